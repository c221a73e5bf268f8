"""What the commander makes of a battery: warnings, the way home, and turning off."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import FakeVehicle
from .test_commander_failsafe import HOLD_TEXT, NAV_LAND, events_told, flying


@pytest.mark.parametrize(("action", "modes"), [(0, []), (1, []), (3, ["AUTO_LOITER", "AUTO_RTL"])])
def test_a_battery_that_does_not_last_for_the_way_home(action: int, modes: list[str]) -> None:
    """COM_FLTT_LOW_ACT; the way home from 60 m takes 20 to 60 s, and a safe estimate 100 s more."""
    vehicle = flying(COM_FLTT_LOW_ACT=action)
    vehicle.reposition(60.0, 0.0, 10.0)
    vehicle.run(15.0)
    vehicle.battery = vehicle.battery._replace(time_remaining_s=300.0)
    vehicle.run(3.0)
    assert not now(vehicle.topics.failsafe_flags.battery_low_remaining_time)
    vehicle.battery = vehicle.battery._replace(time_remaining_s=110.0)
    vehicle.run(6.0)
    assert now(vehicle.topics.failsafe_flags.battery_low_remaining_time)
    assert vehicle.modes[-len(modes) :] == modes or not modes
    assert vehicle.mode is (NavState.AUTO_RTL if action == 3 else NavState.AUTO_LOITER)


def test_a_battery_of_unknown_capacity_says_nothing_of_the_way_home() -> None:
    vehicle = flying()
    vehicle.battery = vehicle.battery._replace(time_remaining_s=math.nan)
    vehicle.run(3.0)
    assert not vehicle.topics.failsafe_flags.battery_low_remaining_time


def test_a_battery_warning_stays_until_the_vehicle_is_disarmed() -> None:
    vehicle = flying(COM_LOW_BAT_ACT=0)
    vehicle.battery = vehicle.battery._replace(warning=2)
    vehicle.run(0.3)
    vehicle.battery = vehicle.battery._replace(warning=0)
    vehicle.run(1.0)
    assert vehicle.topics.failsafe_flags.battery_warning == 2
    vehicle.result(NAV_LAND)
    vehicle.run_until_disarmed()
    vehicle.run(0.2)
    assert vehicle.topics.failsafe_flags.battery_warning == 0


def test_a_battery_that_disconnects_in_flight_is_a_critical_one() -> None:
    """And stays one when it is back; one that was not there when the vehicle was armed is not missed."""
    vehicle = flying(COM_LOW_BAT_ACT=2)
    battery = vehicle.battery
    vehicle.battery = battery._replace(connected=False)
    vehicle.run(6.0)
    assert "Battery 1 disconnected" in vehicle.take_texts()
    assert "check_battery_disconnected" in events_told(vehicle)
    assert vehicle.mode is NavState.AUTO_LAND
    vehicle.battery = battery
    vehicle.run(1.0)
    assert vehicle.topics.failsafe_flags.battery_warning == 2
    bare = FakeVehicle()
    bare.battery = battery._replace(connected=False)
    bare.run(3.0)
    bare.take_off(10.0)
    assert bare.topics.failsafe_flags.battery_warning == 0


def test_a_battery_that_was_low_when_it_was_armed_is_only_warned_of() -> None:
    """Arming with it was allowed by COM_ARM_BAT_MIN (PX4's _battery_warning_at_arming)."""
    vehicle = FakeVehicle(COM_LOW_BAT_ACT=2, COM_ARM_BAT_MIN=0.0)
    vehicle.battery = vehicle.battery._replace(warning=2, remaining=0.06)
    vehicle.run(3.0)
    assert vehicle.arm() == 0
    vehicle.run(6.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert HOLD_TEXT not in vehicle.take_texts()
    vehicle.battery = vehicle.battery._replace(warning=3)
    vehicle.run(0.3)
    assert HOLD_TEXT in vehicle.take_texts()


def test_an_empty_battery_turns_off_who_is_not_armed() -> None:
    """PX4's Commander::battery_status_check asks for a shutdown in 60 s, and commands nothing until then."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.battery = vehicle.battery._replace(warning=3)
    vehicle.take_texts()
    vehicle.run(0.2)
    assert "Dangerously low battery! Shutting system down in 60 seconds" in vehicle.take_texts()
    assert events_told(vehicle)[-1] == "commander_low_bat_shutdown"  # before any failsafe, or another round of checks
    assert vehicle.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) is None
    vehicle.run(58.0)
    assert not now(vehicle.topics.vehicle_commands)
    vehicle.run(5.0)
    (record,) = vehicle.topics.vehicle_commands
    assert (record.command.command, record.command.param1) == (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 2.0)
