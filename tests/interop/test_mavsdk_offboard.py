"""MAVSDK offboard: every kind of setpoint that PX4 takes is flown; without one it can't be started."""

from collections.abc import Iterator

import pytest
from mavsdk.plugins.offboard import (
    AccelerationNed,
    Attitude,
    AttitudeRate,
    Offboard,
    OffboardError,
    OffboardResult,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.plugins.telemetry import FlightMode, Position

from tests.interop.mavsdk_vehicle import Vehicle, distance_m, until

PATIENT_S = 10.0
"""COM_OF_LOSS_T meanwhile: the vehicle's time runs faster than that of a busy machine's MAVSDK."""


@pytest.fixture
def offboard(vehicle: Vehicle) -> Iterator[Offboard]:
    with vehicle.with_param("COM_OF_LOSS_T", PATIENT_S):
        plugin = Offboard(vehicle.system)
        yield plugin
        vehicle.put_down()  # while it is still patient


def test_without_a_setpoint_it_cannot_be_started(vehicle: Vehicle) -> None:
    plugin = Offboard(vehicle.system)
    with pytest.raises(OffboardError) as told:
        plugin.start()
    assert told.value.result == OffboardResult.NO_SETPOINT_SET
    assert not plugin.is_active()


def test_positions_velocities_attitudes_and_rates_are_flown(offboard: Offboard, vehicle: Vehicle) -> None:
    telemetry = vehicle.telemetry
    start = vehicle.take_off(10.0)
    here = telemetry.position_velocity_ned().position
    offboard.set_position_ned(PositionNedYaw(here.north_m + 10.0, here.east_m, -12.0, 0.0))
    offboard.start()
    assert offboard.is_active()
    vehicle.until_mode(FlightMode.OFFBOARD)

    def near(position: Position) -> bool:
        return 9.0 < distance_m(position, start) < 11.0 and position.relative_altitude_m > 11.0

    until(telemetry, "position", near)
    offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 90.0))
    until(telemetry, "velocity_ned", lambda velocity: velocity.east_m_s > 1.8 and abs(velocity.north_m_s) < 0.3)
    until(telemetry, "heading", lambda heading: abs(heading.heading_deg - 90.0) < 5.0)
    offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, -1.0, 30.0))
    until(telemetry, "velocity_ned", lambda velocity: velocity.down_m_s < -0.8)
    until(telemetry, "attitude_angular_velocity_body", lambda rates: 0.4 < rates.yaw_rad_s < 0.65)
    offboard.set_acceleration_ned(AccelerationNed(1.0, 0.0, 0.0))
    until(telemetry, "velocity_ned", lambda velocity: velocity.north_m_s > 1.0)
    offboard.set_attitude(Attitude(0.0, 10.0, 0.0, 0.6))
    until(telemetry, "attitude_euler", lambda attitude: 8.0 < attitude.pitch_deg < 12.0)
    offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 40.0, 0.6))
    until(telemetry, "attitude_angular_velocity_body", lambda rates: 0.55 < rates.yaw_rad_s < 0.85)
    offboard.stop()
    assert not offboard.is_active()
    vehicle.until_mode(FlightMode.HOLD)
