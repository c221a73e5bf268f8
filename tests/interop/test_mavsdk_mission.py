"""MAVSDK mission: transfers with progress, and a mission that is paused, continued and brought home."""

import math
import queue
from typing import Any

import pytest
from mavsdk.plugins.mission import Mission, MissionError, MissionItem, MissionPlan, MissionResult
from mavsdk.plugins.telemetry import FlightMode

from tests.interop.mavsdk_vehicle import Vehicle, distance_m, place, until

TRANSFER_LIMIT_S = 30.0


def item(lat_deg: float, lon_deg: float, height_m: float = 12.0) -> MissionItem:
    return MissionItem(
        latitude_deg=lat_deg, longitude_deg=lon_deg, relative_altitude_m=height_m, speed_m_s=5.0, is_fly_through=True
    )


def test_a_transfer_tells_its_progress(vehicle: Vehicle) -> None:
    mission = Mission(vehicle.system)
    plan = MissionPlan([item(47.3977 + number * 1e-5, 8.5456) for number in range(50)])
    told: queue.Queue[Any] = queue.Queue()
    mission.upload_mission_with_progress_async(plan, lambda result, progress, _user: told.put((result, progress)))
    seen: list[Any] = []
    while not seen or seen[-1][0] == MissionResult.NEXT:
        seen.append(told.get(timeout=TRANSFER_LIMIT_S))
    assert seen[-1][0] == MissionResult.SUCCESS
    assert len(seen) > 10
    down = mission.download_mission().mission_items
    assert [round(one.latitude_deg, 6) for one in down] == [round(one.latitude_deg, 6) for one in plan.mission_items]
    mission.set_current_mission_item(3)
    assert until(mission, "mission_progress", lambda progress: progress.current == 3).total == 50
    mission.clear_mission()
    assert mission.download_mission().mission_items == []


def test_a_mission_is_paused_and_continued_and_returns_at_its_end(vehicle: Vehicle) -> None:
    mission, telemetry = Mission(vehicle.system), vehicle.telemetry
    vehicle.until_ready()
    start = telemetry.position()
    corners = [
        place(north, east, start.latitude_deg, start.longitude_deg) for north, east in ((0, 0), (40, 0), (40, 15))
    ]
    mission.set_return_to_launch_after_mission(True)
    mission.upload_mission(MissionPlan([item(*corner) for corner in corners]))
    vehicle.action.arm()
    mission.start_mission()
    vehicle.until_mode(FlightMode.MISSION)
    until(telemetry, "position", lambda position: distance_m(position, start) > 8.0)
    mission.pause_mission()
    vehicle.until_mode(FlightMode.HOLD)
    until(telemetry, "velocity_ned", lambda velocity: math.hypot(velocity.north_m_s, velocity.east_m_s) < 0.3)
    assert not mission.is_mission_finished()
    mission.start_mission()
    until(mission, "mission_progress", lambda progress: progress.current == progress.total)
    assert mission.is_mission_finished()
    vehicle.until_disarmed()
    assert distance_m(telemetry.position(), start) < 1.5
    mission.set_return_to_launch_after_mission(False)
    mission.clear_mission()


def test_an_empty_mission_cannot_be_uploaded(vehicle: Vehicle) -> None:
    with pytest.raises(MissionError) as told:
        Mission(vehicle.system).upload_mission(MissionPlan([]))
    assert told.value.result in (MissionResult.NO_MISSION_AVAILABLE, MissionResult.INVALID_ARGUMENT)
