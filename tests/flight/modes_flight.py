"""A multicopter flown by estimator, modes and controllers over its simulator, with commander and navigator played here.

No sockets and no clock: `Flight.fly` is a loop over ticks, and a flight of a minute takes a few seconds.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.control.multicopter import MulticopterControl
from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.land_detector.land_detector import LandDetector
from sitl_emu.autopilot.modes.flight_modes import FlightModes
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    HomePosition,
    PositionSetpoint,
    PositionSetpointTriplet,
    Topics,
    TrajectorySetpoint,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.vehicles import load
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.397742, 8.545594, 488.0, 0.0)


class Row(NamedTuple):
    """Estimate and setpoint at one moment, every 0.1 s; positions from where it stood, up positive."""

    t: float
    north: float
    east: float
    up: float
    vn: float
    ve: float
    vd: float
    yaw_deg: float
    yaw_rate_deg_s: float
    tilt_deg: float
    landed: bool
    setpoint: TrajectorySetpoint


class Flight:
    """One multicopter on flat ground."""

    def __init__(self, model: str = "sihsim_hex", seed: int = 1, **changes: Value) -> None:
        vehicle = load(model)
        self.topics = Topics()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {**vehicle.airframe, **changes})
        shared = (self.topics, self.parameters)
        self.sensors, self.estimator = Sensors(*shared), Estimator(*shared)
        self.land_detector = LandDetector(*shared, VehicleKind.MULTICOPTER.traits)
        texts = Texts()
        self.modes = FlightModes(*shared, texts)
        self.control = MulticopterControl(*shared, texts)
        self.simulator = VehicleSimulator(vehicle, HOME, seed, FlatGround())
        self.controls: HilActuatorControls | None = None
        self.ticks = 0
        self.rows: list[Row] = []
        self.begin_s = 0.0
        self.mode(NavState.AUTO_LOITER)
        self.fly(12.0)
        local = self.topics.vehicle_local_position
        self.origin = (local.x, local.y, local.z)
        self.projection = MapProjection(local.ref_lat, local.ref_lon)
        self.topics.home_position = HomePosition(
            0, True, local.ref_lat, local.ref_lon, local.ref_alt, *self.origin, 0.0
        )

    def mode(self, nav_state: NavState) -> None:
        """Change the mode, as the commander would."""
        self.topics.vehicle_status = self.topics.vehicle_status._replace(nav_state=nav_state)

    def arm(self) -> None:
        """Arm."""
        self.topics.vehicle_status = self.topics.vehicle_status._replace(armed=True)
        self.topics.actuator_armed = ActuatorArmed(armed=True)

    def setpoint(
        self,
        place: tuple[float, float, float],
        kind: SetpointType = SetpointType.POSITION,
        yaw: float = math.nan,
        speed: float = -1.0,
        acceptance_m: float = 10.0,
    ) -> PositionSetpoint:
        """A waypoint (north, east, up) as the navigator writes it."""
        north, east, down = self.origin
        lat, lon = self.projection.reproject(place[0] + north, place[1] + east)
        alt = self.topics.vehicle_local_position.ref_alt - down + place[2]
        return PositionSetpoint(0, True, kind, lat, lon, alt, yaw, acceptance_m, speed)

    def go(self, current: PositionSetpoint, previous: PositionSetpoint | None = None,
           following: PositionSetpoint | None = None) -> None:  # fmt: skip
        """Publish a triplet."""
        none = PositionSetpoint()
        self.topics.position_setpoint_triplet = PositionSetpointTriplet(0, previous or none, current, following or none)

    def climb_to(self, up: float) -> None:
        """Arm, take off and hold."""
        self.arm()
        self.mode(NavState.AUTO_TAKEOFF)
        self.go(self.setpoint((0.0, 0.0, up), SetpointType.TAKEOFF, yaw=0.0))
        self.fly(40.0, until=lambda row: row.up > up - 0.8)
        self.mode(NavState.AUTO_LOITER)
        self.go(self.setpoint((0.0, 0.0, up), SetpointType.LOITER, yaw=0.0))
        self.fly(6.0)

    def begin(self) -> None:
        """Record from here."""
        self.rows = []
        self.begin_s = self.ticks * 0.004

    def fly(self, seconds: float, until: Callable[[Row], bool] | None = None) -> None:
        """Run for a time, or until a row is as asked for."""
        topics, simulator = self.topics, self.simulator
        end = self.ticks + round(seconds / 0.004)
        while self.ticks < end:
            now_us = self.sensors.update(simulator.tick(self.controls))
            ticks = self.ticks = self.ticks + 1
            self.estimator.update(now_us)
            if ticks % 5 == 0:
                self.land_detector.update(now_us)
            if ticks % 2 == 0:
                self.modes.update(now_us)
                self.control.update_position(now_us)
            self.control.update_rate(now_us)
            armed = 128 if topics.actuator_armed.armed else 0
            self.controls = HilActuatorControls(now_us, 1, topics.actuator_outputs.controls, armed)
            if ticks % 25 == 0 and self.ticks * 0.004 > 11.9:
                row = self._row()
                self.rows.append(row)
                if until is not None and until(row):
                    return

    def _row(self) -> Row:
        topics = self.topics
        local = topics.vehicle_local_position
        roll, pitch, yaw = topics.vehicle_attitude.euler
        n, e, d = self.origin if hasattr(self, "origin") else (0.0, 0.0, 0.0)
        return Row(
            self.ticks * 0.004 - self.begin_s, local.x - n, local.y - e, d - local.z, local.vx, local.vy, local.vz,
            math.degrees(yaw), math.degrees(topics.vehicle_angular_velocity.xyz[2]),
            math.degrees(math.acos(math.cos(roll) * math.cos(pitch))), topics.vehicle_land_detected.landed,
            topics.trajectory_setpoint,
        )  # fmt: skip
