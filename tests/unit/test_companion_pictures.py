"""What is written on the pictures of what was found."""

import cv2
import numpy as np

from sitl_emu.missions.companion.companion import Event
from sitl_emu.missions.companion.pictures import draw

GREY = 128


def test_the_dark_rim_of_a_text_lies_around_it() -> None:
    """OpenCV 5 writes thicker text wider: drawn thick, the rim ran away from its text."""
    plain = np.full((60, 640, 3), GREY, np.uint8)
    drawn = draw(plain, [], Event(32_000_000, "target_confirmed", "target 1: debris_field", {}))
    bright, dark = (drawn > GREY + 20).all(axis=2), (drawn < GREY - 60).all(axis=2)
    assert bright.any() and dark.any() and (plain == GREY).all()
    near = cv2.dilate(bright.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    assert not (dark & ~near).any()
