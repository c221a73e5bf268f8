"""Barometer: samples keep coming (PX4's baroCheck)."""

from autopilot.commander.arming_checks.findings import ABSOLUTE_PRESSURE, Findings, Settings
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second forbids arming. In flight nothing is said of it, as measured on PX4 (inject_baro_off)."""
    baro = topics.sensor_baro
    if now_us - baro.timestamp <= TIMEOUT_US:
        return
    if topics.vehicle_status.armed:
        findings.unhealthy |= ABSOLUTE_PRESSURE
    elif baro.timestamp == 0:
        findings.forbid_arming(ABSOLUTE_PRESSURE, "Preflight Fail: barometer 0 missing")
    else:
        findings.forbid_arming(ABSOLUTE_PRESSURE, "Preflight Fail: No valid data from Baro 0")
