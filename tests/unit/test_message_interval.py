"""SET_MESSAGE_INTERVAL and GET_MESSAGE_INTERVAL: what streams have from the start, by default, and when set."""

import pytest

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, PAYLOAD, Peer, command_long, only

GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 510, 511, 512
ACCEPTED, DENIED = 0, 2


def test_an_interval_that_is_set_again_and_again_still_sends() -> None:
    """A stream keeps the moment of its last message (Mavlink::configure_stream)."""
    peer = Peer()
    peer.fly_and_run(1.0)
    count = 0
    for _ in range(10):
        count += len(only(peer.send(command_long(SET_MESSAGE_INTERVAL, 1, 1e6)), "SYS_STATUS"))
        count += len(only(peer.fly_and_run(0.5), "SYS_STATUS"))
    assert count == pytest.approx(5, abs=1)


@pytest.mark.parametrize(("interval_us", "sends"), [(1.0, False), (100.0, False), (448.0, False), (500.0, True)])
def test_an_interval_shorter_than_its_slack_sends_nothing(interval_us: float, sends: bool) -> None:
    """Three tenths of 1.5 ms, taken off in unsigned numbers (MavlinkStream::update); a real PX4 v1.18 was asked."""
    peer = Peer()
    peer.fly_and_run(1.0)
    peer.send(command_long(SET_MESSAGE_INTERVAL, 30, interval_us))
    assert bool(only(peer.fly_and_run(1.0), "ATTITUDE")) is sends
    peer.send(command_long(SET_MESSAGE_INTERVAL, 30, 100_000.0))
    assert only(peer.fly_and_run(1.0), "ATTITUDE"), "set anew it comes again"


@pytest.mark.parametrize(("number", "result"), [(0.0, 4), (65536.0, 0), (16777215.0, 0), (float("nan"), 0)])
def test_heartbeat_has_a_rate_under_another_number(number: float, result: int) -> None:
    """0 is no message there, but of others 16 bits count (set_message_interval); a real PX4 v1.18 was asked."""
    peer = Peer()
    peer.fly_and_run(1.0)
    assert only(peer.send(command_long(SET_MESSAGE_INTERVAL, number, 200_000.0)), "COMMAND_ACK")[0].result == result
    assert (len(only(peer.fly_and_run(2.0), "HEARTBEAT")) > 4) is (result == 0)


@pytest.mark.parametrize(
    ("number", "interval_us"),
    [
        (mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS, 2_000_000),
        (mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_SET_ATTITUDE, 200_000),
        (mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED, -1),
        (mavlink.MAVLINK_MSG_ID_CAMERA_TRIGGER, -1),
        (mavlink.MAVLINK_MSG_ID_COMMAND_LONG, -1),
        (mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, -1),
    ],
)
def test_streams_of_payloads_have_their_intervals_without_one(number: int, interval_us: int) -> None:
    """A real PX4 v1.18 without gimbal and camera; a stream without limit, and what is no stream, is -1."""
    peer = Peer()
    for link in (ONBOARD, PAYLOAD):
        for _ in range(2):
            replies = peer.send(command_long(GET_MESSAGE_INTERVAL, number), link)
            (told,) = only(replies, "MESSAGE_INTERVAL")
            assert told.interval_us == interval_us
            peer.send(command_long(SET_MESSAGE_INTERVAL, number, 0.0), link)


def test_streams_that_have_nothing_to_say_have_intervals() -> None:
    """NAV_CONTROLLER_OUTPUT runs from the start, GPS2_RAW without limit on the onboard link, SCALED_IMU2 not."""
    peer = Peer()
    intervals = []
    for number, link in ((62, GCS), (62, ONBOARD), (124, ONBOARD), (116, GCS)):
        replies = peer.send(command_long(GET_MESSAGE_INTERVAL, number), link)
        intervals.append(only(replies, "MESSAGE_INTERVAL")[0].interval_us)
    assert intervals == [1_000_000, 100_000, -1, -1]
    assert only(peer.send(command_long(SET_MESSAGE_INTERVAL, 116, 50_000.0)), "COMMAND_ACK")[0].result == ACCEPTED
    replies = peer.send(command_long(GET_MESSAGE_INTERVAL, 116))
    assert only(replies, "MESSAGE_INTERVAL")[0].interval_us == 50_000
    assert only(peer.send(command_long(REQUEST_MESSAGE, 116)), "COMMAND_ACK")[0].result == DENIED
    peer.send(command_long(SET_MESSAGE_INTERVAL, 116, -1.0))
    replies = peer.send(command_long(GET_MESSAGE_INTERVAL, 116))
    assert only(replies, "MESSAGE_INTERVAL")[0].interval_us == -1


@pytest.mark.parametrize(
    ("name", "first_us", "default_us"),
    [
        ("ATTITUDE_QUATERNION", 20_000, 100_000),
        ("RC_CHANNELS", 50_000, 200_000),
        ("OPTICAL_FLOW_RAD", 100_000, -1),
        ("GPS_RAW_INT", 200_000, 200_000),
        ("GPS_GLOBAL_ORIGIN", 1_000_000, 1_000_000),
        ("TIME_ESTIMATE_TO_TARGET", 1_000_000, 1_000_000),
        ("ADSB_VEHICLE", 200_000, 200_000),
        ("GIMBAL_DEVICE_ATTITUDE_STATUS", 200_000, 200_000),
        ("MOUNT_ORIENTATION", 100_000, 100_000),
        ("FUEL_STATUS", 1_000_000, 1_000_000),
        ("OPEN_DRONE_ID_ARM_STATUS", 1_000_000, 1_000_000),
    ],
)
def test_intervals_of_a_ground_stations_link(name: str, first_us: int, default_us: int) -> None:
    """By px4-rc.mavlink, and by the mode (Mavlink::configure_streams_to_default)."""
    peer, number = Peer(), getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    told = []
    for _ in range(2):
        replies = peer.send(command_long(GET_MESSAGE_INTERVAL, number))
        told.append(only(replies, "MESSAGE_INTERVAL")[0].interval_us)
        peer.send(command_long(SET_MESSAGE_INTERVAL, number, 0.0))
    assert told == [first_us, default_us]


@pytest.mark.parametrize("name", ["COLLISION", "GPS_RTCM_DATA"])
def test_what_px4_has_no_stream_for_has_no_interval(name: str) -> None:
    message_id = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    ack = only(Peer().send(command_long(SET_MESSAGE_INTERVAL, message_id, 1e6)), "COMMAND_ACK")[0]
    assert ack.result == mavlink.MAV_RESULT_FAILED
