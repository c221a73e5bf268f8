"""Gyro calibration: the mean of 250 samples at rest is the offset (PX4's gyro_calibration.cpp)."""

import math
from collections.abc import Generator

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.topics import Vector3

SAMPLES = 250
REPORT_EVERY_PERCENT = 10
MOST_TRIES = 20
MOST_ERROR_RAD_S = math.radians(0.6)
MEDIAN_OF = 9
CANCELLED, SILENT = "cancelled", "silent"


def calibrate(bench: Bench) -> Steps:
    """Try until the vehicle stands still; write CAL_GYRO0_*."""
    bench.started("gyro")
    for attempt in range(1, MOST_TRIES + 1):
        offset = yield from _measure(bench)
        if offset == CANCELLED:
            break
        if offset is not None and not isinstance(offset, str):
            bench.save("GYRO", OFF=offset)
            return (yield from bench.done("gyro"))
        if offset is None:
            bench.critical("motion, retrying..")
        if attempt == MOST_TRIES:
            bench.critical("ERROR: Motion during calibration")
    return (yield from bench.failed("gyro"))


def _measure(bench: Bench) -> Generator[None, None, Vector3 | str | None]:
    """The mean; None when the vehicle moved; CANCELLED or SILENT."""
    total = (0.0, 0.0, 0.0)
    last: list[Vector3] = []
    told = -1
    for count in range(1, SAMPLES + 1):
        if bench.cancelled():
            return CANCELLED
        heard = yield from bench.next_imu()
        if not heard:
            bench.silent_sensor()
            return SILENT
        x, y, z = sample = bench.gyro()
        total = (total[0] + x, total[1] + y, total[2] + z)
        last = [*last[1 - MEDIAN_OF :], sample]
        percent = 100 * count // SAMPLES
        if percent % REPORT_EVERY_PERCENT == 0 and percent != told:
            told = percent
            bench.progress(percent)
    mean = (total[0] / SAMPLES, total[1] / SAMPLES, total[2] / SAMPLES)
    medians = (sorted(axis)[MEDIAN_OF // 2] for axis in zip(*last, strict=True))
    if any(abs(median - m) > MOST_ERROR_RAD_S for median, m in zip(medians, mean, strict=True)):
        return None
    return mean
