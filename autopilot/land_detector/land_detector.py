"""Land detector: whether the vehicle stands on the ground, and rests there.

PX4's LandDetector (src/modules/land_detector, v1.18): what all kinds of it share. It publishes once a second, and when
something has changed.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from sitl_emu.autopilot.land_detector.flight_time import FlightTime
from sitl_emu.autopilot.land_detector.multicopter import MulticopterLandDetector
from sitl_emu.autopilot.land_detector.rover import RoverLandDetector
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleLandDetected
from sitl_emu.autopilot.vehicle_kind import Traits

PUBLISHED_AFTER_US: Final = 1_000_000
AT_REST_US: Final = 1_000_000
MOVING_RAD_S = math.radians(3.0)
SHAKING_GYRO: Final = 0.02
SHAKING_ACCEL: Final = 1.2
"""Vibration metrics of vehicle_imu_status beyond which a vehicle is not at rest (LandDetector::UpdateVehicleAtRest)."""


class Detector(Protocol):
    """What a kind of vehicle finds out for itself."""

    def update(self, now_us: int) -> tuple[bool, ...]:
        """landed, maybe_landed, ground_contact, freefall and in_ground_effect, at 83 Hz."""
        ...

    def details(self, now_us: int) -> tuple[bool, ...]:
        """What follows at_rest in vehicle_land_detected, or nothing."""
        ...


DETECTORS: Mapping[str, Callable[[Topics, Parameters], Detector]] = {
    "multicopter": MulticopterLandDetector,
    "rover": RoverLandDetector,
}
"""By Traits.land_detector."""


class LandDetector:
    """Writer of vehicle_land_detected."""

    def __init__(self, topics: Topics, parameters: Parameters, traits: Traits) -> None:
        self._topics = topics
        self._detector = DETECTORS[traits.land_detector](topics, parameters)
        self._flight_time = FlightTime(parameters)
        self._moved_us = 0

    def update(self, now_us: int) -> None:
        """Run at 83 Hz."""
        topics = self._topics
        last = topics.vehicle_land_detected
        self._flight_time.update(now_us, armed=topics.actuator_armed.armed, landed=last.landed)
        states = self._detector.update(now_us)
        rests = self._rests(now_us)
        states = (*states, states[0] and rests)
        if last.timestamp == 0 or now_us - last.timestamp >= PUBLISHED_AFTER_US or states != last[1:7]:
            topics.vehicle_land_detected = VehicleLandDetected(now_us, *states, *self._detector.details(now_us))

    def _rests(self, now_us: int) -> bool:
        """It has neither turned nor shaken for a second; to be asked in flight, too."""
        p, q, r = self._topics.vehicle_angular_velocity.xyz
        imu = self._topics.vehicle_imu_status
        if p * p + q * q + r * r > MOVING_RAD_S * MOVING_RAD_S:
            self._moved_us = now_us
        elif imu.gyro_vibration_metric > SHAKING_GYRO or imu.accel_vibration_metric > SHAKING_ACCEL:
            self._moved_us = max(self._moved_us, imu.timestamp)
        return now_us - self._moved_us > AT_REST_US
