"""Heartbeats and time, and what is told again of others: batteries, aircraft, numbers; as measured on PX4 v1.18."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.topics import BatteryStatus, GcsHeartbeats
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, command_long, only


def test_answers_to_our_pings_are_timed() -> None:
    peer = Peer()
    pings = peer.mavlink.links[GCS].pings
    peer.now_us = 1_000_000
    for sequence, sent_us in ((5, 998_000), (6, 996_000), (9, 990_000)):
        peer.send(mavlink.MAVLink_ping_message(sent_us, sequence, 1, 1))
    peer.send(mavlink.MAVLink_ping_message(0, 10, 7, 1))
    assert (pings.answers, pings.dropped, pings.last_ms, pings.max_ms, pings.min_ms) == (3, 2, 10.0, 10.0, 2.0)
    assert pings.mean_ms == (10.0 + (4.0 + 1.0) / 2.0) / 2.0


def test_ping_timesync_heartbeat() -> None:
    peer = Peer()
    peer.now_us = 5_000_000
    reply = peer.send(mavlink.MAVLink_ping_message(7, 42, 0, 0))[0]
    assert (reply.seq, reply.target_system, reply.target_component) == (42, 255, 190)
    assert peer.send(mavlink.MAVLink_ping_message(7, 42, 1, 1)) == []
    reply = peer.send(mavlink.MAVLink_timesync_message(0, 123))[0]
    assert (reply.tc1, reply.ts1) == (5_000_000_000, 123)
    assert bytes(reply.get_msgbuf())[10:-2][16:] == bytes((255, 190)), "target_system and target_component"
    peer.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    assert peer.topics.gcs_heartbeats.gcs_us == 5_000_000
    peer.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3), ONBOARD)
    assert peer.topics.gcs_heartbeats.onboard_us == 0, "not a component of this vehicle"


def test_a_component_of_our_own_system_hears_an_answer_to_its_ping() -> None:
    """Anybody does (MavlinkReceiver::handle_message_ping)."""
    (reply,) = Peer(system=1, component=191).send(mavlink.MAVLink_ping_message(7, 42, 0, 0), ONBOARD)
    assert (reply.time_usec, reply.seq, reply.target_system, reply.target_component) == (7, 42, 1, 191)


def test_heartbeats_of_components() -> None:
    """By MAV_TYPE; well are those in standby and active (MavlinkReceiver::handle_message_heartbeat)."""
    peer = Peer(system=1, component=191)
    peer.now_us = 5_000_000
    for kind in (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_TYPE_ADSB):
        peer.send(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 0, 3), ONBOARD)
    peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_PARACHUTE, 8, 0, 0, 4, 3), ONBOARD)
    peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_ODID, 8, 0, 0, 5, 3), ONBOARD)
    assert peer.topics.gcs_heartbeats == GcsHeartbeats(0, 5_000_000, 5_000_000, True, 5_000_000, False, 5_000_000)


@pytest.mark.parametrize("kind", [mavlink.MAV_TYPE_ADSB, mavlink.MAV_TYPE_FLARM])
def test_receivers_of_traffic(kind: int) -> None:
    peer = Peer(system=1, component=156)
    peer.now_us = 5_000_000
    peer.send(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 0, 3), ONBOARD)
    assert peer.topics.gcs_heartbeats.adsb_us == 5_000_000


def smart_battery(remaining_pct: int, *cells_mv: int) -> Any:
    voltages = [*cells_mv, *(65535,) * (10 - len(cells_mv))]
    return mavlink.MAVLink_battery_status_message(1, 1, 1, 32767, voltages, 150, 12, -1, remaining_pct)


def test_a_battery_of_our_own_system_stands_in_the_place_of_ours_until_that_is_measured_again() -> None:
    peer = Peer(system=1, component=180)
    peer.now_us = 1_000
    peer.fly()
    peer.send(smart_battery(6, 3501, 3502, 3503))
    battery = only(peer.send(command_long(512, 147)), "BATTERY_STATUS")[0]
    assert battery.voltages[:4] == [3501, 3502, 3503, 65535]
    assert (battery.id, battery.battery_remaining, battery.charge_state) == (255, 6, 3)
    status = only(peer.send(command_long(512, 1)), "SYS_STATUS")[0]
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (10506, 150, 6)
    heard = only(peer.fly_and_run(4.5), "BATTERY_STATUS")
    assert {(battery.id, battery.voltages[0], battery.battery_remaining) for battery in heard} == {(0, 16200, 100)}


def test_a_battery_that_does_not_know_its_charge_warns_of_nothing() -> None:
    """-1 is not known, neither of the charge nor of the current (handle_message_battery_status)."""
    peer = Peer(system=1, component=180)
    peer.now_us = 1_000
    peer.fly()
    cells = [3500, *(65535,) * 9]
    peer.send(mavlink.MAVLink_battery_status_message(0, 1, 1, 2550, cells, -1, -1, -1, -1, 90))
    heard = peer.topics.battery_status
    assert (heard.remaining, heard.current_a, heard.warning) == (-1.0, -1.0, 0)
    told = only(peer.run(2.5), "BATTERY_STATUS")[-1]
    assert (told.battery_remaining, told.current_battery, told.current_consumed) == (-1, -1, -1)
    assert (told.temperature, told.time_remaining, told.charge_state) == (2550, 90, 1)
    status = only(peer.send(command_long(512, 1), ONBOARD), "SYS_STATUS")[0]
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (3500, -1, -1)
    peer.send(mavlink.MAVLink_battery_status_message(0, 1, 1, 32767, cells, -250, -1, -1, 50))
    told = only(peer.run(2.5), "BATTERY_STATUS")[-1]
    assert (told.temperature, told.current_battery, told.time_remaining) == (32767, -250, 0), "it is charged"


@pytest.mark.parametrize(
    ("charge_pct", "cells_mv", "told_mv", "told_pct"),
    [(7, (3700, 4002), [3700, 4001, 65535], 7), (15, (0, 3700), [3700, 65535, 65535], 16)],
)
def test_what_float32_makes_of_a_battery(
    charge_pct: int, cells_mv: tuple[int, ...], told_mv: list[int], told_pct: int
) -> None:
    """Cells lose their fractions and the charge in SYS_STATUS goes up to the next percent, after their products have
    been rounded; without a first cell the sum stands there (streams/BATTERY_STATUS.hpp, SYS_STATUS.hpp).
    """
    peer = Peer(system=1, component=180)
    peer.now_us = 1_000
    peer.send(smart_battery(charge_pct, *cells_mv))
    assert only(peer.send(command_long(512, 147)), "BATTERY_STATUS")[0].voltages[:3] == told_mv
    assert only(peer.send(command_long(512, 1)), "SYS_STATUS")[0].battery_remaining == told_pct


def test_a_voltage_that_no_cell_holds_is_told_in_several() -> None:
    """65534 mV at most in each (streams/BATTERY_STATUS.hpp)."""
    peer = Peer()
    peer.now_us = 1_000
    peer.topics.battery_status = BatteryStatus(1_000, True, 100.0, -1.0, 1.0)
    battery = only(peer.send(command_long(512, 147)), "BATTERY_STATUS")[0]
    assert battery.voltages[:3] == [65534, 34466, 65535]
    peer.topics.battery_status = BatteryStatus(2_000, True, 700.0, -1.0, 1.0)
    assert set(only(peer.send(command_long(512, 147)), "BATTERY_STATUS")[0].voltages) == {65535}


def test_batteries_of_others_are_not_ours() -> None:
    for system, component in ((255, 180), (1, 1)):
        peer = Peer(system=system, component=component)
        peer.send(smart_battery(6, 3500))
        assert not peer.topics.battery_status.connected


def adsb_vehicle(icao_address: int, **changes: float) -> Any:
    fields: dict[str, Any] = {
        "lat": 473977420, "lon": 85455940, "altitude_type": 1, "altitude": 600_000, "heading": 12345,
        "hor_velocity": 5000, "ver_velocity": -250, "callsign": b"HBABC", "emitter_type": 3, "tslc": 2,
        "flags": 0x3F, "squawk": 7000,
    }  # fmt: skip
    return mavlink.MAVLink_adsb_vehicle_message(icao_address, **fields | changes)


def test_aircraft_are_told_again_each_once_on_every_link() -> None:
    peer = Peer()
    for number in (1, 2, 3):
        peer.send(adsb_vehicle(number, flags=0x7F))
    for link in (GCS, ONBOARD):
        heard = only(peer.run(0.3, link), "ADSB_VEHICLE")
        assert [vehicle.ICAO_address for vehicle in heard if vehicle.get_srcSystem() == 1] == [1, 2, 3]
        first = next(vehicle for vehicle in heard if vehicle.get_srcSystem() == 1).to_dict()
        assert first == adsb_vehicle(1).to_dict()
    assert peer.topics.transponder_reports[0].heading == pytest.approx(math.radians(123.45))
    assert peer.send(command_long(512, 246))[-1].result == 2, "nothing new, nothing on request"


def test_an_aircraft_told_again_loses_its_fractions() -> None:
    """1e-7 does not bring every degree back, nor float32 every speed (streams/ADSB_VEHICLE.hpp)."""
    peer = Peer()
    peer.send(adsb_vehicle(1, lat=473_977_421, hor_velocity=53, ver_velocity=-118))
    (told,) = only(peer.run(0.3), "ADSB_VEHICLE")
    assert (told.lat, told.lon, told.hor_velocity, told.ver_velocity) == (473_977_420, 85_455_940, 52, -117)


def test_of_many_aircraft_the_last_twenty_wait() -> None:
    peer = Peer()
    for number in range(1, 31):
        peer.send(adsb_vehicle(number))
    heard = only(peer.run(0.3), "ADSB_VEHICLE")
    assert [vehicle.ICAO_address for vehicle in heard] == list(range(11, 31))


@pytest.mark.parametrize(
    ("sent", "told"),
    [
        (mavlink.MAVLink_named_value_float_message(7, b"speed", 1.5), {"name": "speed", "value": 1.5}),
        (mavlink.MAVLink_named_value_int_message(7, b"count", -3), {"name": "count", "value": -3.0}),
        (mavlink.MAVLink_named_value_float_message(7, b"tenletters", 1.5), {"name": "tenletter"}),
        (mavlink.MAVLink_debug_message(7, 5, 2.5), {"ind": 5, "value": 2.5}),
        (mavlink.MAVLink_debug_vect_message(b"wind", 7, 1.0, 2.0, 3.0), {"name": "wind", "x": 1.0, "z": 3.0}),
        (mavlink.MAVLink_debug_float_array_message(7, b"many", 9, [4.0] * 58), {"array_id": 9, "data": [4.0] * 58}),
    ],
)
def test_numbers_of_others_are_told_again(sent: Any, told: dict[str, Any]) -> None:
    """Once, by the stream of their name, at our time; a named integer is a float (handle_message_named_value_int)."""
    name = sent.get_type().replace("_INT", "_FLOAT")
    peer = Peer()
    peer.now_us = 3_000_000
    peer.send(sent, ONBOARD)
    heard = [message for message in only(peer.run(2.5), name) if message.get_srcSystem() == 1]
    assert len(heard) == 1
    assert told.items() <= heard[0].to_dict().items()
    assert (heard[0].time_usec if hasattr(heard[0], "time_usec") else heard[0].time_boot_ms * 1000) == 3_000_000
