"""Turning motors one by one, on a vehicle that stands disarmed with its propellers off.

Source: https://mavlink.io/en/messages/common.html#MAV_CMD_ACTUATOR_TEST. PX4 limits a test to 3 s, and takes none while
the safety switch is on or the vehicle is armed.
"""

import math

from sitl_emu.gcs.command import Command

ACTUATOR_TEST = 310
FIRST_MOTOR_FUNCTION = 1
"""ACTUATOR_OUTPUT_FUNCTION_MOTOR1."""


def turn_motor(system: int, motor: int, thrust: float, seconds: float) -> Command:
    """Turns a motor (1 is the first); `thrust` 0..1."""
    return Command(system, 1, ACTUATOR_TEST, (thrust, seconds, 0, 0, FIRST_MOTOR_FUNCTION + motor - 1))


def stop_motor(system: int, motor: int) -> Command:
    """Ends a motor's test before its time."""
    return Command(system, 1, ACTUATOR_TEST, (math.nan, 0, 0, 0, FIRST_MOTOR_FUNCTION + motor - 1))
