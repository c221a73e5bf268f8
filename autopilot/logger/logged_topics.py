"""What is logged, and how often (PX4: logged_topics.cpp)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from autopilot.logger import rows
from autopilot.logger.packing import Row

STATE_MS = 500
"""PX4 publishes states that do not change twice a second."""
INNOVATIONS, TRUTH = "estimator_innovations", "groundtruth"


class LoggedTopic(NamedTuple):
    """A topic as PX4 logs it."""

    name: str
    interval_ms: int
    """At most so often; 0: each."""
    row: Row
    of: str = ""
    """Name of our topic, where it is another."""
    state: bool = False
    """A state changes rarely, and its writer may repeat it all the time: it is logged when it changes, else seldom."""

    @property
    def source(self) -> str:
        """Name of our topic."""
        return self.of or self.name


COMMON = (
    LoggedTopic("sensor_combined", 0, rows.sensor_combined),
    LoggedTopic("vehicle_acceleration", 50, rows.vehicle_acceleration, "sensor_combined"),
    LoggedTopic("vehicle_air_data", 200, rows.vehicle_air_data, "sensor_baro"),
    LoggedTopic("sensor_baro", 1000, rows.sensor_baro),
    LoggedTopic("vehicle_magnetometer", 200, rows.vehicle_magnetometer, "sensor_mag"),
    LoggedTopic("sensor_mag", 1000, rows.sensor_mag),
    LoggedTopic("vehicle_attitude_groundtruth", 10, rows.vehicle_attitude_groundtruth, TRUTH),
    LoggedTopic("vehicle_angular_velocity_groundtruth", 10, rows.vehicle_angular_velocity_groundtruth, TRUTH),
    LoggedTopic("vehicle_global_position_groundtruth", 100, rows.vehicle_global_position_groundtruth, TRUTH),
    LoggedTopic("vehicle_local_position_groundtruth", 20, rows.vehicle_local_position_groundtruth, TRUTH),
    LoggedTopic("distance_sensor", 1000, rows.distance_sensor),
    LoggedTopic("battery_status", 200, rows.battery_status),
    LoggedTopic("vehicle_attitude", 50, rows.vehicle_attitude),
    LoggedTopic("vehicle_angular_velocity", 20, rows.vehicle_angular_velocity),
    LoggedTopic("vehicle_local_position", 100, rows.vehicle_local_position),
    LoggedTopic("vehicle_global_position", 200, rows.vehicle_global_position),
    LoggedTopic("estimator_status", 200, rows.estimator_status),
    LoggedTopic("estimator_status_flags", 1000, rows.estimator_status_flags, "estimator_status"),
    LoggedTopic("estimator_sensor_bias", 1000, rows.estimator_sensor_bias, "estimator_status"),
    LoggedTopic("estimator_innovations", 500, rows.estimator_innovations),
    LoggedTopic("estimator_innovation_variances", 500, rows.estimator_innovation_variances, "estimator_innovations"),
    LoggedTopic(
        "estimator_innovation_test_ratios", 500, rows.estimator_innovation_test_ratios, "estimator_innovations"
    ),
    LoggedTopic("vehicle_imu_status", 1000, rows.vehicle_imu_status, "estimator_status"),
    LoggedTopic("wind", 1000, rows.wind),
    LoggedTopic("vehicle_land_detected", STATE_MS, rows.vehicle_land_detected, state=True),
    LoggedTopic("vehicle_control_mode", STATE_MS, rows.vehicle_control_mode, "vehicle_status", state=True),
    LoggedTopic("failsafe_flags", STATE_MS, rows.failsafe_flags, state=True),
    LoggedTopic("home_position", STATE_MS, rows.home_position, state=True),
    LoggedTopic("actuator_armed", STATE_MS, rows.actuator_armed, state=True),
    LoggedTopic("position_setpoint_triplet", 200, rows.position_setpoint_triplet),
    LoggedTopic("vehicle_roi", 1000, rows.vehicle_roi),
    LoggedTopic("mission_result", STATE_MS, rows.mission_result, state=True),
    LoggedTopic("actuator_outputs", 100, rows.actuator_outputs),
    LoggedTopic("manual_control_setpoint", 200, rows.manual_control_setpoint),
    LoggedTopic("manual_control_switches", STATE_MS, rows.manual_control_switches, state=True),
    LoggedTopic("input_rc", 500, rows.input_rc),
    LoggedTopic("cpuload", 0, rows.cpuload),
    LoggedTopic("offboard_control_mode", 100, rows.offboard_control_mode, "offboard_setpoint"),
)
MULTICOPTERS = (
    LoggedTopic("trajectory_setpoint", 200, rows.trajectory_setpoint),
    LoggedTopic("vehicle_constraints", 1000, rows.vehicle_constraints),
    LoggedTopic("vehicle_local_position_setpoint", 100, rows.vehicle_local_position_setpoint),
    LoggedTopic("vehicle_attitude_setpoint", 50, rows.vehicle_attitude_setpoint),
    LoggedTopic("vehicle_rates_setpoint", 20, rows.vehicle_rates_setpoint),
    LoggedTopic("vehicle_thrust_setpoint", 20, rows.vehicle_thrust_setpoint, "vehicle_rates_setpoint"),
    LoggedTopic("vehicle_torque_setpoint", 20, rows.vehicle_torque_setpoint),
    LoggedTopic("rate_ctrl_status", 200, rows.rate_ctrl_status),
    LoggedTopic("takeoff_status", 1000, rows.takeoff_status),
    LoggedTopic("hover_thrust_estimate", 100, rows.hover_thrust_estimate),
)


# --- profiles ------------------------------------------------------------------------------------------------

MOTOR_FUNCTION, SERVO_FUNCTION = 101, 201
"""PWM_MAIN_FUNCn of the first motor and the first servo."""
NOT_REVERSIBLE = (0,)
"""actuator_motors.reversible_flags."""
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
    motors = rows.actuators("actuator_motors", vehicle.functions, MOTOR_FUNCTION, NOT_REVERSIBLE)
    servos = rows.actuators("actuator_servos", vehicle.functions, SERVO_FUNCTION)
    known = [
        *COMMON,
        LoggedTopic("vehicle_gps_position", 100, rows.gps("vehicle_gps_position", vehicle.boot_unix_us), "sensor_gps"),
        LoggedTopic("sensor_gps", 1000, rows.gps("sensor_gps", vehicle.boot_unix_us)),
        LoggedTopic("vehicle_status", STATE_MS, rows.vehicle_status(vehicle.system_id), state=True),
        LoggedTopic("actuator_motors", 100, motors, "actuator_outputs"),
        *((LoggedTopic("actuator_servos", 100, servos, "actuator_outputs"),) if vehicle.rover else MULTICOPTERS),
    ]
    default = not profile or profile >> DEFAULT_PROFILE & 1
    intervals = {topic.name: topic.interval_ms for topic in known} if default else {}
    for bit, others in PROFILES.items():
        if profile >> bit & 1:
            intervals.update(others)
    return [topic._replace(interval_ms=intervals[topic.name]) for topic in known if topic.name in intervals]
