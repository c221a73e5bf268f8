"""MAVSDK flies our vehicles: health, arm, take off, go to a place, fly a mission, land."""

import math
import queue
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk, System
from mavsdk.plugins.action import Action
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.telemetry import Telemetry

from tests.launched import launched

METRES_PER_DEGREE = 111_195.0
"""Of latitude, on PX4's sphere."""
SPEED = "4"
STEP_LIMIT_S = 60.0


def until(subscribe: Callable[..., Any], unsubscribe: Callable[[Any], None], accept: Callable[[Any], bool]) -> Any:
    """The first value of a MAVSDK stream that is accepted; raises queue.Empty when none comes in time."""
    values: queue.Queue[Any] = queue.Queue()
    handle = subscribe(lambda value, _user_data: values.put(value))
    try:
        while True:
            value = values.get(timeout=STEP_LIMIT_S)
            if accept(value):
                return value
    finally:
        unsubscribe(handle)


@pytest.fixture
def system(request: pytest.FixtureRequest) -> Iterator[System]:
    """A launched vehicle as MAVSDK sees it."""
    model, instance = request.param
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with launched(model, "--instance", str(instance), "--speed", SPEED) as process, Mavsdk(station) as mavsdk:
        mavsdk.add_any_connection(f"udpin://0.0.0.0:{14540 + instance}")
        found = mavsdk.first_autopilot(timeout_s=30.0)
        assert found is not None
        assert process.poll() is None  # it is this one that MAVSDK found
        yield found


def place(north_m: float, east_m: float, lat_deg: float, lon_deg: float) -> tuple[float, float]:
    """Latitude and longitude some metres away."""
    return (
        lat_deg + north_m / METRES_PER_DEGREE,
        lon_deg + east_m / METRES_PER_DEGREE / math.cos(math.radians(lat_deg)),
    )


@pytest.mark.parametrize("system", [("iris", 5), ("m600", 6)], indirect=True)
def test_a_mavsdk_script_flies_the_vehicle(system: System) -> None:
    """The whole life of a flight, as a MAVSDK user writes it."""
    telemetry, action, mission = Telemetry(system), Action(system), Mission(system)
    position = (telemetry.subscribe_position, telemetry.unsubscribe_position)
    until(telemetry.subscribe_health_all_ok, telemetry.unsubscribe_health_all_ok, bool)
    start = until(*position, lambda p: math.isfinite(p.latitude_deg))

    action.set_takeoff_altitude(10.0)
    action.arm()
    action.takeoff()
    until(*position, lambda p: p.relative_altitude_m > 9.0)

    lat, lon = place(30.0, 20.0, start.latitude_deg, start.longitude_deg)
    action.goto_location(lat, lon, start.absolute_altitude_m + 15.0, 90.0)
    there = until(
        *position,
        lambda p: (
            abs(p.latitude_deg - lat) < 1e-5 and abs(p.longitude_deg - lon) < 1.5e-5 and p.relative_altitude_m > 14
        ),
    )
    assert there.relative_altitude_m == pytest.approx(15.0, abs=1.5)

    corners = [place(n, e, start.latitude_deg, start.longitude_deg) for n, e in ((30, 0), (0, 0))]
    items = [
        MissionItem(latitude_deg=lat, longitude_deg=lon, relative_altitude_m=12.0, speed_m_s=5.0, is_fly_through=True)
        for lat, lon in corners
    ]
    mission.upload_mission(MissionPlan(items))
    mission.start_mission()
    until(
        mission.subscribe_mission_progress,
        mission.unsubscribe_mission_progress,
        lambda progress: progress.current == progress.total == len(items),
    )
    downloaded = mission.download_mission()
    assert len(downloaded.mission_items) == len(items)

    action.land()
    until(telemetry.subscribe_armed, telemetry.unsubscribe_armed, lambda armed: not armed)
    assert telemetry.position().relative_altitude_m == pytest.approx(0.0, abs=1.5)
