"""Land detector: a multicopter that comes down, and a rover that never leaves the ground."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, TakeoffState
from sitl_emu.autopilot.land_detector.land_detector import LandDetector
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    HoverThrustEstimate,
    PositionSetpoint,
    PositionSetpointTriplet,
    SensorCombined,
    TakeoffStatus,
    Topics,
    TrajectorySetpoint,
    VehicleAcceleration,
    VehicleGlobalPosition,
    VehicleLocalPosition,
    VehicleThrustSetpoint,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from tests.typed import now

STEP_US = 20_000
NAN = float("nan")


class Descending:
    """A multicopter that is told to descend at 0.7 m/s."""

    def __init__(self) -> None:
        self.topics = Topics()
        self.detector = LandDetector(self.topics, Parameters(VehicleKind.MULTICOPTER), VehicleKind.MULTICOPTER.traits)
        self.now_us = 0
        topics = self.topics
        topics.actuator_armed = ActuatorArmed(True)
        topics.takeoff_status = TakeoffStatus(0, int(TakeoffState.FLIGHT))
        topics.trajectory_setpoint = TrajectorySetpoint(0, velocity=(NAN, NAN, 0.7))
        self.moves(0.7, 0.5)
        self.run(1.0)

    def moves(self, vz: float, thrust: float, vx: float = 0.0, dist_bottom: float | None = None) -> None:
        local = VehicleLocalPosition(0, 0, True, True, True, True, vx=vx, vz=vz, z_deriv=vz)
        if dist_bottom is not None:
            local = local._replace(dist_bottom=dist_bottom, dist_bottom_valid=True, dist_bottom_sensor_bitfield=1)
        self.topics.vehicle_local_position = local
        self.topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(self.now_us, (0.0, 0.0, -thrust))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            self.topics.vehicle_thrust_setpoint = self.topics.vehicle_thrust_setpoint._replace(timestamp=self.now_us)
            self.detector.update(self.now_us)

    def state(self) -> tuple[bool, bool, bool]:
        land = self.topics.vehicle_land_detected
        return land.ground_contact, land.maybe_landed, land.landed


def test_disarmed_is_landed() -> None:
    topics = Topics()
    LandDetector(topics, Parameters(VehicleKind.MULTICOPTER), VehicleKind.MULTICOPTER.traits).update(0)
    assert topics.vehicle_land_detected.landed


def test_at_rest_is_who_has_neither_turned_nor_shaken_for_a_second_before_it_landed_either() -> None:
    vehicle = Descending()
    vehicle.topics.vehicle_angular_velocity = vehicle.topics.vehicle_angular_velocity._replace(xyz=(0.0, 0.0, 0.1))
    vehicle.run(0.1)
    vehicle.topics.vehicle_angular_velocity = vehicle.topics.vehicle_angular_velocity._replace(xyz=(0.0, 0.0, 0.0))
    vehicle.topics.actuator_armed = ActuatorArmed(False)
    vehicle.run(0.9)
    land = now(vehicle.topics).vehicle_land_detected
    assert land.landed and not land.at_rest
    vehicle.run(0.2)
    assert now(vehicle.topics).vehicle_land_detected.at_rest


def test_flying_is_not_landed() -> None:
    assert Descending().state() == (False, False, False)


def test_contact_then_maybe_then_landed_each_in_its_time() -> None:
    vehicle = Descending()
    vehicle.moves(0.0, 0.2)
    vehicle.run(0.34)
    assert vehicle.state() == (False, False, False)
    vehicle.run(0.02)
    assert vehicle.state() == (True, False, False), "little thrust, and it has stopped"
    vehicle.run(2.0)
    assert vehicle.state() == (True, False, False), "thrust is not minimal"
    vehicle.moves(0.0, 0.12)
    vehicle.run(0.34)
    assert vehicle.state() == (True, False, False)
    vehicle.run(0.02)
    assert vehicle.state() == (True, True, False)
    vehicle.run(0.34)
    assert vehicle.state() == (True, True, True)


def test_a_hover_thrust_that_is_known_lets_more_thrust_count_as_low() -> None:
    vehicle = Descending()
    vehicle.moves(0.0, 0.3)
    vehicle.run(1.0)
    assert vehicle.state() == (False, False, False)
    vehicle.topics.hover_thrust_estimate = HoverThrustEstimate(0, 0.5, valid=True)
    vehicle.run(1.0)
    assert vehicle.state() == (True, False, False)


def test_who_is_not_told_to_descend_does_not_land() -> None:
    vehicle = Descending()
    vehicle.topics.trajectory_setpoint = TrajectorySetpoint(0, velocity=(NAN, NAN, 0.0))
    vehicle.moves(0.0, 0.0)
    vehicle.run(5.0)
    assert vehicle.state() == (False, False, False)


def test_out_of_the_range_of_its_sensor_it_takes_three_times_as_long() -> None:
    vehicle = Descending()
    vehicle.moves(0.7, 0.5, dist_bottom=0.8)
    vehicle.run(0.1)
    vehicle.moves(0.0, 0.12)
    vehicle.run(2.98)
    assert vehicle.state() == (True, True, False)
    vehicle.run(0.1)
    assert vehicle.state() == (True, True, True)


def test_high_above_measured_ground_it_never_lands() -> None:
    vehicle = Descending()
    vehicle.moves(0.0, 0.12, dist_bottom=5.0)
    vehicle.run(5.0)
    assert vehicle.state() == (False, False, False)


@pytest.mark.parametrize("motion", [{"vz": 0.5}, {"vz": 0.0, "vx": 2.0}])
def test_motion_forbids_it(motion: dict[str, float]) -> None:
    vehicle = Descending()
    vehicle.moves(thrust=0.12, **motion)
    vehicle.run(5.0)
    assert vehicle.state() == (False, False, False)


def test_a_height_that_stays_counts_where_the_vertical_velocity_is_wrong() -> None:
    vehicle = Descending()
    vehicle.moves(0.5, 0.12)
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(z_deriv=0.0)
    vehicle.run(2.0)
    assert vehicle.state() == (True, True, True)


def test_a_distance_that_no_range_finder_measures_is_not_asked() -> None:
    """By optical flow the ground is known from how fast it moves."""
    vehicle = Descending()
    vehicle.moves(0.0, 0.12, dist_bottom=5.0)
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(
        dist_bottom_sensor_bitfield=2
    )
    vehicle.run(2.0)
    assert vehicle.state() == (True, True, True)


def test_a_disarmed_vehicle_that_is_told_nothing_does_not_descend() -> None:
    vehicle = Descending()
    assert vehicle.topics.vehicle_land_detected.in_descend
    vehicle.topics.actuator_armed = ActuatorArmed(False)
    vehicle.topics.trajectory_setpoint = TrajectorySetpoint()
    vehicle.run(0.1)
    assert not now(vehicle.topics.vehicle_land_detected.in_descend)


def test_waiting_for_takeoff_is_landed_and_thrust_ends_that() -> None:
    topics = Topics()
    detector = LandDetector(topics, Parameters(VehicleKind.MULTICOPTER), VehicleKind.MULTICOPTER.traits)
    topics.actuator_armed = ActuatorArmed(True)
    topics.vehicle_local_position = VehicleLocalPosition(0, 0, True, True, True, True)
    topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(20_000)
    detector.update(20_000)
    assert topics.vehicle_land_detected.landed
    topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(40_000, (0.0, 0.0, -0.3))
    detector.update(40_000)
    assert not topics.vehicle_land_detected.landed


@pytest.mark.parametrize(("age_us", "thrust", "is_low"), [(0, 0.0, True), (0, math.nan, True), (1_000_000, 0.0, False)])
def test_a_thrust_that_nobody_asks_for_any_more_is_not_low(age_us: int, thrust: float, is_low: bool) -> None:
    """MulticopterLandDetector.cpp, _update_topics and _get_ground_contact_state: disarmed, too."""
    topics = Topics()
    detector = LandDetector(topics, Parameters(VehicleKind.MULTICOPTER), VehicleKind.MULTICOPTER.traits)
    topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(10_000_000 - age_us, (0.0, 0.0, -thrust))
    detector.update(10_000_000)
    assert topics.vehicle_land_detected.has_low_throttle is is_low


def rover(nav_state: NavState, north_deg: float = 0.0) -> tuple[Topics, LandDetector]:
    topics = Topics()
    topics.vehicle_status = topics.vehicle_status._replace(
        vehicle_kind=VehicleKind.ROVER_ACKERMANN, nav_state=nav_state
    )
    topics.vehicle_global_position = VehicleGlobalPosition(0, 0, 47.0 + north_deg, 8.0, 0.0, 0.0, True, True)
    home = PositionSetpoint(0, True, 0, 47.0, 8.0, 0.0)
    topics.position_setpoint_triplet = PositionSetpointTriplet(0, current=home)
    return topics, LandDetector(topics, Parameters(VehicleKind.ROVER_ACKERMANN), VehicleKind.ROVER_ACKERMANN.traits)


def test_a_rover_is_in_the_air_half_a_second_after_arming() -> None:
    topics, detector = rover(NavState.AUTO_LOITER)
    detector.update(0)
    assert topics.vehicle_land_detected.landed
    topics.actuator_armed = ActuatorArmed(True)
    detector.update(1_000_000)
    detector.update(1_480_000)
    assert topics.vehicle_land_detected.landed
    detector.update(1_500_000)
    assert not topics.vehicle_land_detected.landed


@pytest.mark.parametrize(
    ("nav_state", "north_deg", "landed"),
    [
        (NavState.AUTO_LAND, 0.01, True),
        (NavState.AUTO_RTL, 0.01, False),
        (NavState.AUTO_RTL, 1e-6, True),
        (NavState.AUTO_MISSION, 1e-6, False),
    ],
)
def test_a_rover_lands_when_told_to_or_back_home(nav_state: NavState, north_deg: float, landed: bool) -> None:
    topics, detector = rover(nav_state, north_deg)
    topics.actuator_armed = ActuatorArmed(True)
    detector.update(9_500_000)
    detector.update(10_000_000)
    assert topics.vehicle_land_detected.landed is landed


def test_a_disarmed_rover_that_is_to_return_counts_as_in_the_air() -> None:
    topics, detector = rover(NavState.AUTO_RTL, 0.01)
    detector.update(0)
    assert topics.vehicle_land_detected.landed
    detector.update(500_000)
    assert not topics.vehicle_land_detected.landed


def test_it_falls_by_the_filtered_acceleration_for_a_third_of_a_second() -> None:
    """MulticopterLandDetector::_get_freefall_state reads vehicle_acceleration, and no raw sample."""
    vehicle = Descending()
    vehicle.topics.sensor_combined = SensorCombined(accelerometer_m_s2=(0.0, 0.0, -0.5))
    vehicle.run(1.0)
    assert not now(vehicle.topics).vehicle_land_detected.freefall
    vehicle.topics.vehicle_acceleration = VehicleAcceleration(0, 0, (0.0, 0.0, -1.9))
    vehicle.run(0.28)
    assert not now(vehicle.topics).vehicle_land_detected.freefall
    vehicle.run(0.06)
    assert now(vehicle.topics).vehicle_land_detected.freefall
