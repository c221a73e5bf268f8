"""A transmitter's channels: sticks, switches, buttons and parameters that they turn."""

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.manual_control.rc_update import OFF, ON, Channel
from sitl_emu.autopilot.topics import SOURCE_RC, RcParameter
from tests.typed import now

from .transmitter import HIGH, LOW, MIDDLE, RC, STICKS, SWITCHES, Pilot


def test_a_channel_is_scaled_on_both_sides_of_its_trim() -> None:
    channel = Channel(1100.0, 1500.0, 1900.0, False)
    assert [channel.scaled(value) for value in (1000, 1100, 1300, 1500, 1700, 1900, 2100)] == pytest.approx(
        [-1.0, -1.0, -0.5, 0.0, 0.5, 1.0, 1.0]
    )
    assert Channel(1100.0, 1500.0, 1900.0, True).scaled(1900) == -1.0
    one_sided = Channel(1000.0, 1000.0, 2000.0, False)
    assert [one_sided.scaled(value) for value in (900, 1000, 1500, 2000)] == pytest.approx([-1.0, -1.0, 0.5, 1.0])
    assert Channel(1500.0, 1500.0, 1500.0, False).scaled(2000) == 1.0


@pytest.mark.parametrize(("minimum", "maximum", "on"), [(1000.0, 2000.0, True), (1100.0, 1900.0, False)])
def test_a_switch_in_the_middle_is_on_by_the_last_bit(minimum: float, maximum: float, on: bool) -> None:
    """Two drawn flights of a PX4 v1.18: kill and arming switches at 1500 us of 1000 to 2000, threshold 0.5, were on."""
    assert (Channel(minimum, 1500.0, maximum, False).scaled(1500) > 0.0) is on


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
    assert (pilot.sticks.roll, pilot.sticks.pitch, pilot.sticks.throttle) == pytest.approx((1.0, -1.0, -1.0))
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


def test_the_switch_that_terminates_is_told_with_the_next_second_or_another_switch() -> None:
    """PX4 does not compare it (rc_update.cpp, operator==)."""
    pilot = Pilot(**RC, RC_MAP_TERM_SW=5, RC_MAP_LOITER_SW=6)
    pilot.channels = [1500, 1500, 1500, 1500, LOW, LOW]
    pilot.run(1.5)
    told = now(pilot.topics).manual_control_switches
    assert told.terminate == OFF
    pilot.channels[4] = HIGH
    pilot.run(0.2)
    assert now(pilot.topics).manual_control_switches == told
    pilot.run(1.0)
    switches = now(pilot.topics).manual_control_switches
    assert switches.terminate == ON and switches.timestamp - told.timestamp == pytest.approx(1_000_000, abs=20_000)
    pilot.channels[4:] = [LOW, HIGH]
    pilot.run(0.1)
    switches = now(pilot.topics).manual_control_switches
    assert (switches.loiter, switches.terminate) == (ON, OFF)


def test_a_channel_turns_a_parameter() -> None:
    """PARAM_MAP_RC by RC_MAP_PARAMn, once a second, when the channel has moved; held within its limits.

    In its middle it is a float32's last bits off 0, which is a move.
    """
    pilot = Pilot(**RC, RC_MAP_PARAM2=5)
    pilot.topics.rc_parameter_map = (RcParameter(), RcParameter("MPC_XY_P", 1.0, 0.5, 0.6, 1.4), RcParameter())
    for channel, expected in ((1500, 1.0), (1750, 1.25), (2000, 1.4), (1000, 0.6)):
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
    pilot.channels = [1500, 1500, 1500, 1500, 2001]
    pilot.run(1.2)
    assert pilot.parameters["COM_FLTMODE1"] == 0x3F800000


def test_a_signal_counts_after_a_tenth_of_a_second_and_unmoved_sticks_are_told_seldom() -> None:
    pilot = Pilot(**RC, RC_FAILS_THR=950)
    pilot.channels = [HIGH, MIDDLE, 900, MIDDLE]
    pilot.run(1.0)
    pilot.channels = [HIGH, MIDDLE, MIDDLE, MIDDLE]
    pilot.run(0.08)
    assert not pilot.sticks.valid
    pilot.run(0.32)  # who holds no sticks is looked at every 200 ms
    assert pilot.sticks.valid
    told = set()
    for _ in range(25):
        pilot.step()
        told.add(pilot.topics.manual_control_rc.timestamp)
    assert 3 <= len(told) <= 5
    pilot.channels = [LOW, MIDDLE, MIDDLE, MIDDLE]
    pilot.step()
    assert pilot.sticks.roll == -1.0


def test_sticks_that_do_not_move_are_told_anew_as_long_as_they_count() -> None:
    """By each message of theirs that is told (every 0.3 s), and 0.2 s after that (ManualControl::Run)."""
    pilot = Pilot(**RC)
    pilot.channels = [MIDDLE] * 4
    pilot.run(1.0)
    told = set()
    for _ in range(100):
        pilot.step()
        told.add(pilot.sticks.timestamp)
    assert 24 <= len(told) <= 28, "in four seconds"


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


def test_nonsense_in_channels_breaks_nothing() -> None:
    pilot = Pilot(**RC, **SWITCHES, RC1_MIN=2000, RC1_MAX=1000, RC_MAP_FAILSAFE=18)
    pilot.channels = [0, 65534, 1, 9, 65535, 0, 0, 0]
    pilot.run(1.0)
    assert all(-1.0 <= value <= 1.0 for value in pilot.sticks[2:6])
