"""Framing and forwarding: what a link makes of damaged, split and foreign bytes, and what passes to the others."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, GIMBAL, ONBOARD, PAYLOAD, Peer, command_long, names, only

HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)


def frame(peer: Peer, message: Any) -> bytes:
    return bytes(message.pack(peer.encoder))


def acks(messages: list[Any]) -> int:
    return len(only(messages, "COMMAND_ACK"))


def test_two_messages_in_a_datagram_and_one_in_two() -> None:
    peer = Peer()
    data = frame(peer, command_long(401))
    assert acks(peer.send_bytes(data + data)) == 2
    assert acks(peer.send_bytes(data[:7])) == 0
    assert acks(peer.send_bytes(data[7:])) == 1


class Plugged:
    """A device that says what it is given, and keeps what it hears."""

    def __init__(self) -> None:
        self.outbox, self.due_us, self.heard = list[bytes](), 1 << 60, list[Any]()
        self._parser = mavlink.MAVLink(None)

    def on_datagram(self, now_us: int, data: bytes) -> None:
        self.heard += self._parser.parse_buffer(data) or []

    def on_time(self, now_us: int) -> None:
        pass


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        (command_long(401), "COMMAND_ACK"),
        (mavlink.MAVLink_set_mode_message(1, 1, 4 << 16), "COMMAND_ACK"),
        (mavlink.MAVLink_mission_request_list_message(1, 1, 0), "MISSION_COUNT"),
    ],
    ids=lambda each: each if isinstance(each, str) else str(each.get_type()),
)
def test_a_device_that_is_plugged_in_is_answered_as_who_speaks_on_a_link(asked: Any, answer: str) -> None:
    """mavlink_main.cpp: each instance has its mission manager, and sends the acks of whom it has heard."""
    peer, device = Peer(), Plugged()
    peer.mavlink.plug_in("camera", "wire", device)
    device.outbox.append(bytes(asked.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=100))))
    peer.run(0.1)
    (said,) = only(device.heard, answer)
    assert (said.target_system, said.target_component) == (1, 100)


def test_mavlink_1_is_understood_and_answered_in_2() -> None:
    peer = Peer()
    message = command_long(401)
    data = bytes(message.pack(mavlink.MAVLink(None, srcSystem=255, srcComponent=190), force_mavlink1=True))
    assert data[0] == 0xFE
    peer.mavlink.on_datagram(0, GCS, data)
    assert peer.mavlink.links[GCS].outbox[0][0] == 0xFD


@pytest.mark.parametrize(
    "garbage",
    [b"", bytes(range(256)), b"\xfd" * 300, b"\xfd\x09\x00\x00\x00\xff\xbe\xff\xff\x00" + b"x" * 11],
    ids=["empty", "counting", "starts", "unknown id"],
)
def test_garbage_does_no_harm(garbage: bytes) -> None:
    peer = Peer()
    assert peer.send_bytes(garbage) == []
    for _ in range(20):  # a start byte in the garbage may swallow a frame's length of what follows
        replies = peer.send(command_long(401))
    assert acks(replies) == 1


def test_a_damaged_frame_is_dropped() -> None:
    peer = Peer()
    data = bytearray(frame(peer, command_long(401)))
    data[15] ^= 1
    assert acks(peer.send_bytes(bytes(data))) == 0
    assert acks(peer.send(command_long(401))) == 1


def test_lost_messages_are_counted() -> None:
    peer = Peer()
    peer.send(HEARTBEAT)
    peer.encoder.seq += 3
    peer.send(HEARTBEAT)
    assert peer.mavlink.links[GCS].messages_lost == 3


@pytest.mark.parametrize(
    ("target", "passes"),
    [
        ((0, 0), True),
        ((245, 191), True),
        ((255, 190), False),
        ((1, 0), False),
        ((1, 1), False),
        ((1, 100), False),
        ((77, 1), False),
    ],
)
def test_commands_pass_to_where_their_target_was_heard(target: tuple[int, int], passes: bool) -> None:
    peer, companion = Peer(), mavlink.MAVLink(None, srcSystem=245, srcComponent=191)
    peer.send(HEARTBEAT, GCS)
    peer.send_bytes(bytes(HEARTBEAT.pack(companion)), ONBOARD)
    for link in (GCS, ONBOARD):
        peer.received(link)
    peer.send(command_long(31000, target=target), GCS)
    assert ("COMMAND_LONG" in names(peer.received(ONBOARD))) == passes


def heard_on(peer: Peer, system: int, component: int, link: int) -> Any:
    """A component that has sent its heartbeat on a link; all outboxes are empty afterwards."""
    codec = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    peer.send_bytes(bytes(HEARTBEAT.pack(codec)), link)
    for each in (GCS, ONBOARD, PAYLOAD, GIMBAL):
        peer.received(each)
    return codec


def test_broadcasts_pass_unchanged_to_all_other_links_where_somebody_was_heard() -> None:
    peer = Peer()
    heard_on(peer, 245, 191, ONBOARD), heard_on(peer, 1, 154, GIMBAL)
    data = frame(peer, HEARTBEAT)
    assert "HEARTBEAT" not in names(peer.send_bytes(data, GCS))
    for link, passed in ((ONBOARD, data), (PAYLOAD, b""), (GIMBAL, data)):
        assert b"".join(peer.mavlink.links[link].outbox) == passed


def test_heartbeats_stay_where_they_are_if_told_so() -> None:
    peer = Peer()
    heard_on(peer, 245, 191, ONBOARD)
    peer.parameters.set("MAV_HB_FORW_EN", 0)
    peer.run(0.1)
    peer.received(ONBOARD)
    peer.send(HEARTBEAT)
    assert peer.received(ONBOARD) == []


def test_a_camera_on_the_onboard_link_is_commanded_and_its_answer_comes_back() -> None:
    peer = Peer()
    camera, _ = heard_on(peer, 1, 100, ONBOARD), heard_on(peer, 255, 190, GCS)
    assert peer.send(command_long(2000, target=(1, 100))) == []
    (asked,) = peer.received(ONBOARD)
    assert (asked.get_type(), asked.command, asked.get_srcSystem()) == ("COMMAND_LONG", 2000, 255)
    ack = mavlink.MAVLink_command_ack_message(2000, 0, 0, 0, 255, 190)
    assert peer.send_bytes(bytes(ack.pack(camera)), ONBOARD) == []
    (answer,) = peer.received(GCS)
    assert (answer.get_type(), answer.get_srcSystem(), answer.get_srcComponent()) == ("COMMAND_ACK", 1, 100)


def test_who_speaks_on_two_links_hears_an_acknowledgement_on_both() -> None:
    peer = Peer()
    heard_on(peer, 255, 190, GCS), heard_on(peer, 255, 190, ONBOARD), heard_on(peer, 245, 191, PAYLOAD)
    assert acks(peer.send(command_long(401), GCS)) == 1
    assert [acks(peer.received(link)) for link in (ONBOARD, PAYLOAD, GIMBAL)] == [1, 0, 0]


@pytest.mark.parametrize("payload_type", [0, 200, 32767, 65535])
def test_tunnels_pass_by_their_target_whatever_they_carry(payload_type: int) -> None:
    peer = Peer()
    heard_on(peer, 245, 191, ONBOARD), heard_on(peer, 246, 191, PAYLOAD)
    data = frame(peer, mavlink.MAVLink_tunnel_message(245, 191, payload_type, 3, [1, 2, 3] + [0] * 125))
    assert peer.send_bytes(data) == []
    assert peer.mavlink.links[ONBOARD].outbox == [data]
    assert peer.mavlink.links[PAYLOAD].outbox == []


@pytest.mark.parametrize(("number", "taken"), [(400, False), (2510, False), (176, True), (212, True), (420, True)])
def test_few_orders_are_taken_from_who_bears_our_own_address(number: int, taken: bool) -> None:
    """To arm, to stream the log; to change the mode, to tune, to fail (handle_message_command_both)."""
    handled: list[int] = []
    peer = Peer(lambda now_us, command: handled.append(command.command), system=1, component=1)
    assert peer.send(command_long(number, 1.0)) == []
    assert handled == [number] * taken
    assert acks(peer.send(command_long(511, 30.0, 100_000.0))) == 1


def test_a_link_in_gimbal_mode_answers_nobody_but_passes_on() -> None:
    peer = Peer()
    heard_on(peer, 245, 191, ONBOARD)
    assert peer.send(command_long(401), GIMBAL) == []
    assert peer.send(mavlink.MAVLink_ping_message(1, 1, 0, 0), GIMBAL) == []
    assert names(peer.received(ONBOARD)) == ["PING"]


def test_a_link_knows_sixteen_senders_and_acknowledges_nothing_to_the_seventeenth() -> None:
    """It is obeyed (MavlinkReceiver::update_rx_stats, Mavlink::handleAndGetCurrentCommandAck)."""
    peer = Peer()
    for system in range(2, 40):
        heard_on(peer, system, 1, GCS)
    link = peer.mavlink.links[GCS]
    assert (link.heard(17, 1), link.heard(18, 1), link.messages_received) == (True, False, 16)
    assert names(peer.send(command_long(512, 148))) == ["AUTOPILOT_VERSION"]


def test_lost_messages_are_counted_modulo_255_as_in_px4() -> None:
    peer = Peer()
    for sequence in (254, 255, 0, 1, 250, 3):
        peer.encoder.seq = sequence
        peer.send(HEARTBEAT)
    # 255 → 0 counts 0; 1 → 250 lost 248; 250 → 3 lost 8, of which PX4 counts 7.
    assert peer.mavlink.links[GCS].messages_lost == 248 + 7


@pytest.mark.parametrize("sender", [(245, 191), (1, 191), (1, 1)])
def test_what_a_companion_says_comes_to_the_ground_station_and_the_other_way(sender: tuple[int, int]) -> None:
    """Whoever it says that it is: a real PX4 passed all three on (6a1c532983)."""
    peer = Peer()
    heard_on(peer, 255, 190, GCS)
    companion = heard_on(peer, *sender, ONBOARD)
    text = mavlink.MAVLink_statustext_message(6, b"hello", 0, 0)
    peer.send_bytes(bytes(text.pack(companion)), ONBOARD)
    (heard,) = peer.received(GCS)
    assert (heard.text, heard.get_srcSystem(), heard.get_srcComponent()) == ("hello", *sender)
    peer.send(text)
    assert [message.text for message in peer.received(ONBOARD)] == ["hello"]


def test_a_datagram_is_never_longer_than_an_ethernet_frame() -> None:
    peer = Peer()
    peer.send(command_long(512, 435, 0))
    for _ in range(200):
        peer.mavlink.on_datagram(0, GCS, frame(peer, command_long(512, 435, 0)))
    assert max(len(data) for data in peer.mavlink.links[GCS].outbox) <= 1400


def test_link_node_status_tells_counts_and_the_rates_of_the_last_second() -> None:
    peer = Peer()
    ping = frame(peer, mavlink.MAVLink_ping_message(1, 1, 1, 1))
    for _ in range(50):
        for _ in range(5):
            peer.send_bytes(frame(peer, mavlink.MAVLink_ping_message(1, 1, 1, 1)))
            peer.encoder.seq = (peer.encoder.seq + 1) & 255
        peer.run(0.1)
    peer.send_bytes(b"\xfd" + ping[1:-1] + b"?")
    status = only(peer.fly_and_run(2.0), "LINK_NODE_STATUS")
    assert (status[0].messages_received, status[0].messages_lost, status[0].rx_parse_err) == (250, 0, 1)
    assert status[0].rx_rate == pytest.approx(50 * len(ping), rel=0.15)
    assert status[-1].rx_rate == 0
    assert status[-1].tx_rate > 1_000 and status[-1].messages_sent > status[0].messages_sent
