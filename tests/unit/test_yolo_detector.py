"""A network's figures as detections: fitting pictures, boxes from anchors, what hides what, files that are no model."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.missions.companion import yolo
from sitl_emu.missions.companion.selection import Selected, Wanted
from sitl_emu.missions.companion.yolo import ModelError, OnnxDetector, decoded, distinct, fitted, middles, overlaps


def test_a_wide_picture_is_fitted_between_grey() -> None:
    fit = fitted(np.full((100, 400, 3), 7, np.uint8), 200, 100)
    assert fit.image.shape == (100, 200, 3) and fit.scale == 0.5 and (fit.left, fit.top) == (0, 25)
    assert (fit.image[:25] == yolo.PAD).all() and (fit.image[25:75] == 7).all() and (fit.image[75:] == yolo.PAD).all()


def test_a_picture_of_the_right_size_is_itself() -> None:
    image = np.zeros((96, 128, 3), np.uint8)
    assert fitted(image, 128, 96).image is image


def test_middles_go_scale_by_scale_and_row_by_row() -> None:
    at = middles(64, 96)
    assert len(at) == 8 * 12 + 4 * 6 + 2 * 3
    assert at[0].tolist() == [4, 4] and at[1].tolist() == [12, 4] and at[12].tolist() == [4, 12]
    assert at[96].tolist() == [8, 8] and at[-1].tolist() == [80, 48]


def figures(*rows: tuple[int, tuple[float, ...], tuple[float, ...]]) -> Any:
    """Of a network of two classes and a picture of 32 x 64: by anchor, sides and scores."""
    out = np.zeros((len(middles(32, 64)), 6), np.float32)
    for anchor, sides, scores in rows:
        out[anchor] = (*sides, *scores)
    return out


def test_boxes_are_sides_from_the_middles_and_scores_are_rounded() -> None:
    found = decoded(figures((0, (4, 3, 6, 5), (0.1, 0.70049))), middles(32, 64), 0.5, 0.6)
    assert found.boxes.tolist() == [[0, 1, 10, 9]] and found.labels.tolist() == [1]
    assert found.scores.tolist() == pytest.approx([0.7])


def test_the_last_bits_of_a_score_choose_nothing() -> None:
    a, b = np.nextafter(np.float32(0.25), np.float32(0)), np.nextafter(np.float32(0.25), np.float32(1))
    counts = [len(decoded(figures((0, (4,) * 4, (score, 0))), middles(32, 64), 0.25, 0.6).boxes) for score in (a, b)]
    assert counts == [1, 1]


def test_of_two_boxes_on_one_thing_the_better_is_kept_unless_they_differ_in_class() -> None:
    boxes = np.array([[0, 0, 10, 10], [1, 0, 10, 10], [1, 0, 10, 10], [40, 0, 50, 10]], np.float32)
    assert distinct(boxes, np.array([0, 0, 1, 0]), 0.6).tolist() == [0, 2, 3]


def test_where_there_is_one_thing_the_better_hides_another_class() -> None:
    out = figures((0, (4, 4, 4, 4), (0.8, 0.0)), (1, (12, 4, -4, 4), (0.0, 0.6)))
    assert decoded(out, middles(32, 64), 0.5, 0.6).labels.tolist() == [0, 1]
    assert decoded(out, middles(32, 64), 0.5, 0.6, one_label=True).labels.tolist() == [0]


def test_overlaps() -> None:
    a = np.array([[0, 0, 10, 10]], np.float32)
    b = np.array([[0, 0, 10, 10], [5, 0, 15, 10], [20, 20, 30, 30]], np.float32)
    assert overlaps(a, b)[0].tolist() == pytest.approx([1.0, 1 / 3, 0.0])


class Session:
    """What onnxruntime gives, with figures of its own."""

    def __init__(self, *outs: Any) -> None:
        self._outs = outs

    def run(self, _: None, inputs: dict[str, Any]) -> list[Any]:
        (planes,) = inputs.values()
        assert planes.shape == (1, 3, 32, 64) and planes.dtype == np.float32 and planes.max() <= 1.0
        self.planes = planes
        return [out[None] for out in self._outs]


def detector_of(*outs: Any) -> tuple[OnnxDetector, Session]:
    made: Any = OnnxDetector.__new__(OnnxDetector)
    session = Session(*outs)
    made._session, made._input, made._labels = session, type("Input", (), {"name": "image"}), ("water", "fire")
    made.height, made.width, made._score, made._iou, made._middles = 32, 64, 0.25, 0.6, middles(32, 64)
    made._one_label = False
    return made, session


def test_detections_are_in_the_pixels_of_the_picture() -> None:
    detector, session = detector_of(figures((0, (4, 4, 12, 4), (0.0, 0.9))))
    image = np.zeros((64, 128, 3), np.uint8)
    image[:, :, 2] = 255  # red
    (one,) = detector.detect(image)
    assert (one.label, one.x, one.y, one.w, one.h) == ("fire", 16.0, 8.0, 32.0, 16.0)
    assert one.score == pytest.approx(0.9)
    assert session.planes[0, 0].min() == 1.0 and session.planes[0, 1:].max() == 0.0  # RGB


def test_areas_are_in_the_pixels_of_the_picture() -> None:
    shares = np.zeros((2, 4, 8), np.float32)
    shares[1, 1:3, 4:] = 0.8  # of the input's 32 x 64; the picture fills its rows 8 to 24
    detector, _ = detector_of(figures((0, (4, 4, 12, 4), (0.0, 0.9))), shares)
    areas = detector.detect(np.zeros((32, 128, 3), np.uint8)).areas
    assert areas is not None and areas.labels == ("water", "fire")
    x, y = np.array([8.0, 64.0, 72.0, 120.0]), np.array([8.0, 16.0, 24.0, 8.0])
    assert areas.at("fire", x, y) == pytest.approx([0.0, 0.4, 0.8, 0.8])
    assert not areas.at("water", x, y).any() and not areas.at("snow", x, y).any()
    alone, _ = detector_of(figures((0, (4, 4, 12, 4), (0.0, 0.9))))
    assert alone.detect(np.zeros((32, 128, 3), np.uint8)).areas is None


def test_a_selection_weighs_areas_too() -> None:
    shares = np.full((2, 4, 8), 0.6, np.float32)
    shares[1, :, :4] = 0.2
    detector, _ = detector_of(figures((0, (4, 4, 12, 4), (0.0, 0.9))), shares)
    found = Selected(detector, {"fire": Wanted(0.5, 0.2)}).detect(np.zeros((64, 128, 3), np.uint8))
    assert found.areas is not None and found.areas.labels == ("fire",)
    assert np.unique(found.areas.shares).tolist() == pytest.approx([0.0, 0.3])


def test_boxes_end_at_the_picture() -> None:
    detector, _ = detector_of(figures((0, (40, 40, 400, 400), (0.9, 0.0))))
    (one,) = detector.detect(np.zeros((64, 128, 3), np.uint8))
    assert (one.x, one.y, one.w, one.h) == (64.0, 32.0, 128.0, 64.0)


def test_a_file_that_is_no_model_is_told(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime")
    path = tmp_path / "x.onnx"
    path.write_bytes(b"no model")
    with pytest.raises(ModelError, match=r"x\.onnx: can't be read as a model"):
        OnnxDetector(path)
    with pytest.raises(ModelError, match=r"none\.onnx: no such file; networks that .*: disaster, field"):
        OnnxDetector(tmp_path / "none.onnx")
