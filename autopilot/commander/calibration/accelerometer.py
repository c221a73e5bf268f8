"""Accelerometer calibration on six sides, and the quick one as it stands (PX4's accelerometer_calibration.cpp).

Six sides give offset and scale of each axis. SENS_BOARD_ROT is not revised: the simulated board is mounted straight.
"""

import math
from collections.abc import Generator

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.commander.calibration.orientation import (
    ALL_SIDES,
    CANCELLED,
    ERROR,
    GRAVITY_M_S2,
    OK,
    SIDES,
    Outcome,
    each_side,
)
from sitl_emu.autopilot.topics import Vector3

MEASURE_US = 5_000_000
SAMPLES = 1000
MOST_TRIES = 10
MOST_JUMP_M_S2 = 0.5
MOST_VARIANCE = 0.01
SIDE_PERCENT = 17
QUICK_US = 3_000_000
QUICK_SAMPLES = 300
MOST_QUICK_OFFSET_M_S2 = 2.5
"""More is no offset, but a vehicle that stands askew."""


def calibrate(bench: Bench) -> Steps:
    """Write CAL_ACC0_*."""
    bench.started("accel")
    forces: dict[int, Vector3] = {}

    def measure(side: int) -> Outcome:
        for _ in range(MOST_TRIES):
            bench.info(f"[cal] Hold still, measuring {SIDES[side]} side")
            force = yield from _mean(bench, MEASURE_US, SAMPLES)
            if bench.cancelled():
                return CANCELLED
            if force is not None:
                forces[side] = force
                x, y, z = force
                bench.info(f"[cal] {SIDES[side]} side result: [{x:.3f} {y:.3f} {z:.3f}]")
                bench.progress(SIDE_PERCENT * len(forces))
                return OK
        return ERROR

    outcome = yield from each_side(bench, ALL_SIDES, measure, lenient=False)
    fit = _fit(forces) if outcome == OK else None
    if fit is None:
        return (yield from bench.failed("accel"))
    offset, scale = fit
    bench.save("ACC", OFF=offset, SCALE=scale)
    return (yield from bench.done("accel"))


def calibrate_quickly(bench: Bench) -> Steps:
    """Write CAL_ACC0_*OFF so that the vehicle as it stands feels gravity alone; says nothing."""
    force = yield from _mean(bench, QUICK_US, QUICK_SAMPLES)
    if force is None:
        return False
    axis = max(range(3), key=lambda n: abs(force[n]))
    expected = [0.0, 0.0, 0.0]
    expected[axis] = math.copysign(GRAVITY_M_S2, force[axis])
    x, y, z = (f - e for f, e in zip(force, expected, strict=True))
    if math.hypot(x, y, z) > MOST_QUICK_OFFSET_M_S2:
        return False
    bench.save("ACC", OFF=(x, y, z), SCALE=(1.0, 1.0, 1.0))
    return True


def _mean(bench: Bench, duration_us: int, enough: int) -> Generator[None, None, Vector3 | None]:
    """The mean specific force at rest; None when there was too much motion. It begins anew after a jump."""
    start_us = bench.now_us
    first: Vector3 | None = None
    samples: list[Vector3] = []
    while bench.now_us - start_us < duration_us and len(samples) <= enough:
        heard = yield from bench.next_imu()
        if not heard or bench.asked is not None:
            return None
        force = bench.accel()
        if first is None or math.dist(force, first) > MOST_JUMP_M_S2:
            first, samples = force, []
        else:
            samples.append(force)
    if len(samples) < 2:
        return None
    n = len(samples)
    x, y, z = mean = tuple(sum(axis) / n for axis in zip(*samples, strict=True))
    variances = [
        sum((v - m) ** 2 for v in axis) / (n - 1) for axis, m in zip(zip(*samples, strict=True), mean, strict=True)
    ]
    return (x, y, z) if math.hypot(*variances) <= MOST_VARIANCE else None


def _fit(forces: dict[int, Vector3]) -> tuple[Vector3, Vector3] | None:
    """Offset and scale of each axis from the forces on its two sides; None where they are no scale."""
    offset, scale = [], []
    for axis in range(3):
        plus, minus = forces[2 * axis][axis], forces[2 * axis + 1][axis]
        half = 0.5 * (plus - minus)
        if not half > 0.0:
            return None
        offset.append(0.5 * (plus + minus))
        scale.append(GRAVITY_M_S2 / half)
    return (offset[0], offset[1], offset[2]), (scale[0], scale[1], scale[2])
