"""What a picture says of plain ground: its edges, of things and not of texture."""

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.missions.disaster.places import ROUGH
from sitl_emu.missions.disaster.sight import FINEST_M, PART_PX, edges_of

LOW_GSD_M = 7.0 / 320.0
CONTRAST = 16.0
"""Of gravel from 7 m, one sigma of its grey levels (disaster-debris, seed 22)."""


DARK, BLUE = (20.0, 20.0, 20.0), (255.0, 105.0, 123.0)
"""BLUE is as bright as the gravel, 128 of grey."""


def gravel(
    stone_m: float, gsd_m: float, person_m: float = 0.0, colour: tuple[float, float, float] = DARK
) -> npt.NDArray[np.uint8]:
    """A picture of stones, as wide as given, and in its middle something of another colour."""
    stones = np.random.default_rng(1).normal(128.0, 40.0, (480, 640)).astype(np.float32)
    grey = cv2.GaussianBlur(stones, (0, 0), stone_m / gsd_m / 2.0)
    grey = 128.0 + (grey - 128.0) * CONTRAST / float(grey.std())
    half = round(person_m / gsd_m / 2.0)
    image = np.stack((grey, grey, grey), axis=-1)
    image[240 - half : 240 + half, 320 - half : 320 + half] = colour
    return np.asarray(np.clip(image, 0, 255), np.uint8)


@pytest.mark.parametrize("colour", [DARK, BLUE])
def test_gravel_is_plain_from_low_and_who_stands_on_it_is_not(colour: tuple[float, float, float]) -> None:
    """Seen as from the height at which pixels are FINEST_M."""
    stones = gravel(0.02, LOW_GSD_M)
    assert edges_of(stones, FINEST_M).mean() > ROUGH, "as texture of things it would be rough"
    assert edges_of(stones, LOW_GSD_M).mean() < ROUGH
    with_person = edges_of(gravel(0.02, LOW_GSD_M, 0.5, colour), LOW_GSD_M)
    rows, columns = with_person.shape
    assert with_person[rows // 2 - 2 : rows // 2 + 2, columns // 2 - 2 : columns // 2 + 2].max() > 2.0 * ROUGH


def test_a_part_is_half_a_metre_from_low_and_high() -> None:
    """And of a height that nobody knows so many pixels."""
    picture = gravel(0.02, LOW_GSD_M)
    low, high, unknown = (edges_of(picture, gsd_m) for gsd_m in (LOW_GSD_M, 2.0 * FINEST_M, 0.0))
    assert abs(640 * LOW_GSD_M / low.shape[1] - PART_PX * FINEST_M) < 0.05
    assert high.shape == unknown.shape == (480 // PART_PX, 640 // PART_PX)
