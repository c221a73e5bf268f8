"""What each link streams and how often, against the rates measured on PX4 v1.18, and what the messages say."""

import math
from collections import Counter

import pytest

from autopilot.mavlink import rates
from autopilot.mavlink.streams import modules
from autopilot.topics import VehicleLandDetected, VehicleStatus
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, GIMBAL, LAT_DEG, ONBOARD, PAYLOAD, Peer, command_long, only

SECONDS = 6.0
EXPECTED_HZ = {
    GCS: {"ATTITUDE": 50, "GPS_RAW_INT": 5, "SERVO_OUTPUT_RAW": 50, "VFR_HUD": 4, "ESC_STATUS": 2, "HEARTBEAT": 1},
    ONBOARD: {
        "ATTITUDE": 100,
        "GPS_RAW_INT": 8,
        "HIGHRES_IMU": 50,
        "LOCAL_POSITION_NED": 30,
        "ODOMETRY": 30,
        "PING": 1,
    },
    PAYLOAD: {"GPS_RAW_INT": 8, "HEARTBEAT": 1, "MISSION_CURRENT": 1},
    GIMBAL: {"AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": 20, "HEARTBEAT": 1, "CURRENT_EVENT_SEQUENCE": 1 / 3},
}
OF_OTHERS = {"ADSB_VEHICLE", "DEBUG", "DEBUG_FLOAT_ARRAY", "DEBUG_VECT", "NAMED_VALUE_FLOAT"}
"""Streams of what others have sent before."""
NOT_YET = OF_OTHERS | {"ORBIT_EXECUTION_STATUS", "POSITION_TARGET_GLOBAL_INT", "RC_CHANNELS", "WIND_COV"}
"""Streams without data on a vehicle that stands disarmed."""
SELDOM_HZ = 0.2
OF_PAYLOADS = {
    "CAMERA_IMAGE_CAPTURED",
    "CAMERA_TRIGGER",
    "GIMBAL_DEVICE_SET_ATTITUDE",
    "GIMBAL_MANAGER_INFORMATION",
    "GIMBAL_MANAGER_STATUS",
}
"""And those without data on a vehicle that has neither camera nor gimbal."""


@pytest.mark.parametrize("link", [GCS, ONBOARD, PAYLOAD, GIMBAL])
def test_rates_are_px4s(link: int) -> None:
    peer = Peer()
    peer.fly_and_run(0.5, link)
    counts = Counter(message.get_type() for message in peer.fly_and_run(SECONDS, link))
    for name, hz in EXPECTED_HZ[link].items():
        assert counts[name] / SECONDS == pytest.approx(hz, rel=0.15, abs=0.35), name
    if link != PAYLOAD:
        table = rates.RATES[peer.mavlink.links[link].mode]
        seldom = {name for name, hz in table.items() if rates.UNLIMITED < hz < SELDOM_HZ}
        expected = (set(table) | {"CURRENT_EVENT_SEQUENCE"}) - seldom
        assert set(counts) == expected - NOT_YET


def test_the_payload_link_keeps_its_data_rate() -> None:
    peer = Peer()
    peer.fly_and_run(2.0, PAYLOAD)
    link = peer.mavlink.links[PAYLOAD]
    before = link.bytes_sent
    messages = peer.fly_and_run(SECONDS, PAYLOAD)
    assert (link.bytes_sent - before) / SECONDS < 4400
    assert len(only(messages, "ATTITUDE")) / SECONDS == pytest.approx(11.84, rel=0.3)


def test_a_rover_has_no_escs_and_no_servo_outputs() -> None:
    peer = Peer(kind="rover")
    found = {message.get_type() for message in peer.fly_and_run(3.0)}
    assert not found & {"ESC_INFO", "ESC_STATUS", "SERVO_OUTPUT_RAW", "ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED"}
    assert "GLOBAL_POSITION_INT" in found


def test_nothing_is_streamed_that_is_not_known_yet() -> None:
    found = {message.get_type() for message in Peer().run(3.0)}
    assert not found & {"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "HOME_POSITION", "GPS_RAW_INT"}
    assert {"HEARTBEAT", "SYS_STATUS", "ATTITUDE"} <= found


def test_sequence_numbers_have_no_gaps_and_datagrams_fit() -> None:
    peer = Peer()
    sequences = [message.get_seq() for message in peer.fly_and_run(2.0, ONBOARD)]
    assert sequences == [index & 255 for index in range(len(sequences))]
    peer.now_us += 1_000_000
    peer.fly()
    peer.mavlink.update(peer.now_us)
    assert max(len(data) for data in peer.mavlink.links[ONBOARD].outbox) <= 1400


def test_contents() -> None:
    peer = Peer()
    latest = {message.get_type(): message for message in peer.fly_and_run(3.0)}
    heartbeat = latest["HEARTBEAT"]
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (13, 12, 29)
    assert heartbeat.custom_mode == 50593792
    position = latest["GLOBAL_POSITION_INT"]
    assert (position.lat, position.relative_alt, position.vx) == (round(LAT_DEG * 1e7), 3000, 50)
    assert position.hdg == 0
    gps = latest["GPS_RAW_INT"]
    assert (gps.eph, gps.epv, gps.h_acc, gps.v_acc, gps.vel_acc, gps.fix_type) == (70, 110, 900, 1780, 400, 3)
    battery = latest["BATTERY_STATUS"]
    assert (battery.voltages[0], battery.voltages[1], battery.current_battery) == (16200, 65535, -1)
    assert (battery.battery_remaining, battery.energy_consumed, battery.charge_state) == (100, -1, 1)
    assert (latest["SYS_STATUS"].voltage_battery, latest["SYS_STATUS"].battery_remaining) == (16200, 100)
    assert latest["EXTENDED_SYS_STATE"].landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    mission = latest["MISSION_CURRENT"]
    assert (mission.seq, mission.total, mission.mission_state, mission.mission_mode) == (0, 65535, 1, 2)
    assert math.isnan(latest["POSITION_TARGET_LOCAL_NED"].x)
    assert latest["ALTITUDE"].altitude_amsl == pytest.approx(492.4, abs=1e-3)
    assert latest["CURRENT_MODE"].custom_mode == 50593792


def test_armed_and_in_the_air() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(armed=True, system_status=4)
    peer.topics.vehicle_land_detected = VehicleLandDetected(landed=False)
    latest = {message.get_type(): message for message in peer.fly_and_run(1.1)}
    assert (latest["HEARTBEAT"].base_mode, latest["HEARTBEAT"].system_status) == (157, 4)
    assert latest["EXTENDED_SYS_STATE"].landed_state == mavlink.MAV_LANDED_STATE_IN_AIR


def test_every_message_in_rates_has_a_module_named_as_it() -> None:
    for table in rates.RATES.values():
        assert set(table) <= set(modules())
    for name, module in modules().items():
        assert mavlink.mavlink_map[module.ID].msgname == name


@pytest.mark.parametrize("name", sorted(modules()))
def test_every_stream_can_be_requested(name: str) -> None:
    peer = Peer()
    peer.fly_and_run(0.2)
    replies = peer.send(command_long(512, modules()[name].ID))
    ack = only(replies, "COMMAND_ACK")[0]
    assert (ack.result == 0) == bool(only(replies, name))
    assert ack.result == (2 if name in NOT_YET | OF_PAYLOADS else 0)


def test_a_receiver_that_does_not_tell_its_accuracy_is_shown_without() -> None:
    """Another simulator may send HIL_GPS with unknown DOP."""
    peer = Peer()
    peer.fly_and_run(0.5)
    peer.topics.sensor_gps = peer.topics.sensor_gps._replace(eph=float("nan"), epv=float("nan"))
    message = only(peer.send(command_long(512, 24)), "GPS_RAW_INT")[0]
    assert (message.h_acc, message.v_acc) == (0, 0)


def test_high_latency_tells_all_in_one() -> None:
    peer = Peer()
    peer.now_us = 1_000_000
    peer.fly()
    told = only(peer.send(command_long(512, 235)), "HIGH_LATENCY2")[0]
    assert (told.latitude, told.longitude, told.altitude) == (473977420, 85455940, 492)
    assert (told.type, told.autopilot, told.battery, told.wp_num) == (13, 12, 100, 65535)
    assert told.custom_mode == 4 | 3 << 8
    assert told.groundspeed == round(0.5 * 5)


def test_high_latency_of_a_vehicle_that_knows_nothing() -> None:
    told = only(Peer().send(command_long(512, 235)), "HIGH_LATENCY2")[0]
    assert (told.latitude, told.eph, told.battery) == (0, 255, -1)
