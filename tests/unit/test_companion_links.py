"""What a companion does with its two links: codec, routing, sharing, yielding."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, PEER_LINK
from sitl_emu.missions.companion.onboard import Onboard
from sitl_emu.missions.companion.peer_link import PeerLink
from sitl_emu.missions.companion.router import is_for_companion
from sitl_emu.missions.companion.wire import Wire
from sitl_emu.missions.companion.yielding import SETTLE_US, Yielding
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


ADDRESSED = [
    (count(ME, 191), True),
    (count(ME, 0), True),
    (count(ME, 1), False),
    (count(9, 1), False),
    (count(9, 191), False),
    (mavlink.MAVLink_command_long_message(ME, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), False),
    (mavlink.MAVLink_command_long_message(ME, 191, 400, 0, 1, 0, 0, 0, 0, 0, 0), True),
    (mavlink.MAVLink_mission_ack_message(255, 190, 0, 0), False),
    (mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), True),
]


@pytest.mark.parametrize(
    ("msg", "mine"), ADDRESSED, ids=[f"{msg.get_type()}-{i}" for i, (msg, _) in enumerate(ADDRESSED)]
)
def test_a_companion_hears_what_is_addressed_to_it_or_to_all(msg: Any, mine: bool) -> None:
    assert is_for_companion(msg, ME) is mine


@pytest.mark.parametrize(
    "asked",
    [
        count(ME, 1),
        mavlink.MAVLink_mission_clear_all_message(ME, 1, 0),
        mavlink.MAVLink_command_long_message(ME, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_set_mode_message(ME, 1, 0),
    ],
    ids=lambda msg: str(msg.get_type()),
)
def test_nothing_that_a_peer_sends_reaches_our_autopilot(asked: Any) -> None:
    onboard = Onboard()
    onboard.on_message(0, AUTOPILOT_LINK, on_the_wire(mavlink.MAVLink_heartbeat_message(10, 12, 0, 0, 4, 3), ME, 1))
    _, out = onboard.on_message(0, PEER_LINK, on_the_wire(asked, PEER, 191))
    assert out == []


def test_what_the_autopilot_says_to_others_stays_on_its_side() -> None:
    onboard = Onboard()
    onboard.on_message(0, AUTOPILOT_LINK, on_the_wire(mavlink.MAVLink_heartbeat_message(10, 12, 0, 0, 4, 3), ME, 1))
    answer = on_the_wire(mavlink.MAVLink_mission_request_int_message(PEER, 191, 0, 0), ME, 1)
    assert onboard.on_message(0, AUTOPILOT_LINK, answer) == (False, [])


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


def test_a_peers_place_is_what_its_autopilot_said() -> None:
    link = PeerLink()
    said = mavlink.MAVLink_global_position_int_message(0, 404_712_345, -869_912_345, 215_250, 0, 0, 0, 0, 0)
    link.heard(0, on_the_wire(said, PEER, 1))
    place = link.peers[PEER].place
    assert place is not None
    assert place == pytest.approx((40.4712345, -86.9912345, 215.25), abs=1e-9)
    assert link.peers[PEER].role == 0


def test_a_companions_own_message_gives_its_vehicle_no_place_and_no_type() -> None:
    link = PeerLink()
    said = mavlink.MAVLink_global_position_int_message(0, 404_712_345, -869_912_345, 215_250, 0, 0, 0, 0, 0)
    link.heard(0, on_the_wire(said, PEER, 191))
    link.heard(0, on_the_wire(mavlink.MAVLink_heartbeat_message(18, 8, 0, 2, 4, 3), PEER, 191))
    peer = link.peers[PEER]
    assert (peer.place, peer.mav_type, peer.role) == (None, 0, 2)


def test_peers_are_known_by_the_role_that_their_companions_tell() -> None:
    link = PeerLink()
    for system, role in ((7, 2), (3, 1), (5, 2)):
        link.heard(0, on_the_wire(mavlink.MAVLink_heartbeat_message(18, 8, 0, role, 4, 3), system, 191))
    assert [peer.system for peer in link.with_role(2)] == [5, 7]
    link.forget(5)
    assert [peer.system for peer in link.with_role(2)] == [7]


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


def test_a_pilot_who_ends_a_failsafe_is_told_apart_from_it() -> None:
    watch = Yielding()
    watch.expect({"mission"})
    assert not watch.on_mode(0, "return", failsafe=True)
    assert watch.on_mode(SETTLE_US, "return", failsafe=True)
    assert (watch.yielded_to, watch.to_failsafe) == ("return", True)
    assert not watch.on_mode(SETTLE_US + 1, "land", failsafe=True)
    assert watch.on_mode(SETTLE_US + 2, "position", failsafe=False)
    assert (watch.yielded_to, watch.to_failsafe) == ("position", False)
    assert watch.on_mode(SETTLE_US + 3, "return", failsafe=True)
    assert watch.on_mode(SETTLE_US + 4, "mission", failsafe=False)
    assert watch.yielded_to is None


def test_a_mission_that_seals_what_it_says_tells_peers_nothing_in_the_clear() -> None:
    onboard, said = Onboard(is_open=False), list[str]()
    heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3)
    place = mavlink.MAVLink_global_position_int_message(1000, 474000000, 85000000, 0, 0, 0, 0, 0, 0)
    for now_us in (0, 2_000_000):
        out = [
            each
            for msg in (heartbeat, place)
            for each in onboard.on_message(now_us, AUTOPILOT_LINK, on_the_wire(msg, ME, 1))[1]
        ]
        said += [link for link, _ in (*out, *onboard.on_time(now_us))]
    assert set(said) == {AUTOPILOT_LINK}
