"""What a real sensor makes of a picture: rows at their own times, smear, exposure, noise, and what JPEG leaves."""

import dataclasses
import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.core.attitude import heading, product, quaternion
from sitl_emu.run import cameras
from sitl_emu.run.configs import CameraDescription
from sitl_emu.vehicles import record
from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.camera import Camera, Pose, body_to_ned, camera_to_body
from sitl_emu.world.imaging import exposure
from sitl_emu.world.imaging.imager import Imager
from sitl_emu.world.imaging.motion import Drift, Motion, drift, ways
from sitl_emu.world.lens import NADIR, Distortion, Intrinsics, Mount
from tests.typed import present
from tests.unit.test_camera_description import WIDE, Dots
from tests.unit.test_scenario_settings import scenario

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]
LENS = Intrinsics(320, 240, 90.0)
FOCAL_PX = 160.0
AHEAD = Mount(0.0, 0.0, 0.0, 0.0)
BARE = ImageSensor(
    auto_exposure=False, vignetting=0.0, blur_px=0.0, readout_s=0.0, exposure_s=0.0, read_noise_electrons=0.0,
    well_electrons=1e9,
)  # fmt: skip
"""Nothing but what a test adds to it."""


def moving(motion: Motion, mount: Mount = AHEAD, height_m: float = 20.0) -> Drift:
    return drift(motion, np.eye(3), None, camera_to_body(mount), np.zeros(3), height_m)


STILL = moving(Motion())


def light(picture: Image) -> Array:
    return (picture[..., 1] / 255.0) ** 2


def pole(imager: Imager, width_px: int = 5) -> Image:
    """A white pole, upright in the middle of a black picture."""
    drawn = np.zeros((imager.source[1], imager.source[0], 3), np.uint8)
    middle = imager.source[0] // 2
    drawn[:, middle - width_px // 2 : middle + width_px // 2 + 1] = 255
    return drawn


def across(picture: Image) -> tuple[Array, Array]:
    """Mean column and variance of each row's light."""
    seen = light(picture)
    columns = np.arange(seen.shape[1])
    mean = (seen * columns).sum(axis=1) / seen.sum(axis=1)
    return mean, (seen * (columns - mean[:, None]) ** 2).sum(axis=1) / seen.sum(axis=1)


@pytest.mark.parametrize(
    ("mount", "motion", "speed_px_s"),
    [
        (AHEAD, Motion(rate_rad_s=(0.0, 0.0, 0.8)), -0.8 * FOCAL_PX),
        (AHEAD, Motion(rate_rad_s=(0.0, 0.0, -0.8)), 0.8 * FOCAL_PX),
        (NADIR, Motion(velocity_m_s=(0.0, 15.0, 0.0)), -15.0 / 20.0 * FOCAL_PX),
        (NADIR, Motion(rate_rad_s=(0.8, 0.0, 0.0)), 0.8 * FOCAL_PX),
    ],
    ids=["yaw right", "yaw left", "to the right", "roll to the right"],
)
def test_a_rolling_shutter_shears_a_pole_by_how_far_it_moves_while_rows_are_read(
    mount: Mount, motion: Motion, speed_px_s: float
) -> None:
    imager = Imager(LENS, replace(BARE, readout_s=0.04), 1, "uas")
    still, _ = across(imager.picture(pole(imager), moving(Motion(), mount), 0))
    sheared, _ = across(imager.picture(pole(imager), moving(motion, mount), 0))
    middle = slice(100, 140) if mount == AHEAD else slice(0, 240)
    expected = speed_px_s * (np.arange(240) / 239 - 0.5) * 0.04
    assert np.abs((sheared - still) - expected)[middle].max() < 0.1
    assert abs(expected[0] - expected[-1]) > 4.0, "and this is no small thing"


@pytest.mark.parametrize("lens", [Distortion(), WIDE])
def test_a_zoomed_camera_shears_and_smears_by_so_much_more(lens: Distortion) -> None:
    zoom, turning = 3.0, moving(Motion(rate_rad_s=(0.0, 0.0, 0.1)))
    seen_by = LENS._replace(distortion=lens)
    slow, long = (
        Imager(seen_by, each, 1, "uas") for each in (replace(BARE, readout_s=0.04), replace(BARE, exposure_s=0.1))
    )
    rows = slice(80, 160)
    still, sheared = (across(slow.picture(pole(slow), each, 0, zoom))[0] for each in (STILL, turning))
    expected = -0.1 * zoom * FOCAL_PX * (np.arange(240) / 239 - 0.5) * 0.04
    assert np.abs((sheared - still) - expected)[rows].max() < 0.1
    narrow, wide = (across(long.picture(pole(long), each, 0, zoom))[1] for each in (STILL, turning))
    assert np.sqrt(12.0 * (wide - narrow)[rows]) == pytest.approx(0.1 * zoom * FOCAL_PX * 0.1, abs=0.5)


def test_a_global_shutter_shears_nothing() -> None:
    imager = Imager(LENS, BARE, 1, "uas")
    turning = moving(Motion(rate_rad_s=(0.0, 0.0, 2.0)))
    assert np.array_equal(imager.picture(pole(imager), turning, 0), imager.picture(pole(imager), STILL, 0))


@pytest.mark.parametrize("length_px", [3.0, 6.5, 12.0])
@pytest.mark.parametrize("moved", ["turning", "driven"])
def test_motion_smears_by_exposure_time_times_speed(length_px: float, moved: str) -> None:
    speed_px_s = length_px / 0.02
    by_rate = Motion(rate_rad_s=(0.0, 0.0, speed_px_s / FOCAL_PX))
    by_speed = Motion(velocity_m_s=(0.0, speed_px_s / FOCAL_PX * 20.0, 0.0))
    imager = Imager(LENS, replace(BARE, exposure_s=0.02), 1, "uas")
    passing = moving(by_rate) if moved == "turning" else moving(by_speed, NADIR)
    sharp, narrow = across(imager.picture(pole(imager), STILL, 0))
    smeared, wide = across(imager.picture(pole(imager), passing, 0))
    rows = slice(110, 130)
    assert np.abs(smeared - sharp)[rows].max() < 0.15, "the frame's time is the middle of its exposure"
    lengths = np.sqrt(12.0 * (wide - narrow)[rows])
    assert np.abs(lengths - length_px).max() < 0.05 * length_px + 0.1


def test_smear_keeps_the_light() -> None:
    imager = Imager(LENS, replace(BARE, exposure_s=0.02), 1, "uas")
    passing = moving(Motion(rate_rad_s=(0.0, 0.0, 3.0)))
    before, after = (light(imager.picture(pole(imager), each, 0)).sum() for each in (STILL, passing))
    assert after == pytest.approx(before, rel=0.02)


@pytest.mark.parametrize("gain", [1.0, 8.0])
def test_noise_is_that_of_electrons_and_never_the_same_twice(gain: float) -> None:
    sensor = replace(
        ImageSensor(), auto_exposure=False, vignetting=0.0, blur_px=0.0, exposure_s=0.01, exposure_max_s=0.01,
        exposure_ev=math.log2(gain),
    )  # fmt: skip
    imager = Imager(Intrinsics(640, 480), sensor, 1, "uas")
    figure = round(255.0 * math.sqrt(0.2 / gain))
    drawn = np.full((imager.source[1], imager.source[0], 3), figure, np.uint8)
    frames = [imager.picture(drawn, STILL, time_us) for time_us in range(0, 1_000_000, 62_500)]
    bright = (figure / 255.0) ** 2 * gain
    white = 4300.0 * (2592 * 1944 / (640 * 480) / 4.0) / gain
    dark = 1.7 * math.sqrt(2592 * 1944 / (640 * 480) / 4.0) / white
    sigma = 255.0 * math.sqrt(bright / white + dark**2) / (2.0 * math.sqrt(bright))
    for frame in frames[:4]:
        assert frame.mean() == pytest.approx(255.0 * math.sqrt(bright), abs=0.1)
        assert frame.std() == pytest.approx(math.sqrt(sigma**2 + 1.0 / 12.0), rel=0.03)
    noise = np.array([frame.astype(np.float64) - frame.mean() for frame in frames])
    for other in noise[1:]:
        assert abs(np.corrcoef(noise[0].ravel(), other.ravel())[0, 1]) < 0.005
    assert noise.mean(axis=0).std() == pytest.approx(frames[0].std() / math.sqrt(len(frames)), rel=0.03), "no pattern"
    for shift in (1, 2):
        neighbours = np.corrcoef(noise[0][:, shift:].ravel(), noise[0][:, :-shift].ravel())[0, 1]
        assert abs(neighbours) < 0.005
    assert np.array_equal(imager.picture(drawn, STILL, 0), frames[0]), "and the same frame is the same"
    for other_camera in (Imager(Intrinsics(640, 480), sensor, 2, "uas"), Imager(Intrinsics(640, 480), sensor, 1, "b")):
        assert not np.array_equal(other_camera.picture(drawn, STILL, 0), frames[0])


def grey(imager: Imager, figure: int) -> Image:
    return np.full((imager.source[1], imager.source[0], 3), figure, np.uint8)


def test_a_stop_doubles_the_light() -> None:
    dark, bright = (
        Imager(LENS, replace(BARE, exposure_s=0.001, exposure_ev=ev), 1, "uas") for ev in (0.0, 1.0)
    )  # fmt: skip
    before, after = (light(each.picture(grey(each, 100), STILL, 0)).mean() for each in (dark, bright))
    assert after == pytest.approx(2.0 * before, rel=0.01)


@pytest.mark.parametrize("figure", [20, 60, 112, 200])
def test_automatic_exposure_brings_any_picture_to_its_level(figure: int) -> None:
    for vignetting in (0.0, 0.5):
        sensor = replace(BARE, auto_exposure=True, exposure_s=0.002, vignetting=vignetting)
        imager = Imager(LENS, sensor, 1, "uas")
        mean = light(imager.picture(grey(imager, figure), STILL, 0)).mean()
        assert math.sqrt(mean) == pytest.approx(0.44, abs=0.004)


def test_what_light_is_wanting_is_made_up_by_time_and_then_by_gain() -> None:
    sensor = ImageSensor()
    assert exposure.exposed(sensor, 1.0) == (1.0, 0.00033, 1.0)
    assert exposure.exposed(sensor, 10.0) == pytest.approx((10.0, 0.0033, 1.0))
    light_of_dusk, time_s, gain = exposure.exposed(sensor, 400.0)
    assert (light_of_dusk, time_s, gain) == pytest.approx((400.0, 0.0333, 400.0 * 0.00033 / 0.0333))
    assert exposure.exposed(sensor, 1e6).gain == 15.5, "and there it ends"
    assert exposure.exposed(sensor, 0.01).time_s == 0.000134


def test_exposure_follows_with_its_time_constant() -> None:
    imager = Imager(LENS, replace(BARE, auto_exposure=True, exposure_s=0.002, follow_s=0.5), 1, "uas")
    imager.picture(grey(imager, 112), STILL, 0)
    means = [float(imager.picture(grey(imager, 60), STILL, 50_000 * k).mean()) for k in range(1, 100)]
    assert 55 < means[0] < 75 and means == sorted(means), "darker scene: the picture comes back by and by"
    assert means[-1] == pytest.approx(112.0, abs=1.5)
    half = next(k for k, mean in enumerate(means) if (mean / 60) ** 2 > 1 + 0.632 * ((112 / 60) ** 2 - 1))
    assert 8 <= half <= 12, "63 % after half a second"


def test_white_balance_and_vignetting() -> None:
    imager = Imager(LENS, replace(BARE, white_balance=(1.44, 1.0, 0.81), vignetting=1.0), 1, "uas")
    picture = imager.picture(grey(imager, 150), STILL, 0)
    assert picture[120, 160].tolist() == pytest.approx([135, 150, 180], abs=1)
    corner = 1.0 + (159.5**2 + 119.5**2) / FOCAL_PX**2
    assert light(picture)[0, 0] / light(picture)[120, 160] == pytest.approx(corner**-2, rel=0.05), (
        "cosine to the fourth"
    )


def test_jpeg_is_what_opencv_makes_of_it() -> None:
    raw, sent = (Imager(LENS, replace(ImageSensor(), jpeg_quality=quality), 1, "uas") for quality in (0, 40))
    drawn = np.random.default_rng(1).integers(0, 256, (raw.source[1], raw.source[0], 3), dtype=np.uint8)
    plain, coded = raw.picture(drawn, STILL, 0), sent.picture(drawn, STILL, 0)
    _, encoded = cv2.imencode(".jpg", plain, (cv2.IMWRITE_JPEG_QUALITY, 40))
    assert np.array_equal(coded, present(cv2.imdecode(encoded, cv2.IMREAD_COLOR))) and not np.array_equal(coded, plain)


def test_lens_and_shutter_in_one_pass_are_the_lens_where_nothing_moves() -> None:
    """A dot appears where it does with the plain sensor."""
    seen_by, pose = Intrinsics(320, 256, 80.0, WIDE), Pose(0.0, 0.0, -15.0, (1.0, 0.0, 0.0, 0.0))
    for dot in ((-4.0, 3.0), (6.0, -8.0), (0.0, 9.0)):
        plain = Camera(Dots([dot]), NADIR, seen_by).render(pose, 0)
        real = Camera(Dots([dot]), NADIR, seen_by, sensor=replace(BARE, readout_s=0.03)).render(pose, 0)
        places = [np.argwhere(picture[..., 1] > 100).mean(axis=0) for picture in (plain, real)]
        assert math.dist(*places) < 0.3


def test_a_cameras_frame_is_a_function_of_time_pose_and_motion() -> None:
    dots, pose = Dots([(0.0, 0.0), (3.0, 3.0)]), Pose(0.0, 0.0, -15.0, quaternion(0.1, -0.1, 0.7))
    motion = Motion((5.0, 1.0, -0.5), (0.3, -0.2, 0.5))
    one, two = (Camera(dots, NADIR, Intrinsics(320, 256), "uas", ImageSensor()) for _ in range(2))
    first = one.render(pose, 66_667, motion=motion)
    one.render(pose, 133_333, motion=motion)
    assert np.array_equal(two.render(pose, 133_333), two.render(pose, 133_333))
    assert np.array_equal(two.render(pose, 66_667, motion=motion), first)
    assert not np.array_equal(two.render(pose, 66_667), first)


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.floats(-0.02, 0.02))
def test_turning_is_a_rotation_and_that_by_rate_times_time(rate: tuple[float, float, float], time_s: float) -> None:
    turning = Drift(np.array(rate), np.zeros(3), np.array((0.0, 0.0, 1.0)), 10.0)
    matrix = ways(turning, np.array((time_s,)))[0, :9].reshape(3, 3).astype(np.float64)
    expected, _ = cv2.Rodrigues(np.array(rate) * time_s)
    assert np.abs(matrix - expected).max() < 2e-4 and np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-6


def test_a_gimbals_head_turns_with_the_heading_alone() -> None:
    q = quaternion(0.3, -0.2, 1.0)
    rates, step_s = (0.4, -0.3, 0.6), 1e-5
    later = product(q, (1.0, 0.5 * step_s * rates[0], 0.5 * step_s * rates[1], 0.5 * step_s * rates[2]))
    by_heading = (heading(later) - heading(q)) / step_s
    level = np.eye(3)
    told = drift(Motion(rate_rad_s=rates), body_to_ned(q), level, level, np.zeros(3), 10.0)
    assert told.rate_rad_s == pytest.approx((0.0, 0.0, by_heading), abs=1e-4)
    fixed = drift(Motion(rate_rad_s=rates), body_to_ned(q), None, body_to_ned(q), np.array((1.0, 0.0, 0.0)), 10.0)
    assert fixed.rate_rad_s == pytest.approx(rates)
    assert fixed.velocity_m_s == pytest.approx(np.cross(rates, (1.0, 0.0, 0.0))), "its lever moves it"


def test_scenario_and_vehicle_say_which_sensor(tmp_path: Path) -> None:
    def described(given: object) -> CameraDescription:
        whole = scenario(tmp_path, {"camera": {"sensor": given}})
        kept = whole.model_dump(mode="json")["vehicles"][0]["camera"]["sensor"]
        assert kept == given, "the run's folder keeps it as it was written"
        made = present(whole.vehicles[0].camera_description)
        assert record.read(CameraDescription, _plain(made), "camera") == made, (
            "and it comes to the camera's process as it was"
        )
        return made

    assert described(None).sensor is None and described("plain").sensor is None
    assert described("ov5648").sensor == ImageSensor()
    assert described({"readout_s": 0.01, "jpeg_quality": 80}).sensor == ImageSensor(readout_s=0.01, jpeg_quality=80)
    data = replace(present(vehicles.load("m600").camera), sensor="ov5648")
    assert cameras.sensor(None, data) == ImageSensor() and cameras.sensor("plain", data) is None


def _plain(described: CameraDescription) -> dict[str, object]:
    return dict(json.loads(json.dumps(dataclasses.asdict(described))))


@pytest.mark.parametrize(
    ("sensor", "said"),
    [
        ("ov5647", "known: plain, ov5648, or a table of what is other than in an ov5648"),
        (5, "known: plain, ov5648, or a table"),
        ({"iso": 100}, "sensor: unknown field 'iso' = 100; allowed are: width_px, height_px, well_electrons"),
        ({"readout_s": 2}, "sensor: readout_s = 2"),
        ({"jpeg_quality": "best"}, "sensor: jpeg_quality = 'best'"),
    ],
)
def test_a_wrong_sensor_is_told(tmp_path: Path, sensor: object, said: str) -> None:
    with pytest.raises(Exception, match=r"vehicles.0.camera.sensor: .*" + said):
        scenario(tmp_path, {"camera": {"sensor": sensor}})


def test_a_lens_without_distortion_is_no_other_lens() -> None:
    assert Imager(Intrinsics(distortion=Distortion()), BARE, 1, "uas").source == (640, 480), "no margin without readout"
