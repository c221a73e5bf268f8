"""The nose turns into the wind (WV_EN): PX4 v1.18's lib/weather_vane.

A vehicle that holds its place leans into the wind. Where it leans to its side, past WV_ROLL_MIN, it turns that way, by
WV_GAIN, no faster than WV_YRATE_MAX. A heading that the navigator wants goes before.
"""

import math

from sitl_emu.autopilot.modes.sticks import StickYaw
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core.attitude import rotation


class WeatherVane:
    """How fast to turn."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self.refresh(parameters)

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self.enabled = bool(value["WV_EN"])
        self._least_roll = math.radians(value["WV_ROLL_MIN"])
        self._fastest = math.radians(value["WV_YRATE_MAX"])
        self._gain = float(value["WV_GAIN"])

    def yawspeed(self) -> float:
        """By the attitude that is wanted, seen along the heading (getWeathervaneYawrate)."""
        topics = self._topics
        heading = topics.vehicle_local_position.heading
        matrix = rotation(topics.vehicle_attitude_setpoint.q_d)
        right = matrix[5] * math.cos(heading) - matrix[2] * math.sin(heading)
        roll = -math.asin(max(-1.0, min(1.0, right)))
        excess = math.copysign(max(abs(roll) - self._least_roll, 0.0), roll)
        return max(-self._fastest, min(self._fastest, excess * self._gain))

    def beside_stick(self, yaw: StickYaw, *, holds_place: bool) -> tuple[float, float]:
        """Yaw and its rate of a mode that sticks fly: no heading is held, and it turns while a place is."""
        if not self.enabled:
            return yaw.yaw, yaw.yawspeed
        yaw.yaw = math.nan
        return yaw.yaw, yaw.yawspeed + (self.yawspeed() if holds_place else 0.0)
