"""Gyro calibration: the mean of 250 samples at rest is the offset (PX4's gyro_calibration.cpp)."""

import math
from collections.abc import Generator

from sitl_emu.autopilot.commander.calibration.bench import Bench, CancelWatch, Steps, changed
from sitl_emu.autopilot.sensors.sensor_calibration import is_calibrated
from sitl_emu.autopilot.topics import Vector3

SAMPLES = 250
REPORT_EVERY_PERCENT = 10
MOST_TRIES = 21
FAILED_TRIES = 20
"""Whoever needs so many has failed, though the last of them went well."""
LEAST_CHANGE_RAD_S = 0.01
"""A calibrated gyro keeps its offset unless it has changed by more (Gyroscope::set_offset)."""
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
        if offset is None:
            bench.critical("motion, retrying..")
        if (offset is None or isinstance(offset, str)) and attempt < MOST_TRIES:
            continue
        if offset is None or isinstance(offset, str) or attempt >= FAILED_TRIES:
            bench.critical("ERROR: Motion during calibration")
            break
        if is_calibrated(bench.parameters, "GYRO"):
            offset = changed(bench.corrections.gyro_offset, offset, LEAST_CHANGE_RAD_S)
        bench.save("GYRO", OFF=offset)
        return (yield from bench.done("gyro"))
    return (yield from bench.failed("gyro"))


def _measure(bench: Bench) -> Generator[None, None, Vector3 | str | None]:
    """The mean; None when the vehicle moved; CANCELLED or SILENT."""
    total = (0.0, 0.0, 0.0)
    last: list[Vector3] = []
    told = -1
    watch = CancelWatch(bench)
    for count in range(1, SAMPLES + 1):
        if watch.cancelled():
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
