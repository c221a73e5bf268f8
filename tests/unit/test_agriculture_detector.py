"""The classical detector on rendered pictures of a field it was not trained on, and on pictures of anything."""

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from sitl_emu.missions.agriculture.detector import LABELS, ClassicalDetector, load_weights
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, camera_pose, project
from sitl_emu.missions.companion.detector import Detection, Detector
from sitl_emu.world import camera
from sitl_emu.world.kinds.corn_field.field import CornField, build
from sitl_emu.world.kinds.corn_field.scene import FieldScene

HEIGHT_M = 15.0
GSD_M = HEIGHT_M / CameraModel().focal_px


@pytest.fixture(scope="module")
def field() -> CornField:
    return build(301)


@pytest.fixture(scope="module")
def eye(field: CornField) -> camera.Camera:
    return camera.Camera(FieldScene(field))


def look(field: CornField, eye: camera.Camera, north: float, east: float) -> tuple[np.ndarray, camera.Pose]:
    pose = camera.Pose(north, east, -field.terrain.height_m(north, east) - HEIGHT_M, (1.0, 0.0, 0.0, 0.0))
    return eye.render(pose, 1), pose


def place(field: CornField, pose: camera.Pose, north: float, east: float) -> tuple[float, float]:
    seen_from = camera_pose(pose[:3], pose.q, NADIR)
    pixel = project(CameraModel(), seen_from, (north, east, -field.terrain.height_m(north, east) - 0.15))
    assert pixel is not None
    return pixel


def near(detections: list[Detection], pixel: tuple[float, float]) -> list[Detection]:
    return [d for d in detections if math.hypot(d.x - pixel[0], d.y - pixel[1]) * GSD_M < 0.9]


def test_finds_a_fields_targets_and_names_them(field: CornField, eye: camera.Camera) -> None:
    detector: Detector = ClassicalDetector()
    right = 0
    for target in field.targets:
        image, pose = look(field, eye, target.north_m - 2.0, target.east_m + 2.0)
        found = near(detector.detect(image, GSD_M), place(field, pose, target.north_m, target.east_m))
        right += bool(found) and found[0].label == target.kind and found[0].score > 0.5
        for one in found:
            assert 0.3 < one.w * GSD_M < 3.5 and 0.3 < one.h * GSD_M < 3.5
    assert right == len(field.targets)


def test_takes_few_distractors_for_targets(field: CornField, eye: camera.Camera) -> None:
    detector = ClassicalDetector()
    taken = 0
    for thing in field.distractors[:12]:
        image, pose = look(field, eye, thing.north_m, thing.east_m)
        taken += bool(near(detector.detect(image, GSD_M), place(field, pose, thing.north_m, thing.east_m)))
    assert taken <= 2


def test_half_the_pixels_at_twice_the_distance_give_the_same(field: CornField, eye: camera.Camera) -> None:
    target = field.targets[0]
    image, pose = look(field, eye, target.north_m, target.east_m)
    half = np.asarray(cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA), np.uint8)
    x, y = place(field, pose, target.north_m, target.east_m)
    assert near(ClassicalDetector().detect(image, GSD_M), (x, y))
    assert any(
        math.hypot(2 * d.x - x, 2 * d.y - y) * GSD_M < 0.9 for d in ClassicalDetector().detect(half, 2.0 * GSD_M)
    )


@pytest.mark.parametrize("colour", [(0, 0, 0), (255, 255, 255), (40, 120, 70), (70, 90, 115)])
def test_a_plain_picture_holds_nothing(colour: tuple[int, int, int]) -> None:
    assert ClassicalDetector().detect(np.full((480, 640, 3), colour, np.uint8)) == []


@pytest.mark.parametrize("gsd_m", [None, 0.001, 0.0072, 0.06, 0.5])
def test_any_distance_and_size_is_borne(gsd_m: float | None) -> None:
    noise = np.random.default_rng(1).integers(0, 255, size=(240, 424, 3), dtype=np.uint8)
    for one in ClassicalDetector().detect(noise, gsd_m):
        assert one.label in LABELS and 0.0 <= one.score <= 1.0


def test_weights_must_fit_the_features(tmp_path: Path) -> None:
    weights = load_weights()._asdict()
    broken = {name: np.asarray(values).tolist() for name, values in weights.items()}
    broken["hidden"] = broken["hidden"][:-1]
    path = tmp_path / "weights.json"
    path.write_text(json.dumps(broken))
    with pytest.raises(ValueError, match=r"weights\.json"):
        load_weights(path)
