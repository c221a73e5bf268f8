"""MAVSDK flies our vehicles: health, arm, take off, go to a place, fly a mission, land."""

import math

import pytest
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan

from tests.interop.mavsdk_vehicle import connected, place, until


@pytest.mark.parametrize(("model", "instance"), [("iris", 0), ("m600", 0)])
def test_a_mavsdk_script_flies_the_vehicle(model: str, instance: int) -> None:
    """The whole life of a flight, as a MAVSDK user writes it."""
    with connected(model, instance) as vehicle:
        action, telemetry, mission = vehicle.action, vehicle.telemetry, Mission(vehicle.system)
        until(telemetry, "health_all_ok", bool)
        start = until(telemetry, "position", lambda p: math.isfinite(p.latitude_deg))

        corners = [place(n, e, start.latitude_deg, start.longitude_deg) for n, e in ((30, 0), (0, 0))]
        items = [
            MissionItem(
                latitude_deg=lat, longitude_deg=lon, relative_altitude_m=12.0, speed_m_s=5.0, is_fly_through=True
            )
            for lat, lon in corners
        ]
        mission.upload_mission(MissionPlan(items))

        action.set_takeoff_altitude(10.0)
        action.arm()
        action.takeoff()
        until(telemetry, "position", lambda p: p.relative_altitude_m > 9.0)

        lat, lon = place(30.0, 20.0, start.latitude_deg, start.longitude_deg)
        action.goto_location(lat, lon, start.absolute_altitude_m + 15.0, 90.0)
        there = until(
            telemetry,
            "position",
            lambda p: (
                abs(p.latitude_deg - lat) < 1e-5 and abs(p.longitude_deg - lon) < 1.5e-5 and p.relative_altitude_m > 14
            ),
        )
        assert there.relative_altitude_m == pytest.approx(15.0, abs=1.5)

        mission.start_mission()
        until(
            mission,
            "mission_progress",
            lambda progress: progress.current == progress.total == len(items),
        )
        downloaded = mission.download_mission()
        assert len(downloaded.mission_items) == len(items)

        action.land()
        until(telemetry, "armed", lambda armed: not armed)
        assert telemetry.position().relative_altitude_m == pytest.approx(0.0, abs=1.5)
