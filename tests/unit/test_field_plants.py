"""What stands in a corn field near a camera: plants of the painter's own leaves, where the painter has them."""

import math

import cv2
import numpy as np
import pytest

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import camera_model
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.kinds.corn_field import plant_mesh, renderer
from sitl_emu.world.kinds.corn_field.crop import KINDS, grow
from sitl_emu.world.kinds.corn_field.field import HEADLAND_M, CornField, build
from sitl_emu.world.kinds.corn_field.painter import tint_of
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.kinds.corn_field.sprites import DRAWN_GSD_M, SPRITES_PER_KIND, draw
from sitl_emu.world.lens import MAST, NADIR

LOOKING_NORTH = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


@pytest.fixture(scope="module")
def field() -> CornField:
    return build(7, (60.0, 60.0))


@pytest.fixture(scope="module")
def scene(field: CornField) -> FieldScene:
    return FieldScene(field)


@pytest.mark.parametrize("kind", SPRITES_PER_KIND)
@pytest.mark.parametrize("level", range(plant_mesh.LEVELS))
def test_a_plant_covers_from_above_what_the_painter_stamps_of_it(field: CornField, kind: str, level: int) -> None:
    kinds = plant_mesh.build(field.seed, field.plant_height_m, tint_of(field), field.light)
    before = list(SPRITES_PER_KIND).index(kind)
    sprite = sum(list(SPRITES_PER_KIND.values())[:before])
    first, last, _, _ = kinds.meshes.levels[kinds.first_level[sprite] + level]
    canvas = draw(field.seed, kind, 0, field.plant_height_m)
    stamped = canvas.mask > 0
    seen = np.zeros(stamped.shape, np.uint8)
    for triangle in kinds.meshes.corners[first:last].reshape(-1, 3, 3):
        spots = np.round(triangle[:, [1, 0]] / DRAWN_GSD_M + canvas.middle).astype(np.int32)
        cv2.fillPoly(seen, [spots], 255)
    both, either = np.count_nonzero(stamped & (seen > 0)), np.count_nonzero(stamped | (seen > 0))
    least = {"residue": 0.3, "litter": 0.3, "weed_grass": 0.35}.get(kind, 0.55) if level else 0.6
    assert both / either > least


def test_a_stalk_rises_from_where_its_plant_is_painted_and_leaves_hang_within_its_height(field: CornField) -> None:
    kinds = plant_mesh.build(field.seed, field.plant_height_m, tint_of(field), field.light)
    first, last, _, _ = kinds.meshes.levels[kinds.first_level[0]]
    corners = kinds.meshes.corners[first:last]
    foot = corners[corners[:, 2] > -1e-6]
    assert len(foot) and np.abs(foot[:, :2]).max() <= plant_mesh.STALK_M + 1e-6
    assert 0.7 * field.plant_height_m < -corners[:, 2].min() < 1.3 * field.plant_height_m


def test_a_plant_is_seen_at_its_pinhole_projection(field: CornField, scene: FieldScene) -> None:
    """The stalk of a plant, from close before it, where a pinhole's model says that it is."""
    plants = grow(field)
    corn = np.flatnonzero((plants.kind == KINDS.index("corn")) & (abs(plants.north_m - 30.0) < 1.0))
    model = camera_model.CameraModel()
    greener = list[float]()
    for one in corn[::40]:
        north, east = float(plants.north_m[one]), float(plants.east_m[one])
        pose = Pose(north - 0.8, east, -field.terrain.height_m(north - 0.8, east) - 0.25, (1.0, 0.0, 0.0, 0.0))
        mount = camera_model.Mount(0.0, 0.0, 0.0, 12.0)
        seen_from = camera_model.camera_pose(pose[:3], pose.q, mount)
        up = 0.4 * field.plant_height_m
        pixel = camera_model.project(model, seen_from, (north, east, -field.terrain.height_m(north, east) - up))
        assert pixel is not None
        s, c = math.sin(math.radians(12.0)), math.cos(math.radians(12.0))
        axes = np.array(((0.0, -s, c), (1.0, 0.0, 0.0), (0.0, c, s)))
        picture = scene.renderer(640, 480, 320.0).draw(np.array(pose[:3]), axes).astype(int)
        x, y = round(pixel[0]), round(pixel[1])
        patch = picture[y - 1 : y + 2, x - 2 : x + 3].reshape(-1, 3).mean(axis=0)
        greener.append(patch[1] - patch[2])
    assert len(greener) >= 3 and np.median(greener) > 15.0


def test_a_camera_that_looks_up_sees_the_sky_and_one_that_looks_ahead_the_land_to_the_horizon(
    field: CornField, scene: FieldScene
) -> None:
    at = np.array((1.0, 30.0, -field.terrain.height_m(1.0, 30.0) - 1.5))
    picture = scene.renderer(640, 480, 320.0).draw(at, LOOKING_NORTH).astype(int)
    sky, ground = picture[:200].reshape(-1, 3), picture[300:].reshape(-1, 3)
    assert (sky[:, 0] >= sky[:, 2]).all() and (sky[:, 0] > 150).all()  # blue, and nothing else
    assert np.mean(ground[:, 0] < ground[:, 2]) > 0.2 and np.mean(ground[:, 1] > ground[:, 2] + 10) > 0.1


@pytest.mark.parametrize("seed", [1, 3, 7])
def test_no_ghost_contours_stand_about_leaves(seed: int) -> None:
    """Contours of a painting, looked up at several heights, left a thousand specks of green in this frame."""
    own = build(seed, (60.0, 60.0))
    pose = Pose(30.0, 30.0, -own.terrain.height_m(30.0, 30.0) - 0.2, quaternion(0.0, 0.0, 0.4))
    picture = Camera(FieldScene(own), MAST, name="ugv").render(pose, 0)
    green = (2 * picture[..., 1].astype(int) - picture[..., 0] - picture[..., 2] > 30).astype(np.uint8)
    _, _, parts, _ = cv2.connectedComponentsWithStats(green)
    assert np.count_nonzero(green) > 50_000
    assert np.count_nonzero(parts[1:, cv2.CC_STAT_AREA] < 12) < 100


def test_the_change_from_meshes_to_painted_plants_is_no_change_of_light(field: CornField, scene: FieldScene) -> None:
    camera = Camera(scene, NADIR, name="uas")
    colours, shares = [], []
    for height in (renderer.STANDING_M - 0.5, renderer.STANDING_M + 0.5):
        pose = Pose(30.0, 30.0, -field.terrain.height_m(30.0, 30.0) - height, (1.0, 0.0, 0.0, 0.0))
        picture = camera.render(pose, 0).astype(float)
        green = 2 * picture[..., 1] - picture[..., 0] - picture[..., 2] > 20
        colours.append(picture[green].mean(axis=0))
        shares.append(float(green.mean()))
    assert np.abs(np.subtract(*colours)).max() < 16.0  # of 255
    assert abs(shares[0] - shares[1]) < 0.2  # paint is a little fatter than a leaf


def test_rows_end_where_the_planter_was_lifted_and_never_on_the_headland(field: CornField) -> None:
    plants = grow(field)
    corn = plants.kind == KINDS.index("corn")
    row = np.round((plants.east_m[corn] - field.row_east_m[0]) / 0.75).astype(int)
    first = np.array([plants.north_m[corn][row == k].min() for k in range(len(field.row_east_m))])
    last = np.array([plants.north_m[corn][row == k].max() for k in range(len(field.row_east_m))])
    assert first.min() > HEADLAND_M - 0.12 and last.max() < field.size_m[0] - HEADLAND_M + 0.12
    assert first.std() > 0.1 and last.std() > 0.1
