"""What every flight mode is to `flight_modes.py`: PX4's FlightTask (src/modules/flight_mode_manager/tasks, v1.18).

A task is activated with the setpoint that was flown last, so that it goes on smoothly, and then makes one setpoint with
its constraints at every update. It reads topics and keeps copies of its parameters.
"""

import math
from typing import Final, Protocol

from sitl_emu.autopilot.topics import (
    HomePosition,
    TrajectorySetpoint,
    Vector3,
    VehicleConstraints,
    VehicleLocalPosition,
)

GEAR_UP_ABOVE_M: Final = 2.0
LEAST_RISE_M: Final = 0.2
HAGL_MARGIN_M: Final = 0.05
TAKEOFF_VELOCITY: Final = -0.3
"""Down, m/s."""
Setpoint = tuple[TrajectorySetpoint, VehicleConstraints]


class FlightTask(Protocol):
    """One flight mode."""

    def refresh(self) -> None:
        """Copy the parameters again; they have changed."""

    def activate(self, last: TrajectorySetpoint) -> None:
        """Begin, or begin anew, from the setpoint flown last; NaN where none was."""

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step of `dt_s` seconds."""


def start_state(last: TrajectorySetpoint, local: VehicleLocalPosition) -> tuple[Vector3, Vector3, Vector3]:
    """Position, velocity and acceleration to go on from: the last setpoint's, the vehicle's where that has none."""
    px, py, pz = last.position
    vx, vy, vz = last.velocity
    ax, ay, az = last.acceleration
    position = (_or(px, local.x), _or(py, local.y), _or(pz, local.z))
    velocity = (_or(vx, local.vx), _or(vy, local.vy), _or(vz, local.vz))
    return position, velocity, (_or(ax, local.ax), _or(ay, local.ay), _or(az, local.az))


def distance_to_ground_m(local: VehicleLocalPosition, home: HomePosition) -> float:
    """Height above what is known of the ground: by the range sensor, above home, or above the origin."""
    if local.dist_bottom_valid:
        return local.dist_bottom
    return home.z - local.z if home.valid and math.isfinite(home.z) else -local.z


def wants_takeoff(position: Vector3, velocity: Vector3, local: VehicleLocalPosition) -> bool:
    """Whether a setpoint is far enough above a vehicle on the ground to lift it off (FlightTask::_checkTakeoff)."""
    least = local.hagl_min + HAGL_MARGIN_M if math.isfinite(local.hagl_min) else LEAST_RISE_M
    return position[2] < local.z - least or velocity[2] < TAKEOFF_VELOCITY


def _or(value: float, default: float) -> float:
    return value if value - value == 0.0 else default
