"""The mission protocol where partners, links and transfers get into each other's way, as PX4's manager has it."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.land_detector.flight_time import FlightTime
from sitl_emu.autopilot.mavlink.services.mission_items import parse
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import MissionResult, VehicleStatus
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, names, only
from tests.unit.plan_messages import HOME_X, HOME_Y, MISSION_FRAME, RELATIVE_INT, count, item, upload

MULTICOPTER, ROVER = VehicleKind
ACCEPTED, ERROR, UNSUPPORTED, CANCELLED = 0, 1, 3, 15
NOT_GIVEN = 0x7FFFFFFF


def request_list(kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_request_list_message(1, 1, kind)


def request(seq: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind)


def ack(result: int = ACCEPTED, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_ack_message(1, 1, result, kind)


def clear(kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_clear_all_message(1, 1, kind)


def said(peer: Peer) -> str:
    return peer.texts.recent[-1].text


def answers(replies: list[Any]) -> list[tuple[int, int]]:
    return [(reply.type, reply.mission_type) for reply in only(replies, "MISSION_ACK")]


def with_three_items() -> Peer:
    peer = Peer()
    assert upload(peer, item(0, 22), item(1), item(2)) == (ACCEPTED, 0)
    return peer


def test_during_a_download_nothing_else_is_begun() -> None:
    peer = with_three_items()
    peer.send(request_list())
    assert answers(peer.send(count(2))) == [(ERROR, 0)]
    assert said(peer) == "WPM: IGN MISSION_COUNT: Busy\t"
    assert peer.send(clear()) == []
    assert said(peer) == "WPM: IGN CLEAR CMD: Busy\t"
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 1))
    assert said(peer) == "WPM: IGN WP CURR CMD: Busy\t"
    assert answers(peer.send(item(0))) == [(ERROR, 0)]
    assert said(peer) == "IGN MISSION_ITEM: Busy\t"
    assert only(peer.send(request(0)), "MISSION_ITEM_INT")[0].seq == 0


def test_during_an_upload_no_download_is_begun() -> None:
    peer = with_three_items()
    peer.send(count(2))
    assert peer.send(request_list()) == []
    assert said(peer) == "Mission download request ignored, already active\t"
    assert peer.send(request(0)) == []
    assert said(peer) == "WPM: REJ. CMD: Busy\t"


def test_a_download_that_nobody_ended_may_begin_again_when_all_was_sent() -> None:
    peer = with_three_items()
    peer.send(request_list())
    for seq in range(3):
        peer.send(request(seq))
    assert only(peer.send(request_list(1)), "MISSION_COUNT")[0].mission_type == 1


def test_a_download_is_given_up_after_5_s_of_silence() -> None:
    peer = with_three_items()
    peer.send(request_list())
    peer.run(5.1)
    assert said(peer) == "Mission sync timeout\t"
    assert names(peer.send(count(1))) == ["MISSION_REQUEST_INT"]


def test_the_count_is_told_again_until_the_first_item_is_asked_for() -> None:
    """mavlink_mission.cpp: every 250 ms, as the message may be lost; from then on it is the other side that asks."""
    peer = with_three_items()
    assert names(peer.send(request_list())) == ["MISSION_COUNT"]
    counts = only(peer.run(1.1), "MISSION_COUNT")
    assert [(each.count, each.target_system) for each in counts] == [(3, 255)] * 4
    assert names(peer.send(request(0))) == ["MISSION_ITEM_INT"]
    assert only(peer.run(1.0), "MISSION_COUNT") == []


def test_refused_uploads_do_not_keep_a_download_alive() -> None:
    peer = with_three_items()
    peer.send(request_list())
    for _ in range(5):
        assert answers(peer.send(count(1))) == [(ERROR, 0)]
        peer.run(1.02)
    assert names(peer.send(count(1))) == ["MISSION_REQUEST_INT"]


def test_an_empty_plan_is_to_be_acknowledged_too() -> None:
    peer = Peer()
    assert only(peer.send(request_list()), "MISSION_COUNT")[0].count == 0
    assert answers(peer.send(count(1))) == [(ERROR, 0)]
    peer.send(ack())
    assert names(peer.send(count(1))) == ["MISSION_REQUEST_INT"]


def test_an_unknown_kind_of_plan_is_empty() -> None:
    reply = only(with_three_items().send(request_list(7)), "MISSION_COUNT")[0]
    assert (reply.count, reply.mission_type) == (0, 7)


def test_another_partner_is_told_that_he_is_none() -> None:
    peer = with_three_items()
    peer.send(request_list())
    peer.encoder.srcSystem = 254
    assert peer.send(request(0)) == []
    assert said(peer) == "WPM: REJ. CMD: partner id mismatch\t"
    assert peer.send(ack()) == []
    assert said(peer) == "REJ. WP CMD: partner id mismatch\t"
    assert peer.send(item(0)) == []
    assert said(peer) == "REJ. MIS ITEM: partner id mismatch\t"


def test_an_item_of_another_kind_is_an_error_that_ends_nothing() -> None:
    peer = Peer()
    peer.send(count(2))
    assert answers(peer.send(item(0, mission_type=1))) == [(ERROR, 0)]
    assert only(peer.send(item(0)), "MISSION_REQUEST_INT")[0].seq == 1


def test_uploads_on_two_links_do_not_mix() -> None:
    peer = Peer()
    peer.send(count(2), GCS)
    assert answers(peer.send(count(3), ONBOARD)) == [(ERROR, 0)]
    peer.send(ack(CANCELLED), GCS)
    assert names(peer.send(count(3), ONBOARD)) == ["MISSION_REQUEST_INT"]


def test_what_one_link_uploads_the_other_downloads() -> None:
    peer = with_three_items()
    assert only(peer.send(request_list(), ONBOARD), "MISSION_COUNT")[0].count == 3
    assert only(peer.send(request(0), ONBOARD), "MISSION_ITEM_INT")[0].command == 22


def test_a_broadcast_is_not_for_us() -> None:
    assert Peer().send(mavlink.MAVLink_mission_request_list_message(0, 0, 0)) == []


def test_the_same_plan_again_changes_nothing() -> None:
    peer = with_three_items()
    before = peer.dataman.mission
    peer.dataman.current_seq = 2
    assert upload(peer, item(0, 22), item(1), item(2)) == (ACCEPTED, 0)
    assert peer.dataman.mission is before
    assert peer.dataman.current_seq == 2


@pytest.mark.parametrize(("marked", "current"), [(None, 2), (1, 1), (0, 0)])
def test_a_new_plan_begins_at_the_marked_item_or_goes_on(marked: int | None, current: int) -> None:
    peer = with_three_items()
    peer.dataman.current_seq = 2
    upload(peer, *(item(seq, z=20.0, current=int(seq == marked)) for seq in range(3)))
    assert peer.dataman.current_seq == current


def test_a_shorter_plan_goes_on_at_its_last_item() -> None:
    peer = with_three_items()
    peer.dataman.current_seq = 2
    upload(peer, item(0, z=20.0), item(1, z=20.0))
    assert peer.dataman.current_seq == 1


def test_the_current_item_is_marked_in_every_kind_of_plan() -> None:
    peer = with_three_items()
    peer.dataman.told_seq = 1
    upload(peer, *(item(seq, 5100, mission_type=2) for seq in range(2)), kind=2)
    peer.send(request_list(2))
    assert [only(peer.send(request(seq, 2)), "MISSION_ITEM_INT")[0].current for seq in range(2)] == [0, 1]


def test_the_id_of_a_fence_is_that_of_what_was_uploaded() -> None:
    peer = Peer()
    corners = [item(seq, 5001, 5, param1=4.0, z=0.0, mission_type=1) for seq in range(4)]
    upload(peer, *corners, kind=1)
    first = peer.dataman.fence.opaque_id
    peer.send(clear(1))
    assert peer.dataman.fence.opaque_id == 0
    upload(peer, *corners, kind=1)
    assert peer.dataman.fence.opaque_id == first != 0


def test_a_disk_that_is_full_refuses_an_upload(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = with_three_items()
    monkeypatch.setattr(peer.dataman, "store", lambda *_: False)
    assert upload(peer, item(0)) == (ERROR, 0)
    assert said(peer) == "Unable to write on micro SD\t"
    assert len(peer.dataman.mission.items) == 3


def test_a_reached_item_is_told_again_until_a_new_upload_begins() -> None:
    peer = with_three_items()
    peer.topics.mission_result = MissionResult(seq_reached=1)
    assert {each.seq for each in only(peer.run(2.5), "MISSION_ITEM_REACHED")} == {1}
    peer.send(count(3))
    assert only(peer.run(2.5), "MISSION_ITEM_REACHED") == []


@pytest.mark.parametrize(
    ("nav_state", "mode"), [(NavState.AUTO_LOITER, 2), (NavState.AUTO_MISSION, 1), (NavState.AUTO_LAND, 1)]
)
def test_a_mission_counts_as_active_in_these_modes(nav_state: NavState, mode: int) -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(nav_state=nav_state)
    assert only(peer.run(1.1), "MISSION_CURRENT")[0].mission_mode == mode


@pytest.mark.parametrize(
    ("sent", "kind", "result"),
    [
        (item(0, 20, MISSION_FRAME, x=NOT_GIVEN, y=NOT_GIVEN, z=0.0), MULTICOPTER, 0),
        (item(0, 2001, MISSION_FRAME, x=-0x80000000, y=-0x80000000, z=float("nan")), MULTICOPTER, 0),
        (item(0, 20, MISSION_FRAME, x=0, y=0, z=0.0, param1=1.0), MULTICOPTER, 6),
        (item(0, 20, x=0, y=0, z=0.0), MULTICOPTER, 10),
        (item(0, 20, x=NOT_GIVEN, y=NOT_GIVEN, z=0.0), MULTICOPTER, UNSUPPORTED),
        (item(0, 93, MISSION_FRAME, x=42, y=0, z=0.0, param1=10.0), MULTICOPTER, 10),
        (item(0, 93, MISSION_FRAME, x=0, y=0, z=0.0, param1=10.0), MULTICOPTER, 0),
        (item(0, 22, param1=-1.0), MULTICOPTER, 0),
        (item(0, 22, param1=-1.0), ROVER, 6),
        (item(0, 84, param3=45.0), MULTICOPTER, 8),
        (item(0, 85, param1=1.0), MULTICOPTER, 6),
        (item(0, 80, param1=3.0), MULTICOPTER, 0),
        (item(0, 80, param1=1.0), MULTICOPTER, 6),
        (item(0, 80, MISSION_FRAME, param1=3.0), MULTICOPTER, 6),
        (item(0, 80, MISSION_FRAME, param1=float("inf")), MULTICOPTER, 6),
    ],
)
def test_parameters_that_a_command_does_not_use(sent: Any, kind: VehicleKind, result: int) -> None:
    assert parse(sent, 0, kind.traits)[1] == result


def sent_back(sent: Any, kind: int = 0) -> Any:
    """What one item comes back as."""
    peer = Peer()
    assert upload(peer, sent, kind=kind) == (ACCEPTED, kind)
    peer.send(request_list(kind))
    return only(peer.send(request(0, kind)), "MISSION_ITEM_INT")[0]


@pytest.mark.parametrize(
    ("sent", "expected"),
    [
        (item(0, 177, MISSION_FRAME, x=0, y=0, z=0.0, param1=1.7, param2=-1.0), {"param1": 1.0, "param2": 65535.0}),
        (item(0, 177, MISSION_FRAME, x=0, y=0, z=0.0, param1=40000.0), {"param1": -25536.0, "param2": 0.0}),
        (item(0, 20, MISSION_FRAME, x=NOT_GIVEN, y=NOT_GIVEN, z=0.0), {"x": -0x80000000, "y": -0x80000000}),
        (item(0, 179, MISSION_FRAME, param4=7.0), {"x": 473977408, "y": 85455936, "param4": 7.0}),
        (item(0, 21, param2=1.9), {"param2": 1.0}),
        (item(0, 212, x=NOT_GIVEN, y=NOT_GIVEN, z=math.nan, param1=1.0), {"param1": 0.0}),
        (item(0, 19, param2=4.0, param4=90.0), {"param2": 1.0, "param4": 1.0}),
        (item(0, 19, param4=math.nan), {"param4": 0.0}),
        (item(0, 16, autocontinue=2), {"autocontinue": 0}),
        (item(0, 16, autocontinue=3), {"autocontinue": 1}),
    ],
)
def test_what_comes_back_has_gone_through_px4s_types(sent: Any, expected: dict[str, float]) -> None:
    found = sent_back(sent)
    assert {name: getattr(found, name) for name in expected} == expected


@pytest.mark.parametrize(
    ("command", "param1", "result", "kept"),
    [
        (5001, 3.6, ACCEPTED, 4.0),
        (5002, -5.0, ACCEPTED, 65532.0),
        (5001, 2.4, ERROR, None),
        (5001, math.nan, ERROR, None),
        (5003, -5.5, ACCEPTED, -5.5),
    ],
)
def test_counts_of_vertices_are_whole(command: int, param1: float, result: int, kept: float | None) -> None:
    found, error = parse(item(0, command, 5, param1=param1, z=0.0, mission_type=1), 1, VehicleKind.MULTICOPTER.traits)
    assert error == result
    assert (found and found.param1) == kept


def test_after_a_refused_item_the_one_before_is_taken_for_the_last() -> None:
    peer = Peer()
    peer.send(count(2))
    peer.send(item(0))
    assert answers(peer.send(item(1, 5100))) == [(ERROR, 0)]
    assert answers(peer.send(item(0))) == [(ACCEPTED, 0)]


def test_a_download_request_does_not_end_an_upload_that_has_as_many_items_as_the_plan() -> None:
    peer = with_three_items()
    peer.send(count(5))
    for seq in range(3):
        peer.send(item(seq))
    assert only(peer.send(request_list()), "MISSION_COUNT") == []
    peer.send(item(3))
    assert answers(peer.send(item(4)))[0][0] == ACCEPTED


def test_an_item_that_is_gone_meanwhile_ends_the_download() -> None:
    peer = with_three_items()
    peer.send(request_list())
    peer.send(clear(), ONBOARD)
    assert answers(peer.send(request(0))) == [(ERROR, 0)]
    assert said(peer) == "WPM: REJ. CMD: Req. WP was unexpected\t"
    assert peer.texts.events.recent[-1].id == layout("mavlink_mission_wp_unexpected2")[0]


def test_a_jump_that_was_followed_is_sent_to_the_last_partner() -> None:
    peer = Peer()
    upload(peer, item(0), item(1, 177, MISSION_FRAME, x=0, y=0, z=0.0, param1=0.0, param2=3.0))
    peer.topics.mission_result = MissionResult(seq_total=2, item_do_jump_changed=True, item_changed_index=1)
    told = only(peer.run(1.0), "MISSION_ITEM_INT")
    assert [(each.seq, each.command, each.param2, each.target_system) for each in told] == [(1, 177, 3.0, 255)]


def test_who_chooses_the_current_item_is_not_told_at_once() -> None:
    peer = with_three_items()
    peer.run(1.1)
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    told = [each.seq for each in only(peer.run(0.5) + peer.run(0.6), "MISSION_CURRENT")]
    assert told == [2]
    peer.dataman.told_seq = 1
    assert only(peer.run(0.05), "MISSION_CURRENT")[-1].seq == 1


@pytest.mark.parametrize(("marked", "told"), [(None, 65535), (1, 1)])
def test_a_plan_that_nobody_has_looked_at_has_no_current_item_unless_one_is_marked(
    marked: int | None, told: int
) -> None:
    """MavlinkMissionManager::update_active_mission; PX4's navigator looks at it when it knows home."""
    peer = Peer()
    upload(peer, *(item(seq, current=int(seq == marked)) for seq in range(3)))
    assert only(peer.run(1.1), "MISSION_CURRENT")[-1].seq == told


def test_the_end_of_a_mission_is_told_at_once_and_so_is_its_new_begin() -> None:
    """MavlinkMissionManager::send, _last_finished."""
    peer = with_three_items()
    peer.run(1.1)
    for state in (mavlink.MISSION_STATE_COMPLETE, mavlink.MISSION_STATE_ACTIVE):
        peer.topics.mission_result = MissionResult(peer.now_us, seq_total=3, mission_state=state)
        assert [each.mission_state for each in only(peer.run(0.05), "MISSION_CURRENT")] == [state]


def test_a_fence_that_cannot_be_cleared_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer()
    monkeypatch.setattr(peer.dataman, "store", lambda *_: False)
    assert answers(peer.send(clear(1))) == [(ERROR, 1)]
    assert said(peer) == "Mission storage: Unable to write to microSD\t"


@pytest.mark.parametrize(("yaw", "kept"), [(90.0, 90.0), (-90.0, 270.0), (720.0, 0.0)])
def test_headings_are_kept_within_a_turn(yaw: float, kept: float) -> None:
    found, _ = parse(item(0, 16, param4=yaw), 0, VehicleKind.MULTICOPTER.traits)
    assert found is not None
    assert found.param4 == kept


def test_a_region_of_interest_comes_back_as_px4_keeps_it() -> None:
    peer = Peer()
    upload(peer, item(0, 80, param1=3.0))
    peer.send(request_list())
    found = only(peer.send(request(0)), "MISSION_ITEM_INT")[0]
    assert (found.command, found.param1, found.x, found.y, found.frame) == (201, 0.0, HOME_X, HOME_Y, RELATIVE_INT)


def test_the_time_in_the_air_is_added_up_over_flights_and_starts() -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER)
    parameters.set("LND_FLIGHT_T_LO", -1_000_000)
    time = FlightTime(parameters)
    time.update(0, armed=True, landed=True)
    time.update(1_000_000, armed=True, landed=False)
    time.update(2_000_000, armed=True, landed=True)
    time.update(4_000_000, armed=False, landed=True)
    assert (parameters["LND_FLIGHT_T_HI"], parameters["LND_FLIGHT_T_LO"]) == (1, 2_000_000)
