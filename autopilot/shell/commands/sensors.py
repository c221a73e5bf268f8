"""sensors: which are there and send (PX4: modules/sensors)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle
from sitl_emu.autopilot.shell.commands.module import default_command

SENSORS = (
    ("gyro and accel", "sensor_combined"),
    ("barometer", "sensor_baro"),
    ("magnetometer", "sensor_mag"),
    ("gps", "sensor_gps"),
    ("distance sensor", "distance_sensor"),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`sensors status`: the age of every sensor's last sample."""
    if list(arguments) != ["status"]:
        return (yield from default_command("sensors", True, arguments))
    for name, topic in SENSORS:
        timestamp = getattr(vehicle.topics, topic).timestamp
        if timestamp:
            yield f"selected {name}: 0, last sample {(vehicle.now_us - timestamp) * 1e-6:.3f} s ago\n"
        else:
            yield f"no {name}\n"
    return SUCCESS
