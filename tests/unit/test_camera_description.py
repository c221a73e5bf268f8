"""One description of a camera: what the renderer draws is where the companion, and OpenCV, expect it."""

import math
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sitl_emu.core.attitude import heading, product, quaternion
from sitl_emu.missions.companion import calibration, camera_model
from sitl_emu.missions.companion.camera_model import CameraModel, camera_pose, project
from sitl_emu.missions.companion.geolocation import on_level_ground, pixel_ray
from sitl_emu.missions.companion.options import Options
from sitl_emu.run import cameras, models
from sitl_emu.run.configs import CameraDescription
from sitl_emu.vehicles import image_sensor
from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.lens import (
    MAST,
    NADIR,
    Distortion,
    Intrinsics,
    LensError,
    Mount,
    source_of,
    undistorted,
    zoomed_source,
)  # fmt: skip
from tests.typed import present
from tests.unit.test_scenario_settings import scenario

WIDE = Distortion(-0.15, 0.02, 0.0006, -0.0004, 0.0)
"""Of the size that a wide-angle lens of 90 degrees has: a barrel."""
PINCUSHION = Distortion(0.12, 0.02, 0.0, 0.0, 0.0)
UP_M = 15.0
Array = npt.NDArray[np.float64]


class Dots:
    """A scene of white dots on black, level ground."""

    seed = 1
    moves = False

    def __init__(self, dots_m: list[tuple[float, float]]) -> None:
        self.dots_m = dots_m

    def ground_m(self, north_m: float, east_m: float) -> float:
        return 0.0

    def renderer(self, width: int, height: int, focal_px: float) -> "DotRenderer":
        return DotRenderer(self.dots_m, width, height, focal_px)


class DotRenderer:
    """A pinhole, drawn by OpenCV: it knows of no lens."""

    def __init__(self, dots_m: list[tuple[float, float]], width: int, height: int, focal_px: float) -> None:
        self.dots_m, self.shape, self.focal_px = dots_m, (height, width, 3), focal_px

    def draw(
        self, position_ned_m: Array, camera_to_ned: Array, time_s: float, zoom: float = 1.0
    ) -> npt.NDArray[np.uint8]:
        picture, focal = np.zeros(self.shape, np.uint8), self.focal_px * zoom
        for north, east in self.dots_m:
            x, y, z = camera_to_ned.T @ (np.array((north, east, 0.0)) - position_ned_m)
            at = [x / z * focal + (self.shape[1] - 1) / 2, y / z * focal + (self.shape[0] - 1) / 2]
            centre = (round(at[0] * 16), round(at[1] * 16))
            cv2.circle(picture, centre, 4 * 16, (255, 255, 255), -1, cv2.LINE_AA, 4)
        return picture


@pytest.mark.parametrize("lens", [Distortion(), WIDE, PINCUSHION])
@pytest.mark.parametrize("size", [(640, 480), (320, 256)])
def test_a_dot_appears_where_the_companion_expects_it_and_is_placed_back(
    lens: Distortion, size: tuple[int, int]
) -> None:
    dots = [(north, east) for north in (-6.0, 0.0, 7.0) for east in (-8.0, 0.5, 9.0)]
    seen_by = Intrinsics(*size, 80.0, lens)
    pose = Pose(1.0, -0.5, -UP_M, (math.cos(0.3), 0.0, 0.0, math.sin(0.3)))
    focal = seen_by.focal_px
    model = CameraModel(*size, focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2, camera_model.Distortion(*lens))
    seen_from = camera_pose((1.0, -0.5, -UP_M), pose.q, camera_model.NADIR)
    found = 0
    for dot in dots:
        pixel = present(project(model, seen_from, (*dot, 0.0)))
        if not (8 < pixel[0] < size[0] - 8 and 8 < pixel[1] < size[1] - 8):
            continue
        picture = Camera(Dots([dot]), NADIR, seen_by).render(pose, 0)
        moments = cv2.moments((picture[..., 0] > 100).astype(np.uint8), binaryImage=True)
        x, y = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        assert math.dist((x, y), pixel) < 0.35
        placed = present(on_level_ground(pixel_ray(model, seen_from, x, y), 0.0))
        assert math.dist(placed[:2], dot) < 0.5 * UP_M / focal
        found += 1
    assert found >= 5


@pytest.mark.parametrize("sensor", [None, image_sensor.named(image_sensor.OV5648)])
@pytest.mark.parametrize("lens", [Distortion(), WIDE, PINCUSHION])
def test_a_zoomed_picture_is_where_the_calibration_says_with_so_many_times_its_focal_lengths(
    lens: Distortion, sensor: ImageSensor | None
) -> None:
    """And not where the file itself, which is of no zoom, has it."""
    seen_by, zoom, pose = Intrinsics(320, 240, 80.0, lens), 2.5, Pose(0.0, 0.0, -UP_M, (1.0, 0.0, 0.0, 0.0))
    focal = seen_by.focal_px
    told = CameraModel(320, 240, focal, focal, 159.5, 119.5, camera_model.Distortion(*lens))
    seen_from = camera_pose((0.0, 0.0, -UP_M), pose.q, camera_model.NADIR)
    for dot in ((3.0, -4.0), (-3.2, 4.3), (0.5, 4.4)):
        camera = Camera(Dots([dot]), NADIR, seen_by, sensor=sensor)
        bright = camera.render(pose, 0, zoom=zoom)[..., 0] > 100
        moments = cv2.moments(bright.astype(np.uint8), binaryImage=True)
        at = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        zoomed = told._replace(fx=zoom * told.fx, fy=zoom * told.fy)
        assert math.dist(at, present(project(zoomed, seen_from, (*dot, 0.0)))) < 0.35
        assert math.dist(at, present(project(told, seen_from, (*dot, 0.0)))) > 40.0


@pytest.mark.parametrize("lens", [WIDE, PINCUSHION, Distortion(k1=-0.3, k2=0.09, p1=0.003)])
@pytest.mark.parametrize("zoom", [1.01, 1.7, 4.0])
def test_a_zoomed_pictures_source_is_as_exact_as_one_that_is_worked_out_pixel_by_pixel(
    lens: Distortion, zoom: float
) -> None:
    seen_by = Intrinsics(640, 480, 80.0, lens)
    whole = source_of(seen_by)
    focal, source = zoomed_source(seen_by, zoom, (whole.width, whole.height))
    exact = source_of(seen_by.zoomed(zoom))
    assert 0.9 * zoom < focal <= zoom, "that of the source, which may hold less than a pincushion needs"
    miss_x = (source.map_x - (source.width - 1) / 2.0) * (zoom / focal) - (exact.map_x - (exact.width - 1) / 2.0)
    miss_y = (source.map_y - (source.height - 1) / 2.0) * (zoom / focal) - (exact.map_y - (exact.height - 1) / 2.0)
    assert float(np.hypot(miss_x, miss_y).max()) < 0.05


@pytest.mark.parametrize("lens", [WIDE, PINCUSHION])
def test_the_distortion_is_opencvs(lens: Distortion) -> None:
    model = CameraModel(distortion=camera_model.Distortion(*lens))
    matrix = np.array([[model.fx, 0.0, model.cx], [0.0, model.fy, model.cy], [0.0, 0.0, 1.0]])
    straight = camera_model.CameraPose(np.zeros(3), np.eye(3))
    for place in ((0.3, -0.2, 1.0), (-1.0, 0.6, 1.1), (0.9, 0.7, 1.0)):
        theirs, _ = cv2.projectPoints(np.array([place]), np.zeros(3), np.zeros(3), matrix, np.array(lens))
        ours = present(project(model, straight, place))
        assert ours == pytest.approx(theirs.ravel(), abs=1e-6)
        x, y, _ = model.ray(*ours)
        assert (x, y) == pytest.approx((place[0] / place[2], place[1] / place[2]), abs=1e-6)


@given(
    st.floats(-0.35, 0.35), st.floats(-0.1, 0.1), st.floats(-0.003, 0.003), st.floats(-0.003, 0.003),
    st.floats(-0.02, 0.02), st.integers(0, 63), st.integers(0, 47),
)  # fmt: skip
def test_both_sides_undo_any_lens_that_is_let_pass(
    k1: float, k2: float, p1: float, p2: float, k3: float, column: int, row: int
) -> None:
    lens = Distortion(k1, k2, p1, p2, k3)
    try:
        source_of(Intrinsics(64, 48, distortion=lens))
    except LensError:
        assume(False)
    x, y = (column - 31.5) / 32.0, (row - 23.5) / 32.0
    ours = camera_model.undistorted(x, y, camera_model.Distortion(*lens))
    assert camera_model.distorted(*ours, camera_model.Distortion(*lens)) == pytest.approx((x, y), abs=1e-6)
    theirs = undistorted(np.array(x), np.array(y), lens)
    assert ours == pytest.approx([float(each) for each in theirs], abs=1e-5)


@pytest.mark.parametrize("lens", [Distortion(k1=-0.6), Distortion(k1=-0.2, k2=-0.4), Distortion(k1=-3.0, p1=0.5)])
def test_a_lens_that_folds_the_picture_is_refused(lens: Distortion) -> None:
    with pytest.raises(LensError, match=r"k1 -.* this lens folds the picture over before its corners"):
        source_of(Intrinsics(distortion=lens))


def test_the_file_holds_what_the_renderer_draws(tmp_path: Path) -> None:
    camera = {
        "mount": {"forward_m": 0.1, "down_m": 0.2, "depression_deg": 70},
        "resolution": [1280, 720],
        "hfov_deg": 75,
        "distortion": {"k1": -0.1, "p2": 0.001},
        "rate_hz": 10,
    }
    vehicle = scenario(tmp_path, {"camera": camera}).vehicles[0]
    described = present(vehicle.camera_description)
    cameras.write_calibration(tmp_path / "uas-camera.yaml", described)
    model, mount = calibration.of(Options({"calibration": str(tmp_path / "uas-camera.yaml")}), camera_model.NADIR)
    drawn = cameras.intrinsics(described)
    assert (model.width, model.height, model.distortion) == (1280, 720, (-0.1, 0.0, 0.0, 0.001, 0.0))
    assert (model.fx, model.fy) == (drawn.focal_px, drawn.focal_px), "to the last bit"
    assert tuple(mount) == (*cameras.mount(described), False) == (0.1, 0.0, 0.2, 70.0, False)


def test_a_camera_on_a_gimbal_is_known_as_such_to_all_who_read_its_description(tmp_path: Path) -> None:
    by_data = scenario(tmp_path, {"model": "m600", "camera": {}}).vehicles[0]
    numbers = {"forward_m": 0.1, "down_m": 0.3, "on_gimbal": True}
    by_numbers = scenario(tmp_path, {"model": "m600", "camera": {"mount": numbers}}).vehicles[0]
    for vehicle, place in ((by_data, (0.0, 0.0, 0.15, 0.0)), (by_numbers, (0.1, 0.0, 0.3, 0.0))):
        described = present(vehicle.camera_description)
        assert described.on_gimbal and cameras.mount(described) == place
        cameras.write_calibration(tmp_path / "on.yaml", described)
        assert calibration.read(tmp_path / "on.yaml").mount == (*place, True)
        assert present(models.as_set(vehicle.model_data).camera).mount == "gimbal"
    fixed = scenario(tmp_path, {"model": "m600", "camera": {"mount": "nadir"}}).vehicles[0]
    assert not present(fixed.camera_description).on_gimbal
    assert present(models.as_set(fixed.model_data).camera).mount == "nadir", "and its MAVLink camera says so"


@given(
    roll=st.floats(-0.4, 0.4), pitch=st.floats(-0.4, 0.4), yaw=st.floats(-3.1, 3.1),
    look=st.tuples(st.floats(-0.3, 0.3), st.floats(-1.57, -0.8), st.floats(-1.0, 1.0)),
)  # fmt: skip
@settings(max_examples=25)
def test_what_a_camera_on_a_gimbal_sees_is_where_the_companion_expects_it(
    roll: float, pitch: float, yaw: float, look: tuple[float, float, float]
) -> None:
    """Whatever the body does, the picture follows the gimbal's head; only its place moves with the body."""
    body, told = quaternion(roll, pitch, yaw), quaternion(*look)
    head = product(quaternion(0.0, 0.0, heading(body)), told)
    seen_by, mount = Intrinsics(320, 256, 80.0), camera_model.Mount(0.1, 0.0, 0.3, 0.0, True)
    focal = seen_by.focal_px
    model = CameraModel(320, 256, focal, focal, 159.5, 127.5)
    seen_from = camera_pose((1.0, -0.5, -UP_M), body, mount, head)
    middle = on_level_ground(pixel_ray(model, seen_from, 150.0, 120.0), 0.0)
    assume(middle is not None)
    camera = Camera(Dots([present(middle)[:2]]), Mount(*mount[:4]), seen_by)
    image = camera.render(Pose(1.0, -0.5, -UP_M, body), 0, head)
    rows, columns = np.nonzero(image[..., 0] > 100)
    assert (columns.mean(), rows.mean()) == pytest.approx((150.0, 120.0), abs=0.5)


def test_the_mavlink_camera_says_what_is_rendered(tmp_path: Path) -> None:
    vehicle = scenario(tmp_path, {"camera": {"resolution": [1280, 720], "hfov_deg": 75}}).vehicles[0]
    data = present(models.as_set(vehicle.model_data).camera)
    assert (data.resolution_h_px, data.resolution_v_px, data.frame_rate_hz) == (1280, 720, 15.0)
    assert 2 * math.degrees(math.atan(data.sensor_width_mm / 2 / data.focal_length_mm)) == pytest.approx(75.0)
    assert data.sensor_height_mm / data.sensor_width_mm == pytest.approx(720 / 1280)


def test_what_is_left_out_is_as_in_the_vehicles_data(tmp_path: Path) -> None:
    uas = scenario(tmp_path, {"camera": {}}).vehicles[0]
    assert cameras.intrinsics(present(uas.camera_description)) == Intrinsics()
    assert cameras.mount(present(uas.camera_description)) == NADIR
    ugv = scenario(tmp_path, {"model": "rover", "camera": {}}).vehicles[0]
    assert cameras.mount(present(ugv.camera_description)) == MAST
    assert isinstance(ugv.camera_description, CameraDescription)


@pytest.mark.parametrize(("sensor", "readout_s"), [("plain", 0.0), ("ov5648", 0.0326)])
def test_a_companion_is_told_how_long_its_camera_s_rows_take(tmp_path: Path, sensor: str, readout_s: float) -> None:
    uas = scenario(tmp_path, {"camera": {"sensor": sensor}}).vehicles[0]
    cameras.write_calibration(tmp_path / "uas-camera.yaml", present(uas.camera_description))
    assert calibration.read(tmp_path / "uas-camera.yaml").camera.readout_s == readout_s


def test_files_of_opencvs_own_programs_are_read(tmp_path: Path) -> None:
    """interactive-calibration writes XML with cameraResolution and dist_coeffs, and knows no mount."""
    path = tmp_path / "calibrated.xml"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", np.array([[612.5, 0.0, 330.1], [0.0, 610.2, 244.7], [0.0, 0.0, 1.0]]))
    storage.write("dist_coeffs", np.array([[-0.1, 0.02, 0.001, 0.0, 0.0]]))
    storage.startWriteStruct("cameraResolution", cv2.FILE_NODE_SEQ)
    storage.write("", 640)
    storage.write("", 480)
    storage.endWriteStruct()
    storage.release()
    read = calibration.read(path)
    assert read.mount is None
    lens = camera_model.Distortion(-0.1, 0.02, 0.001, 0.0, 0.0)
    assert read.camera == CameraModel(640, 480, 612.5, 610.2, 330.1, 244.7, lens)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not a file of OpenCV's FileStorage"),
        ("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n", "camera_matrix: missing; a matrix is needed there"),
    ],
)
def test_a_wrong_file_is_told(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=said):
        calibration.read(path)
    with pytest.raises(ValueError, match="there is no such calibration file"):
        calibration.read(tmp_path / "none.yaml")
    with pytest.raises(ValueError, match="option calibration: 5; allowed: the name of a file"):
        calibration.of(Options({"calibration": 5}), camera_model.NADIR)


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ({"mount": "nose"}, "camera.mount: 'nose': known: nadir, mast, gimbal, or {forward_m: …"),
        (
            {"mount": {"forward": 1}},
            "camera.mount.forward: unknown field; allowed here: forward_m, right_m, down_m, dep",
        ),
        ({"mount": "gimbal"}, "camera.mount: on a gimbal: iris carries no gimbal"),
        ({"mount": {"on_gimbal": True}}, "camera.mount: on a gimbal: iris carries no gimbal"),
        ({"mount": 5}, "camera.mount: 5: must be a name, or a mapping with the fields forward_m"),
        ({"resolution": [636, 480]}, "camera.resolution.0: 636: Input should be a multiple of 8"),
        ({"resolution": 640}, "camera.resolution: 640: Input should be a valid"),
        ({"hfov_deg": 180}, "camera.hfov_deg: 180: Input should be less than or equal to 150"),
        ({"distortion": {"k4": 1}}, "camera.distortion.k4: unknown field; allowed here: k1, k2, p1, p2, k3"),
        ({"distortion": {"k1": -0.9}}, "camera.distortion: k1 -0.9: this lens folds the picture over"),
    ],
)
def test_a_wrong_camera_is_told(tmp_path: Path, camera: dict[str, object], said: str) -> None:
    with pytest.raises(Exception, match="vehicles.0." + said.replace("{", r"\{")):
        scenario(tmp_path, {"camera": camera})
