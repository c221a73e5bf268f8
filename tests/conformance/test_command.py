"""Command protocol: targets, repetitions, what each command is answered with, commands that choose a mode."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

PAGE = "https://mavlink.io/en/services/command.html"
RUN_PREARM_CHECKS = 401
ACTUATOR_GROUP_TEST, ROLL_TORQUE, COLLECTIVE_TILT = 309, 0, 3
"""Of the development dialect."""
HOLD = (4, 3)
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)
"""MAV_RESULT."""

pytestmark = pytest.mark.covers("COMMAND_ACK", source=PAGE)

ANSWERS = {
    ACCEPTED: "DO_CHANGE_SPEED DO_GO_AROUND DO_SET_ACTUATOR DO_SET_SAFETY_SWITCH_STATE NAV_ROI DO_SET_ROI_NONE",
    DENIED: "DO_FLIGHTTERMINATION",
    CANCELLED: "DO_LAND_START",
    FAILED: "CONTROL_HIGH_LATENCY",
    UNSUPPORTED: """
        AIRFRAME_CONFIGURATION ARM_AUTHORIZATION_REQUEST CAN_FORWARD CONDITION_CHANGE_ALT CONDITION_DELAY
        CONDITION_DISTANCE CONDITION_GATE CONDITION_LAST CONDITION_YAW DO_CONTROL_VIDEO DO_DIGICAM_CONFIGURE
        DO_FENCE_ENABLE DO_FOLLOW DO_FOLLOW_REPOSITION DO_GUIDED_LIMITS DO_INVERTED_FLIGHT DO_JUMP DO_JUMP_TAG DO_LAST
        DO_PARACHUTE DO_PAUSE_CONTINUE DO_RALLY_LAND DO_REPEAT_RELAY DO_REPEAT_SERVO DO_SET_PARAMETER DO_SET_RELAY
        DO_SET_REVERSE DO_SET_ROI_SYSID DO_SET_SERVO GET_HOME_POSITION JUMP_TAG NAV_CONTINUE_AND_CHANGE_ALT NAV_FOLLOW
        NAV_GUIDED_ENABLE NAV_LOITER_TO_ALT NAV_LOITER_TURNS NAV_LOITER_UNLIM NAV_PAYLOAD_PLACE NAV_RALLY_POINT
        NAV_SET_YAW_SPEED NAV_SPLINE_WAYPOINT NAV_TAKEOFF_LOCAL NAV_VTOL_LAND NAV_WAYPOINT OVERRIDE_GOTO
        PANORAMA_CREATE REQUEST_AUTOPILOT_CAPABILITIES REQUEST_PROTOCOL_VERSION SPATIAL_USER_1 UAVCAN_GET_NODE_INFO
        USER_1 WAYPOINT_USER_1
    """,
}
"""To all parameters 0, for a vehicle that stands disarmed in Hold."""
NO_ANSWER = """
    CONFIGURE_ACTUATOR DO_FIGURE_EIGHT DO_VTOL_TRANSITION DO_WINCH NAV_DELAY PAYLOAD_CONTROL_DEPLOY
    PAYLOAD_PREPARE_DEPLOY PREFLIGHT_SET_SENSOR_OFFSETS PREFLIGHT_UAVCAN START_RX_PAIR
"""
MODES = {
    "DO_ORBIT": (3, 1),
    "NAV_LAND": (4, 6),
    "NAV_LAND_LOCAL": (4, 9),
    "NAV_RETURN_TO_LAUNCH": (4, 5),
    "NAV_TAKEOFF": (4, 2),
    "NAV_VTOL_TAKEOFF": (4, 10),
}
"""Custom main and sub mode that a command chooses, on the ground as well."""


WITH_PARAMETERS = (
    ("DO_SET_MODE", (0, 4, 3), TEMPORARILY_REJECTED),
    ("DO_SET_MODE", (1, 99, 0), TEMPORARILY_REJECTED),
    ("DO_CHANGE_SPEED", (1, 5, -1), ACCEPTED),
    ("PREFLIGHT_REBOOT_SHUTDOWN", (0, 1), ACCEPTED),
    ("PREFLIGHT_REBOOT_SHUTDOWN", (4,), DENIED),
    ("MISSION_START", (0, 5), DENIED),
    ("COMPONENT_ARM_DISARM", (0,), ACCEPTED),
    ("DO_SET_HOME", (0, 0, 0, 0, math.nan, math.nan, math.nan), DENIED),
    ("DO_SET_HOME", (1,), ACCEPTED),
    ("DO_SET_SAFETY_SWITCH_STATE", (2,), FAILED),
)
"""To these parameters, likewise."""
UNUSED_PARAMETERS = (
    ("NAV_RETURN_TO_LAUNCH", (1,)),
    ("NAV_LAND", (0, 0, 1)),
    ("NAV_TAKEOFF", (0, 1)),
    ("COMPONENT_ARM_DISARM", (1, 0, 1)),
    ("DO_CHANGE_SPEED", (1, 5, -1, 1)),
    ("NAV_WAYPOINT", (0, 0, 5)),
)
"""Set parameters of which the last has no use."""
RELEASE, GRAB = 0, 1


def number_of(name: str) -> int:
    return int(getattr(common, f"MAV_CMD_{name}"))


def about(name: str, *values: Any) -> Any:
    """A case about a command."""
    source = "measured command/disarmed/*, command/variant/*: the answer on the ground"
    return pytest.param(name, *values, marks=pytest.mark.covers(f"MAV_CMD_{name}", source=source), id=name)


def command_int(station: Any, number: int) -> int | None:
    """Send a COMMAND_INT; the result of its ack, or None."""
    station.mav.command_int_send(station.system, 1, 0, number, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    while (ack := station.receive("COMMAND_ACK")) is not None:
        if ack.command == number:
            return int(ack.result)
    return None


@pytest.mark.covers(
    "MAV_CMD_RUN_PREARM_CHECKS", source="measured command/target/401/*: answered to component 1 and to all, to no other"
)
@pytest.mark.covers("COMMAND_LONG", source=PAGE)
@pytest.mark.parametrize(
    ("offset", "component", "answered"), [(0, 1, True), (0, 0, True), (0, 42, False), (9, 1, False)]
)
def test_targets(station: Any, offset: int, component: int, answered: bool) -> None:
    station.mav.command_long_send(station.system + offset, component, RUN_PREARM_CHECKS, 0, *(0.0,) * 7)
    ack = station.receive("COMMAND_ACK", 3.0 if answered else 0.7)
    assert (ack is not None) == answered
    if answered:
        assert (ack.command, ack.result, ack.target_system, ack.target_component) == (401, 0, 255, 190)


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(
    "MAV_CMD_DO_AUTOTUNE_ENABLE", source="PX4 src/modules/mavlink/mavlink_receiver.cpp: denied unless param1 begins it"
)
def test_autotune_is_only_begun(station: Any) -> None:
    number = number_of("DO_AUTOTUNE_ENABLE")
    assert (station.command(number), command_int(station, number)) == (DENIED, DENIED)


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(source="PX4 parameter COM_PREARM_MODE: a torque needs a prearmed vehicle")
def test_a_group_of_actuators_is_not_tested_on_a_disarmed_vehicle(station: Any) -> None:
    assert station.command(ACTUATOR_GROUP_TEST, ROLL_TORQUE, 0.3) == TEMPORARILY_REJECTED


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(source="https://mavlink.io/en/messages/development.html#ACTUATOR_TEST_GROUP")
def test_no_rotor_of_a_multicopter_tilts(station: Any) -> None:
    assert station.command(ACTUATOR_GROUP_TEST, COLLECTIVE_TILT, 0.3) == UNSUPPORTED


@pytest.mark.covers("COMMAND_LONG", "COMMAND_INT", source=PAGE)
@pytest.mark.parametrize(
    ("name", "result"), [about(name, result) for result, names in ANSWERS.items() for name in names.split()]
)
def test_a_command_is_answered_alike_in_both_messages(station: Any, name: str, result: int) -> None:
    number = number_of(name)
    assert (station.command(number), command_int(station, number)) == (result, result)


@pytest.mark.covers("COMMAND_LONG", source="measured command/disarmed/*: no ack from whoever is asked in vain")
@pytest.mark.parametrize("name", [about(name) for name in NO_ANSWER.split()])
def test_a_command_that_nobody_answers(station: Any, name: str) -> None:
    """The answer to the next command comes first."""
    for number in (number_of(name), RUN_PREARM_CHECKS):
        station.mav.command_long_send(station.system, 1, number, 0, *(0.0,) * 7)
    assert station.receive("COMMAND_ACK").command == RUN_PREARM_CHECKS


@pytest.mark.parametrize(("name", "mode"), [about(name, mode) for name, mode in MODES.items()])
def test_a_command_chooses_its_mode(station: Any, name: str, mode: tuple[int, int]) -> None:
    main, sub = mode
    try:
        assert station.command(number_of(name)) == ACCEPTED
        assert station.heartbeat().custom_mode == main << 16 | sub << 24
    finally:
        station.set_mode(*HOLD)


def test_a_command_that_nobody_knows(station: Any) -> None:
    assert station.command(31000) == UNSUPPORTED


ORBIT_TASK = "PX4 src/modules/flight_mode_manager/tasks/Orbit/FlightTaskOrbit.cpp"


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers("MAV_CMD_DO_ORBIT", "ORBIT_EXECUTION_STATUS", source=f"{ORBIT_TASK}: the frame is 0")
def test_an_orbit_is_told(station: Any) -> None:
    """Also by a vehicle that stands on the ground."""
    try:
        assert station.command(number_of("DO_ORBIT"), 5.0, 2.0, 0.0, 0.0, *(math.nan,) * 3) == ACCEPTED
        status = station.receive("ORBIT_EXECUTION_STATUS")
        assert (status.frame, status.radius >= 1.0) == (common.MAV_FRAME_GLOBAL, True)
    finally:
        station.set_mode(*HOLD)


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(
    "MAV_CMD_DO_ORBIT", "STATUSTEXT", source=f"{ORBIT_TASK}: a radius of less than 1 m is accepted, told, and not flown"
)
def test_an_orbit_that_is_too_small_is_told(station: Any) -> None:
    number = number_of("DO_ORBIT")
    told: set[int | str] = set()
    station.mav.command_long_send(station.system, 1, number, 0, *(0.0,) * 7)
    try:
        while len(told) < 2 and (message := station.receive(["COMMAND_ACK", "STATUSTEXT"])) is not None:
            if message.get_type() == "STATUSTEXT":
                told |= {message.text} & {"Orbit radius limit exceeded\t"}
            elif message.command == number:
                told.add(message.result)
        assert told == {ACCEPTED, "Orbit radius limit exceeded\t"}
    finally:
        station.set_mode(*HOLD)


@pytest.mark.parametrize(("name", "params", "result"), [about(*case) for case in WITH_PARAMETERS])
def test_parameters_decide(station: Any, name: str, params: tuple[float, ...], result: int) -> None:
    assert station.command(number_of(name), *params) == result


@pytest.mark.parametrize(
    ("name", "params"),
    [
        pytest.param(
            *case,
            marks=pytest.mark.covers(
                f"MAV_CMD_{case[0]}", source="https://mavlink.io/en/messages/common.html#MAV_RESULT"
            ),
            id=case[0],
        )
        for case in UNUSED_PARAMETERS
    ],
)
def test_a_parameter_without_a_use_is_denied(station: Any, name: str, params: tuple[float, ...]) -> None:
    """0 and NaN leave a parameter out. One that does not look does as it is told: that ends at once."""
    result = None
    try:
        result = station.command(number_of(name), *params)
        assert result == DENIED
    finally:
        if result != DENIED:
            station.command(number_of("COMPONENT_ARM_DISARM"), 0)
            station.command(number_of("DO_SET_MODE"), 1, *HOLD)
            station.disarm()


@pytest.mark.covers("COMMAND_INT", "MAV_CMD_ACTUATOR_TEST", source=PAGE)
def test_an_integer_that_is_no_place_is_not_scaled(station: Any) -> None:
    """ACTUATOR_OUTPUT_FUNCTION_MOTOR1 in x; a test of no length lets go of it."""
    number = number_of("ACTUATOR_TEST")
    station.mav.command_int_send(station.system, 1, 0, number, 0, 0, math.nan, 0.0, 0.0, 0.0, 1, 0, 0.0)
    assert acks_of(station, number, 0.9) == [(ACCEPTED, 0)]


def acks_of(station: Any, command: int, seconds: float, at_least: int = 1) -> list[tuple[int, int]]:
    """(result, progress) of the acks of a command within a time."""
    acks = station.collect("COMMAND_ACK", seconds, at_least)
    return [(ack.result, ack.progress) for ack in acks if ack.command == command]


@pytest.mark.covers(
    "COMMAND_LONG",
    source="measured command/confirmation/*, command/repeat/401/acks: every repetition is answered",
)
@pytest.mark.parametrize("confirmation", [0, 1, 5, 255])
def test_repetitions_are_answered(station: Any, confirmation: int) -> None:
    station.mav.command_long_send(station.system, 1, RUN_PREARM_CHECKS, confirmation, *(0.0,) * 7)
    assert acks_of(station, RUN_PREARM_CHECKS, 0.9) == [(ACCEPTED, 0)]


@pytest.mark.covers(
    "MAV_CMD_COMPONENT_ARM_DISARM",
    source="measured command/variant/400/half: no ack for what is neither arming nor disarming",
)
def test_half_arming_is_none(station: Any) -> None:
    number = number_of("COMPONENT_ARM_DISARM")
    station.mav.command_long_send(station.system, 1, number, 0, 2.0, *(0.0,) * 6)
    assert acks_of(station, number, 0.9, at_least=0) == []


@pytest.mark.covers("MAV_CMD_DO_GRIPPER", source="PX4 parameter PD_GRIPPER_TO: how long the gripper takes")
def test_a_gripper_takes_its_time_and_answers_twice(station: Any) -> None:
    """One that already is where it shall be answers once."""
    number = number_of("DO_GRIPPER")
    station.mav.command_long_send(station.system, 1, number, 0, 1, GRAB, *(0.0,) * 5)
    while (ack := station.receive("COMMAND_ACK")) is not None and (ack.command, ack.result) != (number, ACCEPTED):
        pass
    for action in (RELEASE, GRAB):
        station.mav.command_long_send(station.system, 1, number, 0, 1, action, *(0.0,) * 5)
        assert acks_of(station, number, 2.0, at_least=2) == [(IN_PROGRESS, 255), (ACCEPTED, 0)]
        assert station.command(number, 1, action) == ACCEPTED
