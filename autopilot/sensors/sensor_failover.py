"""Tells that the magnetometer or the barometer has failed: CheckFailover of PX4's VehicleMagnetometer and
VehicleAirData, and their DataValidator (v1.18).

One fails when it gives nothing for 0.3 s (TIMEOUT), as one that is disabled does, or the same for too long (STALE); it
may fail again once it was well. There is one of each, so that nothing can take over, and whether it may be armed
without, the arming checks decide.
"""

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.sensors.data_validator import DataValidator

TIMEOUT_US = 300_000
"""SENSOR_TIMEOUT of both."""
TOLD_EVERY_US = 3_000_000
STALE, TIMEOUT = ("STALE", 2), ("TIMEOUT", 4)
"""What is said, and px4::sensor_failover_reason_t."""


class SensorFailover:
    """Of one sensor; `validator`: what the sensors' side knows of its samples."""

    def __init__(self, sensor: str, validator: DataValidator, say: Say) -> None:
        """`sensor`: MAG or BARO."""
        self._sensor, self._validator, self._say = sensor, validator, say
        self._event = f"sensor_failover_{sensor.lower()}"
        self._is_well = False
        self._told_us = -TOLD_EVERY_US

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        heard_us = self._validator.put_us
        reason = TIMEOUT if now_us - heard_us > TIMEOUT_US else STALE if self._validator.stale else None
        if reason is not None and self._is_well and now_us - self._told_us > TOLD_EVERY_US:
            self._told_us = now_us
            text, flag = reason
            self._say(Severity.EMERGENCY, f"{self._sensor} #0 failed:  {text}!\t", self._event, 0, flag)
        self._is_well = reason is None and heard_us > 0
