"""MAVSDK mission_raw: mission, fence and rally points item by item, what is refused, and where the mission stands."""

import math
from collections.abc import Iterator

import pytest
from mavsdk.plugins.geofence import Geofence
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw, MissionRawError, MissionRawResult

from tests.interop.mavsdk_vehicle import Vehicle, until

MISSION, FENCE, RALLY = 0, 1, 2
GLOBAL, RELATIVE_INT = 0, 6
WAYPOINT, TAKEOFF, CONTINUE_AND_CHANGE_ALT, FENCE_CIRCLE, RALLY_POINT = 16, 22, 30, 5003, 5100
X, Y = 473977418, 85455939


def item(
    seq: int, command: int = WAYPOINT, kind: int = MISSION, param1: float = 0.0, height_m: float = 10.0
) -> MissionItem:
    frame = RELATIVE_INT if kind == MISSION else GLOBAL
    current = int(kind == MISSION and seq == 0)
    param4 = math.nan if kind == MISSION else 0.0
    return MissionItem(seq, frame, command, current, 1, param1, 0.0, 0.0, param4, X + 100 * seq, Y, height_m, kind)


@pytest.fixture
def mission(vehicle: Vehicle) -> Iterator[MissionRaw]:
    raw = MissionRaw(vehicle.system)
    yield raw
    raw.clear_mission()


def test_a_mission_comes_down_as_it_went_up(mission: MissionRaw) -> None:
    up = [item(0, TAKEOFF), *(item(seq) for seq in range(1, 100))]
    mission.upload_mission(up)
    down = mission.download_mission()
    told = [(one.seq, one.frame, one.command, one.x, one.y, one.z, one.mission_type) for one in down]
    assert told == [(one.seq, one.frame, one.command, one.x, one.y, one.z, one.mission_type) for one in up]


def test_the_current_item_can_be_chosen_and_a_wrong_one_cannot(mission: MissionRaw) -> None:
    mission.upload_mission([item(seq) for seq in range(5)])
    mission.set_current_mission_item(2)
    assert until(mission, "mission_progress", lambda progress: progress.current == 2).total == 5
    with pytest.raises(MissionRawError) as told:
        mission.set_current_mission_item(20)
    assert told.value.result == MissionRawResult.INVALID_ARGUMENT
    assert not mission.is_mission_finished()


def test_a_refused_mission_leaves_the_old_one(mission: MissionRaw) -> None:
    mission.upload_mission([item(0), item(1)])
    with pytest.raises(MissionRawError) as told:
        mission.upload_mission([item(0, CONTINUE_AND_CHANGE_ALT)])
    assert told.value.result == MissionRawResult.UNSUPPORTED
    assert len(mission.download_mission()) == 2
    mission.clear_mission()
    assert mission.download_mission() == []


def test_fence_and_rally_points_are_kept_apart_from_the_mission(mission: MissionRaw, vehicle: Vehicle) -> None:
    mission.upload_mission([item(0)])
    mission.upload_geofence([item(0, FENCE_CIRCLE, FENCE, param1=5000.0, height_m=0.0)])
    mission.upload_rally_points([item(seq, RALLY_POINT, RALLY) for seq in range(3)])
    assert [one.param1 for one in mission.download_geofence()] == [5000.0]
    assert [one.mission_type for one in mission.download_rallypoints()] == [RALLY] * 3
    assert len(mission.download_mission()) == 1
    Geofence(vehicle.system).clear_geofence()
    assert mission.download_geofence() == []
    assert len(mission.download_rallypoints()) == 3


def test_a_changed_mission_is_told(mission: MissionRaw) -> None:
    mission.upload_mission([item(0), item(1)])
    assert until(mission, "mission_progress", lambda progress: progress.total == 2)
