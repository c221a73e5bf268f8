"""Whether a failsafe has the vehicle, and which, from what PX4 says: heartbeat, CURRENT_MODE, events."""

import struct
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.failsafe import FailsafeWatch
from tests.unit.companion_px4 import on_the_wire

SYSTEM = 1
MISSION, RETURN, POSITION, TERMINATION = 4 << 16 | 4 << 24, 4 << 16 | 5 << 24, 3 << 16, 10 << 16
STANDBY, ACTIVE, CRITICAL, FLIGHT_TERMINATION = 3, 4, 5, 8
RTL, TERMINATE = 6, 10
ENTER, ENTER_HOLD, GENERIC, LOW_BATTERY_WARNING = 26528394, 30481910, 31382480, 28993875
OUTSIDE_FENCE, OFFBOARD_LOST = 16920235, 28241790
OFFBOARD = 6 << 16


def heartbeat(mode: int, state: int) -> Any:
    return on_the_wire(mavlink.MAVLink_heartbeat_message(2, 12, 157, mode, state, 3), SYSTEM, 1)


def event(sequence: int, number: int, arguments: bytes = b"", time_ms: int = 1000) -> Any:
    padded = list(arguments.ljust(40, b"\0"))
    return on_the_wire(mavlink.MAVLink_event_message(number, time_ms, sequence, 0, 0, 0x21, padded), SYSTEM, 1)


def enter(sequence: int, cause: int) -> Any:
    return event(sequence, ENTER, struct.pack("<IBB", MISSION, RTL, cause))


def heard(*messages: Any) -> FailsafeWatch:
    watch = FailsafeWatch(SYSTEM)
    for msg in messages:
        watch.on_message(0, msg)
    return watch


@pytest.mark.parametrize(
    ("cause", "text"),
    [
        (1, "manual control lost"),
        (2, "ground station lost"),
        (3, "low battery"),
        (4, "critical battery"),
        (5, "emergency battery"),
        (6, "low flight time"),
    ],
)
def test_a_failsafe_is_told_by_the_heartbeats_state_and_its_cause_by_an_event(cause: int, text: str) -> None:
    watch = heard(heartbeat(MISSION, ACTIVE), enter(1, cause), heartbeat(RETURN, CRITICAL))
    assert watch.active
    assert watch.cause == text


def test_a_pilots_mode_is_no_failsafe() -> None:
    watch = heard(heartbeat(MISSION, ACTIVE), heartbeat(POSITION, ACTIVE))
    assert not watch.active


def test_a_failsafe_that_waits_in_hold_first_tells_its_cause_behind_the_delay() -> None:
    arguments = struct.pack("<IBHB", MISSION, RTL, 5, 2)
    watch = heard(event(1, ENTER_HOLD, arguments), heartbeat(4 << 16 | 3 << 24, CRITICAL))
    assert (watch.active, watch.cause) == (True, "ground station lost")


@pytest.mark.parametrize("check_first", [True, False])
def test_a_generic_failsafe_is_about_what_the_checks_say_near_it(check_first: bool) -> None:
    generic = GENERIC, struct.pack("<IB", MISSION, RTL)
    messages = [event(1, OUTSIDE_FENCE, time_ms=9_000), event(2, *generic, time_ms=9_500)]
    if not check_first:
        messages = [event(1, *generic, time_ms=9_000), event(2, OUTSIDE_FENCE, time_ms=9_040)]
    assert heard(*messages, heartbeat(RETURN, CRITICAL)).cause == "geofence"


def test_a_missing_offboard_signal_is_a_cause_where_offboard_was_flown_only() -> None:
    """PX4 reports all its checks again when a failsafe begins; that one fails on any vehicle without setpoints."""
    for mode, cause in ((OFFBOARD, "offboard signal lost"), (MISSION, "cause unknown")):
        checks = event(1, OFFBOARD_LOST, time_ms=9_000)
        watch = heard(checks, event(2, GENERIC, struct.pack("<IB", mode, RTL), time_ms=9_012))
        assert watch.cause == cause


def test_what_a_real_px4_says_when_its_height_fence_is_left_and_a_pilot_takes_over() -> None:
    """Heard from PX4 v1.18's SIH: GF_MAX_VER_DIST 4 while hovering at 8 m, GF_ACTION 3; then the pilot chooses Hold."""
    hold = 4 << 16 | 3 << 24
    checks = (27825120, 28241790, 17154777, 17231145, 30700832, 18691879)
    messages = [event(1 + i, number, time_ms=81_264) for i, number in enumerate(checks)]
    messages += [event(7, 21279712, struct.pack("<IBH", hold, RTL, 5), time_ms=81_276), heartbeat(hold, CRITICAL)]
    messages += [event(8, 31382480, struct.pack("<IB", hold, RTL), time_ms=86_280)]
    watch = heard(*messages)
    assert (watch.active, watch.cause) == (True, "geofence")
    watch.on_message(0, heartbeat(RETURN, CRITICAL))
    assert (watch.active, watch.cause) == (True, "geofence")
    for i, number in enumerate(checks):
        watch.on_message(0, event(9 + i, number, time_ms=97_180))
    assert (watch.active, watch.cause) == (True, "geofence")
    watch.on_message(0, heartbeat(hold, ACTIVE))
    assert not watch.active


def test_a_generic_failsafe_that_no_check_explains_has_no_cause() -> None:
    generic = event(2, GENERIC, struct.pack("<IB", MISSION, RTL), time_ms=20_000)
    watch = heard(event(1, OUTSIDE_FENCE, time_ms=9_000), generic, heartbeat(RETURN, CRITICAL))
    assert (watch.active, watch.cause) == (True, "cause unknown")


def test_a_warning_alone_is_no_failsafe() -> None:
    watch = heard(event(1, LOW_BATTERY_WARNING), heartbeat(MISSION, ACTIVE))
    assert (watch.active, watch.cause) == (False, "cause unknown")


def test_the_cause_is_forgotten_with_the_failsafe() -> None:
    watch = heard(enter(1, 3), heartbeat(RETURN, CRITICAL), heartbeat(POSITION, ACTIVE), heartbeat(RETURN, CRITICAL))
    assert (watch.active, watch.cause) == (True, "cause unknown")


@pytest.mark.parametrize(("asked_for", "failsafe"), [(MISSION, True), (TERMINATION, False)])
def test_a_terminated_vehicle_was_so_by_a_failsafe_if_nobody_asked_for_it(asked_for: int, failsafe: bool) -> None:
    told = event(1, GENERIC, struct.pack("<IB", asked_for, TERMINATE))
    watch = heard(told, heartbeat(asked_for, FLIGHT_TERMINATION))
    assert (watch.active, watch.terminated) == (failsafe, failsafe)
    watch.on_message(0, heartbeat(MISSION, STANDBY))
    assert (watch.active, watch.terminated) == (False, False), "a reboot ends it"


def test_who_is_killed_by_a_pilot_was_terminated_by_no_failsafe() -> None:
    assert not heard(heartbeat(MISSION, FLIGHT_TERMINATION)).active


def test_an_event_that_was_lost_is_asked_for() -> None:
    watch = heard(event(1, LOW_BATTERY_WARNING))
    asked = watch.on_message(0, event(3, LOW_BATTERY_WARNING))
    assert [(msg.get_type(), msg.first_sequence, msg.last_sequence) for msg in asked] == [("REQUEST_EVENT", 2, 2)]
    watch.on_message(0, enter(2, 3))
    watch.on_message(0, heartbeat(RETURN, CRITICAL))
    assert watch.cause == "low battery"


def test_other_vehicles_are_not_listened_to() -> None:
    watch = FailsafeWatch(2)
    watch.on_message(0, heartbeat(RETURN, CRITICAL))
    assert not watch.active
