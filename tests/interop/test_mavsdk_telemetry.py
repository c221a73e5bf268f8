"""MAVSDK telemetry: every stream that PX4 has comes, with values that agree; rates can be chosen."""

import math
from typing import Any

import pytest
from mavsdk.plugins.telemetry import FixType, FlightMode, LandedState, TelemetryError

from tests.interop.mavsdk_vehicle import Vehicle, until

FIELD_HEIGHT_M = 489.4
"""PX4's default home, above mean sea level."""
RATED = """
    altitude attitude_euler attitude_quaternion battery distance_sensor fixedwing_metrics gps_info home imu landed_state
    odometry position position_velocity_ned raw_gps unix_epoch_time velocity_ned
"""
STREAMS = RATED + "attitude_angular_velocity_body heading health scaled_pressure vtol_state"


@pytest.mark.parametrize("stream", STREAMS.split())
def test_a_stream_comes(vehicle: Vehicle, stream: str) -> None:
    assert until(vehicle.telemetry, stream) is not None


@pytest.mark.parametrize("stream", RATED.split())
def test_a_rate_can_be_chosen(vehicle: Vehicle, stream: str) -> None:
    getattr(vehicle.telemetry, f"set_rate_{stream}")(10.0)


@pytest.mark.parametrize("stream", ["actuator_control_target", "raw_imu"])
def test_a_stream_that_px4_does_not_have_is_refused(vehicle: Vehicle, stream: str) -> None:
    with pytest.raises(TelemetryError):
        getattr(vehicle.telemetry, f"set_rate_{stream}")(10.0)


def test_a_vehicle_that_stands_says_so(vehicle: Vehicle) -> None:
    telemetry = vehicle.telemetry
    vehicle.until_ready()
    assert not telemetry.armed() and not telemetry.in_air()
    assert telemetry.flight_mode() == FlightMode.HOLD
    assert telemetry.landed_state() == LandedState.ON_GROUND
    assert telemetry.gps_info().fix_type == FixType.FIX_3D
    position, velocity = telemetry.position(), telemetry.velocity_ned()
    assert position.absolute_altitude_m == pytest.approx(FIELD_HEIGHT_M, abs=3.0)
    assert position.relative_altitude_m == pytest.approx(0.0, abs=1.5)
    assert math.hypot(velocity.north_m_s, velocity.east_m_s) < 0.5
    assert until(telemetry, "battery").remaining_percent == pytest.approx(100.0, abs=60.0)
    origin = telemetry.get_gps_global_origin()
    assert (origin.latitude_deg, origin.longitude_deg) == pytest.approx((47.3977, 8.5456), abs=1e-3)


def test_arming_is_told_in_words(vehicle: Vehicle) -> None:
    vehicle.until_ready()
    texts: list[str] = []

    def keep(text: Any, _user_data: Any) -> None:
        texts.append(text.text)

    handle = vehicle.telemetry.subscribe_status_text(keep)
    vehicle.action.arm()
    until(vehicle.telemetry, "armed", bool)
    vehicle.action.disarm()
    vehicle.until_disarmed()
    until(vehicle.telemetry, "position", lambda _: any("Disarmed" in text for text in texts))
    vehicle.telemetry.unsubscribe_status_text(handle)
    assert any("Armed" in text for text in texts)
