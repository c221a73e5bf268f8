"""The estimator as the other modules see it: what it publishes when sensors come, go and lie."""

import math

import numpy as np
import pytest

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.ekf import RANGE
from sitl_emu.autopilot.topics import DistanceSensorSample, LandingTargetPose, Vector3
from tests.typed import now
from tests.unit.estimator_feed import ALT_M, DECLINATION, LAT, LON, Feed


def circle(time_s: float) -> tuple[Vector3, Vector3, Vector3]:
    """At rest for 3 s, then a circle of 20 m at up to 5 m/s, at a height of 10 m."""
    t = time_s - 3.0
    if t <= 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    # The angle begins with no speed: w * (t - sin(t)), so that all derivatives are smooth.
    w = 0.125
    angle, rate, accel = w * (t - math.sin(t)), w * (1.0 - math.cos(t)), w * math.sin(t)
    c, s, r = math.cos(angle), math.sin(angle), 20.0
    position = (r * s, r * (1.0 - c), -0.1 * (t - math.sin(t)))
    velocity = (r * c * rate, r * s * rate, -0.1 * (1.0 - math.cos(t)))
    return (
        position,
        velocity,
        (r * (c * accel - s * rate * rate), r * (s * accel + c * rate * rate), -0.1 * math.sin(t)),
    )


def test_knows_where_it_is_four_seconds_after_power_on() -> None:
    feed = Feed()
    feed.run(4.0)
    local, flags = feed.topics.vehicle_local_position, feed.topics.estimator_status_flags
    assert local.xy_valid and local.z_valid and local.v_xy_valid and local.v_z_valid
    assert flags.cs_tilt_align and flags.cs_yaw_align and flags.cs_gnss_pos and flags.cs_baro_hgt and flags.cs_mag
    assert (local.ref_lat, local.ref_lon) == pytest.approx((LAT, LON), abs=1e-5)
    assert local.ref_alt == pytest.approx(ALT_M, abs=0.5)
    assert local.heading == pytest.approx(0.7, abs=0.05)
    place = feed.topics.vehicle_global_position
    assert place.valid and place.alt == pytest.approx(ALT_M, abs=0.5)


@pytest.mark.parametrize(("logged", "states", "status"), [(True, 125, 125), (False, 2, 9)])
def test_what_only_a_log_takes_at_every_step_is_told_seldom_without_one(logged: bool, states: int, status: int) -> None:
    """PX4 publishes with each step of the filter, 125 times a second (EKF2.cpp)."""
    feed = Feed()
    feed.run(4.0)
    feed.estimator.records.logged = logged
    told = {name: set[int]() for name in ("estimator_states", "estimator_innovations", "estimator_status")}
    for _ in range(500):
        feed.step()
        for name, times in told.items():
            times.add(getattr(feed.topics, name).timestamp)
    for name, times in told.items():
        wanted = status if name == "estimator_status" else states
        assert len(times) / 2.0 == pytest.approx(wanted, abs=1.0), name


def test_a_height_bias_is_told_when_it_has_changed() -> None:
    """The reference's, GNSS here, is none and never is told; the barometer's follows it (PublishBaroBias)."""
    feed = Feed(EKF2_HGT_REF=1.0)
    told = set[float]()
    for _ in range(2000):
        feed.step()
        told.add(feed.topics.estimator_baro_bias.bias)
    assert len(told) > 20
    assert feed.topics.estimator_gnss_hgt_bias.timestamp == 0


def test_the_place_on_earth_comes_with_each_local_position() -> None:
    """A hundred times a second to who asks for so many (a real PX4's GLOBAL_POSITION_INT)."""
    feed = Feed()
    feed.run(4.0)
    told = set[int]()
    for _ in range(250):
        feed.step()
        local, place = feed.topics.vehicle_local_position, feed.topics.vehicle_global_position
        assert place.timestamp == local.timestamp
        told.add(place.timestamp)
    assert len(told) in (125, 126)


def test_stands_still_on_the_ground() -> None:
    feed = Feed()
    feed.run(5.0)
    seen = []
    for _ in range(60):
        feed.run(0.25)
        local = feed.topics.vehicle_local_position
        seen.append((local.x, local.z, local.vx, local.vz, local.heading))
    spans = [max(column) - min(column) for column in zip(*seen, strict=True)]
    assert spans[0] < 0.3 and spans[1] < 0.3, "position"
    assert spans[2] < 0.1 and spans[3] < 0.1, "velocity"
    assert spans[4] < 0.02, "heading"


def test_follows_a_moving_vehicle() -> None:
    feed = Feed(circle)
    feed.run(4.0)
    for _ in range(52):
        feed.run(0.5)
        position, velocity, _ = circle(feed.time_s)
        local = feed.topics.vehicle_local_position
        assert math.dist((local.x, local.y, local.z), position) < 1.0
        assert math.dist((local.vx, local.vy, local.vz), velocity) < 0.4
        roll, pitch, yaw = feed.topics.vehicle_attitude.euler
        assert abs(roll) < 0.03 and abs(pitch) < 0.03 and abs(yaw - 0.7) < 0.05


def test_the_attitude_is_told_with_each_imu_sample() -> None:
    """EKF2.cpp, PublishAttitude; positions come with each step of the filter, which is two samples."""
    feed = Feed()
    feed.run(3.0)
    attitudes, positions = set(), set()
    for _ in range(20):
        feed.step()
        attitudes.add(feed.topics.vehicle_attitude.q)
        assert feed.topics.vehicle_attitude.timestamp == feed.ticks * 4000
        positions.add(feed.topics.vehicle_local_position.timestamp)
    assert len(attitudes) == 20 and len(positions) in (10, 11)


def test_learns_an_imu_bias() -> None:
    feed = Feed()
    feed.accel_bias_z, feed.gyro_bias_x = 0.15, 0.02
    feed.run(20.0)
    bias = feed.topics.estimator_sensor_bias
    assert bias.gyro_bias[0] == pytest.approx(0.02, abs=0.005)
    assert bias.accel_bias[2] == pytest.approx(0.15, abs=0.05)
    assert feed.topics.vehicle_angular_velocity.xyz[0] == pytest.approx(0.0, abs=0.02)


def test_an_imu_that_is_calibrated_anew_loses_the_bias_that_was_learnt() -> None:
    """EKF2.cpp, by sensor_combined's calibration counts: else the bias would be taken off twice."""
    feed = Feed()
    feed.gyro_bias_x, feed.accel_bias_z = 0.02, 0.15
    feed.run(25.0)
    combined = feed.topics.sensor_combined
    assert (combined.accel_calibration_count, combined.gyro_calibration_count) == (0, 1), "a gyro's first one counts"
    state = feed.estimator.ekf.state
    assert (state.gyro_bias[0], state.accel_bias[2]) == pytest.approx((0.02, 0.15), abs=0.01)
    feed.parameters.set("CAL_GYRO0_XOFF", 0.02)
    feed.step()
    combined = feed.topics.sensor_combined
    assert (combined.accel_calibration_count, combined.gyro_calibration_count) == (0, 2)
    feed.run(4.0)
    assert not feed.topics.estimator_sensor_bias.gyro_bias_stable
    assert state.gyro_bias[0] == pytest.approx(0.0, abs=2e-3)
    feed.parameters.set("CAL_ACC0_ZOFF", 0.15)
    feed.run(4.0)
    assert state.accel_bias[2] == pytest.approx(0.0, abs=0.02)
    assert feed.topics.vehicle_local_position.vz == pytest.approx(0.0, abs=0.05)


def test_another_gyro_cutoff_lets_the_rates_go_on() -> None:
    """VehicleAngularVelocity: a new filter begins with the last rates."""
    feed = Feed()
    feed.gyro_bias_x = 0.8
    feed.run(0.2)
    before = feed.estimator.ekf.state.gyro_bias[0] + feed.topics.vehicle_angular_velocity.xyz[0]
    feed.parameters.set("IMU_GYRO_CUTOFF", 20.0)
    feed.step()
    after = feed.estimator.ekf.state.gyro_bias[0] + feed.topics.vehicle_angular_velocity.xyz[0]
    assert (before, after) == pytest.approx((0.8, 0.8), abs=0.05)


def test_a_bias_that_jumps_is_no_angular_acceleration() -> None:
    """VehicleAngularVelocity: what is differentiated has its bias still."""
    feed = Feed()
    feed.run(2.0)
    before = feed.topics.vehicle_angular_velocity
    feed.estimator.ekf.state.gyro_bias = (0.5, 0.0, 0.0)
    feed.step()
    after = feed.topics.vehicle_angular_velocity
    assert after.xyz[0] - before.xyz[0] == pytest.approx(-0.5, abs=0.02)
    assert abs(after.xyz_derivative[0]) < 5.0


def test_without_gps_there_is_height_but_no_position() -> None:
    feed = Feed()
    feed.gps = False
    feed.run(4.0)
    local = feed.topics.vehicle_local_position
    assert not local.xy_valid and not local.v_xy_valid and local.z_valid
    assert math.isnan(local.ref_lat) and not feed.topics.vehicle_global_position.valid


def test_a_fix_that_is_not_trusted_lies_thousands_of_kilometres_away() -> None:
    """Before there is an origin the filter stands at 0° N 0° E.

    Innovations and GPS_GLITCH as in PX4's log (estimator_aid_src_gnss_pos, estimator_status: shared/px4/ulog).
    """
    feed = Feed(EKF2_REQ_NSATS=30)
    feed.run(2.0)
    north, east = feed.topics.estimator_aid_src_gnss_pos.innovation
    assert (north, east) == pytest.approx((-5240971.0, -951291.0), rel=1e-5)
    assert feed.topics.estimator_status.solution_status_flags & 1024
    assert not feed.topics.estimator_status_flags.cs_gnss_pos


def test_the_first_fix_leaves_the_last_known_place_behind() -> None:
    """In PX4's log 5289 km lie between (estimator_aid_src_fake_pos), until 0.4 s later it is known anew."""
    feed = Feed()
    while feed.estimator.ekf.origin is None:
        feed.step()
    fixed = feed.topics.vehicle_local_position
    feed.run(0.3)
    fake = feed.topics.estimator_aid_src_fake_pos
    assert fake.innovation_rejected and fake.innovation == pytest.approx((5289202.0, 645154.0), rel=1e-3)
    feed.run(0.4)
    local, fake = feed.topics.vehicle_local_position, feed.topics.estimator_aid_src_fake_pos
    assert fake.fused and abs(fake.innovation[0]) < 0.1
    assert fake.observation == pytest.approx((LAT, LON), abs=1e-4), "degrees, as PX4's log has them"
    assert local.xy_reset_counter == fixed.xy_reset_counter + 1
    assert local.vxy_reset_counter == fixed.vxy_reset_counter + 1


def test_position_ends_five_seconds_after_the_last_fix_and_comes_back() -> None:
    feed = Feed(circle)
    feed.run(10.0)
    feed.gps = False
    feed.run(4.7)
    local = feed.topics.vehicle_local_position
    assert local.xy_valid and local.dead_reckoning
    feed.run(0.5)
    local = feed.topics.vehicle_local_position
    assert not local.xy_valid and not local.v_xy_valid and local.z_valid
    assert not now(feed.topics.vehicle_global_position.valid)
    feed.gps = True
    feed.run(1.5)
    local = feed.topics.vehicle_local_position
    assert local.xy_valid and feed.topics.vehicle_global_position.valid
    assert math.dist((local.x, local.y), circle(feed.time_s)[0][:2]) < 1.0


def test_timeout_is_the_parameter_s() -> None:
    feed = Feed(circle, EKF2_NOAID_TOUT=2_000_000)
    feed.run(10.0)
    feed.gps = False
    feed.run(2.3)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_a_jump_of_the_gps_is_gated_and_after_seven_seconds_believed() -> None:
    feed = Feed(circle)
    feed.run(12.0)
    feed.gps_offset_m = 60.0
    feed.run(2.0)
    assert feed.topics.estimator_status.pos_test_ratio > 1.0
    error = feed.topics.vehicle_local_position.x - circle(feed.time_s)[0][0]
    assert abs(error) < 2.0
    feed.run(8.0)
    error = feed.topics.vehicle_local_position.x - circle(feed.time_s)[0][0]
    assert error == pytest.approx(60.0, abs=2.0)


def test_the_first_fix_is_of_the_antenna_and_the_origin_where_the_vehicle_is() -> None:
    """Position observations of PX4 have SENS_GPS0_OFFX taken off (updateGnssPos in EKF/aid_sources/gnss)."""
    feed = Feed(yaw=0.0, SENS_GPS0_OFFX=3.0)
    feed.run(6.0)
    local, fix = feed.topics.vehicle_local_position, feed.topics.estimator_aid_src_gnss_pos
    assert math.hypot(local.x, local.y) < 0.5
    assert (local.ref_lat - LAT) * 111_195.0 == pytest.approx(-3.0, abs=0.5)
    assert (fix.observation[0] - LAT) * 111_195.0 == pytest.approx(-3.0, abs=0.5)


def test_height_goes_on_without_barometer() -> None:
    feed = Feed(circle)
    feed.run(8.0)
    feed.baro = False
    feed.run(10.0)
    local = feed.topics.vehicle_local_position
    assert local.z_valid and not feed.topics.estimator_status_flags.cs_baro_hgt
    assert local.z == pytest.approx(circle(feed.time_s)[0][2], abs=0.5)


def test_the_barometer_goes_along_when_the_height_jumps_to_what_gps_says() -> None:
    feed = Feed()
    feed.run(12.0)
    resets = feed.topics.vehicle_local_position.z_reset_counter
    feed.gps_offset_up_m = 30.0
    while feed.topics.vehicle_local_position.z_reset_counter == resets and feed.time_s < 40.0:
        feed.step()
    feed.gps = False
    feed.run(1.0)
    assert feed.topics.vehicle_local_position.z == pytest.approx(-30.0, abs=1.0)
    assert feed.topics.estimator_status_flags.cs_baro_hgt


def test_barometer_as_height_reference() -> None:
    feed = Feed(circle, EKF2_HGT_REF=0)
    feed.run(15.0)
    assert feed.topics.vehicle_local_position.z == pytest.approx(circle(feed.time_s)[0][2], abs=0.6)


def test_distance_to_ground() -> None:
    feed = Feed(circle)
    feed.run(10.0)
    for _ in range(60):
        feed.run(0.052)
        height = -feed.topics.vehicle_local_position.z
        feed.topics.distance_sensor = DistanceSensorSample(feed.ticks * 4000, height + 2.0, 0.2, 12.0)
    local = feed.topics.vehicle_local_position
    assert local.dist_bottom_valid and local.dist_bottom == pytest.approx(2.0 - local.z, abs=0.2)
    feed.run(1.5)
    assert not feed.topics.vehicle_local_position.dist_bottom_valid


def test_ground_effect_ends_at_once_where_the_ground_is_known_to_be_far() -> None:
    """A way down may be told to be into it all the time: Ekf::updateGroundEffect goes by the height."""
    feed = Feed(circle)
    feed.in_ground_effect = True
    feed.run(10.0)
    assert feed.estimator.ekf.flags.gnd_effect
    told = [True]
    for _ in range(60):
        for _ in range(13):
            feed.step()
            if told[-1] != feed.estimator.ekf.flags.gnd_effect:
                told.append(not told[-1])
        height = -feed.topics.vehicle_local_position.z
        feed.topics.distance_sensor = DistanceSensorSample(feed.ticks * 4000, height + 2.0, 0.2, 12.0)
    assert told == [True, False]


def test_heights_that_count_from_the_ground_do_so_all_the_time() -> None:
    """EKF2_RNG_CTRL 2 gives the reference up with each sample; the fallback takes it again in the same step."""
    feed = Feed(EKF2_HGT_REF=2, EKF2_RNG_CTRL=2)
    references = set()
    for _ in range(150):
        feed.run(0.04)
        feed.topics.distance_sensor = DistanceSensorSample(feed.ticks * 4000, 0.5, 0.1, 12.0)
        references.add(feed.estimator.ekf.height_reference if feed.time_s > 5.0 else RANGE)
    assert feed.estimator.ekf.flags.rng_hgt
    assert references == {RANGE}


@pytest.mark.parametrize("standing_s", [10.0, 10.004, 10.012, 10.032, 10.048, 10.06])
def test_the_ground_is_uncertain_by_the_steps_before_heights_refer_to_it(standing_s: float) -> None:
    """EKF2_TERR_NOISE adds (8 ms · 5 m/s)² at each step (EKF/covariance.cpp) from the first range on; the second makes
    heights count from the ground, and it grows no more. Whatever the filter predicts at once, nothing else is added."""
    feed = Feed(EKF2_HGT_REF=1)
    feed.run(standing_s)
    ekf = feed.estimator.ekf
    assert ekf.height_reference != RANGE
    certain = []
    for _ in range(100):
        feed.topics.distance_sensor = DistanceSensorSample(feed.ticks * 4000, 0.1, 0.1, 12.0)
        feed.run(0.02)
        if ekf.height_reference == RANGE:
            ekf.predict_covariance()
            certain.append(ekf.variance(cov.TERRAIN))
    assert ekf.height_reference == RANGE
    step_m2 = 0.04**2
    assert 2 * step_m2 < certain[0] - 0.01**2 < 5 * step_m2, certain
    assert certain[-1] == pytest.approx(certain[0], rel=0.3)


@pytest.mark.parametrize(("enabled", "seen"), [(1, True), (1, False), (0, True)])
def test_a_landing_target_that_is_seen_tells_the_speed(enabled: int, seen: bool) -> None:
    """It stands: its speed from the vehicle, 0.6 m/s to the south, is the vehicle's to the north (EKF2_AVEL_EN)."""
    feed = Feed(circle)
    feed.parameters.set("EKF2_AVEL_EN", enabled)
    feed.run(6.0)
    off = []
    for _ in range(250):
        _, velocity, _ = circle(feed.time_s)
        feed.topics.landing_target_pose = LandingTargetPose(
            feed.ticks * 4000,
            vx_rel=-velocity[0] - 0.6,
            vy_rel=-velocity[1],
            cov_vx_rel=0.01,
            cov_vy_rel=0.01,
            rel_vel_ekf2_valid=seen,
        )
        feed.run(0.02)
        off.append(feed.topics.vehicle_local_position.vx - circle(feed.time_s)[1][0])
    assert (off[-1] > 0.4) == bool(enabled and seen)


def test_same_sensors_same_estimate() -> None:
    ends = []
    for _ in range(2):
        feed = Feed(circle)
        feed.run(6.0)
        ends.append((feed.topics.vehicle_local_position, feed.topics.vehicle_attitude))
    assert ends[0] == ends[1]


def test_declination_comes_from_the_place_and_is_saved() -> None:
    feed = Feed()
    notifications = feed.parameters.notifications
    feed.run(3.0)
    assert feed.parameters.notifications == notifications
    assert feed.topics.vehicle_local_position.heading == pytest.approx(0.7, abs=0.03)
    assert feed.parameters["EKF2_MAG_DECL"] == pytest.approx(math.degrees(DECLINATION), abs=1e-3)


def test_without_the_place_the_saved_declination_counts() -> None:
    feed = Feed(EKF2_MAG_DECL=13.4)
    feed.gps = False
    feed.run(6.0)
    turned = math.radians(13.4) - DECLINATION
    assert feed.topics.vehicle_local_position.heading == pytest.approx(0.7 + turned, abs=0.03)
    assert feed.parameters["EKF2_MAG_DECL"] == pytest.approx(13.4)


def test_no_declination_that_is_known_turns_no_heading() -> None:
    """Nothing is fused then, for the field alone (mag_control.cpp, fuseDeclination's defaults)."""
    feed = Feed()
    feed.gps = False
    feed.run(6.0)
    ekf, mag = feed.estimator.ekf, feed.estimator.fusion.magnetometer
    ekf.apply()
    heading = ekf.state.q
    mag._fuse_declination(all_states=True, tilt=True)
    ekf.apply()
    assert ekf.state.q == heading
    feed.parameters.set("EKF2_MAG_DECL", 13.4)
    feed.run(0.5)
    ekf.apply()
    heading = ekf.state.q
    mag._fuse_declination(all_states=True, tilt=True)
    ekf.apply()
    assert ekf.state.q != heading


def test_odometry_s_variances_are_the_filter_s() -> None:
    feed = Feed()
    feed.run(6.0)
    told, own = feed.topics.odometry_variances, feed.estimator.ekf.p.diagonal()[:9].tolist()
    assert (*told.attitude, *told.velocity, *told.position) == pytest.approx(own, rel=0.1)


def test_the_field_is_never_better_known_than_a_milligauss() -> None:
    """kMagVarianceMin, while the compass is fused."""
    p = np.zeros((cov.STATES, cov.STATES))
    cov.raise_to_floor(cov.variances(p), mag=False, wind=False)
    assert p[cov.MAG_I, cov.MAG_I] == p[cov.WIND, cov.WIND] == 0.0
    cov.raise_to_floor(cov.variances(p), mag=True, wind=True)
    assert p.diagonal()[cov.MAG_I : cov.TERRAIN].tolist() == [1e-6] * 8


def test_height_does_not_drift_before_arming() -> None:
    feed = Feed()
    feed.run(5.0)
    heights = []
    for _ in range(40):
        feed.run(0.5)
        heights.append(feed.topics.vehicle_local_position.z)
    assert max(heights) - min(heights) < 0.15


def test_what_it_fuses_is_told() -> None:
    feed = Feed()
    feed.run(4.0)
    topics = feed.topics
    for aid in (topics.estimator_aid_src_gnss_pos, topics.estimator_aid_src_gnss_vel, topics.estimator_aid_src_mag):
        assert aid.fused and not aid.innovation_rejected and max(aid.test_ratio) < 1.0
    assert topics.estimator_aid_src_baro_hgt.fused
    states = topics.estimator_states
    assert states.n_states == 25 and min(states.covariances[:15]) > 0.0
    assert topics.estimator_fusion_control.gps_active[0] and topics.estimator_gps_status.checks_passed
    assert topics.estimator_status.timestamp_sample < topics.estimator_status.timestamp
