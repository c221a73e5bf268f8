"""The gimbal moves the picture: frames of a run beside what is drawn from the truth, and what a companion believes."""

import contextlib
import csv
import json
import math
import threading
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
from PIL import Image
from pyulog import ULog

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.core.attitude import euler, heading, product, quaternion
from sitl_emu.missions.companion import calibration
from sitl_emu.run import worlds
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.lens import Intrinsics, Mount
from tests.missions.installed import YARD, run_in_yard
from tests.missions.look_around import LOOKS, ZOOM_PERCENT
from tests.missions.runs import FIRST_INSTANCE
from tests.rtp import IDR, Ear, decoded, psnr_db, units

VEHICLE: dict[str, object] = {
    "name": "uas",
    "model": "m600",
    "start": "home",
    "camera": {"resolution": [160, 120], "rate_hz": 10},
}
GPS = 0x8825
"""EXIF's IFD of where a picture was taken."""
WITHIN_DEG = 0.5
"""So well the companion knows where its camera looks, by the heading that its autopilot believes."""
HEADING_ERROR_DEG = 3.0
"""So far that heading may be off: a degree by the hard iron of an m600, the rest walks with its sensors' noise."""
ZOOM = 1.0 + 3.0 * ZOOM_PERCENT / 100.0
"""An m600's camera goes to 4 times."""
SPEED = "5"
"""Video has the camera's rate, 10 Hz, by the wall's clock: a look of 3 s has six frames of it, on a slow
machine more."""


class Flight(NamedTuple):
    """What a flight has left, and the packets of its video, by picture."""

    folder: Path
    video: list[list[bytes]]


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    made, video, ended = tmp_path_factory.mktemp("gimbal"), list[list[bytes]](), threading.Event()
    ear = Ear(ports.video(FIRST_INSTANCE))

    def hear() -> None:
        while not (ended.is_set() and ear.silent()):
            with contextlib.suppress(TimeoutError):
                video.append(ear.picture())

    hearing = threading.Thread(target=hear)
    hearing.start()
    try:
        run_in_yard(made, "look_around", VEHICLE, arguments=("--video", "--speed", SPEED))
    finally:
        ended.set()
        hearing.join()
        ear.close()
    return Flight(made, video)


@pytest.fixture(scope="module")
def folder(flight: Flight) -> Path:
    return flight.folder


def truths(folder: Path) -> dict[int, Pose]:
    with (folder / "run/truth-uas.csv").open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    return {
        round(row["time_s"] * 1e6): Pose(
            row["north_m"], row["east_m"], row["down_m"], (row["qw"], row["qx"], row["qy"], row["qz"])
        )
        for row in rows
    }


def head_of(pose: Pose, pitch_deg: float, yaw_deg: float) -> Any:
    return head_by(heading(pose.q), pitch_deg, yaw_deg)


def head_by(heading_rad: float, pitch_deg: float, yaw_deg: float) -> Any:
    level = quaternion(0.0, 0.0, heading_rad)
    return product(level, quaternion(0.0, math.radians(pitch_deg), math.radians(yaw_deg)))


def believed_heading_rad(folder: Path, time_us: int) -> float:
    """The autopilot's, by its log."""
    (log,) = (folder / "run/rootfs/uas/log").glob("*/*.ulg")
    attitude = ULog(str(log), ["vehicle_attitude"]).get_dataset("vehicle_attitude").data
    at = int(np.argmin(np.abs(attitude["timestamp"].astype(float) - time_us)))
    w, x, y, z = (float(attitude[f"q[{n}]"][at]) for n in range(4))
    return heading((w, x, y, z))


def knows_where_its_camera_looks(folder: Path) -> None:
    """By what it was told; how far that is from the truth, is the autopilot's heading."""
    heads, truth = json.loads((folder / "heads.json").read_text()), truths(folder)
    for look, (time_us, head) in zip(LOOKS, heads.items(), strict=False):
        believed_rad = believed_heading_rad(folder, int(time_us))
        assert angle_deg(head, head_by(believed_rad, *look)) < WITHIN_DEG
        assert abs(math.degrees(believed_rad - heading(truth[int(time_us)].q))) < HEADING_ERROR_DEG


def angle_deg(a: Any, b: Any) -> float:
    return 2.0 * math.degrees(math.acos(min(1.0, abs(sum(p * q for p, q in zip(a, b, strict=True))))))


def test_each_frame_shows_what_lies_where_the_gimbal_looked(folder: Path) -> None:
    heads, truth = json.loads((folder / "heads.json").read_text()), truths(folder)
    camera = Camera(worlds.build(str(YARD), 0, {}).scene(), Mount(0.0, 0.0, 0.15, 0.0), Intrinsics(160, 120), "uas")
    assert len(heads) == len(LOOKS) + 2
    for (pitch_deg, yaw_deg), time_us in zip(LOOKS, map(int, heads), strict=False):
        pose, frame = truth[time_us], cv2.imread(str(folder / f"{time_us}.png"))
        assert frame is not None
        seen = frame.astype(float)
        drawn = camera.render(pose, time_us, head_of(pose, pitch_deg, yaw_deg)).astype(float)
        assert np.abs(seen - drawn).mean() < 4.0, (
            "the truth of the files is rounded, and the sensor's noise is the same"
        )
        others = [look for look in LOOKS if look != (pitch_deg, yaw_deg)]
        for other in others:
            wrong = camera.render(pose, time_us, head_of(pose, *other)).astype(float)
            assert np.abs(seen - wrong).mean() > 3.0 * np.abs(seen - drawn).mean()


def test_the_video_shows_what_the_camera_sent_its_companion(flight: Flight) -> None:
    """Not every frame, as the run is faster than real time: all that is asked for is one of each look."""
    first = next(at for at, packets in enumerate(flight.video) if IDR in units(packets))
    seen = decoded(flight.video[first:])
    assert len(seen) == len(flight.video) - first >= len(LOOKS)
    assert {image.shape for image in seen} == {(120, 160, 3)}
    frames = {time_us: cv2.imread(str(flight.folder / f"{time_us}.png")) for time_us in heads_of(flight.folder)}
    held = list(frames.values())[: len(LOOKS)]
    for number, frame in enumerate(held):
        assert frame is not None
        fits = [psnr_db(image, np.asarray(frame, np.uint8)) for image in seen]
        best = seen[int(np.argmax(fits))]
        others = [psnr_db(best, np.asarray(other, np.uint8)) for other in held]
        assert others[number] == max(others) > 26.0, f"look {number}: {others}"


def heads_of(folder: Path) -> list[str]:
    return list(json.loads((folder / "heads.json").read_text()))


def test_the_companion_knows_by_mavlink_where_its_camera_looked(folder: Path) -> None:
    heads, truth = json.loads((folder / "heads.json").read_text()), truths(folder)
    assert len(heads) == len(LOOKS) + 2
    knows_where_its_camera_looks(folder)
    moving_us, moving = list(heads.items())[-2]
    w, x, y, z = moving
    pitch_deg = math.degrees(euler((w, x, y, z))[1])
    assert -89.0 < pitch_deg < -31.0, "on its way"
    camera = Camera(worlds.build(str(YARD), 0, {}).scene(), Mount(0.0, 0.0, 0.15, 0.0), Intrinsics(160, 120), "uas")
    frame = cv2.imread(str(folder / f"{moving_us}.png"))
    assert frame is not None
    drawn = camera.render(truth[int(moving_us)], int(moving_us), tuple(moving)).astype(float)
    held_still = camera.render(truth[int(moving_us)], int(moving_us), head_of(truth[int(moving_us)], *LOOKS[-1]))
    off = np.abs(frame.astype(float) - drawn).mean()
    assert off < 4.0 and np.abs(frame.astype(float) - held_still).mean() > 2.0 * off, "the picture moved with it"


def test_a_picture_taken_over_mavlink_is_a_file_of_what_the_camera_saw(folder: Path) -> None:
    truth, run = truths(folder), folder / "run"
    camera = Camera(worlds.build(str(YARD), 0, {}).scene(), Mount(0.0, 0.0, 0.15, 0.0), Intrinsics(160, 120), "uas")
    lines = [json.loads(line) for line in (run / "events.jsonl").read_text().splitlines()]
    told = [line for line in lines if line["event"] == "picture"]
    assert [line["text"] for line in told] == [f"mftp://[;comp=1]/camera/IMG_{n:04d}.jpg" for n in (1, 2, 3, 4)]
    for line, look in zip(told, LOOKS, strict=False):
        path = run / "rootfs/uas" / line["text"].partition("]/")[2]
        pose = min(truth.items(), key=lambda row: abs(row[0] - line["time_us"]))[1]
        seen = cv2.imread(str(path))
        assert seen is not None and seen.shape == (120, 160, 3)
        off = {
            other: np.abs(seen.astype(float) - camera.render(pose, line["time_us"], head_of(pose, *other))).mean()
            for other in LOOKS
        }
        assert off[look] < 5.0 and min(off, key=lambda other: off[other]) == look
        with Image.open(path) as image:
            gps = image.getexif().get_ifd(GPS)
        for name, number in (("lat", 2), ("lon", 4)):
            degrees, minutes, seconds = map(float, gps[number])
            assert degrees + minutes / 60 + seconds / 3600 == pytest.approx(line[name] / 1e7, abs=1e-7)


def shows_the_zoom(folder: Path) -> None:
    """The last frame and the last picture do: what was drawn grows by it."""
    truth, time_us = truths(folder), int(list(json.loads((folder / "heads.json").read_text()))[-1])
    camera = Camera(worlds.build(str(YARD), 0, {}).scene(), Mount(0.0, 0.0, 0.15, 0.0), Intrinsics(160, 120), "uas")
    pose = truth[time_us]
    for path in (folder / f"{time_us}.png", folder / "run/rootfs/uas/camera/IMG_0004.jpg"):
        seen = np.asarray(cv2.imread(str(path))).astype(float)
        wide, near = (
            np.abs(seen - camera.render(pose, time_us, head_of(pose, *LOOKS[0]), zoom=zoom)).mean()
            for zoom in (1.0, ZOOM)
        )
        assert near < 5.0 and wide > 2.0 * near, path.name


def test_frames_and_pictures_show_how_far_the_camera_has_zoomed(folder: Path) -> None:
    shows_the_zoom(folder)
    told = calibration.read(folder / "run/uas-camera.yaml").camera
    assert told.fx == pytest.approx(80.0), "the calibration is that of no zoom"


def test_a_picture_can_be_fetched_by_its_url_over_mavlink_ftp(folder: Path) -> None:
    assert (folder / "fetched.jpg").read_bytes() == (folder / "run/rootfs/uas/camera/IMG_0002.jpg").read_bytes()


def test_the_calibration_file_says_that_it_hangs_on_the_gimbal(folder: Path) -> None:
    assert "on_gimbal: 1" in (folder / "run/uas-camera.yaml").read_text()


def test_beside_an_autopilot_from_outside_gimbal_and_camera_are_at_the_far_ends_of_its_links(tmp_path: Path) -> None:
    """Ours, without devices of its own, stands in for a real PX4."""
    airframe = vehicles.FOLDER / "m600/airframe.json"
    arguments = ["--airframe", str(airframe), "--instance", "{instance}", "--root", "{rootfs}"]
    command = ["{python}", "-P", "-m", "sitl_emu.autopilot", *arguments]
    run = run_in_yard(tmp_path, "look_around", VEHICLE | {"autopilot": {"command": command, "components": True}})
    truth, heads = truths(tmp_path), json.loads((tmp_path / "heads.json").read_text())
    knows_where_its_camera_looks(tmp_path)
    camera = Camera(worlds.build(str(YARD), 0, {}).scene(), Mount(0.0, 0.0, 0.15, 0.0), Intrinsics(160, 120), "uas")
    time_us = int(list(heads)[1])
    frame = np.asarray(cv2.imread(str(tmp_path / f"{time_us}.png"))).astype(float)
    off = [
        np.abs(frame - camera.render(truth[time_us], time_us, head_of(truth[time_us], *look))).mean() for look in LOOKS
    ]
    assert off[1] == min(off) < 5.0
    assert (run / "rootfs/uas/camera/IMG_0003.jpg").read_bytes()[:2] == b"\xff\xd8"
    shows_the_zoom(tmp_path)
