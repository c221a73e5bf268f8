"""Barometer calibration: its altitude is made the GPS's (PX4's baro_calibration.cpp)."""

import math

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS, INTERNAL_PRIORITY

DURATION_US = 3_000_000
STEP_US = 100_000
LEAST_FIX = 2
MOST_EPV = 100.0
SEA_LEVEL_PA, SEA_LEVEL_K, LAPSE_K_M, EXPONENT = 101_325.0, 288.15, 0.0065, 0.0065 * 287.1 / 9.80665
"""lib/atmosphere."""
MOST_OFFSET_PA, NEAR_ENOUGH_M, MOST_HALVINGS = 10_000.0, 0.1, 100
LEAST_CHANGE_PA = 0.01
"""Barometer::set_offset."""


def calibrate(bench: Bench) -> Steps:
    """Write CAL_BARO0_OFF; without a GPS fix it fails at the end of its 3 s."""
    bench.started("baro")
    pressures_pa: list[float] = []
    altitudes_m: list[float] = []
    until_us = bench.now_us + DURATION_US
    before_pa = float(bench.parameters["CAL_BARO0_OFF"])
    while bench.now_us < until_us:
        yield from bench.sleep(STEP_US)
        baro, gps = bench.topics.sensor_baro, bench.topics.sensor_gps
        if baro.pressure_pa == baro.pressure_pa:
            pressures_pa.append(baro.pressure_pa)
        if gps.fix_type >= LEAST_FIX and gps.epv < MOST_EPV and bench.now_us - gps.timestamp < 1_000_000:
            altitudes_m.append(gps.altitude_msl_m)
    if not altitudes_m:
        bench.critical("[cal] calibration failed: GPS required for baro cal")
        return False
    if pressures_pa:
        bias_pa = _bias(sum(pressures_pa) / len(pressures_pa), sum(altitudes_m) / len(altitudes_m))
        if bias_pa is not None:
            bench.parameters.set("CAL_BARO0_ID", DEVICE_IDS["BARO"])
            bench.parameters.set("CAL_BARO0_PRIO", INTERNAL_PRIORITY)
            if abs(bias_pa) > LEAST_CHANGE_PA:
                bench.parameters.set("CAL_BARO0_OFF", before_pa + bias_pa)
    bench.info("[cal] calibration done: baro")
    return True


def _bias(pressure_pa: float, altitude_m: float) -> float | None:
    """How much too high the pressure is for the altitude, by halving, no closer than to 0.1 m; None where too much."""
    low, high = -MOST_OFFSET_PA, MOST_OFFSET_PA
    for _ in range(MOST_HALVINGS):
        middle = low + (high - low) / 2.0
        error_m = _altitude_m(pressure_pa - middle) - altitude_m
        if error_m > NEAR_ENOUGH_M:
            high = middle
        elif error_m < -NEAR_ENOUGH_M:
            low = middle
        else:
            return middle
    return None


def _altitude_m(pressure_pa: float) -> float:
    """By the standard atmosphere."""
    return (1.0 - math.pow(max(pressure_pa, 0.0) / SEA_LEVEL_PA, EXPONENT)) * SEA_LEVEL_K / LAPSE_K_M
