"""Events on simulated time: sequence numbers, what is kept, the rounds of arming checks, and a lossy link."""

import random
import struct
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.events import Events, layout, pack
from sitl_emu.autopilot.topics import BatteryStatus, OffboardSetpoint, SensorBaro, TrajectorySetpoint
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.event import EventReceiver
from tests.unit.mavlink_peer import GCS, GIMBAL, Peer
from tests.unit.navigation_fake import FakeVehicle

FIRST_SEQUENCE = 65526
SUMMARY, HEALTH = 27825120, 18691879
MISSION_MISSING, OFFBOARD_LOST, NO_STICKS, NO_GCS = 17154777, 28241790, 17231145, 23579003
SYSTEM, REMOTE_CONTROL, COMMUNICATION_LINKS = 20, 7, 12
ALL = 0xFFFFFFFF


def request(first: int, last: int, component: int = 1) -> Any:
    return mavlink.MAVLink_request_event_message(first % 65536, last % 65536, 1, component)


def of(messages: list[Any], *names: str) -> list[Any]:
    return [message for message in messages if message.get_type() in names]


def sent(peer: Peer, count: int) -> list[Any]:
    """Let the autopilot send so many takeoffs."""
    for _ in range(count):
        peer.texts.say(Severity.INFO, "Takeoff detected\t", "commander_takeoff_detected")
    return of(peer.run(0.004), "EVENT", "CURRENT_EVENT_SEQUENCE")


# --- service --------------------------------------------------------------------------------------------------


def test_the_first_events_reset_the_count_and_the_newest_alone_is_sent() -> None:
    reset, event = sent(Peer(), 3)
    assert (reset.sequence, reset.flags) == (FIRST_SEQUENCE + 2, 1)
    assert (event.sequence, event.id, event.log_levels) == (FIRST_SEQUENCE + 2, 21054825, 0x66)


def test_sequence_numbers_wrap_and_are_announced_every_three_seconds_on_every_link() -> None:
    peer = Peer()
    for link in (GCS, GIMBAL):
        peer.received(link)
    sent(peer, 12)
    peer.received(GIMBAL)
    announced = of(peer.run(3.1), "CURRENT_EVENT_SEQUENCE")
    assert [(message.sequence, message.flags) for message in announced] == [(1, 0)]
    assert len(of(peer.received(GIMBAL), "CURRENT_EVENT_SEQUENCE")) == 1


def test_before_the_first_event_the_announcement_is_a_reset() -> None:
    (announced,) = of(Peer().run(3.1), "CURRENT_EVENT_SEQUENCE")
    assert (announced.sequence, announced.flags) == (FIRST_SEQUENCE - 1, 1)


def test_what_is_kept_is_sent_to_everybody_again_and_what_is_not_is_an_error_each() -> None:
    peer = Peer()
    sent(peer, 30)
    newest = FIRST_SEQUENCE + 29
    replies = peer.send(request(newest - 1, newest))
    assert [(m.sequence, m.destination_system) for m in replies] == [((newest - 1) % 65536, 0), (newest % 65536, 0)]
    replies = peer.send(request(newest - 20, newest - 19))
    assert [m.get_type() for m in replies] == ["RESPONSE_EVENT_ERROR", "EVENT"]
    error = replies[0]
    assert (error.sequence, error.sequence_oldest_available) == ((newest - 20) % 65536, (newest - 19) % 65536)
    assert (error.target_system, error.target_component, error.reason) == (255, 190, 0)
    (future,) = peer.send(request(newest + 100, newest + 100))
    assert (future.get_type(), future.sequence) == ("RESPONSE_EVENT_ERROR", (newest + 100) % 65536)
    assert len(of(peer.send(request(newest, newest, component=100)), "EVENT")) == 1, "whomever it is for"


def test_a_range_longer_than_what_is_kept_gets_one_error_for_its_beginning() -> None:
    peer = Peer()
    sent(peer, 30)
    replies = peer.send(request(FIRST_SEQUENCE - 5000, FIRST_SEQUENCE + 29))
    assert [m.get_type() for m in replies] == ["RESPONSE_EVENT_ERROR"] + ["EVENT"] * 20
    assert len(peer.send(request(1, 65535))) == 21
    assert peer.send(request(0, 65535)) == [], "its end is its beginning"


def test_arguments_are_packed_as_the_table_types_them() -> None:
    events = Events()
    events.send("commander_armed_by", Severity.INFO, 4)
    events.send("vrtl_return_at", Severity.INFO, 520, 31)
    events.send("mission_climb_before_start", Severity.INFO, 49.9999694824)
    events.send("commander_disarm_denied_not_landed", Severity.CRITICAL)
    assert [event.arguments.hex() for event in events.recent] == ["04", "080200001f000000", "f8ff4742", ""]
    assert [event.log_levels for event in events.recent] == [0x66, 0x66, 0x66, 0x62]
    assert pack("Bh", (300, float("nan"))) == b"\x2c\0\0"
    with pytest.raises(KeyError):
        layout("no_such_event")


@pytest.mark.parametrize(
    ("name", "severity", "arguments", "levels"),
    [
        ("commander_kill_sw_engaged", Severity.INFO, (), 0x66),
        ("commander_kill_sw_engaged", Severity.CRITICAL, (), 0x62),
        ("commander_ctrl_high_latency_failed", Severity.CRITICAL, (), 0x62),
        ("commander_failsafe_enter_autopilot_disengaged", Severity.CRITICAL, (0, 3), 0x42),
        ("commander_failsafe_enter_low_flight_time_warn", Severity.WARNING, (), 0x64),
        ("commander_cal_cmd_denied", Severity.CRITICAL, (241,), 0x63),
        ("navigator_reposition_outside_geofence", Severity.CRITICAL, (), 0x63),
        ("navigator_change_altitude_outside_geofence", Severity.CRITICAL, (), 0x63),
        ("navigator_course_change_altitude_outside_geofence", Severity.CRITICAL, (), 0x63),
        ("mavlink_log_not_enough_bw", Severity.CRITICAL, (1000,), 0x33),
        ("mission_item_set_failed", Severity.CRITICAL, (), 0x33),
        ("mission_failed_to_read_wp", Severity.CRITICAL, (4,), 0x33),
        ("mc_pos_ctrl_cruise_set", Severity.CRITICAL, (4.0,), 0x44),
        ("ekf2_mag_type_invalid", Severity.CRITICAL, (7.0,), 0x44),
    ],
)
def test_an_event_has_levels_of_its_own(
    name: str, severity: Severity, arguments: tuple[float, ...], levels: int
) -> None:
    """As PX4 sends them (Commander.cpp, failsafe/framework.cpp, MulticopterPositionControl.cpp, navigator_main.cpp).

    `severity` is that of the text; the level for the log is in the high half, that for people in the low one.
    """
    events = Events()
    events.send(name, severity, *arguments)
    assert events.recent[-1].log_levels == levels


@pytest.mark.parametrize("loss", [0.05, 0.1, 0.3])
def test_a_ground_station_gets_every_event_over_a_lossy_link(loss: float) -> None:
    peer, receiver, chance = Peer(), EventReceiver(1), random.Random(7)
    wanted, received = 40, []
    for step in range(900):
        if step % 5 == 0 and step < 5 * wanted:
            peer.texts.say(Severity.INFO, "Armed by external command\t", "commander_armed_by", step // 5)
        heard, asked = peer.run(0.02), receiver.on_time(peer.now_us)
        while heard or asked:
            asked += [
                request
                for message in heard
                if chance.random() >= loss
                for request in receiver.on_message(peer.now_us, message)
            ]
            heard = [answer for request in asked if chance.random() >= loss for answer in peer.send(request)]
            asked = []
        received += receiver.take()
    numbers = [event.arguments[0] for event in received]
    assert numbers == list(range(numbers[0], wanted)) and numbers[0] <= 2
    assert receiver.missed == 0


def test_a_ground_station_skips_what_is_gone_and_begins_anew_after_a_restart() -> None:
    def event(sequence: int) -> Any:
        message = mavlink.MAVLink_event_message(21054825, 0, sequence, 0, 0, 102, [0] * 40)
        message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1))
        return message

    def other(message: Any) -> Any:
        message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1))
        return message

    receiver = EventReceiver(1)
    receiver.on_message(0, event(5))
    (asked,) = receiver.on_message(0, event(9))
    assert (asked.first_sequence, asked.last_sequence) == (6, 8)
    assert receiver.on_time(99_999) == []
    assert len(receiver.on_time(100_000)) == 1
    receiver.on_message(200_000, other(mavlink.MAVLink_response_event_error_message(6, 8, 255, 190, 0)))
    receiver.on_message(200_000, event(8))
    assert [each.sequence for each in receiver.take()] == [5, 8, 9]
    assert receiver.missed == 2
    receiver.on_message(300_000, other(mavlink.MAVLink_current_event_sequence_message(2, 1)))
    receiver.on_message(300_000, event(3))
    assert [each.sequence for each in receiver.take()] == [3]
    for _ in range(100):
        receiver.on_message(300_000, event(50))
        receiver.on_time(10_000_000)
    now_us = 10_000_000
    while receiver.on_time(now_us := now_us + 200_001):
        pass
    assert [each.sequence for each in receiver.take()] == [50]


# --- arming checks ----------------------------------------------------------------------------------------------


def rounds(vehicle: FakeVehicle) -> list[list[tuple[int, int, bytes]]]:
    """Reports since the last call: (id, log levels, arguments), from one summary to the other."""
    found: list[list[tuple[int, int, bytes]]] = []
    for event in vehicle.events.recent:
        if event.id == SUMMARY:
            found.append([])
        if found and (not found[-1] or found[-1][-1][0] != HEALTH):
            found[-1].append((event.id, event.log_levels, event.arguments))
    vehicle.events.recent.clear()
    return found


def ready() -> FakeVehicle:
    vehicle = FakeVehicle()
    vehicle.run(10.0)
    rounds(vehicle)
    return vehicle


def test_a_round_has_the_shape_and_the_bits_recorded_from_a_real_px4() -> None:
    """qgc_connect.json, RUN_PREARM_CHECKS on a quadrotor that stands in HOLD (events' ids as in v1.18)."""
    vehicle = ready()
    vehicle.commander._checks.update(vehicle.now_us, force_report=True)
    ((summary, *failures, health),) = rounds(vehicle)
    modes = 0x807F3BB0 & ~(1 << NavState.ALTITUDE_CRUISE)
    modes |= 1 << 9
    assert summary[:2] == (SUMMARY, 0x88)
    assert struct.unpack("<BIIII", summary[2])[:3] == (0, 1 << SYSTEM, 1 << REMOTE_CONTROL)
    assert struct.unpack("<BIIII", summary[2])[3:] == (modes, modes)
    assert failures == [
        (OFFBOARD_LOST, 0x33, struct.pack("<IB", 1 << NavState.OFFBOARD, SYSTEM)),
        (MISSION_MISSING, 0x66, struct.pack("<IB", 1 << NavState.AUTO_MISSION, SYSTEM)),
        (NO_STICKS, 0x44, struct.pack("<IB", ALL, REMOTE_CONTROL)),
    ]
    assert health[:2] == (HEALTH, 0x88)
    present = struct.unpack("<BIII", health[2])[1]
    assert struct.unpack("<BIII", health[2])[2:] == (0, 0)
    assert present & 0x28021802 == 0x28021802


def test_changes_are_reported_at_most_every_two_seconds_and_nothing_without_a_change() -> None:
    vehicle = ready()
    vehicle.run(10.0)
    assert rounds(vehicle) == []
    vehicle.battery = BatteryStatus(connected=True, remaining=0.2, warning=1)
    vehicle.run(0.3)
    assert len(rounds(vehicle)) == 1
    vehicle.parameters.set("CAL_MAG0_ID", 0)
    vehicle.run(1.5)
    assert rounds(vehicle) == []
    vehicle.run(0.5)
    ((_, *failures, _),) = rounds(vehicle)
    uncalibrated = layout("check_mag_not_calibrated")[0]
    assert uncalibrated in {failure[0] for failure in failures}


def test_a_lost_ground_station_is_a_remark_and_its_return_a_report() -> None:
    vehicle = ready()
    vehicle.gcs = False
    vehicle.run(20.0)
    ((_, *failures, health),) = rounds(vehicle)
    assert failures[-1] == (NO_GCS, 0x66, struct.pack("<IB", ALL, COMMUNICATION_LINKS))
    assert not struct.unpack("<BIII", health[2])[1] & 1 << COMMUNICATION_LINKS
    vehicle.gcs = True
    vehicle.run(1.0)
    assert len(rounds(vehicle)) == 1


def test_a_mode_that_prevents_arming_clears_its_bits_while_it_is_chosen() -> None:
    vehicle = ready()
    vehicle.set_mode(4, 5)
    vehicle.run(0.3)
    ((summary, *failures, _),) = rounds(vehicle)
    can_arm, can_run = struct.unpack("<BIIII", summary[2])[3:]
    assert not can_arm >> NavState.AUTO_RTL & 1 and can_run >> NavState.AUTO_RTL & 1
    assert layout("check_modes_cannot_takeoff")[0] in [failure[0] for failure in failures]


def test_offboard_says_what_its_setpoint_lacks() -> None:
    vehicle = ready()
    vehicle.topics.offboard_setpoint = OffboardSetpoint(
        vehicle.now_us, trajectory=TrajectorySetpoint(position=(0.0, 0.0, -5.0))
    )
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(xy_valid=False)
    vehicle.commander._checks.update(vehicle.now_us, force_report=True)
    ((_, *failures, _),) = rounds(vehicle)
    assert layout("check_modes_offboard_no_local_position")[0] in [failure[0] for failure in failures]


def test_a_dead_sensor_is_an_error_of_its_health() -> None:
    vehicle = ready()
    vehicle.topics.sensor_baro = SensorBaro(1)
    vehicle.commander._checks.update(vehicle.now_us, force_report=True)
    ((summary, *failures, health),) = rounds(vehicle)
    assert struct.unpack("<BIIII", summary[2])[3] == 0
    assert struct.unpack("<BIII", health[2])[2] == 1 << 1
    assert failures[0] == (layout("check_baro_no_data")[0], 0x33, struct.pack("<IBB", ALL, 1, 0))
