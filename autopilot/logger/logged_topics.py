"""What is logged, and how often (PX4: logged_topics.cpp)."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from sitl_emu.autopilot.logger.packing import Row
from sitl_emu.autopilot.logger.rows import commander, control, estimator, navigator, outside, rover, sensors, system
from sitl_emu.autopilot.sensors.distance_sensors import distance_sensors
from sitl_emu.autopilot.topics import Topics
from sitl_emu.autopilot.topics.outside import MOST_INSTANCES

STATE_MS, SLOW_STATE_MS, ON_CHANGE = 500, 1000, 0
"""So often PX4 publishes a state that does not change: commander twice a second, the land detector and switches every
second (LandDetector.cpp, rc_update.cpp), others never. vehicle_constraints it publishes all the time, and logs every
second."""
TRUTH = "groundtruth"
ROVER = "rover_ackermann"
ESTIMATOR_MS = 10
"""So often PX4's simulation logs what the estimator tells of itself, at most. Attitude, places and its yaw by GNSS are
logged as often as they are told."""


class Nobody(NamedTuple):
    """In place of an instance's record, while there is none."""

    timestamp: int = 0


NOBODY = Nobody()


class LoggedTopic(NamedTuple):
    """A topic as PX4 logs it."""

    name: str
    interval_ms: int
    """At most so often; 0: each. A state that does not change: so often; 0: never again."""
    row: Row
    of: str = ""
    """Name of our topic, where it is another."""
    state: bool = False
    """A state changes rarely, and its writer may repeat it all the time: it is logged when it changes, else as PX4
    publishes it. A topic of which our record does not say when it was made is one."""
    module: str = ""
    """PX4's module that publishes it, where that does not run on every kind of vehicle."""
    instance: int = 0
    """uORB's, where there are several."""
    find: Callable[[Topics, int], Any] | None = None
    """How an instance's record is found, where our topics hold several in one slot."""

    @property
    def source(self) -> str:
        """Name of our topic."""
        return self.of or self.name

    def record(self, topics: Topics) -> Any:
        """Its present record."""
        return getattr(topics, self.source) if self.find is None else self.find(topics, self.instance)


def _distance_sensor(topics: Topics, instance: int) -> Any:
    """Those that have spoken, our own first."""
    sensors = [sensor for sensor in distance_sensors(topics) if sensor.timestamp]
    return sensors[instance] if instance < len(sensors) else NOBODY


def _aux_global_position(topics: Topics, instance: int) -> Any:
    sources = topics.aux_global_position
    return sources[instance] if instance < len(sources) else NOBODY


def _distance_sensors(first: int, count: int) -> list[LoggedTopic]:
    """PX4 logs two by default, and up to ten where a bit of SDLOG_PROFILE asks for them; ours are at most five."""
    return [
        LoggedTopic("distance_sensor", 1000, sensors.distance_sensor, instance=n, find=_distance_sensor)
        for n in range(first, first + count)
    ]


def _instances(name: str, interval_ms: int, row: Row, count: int) -> list[LoggedTopic]:
    """A topic with a slot for each instance: `name`, `name_1` and so on."""
    return [LoggedTopic(name, interval_ms, row, f"{name}_{n}" if n else "", instance=n) for n in range(count)]


COMMON = (
    LoggedTopic("sensor_combined", 0, sensors.sensor_combined),
    LoggedTopic("vehicle_acceleration", 50, sensors.vehicle_acceleration),
    LoggedTopic("vehicle_imu", 500, sensors.vehicle_imu, "sensor_combined"),
    LoggedTopic("sensor_accel", 1000, sensors.sensor_accel, "sensor_imu"),
    LoggedTopic("sensor_gyro", 1000, sensors.sensor_gyro, "sensor_imu"),
    LoggedTopic("vehicle_imu_status", 1000, sensors.vehicle_imu_status),
    LoggedTopic("sensors_status_imu", 200, sensors.sensors_status_imu, state=True),
    LoggedTopic("vehicle_air_data", 200, sensors.vehicle_air_data),
    LoggedTopic("sensor_baro", 1000, sensors.sensor_baro),
    LoggedTopic("vehicle_magnetometer", 200, sensors.vehicle_magnetometer),
    LoggedTopic("sensor_mag", 1000, sensors.sensor_mag),
    LoggedTopic("vehicle_attitude_groundtruth", 10, sensors.vehicle_attitude_groundtruth, TRUTH),
    LoggedTopic("vehicle_angular_velocity_groundtruth", 10, sensors.vehicle_angular_velocity_groundtruth, TRUTH),
    LoggedTopic("vehicle_global_position_groundtruth", 100, sensors.vehicle_global_position_groundtruth, TRUTH),
    LoggedTopic("vehicle_local_position_groundtruth", 20, sensors.vehicle_local_position_groundtruth, TRUTH),
    *_distance_sensors(0, 2),
    LoggedTopic("sensor_optical_flow", 1000, outside.sensor_optical_flow),
    LoggedTopic("vehicle_optical_flow", 500, outside.vehicle_optical_flow),
    *(
        LoggedTopic("aux_global_position", 500, outside.aux_global_position, instance=n, find=_aux_global_position)
        for n in range(MOST_INSTANCES)
    ),
    LoggedTopic("onboard_computer_status", 10, outside.onboard_computer_status),
    LoggedTopic("radio_status", 0, outside.radio_status),
    LoggedTopic("battery_status", 200, sensors.battery_status),
    LoggedTopic("esc_status", 100, sensors.esc_status),
    LoggedTopic("ranging_beacon", 100, sensors.ranging_beacon),
    LoggedTopic("system_power", STATE_MS, sensors.system_power, state=True),
    LoggedTopic("vehicle_attitude", 0, estimator.vehicle_attitude),
    LoggedTopic("vehicle_angular_velocity", 10, estimator.vehicle_angular_velocity),
    LoggedTopic("vehicle_local_position", 0, estimator.vehicle_local_position),
    LoggedTopic("vehicle_global_position", 0, estimator.vehicle_global_position),
    *(
        LoggedTopic(name, 0 if name == "yaw_estimator_status" else ESTIMATOR_MS, row)
        for name, row in estimator.OWN_NAMES.items()
    ),
    LoggedTopic("wind", 1000, estimator.wind),
    LoggedTopic("vehicle_land_detected", SLOW_STATE_MS, estimator.vehicle_land_detected, state=True),
    LoggedTopic("vehicle_control_mode", STATE_MS, commander.vehicle_control_mode, "vehicle_status", state=True),
    LoggedTopic("failsafe_flags", STATE_MS, commander.failsafe_flags, state=True),
    LoggedTopic("failure_detector_status", 100, commander.failure_detector_status),
    LoggedTopic("config_overrides", STATE_MS, commander.config_overrides, state=True),
    LoggedTopic("home_position", ON_CHANGE, commander.home_position, state=True),
    LoggedTopic("actuator_armed", STATE_MS, commander.actuator_armed, state=True),
    LoggedTopic("cpuload", 0, commander.cpuload),
    LoggedTopic("logger_status", 200, system.logger_status),
    LoggedTopic("parameter_update", 0, system.parameter_update),
    LoggedTopic("sensor_selection", 0, system.sensor_selection),
    *_instances("telemetry_status", 1000, system.telemetry_status, 4),
    *_instances("timesync_status", 1000, system.timesync_status, 3),
    LoggedTopic("position_setpoint_triplet", 200, navigator.position_setpoint_triplet),
    LoggedTopic("vehicle_roi", 1000, navigator.vehicle_roi),
    LoggedTopic("mission_result", ON_CHANGE, navigator.mission_result, state=True),
    LoggedTopic("navigator_status", 0, navigator.navigator_status),
    LoggedTopic("navigator_mission_item", 0, navigator.navigator_mission_item),
    LoggedTopic("rtl_time_estimate", 1000, navigator.rtl_time_estimate),
    LoggedTopic("rtl_status", 2000, navigator.rtl_status),
    LoggedTopic("distance_sensor_mode_change_request", 0, navigator.distance_sensor_mode_change_request),
    LoggedTopic("actuator_outputs", 100, control.actuator_outputs),
    LoggedTopic("vehicle_attitude_setpoint", 50, control.vehicle_attitude_setpoint),
    LoggedTopic("vehicle_rates_setpoint", 20, control.vehicle_rates_setpoint),
    LoggedTopic("offboard_control_mode", 100, control.offboard_control_mode, "offboard_setpoint"),
    LoggedTopic("manual_control_setpoint", 200, outside.manual_control_setpoint),
    LoggedTopic("manual_control_switches", SLOW_STATE_MS, outside.manual_control_switches, state=True),
    LoggedTopic("input_rc", 500, outside.input_rc),
    LoggedTopic("gripper", ON_CHANGE, outside.gripper, state=True),
)
OF_SOME_KINDS = (
    LoggedTopic("trajectory_setpoint", 200, control.trajectory_setpoint, module="flight_mode_manager"),
    LoggedTopic(
        "vehicle_constraints", SLOW_STATE_MS, control.vehicle_constraints, state=True, module="flight_mode_manager"
    ),
    LoggedTopic("landing_gear", 200, control.landing_gear, module="flight_mode_manager"),
    LoggedTopic(
        "vehicle_local_position_setpoint", 100, control.vehicle_local_position_setpoint, module="mc_pos_control"
    ),
    LoggedTopic("vehicle_thrust_setpoint", 20, control.vehicle_thrust_setpoint, module="mc_rate_control"),
    LoggedTopic("vehicle_torque_setpoint", 20, control.vehicle_torque_setpoint, module="mc_rate_control"),
    LoggedTopic(
        "actuator_controls_status_0",
        300,
        control.actuator_controls_status_0,
        "actuator_controls_status",
        module="mc_rate_control",
    ),
    LoggedTopic("rate_ctrl_status", 200, control.rate_ctrl_status, module="mc_rate_control"),
    LoggedTopic("control_allocator_status", 200, control.control_allocator_status, module="control_allocator"),
    LoggedTopic(
        "autotune_attitude_control_status",
        100,
        control.autotune_attitude_control_status,
        module="mc_att_control",
    ),
    LoggedTopic("takeoff_status", 1000, control.takeoff_status, module="mc_pos_control"),
    LoggedTopic("hover_thrust_estimate", 100, control.hover_thrust_estimate, module="mc_hover_thrust_estimator"),
    LoggedTopic("trajectory_setpoint", 200, control.trajectory_setpoint, module=ROVER),
    LoggedTopic("position_controller_status", 500, rover.position_controller_status, module=ROVER),
    *(LoggedTopic(name, 100, row, module=ROVER) for name, row in rover.OWN_NAMES.items()),
)
NOT_BY_DEFAULT = (
    LoggedTopic("ekf2_timestamps", 0, estimator.ekf2_timestamps),
    LoggedTopic("vehicle_visual_odometry", 0, outside.vehicle_visual_odometry),
    LoggedTopic("vehicle_mocap_odometry", 30, outside.vehicle_mocap_odometry),
    LoggedTopic("obstacle_distance", 0, outside.obstacle_distance),
    LoggedTopic("obstacle_distance_fused", 0, outside.obstacle_distance_fused),
    LoggedTopic("collision_constraints", 0, control.collision_constraints),
    LoggedTopic("debug_array", 0, outside.debug_array),
    LoggedTopic("debug_key_value", 0, outside.debug_key_value),
    LoggedTopic("debug_value", 0, outside.debug_value),
    LoggedTopic("debug_vect", 0, outside.debug_vect),
    LoggedTopic("actuator_test", 500, control.actuator_test),
    *_distance_sensors(2, 3),
)
"""What a bit of SDLOG_PROFILE has to ask for."""


# --- profiles ------------------------------------------------------------------------------------------------

MOTOR_FUNCTION, SERVO_FUNCTION = 101, 201
"""PWM_MAIN_FUNCn of the first motor and the first servo."""
DEFAULT_PROFILE = 0
PROFILES: Mapping[int, Mapping[int, Sequence[str]]] = {
    1: {
        0: (
            "ekf2_timestamps",
            "vehicle_optical_flow",
            "sensor_combined",
            "sensor_selection",
            "vehicle_air_data",
            "vehicle_gps_position",
            "vehicle_land_detected",
            "vehicle_magnetometer",
            "vehicle_status",
            "vehicle_visual_odometry",
            "ranging_beacon",
            "aux_global_position",
            "distance_sensor",
        )
    },
    2: {100: ("sensor_accel", "sensor_baro", "sensor_gyro", "sensor_mag")},
    3: {
        0: (
            "sensor_combined",
            "vehicle_angular_velocity",
            "vehicle_torque_setpoint",
            "vehicle_acceleration",
            "actuator_motors",
        )
    },
    4: {
        0: (
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
        5: ("esc_status",),
        20: ("rate_ctrl_status",),
    },
    5: {0: ("debug_array", "debug_key_value", "debug_value", "debug_vect"), 500: ("actuator_test",)},
    6: {100: ("sensor_accel", "sensor_baro", "sensor_gyro", "sensor_mag")},
    7: {
        0: ("collision_constraints", "distance_sensor", "obstacle_distance_fused", "obstacle_distance"),
        30: ("vehicle_mocap_odometry", "vehicle_visual_odometry"),
    },
    11: {
        10: (
            "distance_sensor",
            "sensor_baro",
            "sensor_optical_flow",
            "sensor_gps",
            "sensor_mag",
            "estimator_aid_src_baro_hgt",
            "vehicle_air_data",
            "vehicle_magnetometer",
            "vehicle_thrust_setpoint",
        )
    },
}
"""Per bit of SDLOG_PROFILE but the default, in PX4's order, of which the last one counts: intervals in ms, and what is
logged so often (logged_topics.cpp:295-407). Estimator replay, thermal calibration, system identification, high rate,
debugging, sensor comparison, vision, high-rate sensors. Bits 8 to 10 (raw samples of IMUs, MAVLink's tunnel) are of
what no vehicle of ours has."""
EVERY_PROFILE = sum(1 << bit for bit in (DEFAULT_PROFILE, *PROFILES))


class Vehicle(NamedTuple):
    """What rows need to know of a vehicle."""

    modules: frozenset[str]
    """PX4's modules that run on it (Traits.modules)."""
    functions: Sequence[int]
    """PWM_MAIN_FUNC1 and so on: what each output carries."""
    system_id: int
    thrust_model_factor: float = 0.0
    """THR_MDL_FAC."""
    reversible_flags: int = 0
    """CA_R_REV."""


def logged_topics(profile: int, vehicle: Vehicle) -> list[LoggedTopic]:
    """What SDLOG_PROFILE asks for, as far as we have it."""
    curve = vehicle.thrust_model_factor
    # a rover's module writes 0 where it has nothing to say, the control allocator NaN
    unused = 0.0 if ROVER in vehicle.modules else math.nan
    flags = (vehicle.reversible_flags,)
    motors = control.actuators("actuator_motors", vehicle.functions, MOTOR_FUNCTION, flags, curve, unused)
    servos = control.actuators("actuator_servos", vehicle.functions, SERVO_FUNCTION, unused=unused)
    actuator_servos = LoggedTopic("actuator_servos", 100, servos, "actuator_outputs", module=ROVER)
    known = [
        *COMMON,
        *NOT_BY_DEFAULT,
        LoggedTopic("vehicle_gps_position", 100, sensors.gps("vehicle_gps_position"), "sensor_gps"),
        LoggedTopic("sensor_gps", 1000, sensors.gps("sensor_gps")),
        LoggedTopic("vehicle_status", STATE_MS, commander.vehicle_status(vehicle.system_id), state=True),
        LoggedTopic("actuator_motors", 100, motors, "actuator_outputs"),
        *(topic for topic in (*OF_SOME_KINDS, actuator_servos) if topic.module in vehicle.modules),
    ]
    default = not profile or profile >> DEFAULT_PROFILE & 1
    wanted = {topic: topic.interval_ms for topic in known if default and topic not in NOT_BY_DEFAULT}
    for bit, rates in PROFILES.items():
        if profile >> bit & 1:
            others = {name: interval_ms for interval_ms, names in rates.items() for name in names}
            # a state is told again as often as its writer does, however often the log would take it
            wanted |= {
                topic: topic.interval_ms if topic.state else others[topic.name]
                for topic in known
                if topic.name in others
            }
    return [topic._replace(interval_ms=wanted[topic]) for topic in known if topic in wanted]
