"""What becomes of a flow sensor's samples, as PX4's VehicleOpticalFlow has it."""

import math

import pytest

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.vehicle_optical_flow import FlowGatherer
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    DistanceSensorSample,
    SensorOpticalFlow,
    Topics,
    VehicleAngularVelocity,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind

SAMPLE = SensorOpticalFlow((0.02, -0.01), (0.004, 0.0, 0.001), 10_000, 200, 1.5)


def gatherer(**parameters: float) -> tuple[FlowGatherer, Topics]:
    topics = Topics()
    return FlowGatherer(topics, Parameters(VehicleKind.MULTICOPTER, parameters)), topics


def test_fast_samples_are_added_up_until_the_rate_lets_one_go() -> None:
    """SENS_FLOW_RATE is 70 Hz: two samples of 10 ms."""
    flow, topics = gatherer()
    flow.put(1_000_000, SAMPLE)
    assert topics.vehicle_optical_flow.timestamp == 0
    flow.put(1_010_000, SAMPLE._replace(pixel_flow=(0.04, -0.03), quality=101, distance_m=2.5))
    told = topics.vehicle_optical_flow
    assert (told.timestamp, told.integration_timespan_us) == (1_010_000, 20_000)
    assert (told.quality, told.distance_m) == (150, 2.0)
    assert told.pixel_flow == pytest.approx((0.06, -0.04))
    assert told.delta_angle == pytest.approx((0.008, 0.0, 0.002))
    assert (told.x, told.y) == pytest.approx((2.6, -2.0))


def test_a_gap_begins_anew_and_so_does_the_first_good_sample_after_bad_ones() -> None:
    flow, topics = gatherer()
    flow.put(1_000_000, SAMPLE)
    flow.put(1_100_000, SAMPLE._replace(quality=0))
    flow.put(1_110_000, SAMPLE)
    assert topics.vehicle_optical_flow.timestamp == 0
    flow.put(1_120_000, SAMPLE)
    assert (topics.vehicle_optical_flow.quality, topics.vehicle_optical_flow.timestamp) == (200, 1_120_000)


def test_scale_and_rotation_make_the_camera_s_angles_the_body_s() -> None:
    flow, topics = gatherer(SENS_FLOW_SCALE=1.5, SENS_FLOW_ROT=2, SENS_FLOW_RATE=200.0)
    flow.put(1_000_000, SAMPLE)
    assert topics.vehicle_optical_flow.pixel_flow == pytest.approx((0.015, 0.03))
    assert topics.vehicle_optical_flow.delta_angle == pytest.approx((0.0, 0.004, 0.001))


def test_the_vehicle_s_gyro_and_range_stand_in_for_the_sensor_s() -> None:
    flow, topics = gatherer(SENS_FLOW_RATE=200.0, SENS_FLOW_ROT=2)
    topics.vehicle_angular_velocity = VehicleAngularVelocity(1_000_000, (0.1, 0.2, 0.3))
    bare = SAMPLE._replace(delta_angle=NAN3, distance_m=NAN)
    flow.put(1_000_000, bare)
    assert topics.vehicle_optical_flow.delta_angle == pytest.approx((0.001, 0.002, 0.003))
    assert math.isnan(topics.vehicle_optical_flow.distance_m)
    topics.distance_sensor = DistanceSensorSample(1_000_000, 2.0, 0.2, 10.0)
    flow.put(1_005_000, bare)
    assert math.isnan(topics.vehicle_optical_flow.distance_m)
    topics.distance_sensor = DistanceSensorSample(1_010_000, 3.0, 0.2, 10.0)
    flow.put(1_010_000, bare)
    assert topics.vehicle_optical_flow.distance_m == 3.0
    flow.put(1_110_000, bare)
    assert math.isnan(topics.vehicle_optical_flow.distance_m)
