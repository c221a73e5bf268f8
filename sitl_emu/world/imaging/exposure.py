"""Exposure time and gain: fixed, or such that the picture's mean is as wanted.

No logarithm or power but of the setting itself: the same figures on every processor.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.image_sensor import ImageSensor

METERED = 4
"""Automatic exposure meters every fourth pixel of every fourth row."""
DARKEST = 1e-6
"""Mean light below which a picture is taken as this bright: it is black."""


class Exposure(NamedTuple):
    """How a frame is exposed; `light` is its brightness over that of the drawn picture."""

    light: float
    time_s: float
    gain: float


def exposed(sensor: ImageSensor, light: float) -> Exposure:
    """With a wanted brightness over the drawn picture's: longer first, then by gain, within the sensor's limits."""
    if sensor.exposure_s <= 0.0:
        gain = min(max(light, 1.0), sensor.gain_max)
        return Exposure(min(light, sensor.gain_max), 0.0, gain)
    time_s = min(max(sensor.exposure_s * light, sensor.exposure_min_s), max(sensor.exposure_max_s, sensor.exposure_s))
    gain = min(max(light * sensor.exposure_s / time_s, 1.0), sensor.gain_max)
    return Exposure(time_s / sensor.exposure_s * gain, time_s, gain)


def metered(picture: npt.NDArray[np.uint8]) -> float:
    """Mean light of a picture, 1 being white; its figures are square roots of light."""
    some = picture[::METERED, ::METERED].astype(np.int64)
    return max(float((some * some).sum()) / (some.size * 255.0**2), DARKEST)


def wanted(sensor: ImageSensor, picture: npt.NDArray[np.uint8], falloff: float) -> float:
    """The brightness over the drawn picture's that the settings ask for; `falloff`: the mean of vignetting."""
    by_setting: float = 2.0**sensor.exposure_ev
    return by_setting * sensor.level**2 / (metered(picture) * falloff) if sensor.auto_exposure else by_setting


def followed(before: float, now: float, elapsed_s: float, time_constant_s: float) -> float:
    """The brightness on its way from that of the frame before to what is wanted now: a first-order lag."""
    if time_constant_s <= 0.0 or elapsed_s <= 0.0:
        return now
    return before + (now - before) * elapsed_s / (time_constant_s + elapsed_s)
