"""Tells that the magnetometer has failed: PX4's VehicleMagnetometer::CheckFailover and its DataValidator (v1.18).

A compass fails when it says nothing for 0.3 s (TIMEOUT), or the same for too long (STALE); it may fail again once it
was well. There is one, so that nothing can take over, and whether it may be armed without, the arming checks decide.
"""

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.sensors.data_validator import DataValidator
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US = 300_000
"""VehicleMagnetometer's SENSOR_TIMEOUT."""
TOLD_EVERY_US = 3_000_000
STALE, TIMEOUT = ("STALE", 2), ("TIMEOUT", 4)
"""What is said, and px4::sensor_failover_reason_t."""


class MagnetometerFailover:
    """Watches sensor_mag; `validator`: what the sensors' side knows of its samples."""

    def __init__(self, topics: Topics, validator: DataValidator, say: Say) -> None:
        self._topics, self._validator = topics, validator
        self._say = say
        self._is_well = False
        self._told_us = -TOLD_EVERY_US

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        heard_us = self._topics.sensor_mag.timestamp
        reason = TIMEOUT if now_us - heard_us > TIMEOUT_US else STALE if self._validator.stale else None
        if reason is not None and self._is_well and now_us - self._told_us > TOLD_EVERY_US:
            self._told_us = now_us
            text, flag = reason
            self._say(Severity.EMERGENCY, f"MAG #0 failed:  {text}!\t", "sensor_failover_mag", 0, flag)
        self._is_well = reason is None and heard_us > 0
