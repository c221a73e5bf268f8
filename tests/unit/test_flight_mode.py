"""Flight modes: every one has its row, no two can be confused, and what follows from the rows is PX4's."""

import pytest

from sitl_emu.autopilot.commander.control_mode import control_mode
from sitl_emu.autopilot.commander.custom_mode import base_mode_of, custom_mode_of, nav_state_of
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.flight_mode import (
    ATTITUDE,
    FLIGHT_MODES,
    FLOWN_BY_STICKS,
    NOTHING,
    RATES,
    STICKS_TO_THRUST,
    THRUST_AND_TORQUE,
    TRAJECTORY,
    ControlMode,
    DriveMode,
    Need,
    Task,
    modes_where,
)
from sitl_emu.autopilot.modes.flight_modes import FlightModes
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    DirectActuator,
    OffboardSetpoint,
    ThrustAndTorque,
    Topics,
    TrajectorySetpoint,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind

NAN = float("nan")
MULTICOPTER, ROVER = (kind.traits for kind in (VehicleKind.MULTICOPTER, VehicleKind.ROVER_ACKERMANN))
NO_SETPOINT = OffboardSetpoint()


def test_every_mode_has_its_row_in_the_order_of_its_number() -> None:
    assert list(FLIGHT_MODES) == list(NavState)


@pytest.mark.parametrize("number_of", ["event_number", "slot", "shell_name", "standard_mode"])
def test_no_two_modes_have_the_same_number(number_of: str) -> None:
    unset = {"event_number": 255, "standard_mode": 0}.get(number_of)
    numbers = [getattr(mode, number_of) for mode in FLIGHT_MODES.values() if getattr(mode, number_of) != unset]
    assert numbers
    assert len(numbers) == len(set(numbers))


@pytest.mark.parametrize("state", NavState)
def test_a_mode_that_may_be_set_is_found_by_its_custom_mode(state: NavState) -> None:
    mode = FLIGHT_MODES[state]
    assert custom_mode_of(state) == mode.sub_mode << 24 | mode.main_mode << 16
    assert (nav_state_of(mode.main_mode, mode.sub_mode) is state) is mode.by_set_mode


@pytest.mark.parametrize(
    ("states", "base_mode"),
    [
        (("MANUAL", "ALTITUDE_CRUISE", "ALTCTL", "POSCTL", "POSITION_SLOW", "STAB"), 81),
        (("EXTERNAL1", "EXTERNAL8", "AUTO_FOLLOW_TARGET", "ORBIT"), 17),
        (("GUIDED_COURSE", "AUTO_TAKEOFF", "AUTO_LOITER", "AUTO_MISSION", "AUTO_RTL", "AUTO_LAND"), 29),
        (("AUTO_PRECLAND",), 29),
        (("ACRO",), 65),
        (("OFFBOARD", "TERMINATION"), 1),
    ],
)
def test_base_mode_of_a_disarmed_hexacopter(states: tuple[str, ...], base_mode: int) -> None:
    """Measured: mode/disarmed/DO_SET_MODE/* and DO_SET_STANDARD_MODE/2; TERMINATION by control_mode.cpp."""
    for state in states:
        control = control_mode(NavState[state], MULTICOPTER, NO_SETPOINT)
        assert base_mode_of(control, armed=False) == base_mode, state
        assert base_mode_of(control, armed=True) == base_mode + 128


def test_descend_is_flown_by_itself_without_a_height() -> None:
    """ModeUtil/control_mode.cpp; a PX4 v1.18 whose GPS fails in HOLD logs just this, and has base mode 157."""
    control = FLIGHT_MODES[NavState.DESCEND].control
    assert (control.auto, control.climb_rate, control.altitude, control.position) == (True, True, False, False)
    assert base_mode_of(control, armed=True) == 157


def test_manual_stabilizes_a_multicopter_and_not_a_rover() -> None:
    """Measured: mode/arm_in/1.0 of the rover has base mode 65, of the hexacopter 81."""
    manual = [control_mode(NavState.MANUAL, traits, NO_SETPOINT) for traits in (MULTICOPTER, ROVER)]
    assert [base_mode_of(control, armed=False) for control in manual] == [81, 65]
    assert manual[1] == THRUST_AND_TORQUE._replace(manual=True)


@pytest.mark.parametrize(
    ("setpoint", "control"),
    [
        (OffboardSetpoint(1, trajectory=TrajectorySetpoint(position=(1.0, 2.0, NAN))), TRAJECTORY),
        (
            OffboardSetpoint(1, trajectory=TrajectorySetpoint(velocity=(1.0, 2.0, NAN))),
            TRAJECTORY._replace(position=False),
        ),
        (
            OffboardSetpoint(1, trajectory=TrajectorySetpoint(acceleration=(0.0, NAN, NAN))),
            TRAJECTORY._replace(position=False, altitude=False, climb_rate=False),
        ),
        (OffboardSetpoint(1, thrust_and_torque=ThrustAndTorque()), THRUST_AND_TORQUE),
        (OffboardSetpoint(1, direct_actuator=DirectActuator()), NOTHING),
        (OffboardSetpoint(1, attitude=VehicleAttitudeSetpoint()), ATTITUDE),
        (OffboardSetpoint(1, rates=VehicleRatesSetpoint()), RATES),
        (NO_SETPOINT, NOTHING),
    ],
)
def test_what_offboard_controls_follows_from_its_setpoint(setpoint: OffboardSetpoint, control: ControlMode) -> None:
    assert control_mode(NavState.OFFBOARD, ROVER, setpoint) == control._replace(offboard=True)


def test_sticks_that_are_the_thrust_have_no_task() -> None:
    assert {state.name for state in STICKS_TO_THRUST} == {"MANUAL", "STAB", "ACRO"}
    assert modes_where(lambda mode: mode.control.manual and mode.task is None) == STICKS_TO_THRUST


def test_who_is_flown_by_sticks_needs_them() -> None:
    assert modes_where(lambda mode: bool(mode.needs & Need.MANUAL_CONTROL)) == FLOWN_BY_STICKS


def test_every_task_and_drive_mode_has_a_mode() -> None:
    assert {mode.task for mode in FLIGHT_MODES.values()} == {None, *Task}
    assert {mode.drive_mode for mode in FLIGHT_MODES.values()} == {None, *DriveMode}
    tasks = FlightModes(Topics(), Parameters(VehicleKind.MULTICOPTER), Texts()).tasks
    assert set(tasks) == modes_where(lambda mode: mode.task is not None)
