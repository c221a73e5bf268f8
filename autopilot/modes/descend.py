"""DESCEND: down at landing speed without a position, level, heading held (PX4 v1.18's FlightTaskDescend)."""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, TrajectorySetpoint, VehicleConstraints

NAN = math.nan


class Descend:
    """The flight task of DESCEND."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._yaw = NAN
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        self._speed = self._parameters["MPC_LAND_SPEED"]
        self._limits = VehicleConstraints(self._parameters["MPC_Z_VEL_MAX_UP"], self._parameters["MPC_Z_VEL_MAX_DN"])

    def activate(self, last: TrajectorySetpoint) -> None:
        """Hold the heading there is."""
        self._yaw = self._topics.vehicle_local_position.heading

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """The same at all times."""
        down, level = (NAN, NAN, self._speed), (0.0, 0.0, NAN)
        return TrajectorySetpoint(now_us, (NAN, NAN, NAN), down, level, self._yaw, 0.0), self._limits
