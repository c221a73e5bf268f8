"""What comes from outside is really flown: vision without GPS, landing targets, obstacles, survey cameras."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection

from .pilot import HOME, Pilot

UNKNOWN = [math.nan] + [0.0] * 20
SET_MODE, ARM = 176, 400


def sticks(pilot: Pilot) -> dict[str, int]:
    """A joystick in centre position, sent at 20 Hz; change it to fly."""
    held = {"x": 0, "y": 0, "z": 500, "r": 0}
    pilot.every(20.0, lambda: mavlink.MAVLink_manual_control_message(1, held["x"], held["y"], held["z"], held["r"], 0))
    return held


def seen(pilot: Pilot) -> Any:
    """The truth as a vision system tells it."""
    pose = pilot.truth
    return mavlink.MAVLink_odometry_message(
        0, 1, 1, pose.north_m, pose.east_m, pose.down_m, pose.q, pose.vn_m_s, pose.ve_m_s, pose.vd_m_s, 0.0, 0.0, 0.0,
        UNKNOWN, UNKNOWN, 0, 2, 100,
    )  # fmt: skip


def test_without_gps_it_flies_by_what_is_seen() -> None:
    pilot = Pilot("iris", EKF2_GPS_CTRL=0, EKF2_EV_CTRL=15, COM_FLTMODE_BOOT=2)
    held = sticks(pilot)
    pilot.every(30.0, lambda: seen(pilot))
    pilot.run(10.0)
    assert pilot.topics.vehicle_status.nav_state is NavState.POSCTL
    assert pilot.topics.vehicle_local_position.xy_valid and math.isnan(pilot.topics.vehicle_local_position.ref_lat)
    pilot.command(ARM, 1)
    held["z"] = 800
    pilot.until(lambda: -pilot.truth.down_m > 6.0, 30.0)
    held["z"] = 500
    pilot.run(4.0)
    held["x"] = 700
    pilot.run(4.0)
    held["x"] = 0
    pilot.run(5.0)
    assert pilot.truth.north_m > 5.0
    there = pilot.truth
    pilot.run(10.0)
    assert math.hypot(pilot.truth.north_m - there.north_m, pilot.truth.east_m - there.east_m) < 0.5


def test_without_gps_it_takes_off_by_mis_takeoff_alt_and_lands_where_it_was_told_to() -> None:
    """Nothing is known of the Earth: the local frame begins at 0, 0, 0 (FlightTaskAuto::_evaluateGlobalReference)."""
    pilot = Pilot("iris", EKF2_GPS_CTRL=0, EKF2_EV_CTRL=15, MIS_TAKEOFF_ALT=6.0)
    pilot.every(30.0, lambda: seen(pilot))
    pilot.run(10.0)
    pilot.command(22, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)
    pilot.until_armable()
    pilot.command(ARM, 1)
    pilot.until(lambda: -pilot.truth.down_m > 5.5, 30.0)
    pilot.run(3.0)
    assert -pilot.truth.down_m == pytest.approx(6.0, abs=0.3)
    pilot.command(SET_MODE, 1, 4, 6)
    pilot.simulator.sih_wind_n = -4.0
    pilot.until_disarmed()
    assert math.hypot(pilot.truth.north_m, pilot.truth.east_m) < 0.5


def test_it_lands_on_a_target() -> None:
    pilot = Pilot("m600")
    pilot.take_off(10.0)
    # The local frame begins where GPS said the vehicle stood; the target is told in it, but stands in the world
    pilot.run(3.0)
    local, truth = pilot.topics.vehicle_local_position, pilot.truth
    north, east = 4.0 + local.x - truth.north_m, -3.0 + local.y - truth.east_m
    level = (1.0, 0.0, 0.0, 0.0)
    pilot.every(
        10.0, lambda: mavlink.MAVLink_landing_target_message(0, 0, 1, 0, 0, 0, 0, 0, north, east, 0.0, level, 2, 1)
    )
    pilot.command(SET_MODE, 1, 4, 9)
    pilot.until_disarmed()
    assert (pilot.truth.north_m, pilot.truth.east_m) == pytest.approx((4.0, -3.0), abs=0.8)


def test_it_stops_before_an_obstacle() -> None:
    pilot = Pilot("iris", CP_DIST=4.0)
    held = sticks(pilot)
    pilot.take_off(8.0)
    pilot.command(SET_MODE, 1, 3, 0)
    wall_m = pilot.truth.north_m + 30.0

    def around() -> Any:
        """A wall in the north, told around the north."""
        ahead_m = wall_m - pilot.truth.north_m
        cosines = (math.cos(math.radians(index * 5)) for index in range(72))
        away = [min(ahead_m / cosine, 20.01) if cosine > 0.1 else 20.01 for cosine in cosines]
        distances = [round(100 * max(distance, 0.0)) for distance in away]
        return mavlink.MAVLink_obstacle_distance_message(0, 0, distances, 5, 20, 2000, 5.0, 0.0, 1)

    pilot.every(10.0, around)
    held["x"] = 1000
    pilot.run(20.0)
    assert 3.0 < wall_m - pilot.truth.north_m < 8.0
    assert abs(pilot.truth.vn_m_s) < 0.5


def test_a_survey_takes_its_pictures_where_it_says() -> None:
    pilot = Pilot("m600")
    pilot.wanted = frozenset({"CAMERA_IMAGE_CAPTURED"})
    pilot.take_off(15.0)
    pilot.command(206, 8.0, 0, 1)
    place = MapProjection(HOME.lat_deg, HOME.lon_deg)
    lat, lon = place.reproject(40.0, 0.0)
    pilot.command(192, 5.0, 0, 0, math.nan, lat, lon, HOME.alt_amsl_m + 15.0)
    shots: list[tuple[Any, float, float]] = []

    def note() -> bool:
        images = [image for image in pilot.heard if image.get_srcComponent() == 100]
        for image in images[len(shots) :]:
            shots.append((image, pilot.truth.north_m, pilot.truth.east_m))
        return pilot.truth.north_m > 38.0

    pilot.until(note)
    assert len(shots) == pytest.approx(40.0 / 8.0 + 1.0, abs=1)
    for image, north_m, east_m in shots:
        north, east = place.project(image.lat * 1e-7, image.lon * 1e-7)
        assert math.hypot(north - north_m, east - east_m) < 2.0
        w, x, y, z = image.q
        assert 2.0 * (w * y - z * x) == pytest.approx(-1.0, abs=0.02)  # the gimbal looks down
