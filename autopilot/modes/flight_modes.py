"""Chooses the flight mode's task and publishes its setpoint: PX4's flight_mode_manager (v1.18).

One task per mode; all AUTO modes share one, so that a mission goes over into its pause without a jerk. Until the
rotors' ramp begins the task begins anew at every update. One that needs sticks does not begin without: Descend runs in
its place. Modes that sticks fly without a position (STAB, ACRO, MANUAL) and termination publish no setpoint. OFFBOARD
is a task here alone: what others asked for there nobody goes on from.
"""

import math
from typing import Final

from sitl_emu.autopilot.constants import GEAR_DOWN, GEAR_KEEP, NavState, Severity, TakeoffState
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, Task
from sitl_emu.autopilot.modes.altitude_cruise import AltitudeCruise
from sitl_emu.autopilot.modes.auto import Auto
from sitl_emu.autopilot.modes.descend import Descend
from sitl_emu.autopilot.modes.flight_task import FlightTask
from sitl_emu.autopilot.modes.follow_target import FollowTargetTask
from sitl_emu.autopilot.modes.manual_altitude import ManualAltitude
from sitl_emu.autopilot.modes.manual_direct import DirectAltitude, DirectPosition
from sitl_emu.autopilot.modes.manual_position import ManualPosition
from sitl_emu.autopilot.modes.manual_position_slow import ManualPositionSlow
from sitl_emu.autopilot.modes.offboard import Offboard
from sitl_emu.autopilot.modes.orbit import Orbit
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters.subscription_interval import PARAMETER_UPDATE_INTERVAL_US, SubscriptionInterval
from sitl_emu.autopilot.topics import LandingGear, Topics, TrajectorySetpoint, Vector3, VehicleConstraints

INTERVAL_US: Final = 20_000
"""A task runs with the estimate, at most so often on average (FlightModeManager::init)."""
LONGEST_STEP_S: Final = 0.1
DIRECT: Final = 0
POSITION_MODES = (DIRECT, 4)
"""MPC_POS_MODE; another is set to 4 when Position is flown (FlightModeManager.cpp)."""
NAN = math.nan
DESCEND: Final = 1
"""FlightTaskIndex: after Auto (modules/flight_mode_manager/CMakeLists.txt)."""
AUTO_ON_GROUND = TrajectorySetpoint(velocity=(0.0, 0.0, 0.7), acceleration=(0.0, 0.0, 0.0))
"""FlightTaskAuto's trajectory begins downwards, so that it takes its time to lift the vehicle off; without what shakes
the vehicle."""


class FlightModes:
    """Writer of trajectory_setpoint, vehicle_constraints, landing_gear and orbit_status."""

    def __init__(self, topics: Topics, parameters: Parameters, texts: Texts) -> None:
        say, send = texts.of("flight_mode_manager"), texts.events.send
        self._texts = texts
        self._topics = topics
        self._parameters = parameters
        auto, follow_target = Auto(topics, parameters, say, send), FollowTargetTask(topics, parameters)
        slow = ManualPositionSlow(topics, parameters, say, send)
        self._descend = Descend(topics, parameters)
        tasks: dict[Task, FlightTask] = {
            Task.AUTO: auto,
            Task.MANUAL_POSITION: ManualPosition(topics, parameters, say, send),
            Task.MANUAL_POSITION_SLOW: slow,
            Task.MANUAL_ALTITUDE: ManualAltitude(topics, parameters),
            Task.ALTITUDE_CRUISE: AltitudeCruise(topics, parameters),
            Task.DESCEND: self._descend,
            Task.ORBIT: Orbit(topics, parameters, say, send),
            Task.FOLLOW_TARGET: follow_target,
            Task.OFFBOARD: Offboard(topics, parameters),
        }
        self.tasks = {state: tasks[mode.task] for state, mode in FLIGHT_MODES.items() if mode.task is not None}
        self._direct: dict[NavState, FlightTask] = {
            NavState.POSCTL: DirectPosition(topics, parameters),
            NavState.ALTCTL: DirectAltitude(topics, parameters),
        }
        """With MPC_POS_MODE 0."""
        self._auto, self._follow_target, self._slow = auto, follow_target, slow
        self._offboard = tasks[Task.OFFBOARD]
        self._lacks_sticks = False
        """Descend runs because the mode's own task cannot begin."""
        self._task: FlightTask | None = None
        self._estimates = SubscriptionInterval(INTERVAL_US, 0)
        self._updated_us = 0
        self._gear = GEAR_KEEP
        topics.vehicle_constraints = VehicleConstraints(parameters["MPC_Z_VEL_MAX_UP"], parameters["MPC_Z_VEL_MAX_DN"])
        self._updates = SubscriptionInterval(PARAMETER_UPDATE_INTERVAL_US, parameters.version)

    def update(self, now_us: int) -> None:
        """With each estimate (125 Hz). A task runs with some of them: at 50 Hz, 16 and 24 ms apart in turn.

        What OFFBOARD asks for goes to the controllers as it comes, past PX4's flight_mode_manager.
        """
        topics = self._topics
        status = topics.vehicle_status
        in_offboard = self.tasks.get(status.nav_state) is self._offboard
        if not (self._estimates.updated(now_us, topics.vehicle_local_position.timestamp) or in_offboard):
            return
        if self._updates.updated(now_us, self._parameters.version):
            for each in (*self.tasks.values(), *self._direct.values()):
                each.refresh()
        dt_s = min((now_us - self._updated_us) * 1e-6, LONGEST_STEP_S)
        self._updated_us = now_us
        task: FlightTask | None = self.tasks.get(status.nav_state)
        if status.nav_state in self._direct:
            position_mode = self._parameters["MPC_POS_MODE"]
            if position_mode == DIRECT:
                task = self._direct[status.nav_state]
            elif status.nav_state is NavState.POSCTL and position_mode not in POSITION_MODES:
                line = f"[flight_mode_manager] MPC_POS_MODE {position_mode} invalid, resetting"
                self._texts.note(Severity.ERROR, line)
                self._parameters.set("MPC_POS_MODE", 4)
        needs_sticks = isinstance(task, ManualAltitude) and task.NEEDS_STICKS
        without_sticks = needs_sticks and not topics.manual_control_setpoint.valid
        goes_on = without_sticks and task is self._task
        if without_sticks and not goes_on:
            task = self._runs_instead()
        self._lacks_sticks = without_sticks and not goes_on
        if task is not self._task:
            before, self._task = self._task, task
            for ending in (self._follow_target, self._slow):
                if before is ending:
                    ending.end(now_us)
            if task is None:
                topics.trajectory_setpoint = TrajectorySetpoint(now_us)
            else:
                task.refresh()  # PX4 makes a task anew: it knows at once what has changed
                if isinstance(task, (Auto, FollowTargetTask, ManualAltitude)):
                    task.begin()
                # PX4 runs no task in OFFBOARD, whose setpoint may lie far away (FlightModeManager::switchTask)
                task.activate(TrajectorySetpoint() if before is self._offboard else topics.trajectory_setpoint)
        if task is None:
            return
        if goes_on:  # sticks that are lost: it asks for nothing (FlightModeManager::generateTrajectorySetpoint)
            topics.trajectory_setpoint, topics.vehicle_constraints = TrajectorySetpoint(now_us), VehicleConstraints()
        else:
            topics.trajectory_setpoint, topics.vehicle_constraints = task.update(now_us, dt_s)
        if topics.takeoff_status.state < TakeoffState.RAMPUP:
            velocity = topics.trajectory_setpoint.velocity
            task.activate(AUTO_ON_GROUND if task is self._auto else _on_ground(velocity))
        gear = self._auto.gear if task is self._auto else GEAR_DOWN if task is self._descend else GEAR_KEEP
        if gear != self._gear:
            self._gear = gear
            if gear != GEAR_KEEP:
                topics.landing_gear = LandingGear(now_us, gear)

    def _runs_instead(self) -> FlightTask:
        """What runs where a task cannot begin, made anew at every run (FlightModeManager::start_flight_task)."""
        status = self._topics.vehicle_status
        if status.armed and not self._lacks_sticks:
            unable = f"Matching flight task was not able to run, Nav state: {status.nav_state:d}, Task: {DESCEND}"
            self._texts.note(Severity.ERROR, f"[flight_mode_manager] {unable}")
        if self._task is self._descend:
            self._descend.activate(TrajectorySetpoint())
        return self._descend


def _on_ground(velocity: Vector3) -> TrajectorySetpoint:
    """A setpoint to begin with that keeps nothing but the vertical velocity, by which a stick may ask to land."""
    return TrajectorySetpoint(velocity=(NAN, NAN, velocity[2]))
