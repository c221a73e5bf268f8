"""Plans over MAVLink: what is sent, what comes back, as measured on PX4 v1.18."""

import struct
from typing import Any

import pytest

from sitl_emu.autopilot.topics import (
    MissionResult,
)
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, names, only
from tests.unit.plan_messages import HOME_X, MISSION_FRAME, RELATIVE, RELATIVE_INT, count, item, upload


def test_mission_upload_and_download() -> None:
    peer = Peer()
    assert upload(peer, item(0, 22, current=1), item(1), item(2)) == (0, 0)
    assert [each.command for each in peer.dataman.mission.items] == [22, 16, 16]
    announced = peer.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert [(reply.count, reply.mission_type) for reply in announced] == [(3, 0)]
    for seq in range(3):
        reply = peer.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))[0]
        assert (reply.seq, reply.frame, reply.x, reply.current) == (seq, RELATIVE_INT, HOME_X, int(seq == 0))
    peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0))
    assert peer.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))[0].type == 0
    assert peer.dataman.mission.items == ()


def test_an_upload_is_asked_for_again_and_given_up() -> None:
    peer = Peer()
    peer.send(count(2))
    assert names(peer.send(item(0))) == ["MISSION_REQUEST_INT"]
    repeated = only(peer.run(4.9), "MISSION_REQUEST_INT")
    assert {reply.seq for reply in repeated} == {1}
    assert len(repeated) == pytest.approx(19, abs=1)
    peer.run(0.3)
    assert only(peer.run(1.0), "MISSION_REQUEST_INT") == []
    assert upload(peer, item(0)) == (0, 0)


def test_items_out_of_order() -> None:
    peer = Peer()
    peer.send(count(3))
    assert peer.send(item(2)) == []
    assert peer.send(item(0))[0].seq == 1
    assert peer.send(item(0)) == []
    busy = peer.send(count(3))
    assert [(reply.type, reply.mission_type) for reply in busy] == [(1, 0)]
    peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, 0))
    assert peer.send(item(1))[0].type == 1
    assert any(text.text.startswith("IGN MISSION_ITEM: No transfer") for text in peer.texts.recent)


def test_a_failed_upload_leaves_the_old_plan() -> None:
    peer = Peer()
    upload(peer, item(0))
    assert upload(peer, item(0, 30)) == (3, 0)
    assert len(peer.dataman.mission.items) == 1


@pytest.mark.parametrize(
    ("sent", "result"),
    [
        (item(0, frame=RELATIVE), 0),
        (item(0, frame=MISSION_FRAME), 3),
        (item(0, frame=7), 2),
        (item(0, param3=3.0), 8),
        (item(0, param4=float("nan"), param3=float("nan")), 0),
        (item(0, 178, MISSION_FRAME), 10),
        (item(0, 178, MISSION_FRAME, x=0, y=0, z=0.0, param2=5.0), 0),
        (item(0, 183), 3),
        (item(0, 5001), 12),
        (item(0, 5100), 1),
        (item(0, 189, MISSION_FRAME), 0),
    ],
)
def test_item_rules(sent: Any, result: int) -> None:
    assert upload(Peer(), sent)[0] == result


def test_limits_and_unknown_types() -> None:
    peer = Peer()
    for kind, most in ((0, 10_000), (1, 64), (2, 32)):
        assert names(peer.send(count(most, kind))) == ["MISSION_REQUEST_INT"]
        peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, kind))
        assert [reply.type for reply in peer.send(count(most + 1, kind))] == [4]
    assert [(reply.type, reply.mission_type) for reply in peer.send(count(1, 3))] == [(4, 3)]
    assert [(reply.type, reply.mission_type) for reply in peer.send(count(0))] == [(0, 0)]


def test_fence_and_rally() -> None:
    peer = Peer()
    corners = [item(seq, 5001, 5, param1=4.0, z=0.0, mission_type=1) for seq in range(4)]
    assert upload(peer, *corners, kind=1) == (0, 1)
    assert (peer.dataman.fence.items[0].frame, peer.dataman.fence.items[0].autocontinue) == (5, 0)
    assert upload(peer, item(0, 5100, RELATIVE, mission_type=2), kind=2) == (0, 2)
    assert len(peer.dataman.rally.items) == 1
    assert upload(peer, item(0, 5001, 5, param1=2.0, z=0.0, mission_type=1), kind=1)[0] == 1
    assert len(peer.dataman.fence.items) == 4


def test_plan_ids_are_on_the_wire() -> None:
    peer = Peer()
    peer.send(count(1))
    peer.mavlink.on_datagram(0, GCS, bytes(item(0).pack(peer.encoder)))
    frame = next(data for data in peer.mavlink.links[GCS].outbox)
    assert struct.unpack_from("<I", frame, 14) == (peer.dataman.mission.opaque_id,)


def test_plan_ids_are_px4s() -> None:
    peer = Peer()
    upload(peer, item(0, 22), item(1, x=HOME_X + 300), item(2, x=HOME_X + 600))
    assert peer.dataman.mission.opaque_id == 1161622139


def test_mission_current_keeps_its_rate_after_changes() -> None:
    peer = Peer()
    for _ in range(5):
        upload(peer, item(0), item(1))
        peer.run(0.1)
    assert len(only(peer.run(3.0), "MISSION_CURRENT")) == pytest.approx(3, abs=1)


def test_set_current_and_reached() -> None:
    peer = Peer()
    upload(peer, item(0), item(1), item(2))
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    assert only(peer.run(1.1), "MISSION_CURRENT")[-1].seq == 2
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    assert peer.texts.recent[-1].text == "WPM: WP CURR CMD: Not in list\t"
    peer.topics.mission_result = MissionResult(seq_reached=1, seq_reached_timestamp=5)
    assert [reply.seq for reply in only(peer.run(0.1), "MISSION_ITEM_REACHED")] == [1]
    assert [reply.seq for reply in only(peer.run(20.0), "MISSION_ITEM_REACHED")] == [1] * 10


def test_only_one_upload_at_a_time() -> None:
    peer = Peer()
    peer.send(count(2), GCS)
    assert [reply.type for reply in peer.send(count(2), ONBOARD)] == [1]
