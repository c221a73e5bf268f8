"""Signing: pymavlink signs as a ground station does; what is believed, what is not, and what a restart remembers."""

from pathlib import Path
from typing import Any

import pytest

from sitl_emu.autopilot.mavlink.services.signing import SigningKeyFile
from sitl_emu.autopilot.mavlink.signature import NO_KEY, SigningKey
from sitl_emu.autopilot.topics import ActuatorArmed
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs import signing
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, command_long, names, only

KEY, OTHER_KEY = signing.key_of("correct horse"), signing.key_of("battery staple")
NOW = signing.timestamp(1_790_000_000_000_000)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
KEY_FILE = "mavlink/mavlink-signing-key.bin"


def setup(key: bytes, now: int = NOW, target: tuple[int, int] = (1, 1)) -> Any:
    return mavlink.MAVLink_setup_signing_message(*target, list(key), now)


def texts(peer: Peer) -> list[str]:
    return [text.text for text in peer.texts.recent]


def signing_peer(root: Path | None = None) -> Peer:
    """A peer that has given its key, and signs."""
    peer = Peer(root=root)
    peer.send(setup(KEY))
    signing.sign(peer.encoder, KEY, NOW)
    return peer


def acked(peer: Peer, link: int = GCS) -> bool:
    return "COMMAND_ACK" in names(peer.send(command_long(401), link))


def test_without_a_key_signatures_of_any_key_are_taken_and_answers_are_unsigned() -> None:
    peer = Peer()
    signing.sign(peer.encoder, OTHER_KEY, NOW)
    (ack,) = peer.send(command_long(401))
    assert ack.get_header().incompat_flags == 0


def test_a_first_key_is_taken_unsigned_and_everything_is_signed_from_then_on() -> None:
    peer = Peer()
    peer.send(HEARTBEAT)
    peer.send(setup(KEY))
    assert texts(peer)[-1] == "MAVLink signing key accepted"
    ear: Any = mavlink.MAVLink(None)
    signing.sign(ear, KEY, NOW)
    for link in range(4):
        peer.received(link)
        peer.mavlink.links[link].send_fields(mavlink.MAVLINK_MSG_ID_PING, 1, 2, 0, 0)
        peer.mavlink.links[link].flush()
        (message,) = ear.parse_buffer(b"".join(peer.mavlink.links[link].outbox))
        assert message.get_signed() and message.get_link_id() == link


def test_unsigned_wrongly_signed_and_repeated_messages_are_dropped_on_all_links() -> None:
    peer = signing_peer()
    assert acked(peer) and acked(peer, ONBOARD)
    stamp = peer.encoder.signing.timestamp
    link = peer.mavlink.links[GCS]
    received, errors = link.messages_received, link.parse_errors
    peer.received(GCS)  # the acknowledgement of what was asked on the other link
    repeated = bytes(command_long(401).pack(peer.encoder))
    assert names(peer.send_bytes(repeated)) == ["COMMAND_ACK"]
    peer.received(ONBOARD)
    assert peer.send_bytes(repeated) == [] and peer.send_bytes(repeated, ONBOARD) == []
    signing.sign(peer.encoder, OTHER_KEY, stamp + 10)
    assert not acked(peer)
    signing.sign(peer.encoder, signing.NO_KEY, 0)
    assert not acked(peer) and not acked(peer, ONBOARD)
    assert (link.messages_received, link.parse_errors) == (received + 1, errors + 3)


def test_a_stream_may_not_go_back_nor_a_new_one_be_a_minute_old() -> None:
    peer = signing_peer()
    assert acked(peer)
    peer.encoder.signing.timestamp = NOW
    assert not acked(peer)
    for link_id, lag, believed in ((1, 6_000_000 + 100, False), (2, 5_900_000, True)):
        peer.encoder.signing.link_id, peer.encoder.signing.timestamp = link_id, NOW - lag
        assert acked(peer) == believed


def test_sixteen_streams_are_believed_and_no_more() -> None:
    peer = signing_peer()
    believed = []
    for link_id in range(20):
        peer.encoder.signing.link_id = link_id
        believed.append(acked(peer))
    assert believed == [True] * 16 + [False] * 4


@pytest.mark.parametrize(
    ("message", "passes"),
    [
        (HEARTBEAT, True),
        (mavlink.MAVLink_radio_status_message(1, 1, 50, 0, 0, 0, 0), True),
        (mavlink.MAVLink_adsb_vehicle_message(1, 0, 0, 0, 0, 0, 0, 0, b"", 0, 0, 0, 0), True),
        (mavlink.MAVLink_collision_message(0, 1, 0, 0, 0.0, 0.0, 0.0), True),
        (mavlink.MAVLink_ping_message(1, 1, 0, 0), False),
        (mavlink.MAVLink_named_value_float_message(1, b"X", 1.0), False),
    ],
    ids=lambda value: value.get_type() if isinstance(value, mavlink.MAVLink_message) else "",
)
def test_four_messages_are_taken_and_passed_on_unsigned(message: Any, passes: bool) -> None:
    peer = signing_peer()
    peer.send(HEARTBEAT, ONBOARD)
    peer.received(ONBOARD)
    signing.sign(peer.encoder, signing.NO_KEY, 0)
    data = bytes(message.pack(peer.encoder))
    peer.send_bytes(data)
    assert peer.mavlink.links[ONBOARD].outbox == ([data] if passes else [])


def test_a_signed_message_is_passed_on_with_its_own_signature_and_setup_signing_never() -> None:
    peer = signing_peer()
    peer.send(HEARTBEAT, ONBOARD)
    peer.received(ONBOARD)
    data = bytes(mavlink.MAVLink_ping_message(1, 1, 0, 0).pack(peer.encoder))
    peer.send_bytes(data)
    assert peer.mavlink.links[ONBOARD].outbox == [data]
    peer.received(ONBOARD)
    peer.send(setup(OTHER_KEY, target=(0, 0)))
    assert "SETUP_SIGNING" not in names(peer.received(ONBOARD))


def test_a_key_is_changed_and_removed_with_the_signature_of_the_old_one() -> None:
    peer = signing_peer()
    unsigned: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    for key in (OTHER_KEY, signing.NO_KEY):
        assert peer.send_bytes(bytes(setup(key, 0).pack(unsigned))) == []
    assert acked(peer) and texts(peer) == ["MAVLink signing key accepted"]
    peer.send(setup(OTHER_KEY))
    assert not acked(peer)
    signing.sign(peer.encoder, OTHER_KEY, peer.encoder.signing.timestamp)
    assert acked(peer)
    peer.send(setup(signing.NO_KEY, 0))
    signing.sign(peer.encoder, signing.NO_KEY, 0)
    (ack,) = peer.send(command_long(401))
    assert ack.get_header().incompat_flags == 0
    assert texts(peer)[1:] == ["MAVLink signing key accepted", "MAVLink signing disabled"]


def test_a_key_is_taken_whoever_it_is_for() -> None:
    """Mavlink::handle_message: nobody looks at the target."""
    peer = Peer()
    peer.send(setup(KEY, target=(2, 1)))
    assert texts(peer) == ["MAVLink signing key accepted"]


def test_no_key_is_changed_while_armed() -> None:
    peer = Peer()
    peer.topics.actuator_armed = ActuatorArmed(armed=True)
    peer.send(setup(KEY))
    assert texts(peer) == ["MAVLink signing: rejected while armed"]
    assert [int(text.severity) for text in peer.texts.recent] == [2]
    assert acked(peer)


def test_a_key_outlives_a_restart_with_its_first_time_and_its_removal_too(tmp_path: Path) -> None:
    """MavlinkSignControl::write_key_and_timestamp: only as the key is set, so that a restart believes old messages."""
    peer = signing_peer(tmp_path)
    repeated = bytes(command_long(401).pack(peer.encoder))
    peer.encoder.signing.timestamp = NOW + 60_000_000
    assert acked(peer)
    path = tmp_path / KEY_FILE
    assert (path.stat().st_mode & 0o777, path.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    assert path.read_bytes() == KEY + NOW.to_bytes(8, "little")
    peer.run(60.1)
    assert SigningKeyFile(tmp_path).load() == (KEY, NOW)

    again = Peer(root=tmp_path)
    assert again.send_bytes(repeated) != []
    assert not acked(again)
    signing.sign(again.encoder, KEY, peer.encoder.signing.timestamp)
    assert acked(again)
    again.send(setup(signing.NO_KEY, 0))
    assert path.read_bytes() == bytes(40)
    assert acked(Peer(root=tmp_path))


@pytest.mark.parametrize("data", [None, b"", bytes(39), bytes(40), b"\1" * 31, b"\1" * 32, b"\1" * 39])
def test_without_a_whole_key_in_its_file_nothing_is_signed(tmp_path: Path, data: bytes | None) -> None:
    if data is not None:
        (tmp_path / "mavlink").mkdir()
        (tmp_path / KEY_FILE).write_bytes(data)
    assert SigningKeyFile(tmp_path).load() == NO_KEY
    assert acked(Peer(root=tmp_path))


def test_a_whole_key_is_read_with_its_time(tmp_path: Path) -> None:
    (tmp_path / "mavlink").mkdir()
    (tmp_path / KEY_FILE).write_bytes(b"\1" * 32 + b"\2" + bytes(7))
    assert SigningKeyFile(tmp_path).load() == (b"\1" * 32, 2)


def test_a_folder_that_can_not_be_written_keeps_the_key_until_the_end(tmp_path: Path) -> None:
    (tmp_path / "mavlink").write_text("in the way")
    peer = signing_peer(tmp_path)
    assert acked(peer)
    assert SigningKeyFile(tmp_path).load() == NO_KEY


def test_the_same_key_again_turns_the_time_back_to_what_it_is_given_with() -> None:
    """MavlinkSignControl::check_for_signing."""
    peer = signing_peer()
    peer.encoder.signing.timestamp = NOW + 500
    peer.send(HEARTBEAT)
    assert peer.mavlink.links[GCS].signing.timestamp >= NOW + 500
    peer.send(setup(KEY, NOW))
    assert NOW <= peer.mavlink.links[GCS].signing.timestamp < NOW + 100
    assert SigningKey(KEY).enabled and not NO_KEY.enabled


# --- the client half ---------------------------------------------------------------------------------------


def test_a_ground_station_sets_a_key_and_is_told() -> None:
    peer, client = Peer(), signing.Signing(1, 1, KEY, NOW)
    peer.topics.vehicle_status = peer.topics.vehicle_status._replace(gcs_connection_lost=False)
    peer.send(HEARTBEAT)
    heard = [message for sent in client.on_time(0) for message in peer.send(sent)]
    for message in heard + only(peer.run(0.1), "STATUSTEXT"):
        client.on_message(0, message)
    assert (client.done, client.accepted, client.text) == (True, True, "MAVLink signing key accepted")
    assert client.on_time(9_000_000) == []


def test_a_ground_station_hears_why_not_or_that_there_is_no_answer() -> None:
    client = signing.Signing(1, 1, signing.NO_KEY, NOW)
    sent = [len(client.on_time(second * 1_000_000)) for second in range(7)]
    assert sent == [1, 1, 1, 1, 1, 0, 0]
    assert client.accepted is False and client.text.startswith("no answer")
    refused = signing.Signing(1, 1, KEY, NOW)
    text = mavlink.MAVLink_statustext_message(2, b"MAVLink signing: rejected while armed", 0, 0)
    peer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    (heard,) = mavlink.MAVLink(None).parse_buffer(text.pack(peer)) or []
    refused.on_message(0, heard)
    assert refused.accepted is False and refused.text == "MAVLink signing: rejected while armed"
    with pytest.raises(ValueError, match="3 bytes; allowed: 32"):
        signing.Signing(1, 1, b"abc", NOW)
