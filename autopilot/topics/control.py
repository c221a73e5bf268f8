"""From set-points to actuators (writers: modes/, control/, mavlink/services/ and uxrce_dds_client/offboard.py)."""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN, NAN3, Quaternion, Vector3


class TrajectorySetpoint(NamedTuple):
    """Writer: the flight mode. NED; NaN in every axis that is not controlled."""

    timestamp: int = 0
    position: Vector3 = NAN3
    velocity: Vector3 = NAN3
    acceleration: Vector3 = NAN3
    yaw: float = NAN
    yawspeed: float = NAN
    jerk: Vector3 = NAN3
    """For the log alone."""


class LandingGear(NamedTuple):
    """Writers: the flight mode, when it begins to ask for another, and a switch. 1 up, -1 down, 0 as it is."""

    timestamp: int = 0
    landing_gear: int = 0


class VehicleConstraints(NamedTuple):
    """Writer: the flight mode; limits of the position controller, NaN for the parameter's."""

    speed_up: float = NAN
    speed_down: float = NAN
    want_takeoff: bool = False


class PositionControllerStatus(NamedTuple):
    """Writer: rover_ackermann: how near it takes a waypoint for reached, in metres; 0 before it was told."""

    timestamp: int = 0
    acceptance_radius: float = 0.0


class VehicleLocalPositionSetpoint(NamedTuple):
    """Writer: mc_pos_control: what it really tracks (POSITION_TARGET_LOCAL_NED)."""

    timestamp: int = 0
    x: float = NAN
    y: float = NAN
    z: float = NAN
    vx: float = NAN
    vy: float = NAN
    vz: float = NAN
    acceleration: Vector3 = NAN3
    thrust: Vector3 = NAN3
    yaw: float = NAN
    yawspeed: float = NAN


class VehicleAttitudeSetpoint(NamedTuple):
    """thrust_body is FRD, normalised, so that hover is about (0, 0, -MPC_THR_HOVER)."""

    timestamp: int = 0
    q_d: Quaternion = (1.0, 0.0, 0.0, 0.0)
    yaw_sp_move_rate: float = 0.0
    thrust_body: Vector3 = (0.0, 0.0, 0.0)


class VehicleRatesSetpoint(NamedTuple):
    """Body rates and thrust."""

    timestamp: int = 0
    rates: Vector3 = (0.0, 0.0, 0.0)
    thrust_body: Vector3 = (0.0, 0.0, 0.0)


class VehicleThrustSetpoint(NamedTuple):
    """Writer: mc_rate_control: what the allocation is asked for, normalised, along the body's axes."""

    timestamp: int = 0
    xyz: Vector3 = (0.0, 0.0, 0.0)


class VehicleTorqueSetpoint(NamedTuple):
    """Writer: mc_rate_control, at 50 Hz, for the log: normalised torque about the body's axes."""

    timestamp: int = 0
    xyz: Vector3 = (0.0, 0.0, 0.0)


class ActuatorControlsStatus(NamedTuple):
    """Writer: mc_rate_control, twice a second (uORB actuator_controls_status_0)."""

    timestamp: int = 0
    control_power: Vector3 = (0.0, 0.0, 0.0)
    """Mean squares of the torques about roll, pitch and yaw."""


class RateCtrlStatus(NamedTuple):
    """Writer: mc_rate_control, at 50 Hz, for the log: what its integrators have learnt."""

    timestamp: int = 0
    rollspeed_integ: float = 0.0
    pitchspeed_integ: float = 0.0
    yawspeed_integ: float = 0.0


class ActuatorOutputs(NamedTuple):
    """Writer: control allocation. `controls` as HIL_ACTUATOR_CONTROLS; `pwm` in µs. Up to the last output that carries
    something: of all of them mixer.py tells."""

    timestamp: int = 0
    controls: tuple[float, ...] = ()
    pwm: tuple[float, ...] = ()
    test_mode: bool = False
    """The outputs move for a test, though the vehicle is disarmed."""


class ControlAllocatorStatus(NamedTuple):
    """Writer: control_allocator, at 5 Hz, for the log: what it could not give, which actuators are at their ends."""

    timestamp: int = 0
    unallocated_torque: Vector3 = NAN3
    unallocated_thrust: Vector3 = NAN3
    torque_setpoint_achieved: bool = False
    thrust_setpoint_achieved: bool = False
    actuator_saturation: tuple[int, ...] = (2,) * 16
    """16 of them: 2 at the upper end, -2 at the lower; one that is not there has both ends at 0: upper."""
    handled_motor_failure_mask: int = 0
    motor_stop_mask: int = 0
    actuator_group_preflight_check_active: bool = False


class CollisionConstraints(NamedTuple):
    """uORB collision_constraints: north and east acceleration, m/s2. Writer: modes/collision_prevention.py."""

    timestamp: int = 0
    original_setpoint: tuple[float, float] = (NAN, NAN)
    adapted_setpoint: tuple[float, float] = (NAN, NAN)


class AutotuneAttitudeControlStatus(NamedTuple):
    """uORB autotune_attitude_control_status. Writer: control/mc_autotune.py, ten times a second while it tunes."""

    timestamp: int = 0
    coeff: tuple[float, ...] = (0.0,) * 5
    coeff_var: tuple[float, ...] = (0.0,) * 5
    fitness: float = 0.0
    innov: float = 0.0
    dt_model: float = 0.0
    kc: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    att_p: float = 0.0
    rate_sp: Vector3 = (0.0, 0.0, 0.0)
    u_filt: float = 0.0
    y_filt: float = 0.0
    state: int = 0


class TakeoffStatus(NamedTuple):
    """Writer: mc_pos_control; state is constants.TakeoffState."""

    timestamp: int = 0
    state: int = 0
    tilt_limit: float = NAN


class HoverThrustEstimate(NamedTuple):
    """Thrust that holds the vehicle in the air, normalised, and its variance; NaN while nothing is estimated.

    Then the last innovation of the acceleration (m/s²), its variance and test ratio, and the variance of its noise.
    """

    timestamp: int = 0
    hover_thrust: float = NAN
    valid: bool = False
    hover_thrust_var: float = NAN
    accel_innov: float = NAN
    accel_innov_var: float = NAN
    accel_innov_test_ratio: float = NAN
    accel_noise_var: float = NAN


class GotoSetpoint(NamedTuple):
    """A place to go to by a smoothed trajectory. NaN: no heading of its own, the vehicle's own limits."""

    timestamp: int
    position: Vector3
    """NED, m."""
    heading: float = NAN
    max_horizontal_speed: float = NAN
    max_vertical_speed: float = NAN
    max_heading_rate: float = NAN


class ThrustAndTorque(NamedTuple):
    """What ROS 2 asks of the allocation, in place of the rate controller."""

    thrust: VehicleThrustSetpoint = VehicleThrustSetpoint()
    torque: VehicleTorqueSetpoint = VehicleTorqueSetpoint()


class ActuatorMotors(NamedTuple):
    """Thrust of each motor, 0 to 1, or -1 to 1 where its bit of `reversible_flags` is set; NaN stops it."""

    timestamp: int = 0
    control: tuple[float, ...] = ()
    reversible_flags: int = 0


class ActuatorServos(NamedTuple):
    """Place of each servo, -1 to 1; NaN leaves it to its disarmed place."""

    timestamp: int = 0
    control: tuple[float, ...] = ()


class DirectActuator(NamedTuple):
    """What ROS 2 tells the outputs, in place of all controllers."""

    motors: ActuatorMotors = ActuatorMotors()
    servos: ActuatorServos = ActuatorServos()


class RoverSetpoint(NamedTuple):
    """What ROS 2 tells a rover's controllers: when it did so last (0: never), and the value; NaN moves nothing."""

    speed: tuple[int, float] = (0, NAN)
    """m/s, forward."""
    yaw: tuple[int, float] = (0, NAN)
    """rad, from north."""
    yaw_rate: tuple[int, float] = (0, NAN)
    """rad/s."""
    throttle: tuple[int, float] = (0, NAN)
    """-1 to 1."""
    steering: tuple[int, float] = (0, NAN)
    """-1 to 1."""


class OffboardSetpoint(NamedTuple):
    """Last SET_POSITION_TARGET_* or SET_ATTITUDE_TARGET, or ROS 2's: offboard_control_mode and its setpoint in one.

    One of trajectory, attitude, rates, thrust_and_torque and direct_actuator is set, the one that is asked for; where
    nobody has told it yet, its own time is 0. None is where nothing is asked for (timestamp 0).
    """

    timestamp: int = 0
    trajectory: TrajectorySetpoint | None = None
    attitude: VehicleAttitudeSetpoint | None = None
    rates: VehicleRatesSetpoint | None = None
    goto: GotoSetpoint | None = None
    """Where ROS 2 gives a place instead of a trajectory; `trajectory` then has that place."""
    rover: RoverSetpoint | None = None
    """What ROS 2 tells a rover's controllers, of which those run that the setpoint asks for; None where OFFBOARD tells
    them itself, of a trajectory's position or velocity."""
    thrust_and_torque: ThrustAndTorque | None = None
    direct_actuator: DirectActuator | None = None


class ActuatorTest(NamedTuple):
    """Writer: commander. The newest MAV_CMD_ACTUATOR_TEST; time-out 0 releases the function. NaN stops a motor."""

    timestamp: int = 0
    function: int = 0
    """PX4's output function: motor 1 is 101, servo 1 is 201."""
    value: float = NAN
    timeout_us: int = 0


class ActuatorSet(NamedTuple):
    """Writer: commander. DO_SET_ACTUATOR: -1..1 for the outputs of functions 301 to 306; NaN where nobody set one."""

    values: tuple[float, ...] = (NAN,) * 6
