"""MAVSDK follow_me: its settings are PX4's parameters, and a vehicle stays behind somebody who walks north."""

import contextlib
import time

import pytest
from mavsdk.plugins.follow_me import Config, FollowMe, FollowMeError, TargetLocation
from mavsdk.plugins.telemetry import FlightMode

from tests.interop.mavsdk_vehicle import SPEED, Vehicle, distance_m, place, until

BEHIND = 180.0
WALKS_M_S, WALK_M, EVERY_S = 2.0, 80.0, 0.05
CONFIG = Config(12.0, 6.0, 0.2, Config.FollowAltitudeMode.CONSTANT, 6.0, BEHIND)


def test_the_settings_are_px4s_parameters(vehicle: Vehicle) -> None:
    plugin = FollowMe(vehicle.system)
    before = plugin.get_config()
    plugin.set_config(CONFIG)
    for name, value in (("FLW_TGT_HT", 12.0), ("FLW_TGT_DST", 6.0), ("FLW_TGT_FA", BEHIND), ("FLW_TGT_RS", 0.2)):
        assert vehicle.param.get_param_float(name) == pytest.approx(value)
    plugin.set_config(before)
    assert not plugin.is_active()


def test_it_stays_behind_who_walks(vehicle: Vehicle) -> None:
    plugin = FollowMe(vehicle.system)
    before = plugin.get_config()
    plugin.set_config(Config(10.0, 12.0, 0.1, Config.FollowAltitudeMode.CONSTANT, 8.0, BEHIND))
    start = vehicle.take_off(10.0)
    plugin.start()
    vehicle.until_mode(FlightMode.FOLLOW_ME)
    # The vehicle's clock runs SPEED times as fast as that of who walks beside it
    began_s, north_m = time.monotonic(), 0.0
    while north_m < WALK_M:
        north_m = (time.monotonic() - began_s) * float(SPEED) * WALKS_M_S
        lat, lon = place(north_m, 0.0, start.latitude_deg, start.longitude_deg)
        # MAVSDK takes the heartbeat of the camera for the autopilot's, and thinks for a moment that all is over
        with contextlib.suppress(FollowMeError):
            plugin.set_target_location(TargetLocation(lat, lon, start.absolute_altitude_m, WALKS_M_S, 0.0, 0.0))
        time.sleep(EVERY_S)
    here = vehicle.telemetry.position()
    assert distance_m(here, start) == pytest.approx(WALK_M - 12.0, abs=6.0)
    assert here.relative_altitude_m == pytest.approx(10.0, abs=1.5)
    # Who stands is looked at from where one was
    until(vehicle.telemetry, "velocity_ned", lambda velocity: abs(velocity.north_m_s) < 0.5)
    plugin.stop()
    plugin.set_config(before)
