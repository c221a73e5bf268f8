"""A rover as a bicycle on the plane: enough to drive the rover's control without a simulator."""

import json
import math
import pathlib

from sitl_emu import autopilot
from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.control.rover_ackermann import RoverAckermannControl
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN3,
    ActuatorArmed,
    OffboardSetpoint,
    PositionSetpoint,
    PositionSetpointTriplet,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleLocalPosition,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.geodesy import MapProjection

HOME = MapProjection(47.397742, 8.545594)
DT_US = 4000
VEHICLES = pathlib.Path(autopilot.__file__).parent.parent / "vehicles"


class RoverBody:
    """Topics, control and a bicycle whose drive follows the throttle with a lag; `drive` runs them."""

    def __init__(self, model: str = "rover", nav_state: NavState = NavState.AUTO_LOITER, **changes: float) -> None:
        airframe = json.loads((VEHICLES / model / "airframe.json").read_text())
        self.topics = Topics()
        self.parameters = Parameters(VehicleKind.ROVER_ACKERMANN, {**airframe, **changes})
        self.texts = Texts()
        self.control = RoverAckermannControl(self.topics, self.parameters, self.texts.events.send)
        self.now_us = 1_000_000
        self.north, self.east, self.heading, self.speed, self.steering = 0.0, 0.0, 0.0, 0.0, 0.0
        self.slope = 0.0
        """How steeply it goes up, rad."""
        self.full_speed = float(self.parameters["RO_MAX_THR_SPEED"])
        self.topics.actuator_armed = ActuatorArmed(armed=True)
        self.topics.vehicle_status = VehicleStatus(
            armed=True, nav_state=nav_state, vehicle_kind=VehicleKind.ROVER_ACKERMANN
        )
        self.publish(0.0)

    def go(self, *points: tuple[float, float], speed: float = -1.0) -> None:
        """Publish the triplet: (north, east) of current, or previous and current, or previous, current and next."""
        setpoints = []
        for point in points:
            lat, lon = HOME.reproject(*point)
            setpoints.append(PositionSetpoint(self.now_us, True, SetpointType.POSITION, lat, lon, 488.0,
                                              cruising_speed=speed))  # fmt: skip
        if len(setpoints) == 1:
            setpoints.insert(0, PositionSetpoint())
        if len(setpoints) == 2:
            setpoints.append(PositionSetpoint())
        self.topics.position_setpoint_triplet = PositionSetpointTriplet(self.now_us, *setpoints)

    def offboard(self, position: Vector3 = NAN3, velocity: Vector3 = NAN3, acceleration: Vector3 = NAN3) -> None:
        """Publish an offboard setpoint."""
        trajectory = TrajectorySetpoint(self.now_us, position, velocity, acceleration)
        self.topics.offboard_setpoint = OffboardSetpoint(self.now_us, trajectory)

    def drive(self, seconds: float) -> list[tuple[float, float, float, float]]:
        """Run for a time; rows of (north, east, heading, speed)."""
        rows = []
        wheel_base, most = float(self.parameters["RA_WHEEL_BASE"]), float(self.parameters["RA_MAX_STR_ANG"])
        for _ in range(round(seconds * 1e6 / DT_US)):
            self.now_us += DT_US
            self.control.update_rate(self.now_us)
            steering, throttle = self.topics.actuator_outputs.controls or (0.0, 0.0)
            dt = DT_US * 1e-6
            self.steering += (steering * most - self.steering) * dt / 0.08
            self.speed += (throttle * self.full_speed - self.speed) * dt / 0.15
            yaw_rate = self.speed * math.tan(self.steering) / wheel_base
            self.heading = math.remainder(self.heading + yaw_rate * dt, math.tau)
            self.north += self.speed * math.cos(self.slope) * math.cos(self.heading) * dt
            self.east += self.speed * math.cos(self.slope) * math.sin(self.heading) * dt
            self.publish(yaw_rate)
            rows.append((self.north, self.east, self.heading, self.speed))
        return rows

    def publish(self, yaw_rate: float) -> None:
        """What the estimator would say."""
        along = self.speed * math.cos(self.slope)
        vx, vy, vz = along * math.cos(self.heading), along * math.sin(self.heading), -self.speed * math.sin(self.slope)
        self.topics.vehicle_attitude = VehicleAttitude(self.now_us, quaternion(0.0, self.slope, self.heading))
        self.topics.vehicle_local_position = VehicleLocalPosition(
            self.now_us, self.now_us, True, True, True, True, self.north, self.east, vx=vx, vy=vy, vz=vz,
            heading=self.heading, ref_lat=HOME.lat0_deg, ref_lon=HOME.lon0_deg, ref_alt=488.0, ref_timestamp=1,
        )  # fmt: skip
        self.topics.vehicle_angular_velocity = VehicleAngularVelocity(self.now_us, (0.0, 0.0, yaw_rate))
