"""Failure injection: what can fail, what can't, and a GPS that falls silent."""

import time
from typing import Any

import pytest

INJECT_FAILURE, REQUEST_MESSAGE, SYS_STATUS = 420, 512, 1
ACCEPTED, UNSUPPORTED = 0, 3
GPS, GYRO, BATTERY, RC_SIGNAL, NO_UNIT = 4, 0, 100, 104, 77
OK, OFF, SLOW = 0, 1, 5
GPS_HEALTH = 0x20

pytestmark = pytest.mark.covers("MAV_CMD_INJECT_FAILURE", source="https://docs.px4.io/v1.18/en/debug/failure_injection")


def gps_is_healthy(station: Any) -> bool:
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, SYS_STATUS, *(0.0,) * 6)
    return bool(station.receive("SYS_STATUS").onboard_control_sensors_health & GPS_HEALTH)


def wait_for_gps(station: Any, healthy: bool, limit_s: float) -> bool:
    end_s = time.monotonic() + limit_s
    while time.monotonic() < end_s:
        if gps_is_healthy(station) is healthy:
            return True
        station.collect("HEARTBEAT", 0.3)
    return False


@pytest.mark.covers("COMMAND_ACK", source="measured: mending what is well is accepted")
@pytest.mark.parametrize("unit", [GYRO, GPS, BATTERY])
def test_what_is_well_stays_well(station: Any, unit: int) -> None:
    assert station.command(INJECT_FAILURE, unit, OK) == ACCEPTED


@pytest.mark.parametrize(("unit", "kind"), [(NO_UNIT, OFF), (GPS, SLOW), (RC_SIGNAL, OFF)])
def test_what_px4_cannot_let_fail_is_unsupported(station: Any, unit: int, kind: int) -> None:
    assert station.command(INJECT_FAILURE, unit, kind) == UNSUPPORTED


@pytest.mark.covers("SYS_STATUS", source="measured: without its GPS a vehicle on the ground is not ready within 6 s")
def test_a_gps_that_is_off_and_comes_back(station: Any) -> None:
    assert gps_is_healthy(station)
    assert station.command(INJECT_FAILURE, GPS, OFF) == ACCEPTED
    try:
        assert wait_for_gps(station, healthy=False, limit_s=10.0)
    finally:
        assert station.command(INJECT_FAILURE, GPS, OK) == ACCEPTED
    assert wait_for_gps(station, healthy=True, limit_s=10.0)
    station.wait_until_ready()
