"""Rover with Ackermann steering: what the mode asks for, through five controllers, to motor and steering.

Behaves as PX4's rover_ackermann (src/modules/rover_ackermann, v1.18), whose work item runs at 100 Hz. When other
controllers take over, all begin anew. Disarmed, both actuators are told once to stop, and nothing after that, not even
for an actuator test: PX4's simulated outputs (PWMSim::updateOutputs) speak only when a motor is told something. So they
are silent, too, before any throttle was ever asked for, and once terminated: what it was told last, the rover does on.
"""

import math

from sitl_emu.autopilot.commander.control_mode import control_mode, is_of_mode
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.control.ackermann_controllers import (
    NAN,
    Actuators,
    HeadingToYawRate,
    PositionControl,
    RoverState,
    Setpoints,
    SpeedToThrottle,
    Target,
    YawRateToSteering,
)
from sitl_emu.autopilot.control.ackermann_modes import AutoMode, ManualMode, OffboardMode
from sitl_emu.autopilot.control.mixer import (
    FIRST_MOTOR,
    FIRST_SERVO,
    PWM_DISARMED,
    direct_outputs,
    is_motor,
    is_servo,
    mirrored,
    output,
    unchanged,
)
from sitl_emu.autopilot.control.peripherals import last_used, with_peripherals
from sitl_emu.autopilot.control.rover_parameters import EPSILON, rover_parameters
from sitl_emu.autopilot.events.texts import SendEvent
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, NOTHING, ControlMode, DriveMode
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    ActuatorMotors,
    ActuatorOutputs,
    ActuatorServos,
    DirectActuator,
    RoverAttitudeSetpoint,
    RoverPositionSetpoint,
    RoverRateSetpoint,
    RoverSpeedSetpoint,
    RoverSteeringSetpoint,
    RoverThrottleSetpoint,
    Topics,
    Vector3,
)
from sitl_emu.core.attitude import Quaternion, rotation

INTERVAL_US = 10_000
"""RoverAckermann::init: ScheduleOnInterval(10_ms)."""
SHORTEST_STEP_US, LONGEST_STEP_US = 1_000, 10_000
"""What each controller takes for the time since its last step (AckermannSpeedControl::updateSpeedControl, others)."""
OUTPUTS = 16
NEEDED_TO_STEER = (
    ("ackermann_rate_control_conf_invalid_max_thr_speed", "RO_MAX_THR_SPEED"),
    ("ackermann_rate_control_conf_invalid_wheel_base", "RA_WHEEL_BASE"),
    ("ackermann_rate_control_conf_invalid_max_str_ang", "RA_MAX_STR_ANG"),
    ("ackermann_rate_control_conf_invalid_yaw_rate_lim", "RO_YAW_RATE_LIM"),
)
"""Event and parameter (AckermannRateControl::runSanityChecks)."""
NEEDED_TO_DRIVE = ("ackermann_speed_control_conf_invalid_speed_lim", "RO_SPEED_LIM")
"""AckermannSpeedControl::runSanityChecks; of RO_MAX_THR_SPEED it says nothing."""
CONTROLLERS = 5
"""The first flags of a ControlMode: from position to allocation."""


class RoverAckermannControl:
    """Writer of actuator_outputs, position_controller_status, pure_pursuit_status and rover_* for a rover, and of what
    PX4's MAVLink publishes in OFFBOARD: trajectory_setpoint, vehicle_attitude_setpoint, vehicle_rates_setpoint."""

    started = ()
    """PX4 starts nothing beside it."""

    def __init__(self, topics: Topics, parameters: Parameters, send: SendEvent) -> None:
        """`send` tells the ground of parameters that are missing."""
        self._topics = topics
        self._source = parameters
        self._send = send
        self._setpoints = Setpoints()
        self._target_told: Target | None = None
        self._auto, self._offboard, self._manual = AutoMode(topics), OffboardMode(topics), ManualMode(topics)
        self._position, self._speed = PositionControl(), SpeedToThrottle()
        self._heading, self._yaw_rate = HeadingToYawRate(), YawRateToSteering()
        self._actuators = Actuators()
        self._control_mode = NOTHING
        self._was_armed, self._can_run = False, True
        self._due_us = self._updated_us = 0
        self._version = -1
        self._refresh()

    def update_position(self, now_us: int) -> None:
        """Nothing: PX4's rover has one loop for all its controllers, and that is `update_rate`."""

    def update_rate(self, now_us: int) -> None:
        """All controllers, at 100 Hz."""
        if now_us < self._due_us:
            return
        self._due_us = max(self._due_us + INTERVAL_US, now_us - now_us % INTERVAL_US + INTERVAL_US)
        if is_changed := self._version != self._source.version:
            self._refresh()
        topics = self._topics
        status, armed = topics.vehicle_status, topics.actuator_armed
        mode = control_mode(status.nav_state, status.vehicle_kind.traits, topics.offboard_setpoint)
        if others := mode[:CONTROLLERS] != self._control_mode[:CONTROLLERS]:
            self._reset()
        self._control_mode = mode
        if status.nav_state is NavState.OFFBOARD:
            self._offboard.publish()
        if is_changed or others:
            self._can_run = self._checked(mode)
        if armed.armed and self._can_run:
            self._was_armed = True
            direct = topics.offboard_setpoint.direct_actuator
            if status.nav_state is NavState.OFFBOARD and direct is not None:
                self._obey(now_us, direct, locked=armed.kill or armed.lockdown)
                return
            self._drive(now_us, status.nav_state, mode)
            if mode.allocation and math.isfinite(self._setpoints.throttle):
                self._publish(now_us, locked=armed.kill or armed.lockdown)
            return
        if self._was_armed:
            self._was_armed = False
            self._reset()
            self._actuators.stop()
            topics.actuator_outputs = ActuatorOutputs(now_us, self._stopped, self._stopped_pwm)

    def _checked(self, mode: ControlMode) -> bool:
        """Whether the parameters allow what the mode asks for (RoverAckermann::runSanityChecks); what misses is told.

        Where no yaw rate can be controlled, nobody looks at the speed any more.
        """
        parameters = self._parameters
        if (mode.attitude or mode.rates) and not parameters.steers_at_a_rate:
            for event, name in NEEDED_TO_STEER if mode.rates else ():
                self._tell_if_missing(event, name)
            return False
        if mode.velocity and not parameters.drives_at_a_speed:
            self._tell_if_missing(*NEEDED_TO_DRIVE)
            return False
        return True

    def _tell_if_missing(self, event: str, name: str) -> None:
        value = float(self._source[name])
        if value < EPSILON:
            self._send(event, Severity.ERROR, value)

    def _reset(self) -> None:
        self._setpoints.reset()
        self._position.reset()
        self._speed.reset()
        self._yaw_rate.reset()
        self._manual.reset()

    def _drive(self, now_us: int, nav_state: NavState, mode: ControlMode) -> None:
        """From the mode to the actuators."""
        topics, parameters, setpoints, actuators = self._topics, self._parameters, self._setpoints, self._actuators
        step_us = min(max(now_us - self._updated_us, SHORTEST_STEP_US), LONGEST_STEP_US)
        self._updated_us, dt_s = now_us, step_us * 1e-6
        state = self._state()
        drive_mode = FLIGHT_MODES[nav_state].drive_mode
        if drive_mode is DriveMode.AUTO:
            self._auto.generate(now_us, parameters, setpoints, state)
        elif drive_mode is DriveMode.OFFBOARD:
            self._offboard.generate(setpoints)
        elif drive_mode is DriveMode.MANUAL:
            self._manual.generate(nav_state, parameters, setpoints, state)
        if mode.position:
            self._position.acceptance_m = topics.position_controller_status.acceptance_radius
            if (pursuit := self._position.update(now_us, parameters, setpoints, state)) is not None:
                topics.pure_pursuit_status = pursuit
        if mode.velocity:
            self._speed.update(parameters, setpoints, state, dt_s)
            topics.rover_speed_status = self._speed.status(now_us, state)
        if mode.attitude:
            self._heading.update(parameters, setpoints, state, actuators.motor, dt_s)
            topics.rover_attitude_status = self._heading.status(now_us, state)
        if mode.rates:
            self._yaw_rate.update(parameters, setpoints, state, actuators.motor, dt_s)
            topics.rover_rate_status = self._yaw_rate.status(now_us, state)
        if mode.allocation:
            actuators.update(parameters, setpoints, dt_s)
        self._tell_setpoints(now_us, mode, by_stick=drive_mode is DriveMode.MANUAL)

    def _tell_setpoints(self, now_us: int, mode: ControlMode, *, by_stick: bool) -> None:
        """For the log: the controllers hand them to each other in `Setpoints`. NaN is told only of a place, and of a
        heading in place of which a stick steers (AckermannManualMode)."""
        topics, setpoints = self._topics, self._setpoints
        target = setpoints.target
        if target is not None and target is not self._target_told:
            topics.rover_position_setpoint = RoverPositionSetpoint(
                now_us, target.place, target.start, target.cruising_speed, target.arrival_speed
            )
        self._target_told = target
        if math.isfinite(setpoints.speed):
            topics.rover_speed_setpoint = RoverSpeedSetpoint(now_us, setpoints.speed)
        if math.isfinite(setpoints.yaw) or (by_stick and mode.attitude):
            topics.rover_attitude_setpoint = RoverAttitudeSetpoint(now_us, setpoints.yaw)
        if math.isfinite(setpoints.yaw_rate):
            topics.rover_rate_setpoint = RoverRateSetpoint(now_us, setpoints.yaw_rate)
        if math.isfinite(setpoints.throttle):
            sideways = NAN if mode.velocity else 0.0
            topics.rover_throttle_setpoint = RoverThrottleSetpoint(now_us, setpoints.throttle, sideways)
        if math.isfinite(setpoints.steering):
            topics.rover_steering_setpoint = RoverSteeringSetpoint(now_us, setpoints.steering)

    def _obey(self, now_us: int, direct: DirectActuator, *, locked: bool) -> None:
        """OFFBOARD by direct actuators, in which no controller runs; what nobody has told there stays as it was."""
        topics, actuators = self._topics, self._actuators
        motors, servos = direct
        if not is_of_mode(motors.timestamp, topics.vehicle_status):
            motors = ActuatorMotors(0, (actuators.motor,), int(self._parameters.reversible))
        if not is_of_mode(servos.timestamp, topics.vehicle_status):
            servos = ActuatorServos(0, (actuators.servo,))
        actuators.told(motors.control[0], servos.control[0])
        if locked:
            self._publish(now_us, locked=True)
            return
        outputs = direct_outputs(now_us, self._functions, DirectActuator(motors, servos), unchanged)
        topics.actuator_outputs = self._mirrored(with_peripherals(topics, self._functions, outputs))

    def _state(self) -> RoverState:
        parameters, local = self._parameters, self._topics.vehicle_local_position
        forward, sideways = along_body(self._topics.vehicle_attitude.q, (local.vx, local.vy, local.vz))
        size = math.hypot(forward, sideways)
        speed = math.copysign(size, forward) if size > parameters.speed_threshold else 0.0
        yaw_rate = self._topics.vehicle_angular_velocity.xyz[2]
        if abs(yaw_rate) <= parameters.yaw_rate_threshold:
            yaw_rate = 0.0
        return RoverState((local.x, local.y), local.heading, speed, yaw_rate, local.xy_reset_counter)

    def _publish(self, now_us: int, *, locked: bool) -> None:
        if locked:
            self._topics.actuator_outputs = ActuatorOutputs(now_us, self._stopped, self._stopped_pwm)
            return
        values = {FIRST_SERVO: self._actuators.servo, FIRST_MOTOR: self._actuators.motor}
        each = [self._output(function, values.get(function, 0.0)) for function in self._functions]
        controls, pwm = zip(*each, strict=True) if each else ((), ())
        outputs = with_peripherals(self._topics, self._functions, ActuatorOutputs(now_us, controls, pwm))
        self._topics.actuator_outputs = self._mirrored(outputs)

    def _mirrored(self, outputs: ActuatorOutputs) -> ActuatorOutputs:
        return mirrored(outputs, self._functions, self._reversed, reversible_flags=int(self._parameters.reversible))

    def _output(self, function: int, value: float) -> tuple[float, float]:
        """Control and pulse; a motor that can't turn backwards has all its pulses for the one way (CA_R_REV)."""
        if is_motor(function) or is_servo(function):
            return output(function, value, unchanged, reversible=self._parameters.reversible)
        return 0.0, PWM_DISARMED

    def _refresh(self) -> None:
        self._version = self._source.version
        self._parameters = rover_parameters(self._source)
        functions = [int(self._source[f"PWM_MAIN_FUNC{n}"]) for n in range(1, OUTPUTS + 1)]
        used = [is_motor(function) or is_servo(function) for function in functions]
        self._reversed = int(self._source["PWM_MAIN_REV"])
        self._functions = functions = functions[: last_used(functions, used)]
        self._stopped = (0.0,) * len(functions)
        self._stopped_pwm = (PWM_DISARMED,) * len(functions)


def along_body(attitude: Quaternion, velocity_ned: Vector3) -> tuple[float, float]:
    """Velocity ahead and to the right of the body: uphill, too, what the wheels make good (updateSubscriptions)."""
    m, (north, east, down) = rotation(attitude), velocity_ned
    return m[0] * north + m[3] * east + m[6] * down, m[1] * north + m[4] * east + m[7] * down
