"""What is logged, and how often: PX4's topics, with its names, fields and types, from ours (PX4: logged_topics.cpp).

`formats.json` holds PX4 v1.18's fields of every topic, in the order in which it logs them (by size). A row function
turns one of our records into the values of those fields. A field that we have nothing for is zero or, if a number,
what PX4 logs where it does not know: NaN.
"""

import json
import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

from autopilot.commands import CommandResult
from autopilot.constants import NavState
from autopilot.events import Event
from autopilot.logger import ulog
from autopilot.topics import (
    ActuatorArmed,
    ActuatorOutputs,
    BatteryStatus,
    CpuLoad,
    DistanceSensorSample,
    EstimatorStatus,
    FailsafeFlags,
    HomePosition,
    HoverThrustEstimate,
    InputRc,
    ManualControlSetpoint,
    MissionResult,
    OffboardSetpoint,
    PositionSetpoint,
    PositionSetpointTriplet,
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

Value = float | int | bool
Row = Callable[[Any], Sequence[Value]]
"""Values of a topic's fields, arrays flattened, from our record."""

FORMATS: Mapping[str, tuple[ulog.Field, ...]] = {
    name: ulog.parse_fields(text)
    for name, text in json.loads(pathlib.Path(__file__).with_name("formats.json").read_text()).items()
}
NAN = math.nan
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
MOTORS, SERVOS, OUTPUTS, RC_CHANNELS = 12, 15, 16, 18
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


# --- rows ----------------------------------------------------------------------------------------------------


Extra = Mapping[str, float | str]
"""Fields that have another name in our record, or a constant in every element."""


def by_name(
    topic: str,
    record_type: type,
    extra: Extra | None = None,
    names: Sequence[str] = (),
    compute: Callable[[Any], tuple[Value, ...]] | None = None,
) -> Row:
    """A row whose fields are those of our record that bear the same names, those of `extra`, and those of `names`.

    `compute` returns the values of `names`, arrays flattened. The rest is 0 or, if a number, NaN.
    """
    renamed = extra or {}
    ours: tuple[str, ...] = record_type._fields  # type: ignore[attr-defined]  # every record is a NamedTuple
    kinds = {name: ulog.array_length(kind) for kind, name in FORMATS[topic]}
    places = {name: number for number, name in enumerate(ours) if name in kinds and kinds[name][1] == 1}
    computed = len(ours)
    for name in names:
        places[name] = computed
        computed += kinds[name][1]
    constants: list[Value] = [0, NAN]
    order: list[int] = []
    for name, (base, length) in kinds.items():
        other = renamed.get(name)
        if isinstance(other, str):
            order += [ours.index(other)] * length
        elif other is not None:
            order += [computed + len(constants)] * length
            constants.append(other)
        elif name in places:
            order += range(places[name], places[name] + length)
        else:
            order += [computed + (base in ("float", "double"))] * length
    pick, rest = itemgetter(*order), tuple(constants)
    if compute is None:
        return lambda record: pick(record + rest)
    return lambda record: pick(record + compute(record) + rest)


def padded(values: Sequence[float], length: int, with_what: float) -> tuple[float, ...]:
    """An array of fixed length."""
    return (*values[:length], *(with_what,) * (length - len(values)))


def sensor_combined(record: SensorCombined) -> Sequence[Value]:
    """One IMU sample."""
    time_us, (gx, gy, gz), (ax, ay, az) = record
    return time_us, gx, gy, gz, SENSOR_DT_US, 0, ax, ay, az, SENSOR_DT_US, 0, 0, 0, 0


def vehicle_acceleration(record: SensorCombined) -> Sequence[Value]:
    """Specific force, as measured."""
    return record.timestamp, record.timestamp, *record.accelerometer_m_s2


def vehicle_air_data(record: SensorBaro) -> Sequence[Value]:
    """Pressure altitude, and the density that goes with it."""
    time_us, pressure, altitude, temperature = record
    density = pressure / (STANDARD_PRESSURE_DENSITY * (temperature + KELVIN))
    return time_us, time_us, SIMULATED_BAROMETER, altitude, pressure, temperature, density, 0, 0


def sensor_baro(record: SensorBaro) -> Sequence[Value]:
    """The barometer's own reading."""
    time_us, pressure, _, temperature = record
    return time_us, time_us, SIMULATED_BAROMETER, pressure, temperature, 0


def vehicle_magnetometer(record: SensorMag) -> Sequence[Value]:
    """Field in the body frame, gauss."""
    return record.timestamp, record.timestamp, SIMULATED_MAGNETOMETER, *record.magnetometer_ga, 0


def sensor_mag(record: SensorMag) -> Sequence[Value]:
    """The magnetometer's own reading; its temperature is not known."""
    return record.timestamp, record.timestamp, SIMULATED_MAGNETOMETER, *record.magnetometer_ga, NAN, 0


def _gps(topic: str, boot_unix_us: int) -> Row:
    def compute(record: SensorGps) -> tuple[Value, ...]:
        north, east = record.vel_n_m_s, record.vel_e_m_s
        unix_us = boot_unix_us + record.timestamp
        return math.hypot(north, east), math.atan2(east, north), record.fix_type >= 3, unix_us

    return by_name(topic, SensorGps, GPS, ("vel_m_s", "cog_rad", "vel_ned_valid", "time_utc_usec"), compute)


def vehicle_attitude(record: VehicleAttitude) -> Sequence[Value]:
    """Body to NED."""
    time_us = record.timestamp
    return time_us, time_us, *record.q, 1.0, 0.0, 0.0, 0.0, 0


def vehicle_angular_velocity(record: VehicleAngularVelocity) -> Sequence[Value]:
    """Body rates and their derivative."""
    time_us, xyz, derivative = record
    return time_us, time_us, *xyz, *derivative


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


def vehicle_control_mode(record: VehicleStatus) -> Sequence[Value]:
    """Which controllers the mode asks for."""
    mode = record.nav_state
    position, altitude = mode not in NO_POSITION, mode not in NO_ALTITUDE
    return (
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


def position_setpoint_triplet(record: PositionSetpointTriplet) -> Sequence[Value]:
    """Where the navigator goes: previous, current, next."""
    previous, current, following = (_position_setpoint(setpoint) for setpoint in record[1:])
    return (record.timestamp, *previous, *current, *following)


def trajectory_setpoint(record: TrajectorySetpoint) -> Sequence[Value]:
    """What the flight mode wants; jerk is not told."""
    return (
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


def vehicle_attitude_setpoint(record: VehicleAttitudeSetpoint) -> Sequence[Value]:
    """What attitude control tracks."""
    time_us, q_d, yaw_rate, thrust = record
    return time_us, yaw_rate, *q_d, *thrust


def vehicle_rates_setpoint(record: VehicleRatesSetpoint) -> Sequence[Value]:
    """What rate control tracks."""
    time_us, rates, thrust = record
    return time_us, *rates, *thrust, False


def vehicle_thrust_setpoint(record: VehicleRatesSetpoint) -> Sequence[Value]:
    """What the allocation is asked for, along the body's axes."""
    return record.timestamp, record.timestamp, *record.thrust_body


def vehicle_torque_setpoint(record: VehicleTorqueSetpoint) -> Sequence[Value]:
    """What the allocation is asked for, about the body's axes."""
    return record.timestamp, record.timestamp, *record.xyz


def actuators(functions: Sequence[int], first: int, length: int, tail: tuple[int, ...]) -> Row:
    """A row of the outputs that carry the functions from `first` on; NaN where there is none."""
    channels = [functions.index(first + n) if first + n in functions else -1 for n in range(length)]
    while channels and channels[-1] < 0:
        channels.pop()
    missing = (NAN,) * (length - len(channels))

    def row(record: ActuatorOutputs) -> Sequence[Value]:
        controls = record.controls
        values = [controls[n] if 0 <= n < len(controls) else NAN for n in channels]
        return (record.timestamp, record.timestamp, *values, *missing, *tail)

    return row


def actuator_outputs(record: ActuatorOutputs) -> Sequence[Value]:
    """Microseconds of each output."""
    return record.timestamp, len(record.pwm), *padded(record.pwm, OUTPUTS, 0.0)


def input_rc(record: InputRc) -> Sequence[Value]:
    """Channels of an RC that came over MAVLink."""
    time_us, channels = record
    signal = (-1, NAN, 0, 0, 0, 0)
    return (
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


def offboard_control_mode(record: OffboardSetpoint) -> Sequence[Value]:
    """What an offboard setpoint sets."""
    trajectory = record.trajectory

    def given(vector: tuple[float, float, float] | None) -> bool:
        return vector is not None and any(math.isfinite(value) for value in vector)

    return (
        record.timestamp,
        given(trajectory and trajectory.position),
        given(trajectory and trajectory.velocity),
        given(trajectory and trajectory.acceleration),
        record.attitude is not None,
        record.rates is not None,
        False,
        False,
    )


# --- the table -----------------------------------------------------------------------------------------------


class LoggedTopic(NamedTuple):
    """A topic as PX4 logs it."""

    name: str
    interval_ms: int
    """At most so often; 0: each."""
    source: str
    """Name of our topic."""
    row: Row
    state: bool = False
    """A state changes rarely, and its writer may repeat it all the time: it is logged when it changes, else seldom."""


STATE_MS = 500
"""PX4 publishes states that do not change twice a second."""

COMMAND = by_name("vehicle_command", VehicleCommand)
"""Commands, their answers and events come several at a time, so that no topic holds them."""


def command_ack(record: tuple[VehicleCommand, CommandResult]) -> Sequence[Value]:
    """The answer to a command, but for the time."""
    command, (result, progress, result_param2) = record
    target = (command.source_component, result, progress, command.source_system)
    return 0, command.command, result_param2, *target, False


EVENT_ARGUMENTS = 25


def event(record: Event) -> Sequence[Value]:
    """An event as it is sent, but for the time; its sequence number is its place."""
    return 0, record.id, record.number + 1 & 0xFFFF, *record.arguments.ljust(EVENT_ARGUMENTS, b"\0"), record.log_levels


COMMON = (
    LoggedTopic("sensor_combined", 0, "sensor_combined", sensor_combined),
    LoggedTopic("vehicle_acceleration", 50, "sensor_combined", vehicle_acceleration),
    LoggedTopic("vehicle_air_data", 200, "sensor_baro", vehicle_air_data),
    LoggedTopic("sensor_baro", 1000, "sensor_baro", sensor_baro),
    LoggedTopic("vehicle_magnetometer", 200, "sensor_mag", vehicle_magnetometer),
    LoggedTopic("sensor_mag", 1000, "sensor_mag", sensor_mag),
    LoggedTopic(
        "distance_sensor",
        1000,
        "distance_sensor",
        by_name(
            "distance_sensor",
            DistanceSensorSample,
            DISTANCE,
            ("signal_quality",),
            lambda record: (100 if record.current_distance == record.current_distance else 0,),
        ),
    ),
    LoggedTopic("battery_status", 200, "battery_status", by_name("battery_status", BatteryStatus, BATTERY)),
    LoggedTopic("vehicle_attitude", 50, "vehicle_attitude", vehicle_attitude),
    LoggedTopic("vehicle_angular_velocity", 20, "vehicle_angular_velocity", vehicle_angular_velocity),
    LoggedTopic(
        "vehicle_local_position",
        100,
        "vehicle_local_position",
        by_name(
            "vehicle_local_position", VehicleLocalPosition, LOCAL_POSITION, ("xy_global", "z_global"), _global_origin
        ),
    ),
    LoggedTopic(
        "vehicle_global_position",
        200,
        "vehicle_global_position",
        by_name(
            "vehicle_global_position",
            VehicleGlobalPosition,
            GLOBAL_POSITION,
            ("terrain_alt_valid",),
            lambda record: (record.terrain_alt == record.terrain_alt,),
        ),
    ),
    LoggedTopic(
        "estimator_status",
        200,
        "estimator_status",
        by_name("estimator_status", EstimatorStatus, ESTIMATOR_STATUS, ("control_mode_flags",), _control_mode_flags),
    ),
    LoggedTopic(
        "estimator_status_flags",
        1000,
        "estimator_status",
        by_name("estimator_status_flags", EstimatorStatus, ESTIMATOR_FLAGS),
    ),
    LoggedTopic(
        "estimator_sensor_bias",
        1000,
        "estimator_status",
        by_name(
            "estimator_sensor_bias",
            EstimatorStatus,
            ESTIMATOR_BIAS,
            ("gyro_bias", "accel_bias"),
            lambda record: record.gyro_bias + record.accel_bias,
        ),
    ),
    LoggedTopic(
        "vehicle_imu_status",
        1000,
        "estimator_status",
        by_name(
            "vehicle_imu_status",
            EstimatorStatus,
            IMU_STATUS,
            ("delta_angle_coning_metric", "gyro_vibration_metric", "accel_vibration_metric"),
            lambda record: record.vibration,
        ),
    ),
    LoggedTopic("wind", 1000, "wind", by_name("wind", WindEstimate)),
    LoggedTopic(
        "vehicle_land_detected",
        STATE_MS,
        "vehicle_land_detected",
        by_name("vehicle_land_detected", VehicleLandDetected),
        state=True,
    ),
    LoggedTopic("vehicle_control_mode", STATE_MS, "vehicle_status", vehicle_control_mode, state=True),
    LoggedTopic("failsafe_flags", STATE_MS, "failsafe_flags", by_name("failsafe_flags", FailsafeFlags), state=True),
    LoggedTopic("home_position", STATE_MS, "home_position", by_name("home_position", HomePosition, HOME), state=True),
    LoggedTopic("actuator_armed", STATE_MS, "actuator_armed", by_name("actuator_armed", ActuatorArmed), state=True),
    LoggedTopic("position_setpoint_triplet", 200, "position_setpoint_triplet", position_setpoint_triplet),
    LoggedTopic("vehicle_roi", 1000, "vehicle_roi", by_name("vehicle_roi", VehicleRoi)),
    LoggedTopic("mission_result", STATE_MS, "mission_result", by_name("mission_result", MissionResult), state=True),
    LoggedTopic("actuator_outputs", 100, "actuator_outputs", actuator_outputs),
    LoggedTopic(
        "manual_control_setpoint",
        200,
        "manual_control_setpoint",
        by_name("manual_control_setpoint", ManualControlSetpoint, MANUAL_CONTROL),
    ),
    LoggedTopic("input_rc", 500, "input_rc", input_rc),
    LoggedTopic("cpuload", 0, "cpuload", by_name("cpuload", CpuLoad)),
    LoggedTopic("offboard_control_mode", 100, "offboard_setpoint", offboard_control_mode),
)
MULTICOPTERS = (
    LoggedTopic("trajectory_setpoint", 200, "trajectory_setpoint", trajectory_setpoint),
    LoggedTopic("vehicle_constraints", 1000, "vehicle_constraints", by_name("vehicle_constraints", VehicleConstraints)),
    LoggedTopic(
        "vehicle_local_position_setpoint",
        100,
        "vehicle_local_position_setpoint",
        by_name(
            "vehicle_local_position_setpoint",
            VehicleLocalPositionSetpoint,
            None,
            ("acceleration", "thrust"),
            lambda record: record.acceleration + record.thrust,
        ),
    ),
    LoggedTopic("vehicle_attitude_setpoint", 50, "vehicle_attitude_setpoint", vehicle_attitude_setpoint),
    LoggedTopic("vehicle_rates_setpoint", 20, "vehicle_rates_setpoint", vehicle_rates_setpoint),
    LoggedTopic("vehicle_thrust_setpoint", 20, "vehicle_rates_setpoint", vehicle_thrust_setpoint),
    LoggedTopic("vehicle_torque_setpoint", 20, "vehicle_torque_setpoint", vehicle_torque_setpoint),
    LoggedTopic("takeoff_status", 1000, "takeoff_status", by_name("takeoff_status", TakeoffStatus)),
    LoggedTopic(
        "hover_thrust_estimate",
        100,
        "hover_thrust_estimate",
        by_name("hover_thrust_estimate", HoverThrustEstimate),
    ),
)


# --- profiles ------------------------------------------------------------------------------------------------

MOTOR_FUNCTION, SERVO_FUNCTION = 101, 201
"""PWM_MAIN_FUNCn of the first motor and the first servo."""
DEFAULT_PROFILE = 0
FAST_IMU = ("sensor_combined", "vehicle_angular_velocity", "vehicle_torque_setpoint", "vehicle_acceleration")
PROFILES: Mapping[int, Mapping[str, int]] = {
    1: dict.fromkeys(
        ("sensor_combined", "vehicle_air_data", "vehicle_gps_position", "vehicle_magnetometer", "distance_sensor"), 0
    ),
    2: {"sensor_baro": 100, "sensor_mag": 100},
    3: dict.fromkeys((*FAST_IMU, "actuator_motors"), 0),
    4: dict.fromkeys(
        (
            "manual_control_setpoint",
            "sensor_combined",
            "vehicle_angular_velocity",
            "vehicle_attitude",
            "vehicle_attitude_setpoint",
            "vehicle_rates_setpoint",
            "actuator_motors",
            "actuator_servos",
            "vehicle_thrust_setpoint",
            "vehicle_torque_setpoint",
        ),
        0,
    ),
    6: {"sensor_baro": 100, "sensor_mag": 100},
    7: {"distance_sensor": 0},
    11: {"distance_sensor": 0, "sensor_gps": 0, "sensor_mag": 0},
}
"""Per bit of SDLOG_PROFILE but the default: other intervals in ms. Estimator replay, thermal calibration, system
identification, high rate, sensor comparison, vision, high-rate sensors."""


class Vehicle(NamedTuple):
    """What rows need to know of a vehicle."""

    rover: bool
    functions: Sequence[int]
    """PWM_MAIN_FUNC1 and so on: what each output carries."""
    system_id: int
    boot_unix_us: int


def logged_topics(profile: int, vehicle: Vehicle) -> list[LoggedTopic]:
    """What SDLOG_PROFILE asks for, as far as we have it."""
    status = by_name(
        "vehicle_status",
        VehicleStatus,
        STATUS | {"system_id": vehicle.system_id},
        ("arming_state", "vehicle_type"),
        _arming_and_type,
    )
    motors = actuators(vehicle.functions, MOTOR_FUNCTION, MOTORS, (0,))
    servos = actuators(vehicle.functions, SERVO_FUNCTION, SERVOS, ())
    known = [
        *COMMON,
        LoggedTopic("vehicle_gps_position", 100, "sensor_gps", _gps("vehicle_gps_position", vehicle.boot_unix_us)),
        LoggedTopic("sensor_gps", 1000, "sensor_gps", _gps("sensor_gps", vehicle.boot_unix_us)),
        LoggedTopic("vehicle_status", STATE_MS, "vehicle_status", status, state=True),
        LoggedTopic("actuator_motors", 100, "actuator_outputs", motors),
        *((LoggedTopic("actuator_servos", 100, "actuator_outputs", servos),) if vehicle.rover else MULTICOPTERS),
    ]
    default = not profile or profile >> DEFAULT_PROFILE & 1
    intervals = {topic.name: topic.interval_ms for topic in known} if default else {}
    for bit, others in PROFILES.items():
        if profile >> bit & 1:
            intervals.update(others)
    return [topic._replace(interval_ms=intervals[topic.name]) for topic in known if topic.name in intervals]


def layout_of(name: str) -> ulog.DataLayout:
    """How a topic's data is packed."""
    return ulog.data_layout(FORMATS[name], FORMATS)


def definitions(names: Sequence[str]) -> list[bytes]:
    """The formats of topics, and of the types in them."""
    wanted = dict.fromkeys(names)
    for name in names:
        kinds = (ulog.array_length(kind)[0] for kind, _ in FORMATS[name])
        wanted |= dict.fromkeys(kind for kind in kinds if kind in FORMATS)
    return [ulog.format_definition(name, FORMATS[name]) for name in wanted]
