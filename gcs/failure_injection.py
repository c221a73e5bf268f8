"""Letting a part of a simulated vehicle fail.

Sources: https://mavlink.io/en/messages/common.html#MAV_CMD_INJECT_FAILURE and
https://docs.px4.io/v1.18/en/debug/failure_injection.html. PX4 takes it only where SYS_FAILURE_EN is 1.
"""

from sitl_emu.gcs.command import Command

INJECT_FAILURE = 420
OK, OFF, STUCK, GARBAGE, WRONG = range(5)
"""FAILURE_TYPE; OK mends."""
SENSOR_GYRO, SENSOR_ACCEL, SENSOR_MAG, SENSOR_BARO, SENSOR_GPS = range(5)
"""FAILURE_UNIT of sensors."""
SYSTEM_BATTERY, SYSTEM_MOTOR = 100, 101
"""FAILURE_UNIT of the rest."""


def inject_failure(system: int, unit: int, kind: int, instance: int = 0) -> Command:
    """Lets a FAILURE_UNIT fail by a FAILURE_TYPE; instance 0 means all."""
    return Command(system, 1, INJECT_FAILURE, (unit, kind, instance))
