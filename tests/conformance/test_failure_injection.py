"""Failure injection: what can fail, what can't, and a GPS that falls silent."""

import time
from typing import Any

import pytest

INJECT_FAILURE = 420
ACCEPTED, UNSUPPORTED = 0, 3
GPS, GYRO, BATTERY, RC_SIGNAL, NO_UNIT = 4, 0, 100, 104, 77
OK, OFF, SLOW = 0, 1, 5
GPS_SENSOR, XY_POSITION_CONTROL, PREARM_CHECK = 0x20, 0x4000, 0x10000000
"""MAV_SYS_STATUS_SENSOR."""
LIMIT_S = 60.0

pytestmark = pytest.mark.covers("MAV_CMD_INJECT_FAILURE", source="https://docs.px4.io/v1.18/en/debug/failure_injection")


def status_when(station: Any, **wanted: bool) -> Any:
    """The first SYS_STATUS in which the vehicle is `ready` for its mode, or a GPS is `present`, as wanted."""
    end_s = time.monotonic() + LIMIT_S
    while (status := station.receive("SYS_STATUS")) is not None and time.monotonic() < end_s:
        found = {
            "ready": bool(status.onboard_control_sensors_health & PREARM_CHECK),
            "present": bool(status.onboard_control_sensors_present & GPS_SENSOR),
        }
        if found | wanted == found:
            return status
    raise TimeoutError(f"not {wanted} within {LIMIT_S} s")


@pytest.mark.covers("COMMAND_ACK", source="measured flights/inject_*: mending what is well is accepted")
@pytest.mark.parametrize("unit", [GYRO, GPS, BATTERY])
def test_what_is_well_stays_well(station: Any, unit: int) -> None:
    assert station.command(INJECT_FAILURE, unit, OK) == ACCEPTED


@pytest.mark.parametrize(("unit", "kind"), [(NO_UNIT, OFF), (GPS, SLOW), (RC_SIGNAL, OFF)])
def test_what_px4_cannot_let_fail_is_unsupported(station: Any, unit: int, kind: int) -> None:
    assert station.command(INJECT_FAILURE, unit, kind) == UNSUPPORTED


@pytest.mark.covers("SYS_STATUS", source="measured flights/inject_on_ground: after 6 s it is no longer ready")
@pytest.mark.covers("SYS_STATUS", source="PX4 src/modules/commander/HealthAndArmingChecks/checks/estimatorCheck.cpp")
def test_a_gps_that_is_off_and_comes_back(station: Any) -> None:
    """The position is lost, and then GPS is not there; a sensor that is silent is not unhealthy."""
    status_when(station, ready=True, present=True)
    assert station.command(INJECT_FAILURE, GPS, OFF) == ACCEPTED
    try:
        lost = status_when(station, ready=False)
        assert not lost.onboard_control_sensors_health & XY_POSITION_CONTROL
        silent = status_when(station, present=False)
        assert silent.onboard_control_sensors_health & GPS_SENSOR
    finally:
        assert station.command(INJECT_FAILURE, GPS, OK) == ACCEPTED
    status_when(station, ready=True, present=True)
    station.wait_until_ready()
