"""Sticks, gestures and switches: from channels and joysticks to what the commander does about them."""

import pytest

from sitl_emu.autopilot.constants import GEAR_DOWN, GEAR_UP, NavState, Severity
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.manual_control.manual_control import wants
from sitl_emu.autopilot.topics import SOURCE_MAVLINK_0, SOURCE_RC
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .transmitter import HIGH, LOW, MIDDLE, MODES, RC, SWITCHES, Pilot

MAV_STATE_ACTIVE, MAV_STATE_FLIGHT_TERMINATION = 4, 8


@pytest.mark.parametrize(
    ("mode", "first", "second", "flown"),
    [
        (0, "joystick", "rc", SOURCE_RC),
        (1, "rc", "joystick", SOURCE_MAVLINK_0),
        (2, "rc", "joystick", SOURCE_RC),
        (3, "joystick", "rc", SOURCE_MAVLINK_0),
        (5, "joystick", "rc", SOURCE_RC),
        (5, "rc", "joystick", SOURCE_RC),
        (6, "joystick", "rc", SOURCE_MAVLINK_0),
        (6, "rc", "joystick", SOURCE_MAVLINK_0),
        (7, "joystick", "rc", SOURCE_RC),
        (8, "rc", "joystick", SOURCE_MAVLINK_0),
        (8, "joystick", "rc", SOURCE_MAVLINK_0),
    ],
)
def test_which_sticks_are_flown(mode: int, first: str, second: str, flown: int) -> None:
    pilot = Pilot(**(RC | {"COM_RC_IN_MODE": mode}))
    for name in (first, second):
        if name == "rc":
            pilot.channels = [MIDDLE] * 4
        else:
            pilot.joystick = (0.0, 0.0, 0.0, 0.0)
        pilot.run(0.5)
    assert pilot.sticks.data_source == flown


@pytest.mark.parametrize(("mode", "first_link", "last_link"), [(5, 1, 0), (6, 1, 0), (7, 0, 1), (8, 0, 1), (3, 0, 0)])
def test_which_of_two_joysticks_goes_before_the_other(mode: int, first_link: int, last_link: int) -> None:
    """Links in their order, or the other way round (ManualControlSelector::isInputValid)."""
    link_0, link_1 = SOURCE_MAVLINK_0, SOURCE_MAVLINK_0 + 1
    assert wants(mode, link_0, link_1, link_1) is bool(first_link)
    assert wants(mode, link_1, link_0, link_0) is bool(last_link)


def test_the_other_sticks_take_over_only_where_that_is_wanted() -> None:
    for mode, expected in ((2, True), (3, False)):
        pilot = Pilot(**(RC | {"COM_RC_IN_MODE": mode, "COM_RC_LOSS_T": 0.5}))
        pilot.channels = [MIDDLE] * 4
        pilot.run(0.5)
        pilot.channels, pilot.joystick = None, (0.0, 0.0, 0.0, 0.0)
        pilot.run(1.0)
        assert pilot.sticks.valid is expected


def test_no_sticks_where_they_are_disabled() -> None:
    pilot = Pilot(COM_RC_IN_MODE=4)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(1.0)
    assert not pilot.sticks.valid


@pytest.mark.parametrize(("parameter", "mode"), [(4, NavState.AUTO_LOITER), (2, NavState.POSCTL)])
def test_sticks_choose_no_mode_that_is_what_it_boots_into(parameter: int, mode: NavState) -> None:
    """COM_FLTMODE_BOOT."""
    pilot = Pilot(COM_FLTMODE_BOOT=parameter)
    pilot.run(3.0)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(0.5)
    assert pilot.mode is mode


def test_gestures_arm_and_disarm() -> None:
    pilot = Pilot()
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.joystick = (0.0, 0.0, 1.0, -1.0)
    pilot.run(0.8)
    assert not now(pilot.armed)
    pilot.run(0.5)
    assert now(pilot.armed)
    assert "Armed by stick gesture" in pilot.take_texts()
    pilot.joystick = (0.0, 0.0, -1.0, -1.0)
    pilot.run(1.5)
    assert not pilot.armed
    assert "Disarmed by stick gesture" in pilot.take_texts()


def test_sticks_that_move_take_over() -> None:
    pilot = Pilot()
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.take_off(10.0)
    assert now(pilot.mode) is NavState.AUTO_LOITER
    pilot.joystick = (0.05, 0.0, 0.0, 0.0)
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.AUTO_LOITER
    pilot.joystick = (0.8, 0.0, 0.0, 0.0)  # once may be noise
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.AUTO_LOITER
    for _ in range(4):
        pilot.joystick = (pilot.joystick[0] - 0.2, 0.0, 0.0, 0.0)
        pilot.step()
    pilot.step()
    assert pilot.mode is NavState.POSCTL
    assert "Pilot took over using sticks" in pilot.take_texts()


def swing(pilot: Pilot) -> None:
    """Move the right stick from its middle, quickly and in one direction."""
    for roll in (0.0, 0.2, 0.4, 0.6, 0.8):
        pilot.joystick = (roll, 0.0, 0.0, 0.0)
        pilot.step()
    pilot.step()


def test_sticks_end_the_action_of_a_failsafe_but_not_the_hold_before_it() -> None:
    """In the hold, by mode alone (FailsafeBase::getSelectedAction)."""
    pilot = Pilot(NAV_DLL_ACT=2)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.take_off(10.0)
    pilot.gcs = False
    pilot.run(14.0)
    assert now(pilot.topics.vehicle_status.failsafe)
    swing(pilot)
    assert now(pilot.mode) is NavState.AUTO_LOITER
    pilot.run(5.0)
    assert now(pilot.mode) is NavState.AUTO_RTL
    swing(pilot)
    assert now(pilot.mode) is NavState.POSCTL
    assert layout("failsafe_rc_override")[0] in [event.id for event in pilot.events.recent]
    pilot.run(8.0)
    assert pilot.mode is NavState.POSCTL
    assert not pilot.topics.vehicle_status.failsafe


def test_a_fence_that_holds_lets_no_sticks_through() -> None:
    """GF_ACTION 2: by mode alone (UserTakeoverAllowed::AlwaysModeSwitchOnly)."""
    pilot = Pilot(GF_ACTION=2, GF_MAX_HOR_DIST=30.0)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.take_off(10.0)
    pilot.north = 90.0
    pilot.run(1.0)
    assert now(pilot.topics.vehicle_status.failsafe)
    swing(pilot)
    assert now(pilot.mode) is NavState.AUTO_LOITER
    pilot.set_mode(3)
    pilot.step()
    assert pilot.mode is NavState.POSCTL


def test_lost_sticks_that_are_no_failsafe() -> None:
    """NAV_RCL_ACT 7 switches to HOLD."""
    pilot = Pilot(NAV_RCL_ACT=7, COM_RC_LOSS_T=0.5)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.take_off(10.0)
    pilot.set_mode(3)
    pilot.run(1.0)
    pilot.take_texts()
    pilot.joystick = None
    pilot.run(2.0)
    assert pilot.mode is NavState.AUTO_LOITER
    assert not pilot.topics.vehicle_status.failsafe
    assert "Manual control lost: switching to Hold" in pilot.take_texts()


def test_a_button_that_is_held_arms_and_disarms() -> None:
    """COM_ARM_SWISBTN: for a second."""
    pilot = Pilot(**RC, **SWITCHES, COM_ARM_SWISBTN=1)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    pilot.channels[6] = HIGH
    pilot.run(0.8)
    pilot.channels[6] = LOW
    pilot.run(2.0)
    assert not now(pilot.armed)
    for armed in (True, False):
        pilot.channels[6] = HIGH
        pilot.run(2.5)
        assert now(pilot.armed) is armed
        pilot.channels[6] = LOW
        pilot.run(1.5)
        assert now(pilot.armed) is armed


def test_a_switch_ends_the_flight() -> None:
    pilot = Pilot(**RC, RC_MAP_TERM_SW=5)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW]
    pilot.run(3.0)
    pilot.take_off(10.0)
    pilot.channels[4] = HIGH
    pilot.run(1.1)  # it is told once a second (rc_update.py)
    assert pilot.mode is NavState.TERMINATION
    assert pilot.topics.actuator_armed.termination


def test_sticks_do_not_take_over_where_that_is_off() -> None:
    pilot = Pilot(MAN_OVERRIDE_SPD=-1.0)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(3.0)
    pilot.take_off(10.0)
    pilot.joystick = (1.0, 1.0, 0.0, 0.0)
    pilot.run(0.5)
    assert pilot.mode is NavState.AUTO_LOITER


def test_switches_choose_modes_arm_and_kill() -> None:
    pilot = Pilot(**RC, **SWITCHES, **MODES)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    assert now(pilot.mode) is NavState.STAB  # the first slot, when RC is first seen
    pilot.channels[4] = 1600
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.ALTCTL
    pilot.channels[4] = HIGH
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.POSCTL
    pilot.channels[6] = HIGH
    pilot.run(0.5)
    assert now(pilot.armed)
    pilot.channels[7] = HIGH
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.AUTO_RTL
    pilot.channels[7] = LOW
    pilot.run(0.5)
    assert pilot.mode is NavState.POSCTL
    pilot.channels[5] = HIGH
    pilot.run(0.2)
    assert now(pilot.topics.actuator_armed.kill)
    pilot.channels[5] = LOW
    pilot.run(0.2)
    assert not pilot.topics.actuator_armed.kill
    assert now(pilot.armed)
    pilot.channels[6] = LOW
    pilot.run(0.5)
    assert not pilot.armed
    texts = pilot.take_texts()
    assert {"Kill engaged", "Kill disengaged", "Armed by RC switch", "Disarmed by RC switch"} <= set(texts)


def test_a_receiver_that_is_heard_again_in_flight_leaves_the_mode_alone() -> None:
    """PX4's ManualControl::processSwitches takes the slot of a first message before arming alone."""
    pilot = Pilot(**RC, **SWITCHES, **MODES, COM_RCL_EXCEPT=2)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, HIGH, LOW, LOW, LOW]
    pilot.run(3.0)
    pilot.set_mode(4, 3)
    pilot.take_off(10.0)
    pilot.channels = None
    pilot.run(2.0)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, HIGH, LOW, LOW, LOW]
    pilot.run(2.0)
    assert pilot.sticks.valid
    assert now(pilot.mode) is NavState.AUTO_LOITER
    pilot.channels[4] = 1600
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.ALTCTL


def test_who_stays_killed_is_disarmed_and_does_not_arm() -> None:
    pilot = Pilot(**RC, **SWITCHES)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    pilot.channels[6] = HIGH
    pilot.run(0.5)
    pilot.channels[5] = HIGH
    pilot.run(6.0)
    assert not pilot.armed
    assert pilot.arm() == 1
    assert {"Preflight Fail: Kill switch engaged", "Preflight Fail: Flight termination active"} <= set(pilot.said)


def test_a_gear_switch_moves_the_gear_and_forbids_arming_while_it_is_up() -> None:
    pilot = Pilot(**RC, **SWITCHES, RC_MAP_GEAR_SW=9)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    assert pilot.topics.landing_gear.landing_gear != GEAR_UP
    for position, asked in ((HIGH, GEAR_UP), (LOW, GEAR_DOWN)):
        pilot.channels[8] = position
        pilot.run(2.5)
        assert pilot.topics.landing_gear.landing_gear == asked
        assert (pilot.arm() == 0) is (asked == GEAR_DOWN)
    assert "Preflight Fail: Landing gear switch set in UP position" in pilot.said


def test_a_kill_looks_like_a_terminated_flight_and_is_critical_in_the_air_alone() -> None:
    """PX4's streams/HEARTBEAT.hpp, Commander::executeActionRequest."""
    for in_the_air, severity in ((False, Severity.INFO), (True, Severity.CRITICAL)):
        pilot = Pilot(**RC, **SWITCHES)
        pilot.channels = [MIDDLE, MIDDLE, MIDDLE, MIDDLE, LOW, LOW, LOW, LOW]
        pilot.run(3.0)
        pilot.set_mode(4, 3)
        if in_the_air:
            pilot.take_off(10.0)
        else:
            assert pilot.arm() == 0
        pilot.channels[5] = HIGH
        pilot.run(0.3)
        event_id = layout("commander_kill_sw_engaged")[0]
        assert [event.log_levels & 0xF for event in pilot.events.recent if event.id == event_id] == [severity]
        assert pilot.topics.vehicle_status.system_status == MAV_STATE_FLIGHT_TERMINATION
        pilot.channels[5] = LOW
        pilot.run(0.3)
        assert pilot.topics.vehicle_status.system_status == MAV_STATE_ACTIVE


def test_who_is_killed_on_the_ground_has_its_time_from_arming_on() -> None:
    """PX4's Commander::handleAutoDisarm counts no time that it was not armed."""
    pilot = Pilot(**RC, **SWITCHES)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    pilot.channels[5] = HIGH
    pilot.run(6.0)
    pilot.commander._arming.arm(pilot.now_us, forced=True)
    pilot.run(4.8)
    assert now(pilot.armed)
    pilot.run(0.4)
    assert not pilot.armed
    assert "Disarmed by kill-switch" in pilot.take_texts()


def test_who_flips_the_arming_switch_back_at_once_is_not_asked_for_health() -> None:
    """PX4's Commander::arm gives 5 s, for a switch that was flipped in the air."""
    for seconds, rearmed in ((4.0, True), (5.5, False)):
        pilot = Pilot(**RC, **SWITCHES)
        pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
        pilot.run(3.0)
        pilot.channels[6] = HIGH
        pilot.run(0.5)
        assert now(pilot.armed)
        pilot.channels[6] = LOW
        pilot.run(0.5)
        assert not now(pilot.armed)
        pilot.sensors = False
        pilot.run(seconds)
        pilot.channels[6] = HIGH
        pilot.run(0.3)
        assert pilot.armed is rearmed


@pytest.mark.parametrize(("value", "mode"), [(14, NavState.ORBIT), (16, NavState.ALTITUDE_CRUISE)])
def test_a_slot_may_be_any_mode_that_px4_has_a_number_for(value: int, mode: NavState) -> None:
    """ManualControl::navStateFromParam."""
    pilot = Pilot(**RC, **SWITCHES, COM_FLTMODE1=value)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    assert pilot.mode is mode


@pytest.mark.parametrize("trembles", [True, False])
def test_who_holds_the_sticks_in_the_corners_kills_unless_they_are_perfectly_still(trembles: bool) -> None:
    """Unmoved channels come three times a second, and a run between two finds the sticks put to rest, as in PX4."""
    pilot = Pilot(**RC, MAN_KILL_GEST_T=1.0)
    pilot.channels = [MIDDLE, MIDDLE, MIDDLE, MIDDLE]
    pilot.run(1.0)
    for step in range(100):
        pilot.channels = [HIGH, LOW, LOW + (step % 2 if trembles else 0), LOW]
        pilot.step()
    assert pilot.topics.actuator_armed.kill is trembles
    assert (pilot.sticks.roll, pilot.sticks.throttle) == (0.0, -1.0), "what is flown meanwhile"


def test_switches_ask_for_nothing_while_they_are_calibrated() -> None:
    pilot = Pilot(**RC, **SWITCHES, **MODES)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, LOW]
    pilot.run(3.0)
    assert pilot.result(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 1) == 0
    pilot.run(0.1)
    pilot.channels[4:6] = HIGH, HIGH
    pilot.run(0.5)
    assert pilot.mode is NavState.STAB
    assert not pilot.topics.actuator_armed.kill


def test_a_return_switch_that_is_on_forbids_arming() -> None:
    """PX4's manualControlCheck."""
    pilot = Pilot(**RC, **SWITCHES)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW, HIGH]
    pilot.run(3.0)
    pilot.set_mode(4, 3)
    assert pilot.arm() == 1
    pilot.channels[7] = LOW
    pilot.run(0.5)
    pilot.set_mode(4, 3)
    assert pilot.arm() == 0


def test_sticks_that_com_rc_in_mode_wants_no_more_are_lost_at_once() -> None:
    pilot = Pilot(COM_RC_IN_MODE=1, COM_RC_LOSS_T=5.0)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(1.0)
    assert pilot.sticks.valid
    for mode in (2, 3):
        pilot.parameters.set("COM_RC_IN_MODE", mode)
        pilot.run(0.2)
        assert pilot.sticks.valid
    pilot.parameters.set("COM_RC_IN_MODE", 0)
    pilot.run(0.2)
    assert not pilot.sticks.valid


def test_sticks_that_are_lost_and_come_back_are_told_by_events() -> None:
    pilot = Pilot(COM_RC_LOSS_T=0.5)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(2.0)
    pilot.joystick = None
    pilot.run(2.0)
    pilot.joystick = (0.0, 0.0, 0.0, 0.0)
    pilot.run(1.0)
    lost, regained = layout("commander_rc_lost")[0], layout("commander_rc_regained")[0]
    assert [event.id for event in pilot.events.recent if event.id in (lost, regained)] == [lost, regained]
