"""What a companion does with its two links: codec, routing, sharing, yielding."""

from typing import Any

import pytest

from missions.companion.companion import AUTOPILOT_LINK, PEER_LINK
from missions.companion.onboard import Onboard
from missions.companion.peer_link import PeerLink
from missions.companion.router import Route, route
from missions.companion.wire import Wire
from missions.companion.yielding import SETTLE_US, Yielding
from sitl_emu.core import dialect as mavlink
from tests.unit.companion_px4 import on_the_wire

US = 1_000_000
ME, PEER = 2, 1


def count(target_system: int, target_component: int) -> Any:
    return mavlink.MAVLink_mission_count_message(target_system, target_component, 1, 0)


def test_own_messages_bear_our_address_and_count_up() -> None:
    wire, ear = Wire(7), Wire()
    frames = [wire.encode(count(1, 1)) for _ in range(3)]
    heard = [msg for frame in frames for msg in ear.decode(frame)]
    assert [(m.get_srcSystem(), m.get_srcComponent(), m.get_seq()) for m in heard] == [
        (7, 191, 0),
        (7, 191, 1),
        (7, 191, 2),
    ]


def test_a_message_is_passed_on_byte_by_byte_with_its_sender() -> None:
    sender, router = Wire(1), Wire(2)
    frame = sender.encode(count(2, 1))
    assert router.encode(router.decode(frame)[0]) == frame
    assert Wire(2).decode(router.encode(count(1, 1)))[0].get_seq() == 0  # it did not use up a number of ours


def test_several_frames_garbage_and_damage_in_a_datagram() -> None:
    wire = Wire(1)
    good, bad = wire.encode(count(2, 1)), bytearray(wire.encode(count(2, 1)))
    bad[12] ^= 0xFF
    ear = Wire()
    heard = ear.decode(b"\x00\x01" + good + bytes(bad) + good)
    assert [msg.get_type() for msg in heard] == ["MISSION_COUNT"] * 2
    assert ear.bad_frames == 1
    assert ear.decode(b"\xfd") == []
    assert ear.decode(good[:8]) == []


def test_streams_that_nobody_reads_are_not_decoded() -> None:
    wire = Wire(1)
    frame = wire.encode(mavlink.MAVLink_vfr_hud_message(0, 0, 0, 0, 0, 0))
    assert Wire().decode(frame) == []
    assert len(Wire(skip=()).decode(frame)) == 1


ROUTES = [
    (PEER_LINK, count(ME, 1), Route(False, AUTOPILOT_LINK)),
    (PEER_LINK, count(ME, 191), Route(True, None)),
    (PEER_LINK, count(9, 1), Route(False, None)),
    (PEER_LINK, mavlink.MAVLink_command_long_message(ME, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), Route(False, None)),
    (PEER_LINK, mavlink.MAVLink_set_mode_message(ME, 1, 0), Route(True, None)),
    (PEER_LINK, mavlink.MAVLink_command_long_message(ME, 191, 400, 0, 1, 0, 0, 0, 0, 0, 0), Route(True, None)),
    (PEER_LINK, mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), Route(True, None)),
    (AUTOPILOT_LINK, mavlink.MAVLink_mission_ack_message(PEER, 191, 0, 0), Route(False, PEER_LINK)),
    (AUTOPILOT_LINK, mavlink.MAVLink_mission_ack_message(255, 190, 0, 0), Route(False, None)),
    (AUTOPILOT_LINK, mavlink.MAVLink_mission_ack_message(ME, 191, 0, 0), Route(True, None)),
    (AUTOPILOT_LINK, mavlink.MAVLink_heartbeat_message(13, 12, 0, 0, 4, 3), Route(True, None)),
]


@pytest.mark.parametrize(
    ("link", "msg", "way"), ROUTES, ids=[f"{r[0]}-{r[1].get_type()}-{i}" for i, r in enumerate(ROUTES)]
)
def test_messages_go_where_their_target_says_and_peers_get_missions_only(link: str, msg: Any, way: Route) -> None:
    assert route(link, msg, ME, {PEER}) == way


def test_the_answers_of_the_autopilot_go_back_to_the_peer_that_asked() -> None:
    onboard = Onboard()
    onboard.on_message(0, AUTOPILOT_LINK, on_the_wire(mavlink.MAVLink_heartbeat_message(10, 12, 0, 0, 4, 3), ME, 1))
    asked = on_the_wire(count(ME, 1), PEER, 191)
    assert onboard.on_message(0, PEER_LINK, asked) == (False, [(AUTOPILOT_LINK, asked)])
    answer = on_the_wire(mavlink.MAVLink_mission_request_int_message(PEER, 191, 0, 0), ME, 1)
    assert onboard.on_message(0, AUTOPILOT_LINK, answer) == (False, [(PEER_LINK, answer)])


def test_nothing_is_sent_before_the_autopilot_is_known() -> None:
    onboard = Onboard()
    assert onboard.on_time(0) == []
    assert onboard.on_message(0, PEER_LINK, on_the_wire(count(ME, 1), PEER, 191)) == (False, [])
    onboard.on_message(0, AUTOPILOT_LINK, on_the_wire(mavlink.MAVLink_heartbeat_message(10, 12, 0, 0, 4, 3), ME, 1))
    assert [(link, msg.get_type()) for link, msg in onboard.on_time(0)] == [
        (AUTOPILOT_LINK, "HEARTBEAT"),
        (PEER_LINK, "HEARTBEAT"),
    ]


def test_position_is_shared_once_a_second_whatever_the_stream() -> None:
    link = PeerLink()
    msg = on_the_wire(mavlink.MAVLink_global_position_int_message(0, 1, 2, 3, 4, 0, 0, 0, 0), ME, 1)
    assert sum(len(link.share(t, msg)) for t in range(0, 10 * US, 20_000)) == 10


def test_a_silent_peer_is_lost_only_while_it_is_needed() -> None:
    link = PeerLink()
    link.heard(0, on_the_wire(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), PEER, 191))
    assert not link.lost(100 * US, PEER, since_us=90 * US)
    assert link.lost(111 * US, PEER, since_us=90 * US)
    assert link.lost(111 * US, 9, since_us=90 * US)


def test_a_strange_mode_yields_and_the_commanded_one_resumes() -> None:
    watch = Yielding()
    assert not watch.on_mode(0, "position")
    watch.expect({"mission"})
    assert not watch.on_mode(0, "hold")
    assert not watch.on_mode(SETTLE_US - 1, "hold")
    assert not watch.on_mode(SETTLE_US, "mission")
    assert not watch.on_mode(SETTLE_US + 1, "hold")
    assert watch.on_mode(2 * SETTLE_US + 1, "hold")
    assert watch.yielded_to == "hold"
    assert not watch.on_mode(3 * SETTLE_US, "position")
    assert watch.yielded_to == "position"
    assert watch.on_mode(3 * SETTLE_US, "mission")
    assert watch.yielded_to is None
