"""What the estimator gets of a flow sensor: its samples, added up until SENS_FLOW_RATE lets the next one go.

PX4's VehicleOpticalFlow (src/modules/sensors/vehicle_optical_flow, v1.18): SENS_FLOW_SCALE and SENS_FLOW_ROT make the
camera's angles the body's, a sensor without a gyro gets the vehicle's, one without a range that of distance_sensor.
"""

import math
from typing import Final

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.distance_sensors import DownwardSensor, distance_sensors
from sitl_emu.autopilot.topics import NAN, DistanceSensorSample, SensorOpticalFlow, Topics, Vector3, VehicleOpticalFlow

LONGEST_US: Final = 1_000_000
GAP: Final = 2
"""A sample that comes so many of its own times after the one before begins anew."""
RANGE_US: Final = 100_000
"""An older range is none (TimestampedRingBuffer::peak_first_older_than)."""
TURNS: Final = 8
"""SENS_FLOW_ROT: eighths of a turn about the vertical."""


class FlowGatherer:
    """Writer of vehicle_optical_flow."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._last_us = 0
        self._range_finder, self._range = DownwardSensor(), DistanceSensorSample()
        self._clear()

    def _clear(self) -> None:
        self._flow = (0.0, 0.0)
        self._angle: Vector3 = (0.0, 0.0, 0.0)
        self._timespan_us = self._quality = self._count = 0
        self._ranges_m: list[float] = []

    def put(self, now_us: int, sample: SensorOpticalFlow) -> None:
        """One more sample; a time that is none, or flow that is no number, is not kept."""
        timespan_us, (flow_x, flow_y) = sample.integration_timespan_us, sample.pixel_flow
        if not (0 < timespan_us <= LONGEST_US and math.isfinite(flow_x + flow_y)):
            return
        well_again = self._count > 0 and sample.quality > 0 and self._quality == 0
        if now_us >= self._last_us + GAP * timespan_us or well_again:
            self._clear()
        self._last_us = now_us
        self._flow = (self._flow[0] + flow_x, self._flow[1] + flow_y)
        (x, y, z), (turn_x, turn_y, turn_z) = self._angle, self._turned(sample)
        self._angle = (x + turn_x, y + turn_y, z + turn_z)
        range_m = sample.distance_m if math.isfinite(sample.distance_m) else self._range_m(now_us)
        if math.isfinite(range_m):
            self._ranges_m.append(range_m)
        self._timespan_us += timespan_us
        self._quality += sample.quality
        self._count += 1
        rate_hz = float(self._parameters["SENS_FLOW_RATE"])
        if rate_hz > 0.0 and self._timespan_us < 1e6 / rate_hz:
            return
        self._publish(now_us, sample.device_id)
        self._clear()

    def _turned(self, sample: SensorOpticalFlow) -> Vector3:
        """How far the vehicle has turned: by the sensor's own gyro, else by the vehicle's."""
        x, y, z = sample.delta_angle
        if math.isfinite(x + y + z):
            return *self._rotated(x, y), z
        dt_s = sample.integration_timespan_us * 1e-6
        x, y, z = self._topics.vehicle_angular_velocity.xyz
        return x * dt_s, y * dt_s, z * dt_s

    def _rotated(self, x: float, y: float) -> tuple[float, float]:
        eighths = int(self._parameters["SENS_FLOW_ROT"]) % TURNS
        if not eighths:
            return x, y
        cosine, sine = math.cos(eighths * math.tau / TURNS), math.sin(eighths * math.tau / TURNS)
        return cosine * x - sine * y, sine * x + cosine * y

    def _range_m(self, now_us: int) -> float:
        """Of the sensor that looks down, the last within its range; NaN of none."""
        sample = self._range_finder.new_sample(now_us, distance_sensors(self._topics))
        if sample is not None and sample.min_distance <= sample.current_distance <= sample.max_distance:
            self._range = sample
        recent = 0 < self._range.timestamp <= now_us < self._range.timestamp + RANGE_US
        return self._range.current_distance if recent else NAN

    def _publish(self, now_us: int, device_id: int) -> None:
        value = self._parameters
        limits = (float(value["SENS_FLOW_MAXR"]), float(value["SENS_FLOW_MINHGT"]), float(value["SENS_FLOW_MAXHGT"]))
        scale, dt_s = float(self._parameters["SENS_FLOW_SCALE"]), self._timespan_us * 1e-6
        flow_x, flow_y = self._rotated(self._flow[0] * scale, self._flow[1] * scale)
        self._topics.vehicle_optical_flow = VehicleOpticalFlow(
            now_us,
            (flow_x - self._angle[0]) / dt_s,
            (flow_y - self._angle[1]) / dt_s,
            self._quality // self._count,
            self._timespan_us,
            (flow_x, flow_y),
            self._angle,
            sum(self._ranges_m) / len(self._ranges_m) if self._ranges_m else NAN,
            device_id,
            *limits,
        )
