"""gyro_calibration: what it has of the gyro at rest (PX4: modules/gyro_calibration)."""

from collections.abc import Sequence

from sitl_emu.autopilot.constants import IMU_TEMPERATURE_C
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle
from sitl_emu.autopilot.shell.commands.module import default_command

NAME = "gyro_calibration"


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`gyro_calibration status`: mean, rad/s, and variance of its samples, without PX4's performance counters."""
    calibration = vehicle.gyro_calibration
    if not calibration.runs or list(arguments[:1]) != ["status"]:
        return (yield from default_command(NAME, calibration.runs, arguments))
    mean = ", ".join(f"{value:.5f}" for value in calibration.mean)
    variance = ", ".join(f"{value:.9f}" for value in calibration.variance)
    count = f"{IMU_TEMPERATURE_C:.1f} degC (count {calibration.count})"
    yield f"gyro 0 ({DEVICE_IDS['GYRO']}), [{mean}] var: [{variance}] {count}\n"
    return SUCCESS
