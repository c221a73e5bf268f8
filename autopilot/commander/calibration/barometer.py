"""Barometer calibration: its altitude is made the GPS's (PX4's baro_calibration.cpp)."""

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.sensors.baro_gnss_calibration import offset_pa, save_offset

DURATION_US = 3_000_000
STEP_US = 100_000
LEAST_FIX = 2
MOST_EPV = 100.0
SEA_LEVEL_HPA = 1013.25
"""lib/atmosphere."""


def calibrate(bench: Bench) -> Steps:
    """Write CAL_BARO0_OFF; without a GPS fix it fails at the end of its 3 s."""
    bench.started("baro")
    pressures_pa: list[float] = []
    altitudes_m: list[float] = []
    until_us = bench.now_us + DURATION_US
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
        mean_pa, mean_m = sum(pressures_pa) / len(pressures_pa), sum(altitudes_m) / len(altitudes_m)
        more_pa = offset_pa(mean_pa, mean_m, SEA_LEVEL_HPA)
        if more_pa is not None:
            save_offset(bench.parameters, more_pa)
    bench.info("[cal] calibration done: baro")
    return True
