"""A vehicle that follows trajectory_setpoint by PX4's P gains alone: enough to fly the modes without controllers."""

import math
from collections.abc import Callable
from typing import NamedTuple

from sitl_emu.autopilot.constants import NavState, SetpointType, TakeoffState
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.modes.flight_modes import FlightModes
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    ManualControlSetpoint,
    PositionSetpoint,
    PositionSetpointTriplet,
    TakeoffStatus,
    Topics,
    TrajectorySetpoint,
    VehicleLandDetected,
    VehicleLocalPosition,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.geodesy import MapProjection

HOME = MapProjection(47.397742, 8.545594)
ALTITUDE_M = 488.0
STEP_S = 0.02
"""How often a task runs (`flight_modes.INTERVAL_US`)."""


class Row(NamedTuple):
    """One moment of a flight."""

    t: float
    setpoint: TrajectorySetpoint
    local: VehicleLocalPosition


class Follower:
    """Topics, modes and a point mass; `fly` runs them and records."""

    def __init__(self, up: float = 10.0, nav_state: NavState = NavState.AUTO_LOITER, **changes: float) -> None:
        self.topics = Topics()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, changes)
        self.texts = Texts()
        self.modes = FlightModes(self.topics, self.parameters, self.texts)
        self.now_us = 1_000_000
        self.topics.vehicle_status = VehicleStatus(armed=True, nav_state=nav_state)
        self.topics.takeoff_status = TakeoffStatus(state=TakeoffState.FLIGHT)
        self.topics.vehicle_land_detected = VehicleLandDetected(landed=False)
        self.topics.manual_control_setpoint = ManualControlSetpoint(valid=True)
        self.place(0.0, 0.0, up)

    def place(self, north: float, east: float, up: float, heading: float = 0.0) -> None:
        """Stand still somewhere."""
        self.topics.vehicle_local_position = VehicleLocalPosition(
            self.now_us, self.now_us, True, True, True, True, north, east, -up, heading=heading,
            heading_good_for_control=True,
            ref_lat=HOME.lat0_deg, ref_lon=HOME.lon0_deg, ref_alt=ALTITUDE_M, ref_timestamp=1,
        )  # fmt: skip

    def tell_heading(self, *, is_good: bool) -> None:
        """Whether the heading is good for control."""
        self.topics.vehicle_local_position = self.topics.vehicle_local_position._replace(
            heading_good_for_control=is_good
        )

    def go(self, *points: tuple[float, float, float], yaw: float = math.nan, speed: float = -1.0,
           kind: SetpointType = SetpointType.POSITION, acceptance_m: float = 10.0) -> None:  # fmt: skip
        """Publish the triplet: (north, east, up) of current, or previous and current, or previous, current and next."""
        setpoints = [self.setpoint(point, yaw, speed, kind, acceptance_m) for point in points]
        if len(setpoints) == 1:
            setpoints.insert(0, PositionSetpoint())
        if len(setpoints) == 2:
            setpoints.append(PositionSetpoint())
        self.topics.position_setpoint_triplet = PositionSetpointTriplet(self.now_us, *setpoints)

    def setpoint(self, point: tuple[float, float, float], yaw: float, speed: float, kind: SetpointType,
                 acceptance_m: float) -> PositionSetpoint:  # fmt: skip
        """One waypoint as the navigator writes it."""
        lat, lon = HOME.reproject(point[0], point[1])
        return PositionSetpoint(self.now_us, True, kind, lat, lon, ALTITUDE_M + point[2], yaw, acceptance_m, speed)

    def fly(self, seconds: float, each: Callable[[], None] | None = None) -> list[Row]:
        """Run for a time, or until `each` raises StopIteration."""
        rows = []
        for _ in range(round(seconds / STEP_S)):
            self.now_us += round(STEP_S * 1e6)
            if each is not None:
                try:
                    each()
                except StopIteration:
                    break
            self.modes.update(self.now_us)
            self._follow(STEP_S)
            rows.append(Row(self.now_us * 1e-6, self.topics.trajectory_setpoint, self.topics.vehicle_local_position))
        return rows

    def stand(self, seconds: float) -> TrajectorySetpoint:
        """Run the modes for a time in which the vehicle does not move; the last setpoint."""
        for _ in range(round(seconds / STEP_S)):
            self.now_us += round(STEP_S * 1e6)
            self.topics.vehicle_local_position = self.topics.vehicle_local_position._replace(timestamp=self.now_us)
            self.modes.update(self.now_us)
        return self.topics.trajectory_setpoint

    def _follow(self, dt: float) -> None:
        local, sp = self.topics.vehicle_local_position, self.topics.trajectory_setpoint
        x, v = (local.x, local.y, local.z), (local.vx, local.vy, local.vz)
        place, speed = [], []
        for i in range(3):
            wanted = _finite(sp.velocity[i]) + 0.95 * _finite(sp.position[i] - x[i])
            acceleration = _finite(sp.acceleration[i])
            if math.isfinite(sp.velocity[i]) or math.isfinite(sp.position[i]):
                acceleration += 4.0 * (wanted - v[i])
            acceleration = max(-8.0, min(8.0, acceleration))
            speed.append(v[i] + acceleration * dt)
            place.append(x[i] + speed[i] * dt)
        heading = sp.yaw if math.isfinite(sp.yaw) else local.heading + _finite(sp.yawspeed) * dt
        self.topics.vehicle_local_position = local._replace(
            timestamp=self.now_us, x=place[0], y=place[1], z=place[2], vx=speed[0], vy=speed[1], vz=speed[2],
            heading=math.remainder(heading, math.tau),
        )  # fmt: skip


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def stick_flight(mode: NavState = NavState.POSCTL, up: float = 30.0, **changes: float) -> Follower:
    """A vehicle high up with its sticks centred for a second; `changes` of parameters."""
    follower = Follower(up, mode, **changes)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True)
    follower.fly(1.0)
    return follower


def move(
    follower: Follower,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    throttle: float = 0.0,
    aux1: float = 0.0,
) -> None:
    """Deflect the sticks, and the first auxiliary one."""
    aux = (aux1, 0.0, 0.0, 0.0, 0.0, 0.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, roll, pitch, yaw, throttle, aux=aux)
