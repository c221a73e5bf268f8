"""MAVSDK failure: sensors fail when they may, and work again; what cannot fail is told."""

import pytest
from mavsdk.plugins.failure import Failure, FailureError, FailureResult, FailureType, FailureUnit

from tests.interop.mavsdk_vehicle import Vehicle, until

ENABLED, DISABLED = 1, 0


def test_without_gps_there_is_no_global_position_until_it_is_back(vehicle: Vehicle) -> None:
    failure = Failure(vehicle.system)
    vehicle.until_ready()
    failure.inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    try:
        until(vehicle.telemetry, "health", lambda health: not health.is_global_position_ok)
    finally:
        failure.inject(FailureUnit.SENSOR_GPS, FailureType.OK, 0)
    until(vehicle.telemetry, "health", lambda health: health.is_global_position_ok)
    vehicle.until_ready()


def test_what_cannot_fail_is_told(vehicle: Vehicle) -> None:
    with pytest.raises(FailureError) as told:
        Failure(vehicle.system).inject(FailureUnit.SYSTEM_AVOIDANCE, FailureType.OFF, 0)
    assert told.value.result == FailureResult.UNSUPPORTED


def test_failures_can_be_switched_off_as_a_whole(vehicle: Vehicle) -> None:
    vehicle.param.set_param_int("SYS_FAILURE_EN", DISABLED)
    try:
        with pytest.raises(FailureError) as told:
            Failure(vehicle.system).inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
        # MAVSDK says DISABLED once it knows the parameter; until then the vehicle says DENIED.
        assert told.value.result in (FailureResult.DISABLED, FailureResult.DENIED)
    finally:
        vehicle.param.set_param_int("SYS_FAILURE_EN", ENABLED)
