"""Barometer calibration: its altitude is made the GPS's (PX4's baro_calibration.cpp)."""

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS, INTERNAL_PRIORITY

DURATION_US = 3_000_000
STEP_US = 100_000
LEAST_FIX = 2
MOST_EPV = 100.0
SEA_LEVEL_PA, SEA_LEVEL_K, LAPSE_K_M, EXPONENT = 101_325.0, 288.15, 0.0065, 5.2561


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
            pressures_pa.append(baro.pressure_pa + before_pa)
        if gps.fix_type >= LEAST_FIX and gps.epv < MOST_EPV and bench.now_us - gps.timestamp < 1_000_000:
            altitudes_m.append(gps.altitude_msl_m)
    if not altitudes_m:
        bench.critical("[cal] calibration failed: GPS required for baro cal")
        return False
    if pressures_pa:
        altitude_m = sum(altitudes_m) / len(altitudes_m)
        expected_pa = SEA_LEVEL_PA * max(1.0 - LAPSE_K_M * altitude_m / SEA_LEVEL_K, 0.0) ** EXPONENT
        bench.parameters.set("CAL_BARO0_ID", DEVICE_IDS["BARO"])
        bench.parameters.set("CAL_BARO0_PRIO", INTERNAL_PRIORITY)
        bench.parameters.set("CAL_BARO0_OFF", sum(pressures_pa) / len(pressures_pa) - expected_pa)
    bench.info("[cal] calibration done: baro")
    return True
