"""Airspeed calibration of a vehicle without such a sensor (PX4's airspeed_calibration.cpp): it waits, and fails."""

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps

WAIT_US = 30_000_000
FAILURE_PAUSE_US = 5_000_000


def calibrate(bench: Bench) -> Steps:
    """Nothing is measured and nothing written."""
    bench.started("airspeed")
    bench.critical("[cal] Ensure sensor is not measuring wind")
    until_us = bench.now_us + WAIT_US
    while bench.now_us < until_us:
        if bench.cancelled():
            return False
        yield
    yield from bench.sleep(FAILURE_PAUSE_US)
    bench.critical("[cal] calibration failed: airspeed")
    return False
