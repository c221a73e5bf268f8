"""MAVSDK action: arm, fly, orbit, return, and what is refused; a restart and a shutdown are real."""

import math
from functools import partial
from typing import Any

import pytest
from mavsdk.plugins.action import ActionError, ActionResult, OrbitYawBehavior, RelayCommand
from mavsdk.plugins.telemetry import FlightMode, LandedState

from tests.interop.mavsdk_vehicle import METRES_PER_DEGREE, Vehicle, connected, distance_m, place, until

INSTANCE_TO_END = 0


def test_altitudes_are_kept_in_parameters(vehicle: Vehicle) -> None:
    action = vehicle.action
    action.set_takeoff_altitude(7.0)
    assert (action.get_takeoff_altitude(), vehicle.param.get_param_float("MIS_TAKEOFF_ALT")) == (7.0, 7.0)
    before = action.get_return_to_launch_altitude()
    action.set_return_to_launch_altitude(20.0)
    assert (action.get_return_to_launch_altitude(), vehicle.param.get_param_float("RTL_RETURN_ALT")) == (20.0, 20.0)
    action.set_return_to_launch_altitude(before)


def beyond(lat_deg: float, side: float, place: Any) -> bool:
    """Six metres north (1) or south (-1) of a latitude."""
    return bool(side * (place.latitude_deg - lat_deg) * METRES_PER_DEGREE > 6.0)


def test_a_whole_flight(vehicle: Vehicle) -> None:
    action, telemetry = vehicle.action, vehicle.telemetry
    start = vehicle.take_off(10.0)
    until(telemetry, "landed_state", lambda state: state == LandedState.IN_AIR)
    with pytest.raises(ActionError) as told:
        action.disarm()
    assert told.value.result == ActionResult.COMMAND_DENIED

    ground_m = telemetry.position().absolute_altitude_m - telemetry.position().relative_altitude_m
    lat, lon = place(20.0, 0.0, start.latitude_deg, start.longitude_deg)
    action.goto_location(lat, lon, ground_m + 15.0, math.nan)
    until(telemetry, "position", lambda now: distance_m(now, start) > 19.0 and now.relative_altitude_m > 14.0)

    action.set_current_speed(3.0)
    action.do_orbit(8.0, 3.0, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, lat, lon, ground_m + 15.0)
    centre = telemetry.position()
    centre.latitude_deg, centre.longitude_deg = lat, lon
    for side in (1.0, -1.0):
        until(telemetry, "position", partial(beyond, lat, side))
        assert distance_m(telemetry.position(), centre) == pytest.approx(8.0, abs=2.0)
    action.hold()
    vehicle.until_mode(FlightMode.HOLD)

    action.set_return_to_launch_altitude(15.0)
    action.return_to_launch()
    vehicle.until_mode(FlightMode.RETURN_TO_LAUNCH)
    vehicle.until_disarmed()
    assert distance_m(telemetry.position(), start) < 1.5


def test_killing_stops_the_motors_at_once(vehicle: Vehicle) -> None:
    vehicle.until_ready()
    vehicle.action.arm()
    until(vehicle.telemetry, "armed", bool)
    vehicle.action.kill()
    vehicle.until_disarmed()


@pytest.mark.parametrize(
    ("call", "results"),
    [
        (lambda action: action.set_relay(0, RelayCommand.ON), {ActionResult.UNSUPPORTED}),
        (
            lambda action: action.transition_to_fixedwing(),
            {ActionResult.VTOL_TRANSITION_SUPPORT_UNKNOWN, ActionResult.NO_VTOL_TRANSITION_SUPPORT},
        ),
    ],
)
def test_what_a_quadrotor_does_not_have_is_told(vehicle: Vehicle, call, results) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ActionError) as told:
        call(vehicle.action)
    assert told.value.result in results


def test_a_terminated_vehicle_flies_again_after_a_restart_and_ends_on_shutdown() -> None:
    with connected("iris", INSTANCE_TO_END) as vehicle:
        vehicle.until_ready()
        with pytest.raises(ActionError) as told:
            vehicle.action.terminate()  # PX4 terminates flights only
        assert told.value.result == ActionResult.COMMAND_DENIED
        vehicle.action.arm()
        vehicle.action.terminate()
        vehicle.action.kill()
        vehicle.until_disarmed()
        vehicle.action.reboot()
        until(vehicle.telemetry, "odometry", lambda now: now.time_usec < 10_000_000)
        vehicle.until_ready()
        vehicle.action.arm()
        until(vehicle.telemetry, "armed", bool)
        vehicle.action.disarm()
        vehicle.until_disarmed()
        vehicle.action.shutdown()
        until(vehicle.system, "is_connected", lambda connected: not connected)
