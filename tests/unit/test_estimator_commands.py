"""Commands to the estimator: what it is told to leave, and where it is told to be."""

import math

import pytest

from sitl_emu.autopilot.estimator.commands import EstimatorCommands
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.estimator import Settings
from sitl_emu.autopilot.estimator.external_estimates import take_position
from sitl_emu.autopilot.estimator.samples import ImuSample
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import VehicleStatus
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.geomagnetism import magnetic_field
from tests.typed import now
from tests.unit.vehicle_command import vehicle_command

from .estimator_feed import LAT, LON, Feed
from .test_estimator import circle

EXTERNAL_ATTITUDE, EXTERNAL_POSITION, EXTERNAL_WIND, SENSOR_ENABLE, GLOBAL_ORIGIN = 620, 43003, 43004, 43006, 611
ACCEPTED, TEMPORARILY_REJECTED, UNSUPPORTED, FAILED = 0, 1, 3, 4
GPS, AGP, BARO, MAG = 0, 3, 4, 6
NAN = math.nan


def give(feed: Feed, number: int, *params: float) -> int:
    """The result of a command."""
    command = vehicle_command(number, *params, rest=0.0)
    now_us = feed.topics.sensor_combined.timestamp
    return EstimatorCommands(feed.estimator, feed.topics, feed.parameters).handle_command(now_us, command).result


def north_m(feed: Feed) -> float:
    return feed.topics.vehicle_local_position.x


@pytest.mark.parametrize(("source", "flag"), [(GPS, "cs_gnss_pos"), (BARO, "cs_baro_hgt"), (MAG, "cs_mag")])
def test_a_sensor_is_left_and_taken_again(source: int, flag: str) -> None:
    feed = Feed()
    feed.run(3.0)
    assert getattr(feed.topics.estimator_status_flags, flag)
    assert give(feed, SENSOR_ENABLE, source, NAN, 0) == ACCEPTED
    feed.run(1.0)
    assert not getattr(feed.topics.estimator_status_flags, flag)
    assert give(feed, SENSOR_ENABLE, source, NAN, 1) == ACCEPTED
    feed.run(3.0)
    assert getattr(feed.topics.estimator_status_flags, flag)


def test_what_was_switched_in_flight_is_kept_after_disarming() -> None:
    """EKF2.cpp, syncSensEnParam: at disarming, and at each command before; it knows no second GNSS (bit 1)."""
    feed = Feed(EKF2_SENS_EN=8191 & ~0b11010000)
    feed.topics.vehicle_status = VehicleStatus(armed=True)
    feed.run(0.1)
    assert give(feed, SENSOR_ENABLE, MAG, NAN, 0) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8191 & ~0b11010000
    feed.topics.vehicle_status = VehicleStatus(armed=False)
    feed.run(0.1)
    assert feed.parameters["EKF2_SENS_EN"] == 8191 & ~(0b11010000 | 1 << 10 | 1 << 1)
    assert give(feed, SENSOR_ENABLE, MAG, NAN, 1) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8191 & ~(0b11010000 | 1 << 1)


@pytest.mark.parametrize(("source", "instance"), [(9, 0), (99, 0), (-1, 0), (AGP, 4), (AGP, -1)])
def test_a_sensor_that_nobody_knows(source: float, instance: float) -> None:
    assert give(Feed(), SENSOR_ENABLE, source, instance, 1) == UNSUPPORTED


@pytest.mark.parametrize("source", [NAN, 256, 0.9])
def test_a_source_is_taken_in_eight_bits(source: float) -> None:
    """static_cast<uint8_t>: what is no number is 0, the GPS."""
    feed = Feed()
    assert give(feed, SENSOR_ENABLE, source, 0, 0) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8189 & ~1
    assert give(feed, SENSOR_ENABLE, source, 0, 1) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8189


def test_auxiliary_positions_are_switched_one_by_one() -> None:
    """Each has its bit; who had no id at the start is never available (AgpSource::update)."""
    feed = Feed(EKF2_AGP1_ID=7, EKF2_AGP1_CTRL=1, EKF2_AGP2_CTRL=1)
    assert give(feed, SENSOR_ENABLE, AGP, 0, 0) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8173
    feed.run(0.5)
    assert feed.estimator.fusion.auxiliary.intended() == (False, True, False, False)
    assert give(feed, SENSOR_ENABLE, AGP, 1, 0) == ACCEPTED
    assert feed.parameters["EKF2_SENS_EN"] == 8141
    assert feed.estimator.fusion.auxiliary.intended() == (False,) * 4
    assert give(feed, SENSOR_ENABLE, AGP, 1, 1) == ACCEPTED
    assert give(feed, SENSOR_ENABLE, AGP, 2, 1) == TEMPORARILY_REJECTED
    assert feed.parameters["EKF2_SENS_EN"] == 8173


def test_a_position_from_outside_holds_until_the_gps_has_its_way() -> None:
    feed = Feed()
    feed.run(3.0)
    counter = feed.topics.vehicle_local_position.xy_reset_counter
    assert give(feed, EXTERNAL_POSITION, 0, 0, 1, 0, LAT + 0.01, LON) == ACCEPTED
    feed.run(0.1)
    assert north_m(feed) == pytest.approx(1112.0, abs=5.0)
    assert feed.topics.vehicle_local_position.xy_reset_counter == counter + 1
    feed.run(2.5)
    assert feed.topics.estimator_status.pre_flt_fail_innov_pos_horiz
    feed.run(8.0)
    assert north_m(feed) == pytest.approx(0.0, abs=1.0)


def test_a_late_position_has_climbed_since() -> None:
    """EKF/ekf.cpp, resetGlobalPosToExternalObservation: the whole velocity counts, not the horizontal one alone."""
    feed = Feed()
    feed.run(3.0)
    feed.path = lambda time_s: ((0.0, 0.0, -2.0 * (time_s - 3.0)), (0.0, 0.0, -2.0), (0.0, 0.0, 0.0))
    feed.estimator.ekf.state.vd = -2.0
    feed.run(4.0)
    assert give(feed, EXTERNAL_POSITION, 0, 5.0, 1, 0, LAT, LON, 1000.0) == ACCEPTED
    feed.run(0.02)
    assert feed.topics.vehicle_global_position.alt == pytest.approx(1010.0, abs=1.0)


@pytest.mark.parametrize(("latitude", "result"), [(NAN, TEMPORARILY_REJECTED), (91.0, FAILED)])
def test_a_position_that_is_none_changes_nothing(latitude: float, result: int) -> None:
    feed = Feed()
    feed.run(3.0)
    assert give(feed, EXTERNAL_POSITION, 0, 0, 1, 0, latitude, LON) == result
    assert give(feed, EXTERNAL_ATTITUDE, 1, 2, 3) == ACCEPTED
    feed.run(0.1)
    assert north_m(feed) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("altitude_m", [NAN, 400.0, 2_147_483.0])
def test_a_new_origin_leaves_the_vehicle_where_it_is(altitude_m: float) -> None:
    feed = Feed()
    feed.run(5.0)
    before, height = feed.topics.vehicle_global_position, feed.topics.vehicle_local_position.z
    assert give(feed, GLOBAL_ORIGIN, 0, 0, 0, 0, LAT - 0.01, LON, altitude_m) == ACCEPTED
    feed.run(3.0)
    local, after = feed.topics.vehicle_local_position, feed.topics.vehicle_global_position
    assert (local.ref_lat, local.ref_lon) == (LAT - 0.01, LON)
    assert local.x == pytest.approx(1112.0, abs=5.0)
    moved_m = altitude_m - (before.alt + height) if altitude_m == 400.0 else 0.0
    assert local.z - height == pytest.approx(moved_m, abs=0.7)
    assert (after.lat, after.lon) == pytest.approx((before.lat, before.lon), abs=1e-5)
    assert after.alt == pytest.approx(before.alt, abs=0.7)


def test_a_new_origin_tells_by_how_much_it_moved_the_frame_alone() -> None:
    """Not by how much the origins before did; heights with the sign of setAltOrigin (EKF/ekf_helper.cpp)."""
    feed = Feed()
    feed.run(5.0)
    alt_m = feed.topics.vehicle_local_position.ref_alt
    for north_deg, up_m in ((-0.01, 30.0), (0.0, 0.0)):
        before = feed.topics.vehicle_local_position
        assert give(feed, GLOBAL_ORIGIN, 0, 0, 0, 0, LAT + north_deg, LON, alt_m + up_m) == ACCEPTED
        feed.run(0.5)
        local = feed.topics.vehicle_local_position
        assert (local.xy_reset_counter, local.z_reset_counter) == (
            before.xy_reset_counter + 1,
            before.z_reset_counter + 1,
        )
        assert local.delta_xy == pytest.approx((local.x - before.x, local.y - before.y), abs=0.5)
        assert local.delta_z == local.delta_dist_bottom == pytest.approx(before.ref_alt - local.ref_alt)


def test_an_origin_without_a_position_leaves_the_vehicle_where_it_was_counted_from() -> None:
    """At 0° N 0° E: PX4 tells 5227 km south and 1067 km west of Zürich, and a jump to there (setLatLonOrigin)."""
    feed = Feed(EKF2_GPS_CTRL=0)
    feed.run(15.0)
    before = feed.topics.vehicle_local_position
    assert not before.xy_valid and not before.xy_global
    assert give(feed, GLOBAL_ORIGIN, 0, 0, 0, 0, 47.3979, 8.5456, 480.0) == ACCEPTED
    feed.run(3.0)
    local, earth = feed.topics.vehicle_local_position, feed.topics.vehicle_global_position
    assert (local.x, local.y) == pytest.approx((-5_227_338, -1_067_130), abs=20.0)
    assert local.xy_reset_counter == before.xy_reset_counter + 1
    assert local.delta_xy == pytest.approx((local.x - before.x, local.y - before.y), abs=20.0)
    assert (earth.lat, earth.lon) == pytest.approx((0.0, 0.0), abs=1e-4)
    field = magnetic_field(0.0, 0.0)
    assert feed.estimator.fusion.magnetometer.declination_rad == pytest.approx(field.declination_rad, abs=1e-3)


def test_a_late_position_is_carried_on_to_the_present_and_tells_all_that_it_was_off() -> None:
    """Height as well; what fusion moved is less than the jump that is told (resetGlobalPosToExternalObservation)."""
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {})))
    ekf.begin_step(ImuSample(8000, (0.0, 0.0, 0.0), (0.0, 0.0, -0.0785), 0.008))
    ekf.time_us, ekf.origin, ekf.origin_alt = 10_000_000, MapProjection(LAT, LON), 488.0
    ekf.horizontal_dead_reckoning_too_long = False
    ekf.state.vn, ekf.state.vd = 4.0, -3.0
    take_position(ekf, (LAT, LON, 500.0), 20.0, 8_000_000)
    assert ekf.resets.pos_ne == 1 and ekf.resets.pos_ne_change == pytest.approx((8.0, 0.0), abs=0.01)
    assert 4.0 < ekf.state.pn < 7.0
    assert ekf.state.alt == pytest.approx(506.0)


def test_an_origin_off_the_globe() -> None:
    assert give(Feed(), GLOBAL_ORIGIN, 0, 0, 0, 0, 91.0, 0.0, 0.0) == FAILED


@pytest.mark.parametrize(
    ("number", "params", "result"),
    [
        (EXTERNAL_ATTITUDE, (0, 0, 90.0), ACCEPTED),
        (EXTERNAL_ATTITUDE, (0, 0, NAN), UNSUPPORTED),
        (EXTERNAL_POSITION, (0, NAN, 1, 0, LAT, LON), TEMPORARILY_REJECTED),
        (EXTERNAL_POSITION, (0, 0, 1, 0, NAN, LON), TEMPORARILY_REJECTED),
        (EXTERNAL_POSITION, (0, 0, 1, 0, 91.0, LON), FAILED),
        (GLOBAL_ORIGIN, (0, 0, 0, 0, NAN, LON), FAILED),
    ],
)
def test_numbers_that_say_nothing(number: int, params: tuple[float, ...], result: int) -> None:
    assert give(Feed(), number, *params) == result


def test_wind_ends_with_the_drag_that_showed_it() -> None:
    """A wind that was told counts until one is estimated (controlAirDataFusion)."""
    feed = Feed(circle, EKF2_DRAG_CTRL=1)
    feed.run(2.0)
    assert give(feed, EXTERNAL_WIND, 2.0, 1.0, 90.0, 10.0) == ACCEPTED
    feed.run(6.0)
    assert now(feed.estimator.ekf.flags.wind)
    feed.parameters.set("EKF2_DRAG_CTRL", 0)
    feed.run(0.5)
    last_us = feed.topics.wind.timestamp
    feed.run(1.0)
    assert not now(feed.estimator.ekf.flags.wind)
    assert feed.topics.wind.timestamp == last_us


def test_a_wind_of_no_speed_is_none() -> None:
    """math::max(NaN, 0) in EKF/wind.cpp; a direction that is none changes nothing."""
    feed = Feed()
    feed.run(2.0)
    assert give(feed, EXTERNAL_WIND, 8.0, 1.0, 90.0, 10.0) == ACCEPTED
    assert give(feed, EXTERNAL_WIND, 5.0, 1.0, NAN, 10.0) == ACCEPTED
    assert feed.estimator.ekf.state.wind == pytest.approx((0.0, -8.0), abs=0.01)
    assert give(feed, EXTERNAL_WIND, NAN, 1.0, 90.0, 10.0) == ACCEPTED
    assert feed.estimator.ekf.state.wind == pytest.approx((0.0, 0.0))


def test_wind_is_told_on_the_ground_and_answered_twice() -> None:
    feed = Feed()
    feed.run(2.0)
    assert give(feed, EXTERNAL_WIND, 8.0, 1.0, 90.0, 10.0) == ACCEPTED
    feed.run(1.0)
    assert feed.topics.wind[1:3] == pytest.approx((0.0, -8.0), abs=0.01)
    assert [ack.result for ack in feed.topics.vehicle_command_acks] == [UNSUPPORTED]
    feed.path = lambda _: ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
    feed.run(0.5)
    assert give(feed, EXTERNAL_WIND, 15.0, 1.0, 180.0, 10.0) == ACCEPTED
    feed.run(0.1)
    assert feed.topics.wind[1:3] == pytest.approx((0.0, -8.0), abs=0.01)
