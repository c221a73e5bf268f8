"""Topics: the records through which the modules of the autopilot speak, under their uORB names.

Each topic has one writer, which replaces the record in its slot of `Topics`; everybody else reads. Records are
NamedTuples (cheap to make, impossible to change). Times are `now_us`: int, simulated microseconds since boot
(PX4's hrt_absolute_time). Frames: NED for the world, FRD for the body; quaternions are (w, x, y, z), body to NED.
A missing number is NaN, as in PX4.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from autopilot.constants import NavState, RequestedAction

NAN = math.nan
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
NAN3: Vector3 = (NAN, NAN, NAN)


# --- sensors (writer: sensors.py, from the channel) --------------------------------------------------------


class SensorCombined(NamedTuple):
    """One IMU sample: bias-free it is not; the estimator knows the bias."""

    timestamp: int = 0
    gyro_rad_s: Vector3 = (0.0, 0.0, 0.0)
    accelerometer_m_s2: Vector3 = (0.0, 0.0, -9.80665)


class SensorBaro(NamedTuple):
    """VehicleAirData, as far as it is used."""

    timestamp: int = 0
    pressure_pa: float = NAN
    baro_alt_m: float = NAN
    temperature_c: float = NAN


class SensorMag(NamedTuple):
    """Magnetic field in the body frame, gauss."""

    timestamp: int = 0
    magnetometer_ga: Vector3 = NAN3


class SensorGps(NamedTuple):
    """What the receiver says."""

    timestamp: int = 0
    latitude_deg: float = NAN
    longitude_deg: float = NAN
    altitude_msl_m: float = NAN
    vel_n_m_s: float = NAN
    vel_e_m_s: float = NAN
    vel_d_m_s: float = NAN
    eph: float = NAN
    epv: float = NAN
    fix_type: int = 0
    satellites_used: int = 0


class DistanceSensorSample(NamedTuple):
    """uORB distance_sensor: current_distance is NaN when nothing is in range."""

    timestamp: int = 0
    current_distance: float = NAN
    min_distance: float = NAN
    max_distance: float = NAN
    orientation: int = 25
    h_fov: float = 0.0


class BatteryStatus(NamedTuple):
    """remaining is 0..1; warning is MAV_BATTERY_CHARGE_STATE-like 0 none, 1 low, 2 critical, 3 emergency."""

    timestamp: int = 0
    connected: bool = False
    voltage_v: float = NAN
    current_a: float = NAN
    remaining: float = NAN
    discharged_mah: float = 0.0
    warning: int = 0
    cells_v: tuple[float, ...] = ()
    """Empty where they are not known apart."""
    temperature_c: float = NAN
    time_remaining_s: float = NAN
    """At the average current; NaN without a known capacity."""


class GroundTruth(NamedTuple):
    """What the simulator says is true (HIL_STATE_QUATERNION), for the log alone. x, y, z from where it first was."""

    timestamp: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    xyz: Vector3 = (0.0, 0.0, 0.0)
    """Body rates."""
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    x: float = NAN
    y: float = NAN
    z: float = NAN
    vx: float = NAN
    vy: float = NAN
    vz: float = NAN
    ref_lat: float = NAN
    ref_lon: float = NAN
    ref_alt: float = NAN
    ref_timestamp: int = 0


# --- estimate (writer: estimator) ---------------------------------------------------------------------------


class VehicleAttitude(NamedTuple):
    """Body to NED, with the Euler angles worked out once (roll, pitch, yaw)."""

    timestamp: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    euler: Vector3 = (0.0, 0.0, 0.0)


class VehicleAngularVelocity(NamedTuple):
    """Body rates, bias removed and filtered."""

    timestamp: int = 0
    xyz: Vector3 = (0.0, 0.0, 0.0)
    xyz_derivative: Vector3 = (0.0, 0.0, 0.0)


class VehicleLocalPosition(NamedTuple):
    """NED position, velocity and acceleration from the reference point, as PX4's vehicle_local_position."""

    timestamp: int = 0
    xy_valid: bool = False
    z_valid: bool = False
    v_xy_valid: bool = False
    v_z_valid: bool = False
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    ax: float = 0.0
    ay: float = 0.0
    az: float = 0.0
    heading: float = 0.0
    ref_lat: float = NAN
    ref_lon: float = NAN
    ref_alt: float = NAN
    ref_timestamp: int = 0
    dist_bottom: float = NAN
    dist_bottom_valid: bool = False
    eph: float = NAN
    epv: float = NAN
    evh: float = NAN
    evv: float = NAN
    xy_reset_counter: int = 0
    z_reset_counter: int = 0


class VehicleGlobalPosition(NamedTuple):
    """The same as latitude, longitude (deg) and altitude AMSL (m)."""

    timestamp: int = 0
    valid: bool = False
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    terrain_alt: float = NAN
    eph: float = NAN
    epv: float = NAN


class EstimatorStatus(NamedTuple):
    """Health of the filter: innovation test ratios (1 is the gate) and what ESTIMATOR_STATUS.flags shows."""

    timestamp: int = 0
    tilt_aligned: bool = False
    yaw_aligned: bool = False
    vel_test_ratio: float = 0.0
    pos_test_ratio: float = 0.0
    hgt_test_ratio: float = 0.0
    mag_test_ratio: float = 0.0
    gps_fused: bool = False
    baro_fused: bool = False
    mag_fused: bool = False
    dead_reckoning: bool = False
    gyro_bias: Vector3 = (0.0, 0.0, 0.0)
    accel_bias: Vector3 = (0.0, 0.0, 0.0)
    vibration: Vector3 = (0.0, 0.0, 0.0)
    horizontal_good_us: int = 0
    """When a horizontal position was last taken from a sensor."""
    flow_fused: bool = False
    vision_fused: bool = False
    disabled: frozenset[int] = frozenset()
    """ESTIMATOR_SENSOR_FUSION_SOURCEs that a command has switched off."""


class Innovation(NamedTuple):
    """What one measurement of the filter differed by: estimate minus measurement, as PX4 tells it."""

    innovation: float = NAN
    variance: float = NAN
    """Of the innovation."""
    test_ratio: float = NAN
    """Its square over that of the gate; more than 1 is refused."""


class EstimatorInnovations(NamedTuple):
    """The last innovations of each sensor, by PX4's names of fields; those of a velocity have all three axes."""

    timestamp: int = 0
    by_field: Mapping[str, tuple[Innovation, ...]] = MappingProxyType({})


class WindEstimate(NamedTuple):
    """Wind over ground, NED."""

    timestamp: int = 0
    windspeed_north: float = NAN
    windspeed_east: float = NAN


class VehicleLandDetected(NamedTuple):
    """Writer: land_detector.py."""

    timestamp: int = 0
    landed: bool = True
    maybe_landed: bool = True
    ground_contact: bool = True
    freefall: bool = False
    in_ground_effect: bool = False


# --- state (writer: commander) ---------------------------------------------------------------------------


class VehicleStatus(NamedTuple):
    """Arming and mode. `nav_state` is what is flown, `nav_state_user_intention` what was asked for."""

    timestamp: int = 0
    armed: bool = False
    armed_time: int = 0
    takeoff_time: int = 0
    nav_state: NavState = NavState.AUTO_LOITER
    nav_state_user_intention: NavState = NavState.AUTO_LOITER
    nav_state_timestamp: int = 0
    """When nav_state last changed."""
    system_status: int = 0
    """MAV_STATE of the heartbeat."""
    failsafe: bool = False
    failsafe_defer: bool = False
    termination: bool = False
    gcs_connection_lost: bool = True
    rc_signal_lost: bool = True
    pre_flight_checks_pass: bool = False
    calibrating: bool = False
    vehicle_type: str = "multicopter"
    """multicopter or rover."""
    mav_type: int = 2
    latest_arming_reason: int = 0
    latest_disarming_reason: int = 0


class HealthReport(NamedTuple):
    """Which sensors and systems are there, and well: bits of MAV_SYS_STATUS_SENSOR, and who may arm."""

    timestamp: int = 0
    present: int = 0
    enabled: int = 0
    health: int = 0
    can_arm_mode_flags: int = 0
    """Bit per NavState: arming there is allowed."""
    can_run_mode_flags: int = 0
    """Bit per NavState: switching there is allowed."""


class FailsafeFlags(NamedTuple):
    """What is wrong right now, as PX4's failsafe_flags (True is bad)."""

    angular_velocity_invalid: bool = False
    attitude_invalid: bool = True
    local_altitude_invalid: bool = True
    local_position_invalid: bool = True
    local_velocity_invalid: bool = True
    global_position_invalid: bool = True
    auto_mission_missing: bool = True
    offboard_control_signal_lost: bool = True
    home_position_invalid: bool = True
    manual_control_signal_lost: bool = True
    gcs_connection_lost: bool = True
    battery_warning: int = 0
    battery_unhealthy: bool = False
    geofence_breached: bool = False
    mission_failure: bool = False
    wind_limit_exceeded: bool = False
    flight_time_limit_exceeded: bool = False
    fd_critical_failure: bool = False
    fd_motor_failure: bool = False
    parachute_unhealthy: bool = False
    remote_id_unhealthy: bool = False


class HomePosition(NamedTuple):
    """Home; x, y, z in the local frame."""

    timestamp: int = 0
    valid: bool = False
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    x: float = NAN
    y: float = NAN
    z: float = NAN
    yaw: float = NAN
    manual_home: bool = False
    update_count: int = 0
    roll: float = 0.0
    pitch: float = 0.0


class ActuatorArmed(NamedTuple):
    """Whether motors may turn."""

    armed: bool = False
    lockdown: bool = False
    manual_lockdown: bool = False


# --- navigation (writer: navigator) ----------------------------------------------------------------------


class PositionSetpoint(NamedTuple):
    """One of the triplet. type is one of constants.SetpointType; NaN altitude keeps the present one."""

    timestamp: int = 0
    valid: bool = False
    type: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    yaw: float = NAN
    acceptance_radius: float = NAN
    cruising_speed: float = -1.0
    loiter_radius: float = NAN
    gliding_enabled: bool = False


class PositionSetpointTriplet(NamedTuple):
    """previous, current, next: what the AUTO modes fly."""

    timestamp: int = 0
    previous: PositionSetpoint = PositionSetpoint()
    current: PositionSetpoint = PositionSetpoint()
    next: PositionSetpoint = PositionSetpoint()


class VehicleRoi(NamedTuple):
    """Region of interest: mode 0 none, 1 the next waypoint turned by offsets (rad), 3 a location."""

    mode: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    roll_offset: float = 0.0
    pitch_offset: float = 0.0
    yaw_offset: float = 0.0


class MissionResult(NamedTuple):
    """Progress of the mission, for MISSION_CURRENT and MISSION_ITEM_REACHED."""

    timestamp: int = 0
    mission_id: int = 0
    geofence_id: int = 0
    rally_id: int = 0
    valid: bool = False
    warning: bool = False
    finished: bool = False
    failure: bool = False
    seq_current: int = 0
    seq_reached: int = -1
    seq_reached_timestamp: int = 0
    seq_total: int = 0
    item_do_jump_changed: bool = False
    item_changed_index: int = 0
    mission_state: int = 0
    """MISSION_STATE of MISSION_CURRENT."""


class RtlTimeEstimate(NamedTuple):
    """How long a return from here would take, in seconds; the safe one with a factor and a margin. 0 when not valid."""

    timestamp: int = 0
    valid: bool = False
    time_estimate: float = 0.0
    safe_time_estimate: float = 0.0


class GeofenceResult(NamedTuple):
    """Breach of the fence, and what GF_ACTION asks for."""

    timestamp: int = 0
    breached: bool = False
    action: int = 0
    breach_type: int = 0
    breach_count: int = 0
    breach_time_us: int = 0


# --- setpoints -------------------------------------------------------------------------------------------


class TrajectorySetpoint(NamedTuple):
    """Writer: the flight mode. NED; NaN in every axis that is not controlled."""

    timestamp: int = 0
    position: Vector3 = NAN3
    velocity: Vector3 = NAN3
    acceleration: Vector3 = NAN3
    yaw: float = NAN
    yawspeed: float = NAN


class VehicleConstraints(NamedTuple):
    """Writer: the flight mode; limits of the position controller, NaN for the parameter's."""

    speed_up: float = NAN
    speed_down: float = NAN
    want_takeoff: bool = False


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


class VehicleTorqueSetpoint(NamedTuple):
    """Writer: mc_rate_control, at 50 Hz, for the log: normalised torque about the body's axes."""

    timestamp: int = 0
    xyz: Vector3 = (0.0, 0.0, 0.0)


class RateCtrlStatus(NamedTuple):
    """Writer: mc_rate_control, at 50 Hz, for the log: what its integrators have learnt."""

    timestamp: int = 0
    rollspeed_integ: float = 0.0
    pitchspeed_integ: float = 0.0
    yawspeed_integ: float = 0.0


class ActuatorOutputs(NamedTuple):
    """Writer: control allocation. `controls` as HIL_ACTUATOR_CONTROLS; `pwm` as SERVO_OUTPUT_RAW shows it."""

    timestamp: int = 0
    controls: tuple[float, ...] = ()
    pwm: tuple[int, ...] = ()
    test_mode: bool = False
    """The outputs move for a test, though the vehicle is disarmed."""


class TakeoffStatus(NamedTuple):
    """Writer: mc_pos_control; state is constants.TakeoffState."""

    timestamp: int = 0
    state: int = 0
    tilt_limit: float = NAN


class HoverThrustEstimate(NamedTuple):
    """Thrust that holds the vehicle in the air, normalised."""

    timestamp: int = 0
    hover_thrust: float = 0.5
    valid: bool = False


# --- inputs (writer: the MAVLink services) -----------------------------------------------------------------


SOURCE_UNKNOWN, SOURCE_RC, SOURCE_MAVLINK_0 = 0, 1, 2
"""manual_control_setpoint.data_source; the other MAVLink links follow."""


class InputRc(NamedTuple):
    """Channels as they came, µs of pulse; a channel that its sender ignores is 0."""

    timestamp: int = 0
    values: tuple[int, ...] = ()


Aux = tuple[float, float, float, float, float, float]
NO_AUX: Aux = (0.0,) * 6


class RcParameter(NamedTuple):
    """Which parameter a knob of the RC turns (PARAM_MAP_RC): value0 + scale * (-1..1), within limits; no name: none."""

    name: str = ""
    value0: float = 0.0
    scale: float = 0.0
    value_min: float = 0.0
    value_max: float = 0.0


class ManualControlInput(NamedTuple):
    """Sticks of one source: roll, pitch, yaw, throttle and the six auxiliary ones, each -1..1."""

    timestamp: int = 0
    data_source: int = SOURCE_UNKNOWN
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: float = 0.0
    buttons: int = 0
    aux: Aux = NO_AUX


class ManualControlSwitches(NamedTuple):
    """Switches of the RC: 0 not mapped, 1 on, 3 off; mode_slot 1..6, 0 not mapped. Writer: rc_update."""

    timestamp: int = 0
    mode_slot: int = 0
    arm: int = 0
    return_to_launch: int = 0
    loiter: int = 0
    offboard: int = 0
    kill: int = 0


FRAME_UNKNOWN, FRAME_NED, FRAME_FRD, FRAME_BODY_FRD = range(4)
"""vehicle_odometry POSE_FRAME and VELOCITY_FRAME."""


class VehicleOdometry(NamedTuple):
    """A pose and velocity from outside; NaN where something is not told."""

    timestamp: int = 0
    pose_frame: int = FRAME_UNKNOWN
    position: Vector3 = NAN3
    q: Quaternion = (NAN, NAN, NAN, NAN)
    velocity_frame: int = FRAME_UNKNOWN
    velocity: Vector3 = NAN3
    position_variance: Vector3 = NAN3
    orientation_variance: Vector3 = NAN3
    velocity_variance: Vector3 = NAN3
    reset_counter: int = 0
    quality: int = 0


class VehicleOpticalFlow(NamedTuple):
    """Flow about the body's x and y axes, rad/s, free of rotation: moving forward flows +y, moving right -x."""

    timestamp: int = 0
    x: float = NAN
    y: float = NAN
    quality: int = 0
    integration_timespan_us: int = 0
    pixel_flow: tuple[float, float] = (0.0, 0.0)
    """As measured over that time, rotation included, and the rotation; rad."""
    delta_angle: Vector3 = (0.0, 0.0, 0.0)
    distance_m: float = NAN


class ObstacleDistance(NamedTuple):
    """OBSTACLE_DISTANCE: cm (65535 unknown), degrees; frame is a MAV_FRAME."""

    timestamp: int = 0
    frame: int = 0
    distances: tuple[int, ...] = ()
    increment: float = 0.0
    min_distance: int = 0
    max_distance: int = 0
    angle_offset: float = 0.0


class LandingTargetPose(NamedTuple):
    """Where to land precisely, NED from the local origin; timestamp 0: never told."""

    timestamp: int = 0
    x_abs: float = NAN
    y_abs: float = NAN
    z_abs: float = NAN


class FollowTarget(NamedTuple):
    """Last FOLLOW_TARGET: degrees, m AMSL, m/s NED."""

    timestamp: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    velocity: Vector3 = NAN3


class ActionRequest(NamedTuple):
    """What a gesture (source 0), switch (1), button (2) or mode slot (3) asks; writer: manual_control."""

    number: int
    timestamp: int
    action: RequestedAction
    source: int
    mode: NavState


class ManualControlSetpoint(NamedTuple):
    """The sticks that are flown: roll, pitch, yaw, throttle each -1..1. Writer: manual_control."""

    timestamp: int = 0
    valid: bool = False
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: float = 0.0
    sticks_moving: bool = False
    data_source: int = SOURCE_UNKNOWN
    buttons: int = 0
    aux: Aux = NO_AUX


class OffboardSetpoint(NamedTuple):
    """Last SET_POSITION_TARGET_* or SET_ATTITUDE_TARGET: offboard_control_mode and its setpoint in one.

    Exactly one of trajectory, attitude or rates is set.
    """

    timestamp: int = 0
    trajectory: TrajectorySetpoint | None = None
    attitude: VehicleAttitudeSetpoint | None = None
    rates: VehicleRatesSetpoint | None = None


class VehicleCommand(NamedTuple):
    """COMMAND_LONG or COMMAND_INT as its owner sees it; a place's lat/lon in degrees in param5/param6 for both."""

    command: int
    param1: float = NAN
    param2: float = NAN
    param3: float = NAN
    param4: float = NAN
    param5: float = NAN
    param6: float = NAN
    param7: float = NAN
    frame: int = 0
    """MAV_FRAME of a COMMAND_INT; MAV_FRAME_GLOBAL for a COMMAND_LONG."""
    source_system: int = 0
    source_component: int = 0
    target_system: int = 0
    target_component: int = 0
    from_external: bool = True
    confirmation: int = 0


class CommandRecord(NamedTuple):
    """A command that its owner has accepted and that another module acts on; `number` counts up from 1."""

    number: int
    timestamp: int
    command: VehicleCommand


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


class Gripper(NamedTuple):
    """Writer: payload_deliverer. Closed 1, open -1, as the output of function 430 carries it."""

    position: float = -1.0
    accepted_us: int = -1
    """When a DO_GRIPPER was last answered ACCEPTED: it is done."""


class FailureInjection(NamedTuple):
    """Writer: failure_injection.py. Failures that are on: (FAILURE_UNIT, FAILURE_TYPE, bit per instance) each."""

    entries: tuple[tuple[int, int, int], ...] = ()

    def type_of(self, unit: int, instance: int) -> int:
        """FAILURE_TYPE of an instance (1 is the first) of a FAILURE_UNIT; 0: it is well."""
        for failed, kind, instances in self.entries:
            if failed == unit and instances >> (instance - 1) & 1:
                return kind
        return 0


class VehicleCommandAck(NamedTuple):
    """An answer to a command that comes after the first one, for whoever sent the command."""

    command: VehicleCommand
    result: int
    progress: int = 0
    result_param2: int = 0


class LoggerStatus(NamedTuple):
    """Writer: logger.py, while a log is being written."""

    timestamp: int = 0
    is_logging: bool = False


class CpuLoad(NamedTuple):
    """Writer: load_mon.py. Shares of 1."""

    timestamp: int = 0
    load: float = 0.0
    ram_usage: float = 0.0


class GcsHeartbeats(NamedTuple):
    """When a ground station was last heard, and components of this vehicle (0: never); who of them said to be well."""

    gcs_us: int = 0
    onboard_us: int = 0
    parachute_us: int = 0
    parachute_healthy: bool = False
    open_drone_id_us: int = 0
    open_drone_id_healthy: bool = False
    adsb_us: int = 0


class FailureDetectorStatus(NamedTuple):
    """uORB failure_detector_status: tilted too far for too long."""

    timestamp: int = 0
    fd_roll: bool = False
    fd_pitch: bool = False


class TransponderReport(NamedTuple):
    """uORB transponder_report: an aircraft nearby. Degrees, m AMSL, heading in -π..π, m/s; `number` counts up."""

    timestamp: int
    number: int
    icao_address: int
    lat: float
    lon: float
    altitude_type: int
    altitude: float
    heading: float
    hor_velocity: float
    ver_velocity: float
    callsign: bytes
    emitter_type: int
    tslc: int
    flags: int
    """Bits of ADSB_FLAGS, the first six."""
    squawk: int
    retranslate: bool = True
    """Whether MAVLink tells it again."""


TRANSPONDER_REPORTS_KEPT = 20
"""Length of transponder_report's queue."""


class DebugKeyValue(NamedTuple):
    """uORB debug_key_value: the last NAMED_VALUE_FLOAT or NAMED_VALUE_INT of others; timestamp 0 when there is none."""

    timestamp: int = 0
    key: bytes = b""
    value: float = 0.0


class DebugValue(NamedTuple):
    """uORB debug_value: the last DEBUG of others."""

    timestamp: int = 0
    ind: int = 0
    value: float = 0.0


class DebugVect(NamedTuple):
    """uORB debug_vect: the last DEBUG_VECT of others."""

    timestamp: int = 0
    name: bytes = b""
    xyz: Vector3 = (0.0, 0.0, 0.0)


class DebugArray(NamedTuple):
    """uORB debug_array: the last DEBUG_FLOAT_ARRAY of others."""

    timestamp: int = 0
    id: int = 0
    name: bytes = b""
    data: tuple[float, ...] = ()


class CameraTriggered(NamedTuple):
    """uORB camera_trigger: an image was asked of the camera; timestamp 0 when none ever was."""

    timestamp: int = 0
    seq: int = 0


class CameraCapture(NamedTuple):
    """uORB camera_capture: where the vehicle was; ground_distance is the height above home."""

    timestamp: int = 0
    seq: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    ground_distance: float = NAN
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class GimbalManagerSetAttitude(NamedTuple):
    """Last GIMBAL_MANAGER_SET_ATTITUDE, _SET_PITCHYAW or _SET_MANUAL_CONTROL; manual rates are -1..1."""

    timestamp: int = 0
    origin_sysid: int = 0
    origin_compid: int = 0
    flags: int = 0
    q: Quaternion = (NAN, NAN, NAN, NAN)
    angular_velocity: Vector3 = NAN3
    manual: bool = False


class GimbalDeviceSetAttitude(NamedTuple):
    """Writer: gimbal manager; NaN where nothing is wanted."""

    timestamp: int = 0
    target_component: int = 0
    flags: int = 0
    q: Quaternion = (NAN, NAN, NAN, NAN)
    angular_velocity: Vector3 = NAN3


class GimbalDeviceInformation(NamedTuple):
    """What a gimbal device said of itself; angles in rad. component 0: none was heard."""

    component: int = 0
    cap_flags: int = 0
    roll_min: float = NAN
    roll_max: float = NAN
    pitch_min: float = NAN
    pitch_max: float = NAN
    yaw_min: float = NAN
    yaw_max: float = NAN


class GimbalDeviceAttitudeStatus(NamedTuple):
    """What a gimbal device last said of its attitude."""

    timestamp: int = 0
    device_flags: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class GimbalManagerStatus(NamedTuple):
    """Writer: gimbal manager."""

    timestamp: int = 0
    flags: int = 0
    gimbal_device_id: int = 0
    primary_control_sysid: int = 0
    primary_control_compid: int = 0


class OrbitStatus(NamedTuple):
    """What the orbit mode flies (ORBIT_EXECUTION_STATUS); timestamp 0 when it was never flown."""

    timestamp: int = 0
    radius: float = NAN
    frame: int = 5
    """MAV_FRAME_GLOBAL_INT."""
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    yaw_behaviour: int = 0


def queue_transponder_report(topics: "Topics", report: TransponderReport) -> None:
    """Publish a report, numbered; the oldest gives way."""
    reports = topics.transponder_reports
    number = reports[-1].number + 1 if reports else 1
    topics.transponder_reports = (*reports[1 - TRANSPONDER_REPORTS_KEPT :], report._replace(number=number))


def batteries(topics: "Topics") -> list[BatteryStatus]:
    """Those that are connected."""
    return [battery for battery in (topics.battery_status, topics.battery_status_outside) if battery.connected]


class Topics:
    """The present record of every topic; one slot each, each with one writer."""

    def __init__(self) -> None:
        self.sensor_combined = SensorCombined()
        self.sensor_baro = SensorBaro()
        self.sensor_mag = SensorMag()
        self.sensor_gps = SensorGps()
        self.distance_sensor = DistanceSensorSample()
        self.battery_status = BatteryStatus()
        self.groundtruth = GroundTruth()
        self.battery_status_outside = BatteryStatus()
        """Writer: mavlink/services/battery_status.py, for a battery that tells of itself."""
        self.vehicle_attitude = VehicleAttitude()
        self.vehicle_angular_velocity = VehicleAngularVelocity()
        self.vehicle_local_position = VehicleLocalPosition()
        self.vehicle_global_position = VehicleGlobalPosition()
        self.estimator_status = EstimatorStatus()
        self.estimator_innovations = EstimatorInnovations()
        self.wind = WindEstimate()
        self.vehicle_land_detected = VehicleLandDetected()
        self.vehicle_status = VehicleStatus()
        self.health_report = HealthReport()
        self.failsafe_flags = FailsafeFlags()
        self.failure_detector_status = FailureDetectorStatus()
        self.home_position = HomePosition()
        self.actuator_armed = ActuatorArmed()
        self.position_setpoint_triplet = PositionSetpointTriplet()
        self.vehicle_roi = VehicleRoi()
        self.camera_trigger = CameraTriggered()
        self.camera_capture = CameraCapture()
        self.gimbal_manager_set_attitude = GimbalManagerSetAttitude()
        self.gimbal_device_set_attitude = GimbalDeviceSetAttitude()
        self.gimbal_device_information = GimbalDeviceInformation()
        self.gimbal_device_attitude_status = GimbalDeviceAttitudeStatus()
        self.gimbal_manager_status = GimbalManagerStatus()
        self.mission_result = MissionResult()
        self.geofence_result = GeofenceResult()
        self.rtl_time_estimate = RtlTimeEstimate()
        self.trajectory_setpoint = TrajectorySetpoint()
        self.vehicle_constraints = VehicleConstraints()
        self.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint()
        self.vehicle_attitude_setpoint = VehicleAttitudeSetpoint()
        self.vehicle_rates_setpoint = VehicleRatesSetpoint()
        self.vehicle_torque_setpoint = VehicleTorqueSetpoint()
        self.rate_ctrl_status = RateCtrlStatus()
        self.actuator_outputs = ActuatorOutputs()
        self.takeoff_status = TakeoffStatus()
        self.hover_thrust_estimate = HoverThrustEstimate()
        self.vehicle_visual_odometry = VehicleOdometry()
        self.vehicle_optical_flow = VehicleOpticalFlow()
        self.obstacle_distance = ObstacleDistance()
        self.obstacle_distance_fused = ObstacleDistance()
        """Writer: collision prevention; its map around the body."""
        self.distance_sensor_outside = DistanceSensorSample()
        self.distance_sensor_sideways = DistanceSensorSample(orientation=0)
        self.landing_target_pose = LandingTargetPose()
        self.follow_target = FollowTarget()
        self.input_rc = InputRc()
        self.rc_parameter_map: tuple[RcParameter, RcParameter, RcParameter] = (RcParameter(),) * 3
        """By knob, RC_MAP_PARAM1 to 3. Writer: mavlink/services/parameter.py."""
        self.manual_control_rc = ManualControlInput()
        self.manual_control_mavlink = ManualControlInput()
        self.manual_control_switches = ManualControlSwitches()
        self.action_requests: tuple[ActionRequest, ...] = ()
        self.manual_control_setpoint = ManualControlSetpoint()
        self.offboard_setpoint = OffboardSetpoint()
        self.gcs_heartbeats = GcsHeartbeats()
        self.transponder_reports: tuple[TransponderReport, ...] = ()
        """Writer: `queue_transponder_report`; the last few."""
        self.debug_key_value = DebugKeyValue()
        self.debug_value = DebugValue()
        self.debug_vect = DebugVect()
        self.debug_array = DebugArray()
        self.cpuload = CpuLoad()
        self.logger_status = LoggerStatus()
        self.orbit_status = OrbitStatus()
        self.actuator_test = ActuatorTest()
        self.actuator_set = ActuatorSet()
        self.gripper = Gripper()
        self.failure_injection = FailureInjection()
        self.vehicle_commands: tuple[CommandRecord, ...] = ()
        """Writer: commander; the last few accepted commands that navigator and flight modes act on."""
        self.navigator_commands: tuple[CommandRecord, ...] = ()
        """Writer: navigator; the last few commands that mission items gave, for the commander."""
        self.vehicle_command_acks: tuple[VehicleCommandAck, ...] = ()
        """Writers: owners of commands (`commands.answer_later`); mavlink/services/command.py sends and empties it."""
