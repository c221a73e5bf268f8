"""Mission transfers of the ground side while the autopilot is busy with somebody's: they wait, and begin anew."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.mission import MISSION, STALLED_US, MissionDownload, MissionItem, MissionUpload
from tests.unit.companion_px4 import on_the_wire
from tests.unit.mavlink_peer import ONBOARD, Peer
from tests.unit.plan_messages import count, item, upload
from tests.unit.test_lossy_transfers import X, Y, talk

ITEMS = [MissionItem(6, 16, x=X + seq, y=Y, z=10.0) for seq in range(4)]
LIST = mavlink.MAVLink_mission_request_list_message(1, 1, MISSION)


def left_alone(peer: Peer, *messages: Any, system: int = 250, link: int = 0) -> None:
    """Somebody begins a transfer, and is heard no more."""
    wire: Any = mavlink.MAVLink(None, srcSystem=system, srcComponent=190)
    for message in messages:
        peer.send_bytes(bytes(message.pack(wire)), link)


def uploaded(peer: Peer) -> float:
    """The seconds that it takes to upload the items."""
    service = MissionUpload(1, ITEMS)
    seconds = talk(peer, service, 0.0, 1)
    assert service.outcome == (True, 0, "accepted")
    assert [each.x for each in peer.dataman.mission.items] == [each.x for each in ITEMS]
    return seconds


def test_an_upload_waits_for_a_download_that_nobody_ends() -> None:
    peer = Peer()
    upload(peer, item(0))
    left_alone(peer, LIST)
    assert 5.0 < uploaded(peer) < 9.0


@pytest.mark.parametrize("link", [0, ONBOARD])
def test_an_upload_waits_for_one_that_nobody_goes_on_with(link: int) -> None:
    """On its own link PX4 counts the 5 s of silence from whichever MISSION_COUNT was the last."""
    peer = Peer()
    left_alone(peer, count(3), item(0), link=link)
    assert 5.0 < uploaded(peer) < 9.0


def test_an_upload_does_not_go_on_with_one_of_an_earlier_life_of_its_own() -> None:
    """Its first item would be that one's."""
    peer = Peer()
    left_alone(peer, count(len(ITEMS)), item(0, y=Y + 1), system=255)
    assert 5.0 < uploaded(peer) < 9.0


def test_an_upload_goes_on_as_soon_as_another_has_ended() -> None:
    peer = Peer()
    left_alone(peer, count(2), item(0), link=ONBOARD)
    service = MissionUpload(1, ITEMS)
    for message in service.on_time(peer.now_us):
        for answer in peer.send(message):
            service.on_message(peer.now_us, answer)
    left_alone(peer, item(1), link=ONBOARD)
    assert talk(peer, service, 0.0, 1) < 0.6
    assert service.outcome == (True, 0, "accepted")


@pytest.mark.parametrize("service", [MissionUpload(1, ITEMS), MissionDownload(1)])
def test_a_refusal_for_now_is_final_after_the_last_try(service: Any) -> None:
    busy = on_the_wire(mavlink.MAVLink_mission_ack_message(255, 190, 1, MISSION), 1, 1)
    begun = []
    for now_us in range(0, 10 * STALLED_US, 20_000):
        if service.on_time(now_us):
            begun.append(now_us)
            service.on_message(now_us, busy)
    assert begun == [0, 500_000, 2_500_000, 8_500_000, 14_500_000]
    assert service.outcome == (False, 1, "error")
