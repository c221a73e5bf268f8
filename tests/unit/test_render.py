"""The renderer: where things appear, how far away they are, what they are, and that its bytes are always the same."""

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import camera_model
from sitl_emu.world.camera import Camera, OtherVehicle, Pose, ShowsVehicles, body_to_ned, camera_to_body
from sitl_emu.world.description import read
from sitl_emu.world.lens import Distortion, Intrinsics, Mount
from sitl_emu.world.render import edges, furniture, model, surface_mesh, terrain_mesh, vehicle_mesh
from sitl_emu.world.render.scene import MeshRenderer, MeshScene
from sitl_emu.world.terrain import HeightMap, hills
from sitl_emu.world.world import World
from tests import embree

F64 = npt.NDArray[np.float64]
DOWN = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
"""Straight down, the picture's top in the north."""
NOWHERE = Path()

ROOF = [[-6.4, -7.4, 0], [-6.4, 7.4, 0], [6.4, 7.4, 0], [6.4, -7.4, 0], [0, -7.4, 4], [0, 7.4, 4]]
TOWN: dict[str, Any] = {
    "name": "town",
    "seed": 3,
    "ground": {"use": "grass", "land": [{"use": "asphalt", "polygon_m": [[-60, 20], [60, 20], [60, 28], [-60, 28]]}]},
    "solids": [
        {"name": "flats", "north_m": 30, "east_m": 5, "heading_deg": 20, "box": {"size_m": [16, 12, 10]}},
        {"name": "house", "north_m": 8, "east_m": 42, "box": {"size_m": [12, 14, 6]}},
        {"name": "roof", "north_m": 8, "east_m": 42, "above_ground_m": 6, "label": "roof", "hull": {"points_m": ROOF}},
        {"name": "wall", "north_m": -8, "east_m": 10, "label": "wall", "box": {"size_m": [0.4, 12, 2]}},
        {"name": "silo", "north_m": 5, "east_m": 12, "label": "silo", "cylinder": {"radius_m": 2, "height_m": 8}},
        {
            "name": "rock", "north_m": -12, "east_m": 30, "label": "rock", "pitch_deg": 20,
            "hull": {"points_m": np.random.default_rng(5).normal(size=(14, 3)).round(3).tolist()},
        },
    ],
    "things": [
        {"label": "car", "north_m": 0, "east_m": 24, "radius_m": 2.2, "height_m": 1.5},
        {"label": "person", "north_m": 6, "east_m": 19, "radius_m": 0.3, "height_m": 1.8},
        {"label": "tree", "north_m": -20, "east_m": 8, "radius_m": 2.5, "height_m": 8},
    ],
    "water": [{"name": "pond", "polygon_m": [[-40, -30], [-10, -35], [5, -20], [-20, -12]], "level_m": 0.02}],
}  # fmt: skip
VIEWS = {
    "nadir 20 m": (10.0, 20.0, 20.0, 0.0, 90.0),
    "nadir 60 m": (10.0, 10.0, 60.0, 0.0, 90.0),
    "oblique": (-40.0, -10.0, 22.0, 40.0, 40.0),
    "street": (-30.0, 24.0, 2.5, 0.0, 5.0),
}
"""North, east, height, heading and degrees below the horizon."""


def looking(north: float, east: float, up: float, heading_deg: float, depression_deg: float) -> tuple[F64, F64]:
    """A camera's place and its axes in NED."""
    h, p = math.radians(heading_deg), math.radians(depression_deg)
    ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
    right = np.array((-math.sin(h), math.cos(h), 0.0))
    return np.array((north, east, -up)), np.stack((right, np.cross(ahead, right), ahead), axis=1)


def world_of(**fields: Any) -> World:
    return World(read({"name": "x", **fields}, "x"), NOWHERE)


@pytest.fixture(scope="module")
def town() -> World:
    return World(read(TOWN, "town"), NOWHERE)


@pytest.fixture(scope="module")
def scene(town: World) -> MeshScene:
    return MeshScene(town, NOWHERE)


@pytest.fixture(scope="module")
def renderer(scene: MeshScene) -> MeshRenderer:
    return scene.renderer(640, 480, 320.0)


# --- where things appear ----------------------------------------------------------------------------------------------

MOUNT = Mount(0.1, 0.05, 0.1, 90.0)
DISC_VIEWS = [  # height m, degrees below the horizon, disc's radius m, and how far ahead of the camera's foot it lies
    (0.5, 90.0, 0.03, 0.1),
    (2.0, 90.0, 0.15, 0.5),
    (15.0, 90.0, 0.6, 4.0),
    (60.0, 90.0, 3.0, -20.0),
    (120.0, 90.0, 6.0, 50.0),
    (1.8, 60.0, 0.12, 1.2),
    (10.0, 40.0, 0.8, 9.0),
    (30.0, 25.0, 4.0, 55.0),
    (2.0, 8.0, 0.6, 8.0),
]


@pytest.mark.parametrize(("height_m", "depression_deg", "radius_m", "ahead_m"), DISC_VIEWS)
@pytest.mark.parametrize("lens", [Distortion(), Distortion(k1=-0.12, k2=0.02, p1=0.001, p2=-0.002)])
def test_a_disc_on_the_ground_appears_where_the_companions_camera_model_says(
    height_m: float, depression_deg: float, radius_m: float, ahead_m: float, lens: Distortion
) -> None:
    """White on dark ground: the middle of what is bright, against points around the rim, by another's formulas."""
    yaw, roll, pitch = 0.6, 0.03, -0.02
    north, east = 3.0 + ahead_m * math.cos(yaw), -2.0 + ahead_m * math.sin(yaw)
    disc = {"label": "disc", "north_m": north, "east_m": east, "radius_m": radius_m, "colour": [1.0, 1.0, 1.0]}
    world = world_of(things=[disc], ground={"colour": [0.02, 0.02, 0.02]})
    mount = MOUNT._replace(depression_deg=depression_deg)
    intrinsics = Intrinsics(640, 480, 90.0, lens)
    pose = Pose(3.0, -2.0, -height_m, quaternion(roll, pitch, yaw))
    picture = Camera(MeshScene(world, NOWHERE), mount, intrinsics).render(pose, 0)
    model_ = camera_model.CameraModel(640, 480, 320.0, 320.0, 319.5, 239.5, camera_model.Distortion(*lens))
    seen_from = camera_model.camera_pose(pose[:3], pose.q, camera_model.Mount(*mount))
    rim = []
    for angle in np.arange(96) * math.tau / 96:
        at = (north + radius_m * math.cos(angle), east + radius_m * math.sin(angle), 0.0)
        pixel = camera_model.project(model_, seen_from, at)
        assert pixel is not None and 3 < pixel[0] < 636 and 3 < pixel[1] < 476, "the view is chosen so that it is seen"
        rim.append(pixel)
    outline = cv2.moments(np.array(rim, np.float32)[:, None, :])
    low, high = np.floor(np.min(rim, axis=0)).astype(int) - 3, np.ceil(np.max(rim, axis=0)).astype(int) + 4
    part = picture[low[1] : high[1], low[0] : high[0], 1].astype(np.float32)
    bright = cv2.moments(np.clip(part - 90.0, 0.0, 90.0))
    assert bright["m00"] > 0.0
    dx = bright["m10"] / bright["m00"] + low[0] - outline["m10"] / outline["m00"]
    dy = bright["m01"] / bright["m00"] + low[1] - outline["m01"] / outline["m00"]
    assert math.hypot(dx, dy) < 0.5


def test_a_patch_follows_the_ground_and_what_moves_is_where_its_path_says() -> None:
    rng = np.random.default_rng(4)
    terrain = hills(rng, (-30.0, 30.0), (-30.0, 30.0), 5.0, (20.0, 20.0))
    path = [{"at_s": 0, "north_m": -5, "east_m": 0}, {"at_s": 10, "north_m": 5, "east_m": 4}]
    mat = {"label": "mat", "north_m": 0, "east_m": 0, "radius_m": 1.5, "path": path}
    world = World(read({"name": "x", "things": [mat]}, "x"), NOWHERE, terrain)
    scene = MeshScene(world, NOWHERE)
    assert scene.moves
    looker = scene.renderer(320, 240, 160.0)
    number = scene.names.index("mat")
    for time_s, north, east in ((0.0, -5.0, 0.0), (5.0, 0.0, 2.0), (10.0, 5.0, 4.0)):
        height = terrain.height_m(north, east)
        view = looker.look(np.array((north, east, -height - 12.0)), DOWN, time_s)
        y, x = np.nonzero(view.objects == number)
        assert abs(x.mean() - 159.5) < 1.0 and abs(y.mean() - 119.5) < 1.0
        disc = math.pi * (1.5 * 160.0 / 12.0) ** 2
        assert len(x) == pytest.approx(disc, rel=0.1), "nothing of it is below the ground"
        assert view.depth_m[119, 159] == pytest.approx(12.0, abs=0.02)


# --- what is seen, and how far away -----------------------------------------------------------------------------------


@pytest.mark.parametrize("view", VIEWS)
def test_objects_and_depth_agree_with_embree(scene: MeshScene, renderer: MeshRenderer, view: str) -> None:
    """The same triangles, by rays of another's make."""
    place, rotation = looking(*VIEWS[view])
    seen = renderer.look(place, rotation, 0.0)
    theirs, range_m = embree.seen_by_rays(scene, renderer, place, rotation)
    assert int((theirs != seen.objects).sum()) <= 20
    both = (theirs == seen.objects) & (theirs >= 0)
    error = np.abs(range_m[both] - seen.depth_m[both])
    near = seen.depth_m[both] < 200.0
    assert float(np.mean(error[near] < 1e-3)) > 0.99


@pytest.mark.parametrize("view", VIEWS)
def test_depth_agrees_with_the_rays_of_lidar_and_with_contact(town: World, renderer: MeshRenderer, view: str) -> None:
    """Roofs, walls, rocks and ground, where physics has them; persons, cars and trees have shapes of their own."""
    place, rotation = looking(*VIEWS[view])
    seen = renderer.look(place, rotation, 0.0)
    rows, columns = np.meshgrid(np.arange(6, 480, 12), np.arange(6, 640, 12), indexing="ij")
    picked = rows.ravel(), columns.ravel()
    rays = embree.rays_of(rotation).reshape(480, 640, 3)[picked]
    lengths = np.linalg.norm(rays, axis=1)
    hits = town.raycast(np.tile(place, (len(rays), 1)), rays / lengths[:, None], 0.0, 400.0)
    depth, names = hits.range_m / lengths, np.array(hits.name)
    built = np.isin(names, ["ground", "flats", "house", "roof", "wall", "silo", "rock"]) & np.isfinite(depth)
    shown = np.array([*renderer.scene.names, ""])[seen.objects[picked]]
    both = built & (shown == names)
    assert both.sum() > 0.9 * built.sum()
    error = np.abs(depth[both] - seen.depth_m[picked][both])
    assert float(np.mean(error < 0.05)) > 0.995


def test_roofs_are_as_high_as_contact_has_them(town: World, renderer: MeshRenderer) -> None:
    for north, east, top in ((30.0, 5.0, 10.0), (8.0, 42.0, 10.0), (5.0, 12.0, 8.0)):
        assert town.solids is not None
        surface = town.solids.surface(north, east, -40.0)
        assert surface is not None and surface[0] == pytest.approx(top, abs=0.01)
        seen = renderer.look(np.array((north, east, -40.0)), DOWN, 0.0)
        assert 40.0 - float(seen.depth_m[240, 320]) == pytest.approx(surface[0], abs=0.05)


@pytest.mark.parametrize(("view", "zoom"), [("nadir 20 m", 1.5), ("nadir 60 m", 4.0), ("oblique", 1.3)])
def test_a_zoomed_picture_is_the_middle_of_the_other_enlarged(renderer: MeshRenderer, view: str, zoom: float) -> None:
    place, turn = looking(*VIEWS[view])
    wide, near = (renderer.look(place, turn, 0.0, zoom=each) for each in (1.0, zoom))
    height, width = wide.objects.shape
    rows, columns = ((np.arange(side) + 0.5 - side / 2) / zoom + side / 2 for side in (height, width))
    there = np.ix_(rows.astype(int), columns.astype(int))
    assert np.mean(near.objects == wide.objects[there]) > 0.97
    assert np.median(np.abs(near.depth_m - wide.depth_m[there])) < 0.1
    assert np.array_equal(renderer.look(place, turn, 0.0).picture, wide.picture), "and back"


def test_a_thing_in_the_picture_grows_by_the_zoom() -> None:
    flat = {"name": "slab", "label": "slab", "north_m": 1, "east_m": -2, "box": {"size_m": [4, 5, 0.1]}}
    scene = MeshScene(world_of(solids=[flat]), NOWHERE)
    place, turn = looking(0.0, 0.0, 40.0, 30.0, 90.0)
    sizes = []
    for zoom in (1.0, 2.0, 3.5):
        seen = scene.renderer(640, 480, 320.0).look(place, turn, 0.0, zoom=zoom)
        sizes.append(np.ptp(np.argwhere(seen.objects == scene.labels.index("slab")), axis=0) + 1.0)
    for size, zoom in zip(sizes[1:], (2.0, 3.5), strict=True):
        assert np.abs(size - zoom * sizes[0]).max() <= 1.0 + zoom, "a pixel at each edge"


def test_the_sky_is_far_and_nobodys_and_the_horizon_is_level(renderer: MeshRenderer) -> None:
    seen = renderer.look(*looking(-200.0, 0.0, 3.0, 180.0, 0.0), 0.0)
    sky = seen.objects == -1
    assert np.isinf(seen.depth_m[sky]).all() and not np.isinf(seen.depth_m[~sky]).any()
    assert sky[:239].all() and not sky[241:].any(), "land to the horizon, and nothing else"
    blue, _, red = seen.picture[20, 320]
    assert int(blue) > int(red) + 30


def test_hills_show_no_gaps_between_levels_of_detail() -> None:
    terrain = hills(np.random.default_rng(2), (-120.0, 120.0), (-120.0, 120.0), 14.0, (80.0, 80.0))
    world = World(read({"name": "x"}, "x"), NOWHERE, terrain)
    looker = MeshScene(world, NOWHERE).renderer(640, 480, 320.0)
    for heading in (0.0, 75.0, 190.0):
        up = terrain.height_m(-60.0, -50.0) + 12.0
        seen = looker.look(*looking(-60.0, -50.0, up, heading, 30.0), 0.0)
        below = seen.objects[240:]
        assert (below == 0).all(), "the picture's lower half is all ground"
        rays = (
            embree.rays_of(looking(0, 0, 0, heading, 30.0)[1])
            .reshape(480, 640, 3)[250:470:20, 10:630:20]
            .reshape(-1, 3)
        )
        lengths = np.linalg.norm(rays, axis=1)
        hits = world.raycast(np.tile((-60.0, -50.0, -up), (len(rays), 1)), rays / lengths[:, None], 0.0, 300.0)
        depth = seen.depth_m[250:470:20, 10:630:20].ravel()
        met = np.isfinite(hits.range_m)
        error = np.abs(hits.range_m / lengths - depth)[met] / depth[met]
        assert float(np.percentile(error, 99)) < 0.01


def test_no_gap_shows_where_the_height_map_ends() -> None:
    """Its last row rises and falls within what the far land, with its coarser lines, has as one straight line."""
    wavy = np.repeat(0.4 * np.sin(np.arange(61.0) / 3.0)[:, None], 61, axis=1)
    world = World(read({"name": "x"}, "x"), NOWHERE, HeightMap(wavy, -60.0, -60.0, 2.0))
    looker = MeshScene(world, NOWHERE).renderer(640, 480, 320.0)
    for heading in (90.0, 270.0):
        seen = looker.look(*looking(0.0, 0.0, 16.0, heading, 20.0), 0.0)
        assert (seen.objects[240:] == 0).all() and np.isfinite(seen.depth_m[160:]).all()


# --- light ------------------------------------------------------------------------------------------------------------


def test_a_wall_throws_a_shadow_away_from_the_sun() -> None:
    wall = {"name": "wall", "north_m": 0, "east_m": 0, "label": "wall", "box": {"size_m": [0.4, 12, 3]}}
    world = world_of(solids=[wall], light={"azimuth_deg": 180, "elevation_deg": 45}, ground={"use": "concrete"})
    looker = MeshScene(world, NOWHERE).renderer(320, 240, 160.0)
    picture = looker.draw(np.array((0.0, 0.0, -12.0)), DOWN, 0.0)[:, :, 1].astype(float)
    per_m = 160.0 / 12.0
    shaded, sunny = (picture[round(120 - n * per_m), 110:210].mean() for n in (2.0, -2.0))
    assert shaded < 0.7 * sunny, "the sun stands in the south, the shadow lies to the north, 3 m long"
    assert picture[round(120 - 4.5 * per_m), 110:210].mean() > 0.9 * sunny


def test_edges_are_smooth() -> None:
    """A white roof on black ground, turned a little: along its edge there are greys, and no jumps of a whole pixel."""
    box = {"name": "b", "north_m": 0, "east_m": 0, "heading_deg": 5, "label": "tank", "colour": [1, 1, 1],
           "box": {"size_m": [6, 40, 0.02]}}  # fmt: skip
    looker = MeshScene(world_of(solids=[box], ground={"colour": [0, 0, 0]}), NOWHERE).renderer(320, 240, 160.0)
    picture = looker.draw(np.array((0.0, 0.0, -10.0)), DOWN, 0.0)[:, :, 1].astype(float)
    covered = np.clip((picture[50:95, 60:260] - 20.0) / 210.0, 0.0, 1.0).sum(axis=0)
    columns = np.arange(len(covered))
    slope, start = np.polyfit(columns, covered, 1)
    assert abs(slope) == pytest.approx(math.tan(math.radians(5.0)), abs=0.005)
    assert np.abs(covered - slope * columns - start).max() < 0.2, "no stairs"


@pytest.mark.parametrize("view", VIEWS)
def test_edges_are_nearer_to_a_picture_of_sixteen_times_the_pixels(
    scene: MeshScene, view: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At borders, root of mean square; what they are and how far away, is of centres still."""
    place, axes = looking(*VIEWS[view])
    looker = scene.renderer(320, 240, 160.0)
    smooth = looker.look(place, axes, 0.0)
    fine = scene.renderer(1280, 960, 640.0).look(place, axes, 0.0)
    monkeypatch.setattr(edges, "smoothed", lambda seen, drawn, meshes, kinds, picture: picture.colour)
    hard = looker.look(place, axes, 0.0)
    exact = cv2.resize(fine.picture, (320, 240), interpolation=cv2.INTER_AREA).astype(float)
    objects = fine.objects.reshape(240, 4, 320, 4)
    at_edge = objects.max(axis=(1, 3)) != objects.min(axis=(1, 3))
    off, before = (np.sqrt(((each.picture - exact)[at_edge] ** 2).mean()) for each in (smooth, hard))
    assert off < 0.8 * before
    assert np.array_equal(smooth.objects, hard.objects) and np.array_equal(smooth.depth_m, hard.depth_m)


# --- other vehicles ---------------------------------------------------------------------------------------------------


def test_other_vehicles_are_seen_where_they_are_with_shadows_and_turning_propellers() -> None:
    scene = MeshScene(world_of(ground={"use": "concrete"}, light={"azimuth_deg": 90, "elevation_deg": 45}), NOWHERE)
    shows: object = scene
    assert isinstance(shows, ShowsVehicles)
    moves = [scene.moves]
    looker = scene.renderer(640, 480, 320.0)
    above = np.array((0.0, 0.0, -12.0))
    empty = looker.look(above, DOWN, 0.0)
    iris = OtherVehicle("two", vehicles.load("iris"), Pose(2.0, 1.0, -4.0, quaternion(0.0, 0.0, 0.5)), True)
    scene.put_vehicles([iris])
    seen = looker.look(above, DOWN, 0.0)
    moves.append(scene.moves)
    assert moves == [False, True]
    number = scene.names.index("two")
    assert scene.labels[number] == "vehicle"
    y, x = np.nonzero(seen.objects == number)
    assert (x.mean(), y.mean()) == pytest.approx((320.0 + 320.0 * 1.0 / 8.0, 240.0 - 320.0 * 2.0 / 8.0), abs=2.0)
    assert seen.depth_m[seen.objects == number].mean() == pytest.approx(8.0, abs=0.2)
    darker = empty.picture[:, :, 1].astype(int) - seen.picture[:, :, 1] > 25
    y, x = np.nonzero(darker & (seen.objects != number))
    assert len(x) > 15
    # The sun stands in the east, 45 degrees high: the shadow lies 4 m west of it
    assert (x.mean(), y.mean()) == pytest.approx((320.0 + 320.0 * -3.0 / 12.0, 240.0 - 320.0 * 2.0 / 12.0), abs=4.0)
    later = looker.look(above, DOWN, 0.0011)
    assert 20 < int((later.objects != seen.objects).sum()) < 400, "blades have turned"
    scene.put_vehicles([iris._replace(turning=False)])
    still = [looker.look(above, DOWN, time_s).objects for time_s in (0.0, 0.0011)]
    assert np.array_equal(still[0], still[1])
    scene.put_vehicles([])
    gone = looker.look(above, DOWN, 0.0)
    assert np.array_equal(gone.picture, empty.picture)


@pytest.mark.parametrize("name", vehicles.models())
def test_every_vehicle_has_a_look_of_its_own_size(name: str) -> None:
    look = vehicle_mesh.look_of(vehicles.load(name))
    vehicle = vehicles.load(name)
    assert len(look.propellers) == (len(vehicle.propulsion.rotors) if vehicle.propulsion else 0)
    reach = max([look.body.radius_m, *(float(np.linalg.norm(each.at)) for each in look.propellers)])
    assert 0.15 < reach < 2.5


# --- the same bytes ---------------------------------------------------------------------------------------------------


def digest() -> str:
    """Of pictures, depths and objects of all views of a town that burns."""
    fire = {"name": "f", "polygon_m": [[20, 20], [30, 22], [28, 34]], "smoke": {"height_m": 20}}
    looker = MeshScene(World(read({**TOWN, "fires": [fire]}, "town"), NOWHERE), NOWHERE).renderer(320, 240, 160.0)
    summed = hashlib.sha256()
    for view in VIEWS.values():
        for part in looker.look(*looking(*view), 3.0):
            summed.update(np.ascontiguousarray(part).tobytes())
    return summed.hexdigest()


@pytest.mark.slow
def test_the_same_scene_has_the_same_bytes_also_on_another_kind_of_processor(tmp_path: Path) -> None:
    own = digest()
    assert digest() == own
    here = str(Path(__file__).parent)
    code = f"import sys; sys.path.insert(0, {here!r}); import test_render; print(test_render.digest())"
    environment = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == own


# --- parts ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "made",
    [
        model.box((2.0, 3.0, 4.0), 0),
        model.ellipsoid((1.0, 2.0, 0.5), 0),
        model.lathe(((0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)), 12, 0),
        model.hull([tuple(p) for p in np.random.default_rng(1).normal(size=(40, 3))], 0),
        furniture.person(1.8, (0.5, 0.2, 0.2), 1),
        furniture.car(4.4, (0.2, 0.3, 0.6)),
    ],
)
def test_meshes_look_outwards(made: model.Model) -> None:
    """The volume that closed surfaces enclose is positive: (b - a) x (c - a) looks out."""
    a, b, c = (made.corners[made.triangles[:, k]].astype(float) for k in range(3))
    assert float((a * np.cross(b, c)).sum()) > 0.0


def test_a_hull_is_that_of_its_points() -> None:
    points = np.random.default_rng(7).normal(size=(60, 3))
    triangles = model.hull_triangles(points)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (((points[None] - a[:, None]) * normals[:, None]).sum(axis=2) <= 1e-9).all(), "no point lies outside"
    with pytest.raises(ValueError, match="in a plane"):
        model.hull_triangles(np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]))


def test_a_concave_polygon_is_cut_into_triangles_of_its_area() -> None:
    polygon = [(0.0, 0.0), (30.0, 0.0), (30.0, 20.0), (15.0, 4.0), (0.0, 20.0)]
    corners, triangles = surface_mesh.subdivided(*surface_mesh.triangulated(polygon), 5.0)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    assert (doubled < 0.0).all() and -0.5 * doubled.sum() == pytest.approx(30.0 * 20.0 - 0.5 * 30.0 * 16.0)
    assert max(np.linalg.norm(a - b, axis=1).max(), np.linalg.norm(b - c, axis=1).max()) <= 5.0


def test_coarser_chunks_err_no_more_than_they_say() -> None:
    terrain = hills(np.random.default_rng(3), (0.0, 64.0), (0.0, 64.0), 6.0, (60.0, 60.0))
    assert isinstance(terrain, HeightMap)
    lines = np.arange(0.0, 64.5, 0.5)[:129]
    for chunk in terrain_mesh.chunks(terrain, lines, lines):
        assert chunk.errors[0] == 0.0 and chunk.errors == sorted(chunk.errors)
        coarse = chunk.corners[3][: (terrain_mesh.CHUNK // 8 + 1) ** 2] + np.array(chunk.place)
        wanted = terrain.heights_m(coarse[:, 0], coarse[:, 1])
        assert np.abs(-coarse[:, 2] - wanted).max() < 1e-4, "its own corners lie on the ground"


def test_a_body_camera_sees_what_the_renderer_draws(scene: MeshScene) -> None:
    """Mount and attitude through `camera.Camera`, the horizon where the pitch puts it."""
    camera = Camera(scene, Mount(0.0, 0.0, 0.0, 0.0))
    pose = Pose(-200.0, 0.0, -5.0, quaternion(0.0, math.radians(10.0), math.pi))
    rotation = body_to_ned(pose.q) @ camera_to_body(camera.mount)
    seen = scene.renderer(640, 480, 320.0).look(np.array(pose[:3]), rotation, 0.0)
    rows = np.flatnonzero((seen.objects == -1).all(axis=1))
    assert rows.max() == pytest.approx(240 + 320 * math.tan(math.radians(10.0)), abs=2.0)
    assert camera.render(pose, 0).shape == (480, 640, 3)
