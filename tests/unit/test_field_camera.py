"""The camera is a pure function of seed, time and pose, and its geometry is that of a pinhole."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import camera_model
from sitl_emu.run import views
from sitl_emu.run.export import Eyes
from sitl_emu.run.views import Look
from sitl_emu.world.camera import Camera, OtherVehicle, Pose, ShowsVehicles, body_to_ned, camera_to_body
from sitl_emu.world.description import Light, Thing, Waypoint
from sitl_emu.world.kinds.corn_field import haze, kind
from sitl_emu.world.kinds.corn_field.field import CornField, build
from sitl_emu.world.kinds.corn_field.painter import Layers, orthophoto
from sitl_emu.world.kinds.corn_field.renderer import Renderer
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.kinds.corn_field.visitors import Visitors
from sitl_emu.world.lens import MAST, MOUNTS, NADIR, Intrinsics, Mount
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.world import World


@pytest.fixture(scope="module")
def field() -> CornField:
    return build(7)


@pytest.fixture(scope="module")
def nadir(field: CornField) -> Camera:
    return Camera(FieldScene(field), NADIR, name="uas")


@pytest.fixture(scope="module")
def mast(field: CornField) -> Camera:
    return Camera(FieldScene(field), MAST, name="ugv")


def over(field: CornField, north: float, east: float, height: float, *angles: float) -> Pose:
    return Pose(north, east, -field.terrain.height_m(north, east) - height, quaternion(*(angles or (0.0, 0.0, 0.0))))


class _Marked(Renderer):
    """A renderer of black ground with one white disc."""

    def __init__(self, field: CornField, gsd_m: float, centre: tuple[float, float], radius_m: float) -> None:
        super().__init__(field, 640, 480, 320.0)
        side = 2400
        south, west = centre[0] - side / 2 * gsd_m, centre[1] - side / 2 * gsd_m
        ground = np.zeros((side, side, 4), np.uint8)
        middle = round((side / 2 - 0.5) * 16)
        cv2.circle(ground, (middle, middle), round(radius_m / gsd_m * 16), (255, 255, 255, 0), -1, cv2.LINE_AA, 4)
        self._marked = Layers(ground, np.zeros((8, 8, 4), np.uint8), south, west, gsd_m)

    def ground(self, position: np.ndarray, camera_to_ned: np.ndarray, zoom: float) -> np.ndarray:
        """The disc alone, where the ground is looked up."""
        pixels = self._pixels(self._marked, self._view(position, camera_to_ned, zoom).surfaces[0])
        return np.asarray(cv2.remap(self._marked.ground, pixels, None, cv2.INTER_LINEAR))


@pytest.mark.parametrize(("mount", "zoom"), [("nadir", 1.0), ("nadir", 3.0), ("mast", 1.0), ("mast", 1.5)])
def test_a_disc_on_the_ground_appears_at_its_pinhole_projection(field: CornField, mount: str, zoom: float) -> None:
    rng = np.random.default_rng(3)
    errors = []
    model = camera_model.CameraModel(fx=zoom * 320.0, fy=zoom * 320.0)
    for _ in range(25):
        north, east, yaw = rng.uniform(15, 65), rng.uniform(15, 65), rng.uniform(0, math.tau)
        roll, pitch = rng.normal(scale=0.09, size=2)
        if mount == "nadir":
            d_north, d_east, radius, gsd, height = *(rng.uniform(-11, 11, size=2) / zoom), 0.3, 0.05, 15.0
        else:
            ahead, aside, radius, gsd, height = rng.uniform(0.4 * zoom, 2.5), rng.uniform(-1, 1), 0.05, 0.008, 0.2
            d_north = ahead * math.cos(yaw) - aside * math.sin(yaw)
            d_east = ahead * math.sin(yaw) + aside * math.cos(yaw)
        pose = over(field, north, east, height, roll, pitch, yaw)
        own = MOUNTS[mount]
        rotation = body_to_ned(pose.q)
        position = np.array(pose[:3]) + rotation @ np.array(own[:3])
        spot = (north + d_north, east + d_east)
        # Independent of the renderer: the companion's own pinhole model, and points around the disc's rim.
        seen_from = camera_model.camera_pose(pose[:3], pose.q, camera_model.Mount(*own))
        outline = []
        for angle in np.arange(64) * math.tau / 64:
            at = (spot[0] + radius * math.cos(angle), spot[1] + radius * math.sin(angle))
            pixel = camera_model.project(model, seen_from, (*at, -field.terrain.height_m(*at)))
            assert pixel is not None
            outline.append(pixel)
        if not all(5 < x < 634 and 5 < y < 474 for x, y in outline):
            continue
        picture = _Marked(field, gsd, spot, radius).ground(position, rotation @ camera_to_body(own), zoom)
        moments = cv2.moments(picture[..., 0])
        assert moments["m00"] > 0.0
        shape = cv2.moments(np.array(outline, np.float32)[:, None, :])
        dx = moments["m10"] / moments["m00"] - shape["m10"] / shape["m00"]
        dy = moments["m01"] / moments["m00"] - shape["m01"] / shape["m00"]
        errors.append(math.hypot(dx, dy))
    assert len(errors) >= 10
    assert np.median(errors) < 0.3 and max(errors) < 1.0


@pytest.mark.parametrize("up_m", [6.0, 16.0, 60.0])
def test_what_a_zoomed_camera_shows_is_the_middle_of_the_picture_enlarged(field: CornField, up_m: float) -> None:
    camera = Camera(FieldScene(field), NADIR, name="uas")
    pose, zoom = over(field, 40.0, 41.0, up_m, 0.02, -0.03, 0.6), 2.0
    wide = camera.render(pose, 0)[120:360, 160:480]
    near = cv2.resize(camera.render(pose, 0, zoom=zoom), (320, 240), interpolation=cv2.INTER_AREA)
    grey = [each.mean(axis=2) for each in (wide, near)]
    fine = [cv2.GaussianBlur(each, (0, 0), 1.0) - cv2.GaussianBlur(each, (0, 0), 12.0) for each in grey]
    for part in np.s_[:120, :160], np.s_[:120, 160:], np.s_[120:, :160], np.s_[120:, 160:]:
        window = cv2.createHanningWindow((160, 120), cv2.CV_64F)
        before, after = (np.ascontiguousarray(each[part]) for each in fine)
        shift, _ = cv2.phaseCorrelate(before, after, window)
        assert math.hypot(*shift) < 1.0, "the corners, too, are where they were"
    assert np.array_equal(camera.render(pose, 0)[120:360, 160:480], wide), "and back"


def test_a_weed_patch_of_the_field_appears_where_it_is(field: CornField, nadir: Camera) -> None:
    """The real picture too: the patch's pixels differ from the same field's without its objects."""
    bare = Camera(FieldScene(replace(field, objects=())), NADIR, name="uas")
    for target in field.targets:
        pose = over(field, target.north_m - 3.0, target.east_m + 2.0, 14.0, 0.05, -0.04, 0.7)
        difference = cv2.absdiff(nadir.render(pose, 1), bare.render(pose, 1)).max(axis=2)
        seen_from = camera_model.camera_pose(pose[:3], pose.q, camera_model.NADIR)
        ground = -field.terrain.height_m(target.north_m, target.east_m) - 0.2
        pixel = camera_model.project(camera_model.CameraModel(), seen_from, (target.north_m, target.east_m, ground))
        assert pixel is not None
        changed = np.argwhere(difference > 30)
        near = changed[np.hypot(changed[:, 1] - pixel[0], changed[:, 0] - pixel[1]) < 1.3 * target.radius_m * 320 / 14]
        assert len(near) > 20
        y, x = near.mean(axis=0)
        assert math.hypot(x - pixel[0], y - pixel[1]) < 0.35 * target.radius_m * 320 / 14 + 2.0


def test_a_frame_depends_on_seed_time_and_pose_alone(field: CornField, nadir: Camera, mast: Camera) -> None:
    high, low = over(field, 30, 40, 15, 0.02, 0.03, 1.0), over(field, 33, 44, 0.2, 0.0, 0.0, 0.4)
    first = [nadir.render(high, 66_666), mast.render(low, 66_666)]
    # Elsewhere meanwhile, so that the mosaic of near tiles is another one and built in another order.
    for north in (20.0, 37.0, 60.0):
        nadir.render(over(field, north, 40, 15, 0, 0, 0), 5)
        mast.render(over(field, north, 44, 0.2, 0, 0, 2.0), 5)
    assert np.array_equal(nadir.render(high, 66_666), first[0])
    assert np.array_equal(mast.render(low, 66_666), first[1])
    fresh = Camera(FieldScene(build(7)), MAST, name="ugv")
    assert np.array_equal(fresh.render(low, 66_666), first[1])
    assert not np.array_equal(nadir.render(high, 133_332), first[0]), "noise must change with time"
    assert not np.array_equal(Camera(FieldScene(build(8)), MAST, name="ugv").render(low, 66_666), first[1])


def test_frames_look_like_a_field(field: CornField, nadir: Camera, mast: Camera) -> None:
    for camera, height in ((nadir, 15.0), (mast, 0.2)):
        frame = camera.render(over(field, 40, 30, height, 0, 0, 0), 0)
        assert frame.shape == (480, 640, 3) and frame.dtype == np.uint8
        b, g, r = (frame[..., c].astype(int) for c in range(3))
        green = (2 * g - r - b) > 20
        assert 0.1 < green.mean() < 0.9
        assert 40 < frame.mean() < 180 and frame.std() > 12


def test_top_of_the_picture_is_forward(field: CornField, nadir: Camera) -> None:
    """Flying north at the south edge, what lies ahead is corn and what lies behind is not."""
    frame = nadir.render(over(field, 3.0, 40.0, 8.0, 0, 0, 0), 0).astype(int)
    green = 2 * frame[..., 1] - frame[..., 0] - frame[..., 2] > 25
    assert green[:200].mean() > 0.2 > green[300:400].mean()


def test_extreme_poses_give_a_picture(field: CornField, nadir: Camera) -> None:
    for pose in (
        over(field, 0, 0, 0.05, 0, 0, 0),
        over(field, 40, 40, 100.0, 0.6, -0.5, 3.0),
        over(field, -300, 500, 15.0, 0, 0, 0),
        Pose(40, 40, 30.0, (1.0, 0.0, 0.0, 0.0)),
        over(field, 40, 40, 10.0, 1.6, 0.0, 0.0),
    ):
        assert nadir.render(pose, 0).shape == (480, 640, 3)


def test_orthophoto_covers_the_outline_north_up(field: CornField) -> None:
    picture = orthophoto(field, 0.2)
    assert picture.shape == (400, 400, 3)


def test_sizes_must_fit_the_grid(field: CornField) -> None:
    with pytest.raises(ValueError, match="multiples of 8"):
        Camera(FieldScene(field), Mount(0, 0, 0, 90), Intrinsics(width=636))


def test_both_sides_of_the_link_agree_on_mounts() -> None:
    """The companion's data of its camera is the world's: they may not import each other."""
    assert camera_model.NADIR[:4] == tuple(NADIR) and camera_model.MAST[:4] == tuple(MAST)
    plain, drawn = camera_model.CameraModel(), Intrinsics()
    assert (plain.width, plain.height) == (drawn.width, drawn.height)
    assert tuple(plain.distortion) == tuple(drawn.distortion)
    assert plain.fx == plain.fy == pytest.approx(drawn.focal_px, rel=1e-12)
    assert (plain.cx, plain.cy) == ((drawn.width - 1) / 2, (drawn.height - 1) / 2)


def test_other_vehicles_are_seen_where_they_are_with_their_shadows(field: CornField) -> None:
    scene = FieldScene(field)
    assert isinstance(scene, ShowsVehicles)
    above = over(field, 40.0, 30.0, 14.0)
    drawn = scene.renderer(640, 480, 320.0)
    place, down = np.array(above[:3]), body_to_ned(above.q) @ camera_to_body(NADIR)
    empty = drawn.draw(place, down)
    moves = [scene.moves]
    iris = OtherVehicle("iris", vehicles.load("iris"), over(field, 43.0, 32.0, 6.0, 0.0, 0.0, 0.5), turning=True)
    scene.put_vehicles([iris])
    assert [*moves, scene.moves] == [False, True]
    seen = drawn.draw(place, down)
    changed = (seen != empty).any(axis=2)
    depth = iris.pose.down_m - above.down_m
    body = 320.0 + 320.0 * 2.0 / depth, 240.0 - 320.0 * 3.0 / depth
    y, x = np.nonzero(changed)
    near = np.hypot(x - body[0], y - body[1]) < 30.0
    assert (x[near].mean(), y[near].mean()) == pytest.approx(body, abs=4.0)
    # The shadow lies where the sun's ray through the body meets the ground
    light = field.light
    away = 6.0 / math.tan(math.radians(light.elevation_deg))
    north = 43.0 - away * math.cos(math.radians(light.azimuth_deg))
    east = 32.0 - away * math.sin(math.radians(light.azimuth_deg))
    depth = -field.terrain.height_m(north, east) - above.down_m
    shadow = 320.0 + 320.0 * (east - 30.0) / depth, 240.0 - 320.0 * (north - 40.0) / depth
    darker = (empty.astype(int) - seen).sum(axis=2) > 40
    y, x = np.nonzero(darker & (np.hypot(*np.meshgrid(np.arange(640) - body[0], np.arange(480) - body[1])) > 30.0))
    assert len(x) > 30 and (x.mean(), y.mean()) == pytest.approx(shadow, abs=5.0)
    assert (drawn.draw(place, down, 0.0011) != seen).any(), "blades have turned"
    scene.put_vehicles([])
    assert np.array_equal(drawn.draw(place, down), empty)


def test_plants_hide_a_vehicle_that_stands_behind_them(field: CornField) -> None:
    visitors = Visitors(field)
    drawn = Renderer(field, 640, 480, 320.0, visitors=visitors)
    row = min(field.row_east_m, key=lambda east: abs(east - 30.0))

    def share_shown(east: float) -> float:
        """Of a rover 6 m ahead of a camera 0.3 m over ground, whose way lies at `east`."""
        eye = over(field, 40.0, east, 0.3)
        place, ahead = np.array(eye[:3]), body_to_ned(eye.q) @ camera_to_body(Mount(0.0, 0.0, 0.0, 0.0))
        visitors.put([])
        empty = drawn.draw(place, ahead)
        visitors.put([OtherVehicle("ugv", vehicles.load("rover"), over(field, 46.0, east, 0.2), turning=False)])
        vehicle = visitors.at(0.0)
        assert vehicle is not None
        among = drawn.draw(place, ahead)
        alone = visitors.draw(empty.copy(), Pinhole(place, ahead, 320.0, 640, 480), vehicle, None)
        shown, whole = (int((picture != empty).any(axis=2).sum()) for picture in (among, alone))
        return shown / whole

    assert share_shown(row) < 0.1 and share_shown(row + 0.375) > 0.4


def with_things(*things: Thing) -> World:
    """The corn field of a seed with things beside its patches."""
    made = kind.generate(7, {})
    described = replace(made.description, things=(*made.description.things, *things))
    return World(described, Path(), made.terrain)


def test_things_of_a_world_file_are_in_the_picture_where_the_truth_has_them() -> None:
    truck, sign = Thing("truck", 42.0, 33.0, 3.0, 2.8), Thing("stop sign", 38.0, 29.0, 0.4, 2.2)
    world, lens = with_things(truck, sign), Intrinsics(320, 240)
    bare = with_things().scene().renderer(320, 240, lens.focal_px)
    look = views.view_of(world, Look("", 40.0, 31.0, 14.0, 0.0, 90.0), 0.0)
    picture, _, found = Eyes(world, lens, ("truck",)).look(look)
    changed = (picture != bare.draw(look.place_ned_m, look.camera_to_ned, 0.0)).any(axis=2)
    (seen,) = found
    assert changed[seen.mask].mean() > 0.95, "where the truth has it, there is something"
    labels = [each.seen.label for each in Eyes(world, lens, ("truck", "stop sign")).look(look)[2]]
    assert sorted(labels) == ["stop sign", "truck"]
    assert not world.scene().moves


def test_a_thing_with_a_path_is_seen_where_it_is_then() -> None:
    walking = Thing("car", 38.0, 30.0, 2.2, 1.5, path=(Waypoint(0.0, 38.0, 30.0), Waypoint(10.0, 48.0, 30.0)))
    scene, bare = with_things(walking).scene(), with_things().scene()
    assert scene.moves and not bare.moves
    look = views.view_of(with_things(), Look("", 43.0, 30.0, 16.0, 0.0, 90.0), 0.0)
    at = look.place_ned_m, look.camera_to_ned
    empty, rows = bare.renderer(320, 240, 160.0).draw(*at, 0.0), []
    for time_s in (0.0, 4.0, 8.0):
        changed = scene.renderer(320, 240, 160.0).draw(*at, time_s) != empty
        rows.append(np.nonzero(changed.any(axis=2))[0].mean())
    assert np.diff(rows) == pytest.approx(-4.0 * 160.0 / 15.5, abs=3.0), "4 m to the north, a little above the ground"


# --- haze -------------------------------------------------------------------------------------------------------------


def in_air(world: World, visibility_m: float) -> World:
    described = replace(world.description, light=replace(world.description.light, visibility_m=visibility_m))
    return World(described, world.folder, world.terrain)


def test_a_stop_sign_has_its_letters() -> None:
    sign = Thing("stop_sign", 40.0, 40.0, 0.4, height_m=2.4, heading_deg=180.0)
    world = with_things(sign)
    look = views.view_of(world, Look("", 38.0, 40.0, 2.0, 0.0, 0.0), 0.0)
    seen = world.scene().renderer(320, 240, 160.0).draw(look.place_ned_m, look.camera_to_ned, 0.0)
    blue, green, red = (channel.astype(int) for channel in cv2.split(seen[90:150, 130:190]))
    face = (red > 60) & (red > 3 * green)
    rows, columns = np.nonzero(face)
    within = slice(rows.min() + 6, rows.max() - 5), slice(columns.min() + 6, columns.max() - 5)
    is_print = (abs(red - blue) < 40) & (red > 60)
    assert 0.1 < is_print[within].mean() < 0.4, "within its rim"


def test_haze_lies_before_ground_plants_and_things_as_their_distance_says() -> None:
    truck = Thing("truck", 60.0, 40.0, 3.5, height_m=3.0)
    world, visibility_m = with_things(truck), 90.0
    clear, hazy = (in_air(world, each).scene().renderer(320, 240, 160.0) for each in (1e6, visibility_m))
    horizon = haze.of(kind.field_of(in_air(world, visibility_m))).bgr.astype(float) ** 2
    low, high = Look("", 46.0, 40.0, 2.0, 0.0, 0.0), Look("", 50.0, 50.0, 40.0, 0.0, 90.0)
    for look, part, away_m in (
        (low, np.s_[110:118, 155:165], 60.0 - 3.5 - 46.0),
        (low, np.s_[220:240, 100:220], 2.0 / math.sin(math.atan(110 / 160))),
        (high, np.s_[110:130, 150:170], 40.0),
    ):
        view = views.view_of(world, look, 0.0)
        here, there = (
            each.draw(view.place_ned_m, view.camera_to_ned, 0.0)[part].astype(float) ** 2 for each in (clear, hazy)
        )
        left = (there - horizon).mean() / (here - horizon).mean()
        x = 3.0 * away_m / visibility_m
        assert left == pytest.approx(1.0 / (1.0 + x + x**2 / 2.0 + x**3 / 6.0), abs=0.04), look


def test_a_survey_on_a_clear_day_sees_none_of_it() -> None:
    world = with_things()
    view = views.view_of(world, Look("", 40.0, 40.0, 15.0, 0.0, 90.0), 0.0)
    clear, hazy = (
        in_air(world, each).scene().renderer(320, 240, 160.0).draw(view.place_ned_m, view.camera_to_ned, 0.0)
        for each in (1e6, Light().visibility_m)
    )
    assert np.array_equal(clear, hazy)
