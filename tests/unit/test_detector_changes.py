"""What other cameras do to pictures and their boxes, and what is told by height, sun and haze."""

import numpy as np
import pytest

from sitl_emu.missions.companion.yolo import Found
from tools.detector import augment
from tools.detector.changes import ZOOM, changes, through_another_lens
from tools.detector.colour import learn
from tools.detector.conditions import Condition, binned
from tools.detector.data import Split
from tools.detector.scores import Truth


def marked(left: int, top: int, right: int, bottom: int) -> augment.Sample:
    """A white box on black, known by its pixels."""
    image = np.zeros((320, 416, 3), np.uint8)
    image[top:bottom, left:right] = 255
    rows = np.array([[0, left, top, right, bottom, 1]], np.float32)
    return augment.Sample(image, rows, (image[:, :, 0] > 0).astype(np.uint8))


@pytest.mark.parametrize("has_regions", [True, False])
@pytest.mark.parametrize("box", [(180, 140, 240, 180), (60, 40, 120, 90), (330, 200, 390, 290)])
def test_boxes_go_through_the_other_lens_with_the_picture(box: tuple[int, int, int, int], has_regions: bool) -> None:
    one = marked(*box) if has_regions else marked(*box)._replace(regions=None)
    seen = through_another_lens(one)
    white = seen.image[:, :, 0] > 127
    ys, xs = np.flatnonzero(white.any(axis=1)), np.flatnonzero(white.any(axis=0))
    assert seen.rows[0, 1:5].tolist() == pytest.approx([xs[0], ys[0], xs[-1] + 1, ys[-1] + 1], abs=2.0)
    assert seen.rows[0, 5] == 1.0


def test_the_other_lens_is_longer() -> None:
    seen = through_another_lens(marked(198, 150, 218, 170))
    assert seen.rows[0, 3] - seen.rows[0, 1] == pytest.approx(20 * ZOOM, abs=1.5)


def test_what_the_other_lens_no_longer_shows_is_ignored_or_gone() -> None:
    seen = through_another_lens(marked(0, 0, 16, 12))
    assert seen.rows[0, 5] == augment.IGNORED or seen.rows[0, 1:5].tolist() == [0, 0, 0, 0]


def test_all_other_changes_leave_boxes_where_they_are() -> None:
    one = marked(100, 100, 200, 180)
    for name, change in changes().items():
        seen = change(one)
        assert seen.image.shape == one.image.shape and seen.image.dtype == np.uint8
        if name != "other lens":
            assert np.array_equal(seen.rows, one.rows)
            assert not np.array_equal(seen.image, one.image) or name.startswith("gamma"), name


def test_finds_are_told_apart_by_where_they_were_made() -> None:
    """Two pictures low, where all is found and one thing besides; one high, where nothing is."""
    boxes = np.array([[10, 10, 50, 50]], np.float32)
    truth = Truth(boxes, np.array([0]), np.array([False]))
    right = Found(boxes, np.array([0.9], np.float32), np.array([0]))
    wrong = Found(
        np.array([[10, 10, 50, 50], [100, 100, 140, 140]], np.float32),
        np.array([0.9, 0.8], np.float32),
        np.array([0, 0]),
    )
    nothing = Found(np.zeros((0, 4), np.float32), np.zeros(0, np.float32), np.zeros(0, np.int64))
    about = [{"above_m": 4.0}, {"above_m": 4.5}, {"above_m": 30.0}]
    condition = Condition("height", "above_m", 1.0, (0, 5, 10, 40))
    low, high = binned(condition, [right, wrong, nothing], [truth] * 3, about, 1, 0.5)
    assert (low.pictures, low.truths, low.found, low.false) == (2, 2, 2, 1)
    assert (high.low, high.truths, high.found, high.false) == (10, 1, 0, 0)


def test_colour_alone_finds_what_has_a_colour_of_its_own() -> None:
    rng = np.random.default_rng(2)
    images, rows, regions = [], [], []
    for left in range(20, 260, 40):
        image = np.asarray(90 + rng.integers(0, 40, (320, 416, 3)), np.uint8)
        image[100:160, left : left + 80] = (30, 60, 220)
        images.append(image)
        rows.append(np.array([[0, left, 100, left + 80, 160, 1]], np.float32))
        regions.append(np.asarray(image[..., 2] == 220, np.uint8))
    learnt = learn(Split(("fire",), tuple("abcdef"), images[:5], rows[:5], list(regions[:5]), []))
    found = learnt.found(images[5], 0.5)
    assert found.boxes[0].tolist() == pytest.approx([220, 100, 300, 160], abs=8.0) and found.scores[0] > 0.9
