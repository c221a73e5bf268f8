"""What PX4 logs of each topic, from our records: a row each, with PX4's names and meanings of fields."""

import math
import struct
from collections.abc import Sequence

from autopilot.commands import CommandResult
from autopilot.constants import NavState
from autopilot.events import Event
from autopilot.logger.packing import FORMATS, Extra, Pack, Row, Value, by_name, row
from autopilot.logger.ulog import array_length
from autopilot.topics import (
    ActuatorArmed,
    ActuatorOutputs,
    BatteryStatus,
    CpuLoad,
    DistanceSensorSample,
    EstimatorInnovations,
    EstimatorStatus,
    FailsafeFlags,
    GroundTruth,
    HomePosition,
    HoverThrustEstimate,
    Innovation,
    InputRc,
    ManualControlSetpoint,
    ManualControlSwitches,
    MissionResult,
    OffboardSetpoint,
    PositionSetpoint,
    PositionSetpointTriplet,
    RateCtrlStatus,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorMag,
    TakeoffStatus,
    TrajectorySetpoint,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleAttitudeSetpoint,
    VehicleCommand,
    VehicleConstraints,
    VehicleGlobalPosition,
    VehicleLandDetected,
    VehicleLocalPosition,
    VehicleLocalPositionSetpoint,
    VehicleRatesSetpoint,
    VehicleRoi,
    VehicleStatus,
    VehicleTorqueSetpoint,
    WindEstimate,
)

NAN = math.nan
TIME = struct.Struct("<Q")
SENSOR_DT_US = 4000
"""Integration time of an IMU sample."""
SIMULATED_IMU = 1310988
SIMULATED_BAROMETER, SIMULATED_MAGNETOMETER, SIMULATED_GPS, SIMULATED_DISTANCE_SENSOR = (
    6620172,
    197388,
    11468804,
    9240836,
)
"""Device ids of PX4's simulated sensors (bus type SIMULATION, DRV_*_DEVTYPE_SIM)."""
MULTICOPTER, ROVER = 1, 3
"""vehicle_status.vehicle_type: rotary wing, rover."""
DISARMED, ARMED = 1, 2
"""vehicle_status.arming_state."""
STANDARD_PRESSURE_DENSITY = 287.1
"""Gas constant of air, J/(kg·K): density from pressure and temperature."""
KELVIN = 273.15
OUTPUTS, RC_CHANNELS, EVENT_ARGUMENTS = 16, 18, 25
"""Lengths of arrays."""
RC_OVER_MAVLINK = 6
"""input_rc.input_source."""
AUTO = frozenset(
    {
        NavState.AUTO_MISSION,
        NavState.AUTO_LOITER,
        NavState.AUTO_RTL,
        NavState.AUTO_TAKEOFF,
        NavState.AUTO_LAND,
        NavState.AUTO_FOLLOW_TARGET,
        NavState.AUTO_PRECLAND,
        NavState.DESCEND,
        NavState.ORBIT,
    }
)
STICKS = frozenset(
    {NavState.MANUAL, NavState.ALTCTL, NavState.POSCTL, NavState.POSITION_SLOW, NavState.ACRO, NavState.STAB}
)
NO_ALTITUDE = frozenset({NavState.MANUAL, NavState.ACRO, NavState.STAB, NavState.TERMINATION})
NO_POSITION = NO_ALTITUDE | {NavState.ALTCTL, NavState.DESCEND, NavState.ALTITUDE_CRUISE}
"""How vehicle_control_mode follows from the mode (commander: ModeUtil/control_mode.cpp)."""


def padded(values: Sequence[float], length: int, with_what: float) -> tuple[float, ...]:
    """An array of fixed length."""
    return (*values[:length], *(with_what,) * (length - len(values)))


@row("sensor_combined")
def sensor_combined(pack: Pack, record: SensorCombined) -> bytes:
    """One IMU sample."""
    time_us, (gx, gy, gz), (ax, ay, az) = record
    return pack(time_us, gx, gy, gz, SENSOR_DT_US, 0, ax, ay, az, SENSOR_DT_US, 0, 0, 0, 0)


@row("vehicle_acceleration")
def vehicle_acceleration(pack: Pack, record: SensorCombined) -> bytes:
    """Specific force, as measured."""
    return pack(record.timestamp, record.timestamp, *record.accelerometer_m_s2)


@row("vehicle_air_data")
def vehicle_air_data(pack: Pack, record: SensorBaro) -> bytes:
    """Pressure altitude, and the density that goes with it."""
    time_us, pressure, altitude, temperature = record
    density = pressure / (STANDARD_PRESSURE_DENSITY * (temperature + KELVIN))
    return pack(time_us, time_us, SIMULATED_BAROMETER, altitude, pressure, temperature, density, 0, 0)


@row("sensor_baro")
def sensor_baro(pack: Pack, record: SensorBaro) -> bytes:
    """The barometer's own reading."""
    time_us, pressure, _, temperature = record
    return pack(time_us, time_us, SIMULATED_BAROMETER, pressure, temperature, 0)


@row("vehicle_magnetometer")
def vehicle_magnetometer(pack: Pack, record: SensorMag) -> bytes:
    """Field in the body frame, gauss."""
    return pack(record.timestamp, record.timestamp, SIMULATED_MAGNETOMETER, *record.magnetometer_ga, 0)


@row("sensor_mag")
def sensor_mag(pack: Pack, record: SensorMag) -> bytes:
    """The magnetometer's own reading; its temperature is not known."""
    return pack(record.timestamp, record.timestamp, SIMULATED_MAGNETOMETER, *record.magnetometer_ga, NAN, 0)


def gps(topic: str, boot_unix_us: int) -> Row:
    """A row of what the receiver says; the date of time 0 gives its clock."""

    def compute(record: SensorGps) -> tuple[Value, ...]:
        north, east = record.vel_n_m_s, record.vel_e_m_s
        unix_us = boot_unix_us + record.timestamp
        return math.hypot(north, east), math.atan2(east, north), record.fix_type >= 3, unix_us

    return by_name(topic, SensorGps, GPS, ("vel_m_s", "cog_rad", "vel_ned_valid", "time_utc_usec"), compute)


@row("vehicle_attitude")
def vehicle_attitude(pack: Pack, record: VehicleAttitude) -> bytes:
    """Body to NED."""
    time_us = record.timestamp
    return pack(time_us, time_us, *record.q, 1.0, 0.0, 0.0, 0.0, 0)


@row("vehicle_angular_velocity")
def vehicle_angular_velocity(pack: Pack, record: VehicleAngularVelocity) -> bytes:
    """Body rates and their derivative."""
    time_us, xyz, derivative = record
    return pack(time_us, time_us, *xyz, *derivative)


LOCAL_POSITION: Extra = {
    "timestamp_sample": "timestamp",
    "delta_xy": 0.0,
    "delta_vxy": 0.0,
    "delta_z": 0.0,
    "delta_vz": 0.0,
    "delta_heading": 0.0,
    "z_deriv": "vz",
    "unaided_heading": "heading",
    "heading_good_for_control": "xy_valid",
    "vxy_max": math.inf,
    "vz_max": math.inf,
    "hagl_max_z": math.inf,
    "hagl_max_xy": math.inf,
}
GLOBAL_POSITION: Extra = {
    "timestamp_sample": "timestamp",
    "alt_ellipsoid": "alt",
    "delta_alt": 0.0,
    "delta_terrain": 0.0,
    "lat_lon_valid": "valid",
    "alt_valid": "valid",
}
TRUE_GLOBAL_POSITION: Extra = {
    "timestamp_sample": "timestamp",
    "alt_ellipsoid": "alt",
    **dict.fromkeys(("delta_alt", "delta_terrain", "eph", "epv", "terrain_alt"), 0.0),
    "lat_lon_valid": 1,
    "alt_valid": 1,
}
TRUE_LOCAL_POSITION: Extra = {
    "timestamp_sample": "timestamp",
    "z_deriv": "vz",
    **dict.fromkeys(("delta_xy", "delta_vxy", "delta_z", "delta_vz", "delta_heading", "eph", "epv", "evh", "evv"), 0.0),
    **dict.fromkeys(("xy_valid", "z_valid", "v_xy_valid", "v_z_valid", "xy_global", "z_global"), 1),
    **dict.fromkeys(("vxy_max", "vz_max", "hagl_max_z", "hagl_max_xy"), math.inf),
}
ESTIMATOR_STATUS: dict[str, float | str] = {
    "timestamp_sample": "timestamp",
    "output_tracking_error": 0.0,
    "hdg_test_ratio": "mag_test_ratio",
    "accel_device_id": SIMULATED_IMU,
    "gyro_device_id": SIMULATED_IMU,
    "baro_device_id": SIMULATED_BAROMETER,
    "mag_device_id": SIMULATED_MAGNETOMETER,
}
ESTIMATOR_FLAGS: Extra = {
    "timestamp_sample": "timestamp",
    "cs_tilt_align": "tilt_aligned",
    "cs_yaw_align": "yaw_aligned",
    "cs_gnss_pos": "gps_fused",
    "cs_gnss_vel": "gps_fused",
    "cs_mag": "mag_fused",
    "cs_baro_hgt": "baro_fused",
    "cs_inertial_dead_reckoning": "dead_reckoning",
}
ESTIMATOR_BIAS: Extra = {
    "timestamp_sample": "timestamp",
    "gyro_device_id": SIMULATED_IMU,
    "gyro_bias_valid": "tilt_aligned",
    "accel_device_id": SIMULATED_IMU,
    "accel_bias_valid": "tilt_aligned",
    "mag_device_id": SIMULATED_MAGNETOMETER,
}
SWITCHES: Extra = {
    "timestamp_sample": "timestamp",
    "arm_switch": "arm",
    "return_switch": "return_to_launch",
    "loiter_switch": "loiter",
    "offboard_switch": "offboard",
    "kill_switch": "kill",
}
HOME: Extra = {"valid_alt": "valid", "valid_hpos": "valid", "valid_lpos": "valid"}
BATTERY: Extra = {"current_average_a": "current_a", "scale": 1.0, "id": 1}
MANUAL_CONTROL: Extra = {"timestamp_sample": "timestamp"}
DISTANCE: Extra = {"device_id": SIMULATED_DISTANCE_SENSOR, "q": 0.0}
STATUS: dict[str, float | str] = {
    "nav_state_display": "nav_state",
    "failsafe_defer_state": "failsafe_defer",
    "system_type": "mav_type",
    "component_id": 1,
    "power_input_valid": 1,
    "calibration_enabled": "calibrating",
}


GPS: Extra = {
    "timestamp_sample": "timestamp",
    "altitude_ellipsoid_m": "altitude_msl_m",
    "device_id": SIMULATED_GPS,
    "s_variance_m_s": 0.4,
    "c_variance_rad": 0.1,
    "hdop": 0.7,
    "vdop": 1.1,
}
IMU_STATUS: dict[str, float | str] = {
    "accel_device_id": SIMULATED_IMU,
    "gyro_device_id": SIMULATED_IMU,
    "accel_rate_hz": 250.0,
    "gyro_rate_hz": 250.0,
    "accel_raw_rate_hz": 250.0,
    "gyro_raw_rate_hz": 250.0,
}


def _global_origin(record: VehicleLocalPosition) -> tuple[Value, ...]:
    return record.ref_lat == record.ref_lat, record.ref_alt == record.ref_alt


def _control_mode_flags(record: EstimatorStatus) -> tuple[Value, ...]:
    """The first bits of estimator_status_flags, as PX4 packs them."""
    return (
        record.tilt_aligned
        | record.yaw_aligned << 1
        | record.gps_fused << 2
        | record.mag_fused << 5
        | record.baro_fused << 9,
    )


def _arming_and_type(record: VehicleStatus) -> tuple[Value, ...]:
    return ARMED if record.armed else DISARMED, ROVER if record.vehicle_type == "rover" else MULTICOPTER


@row("vehicle_control_mode")
def vehicle_control_mode(pack: Pack, record: VehicleStatus) -> bytes:
    """Which controllers the mode asks for."""
    mode = record.nav_state
    position, altitude = mode not in NO_POSITION, mode not in NO_ALTITUDE
    return pack(
        record.timestamp,
        record.armed,
        position and record.vehicle_type == "multicopter",
        mode in STICKS,
        mode in AUTO,
        mode == NavState.OFFBOARD,
        position,
        position,
        altitude,
        altitude,
        mode not in (NavState.ACRO, NavState.TERMINATION),
        mode != NavState.TERMINATION,
        mode != NavState.TERMINATION,
    )


_position_setpoint = by_name("position_setpoint", PositionSetpoint)


def position_setpoint_triplet(record: PositionSetpointTriplet) -> bytes:
    """Where the navigator goes: previous, current, next."""
    return TIME.pack(record.timestamp) + b"".join(_position_setpoint(setpoint) for setpoint in record[1:])


@row("trajectory_setpoint")
def trajectory_setpoint(pack: Pack, record: TrajectorySetpoint) -> bytes:
    """What the flight mode wants; jerk is not told."""
    return pack(
        record.timestamp,
        *record.position,
        *record.velocity,
        *record.acceleration,
        NAN,
        NAN,
        NAN,
        record.yaw,
        record.yawspeed,
    )


@row("vehicle_attitude_setpoint")
def vehicle_attitude_setpoint(pack: Pack, record: VehicleAttitudeSetpoint) -> bytes:
    """What attitude control tracks."""
    time_us, q_d, yaw_rate, thrust = record
    return pack(time_us, yaw_rate, *q_d, *thrust)


@row("vehicle_rates_setpoint")
def vehicle_rates_setpoint(pack: Pack, record: VehicleRatesSetpoint) -> bytes:
    """What rate control tracks."""
    time_us, rates, thrust = record
    return pack(time_us, *rates, *thrust, False)


@row("vehicle_thrust_setpoint")
def vehicle_thrust_setpoint(pack: Pack, record: VehicleRatesSetpoint) -> bytes:
    """What the allocation is asked for, along the body's axes."""
    return pack(record.timestamp, record.timestamp, *record.thrust_body)


@row("vehicle_torque_setpoint")
def vehicle_torque_setpoint(pack: Pack, record: VehicleTorqueSetpoint) -> bytes:
    """What the allocation is asked for, about the body's axes."""
    return pack(record.timestamp, record.timestamp, *record.xyz)


def actuators(topic: str, functions: Sequence[int], first: int, tail: tuple[int, ...] = ()) -> Row:
    """A row of the outputs that carry the functions from `first` on; NaN where there is none."""
    (length,) = (array_length(kind)[1] for kind, name in FORMATS[topic] if name == "control")
    channels = [functions.index(first + n) if first + n in functions else -1 for n in range(length)]
    while channels and channels[-1] < 0:
        channels.pop()
    rest = (NAN,) * (length - len(channels)) + tail

    @row(topic)
    def actuator_controls(pack: Pack, record: ActuatorOutputs) -> bytes:
        controls = record.controls
        values = [controls[n] if 0 <= n < len(controls) else NAN for n in channels]
        return pack(record.timestamp, record.timestamp, *values, *rest)

    return actuator_controls


@row("actuator_outputs")
def actuator_outputs(pack: Pack, record: ActuatorOutputs) -> bytes:
    """Microseconds of each output."""
    return pack(record.timestamp, len(record.pwm), *padded(record.pwm, OUTPUTS, 0.0))


@row("input_rc")
def input_rc(pack: Pack, record: InputRc) -> bytes:
    """Channels of an RC that came over MAVLink."""
    time_us, channels = record
    signal = (-1, NAN, 0, 0, 0, 0)
    return pack(
        time_us,
        time_us,
        *signal,
        *padded(channels, RC_CHANNELS, 0),
        len(channels),
        False,
        False,
        RC_OVER_MAVLINK,
        -1,
        -1,
    )


@row("offboard_control_mode")
def offboard_control_mode(pack: Pack, record: OffboardSetpoint) -> bytes:
    """What an offboard setpoint sets."""
    trajectory = record.trajectory

    def given(vector: tuple[float, float, float] | None) -> bool:
        return vector is not None and any(math.isfinite(value) for value in vector)

    return pack(
        record.timestamp,
        given(trajectory and trajectory.position),
        given(trajectory and trajectory.velocity),
        given(trajectory and trajectory.acceleration),
        record.attitude is not None,
        record.rates is not None,
        False,
        False,
    )


distance_sensor = by_name(
    "distance_sensor",
    DistanceSensorSample,
    DISTANCE,
    ("signal_quality",),
    lambda record: (100 if record.current_distance == record.current_distance else 0,),
)
battery_status = by_name("battery_status", BatteryStatus, BATTERY)
vehicle_local_position = by_name(
    "vehicle_local_position", VehicleLocalPosition, LOCAL_POSITION, ("xy_global", "z_global"), _global_origin
)
vehicle_global_position = by_name(
    "vehicle_global_position",
    VehicleGlobalPosition,
    GLOBAL_POSITION,
    ("terrain_alt_valid",),
    lambda record: (record.terrain_alt == record.terrain_alt,),
)
estimator_status = by_name(
    "estimator_status", EstimatorStatus, ESTIMATOR_STATUS, ("control_mode_flags",), _control_mode_flags
)
estimator_status_flags = by_name("estimator_status_flags", EstimatorStatus, ESTIMATOR_FLAGS)
estimator_sensor_bias = by_name(
    "estimator_sensor_bias",
    EstimatorStatus,
    ESTIMATOR_BIAS,
    ("gyro_bias", "accel_bias"),
    lambda record: record.gyro_bias + record.accel_bias,
)
vehicle_imu_status = by_name(
    "vehicle_imu_status",
    EstimatorStatus,
    IMU_STATUS,
    ("delta_angle_coning_metric", "gyro_vibration_metric", "accel_vibration_metric"),
    lambda record: record.vibration,
)


@row("vehicle_attitude_groundtruth")
def vehicle_attitude_groundtruth(pack: Pack, record: GroundTruth) -> bytes:
    """Body to NED."""
    return pack(record.timestamp, record.timestamp, *record.q, 0.0, 0.0, 0.0, 0.0, 0)


@row("vehicle_angular_velocity_groundtruth")
def vehicle_angular_velocity_groundtruth(pack: Pack, record: GroundTruth) -> bytes:
    """Body rates; their derivative is not told."""
    return pack(record.timestamp, record.timestamp, *record.xyz, 0.0, 0.0, 0.0)


def _heading(record: GroundTruth) -> tuple[Value, ...]:
    w, x, y, z = record.q
    return (math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),)


vehicle_global_position_groundtruth = by_name("vehicle_global_position_groundtruth", GroundTruth, TRUE_GLOBAL_POSITION)
vehicle_local_position_groundtruth = by_name(
    "vehicle_local_position_groundtruth", GroundTruth, TRUE_LOCAL_POSITION, ("heading",), _heading
)
wind = by_name("wind", WindEstimate)
rate_ctrl_status = by_name("rate_ctrl_status", RateCtrlStatus, {"wheel_rate_integ": 0.0})
manual_control_switches = by_name("manual_control_switches", ManualControlSwitches, SWITCHES)


AXES_OF = {"gps_vel": ("gps_hvel", "gps_vvel"), "ev_vel": ("ev_hvel", "ev_vvel")}
"""Our velocities have all three axes in one."""


def _innovations(topic: str, value: str) -> Row:
    """A row of one value of the last innovations."""
    place, names = Innovation._fields.index(value), []
    for kind, name in FORMATS[topic]:
        names += [name] * array_length(kind)[1]
    unknown = [NAN] * len(names)
    slots = {field: [n for n, name in enumerate(names) if name in told] for field, told in AXES_OF.items()}
    slots |= {name: [n for n, other in enumerate(names) if other == name] for name in names}

    @row(topic)
    def innovations(pack: Pack, record: EstimatorInnovations) -> bytes:
        values: list[float] = unknown.copy()
        values[0] = values[1] = record.timestamp
        for field, told in record.by_field.items():
            for slot, each in zip(slots[field], told, strict=False):
                values[slot] = each[place]
        return pack(*values)

    return innovations


estimator_innovations = _innovations("estimator_innovations", "innovation")
estimator_innovation_variances = _innovations("estimator_innovation_variances", "variance")
estimator_innovation_test_ratios = _innovations("estimator_innovation_test_ratios", "test_ratio")
vehicle_land_detected = by_name("vehicle_land_detected", VehicleLandDetected)
failsafe_flags = by_name("failsafe_flags", FailsafeFlags)
home_position = by_name("home_position", HomePosition, HOME)
actuator_armed = by_name("actuator_armed", ActuatorArmed)
vehicle_roi = by_name("vehicle_roi", VehicleRoi)
mission_result = by_name("mission_result", MissionResult)
manual_control_setpoint = by_name(
    "manual_control_setpoint",
    ManualControlSetpoint,
    MANUAL_CONTROL,
    ("aux1", "aux2", "aux3", "aux4", "aux5", "aux6"),
    lambda record: record.aux,
)
cpuload = by_name("cpuload", CpuLoad)
vehicle_constraints = by_name("vehicle_constraints", VehicleConstraints)
vehicle_local_position_setpoint = by_name(
    "vehicle_local_position_setpoint",
    VehicleLocalPositionSetpoint,
    None,
    ("acceleration", "thrust"),
    lambda record: record.acceleration + record.thrust,
)
takeoff_status = by_name("takeoff_status", TakeoffStatus)
hover_thrust_estimate = by_name("hover_thrust_estimate", HoverThrustEstimate)


def vehicle_status(system_id: int) -> Row:
    """A row of arming and mode of this system."""
    return by_name(
        "vehicle_status",
        VehicleStatus,
        STATUS | {"system_id": system_id},
        ("arming_state", "vehicle_type"),
        _arming_and_type,
    )


# --- what no topic of ours holds -----------------------------------------------------------------------------

vehicle_command = by_name("vehicle_command", VehicleCommand)


@row("vehicle_command_ack")
def vehicle_command_ack(pack: Pack, record: tuple[VehicleCommand, CommandResult]) -> bytes:
    """The answer to a command, but for the time."""
    command, (result, progress, result_param2) = record
    target = (command.source_component, result, progress, command.source_system)
    return pack(0, command.command, result_param2, *target, False)


@row("event")
def event(pack: Pack, record: Event) -> bytes:
    """An event as it is sent, but for the time; its sequence number is its place."""
    arguments = record.arguments.ljust(EVENT_ARGUMENTS, b"\0")
    return pack(0, record.id, record.number + 1 & 0xFFFF, *arguments, record.log_levels)
