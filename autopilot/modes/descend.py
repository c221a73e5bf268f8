"""DESCEND: down at landing speed without a position, level, heading held (PX4 v1.18's FlightTaskDescend).

Where not even the vertical speed is known it sinks with a constant acceleration. Sticks do not nudge it
(MPC_AUTO_NUDGING).
"""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, TrajectorySetpoint, VehicleConstraints

NAN = math.nan
BLIND_M_S2 = 0.3
"""Down, without a vertical speed."""


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
        """One step."""
        down, sinking = (self._speed, NAN) if self._topics.vehicle_local_position.v_z_valid else (NAN, BLIND_M_S2)
        velocity, acceleration = (NAN, NAN, down), (0.0, 0.0, sinking)
        return TrajectorySetpoint(now_us, (NAN, NAN, NAN), velocity, acceleration, self._yaw, NAN), self._limits
