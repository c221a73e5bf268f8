"""Airspeed calibration of a vehicle without such a sensor (PX4's airspeed_calibration.cpp): it waits, and fails."""

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps

WAIT_US = 30_000_000
ADVICE_PAUSE_US, LOOK_EVERY_US = 500_000, 10_000
FAILURE_PAUSE_US = 5_000_000


def calibrate(bench: Bench) -> Steps:
    """Nothing is measured and nothing written."""
    started_us = bench.now_us
    bench.started("airspeed")
    bench.critical("[cal] Ensure sensor is not measuring wind")
    yield from bench.sleep(ADVICE_PAUSE_US)
    while bench.now_us - started_us < WAIT_US:
        if bench.cancelled(started_us):
            return False
        yield from bench.sleep(LOOK_EVERY_US)
    yield from bench.sleep(FAILURE_PAUSE_US)
    bench.critical("[cal] calibration failed: airspeed")
    return False
