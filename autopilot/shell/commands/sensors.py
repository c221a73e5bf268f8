"""sensors: which are there and send (PX4: modules/sensors)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autopilot.shell.command import SUCCESS, Output
from autopilot.shell.commands.module import default_command

if TYPE_CHECKING:
    from autopilot.autopilot import Autopilot

SENSORS = (
    ("gyro and accel", "sensor_combined"),
    ("barometer", "sensor_baro"),
    ("magnetometer", "sensor_mag"),
    ("gps", "sensor_gps"),
    ("distance sensor", "distance_sensor"),
)


def main(autopilot: "Autopilot", arguments: Sequence[str]) -> Output:
    """`sensors status`: the age of every sensor's last sample."""
    if list(arguments) != ["status"]:
        return (yield from default_command("sensors", True, arguments))
    for name, topic in SENSORS:
        timestamp = getattr(autopilot.topics, topic).timestamp
        if timestamp:
            yield f"selected {name}: 0, last sample {(autopilot.now_us - timestamp) * 1e-6:.3f} s ago\n"
        else:
            yield f"no {name}\n"
    return SUCCESS
