"""A camera's card: numbers that go on, and JPEG files whose EXIF says where and when they were taken."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from sitl_emu.components.card import Card, file_name
from sitl_emu.components.geotag import Geotag

TAG = Geotag(474_977_420, -855_945_940, 489_400, 0)
NOON_US = 1_781_524_800_000_000
"""2026-06-15 12:00 UTC."""
DATE, GPS, EXIF = 0x9003, 0x8825, 0x8769


def drawn(root: Path, number: int) -> Path:
    path = root / "camera" / file_name(number)
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:, 32:] = (40, 90, 200)
    assert cv2.imwrite(str(path), picture)
    return path


def test_numbers_go_on_where_the_card_left_off(tmp_path: Path) -> None:
    card = Card(tmp_path)
    assert [card.next_number(), card.next_number()] == [1, 2]
    drawn(tmp_path, 12)
    (tmp_path / "camera/notes.txt").write_text("")
    assert Card(tmp_path).next_number() == 13


def test_the_url_is_mavlink_ftps_and_names_the_autopilot_as_server() -> None:
    assert Card.url(12) == b"mftp://[;comp=1]/camera/IMG_0012.jpg"
    assert len(Card.url(10**9)) < 205


def test_a_tagged_file_is_the_same_picture_and_says_where_and_when(tmp_path: Path) -> None:
    card = Card(tmp_path, "sitl-emu", "survey camera")
    path = drawn(tmp_path, 1)
    before = cv2.imread(str(path))
    card.tag(1, TAG, NOON_US)
    after = cv2.imread(str(path))
    assert before is not None and after is not None and np.array_equal(before, after)
    with Image.open(path) as image:
        exif = image.getexif()
    gps = exif.get_ifd(GPS)
    assert (exif[0x010F], exif[0x0110]) == ("sitl-emu", "survey camera")
    assert exif.get_ifd(EXIF)[DATE] == "2026:06:15 12:00:00"
    assert (gps[1], gps[3], gps[5]) == ("N", "W", b"\0")
    for value, degrees in ((gps[2], 47.4977420), (gps[4], 85.5945940)):
        assert float(value[0]) + float(value[1]) / 60 + float(value[2]) / 3600 == pytest.approx(degrees, abs=1e-7)
    assert float(gps[6]) == pytest.approx(489.4)


def test_what_is_not_known_is_left_out(tmp_path: Path) -> None:
    card = Card(tmp_path)
    path = drawn(tmp_path, 1)
    card.tag(1, Geotag(), 0)
    with Image.open(path) as image:
        exif = image.getexif()
    assert not exif.get_ifd(GPS) and not exif.get_ifd(EXIF)
