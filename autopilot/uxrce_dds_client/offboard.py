"""Offboard control from ROS 2: offboard_control_mode and its setpoints into topics.offboard_setpoint.

As in PX4, offboard_control_mode says what is controlled (commander/ModeUtil/control_mode.cpp: the first that is set, in
the order of its fields), and its time alone says whether control goes on (COM_OF_LOSS_T); the setpoints come on topics
of their own. A setpoint of before OFFBOARD was entered does not count there, as none does to a controller that has only
just begun to listen.

A number that is none leaves its axis free in a trajectory, in rates it keeps the present one (as in
MulticopterRateControl.cpp), and it stops a motor or servo (ActuatorMotors.msg). An attitude without a direction, and a
thrust or torque that is no number, are not taken, where PX4 would stop motors by them.
"""

import math
from collections.abc import Mapping
from typing import Any

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import (
    ActuatorMotors,
    ActuatorServos,
    DirectActuator,
    GotoSetpoint,
    OffboardSetpoint,
    RoverSetpoint,
    ThrustAndTorque,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
    VehicleThrustSetpoint,
    VehicleTorqueSetpoint,
)

LIMITS = ("max_horizontal_speed", "max_vertical_speed", "max_heading_rate")
TRAJECTORY = ("position", "velocity", "acceleration")
Fields = Mapping[str, Any]


class Offboard:
    """Writer of topics.offboard_setpoint, beside mavlink/services/offboard.py: who speaks last is flown, as in PX4."""

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._mode: Fields = {}
        self._trajectory = TrajectorySetpoint()
        self._attitude = VehicleAttitudeSetpoint()
        self._rates = VehicleRatesSetpoint()
        self._thrust_and_torque = ThrustAndTorque()
        self._direct_actuator = DirectActuator()
        self._goto: GotoSetpoint | None = None
        self._rover = RoverSetpoint()

    def offboard_control_mode(self, now_us: int, fields: Fields) -> None:
        """What is controlled from now on."""
        self._mode = fields
        self._write()

    def trajectory_setpoint(self, now_us: int, fields: Fields) -> None:
        """NED; NaN in every axis that is free. It counts more than a goto_setpoint."""
        self._goto = None
        self._trajectory = TrajectorySetpoint(
            fields["timestamp"],
            _finite(fields["position"]),
            _finite(fields["velocity"]),
            _finite(fields["acceleration"]),
            *_finite((fields["yaw"], fields["yawspeed"], 0.0))[:2],
        )
        self._write()

    def goto_setpoint(self, now_us: int, fields: Fields) -> None:
        """A place; one that is none changes nothing."""
        if not math.isfinite(sum(fields["position"])):
            return

        def told(flag: str, name: str) -> float:
            value: float = fields[name]
            return value if fields[flag] and math.isfinite(value) else math.nan

        self._goto = GotoSetpoint(
            fields["timestamp"],
            fields["position"],
            told("flag_control_heading", "heading"),
            *(told(f"flag_set_{name}", name) for name in LIMITS),
        )
        self._write()

    def rover_speed_setpoint(self, now_us: int, fields: Fields) -> None:
        """How fast a rover is to drive."""
        self._rover = self._rover._replace(speed=(fields["timestamp"], _number(fields["speed_body_x"])))
        self._write()

    def rover_attitude_setpoint(self, now_us: int, fields: Fields) -> None:
        """Where a rover is to head."""
        self._rover = self._rover._replace(yaw=(fields["timestamp"], _number(fields["yaw_setpoint"])))
        self._write()

    def rover_rate_setpoint(self, now_us: int, fields: Fields) -> None:
        """How fast a rover is to turn."""
        self._rover = self._rover._replace(yaw_rate=(fields["timestamp"], _number(fields["yaw_rate_setpoint"])))
        self._write()

    def rover_throttle_setpoint(self, now_us: int, fields: Fields) -> None:
        """How hard a rover is to push, -1 to 1."""
        throttle = _number(fields["throttle_body_x"])
        clamped = math.nan if math.isnan(throttle) else max(-1.0, min(1.0, throttle))
        self._rover = self._rover._replace(throttle=(fields["timestamp"], clamped))
        self._write()

    def rover_steering_setpoint(self, now_us: int, fields: Fields) -> None:
        """How far a rover is to steer, -1 to 1."""
        steering = _number(fields["normalized_steering_setpoint"])
        clamped = math.nan if math.isnan(steering) else max(-1.0, min(1.0, steering))
        self._rover = self._rover._replace(steering=(fields["timestamp"], clamped))
        self._write()

    def vehicle_attitude_setpoint(self, now_us: int, fields: Fields) -> None:
        """Body to NED, with thrust along the body's axes."""
        length, thrust = math.hypot(*fields["q_d"]), fields["thrust_body"]
        if not (math.isfinite(length) and length > 0.0 and math.isfinite(sum(thrust))):
            return
        w, x, y, z = (part / length for part in fields["q_d"])
        turn = fields["yaw_sp_move_rate"]
        turn = turn if math.isfinite(turn) else 0.0
        self._attitude = VehicleAttitudeSetpoint(fields["timestamp"], (w, x, y, z), turn, thrust)
        self._write()

    def vehicle_rates_setpoint(self, now_us: int, fields: Fields) -> None:
        """About the body's axes; the rate controller takes the present rate for what is no number."""
        rates, thrust = (fields["roll"], fields["pitch"], fields["yaw"]), fields["thrust_body"]
        if math.isfinite(sum(thrust)):
            self._rates = VehicleRatesSetpoint(fields["timestamp"], rates, thrust)
            self._write()

    def vehicle_thrust_setpoint(self, now_us: int, fields: Fields) -> None:
        """Along the body's axes."""
        if math.isfinite(sum(fields["xyz"])):
            thrust = VehicleThrustSetpoint(fields["timestamp"], fields["xyz"])
            self._thrust_and_torque = self._thrust_and_torque._replace(thrust=thrust)
            self._write()

    def vehicle_torque_setpoint(self, now_us: int, fields: Fields) -> None:
        """About the body's axes."""
        if math.isfinite(sum(fields["xyz"])):
            torque = VehicleTorqueSetpoint(fields["timestamp"], fields["xyz"])
            self._thrust_and_torque = self._thrust_and_torque._replace(torque=torque)
            self._write()

    def actuator_motors(self, now_us: int, fields: Fields) -> None:
        """Thrust of each motor."""
        motors = ActuatorMotors(fields["timestamp"], fields["control"], fields["reversible_flags"])
        self._direct_actuator = self._direct_actuator._replace(motors=motors)
        self._write()

    def actuator_servos(self, now_us: int, fields: Fields) -> None:
        """Place of each servo."""
        servos = ActuatorServos(fields["timestamp"], fields["control"])
        self._direct_actuator = self._direct_actuator._replace(servos=servos)
        self._write()

    def _write(self) -> None:
        mode = self._mode
        if not mode:
            return
        time_us: int = mode["timestamp"]
        if any(mode[name] for name in TRAJECTORY):
            goto = self._current_goto()
            trajectory = TrajectorySetpoint(goto.timestamp, goto.position) if goto else self._current_trajectory()
            rover = None if mode["position"] or mode["velocity"] else self._rover
            setpoint = OffboardSetpoint(time_us, trajectory, goto=goto, rover=rover)
        elif mode["attitude"]:
            setpoint = OffboardSetpoint(time_us, attitude=self._attitude, rover=self._rover)
        elif mode["body_rate"]:
            setpoint = OffboardSetpoint(time_us, rates=self._rates, rover=self._rover)
        elif mode["thrust_and_torque"]:
            setpoint = OffboardSetpoint(time_us, rover=self._rover, thrust_and_torque=self._thrust_and_torque)
        elif mode["direct_actuator"]:
            setpoint = OffboardSetpoint(time_us, direct_actuator=self._direct_actuator)
        else:
            setpoint = OffboardSetpoint()
        self._topics.offboard_setpoint = setpoint

    def _current_trajectory(self) -> TrajectorySetpoint:
        return TrajectorySetpoint() if self._is_of_before(self._trajectory.timestamp) else self._trajectory

    def _current_goto(self) -> GotoSetpoint | None:
        return None if self._goto is None or self._is_of_before(self._goto.timestamp) else self._goto

    def _is_of_before(self, time_us: int) -> bool:
        """Of before OFFBOARD was entered."""
        status = self._topics.vehicle_status
        return status.nav_state is NavState.OFFBOARD and time_us < status.nav_state_timestamp


def _number(value: float) -> float:
    """NaN for what is none."""
    return value if math.isfinite(value) else math.nan


def _finite(values: tuple[float, ...]) -> Vector3:
    """Three numbers, NaN for what is none."""
    x, y, z = (value if math.isfinite(value) else math.nan for value in values)
    return x, y, z
