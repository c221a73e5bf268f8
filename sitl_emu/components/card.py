"""A camera's card: its pictures as JPEG files in a folder, numbered on and on, each with an EXIF geotag.

Who draws a picture writes `file_name(number)`; the camera puts the geotag in when it tells of it. The folder lies in
what the vehicle's autopilot serves by MAVLink FTP, so a picture can be fetched by its URL
(https://mavlink.io/en/services/ftp.html#mavlink-ftp-url-scheme).
"""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a camera's process, which asks for names alone, does without the dialect
    from sitl_emu.components.geotag import Geotag

FOLDER = "camera"
"""Of the file system that the autopilot serves."""
URL = "mftp://[;comp=1]/{folder}/{file}"
"""The autopilot (component 1) serves the file, not the camera."""
JPEG_START, APP1 = b"\xff\xd8", b"\xff\xe1"
EXIF_IFD, GPS_IFD = 0x8769, 0x8825
MAKE, MODEL, DATE_TIME_ORIGINAL = 0x010F, 0x0110, 0x9003
VERSION, LATITUDE_REF, LATITUDE, LONGITUDE_REF, LONGITUDE, ALTITUDE_REF, ALTITUDE = range(7)
"""EXIF 2.3, 4.6.6: GPS tags."""


def file_name(number: int) -> str:
    """Of the picture with that number on a card."""
    return f"IMG_{number:04d}.jpg"


class Card:
    """The card of one camera."""

    def __init__(self, root: Path, vendor: str = "", model: str = "") -> None:
        """`root`: the folder that stands for the autopilot's file system. Raises OSError."""
        self._folder = root / FOLDER
        self._folder.mkdir(parents=True, exist_ok=True)
        self._makers = (vendor, model)
        numbers = [
            int(found[1]) for path in self._folder.iterdir() if (found := re.fullmatch(r"IMG_(\d+)\.jpg", path.name))
        ]
        self._last = max(numbers, default=0)

    def next_number(self) -> int:
        """For a picture that is being taken."""
        self._last += 1
        return self._last

    @staticmethod
    def url(number: int) -> bytes:
        """Where a picture can be fetched."""
        return URL.format(folder=FOLDER, file=file_name(number)).encode()

    def tag(self, number: int, tag: "Geotag", utc_us: int) -> None:
        """Put into a picture's file where and when it was taken (µs since 1970, 0: not known). Raises OSError."""
        path = self._folder / file_name(number)
        data = path.read_bytes()
        segment = _exif(tag, utc_us, self._makers)
        path.write_bytes(JPEG_START + APP1 + (len(segment) + 2).to_bytes(2, "big") + segment + data[len(JPEG_START) :])


def _exif(tag: "Geotag", utc_us: int, makers: tuple[str, str]) -> bytes:
    from PIL import Image  # for the first picture alone: most autopilots take none

    exif = Image.Exif()
    exif[MAKE], exif[MODEL] = makers
    if utc_us:
        exif.get_ifd(EXIF_IFD)[DATE_TIME_ORIGINAL] = datetime.fromtimestamp(utc_us // 1_000_000, UTC).strftime(
            "%Y:%m:%d %H:%M:%S"
        )
    if tag.lat or tag.lon:
        gps = exif.get_ifd(GPS_IFD)
        gps[VERSION] = b"\2\3\0\0"
        gps[LATITUDE_REF], gps[LATITUDE] = "N" if tag.lat >= 0 else "S", _degrees(tag.lat)
        gps[LONGITUDE_REF], gps[LONGITUDE] = "E" if tag.lon >= 0 else "W", _degrees(tag.lon)
        gps[ALTITUDE_REF], gps[ALTITUDE] = b"\0" if tag.alt >= 0 else b"\1", abs(tag.alt) / 1e3
    return exif.tobytes()


def _degrees(value: int) -> tuple[float, float, float]:
    """Degrees, minutes and seconds of 1e-7 degrees."""
    degrees, rest = divmod(abs(value), 10_000_000)
    minutes, rest = divmod(rest * 60, 10_000_000)
    return float(degrees), float(minutes), rest * 60 / 1e7
