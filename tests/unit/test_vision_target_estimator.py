"""Where a precision landing's target is, by the mission's item and the receiver."""

import itertools
import math

import pytest

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    FiducialMarkerPosReport,
    HomePosition,
    LandingTargetPose,
    NavigatorMissionItem,
    PositionSetpoint,
    PositionSetpointTriplet,
    PrecLandStatus,
    SensorGps,
    Topics,
    Vector3,
    VehicleLandDetected,
    VehicleLocalPosition,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.autopilot.vision_target_estimator.target_filter import TargetFilter
from sitl_emu.autopilot.vision_target_estimator.vision_target_estimator import VisionTargetEstimator
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32
from sitl_emu.core.geodesy import MapProjection

LAT, LON, HOME_ALT = 47.397743, 8.545594, 489.4
PLACE = MapProjection(LAT, LON)
STEP_US, GPS_EVERY_US, SEEN_EVERY_US = 20_000, 120_000, 60_000
NORTH, EAST = 6.0, -4.0
"""Where the mission is to land."""


class Lander:
    """A vehicle that holds 8 m above the ground, and a precision landing that a mission has begun."""

    def __init__(self, **parameters: float) -> None:
        self.topics = Topics()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, parameters)
        self.estimator = VisionTargetEstimator(self.topics, self.parameters)
        self.now_us = 5_000_000
        self.error_north_m = 0.0
        """Of the receiver's position."""
        self.eph = self.epv = self.s_variance_m_s = 0.5
        self.lands_precisely = self.has_gps = True
        self.sees: Vector3 | None = None
        """Where a camera has the target: north, east and down of the vehicle."""
        self.topics.vehicle_land_detected = VehicleLandDetected(1, False, False, False)
        lat, lon = PLACE.reproject(NORTH, EAST)
        self.topics.home_position = HomePosition(valid=True, lat=LAT, lon=LON, alt=HOME_ALT)
        self.topics.navigator_mission_item = NavigatorMissionItem(
            1, 3, mavlink.MAV_CMD_NAV_LAND, lat, lon, 0.0, altitude_is_relative=True
        )

    def run(self, seconds: float) -> list[LandingTargetPose]:
        """What is told meanwhile."""
        told = []
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            now, topics = self.now_us, self.topics
            topics.vehicle_local_position = VehicleLocalPosition(now, now, True, True, True, True, 0.0, 0.0, -8.0)
            topics.prec_land_status = PrecLandStatus(now, self.lands_precisely)
            if self.has_gps and now % GPS_EVERY_US == 0:
                lat, lon = PLACE.reproject(self.error_north_m, 0.0)
                topics.sensor_gps = SensorGps(
                    now,
                    lat,
                    lon,
                    HOME_ALT + 8.0,
                    0.0,
                    0.0,
                    0.0,
                    self.eph,
                    self.epv,
                    3,
                    s_variance_m_s=self.s_variance_m_s,
                )
            if self.sees is not None and now % SEEN_EVERY_US == 0:
                topics.fiducial_marker_pos_report = FiducialMarkerPosReport(now, self.sees, (0.01, 0.01, 0.01))
            before = topics.landing_target_pose
            self.estimator.update(now)
            if topics.landing_target_pose is not before:
                told.append(topics.landing_target_pose)
        return told


def test_the_target_is_where_the_mission_lands_as_a_float32_has_it() -> None:
    """navigator_mission_item's latitude and longitude are float32: 0.4 and 0.1 m apart here."""
    lander = Lander()
    told = lander.run(3.0)
    lat, lon = PLACE.reproject(NORTH, EAST)
    north, east = PLACE.project(float32(lat), float32(lon))
    assert math.hypot(north - NORTH, east - EAST) < 0.3
    assert (told[-1].x_abs, told[-1].y_abs, told[-1].z_abs) == pytest.approx((north, east, 0.0), abs=0.01)
    gaps = {b.timestamp - a.timestamp for a, b in itertools.pairwise(told)}
    assert gaps == {STEP_US}


def test_a_receiver_that_is_off_moves_it() -> None:
    lander = Lander()
    before = lander.run(3.0)[-1]
    lander.error_north_m = 1.0
    after = lander.run(30.0)[-1]
    assert after.x_abs - before.x_abs == pytest.approx(-1.0, abs=0.1)


def test_a_receiver_that_does_not_know_its_errors_counts_with_the_least() -> None:
    """Fmaxf of PX4's processObsGNSSPosMission takes no NaN."""
    known, unknown = Lander(), Lander()
    known.eph = known.epv = 0.5  # VTE_GPS_P_NOISE
    known.s_variance_m_s = 0.3  # VTE_GPS_V_NOISE
    unknown.eph = unknown.epv = unknown.s_variance_m_s = math.nan
    assert unknown.run(3.0) == known.run(3.0) != []


@pytest.mark.parametrize(
    "parameters", [{"VTE_EN": 0}, {"VTE_POS_EN": 0}, {"VTE_TASK_MASK": 2}, {"VTE_AID_MASK": 6}], ids=str
)
def test_parameters_that_leave_nothing_to_tell(parameters: dict[str, float]) -> None:
    assert Lander(**parameters).run(2.0) == []


SEEN = (NORTH + 2.0, EAST - 1.0, 8.0)
"""By the camera, which has the target beside the place of the mission's item, and is right."""


def test_what_a_camera_sees_is_enough_where_no_mission_lands() -> None:
    lander = Lander()
    lander.topics.navigator_mission_item = NavigatorMissionItem()
    lander.sees = SEEN
    pose = lander.run(1.0)[-1]
    assert (pose.x_abs, pose.y_abs, pose.z_abs) == pytest.approx((SEEN[0], SEEN[1], 0.0), abs=1e-6)


def test_a_camera_is_turned_as_it_says() -> None:
    lander = Lander()
    lander.topics.navigator_mission_item = NavigatorMissionItem()
    lander.run(0.5)
    half = math.sqrt(0.5)  # heads east
    lander.topics.fiducial_marker_pos_report = FiducialMarkerPosReport(
        lander.now_us + STEP_US, (3.0, 1.0, 8.0), (0.01, 0.01, 0.01), (half, 0.0, 0.0, half)
    )
    pose = lander.run(0.02)[-1]
    assert (pose.x_abs, pose.y_abs, pose.z_abs) == pytest.approx((-1.0, 3.0, 0.0), abs=1e-6)


def test_a_camera_outweighs_the_receiver_as_soon_as_its_bias_is_known() -> None:
    """What they differ by is averaged for 0.6 s (BiasAverage); until then the target is where the receiver has it."""
    lander = Lander()
    by_receiver = lander.run(2.0)[-1]
    assert by_receiver.x_abs == pytest.approx(NORTH, abs=0.5)
    lander.sees = SEEN
    told = lander.run(2.0)
    found = [pose.timestamp for pose in told if abs(pose.x_abs - SEEN[0]) < 0.1]
    assert (found[0] - told[0].timestamp) * 1e-6 == pytest.approx(0.62, abs=0.08)
    assert all(abs(pose.x_abs - by_receiver.x_abs) < 0.1 for pose in told if pose.timestamp < found[0])
    assert (told[-1].x_abs, told[-1].y_abs) == pytest.approx(SEEN[:2], abs=0.05)
    lander.sees = None
    assert lander.run(10.0)[-1].x_abs == pytest.approx(SEEN[0], abs=0.1), "the receiver is corrected by the bias"


@pytest.mark.parametrize(
    ("parameters", "after_s"),
    [({"VTE_BIA_AVG_THR": 0.0}, 0.04), ({"VTE_BIA_AVG_THR": 0.001, "VTE_BIA_AVG_TOUT": 1.5}, 1.56)],
    ids=str,
)
def test_how_long_the_bias_is_averaged(parameters: dict[str, float], after_s: float) -> None:
    """Not at all; to the end where a camera that trembles never stands still."""
    lander = Lander(**parameters)
    lander.run(2.0)
    told = []
    for step in range(100):
        lander.sees = (SEEN[0] + 0.02 * (step % 2), SEEN[1], SEEN[2])
        told += lander.run(0.06)
    found = next(pose.timestamp for pose in told if abs(pose.x_abs - SEEN[0]) < 0.3)
    assert (found - told[0].timestamp) * 1e-6 == pytest.approx(after_s, abs=0.08)


def test_without_a_receiver_an_average_ends_with_what_it_has() -> None:
    lander = Lander()
    lander.run(2.0)
    lander.sees = SEEN
    lander.run(0.2)
    lander.has_gps = False
    pose = lander.run(1.5)[-1]
    assert (pose.x_abs, pose.y_abs) == pytest.approx(SEEN[:2], abs=0.05)


def test_a_descent_that_a_camera_began_is_landed_on_when_it_sees_no_more() -> None:
    """After VTE_BTOUT the filter begins anew, with the landing that is flown as its place (PrecLandTask)."""
    lander = Lander()
    lander.topics.navigator_mission_item = NavigatorMissionItem()
    lander.sees = SEEN
    lander.run(1.0)
    lat, lon = PLACE.reproject(SEEN[0], SEEN[1])
    descent = PositionSetpoint(lander.now_us, True, SetpointType.LAND, lat, lon, HOME_ALT)
    lander.topics.position_setpoint_triplet = PositionSetpointTriplet(lander.now_us, current=descent)
    lander.run(1.0)
    lander.sees = None
    told = lander.run(2.8)
    assert told[-1].timestamp == pytest.approx(lander.now_us - 800_000, abs=SEEN_EVERY_US), "VTE_TGT_TOUT"
    pose = lander.run(2.0)[-1]
    assert (pose.x_abs, pose.y_abs, pose.z_abs) == pytest.approx((SEEN[0], SEEN[1], 0.0), abs=0.01)


def test_what_is_no_number_is_not_seen() -> None:
    lander = Lander()
    lander.topics.navigator_mission_item = NavigatorMissionItem()
    lander.sees = (math.nan, 0.0, 8.0)
    assert lander.run(1.0) == []


def test_it_is_silent_without_a_landing_a_receiver_or_a_precision_landing() -> None:
    lander = Lander()
    lander.topics.navigator_mission_item = NavigatorMissionItem(1, 3, 16, LAT, LON, 10.0)
    assert lander.run(1.0) == []
    lander = Lander()
    lander.has_gps = False
    assert lander.run(1.0) == []
    lander = Lander()
    lander.lands_precisely = False
    assert lander.run(1.0) == []


def test_a_target_that_is_measured_no_more_is_told_for_two_seconds() -> None:
    """VTE_TGT_TOUT; after VTE_BTOUT, 3 s, it is looked for anew."""
    lander = Lander()
    lander.run(2.0)
    lander.has_gps = False
    assert lander.run(6.0)[-1].timestamp == pytest.approx(7_000_000 + 2_000_000, abs=GPS_EVERY_US)
    lander.has_gps = True
    assert lander.run(1.0)


def test_it_ends_on_the_ground_and_begins_again_within_a_fifth_of_a_second() -> None:
    lander = Lander()
    lander.run(1.0)
    lander.topics.vehicle_land_detected = VehicleLandDetected(lander.now_us, True, True, True)
    assert lander.run(1.0) == []
    lander.topics.vehicle_land_detected = VehicleLandDetected(lander.now_us, False, False, False)
    began_us = lander.now_us
    assert lander.run(1.0)[0].timestamp - began_us <= 200_000 + GPS_EVERY_US


def test_an_axis_weighs_by_variance_and_refuses_what_is_too_far_off() -> None:
    """Worked out by hand: gain 0.5 / (0.5 + 0.5); then 0.25 m² + 0.5 m² at 3.84 let 1.7 m pass, and not 1.8."""
    axis = TargetFilter(10.0, 0.0, 0.0, 0.5, 0.5, 1.0)
    assert axis.fuse_distance(11.0, 0.5, 3.84)
    assert axis.distance_m == pytest.approx(10.5)
    assert not axis.fuse_distance(10.5 + 1.8, 0.5, 3.84)
    assert axis.distance_m == pytest.approx(10.5)
    assert axis.fuse_distance(10.5 + 1.69, 0.5, 3.84)


def test_an_axis_learns_speed_from_distances_and_moves_by_it() -> None:
    axis = TargetFilter(20.0, 0.0, 0.0, 0.5, 0.5, 1.0)
    for step in range(1, 401):
        axis.predict(0.02, 0.0, 0.02, 0.001)
        if step % 6 == 0:
            axis.fuse_distance(20.0 - 1.5 * step * 0.02, 0.25, 3.84)
    assert axis.speed_m_s == pytest.approx(1.5, abs=0.05)
    assert axis.distance_m == pytest.approx(20.0 - 1.5 * 8.0, abs=0.1)
    axis.fuse_speed(1.0, 0.01, 100.0)
    assert axis.speed_m_s < 1.4


def test_an_axis_tells_a_bias_from_the_distance_by_a_camera() -> None:
    axis = TargetFilter(20.0, 0.0, 0.0, 0.5, 0.5, 1.0)
    for _ in range(500):
        axis.predict(0.02, 0.0, 0.02, 0.001)
        axis.fuse_distance(20.0, 0.01, 100.0)
        axis.fuse_distance(21.5, 0.25, 100.0, is_biased=True)
    assert axis.distance_m == pytest.approx(20.0, abs=0.01)
    assert axis.bias_m == pytest.approx(1.5, abs=0.05)
    axis.restart(18.0, -1.0, 0.5, 1.0)
    assert (axis.distance_m, axis.bias_m) == (18.0, -1.0)
