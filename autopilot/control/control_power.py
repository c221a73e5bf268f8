"""How much is asked of the motors to turn the vehicle: by axis the mean square of the torque over half a second.

PX4's MulticopterRateControl::updateActuatorControlsStatus (v1.18).
"""

from typing import Final

from sitl_emu.autopilot.topics import ActuatorControlsStatus, Topics, Vector3

MEASURED_OVER_S: Final = 0.5


class ControlPower:
    """Writer of actuator_controls_status."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._roll = self._pitch = self._yaw = self._time_s = 0.0

    def add(self, now_us: int, torque: Vector3, dt_s: float) -> None:
        """After each rate control."""
        roll, pitch, yaw = torque
        self._roll += roll * roll * dt_s
        self._pitch += pitch * pitch * dt_s
        self._yaw += yaw * yaw * dt_s
        self._time_s += dt_s
        if self._time_s > MEASURED_OVER_S:
            power = (self._roll / self._time_s, self._pitch / self._time_s, self._yaw / self._time_s)
            self._topics.actuator_controls_status = ActuatorControlsStatus(now_us, power)
            self._roll = self._pitch = self._yaw = self._time_s = 0.0
