"""External vision: the filter flies by poses from outside, as EKF2_EV_CTRL says, with and without GPS."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.estimator.aid_sources.ev_vel import VisionVelocity
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.estimator import Settings
from sitl_emu.autopilot.estimator.resets import move_origin
from sitl_emu.autopilot.estimator.samples import ImuSample, VisionSample, VisionUpdate
from sitl_emu.autopilot.mavlink.services import odometry
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    FRAME_BODY_FRD,
    FRAME_FRD,
    FRAME_NED,
    FRAME_UNKNOWN,
    NAN3,
    DistanceSensorSample,
    VehicleOdometry,
    VehicleOpticalFlow,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import euler, quaternion

from .estimator_feed import LAT, Feed, standing
from .mavlink_peer import Peer
from .test_estimator import circle

EVERY_TICKS = 8
"""31 Hz."""
WITHOUT_GPS = {"EKF2_GPS_CTRL": 0, "EKF2_EV_CTRL": 15}


class Seen(Feed):
    """A feed beside which a vision system looks at the vehicle."""

    def __init__(self, path: Any = circle, **parameters: float) -> None:
        super().__init__(path, **parameters)
        self.vision = True
        self.frame = self.velocity_frame = FRAME_NED
        self.offset = (0.0, 0.0, 0.0)
        self.turned = 0.0
        self.resets = 0
        self.quality = 100

    def step(self) -> None:
        super().step()
        if self.vision and self.ticks % EVERY_TICKS == 0:
            (x, y, z), (vx, vy, vz), _ = self.path(self.time_s)
            cosine, sine = math.cos(self.turned), math.sin(self.turned)
            x, y, vx, vy = (
                cosine * x - sine * y,
                sine * x + cosine * y,
                cosine * vx - sine * vy,
                sine * vx + cosine * vy,
            )
            ox, oy, oz = self.offset
            self.topics.vehicle_visual_odometry = VehicleOdometry(
                self.ticks * 4000,
                self.frame,
                (x + ox, y + oy, z + oz),
                quaternion(0.0, 0.0, self.yaw + self.turned),
                self.velocity_frame,
                (vx, vy, vz),
                reset_counter=self.resets,
                quality=self.quality,
            )

    def error_m(self) -> float:
        (x, y, _), _, _ = self.path(self.time_s)
        local = self.topics.vehicle_local_position
        return math.hypot(local.x - x - self.offset[0], local.y - y - self.offset[1])


def test_without_gps_it_knows_where_it_is_but_not_where_on_earth() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(30.0)
    local = feed.topics.vehicle_local_position
    assert local.xy_valid and local.v_xy_valid
    assert math.isnan(local.ref_lat)
    assert not feed.topics.vehicle_global_position.valid
    assert feed.error_m() < 0.3
    assert local.heading == pytest.approx(feed.yaw, abs=0.05)


@pytest.mark.parametrize("control", [0, 8])
def test_what_is_not_wanted_is_not_fused(control: int) -> None:
    feed = Seen(EKF2_GPS_CTRL=0, EKF2_EV_CTRL=control)
    feed.run(8.0)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_when_vision_ends_so_does_the_position() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(10.0)
    feed.vision = False
    feed.run(2.0)
    assert feed.topics.vehicle_local_position.xy_valid
    feed.run(5.0)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_a_vision_system_that_says_it_jumped_takes_the_position_along() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(10.0)
    counter = feed.topics.vehicle_local_position.xy_reset_counter
    feed.offset, feed.resets = (50.0, -20.0, 0.0), 1
    feed.run(0.5)
    assert feed.topics.vehicle_local_position.xy_reset_counter == counter + 1
    assert feed.error_m() < 0.3


def test_a_jump_that_is_not_told_is_refused_at_first() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(10.0)
    feed.offset = (50.0, 0.0, 0.0)
    feed.run(0.5)
    assert feed.error_m() > 40.0
    feed.run(8.0)
    assert feed.error_m() < 1.0


def test_gps_that_comes_later_gives_a_place_on_earth_to_the_same_frame() -> None:
    feed = Seen(EKF2_EV_CTRL=15)
    feed.gps = False
    feed.run(12.0)
    before = feed.topics.vehicle_local_position
    feed.gps = True
    feed.run(15.0)
    local = feed.topics.vehicle_local_position
    assert math.isfinite(local.ref_lat) and feed.topics.vehicle_global_position.valid
    assert local.ref_lat == pytest.approx(LAT, abs=3e-5)
    assert not math.isfinite(before.ref_lat)
    assert feed.error_m() < 1.5


def test_gps_stays_the_position_where_there_is_gps() -> None:
    feed = Seen(EKF2_EV_CTRL=15)
    feed.run(3.0)
    feed.offset = (30.0, 0.0, 0.0)
    feed.run(10.0)
    (x, y, _), _, _ = feed.path(feed.time_s)
    local = feed.topics.vehicle_local_position
    assert math.hypot(local.x - x, local.y - y) < 1.5


def test_a_frame_of_unknown_heading_is_turned_to_the_filters_or_the_filter_to_it() -> None:
    feed = Seen(EKF2_GPS_CTRL=0, EKF2_EV_CTRL=5)
    feed.frame = feed.velocity_frame = FRAME_FRD
    feed.turned = 1.0
    feed.run(20.0)
    # The heading, by compass, is a few hundredths off, at 40 m from where it began.
    assert feed.error_m() < 3.0
    feed = Seen(**WITHOUT_GPS)
    feed.frame = feed.velocity_frame = FRAME_FRD
    feed.turned = 1.0
    feed.run(20.0)
    assert feed.topics.vehicle_local_position.heading == pytest.approx(feed.yaw + 1.0, abs=0.1)


@pytest.mark.parametrize(("control", "pose", "velocity", "north"), [
    (4, FRAME_NED, FRAME_NED, True),
    (4, FRAME_NED, FRAME_BODY_FRD, False),
    (4, FRAME_FRD, FRAME_NED, True),
    (1, FRAME_NED, FRAME_BODY_FRD, True),
    (1, FRAME_FRD, FRAME_NED, False),
])  # fmt: skip
def test_only_what_is_fused_in_ned_shows_where_north_is(control: int, pose: int, velocity: int, north: bool) -> None:
    """Position and velocity have a frame each (isNorthEastAidingActive in EKF/estimator_interface.cpp)."""
    feed = Seen(standing, EKF2_GPS_CTRL=0, EKF2_EV_CTRL=control)
    feed.frame, feed.velocity_frame = pose, velocity
    feed.run(5.0)
    flags = feed.estimator.ekf.flags
    assert (flags.ev_pos, flags.ev_vel) == (control == 1, control == 4)
    assert feed.estimator.ekf.north_east_aiding is north


def test_without_any_height_the_third_axis_of_a_velocity_is_taken_for_down() -> None:
    """Even where it is the body's, which is a flaw of PX4: resetVerticalVelocity (ev_vel.h) is not virtual."""
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {"EKF2_EV_CTRL": 4})))
    imu = ImuSample(20_000_000, (0.0, 0.0, 0.0), (0.0, 0.0, -0.0785), 0.008)
    ekf.begin_step(imu)
    ekf.state.set_attitude(quaternion(0.0, -0.3, 0.0))
    ekf.flags.tilt_align, vision = True, VisionVelocity(ekf)
    sample = VisionSample(20_000_000, vel=(4.0, 0.0, 0.5), velocity_var=(0.01,) * 3, vel_frame=FRAME_BODY_FRD)
    update = VisionUpdate(sample, None, enabled=True, starting=True, jumped=False, good=True)
    vision.control(imu, update)
    assert ekf.flags.ev_vel and ekf.state.vd == pytest.approx(4.0 * math.sin(0.3) + 0.5 * math.cos(0.3))
    vision.control(imu, update)
    assert ekf.state.vd == pytest.approx(0.5)


def test_height_by_vision() -> None:
    feed = Seen(**WITHOUT_GPS, EKF2_HGT_REF=3)
    feed.offset = (0.0, 0.0, -100.0)
    feed.run(20.0)
    (_, _, z), _, _ = feed.path(feed.time_s)
    assert feed.topics.vehicle_local_position.z == pytest.approx(z - 100.0, abs=0.3)


def test_a_height_by_vision_alone_that_jumps_takes_the_origin_s_height_off_twice() -> None:
    """PX4's sign of the bias, which holds the origin's height from then on (ev_height_control.cpp)."""
    feed = Seen(**WITHOUT_GPS, EKF2_HGT_REF=3, EKF2_BARO_CTRL=0)
    feed.run(10.0)
    move_origin(feed.estimator.ekf, 47.0, 8.0, 480.0)
    feed.run(1.0)
    before = feed.topics.vehicle_local_position
    feed.offset = (0.0, 0.0, -20.0)
    feed.run(10.0)
    after = feed.topics.vehicle_local_position
    assert after.z_reset_counter > before.z_reset_counter
    assert after.z - before.z == pytest.approx(960.0 - 20.0, abs=5.0)


def test_a_bias_of_positions_is_not_known_at_first() -> None:
    """BiasEstimator's _state_var, until it is reset for the first time; that of a height is (HeightBiasEstimator)."""
    ekf = Seen(**WITHOUT_GPS).estimator.ekf
    assert [bias.variance for bias in (*ekf.ev_pos_bias, ekf.ev_hgt_bias)] == [0.1, 0.1, 0.0]


def test_too_low_a_quality_is_refused() -> None:
    feed = Seen(**WITHOUT_GPS, EKF2_EV_QMIN=50)
    feed.quality = 10
    feed.run(8.0)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_nonsense_breaks_nothing() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(5.0)
    feed.vision = False
    for value in (math.nan, math.inf, -math.inf, 1e38):
        for frame in (FRAME_UNKNOWN, FRAME_NED, FRAME_FRD, FRAME_BODY_FRD):
            three = (value, value, value)
            feed.topics.vehicle_visual_odometry = VehicleOdometry(
                1, frame, three, (value,) * 4, frame, three, three, three, three
            )
            feed.run(0.1)
    local = feed.topics.vehicle_local_position
    assert all(math.isfinite(value) for value in (local.x, local.y, local.z, local.vx, local.vy, local.vz))


# --- messages -----------------------------------------------------------------------------------------------


def nothing(count: int) -> list[float]:
    return [math.nan] + [0.0] * (count - 1)


def test_messages_become_poses_in_ned() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_vision_position_estimate_message(7, 1.0, 2.0, -3.0, 0.1, 0.2, 0.3, nothing(21)))
    sample = peer.topics.vehicle_visual_odometry
    assert sample.position == (1.0, 2.0, -3.0) and euler(sample.q) == pytest.approx((0.1, 0.2, 0.3), abs=1e-5)
    peer.send(mavlink.MAVLink_vision_speed_estimate_message(7, 1.0, 2.0, 3.0, [0.25] + [0.0] * 8))
    assert peer.topics.vehicle_visual_odometry is sample, "of which PX4 v1.18 knows nothing"


def odometry_message(frame: int, child: int, estimator: int = 2) -> Any:
    return mavlink.MAVLink_odometry_message(
        0, frame, child, 1.0, 2.0, 3.0, (1.0, 0.0, 0.0, 0.0), 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, nothing(21), nothing(21),
        0, estimator, 80,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("frame", "child", "expected"),
    [
        (1, 12, (FRAME_NED, (1.0, 2.0, 3.0), FRAME_BODY_FRD, (4.0, 5.0, 6.0))),
        (4, 4, (FRAME_NED, (2.0, 1.0, -3.0), FRAME_NED, (5.0, 4.0, -6.0))),
        (20, 20, (FRAME_FRD, (1.0, 2.0, 3.0), FRAME_FRD, (4.0, 5.0, 6.0))),
        (21, 21, (FRAME_FRD, (1.0, -2.0, -3.0), FRAME_FRD, (4.0, -5.0, -6.0))),
        (0, 12, (FRAME_UNKNOWN, NAN3, FRAME_BODY_FRD, (4.0, 5.0, 6.0))),
    ],
)
def test_frames_of_odometry(frame: int, child: int, expected: tuple[Any, ...]) -> None:
    sample = odometry.of_odometry(1, odometry_message(frame, child))
    got = (sample.pose_frame, sample.position, sample.velocity_frame, sample.velocity)
    assert repr(got) == repr(expected)


def test_an_attitude_is_taken_as_it_comes_and_variances_go_with_their_axes() -> None:
    """PX4 turns places and velocities of other frames, and leaves the quaternion (handle_message_odometry)."""
    message = odometry_message(mavlink.MAV_FRAME_LOCAL_ENU, mavlink.MAV_FRAME_LOCAL_ENU)
    message.q = [0.6, 0.0, 0.0, 0.8]
    message.pose_covariance = message.velocity_covariance = [float(place) for place in range(21)]
    sample = odometry.of_odometry(1, message)
    assert sample.q == (0.6, 0.0, 0.0, 0.8)
    assert sample.position_variance == sample.velocity_variance == (6.0, 0.0, 11.0)
    assert sample.orientation_variance == (15.0, 18.0, 20.0)
    message.estimator_type = mavlink.MAV_ESTIMATOR_TYPE_NAIVE
    sample = odometry.of_odometry(1, message)
    assert all(map(math.isnan, (*sample.position_variance, *sample.orientation_variance, *sample.velocity_variance)))
    message.x = math.nan
    sample = odometry.of_odometry(1, message)
    assert (sample.pose_frame, sample.velocity_frame, sample.q[0]) == (FRAME_UNKNOWN, FRAME_NED, 0.6)


def test_odometry_of_other_estimators_is_refused() -> None:
    peer = Peer()
    before = peer.topics.vehicle_visual_odometry
    peer.send(odometry_message(1, 12, mavlink.MAV_ESTIMATOR_TYPE_GPS_INS))
    assert peer.topics.vehicle_visual_odometry is before
    assert [(text.severity, text.text) for text in peer.texts.recent] == [
        (mavlink.MAV_SEVERITY_CRITICAL, "ODOMETRY: estimator_type 5 unsupported\t")
    ]


def test_what_the_filter_does_not_look_at() -> None:
    peer = Peer()
    before = peer.topics.vehicle_visual_odometry
    peer.send(mavlink.MAVLink_att_pos_mocap_message(0, (1.0, 0.0, 0.0, 0.0), 1.0, 2.0, 3.0))
    peer.send(odometry_message(1, 12, mavlink.MAV_ESTIMATOR_TYPE_MOCAP))
    assert peer.topics.vehicle_visual_odometry is before


def test_a_place_on_earth_can_be_given_to_a_vehicle_that_sees_alone() -> None:
    feed = Seen(**WITHOUT_GPS)
    feed.run(10.0)
    resets = feed.topics.vehicle_local_position.xy_reset_counter
    move_origin(feed.estimator.ekf, 47.0, 8.0, 500.0)
    feed.run(1.0)
    local, place = feed.topics.vehicle_local_position, feed.topics.vehicle_global_position
    assert (local.xy_reset_counter, local.delta_xy) == (resets + 1, (0.0, 0.0))
    (x, _, z), _, _ = feed.path(feed.time_s)
    assert place.valid
    assert (place.lat - 47.0) * 111_195.0 == pytest.approx(x, abs=0.5)
    assert place.alt == pytest.approx(500.0 - z, abs=1.0)
    assert feed.error_m() < 0.3


def test_set_gps_global_origin_is_the_command() -> None:
    given: list[Any] = []
    peer = Peer(lambda now_us, command: given.append(command))
    peer.now_us = 1_000_000
    peer.fly()
    said = peer.send(mavlink.MAVLink_set_gps_global_origin_message(1, 470000000, 80000000, 500_000))
    assert [(command.command, command.param5, command.param6, command.param7) for command in given] == [
        (611, pytest.approx(47.0), pytest.approx(8.0), 500.0)
    ]
    assert said == [], "the stream tells the new one, once it is there"
    for other in (0, 2):
        assert peer.send(mavlink.MAVLink_set_gps_global_origin_message(other, 0, 0, 0)) == []
    assert len(given) == 1


# --- optical flow -------------------------------------------------------------------------------------------


class Flowing(Feed):
    """A feed with a camera that sees the ground move, and a range sensor; no GPS."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(circle, **({"EKF2_GPS_CTRL": 0} | parameters))
        self.flow = True
        self.quality = 255

    def step(self) -> None:
        super().step()
        (_, _, z), (vx, vy, _), _ = self.path(self.time_s)
        height_m = max(-z + 0.3, 0.3)
        if self.ticks % 12 == 0:
            self.topics.distance_sensor = DistanceSensorSample(self.ticks * 4000, height_m, 0.1, 40.0)
        if self.flow and self.ticks % 12 == 6:
            cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
            forward, right = cosine * vx + sine * vy, -sine * vx + cosine * vy
            self.topics.vehicle_optical_flow = VehicleOpticalFlow(
                self.ticks * 4000,
                -right / height_m,
                forward / height_m,
                self.quality,
                48_000,
                (-right / height_m * 0.048, forward / height_m * 0.048),
            )


def test_flow_gives_a_velocity_and_a_place_that_drifts_slowly() -> None:
    feed = Flowing()
    feed.run(25.0)
    (x, y, _), (vx, vy, _), _ = feed.path(feed.time_s)
    local = feed.topics.vehicle_local_position
    assert local.xy_valid and local.v_xy_valid and math.isnan(local.ref_lat)
    assert math.hypot(local.vx - vx, local.vy - vy) < 0.7
    assert math.hypot(local.x - x, local.y - y) < 6.0


def test_a_camera_that_is_tilted_too_far_sets_the_velocity_where_there_is_nothing_else() -> None:
    """It is not fused then; a reset after a second asks for quality and rate alone (controlOpticalFlowFusion)."""
    feed = Flowing()
    feed.run(20.0)
    ekf, fused_us = feed.estimator.ekf, feed.topics.estimator_aid_src_optical_flow.time_last_fuse
    assert ekf.flags.opt_flow and fused_us
    resets = ekf.resets.vel_ne
    for _ in range(300):
        ekf.state.set_attitude(quaternion(0.9, 0.0, feed.yaw))
        feed.step()
        if ekf.resets.vel_ne > resets:
            break
    assert ekf.flags.opt_flow and ekf.resets.vel_ne == resets + 1


@pytest.mark.parametrize("parameters", [{"EKF2_OF_CTRL": 0}, {"EKF2_OF_QMIN": 256, "EKF2_OF_QMIN_GND": 256}])
def test_flow_that_is_not_wanted_is_not_fused(parameters: dict[str, float]) -> None:
    feed = Flowing(**parameters)
    feed.run(8.0)
    assert not feed.topics.vehicle_local_position.xy_valid


def flow_message(x: float, y: float, turn: float = 0.0, time_us: int = 50_000) -> Any:
    return mavlink.MAVLink_optical_flow_rad_message(0, 0, time_us, x, y, turn, turn, 0.0, 0, 200, 0, -1.0)


def test_the_sensors_own_rotation_is_taken_off() -> None:
    peer = Peer()
    peer.send(flow_message(0.02, 0.03, 0.01))
    flow = peer.topics.vehicle_optical_flow
    assert (flow.x, flow.y) == pytest.approx((0.2, 0.4))
    assert flow.quality == 200
    for nonsense in (flow_message(math.nan, 0.0), flow_message(0.1, math.inf), flow_message(0.1, 0.1, time_us=0)):
        peer.send(nonsense)
        assert peer.topics.vehicle_optical_flow is flow
    peer.send(flow_message(0.02, 0.03, math.nan))
    assert peer.topics.vehicle_optical_flow.x == pytest.approx(0.4)
