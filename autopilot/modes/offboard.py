"""OFFBOARD with position, velocity or acceleration: the setpoint of the link goes to the position controller as it is.

As in PX4 v1.18, where MAVLink writes trajectory_setpoint itself and mc_pos_control derives the wish to take off from a
setpoint above the vehicle, in the step in which it is new: on the ground it keeps none (MulticopterPositionControl::
Run). A goto_setpoint becomes one by `goto_control.py`. Attitude and rate setpoints don't pass here: the controllers
take them from the topic.

A setpoint counts from the first that comes in the mode: MAVLink passes no earlier one on. Until then the controller
goes on with what it flew before.
"""

from sitl_emu.autopilot.commander.control_mode import is_of_mode
from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.modes.goto_control import GotoControl
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, TrajectorySetpoint, VehicleConstraints


class Offboard:
    """The flight task of OFFBOARD."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._goto = GotoControl(parameters)
        self._told = TrajectorySetpoint()
        """The last that went to the controller."""
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        self._speed_up = self._parameters["MPC_Z_VEL_MAX_UP"]
        self._speed_down = self._parameters["MPC_Z_VEL_MAX_DN"]
        self._goto.refresh()

    def activate(self, last: TrajectorySetpoint) -> None:
        """The other side makes the trajectory; to a place it begins anew."""
        self._goto.stop()

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """The last setpoint received."""
        topics = self._topics
        setpoint, goto = topics.offboard_setpoint.trajectory, topics.offboard_setpoint.goto
        if goto is not None:
            setpoint = self._goto.update(now_us, dt_s, goto, topics.vehicle_local_position)
        else:
            self._goto.stop()
        if setpoint is None or not (goto is not None or is_of_mode(setpoint.timestamp, topics.vehicle_status)):
            setpoint = self._told = topics.trajectory_setpoint
        rises = (
            setpoint.position[2] < topics.vehicle_local_position.z
            or setpoint.velocity[2] < 0.0
            or setpoint.acceleration[2] < 0.0
        )
        want_takeoff = rises and topics.vehicle_status.armed and setpoint is not self._told
        self._told = setpoint
        return setpoint, VehicleConstraints(self._speed_up, self._speed_down, want_takeoff)
