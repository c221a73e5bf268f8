"""Sticks, gestures and switches: from channels and joysticks to what the commander does about them."""

from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.manual_control.manual_control import ManualControl, wants
from sitl_emu.autopilot.manual_control.rc_update import Channel, RcUpdate
from sitl_emu.autopilot.topics import SOURCE_MAVLINK_0, SOURCE_RC, InputRc, ManualControlInput, RcParameter
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import FakeVehicle

MAV_STATE_ACTIVE, MAV_STATE_FLIGHT_TERMINATION = 4, 8
LOW, MIDDLE, HIGH = 1000, 1500, 2000
STICKS = {"RC_MAP_ROLL": 1, "RC_MAP_PITCH": 2, "RC_MAP_THROTTLE": 3, "RC_MAP_YAW": 4}
RC = STICKS | {"RC_CHAN_CNT": 8, "COM_RC_IN_MODE": 0}
SWITCHES = {"RC_MAP_FLTMODE": 5, "RC_MAP_KILL_SW": 6, "RC_MAP_ARM_SW": 7, "RC_MAP_RETURN_SW": 8}
MODES = {"COM_FLTMODE1": 8, "COM_FLTMODE4": 1, "COM_FLTMODE6": 2}


class Pilot(FakeVehicle):
    """A vehicle whose pilot holds a transmitter, a joystick or both."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(**parameters)
        self.channels: list[int] | None = None
        self.joystick: tuple[float, float, float, float] | None = None
        self.rc_update = RcUpdate(self.topics, self.parameters)
        self.manual_control = ManualControl(self.topics, self.parameters)

    def step(self) -> None:
        if self.channels is not None:
            self.topics.input_rc = InputRc(self.now_us, tuple(self.channels))
        if self.joystick is not None:
            self.topics.manual_control_mavlink = ManualControlInput(self.now_us, SOURCE_MAVLINK_0, *self.joystick)
        self.rc_update.update()
        self.manual_control.update(self.now_us)
        super().step()

    @property
    def sticks(self) -> Any:
        return self.topics.manual_control_setpoint


def test_a_channel_is_scaled_on_both_sides_of_its_trim() -> None:
    channel = Channel(1100.0, 1500.0, 1900.0, False)
    assert [channel.scaled(value) for value in (1000, 1100, 1300, 1500, 1700, 1900, 2100)] == pytest.approx(
        [-1.0, -1.0, -0.5, 0.0, 0.5, 1.0, 1.0]
    )
    assert Channel(1100.0, 1500.0, 1900.0, True).scaled(1900) == -1.0
    one_sided = Channel(1000.0, 1000.0, 2000.0, False)
    assert [one_sided.scaled(value) for value in (900, 1000, 1500, 2000)] == [-1.0, -1.0, 0.5, 1.0]
    assert Channel(1500.0, 1500.0, 1500.0, False).scaled(2000) == 1.0


def test_a_receiver_that_is_not_calibrated_gives_no_sticks() -> None:
    for missing in ({"RC_CHAN_CNT": 0}, dict.fromkeys(STICKS, 0)):
        pilot = Pilot(**(RC | missing))
        pilot.channels = [MIDDLE] * 8
        pilot.run(1.0)
        assert not pilot.sticks.valid


def test_channels_are_sticks_by_their_mapping() -> None:
    pilot = Pilot(**RC, RC2_REV=-1)
    pilot.channels = [2000, 2000, 1000, 1250]
    pilot.run(0.5)
    assert (pilot.sticks.valid, pilot.sticks.data_source) == (True, SOURCE_RC)
    assert (pilot.sticks.roll, pilot.sticks.pitch, pilot.sticks.throttle) == (1.0, -1.0, -1.0)
    assert pilot.sticks.yaw == pytest.approx(-0.5, abs=0.02)


@pytest.mark.parametrize(("trim", "reverse", "expected"), [(1000, 1, -0.5), (2000, -1, 0.5), (2000, 1, -0.75)])
def test_a_throttle_trimmed_to_its_low_end_is_centred(trim: int, reverse: int, expected: float) -> None:
    """As QGroundControl leaves it: trim is where the throttle is low, and half a stick is 0 all the same."""
    pilot = Pilot(**RC, RC3_TRIM=trim, RC3_REV=reverse)
    pilot.channels = [MIDDLE, MIDDLE, 1250, MIDDLE]
    pilot.run(0.5)
    assert pilot.sticks.throttle == pytest.approx(expected)


def test_channels_are_auxiliary_sticks_by_their_mapping() -> None:
    pilot = Pilot(**RC, RC_MAP_AUX1=5, RC_MAP_AUX6=6)
    pilot.channels = [1500, 1500, 1500, 1500, 2000, 1250]
    pilot.run(0.5)
    assert pilot.sticks.aux == pytest.approx((1.0, 0.0, 0.0, 0.0, 0.0, -0.5))


def test_a_channel_turns_a_parameter() -> None:
    """PARAM_MAP_RC by RC_MAP_PARAMn, once a second, when the channel has moved; held within its limits."""
    pilot = Pilot(**RC, RC_MAP_PARAM2=5)
    pilot.topics.rc_parameter_map = (RcParameter(), RcParameter("MPC_XY_P", 1.0, 0.5, 0.6, 1.4), RcParameter())
    for channel, expected in ((1500, 0.95), (1750, 1.25), (2000, 1.4), (1000, 0.6)):
        pilot.channels = [1500, 1500, 1500, 1500, channel]
        pilot.run(1.2)
        assert pilot.parameters["MPC_XY_P"] == pytest.approx(expected)
    pilot.parameters.set("MPC_XY_P", 0.95)
    pilot.run(1.2)
    assert pilot.parameters["MPC_XY_P"] == pytest.approx(0.95), "the channel has not moved"


def test_a_channel_gives_an_integer_the_bits_of_a_float() -> None:
    """As PX4's param_set, which is handed a float."""
    pilot = Pilot(**RC, RC_MAP_PARAM1=5)
    pilot.topics.rc_parameter_map = (RcParameter("COM_FLTMODE1", 0.0, 1.0, -9.0, 9.0), RcParameter(), RcParameter())
    pilot.channels = [1500, 1500, 1500, 1500, 2000]
    pilot.run(1.2)
    assert pilot.parameters["COM_FLTMODE1"] == 0x3F800000


def test_a_signal_counts_after_a_tenth_of_a_second_and_unmoved_sticks_are_told_seldom() -> None:
    pilot = Pilot(**RC, RC_FAILS_THR=950)
    pilot.channels = [HIGH, MIDDLE, 900, MIDDLE]
    pilot.run(1.0)
    pilot.channels = [HIGH, MIDDLE, MIDDLE, MIDDLE]
    pilot.run(0.08)
    assert not pilot.sticks.valid
    pilot.run(0.12)
    assert pilot.sticks.valid
    told = set()
    for _ in range(25):
        pilot.step()
        told.add(pilot.topics.manual_control_rc.timestamp)
    assert 3 <= len(told) <= 5
    pilot.channels = [LOW, MIDDLE, MIDDLE, MIDDLE]
    pilot.step()
    assert pilot.sticks.roll == -1.0


def test_channels_that_stop_are_lost_sticks() -> None:
    pilot = Pilot(**RC, COM_RC_LOSS_T=0.5)
    pilot.channels = [MIDDLE] * 4
    pilot.run(1.0)
    assert pilot.sticks.valid
    pilot.channels = None
    pilot.run(0.4)
    assert pilot.sticks.valid
    pilot.run(0.3)
    assert not pilot.sticks.valid
    assert pilot.topics.failsafe_flags.manual_control_signal_lost


@pytest.mark.parametrize(
    ("channels", "parameters"),
    [([MIDDLE] * 3, {}), ([MIDDLE, MIDDLE, 900, MIDDLE], {"RC_FAILS_THR": 950})],
)
def test_a_receiver_without_signal(channels: list[int], parameters: dict[str, float]) -> None:
    pilot = Pilot(**RC, **parameters)
    pilot.channels = channels
    pilot.run(1.0)
    assert not pilot.sticks.valid


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
    pilot.run(0.5)
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


def test_buttons_choose_modes() -> None:
    """RC_MAP_FLTM_BTN: channels 5, 7 and 8 are buttons for the first three slots; let go, the mode stays."""
    pilot = Pilot(**RC, RC_MAP_FLTM_BTN=0b1101_0000, COM_FLTMODE1=8, COM_FLTMODE2=1, COM_FLTMODE3=2)
    pilot.channels = [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, HIGH, LOW, LOW]
    pilot.run(3.0)
    for channel, mode in ((4, NavState.STAB), (7, NavState.POSCTL), (6, NavState.ALTCTL)):
        pilot.channels[channel] = 1800
        pilot.run(0.5)
        assert now(pilot.mode) is mode
        pilot.channels[channel] = LOW
        pilot.run(0.5)
        assert now(pilot.mode) is mode
    pilot.channels[4] = 1800
    pilot.run(0.08)
    pilot.channels[4] = 1700
    pilot.run(0.5)
    assert now(pilot.mode) is NavState.ALTCTL, "too short"


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


def test_nonsense_in_channels_breaks_nothing() -> None:
    pilot = Pilot(**RC, **SWITCHES, RC1_MIN=2000, RC1_MAX=1000, RC_MAP_FAILSAFE=18)
    pilot.channels = [0, 65534, 1, 9, 65535, 0, 0, 0]
    pilot.run(1.0)
    assert all(-1.0 <= value <= 1.0 for value in pilot.sticks[2:6])


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
