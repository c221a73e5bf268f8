"""Which side of the vehicle is down, and a measurement on each side in turn (PX4's calibration_routines.cpp)."""

import math
from collections.abc import Callable, Generator

from sitl_emu.autopilot.commander.calibration.bench import TEXT_US, Bench

SIDES = ("back", "front", "left", "right", "up", "down")
"""By the axis along which gravity's counterforce points: +x, -x, +y, -y, +z, -z."""
ALL_SIDES = (1 << len(SIDES)) - 1
GRAVITY_M_S2 = 9.80665
AVERAGE_S = 0.5
STILL_M_S2 = 0.25
LENIENCE = 3.0
STILL_US, LENIENT_STILL_US = 1_300_000, 500_000
TIMEOUT_US = 90_000_000
LATE_SAMPLES = 1000
"""So many are still taken after that."""
MOST_FORCE_ERROR_M_S2 = 5.0
MOST_FAILURES = 4
MOTION_PAUSE_US = 200_000
SIDE_PAUSE_US = 200_000
CANCELLED, ERROR, OK = "cancelled", "error", "ok"
Outcome = Generator[None, None, str]
"""Ends with CANCELLED, ERROR or OK."""


def detect(bench: Bench, *, lenient: bool) -> Generator[None, None, int | None]:
    """Wait until the vehicle is at rest; the index of its side in SIDES, None where that can't be told."""
    still_us = LENIENT_STILL_US if lenient else STILL_US
    threshold = (STILL_M_S2 * (LENIENCE if lenient else 1.0)) ** 2
    average, dispersion = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    rest_us: int | None = None
    last_us, late = bench.now_us, 0
    timeout_us = last_us + TIMEOUT_US
    while rest_us is None or bench.now_us <= rest_us + still_us:
        heard = yield from bench.next_imu()
        late += bench.now_us > timeout_us
        if not heard or late > LATE_SAMPLES:
            bench.silent_sensor()
            return None
        weight, last_us = (bench.now_us - last_us) * 1e-6 / AVERAGE_S, bench.now_us
        for axis, value in enumerate(bench.topics.vehicle_acceleration.xyz):
            error = value - average[axis]
            average[axis] += error * weight
            dispersion[axis] = max(dispersion[axis] * (1.0 - weight), min(error * error, 8.0 * threshold))
        if max(dispersion) < threshold:
            if rest_us is None:
                bench.info("[cal] detected rest position, hold still...")
                rest_us = bench.now_us
                timeout_us = rest_us + TIMEOUT_US
        elif rest_us is not None and max(dispersion) > 4.0 * threshold:
            bench.info("[cal] detected motion, hold still...")
            yield from bench.sleep(MOTION_PAUSE_US)
            rest_us = None
    for side in range(len(SIDES)):
        expected = [0.0, 0.0, 0.0]
        expected[side // 2] = math.copysign(GRAVITY_M_S2, 0.5 - side % 2)
        if all(abs(a - e) < MOST_FORCE_ERROR_M_S2 for a, e in zip(average, expected, strict=True)):
            return side
    bench.critical("ERROR: invalid orientation")
    return None


def each_side(bench: Bench, sides: int, measure: Callable[[int], Outcome], *, lenient: bool) -> Outcome:
    """Run `measure` on every side of the mask `sides`, in the order in which the vehicle is turned to them.

    Between two sides alone it is looked whether somebody cancels.
    """
    started_us = bench.now_us
    pending = [side for side in range(len(SIDES)) if sides >> side & 1]
    failures = 0
    while True:
        if bench.cancelled(started_us):
            return CANCELLED
        if failures > MOST_FAILURES:
            bench.critical("[cal] calibration failed: timeout: no motion")
            return ERROR
        if not pending:
            return OK
        bench.info("[cal] pending: " + " ".join(SIDES[side] for side in pending))
        yield from bench.sleep(TEXT_US)
        bench.info("[cal] hold vehicle still on a pending side")
        yield from bench.sleep(TEXT_US)
        side = yield from detect(bench, lenient=lenient)
        if side is None:
            failures += 1
            bench.info("[cal] detected motion, hold still...")
            yield from bench.sleep(TEXT_US)
            continue
        if side not in pending:
            failures += 1
            bench.info(f"[cal] {SIDES[side]} side already completed")
            yield from bench.sleep(TEXT_US)
            continue
        yield from _twice(bench, f"[cal] {SIDES[side]} orientation detected")
        failures = 0
        outcome = yield from measure(side)
        if outcome != OK:
            return outcome
        yield from _twice(bench, f"[cal] {SIDES[side]} side done, rotate to a different side")
        pending.remove(side)
        yield from bench.sleep(SIDE_PAUSE_US)


def _twice(bench: Bench, text: str) -> Generator[None, None, None]:
    for _ in range(2):
        bench.info(text)
        yield from bench.sleep(TEXT_US)
