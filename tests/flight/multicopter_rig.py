"""A multicopter from sensors to motors in its simulated world, without modes and commander: the test is the pilot."""

import math
from typing import NamedTuple

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.control.multicopter import MulticopterControl
from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.land_detector.land_detector import LandDetector
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.topics import NAN, NAN3, ActuatorArmed, Topics, TrajectorySetpoint, Vector3, VehicleConstraints
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import HilActuatorControls, actuators_as_on_the_wire, as_on_the_wire
from sitl_emu.vehicles import load, with_parcel
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.39774, 8.545594, 488.0, 30.0)
TICK_S = 0.004


class Sample(NamedTuple):
    """10 Hz: what the estimator says, and the truth (position from where it started, NED)."""

    t: float
    position: Vector3
    velocity: Vector3
    euler: Vector3
    yaw_rate: float
    truth: Vector3


class Rig:
    """Ticks of 4 ms as `autopilot.Autopilot` runs them."""

    def __init__(self, model: str, seed: int = 1, *, parcel: bool = False, **parameters: float) -> None:
        """`parcel`: whether what its release can carry hangs there."""
        vehicle = with_parcel(load(model), {}) if parcel else load(model)
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {**vehicle.airframe, **parameters})
        self.topics = Topics()
        shared = (self.topics, self.parameters)
        self.sensors, self.estimator = Sensors(*shared), Estimator(*shared)
        self.land_detector = LandDetector(*shared, VehicleKind.MULTICOPTER.traits)
        self.control = MulticopterControl(*shared, Texts())
        self.simulator = VehicleSimulator(vehicle, HOME, seed, FlatGround(), name=model)
        self.ground_down_m = self.simulator.pose().down_m
        self.answer: HilActuatorControls | None = None
        self.ticks = 0
        self.now_us = 0
        self.record: list[Sample] = []
        self.position_mode()

    def position_mode(self) -> None:
        self.mode(NavState.POSCTL)

    def mode(self, nav_state: NavState) -> None:
        self.topics.vehicle_status = self.topics.vehicle_status._replace(nav_state=nav_state)

    def arm(self, armed: bool = True) -> None:
        self.topics.actuator_armed = ActuatorArmed(armed)
        self.topics.vehicle_status = self.topics.vehicle_status._replace(armed=armed, armed_time=self.now_us)

    def fly(
        self,
        position: Vector3 = NAN3,
        velocity: Vector3 = NAN3,
        yaw: float = NAN,
        want_takeoff: bool = True,
    ) -> None:
        self.topics.trajectory_setpoint = TrajectorySetpoint(self.now_us, position, velocity, NAN3, yaw, NAN)
        self.topics.vehicle_constraints = VehicleConstraints(want_takeoff=want_takeoff)

    def step(self) -> None:
        messages = [as_on_the_wire(message) for message in self.simulator.tick(self.answer)]
        self.now_us = now_us = self.sensors.update(messages)
        self.ticks += 1
        self.estimator.update(now_us)
        if self.ticks % 5 == 0:
            self.land_detector.update(now_us)
        if self.ticks % 2 == 0:
            self.control.update_position(now_us)
        self.control.update_rate(now_us)
        armed = 128 if self.topics.actuator_armed.armed else 0
        controls = self.topics.actuator_outputs.controls
        self.answer = actuators_as_on_the_wire(HilActuatorControls(now_us, 1, controls, armed))
        if self.ticks % 25 == 0:
            self._note()

    def _note(self) -> None:
        local, pose, topics = self.topics.vehicle_local_position, self.simulator.pose(), self.topics
        self.record.append(
            Sample(
                self.now_us * 1e-6,
                (local.x, local.y, local.z),
                (local.vx, local.vy, local.vz),
                topics.vehicle_attitude.euler,
                topics.vehicle_angular_velocity.xyz[2],
                (pose.north_m, pose.east_m, pose.down_m),
            )
        )

    def run(self, seconds: float) -> list[Sample]:
        """Run on, and return what was recorded meanwhile."""
        begin = len(self.record)
        for _ in range(round(seconds / TICK_S)):
            self.step()
        return self.record[begin:]

    def take_off(self, up: float) -> None:
        """Power on, wait for the estimate, arm, climb, and settle at (0, 0, -up)."""
        self.run(3.0)
        self.arm()
        heading = self.topics.vehicle_local_position.heading
        self.fly((0.0, 0.0, NAN), (NAN, NAN, -1.5), heading)
        while self.topics.vehicle_local_position.z > -up + 1.5 and self.now_us < 60e6:
            self.run(0.1)
        self.fly((0.0, 0.0, -up), yaw=heading)
        self.run(6.0)


def tilt(sample: Sample) -> float:
    """Angle (rad) between the body's up and the vertical."""
    return math.acos(max(-1.0, min(1.0, math.cos(sample.euler[0]) * math.cos(sample.euler[1]))))
