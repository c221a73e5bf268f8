"""The table of commands: every row has who decides on it, and every owner decides on what the table gives it."""

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.commands.table import (
    ACCEPTED,
    COMMANDS,
    FENCE,
    FIXED,
    RALLY,
    UNSUPPORTED,
    Owner,
    Role,
    commands_of,
    items_where,
)
from sitl_emu.autopilot.mavlink.command_params import used_params
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.autopilot.vehicle_kind import Traits, VehicleKind
from sitl_emu.core import dialect as mavlink

OF_LINKS = (Owner.MESSAGE_REQUEST, Owner.MESSAGE_INTERVAL, Owner.LOG_STREAMING)
MULTICOPTER, ROVER = (kind.traits for kind in (VehicleKind.MULTICOPTER, VehicleKind.ROVER_ACKERMANN))


@pytest.fixture(scope="module")
def equipped() -> Autopilot:
    """A hexacopter with everything that owns commands: camera trigger and gimbal as well."""
    return Autopilot({**vehicles.load("sihsim_hex").airframe, "TRIG_MODE": 1, "MNT_MODE_IN": 4}, 0)


@pytest.mark.parametrize("number", COMMANDS)
def test_every_command_with_an_owner_comes_to_it(equipped: Autopilot, number: int) -> None:
    command = COMMANDS[number]
    if command.owner in OF_LINKS:
        assert number not in equipped.commands.owners
    elif command.owner is None and command.otherwise == UNSUPPORTED:
        assert equipped.commands.handle(0, VehicleCommand(number)) == (UNSUPPORTED, 0, 0)
    else:
        owner = equipped.commands.owners[number]
        if command.owner not in (None, Owner.COMMANDER):
            assert owner is not equipped.commander
            assert commands_of(command.owner) == owner.COMMANDS
        else:
            assert owner is equipped.commander


def test_the_commander_has_a_handler_for_each_of_its_commands(equipped: Autopilot) -> None:
    answered = equipped.commander.COMMANDS - set(FIXED)
    assert answered == commands_of(Owner.COMMANDER)


def test_where_the_gimbal_does_not_run_nobody_answers_its_commands() -> None:
    bare = Autopilot(vehicles.load("sihsim_hex").airframe, 0)
    for owner in (Owner.GIMBAL, Owner.CAMERA_TRIGGER):
        for number in commands_of(owner):
            assert bare.commands.handle(0, VehicleCommand(number)) is None


def test_a_camera_trigger_starts_with_mavlink_as_its_interface_alone() -> None:
    """Of interfaces PX4's simulated vehicles know no other (camera_trigger.cpp)."""
    hexacopter = vehicles.load("sihsim_hex").airframe
    assert Autopilot({**hexacopter, "TRIG_MODE": 1, "TRIG_INTERFACE": 3}, 0).camera_trigger is not None
    assert Autopilot({**hexacopter, "TRIG_MODE": 1, "TRIG_INTERFACE": 4}, 0).camera_trigger is None


def test_every_number_is_a_mav_cmd() -> None:
    """Or one of PX4's own three."""
    assert {number for number in COMMANDS if number not in mavlink.enums["MAV_CMD"]} == {0, 1, 2}


def test_a_command_acts_only_where_somebody_owns_it() -> None:
    assert all(command.owner is not None for command in COMMANDS.values() if not command.acts)
    assert set(FIXED.values()) == {None, ACCEPTED}


@pytest.mark.parametrize(
    ("name", "traits", "in_plan", "used"),
    [
        ("NAV_WAYPOINT", MULTICOPTER, True, "124567"),
        ("NAV_TAKEOFF", MULTICOPTER, False, "14567"),
        ("NAV_TAKEOFF", ROVER, False, "4567"),
        ("NAV_VTOL_TAKEOFF", MULTICOPTER, False, "34567"),
        ("NAV_VTOL_TAKEOFF", MULTICOPTER, True, "4567"),
        ("DO_SET_GLOBAL_ORIGIN", MULTICOPTER, False, "567"),
        ("DO_SET_GLOBAL_ORIGIN", MULTICOPTER, True, ""),
        ("NAV_FENCE_CIRCLE_INCLUSION", MULTICOPTER, True, "156"),
        ("NAV_RALLY_POINT", MULTICOPTER, False, ""),
        ("DO_SET_MODE", MULTICOPTER, False, "123"),
        ("WAYPOINT_USER_1", MULTICOPTER, False, "1234567"),
    ],
)
def test_parameters_that_may_be_set(name: str, traits: Traits, in_plan: bool, used: str) -> None:
    """PX4's mavlink_command_params.hpp."""
    number = int(getattr(mavlink, f"MAV_CMD_{name}"))
    bits = used_params(number, traits, in_plan=in_plan)
    assert "".join(str(place + 1) for place in range(7) if bits >> place & 1) == used


def test_items_of_other_plans_are_no_part_of_a_flown_mission() -> None:
    others = items_where(lambda item: item.plan in (FENCE, RALLY))
    assert len(others) == 5
    assert not others & items_where(lambda item: item.feasible or item.role is not Role.PASSED_OVER)


def test_a_place_is_kept_in_global_frames_alone() -> None:
    places = items_where(lambda item: item.role in (Role.PLACE, Role.GATE))
    assert places <= items_where(lambda item: item.keeps is not None and not item.in_mission_frame)
