"""Texts and events over MAVLink, as measured on PX4 v1.18."""

from typing import Any

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Text
from sitl_emu.autopilot.mavlink.services.statustext import LinkTexts
from sitl_emu.autopilot.topics import VehicleStatus
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GIMBAL, ONBOARD, Peer, only

HEARTBEAT_OF_GCS = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)


def test_texts_are_cut_into_chunks() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    peer.texts.say(Severity.INFO, "short\t")
    peer.texts.say(Severity.CRITICAL, "x" * 50 + "yz")
    peer.texts.say(Severity.INFO, "y" * 50)
    chunks = only(peer.run(0.11), "STATUSTEXT")
    assert [(chunk.id, chunk.chunk_seq, len(chunk.text), chunk.severity) for chunk in chunks] == [
        (0, 0, 6, 6),
        (1, 0, 50, 2),
        (1, 1, 2, 2),
        (2, 0, 50, 6),
    ]
    assert only(peer.received(GIMBAL), "STATUSTEXT") == []
    assert only(peer.run(0.1), "STATUSTEXT") == []


def test_texts_are_paced_and_a_link_loses_all_but_the_newest_eight() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    for number in range(12):
        peer.texts.say(Severity.INFO, f"text {number}")
    assert [text.text for text in only(peer.run(0.049), "STATUSTEXT")] == ["text 4"]
    rest = [text.text for text in only(peer.run(1.0), "STATUSTEXT")]
    assert rest == [f"text {number}" for number in range(5, 12)]


def test_texts_are_for_ground_stations_that_are_there() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    peer.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3), ONBOARD)
    peer.texts.say(Severity.INFO, "heard")
    assert [text.text for text in only(peer.run(0.01), "STATUSTEXT")] == ["heard"]
    assert only(peer.received(ONBOARD), "STATUSTEXT") == []
    peer.run(2.6)
    peer.texts.say(Severity.INFO, "stale when somebody is back")
    peer.run(4.0)
    peer.texts.say(Severity.INFO, "waits")
    assert only(peer.run(1.5), "STATUSTEXT") == []
    peer.send(HEARTBEAT_OF_GCS)
    assert [text.text for text in only(peer.run(1.0), "STATUSTEXT")] == ["waits"]


def test_a_ground_station_on_the_gimbals_link_is_told_texts() -> None:
    """Mavlink::task_main configures STATUSTEXT on every link; each counts its texts for itself."""
    peer = Peer()
    peer.send(HEARTBEAT_OF_GCS)
    peer.texts.say(Severity.INFO, "one")
    peer.run(0.1)
    peer.send(HEARTBEAT_OF_GCS, GIMBAL)
    peer.texts.say(Severity.INFO, "two")
    heard = [(text.text, text.id) for text in only(peer.run(0.2, GIMBAL), "STATUSTEXT")]
    assert heard == [("one", 0), ("two", 1)]


def test_the_number_of_a_text_wraps_to_0() -> None:
    peer = Peer()
    texts = LinkTexts(peer.mavlink.links[0], 0)
    for number in range((1 << 16) - 1):
        texts.send(0, Text(number, Severity.INFO, "", ""))
    for number in range(2):
        texts.send(0, Text(number, Severity.INFO, "said", ""))
    peer.mavlink.links[0].flush()
    assert [text.id for text in only(peer.received(), "STATUSTEXT")] == [65535, 0]


@pytest.mark.parametrize(("interval_s", "silent_s", "heard"), [(1.0, 2.4, True), (1.0, 2.6, False), (8.0, 19.0, True)])
def test_a_ground_station_whose_clock_is_slower_is_there_longer(
    interval_s: float, silent_s: float, heard: bool
) -> None:
    """2.5 s as PX4 has it, but two and a half intervals of who sends one a second beside a faster simulation."""
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    for _ in range(3):
        peer.send(HEARTBEAT_OF_GCS)
        peer.run(interval_s)
    peer.send(HEARTBEAT_OF_GCS)
    peer.run(silent_s)
    peer.texts.say(Severity.INFO, "heard")
    assert bool(only(peer.run(0.01), "STATUSTEXT")) is heard


def test_what_components_say_goes_into_the_log_and_to_nobody_else() -> None:
    """Alone, in chunks, with a chunk lost, and never ended (MavlinkStatustextHandler)."""
    companion = Peer(system=1, component=191)
    companion.send(HEARTBEAT_OF_GCS)
    for severity, text, number, chunk in (
        (4, b"alone", 0, 0),
        (2, b"a" * 50, 7, 0),
        (2, b"b" * 3, 7, 1),
        (6, b"c" * 50, 8, 0),
        (6, b"d", 8, 2),
        (6, b"e" * 50, 9, 0),
        (6, b"f" * 50, 0, 0),
    ):
        companion.send(mavlink.MAVLink_statustext_message(severity, text, number, chunk), ONBOARD)
    assert [(each.severity, each.line) for each in companion.texts.lines] == [
        (4, "alone"),
        (2, "a" * 50 + "bbb"),
        (6, "c" * 50 + "[ missing ... ]d"),
        (6, "e" * 50 + "[ missing ... ]"),
        (6, "f" * 49),
    ]
    assert companion.texts.count == 0
    other = Peer(system=2, component=191)
    other.send(mavlink.MAVLink_statustext_message(4, b"not ours"))
    assert not other.texts.lines


def request_event(first: int, last: int) -> Any:
    return mavlink.MAVLink_request_event_message(
        target_system=1, target_component=1, first_sequence=first, last_sequence=last
    )
