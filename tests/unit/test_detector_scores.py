"""Average precision, precision, recall and confusion, by cases that one can count by hand."""

import numpy as np
import pytest

from sitl_emu.missions.companion.yolo import Found
from tools.detector.scores import Truth, average_precision, confusion, score

A, B, C = (0.0, 0.0, 10.0, 10.0), (20.0, 0.0, 30.0, 10.0), (50.0, 50.0, 60.0, 60.0)
Box = tuple[float, float, float, float]


def found(*rows: tuple[Box, float, int]) -> Found:
    boxes = np.array([row[0] for row in rows], np.float32).reshape(-1, 4)
    return Found(boxes, np.array([row[1] for row in rows], np.float32), np.array([row[2] for row in rows], np.int64))


def truth(*rows: tuple[Box, int, bool]) -> Truth:
    boxes = np.array([row[0] for row in rows], np.float32).reshape(-1, 4)
    return Truth(boxes, np.array([row[1] for row in rows], np.int64), np.array([row[2] for row in rows], np.bool_))


def hits(text: str) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.array([each == "+" for each in text], np.bool_)


@pytest.mark.parametrize(("order", "count", "expected"), [
    ("++", 2, 1.0),
    ("+", 2, 51 / 101),          # recalls 0 to 0.50 of 101
    ("-+", 1, 0.5),
    ("+-+", 2, (51 + 50 * 2 / 3) / 101),
    ("--", 1, 0.0),
    ("", 3, 0.0),
    ("+", 0, 0.0),
])  # fmt: skip
def test_average_precision(order: str, count: int, expected: float) -> None:
    assert average_precision(hits(order), count) == pytest.approx(expected)


def test_all_right_is_one_everywhere() -> None:
    one = score([found((A, 0.9, 0), (B, 0.8, 1))], [truth((A, 0, False), (B, 1, False))], 2)
    assert one.map50 == one.map50_95 == 1.0
    assert [(row.precision, row.recall, round(row.f1, 6)) for row in one.classes] == [(1.0, 1.0, 1.0)] * 2


def test_a_box_that_fits_roughly_counts_at_low_overlaps_alone() -> None:
    shifted = (0.0, 0.0, 10.0, 7.2)  # IoU 0.72: right at 0.5 to 0.7, five of ten
    one = score([found((shifted, 0.9, 0))], [truth((A, 0, False))], 1)
    assert one.map50 == 1.0 and one.map50_95 == pytest.approx(0.5)


def test_a_truth_is_found_once() -> None:
    one = score([found((A, 0.9, 0), (A, 0.8, 0))], [truth((A, 0, False))], 1, at=0.5)
    assert one.classes[0].precision == 0.5 and one.classes[0].recall == 1.0 and one.map50 == 1.0


def test_the_wrong_class_is_a_miss_and_a_false_find() -> None:
    one = score([found((A, 0.9, 1))], [truth((A, 0, False))], 2, at=0.5)
    assert one.classes[0].recall == 0.0 and one.classes[1].precision == 0.0
    assert one.map50 == 0.0  # of the class that is there


def test_what_lies_in_something_ignored_does_not_count() -> None:
    inner = (2.0, 2.0, 6.0, 6.0)
    one = score([found((inner, 0.9, 0), (B, 0.8, 0))], [truth((A, 0, True), (B, 0, False))], 1, at=0.5)
    assert one.classes[0].precision == 1.0 and one.classes[0].truths == 1


def test_the_threshold_is_where_f1_is_highest() -> None:
    one = score([found((A, 0.9, 0), (B, 0.6, 0), (C, 0.3, 0))], [truth((A, 0, False), (B, 0, False))], 1)
    assert 0.3 < one.at <= 0.6
    assert one.classes[0].precision == one.classes[0].recall == 1.0


def test_confusion_has_a_row_and_a_column_for_nothing() -> None:
    table = confusion([found((A, 0.9, 1), (C, 0.8, 0), (B, 0.1, 0))], [truth((A, 0, False), (B, 1, False))], 2, 0.5)
    assert table.tolist() == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
