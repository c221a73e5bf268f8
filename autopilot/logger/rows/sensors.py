"""Sensors, batteries and what the simulator says is true (topics/sensors.py)."""

import math
from collections.abc import Callable, Sequence

from sitl_emu.autopilot.constants import IMU_TEMPERATURE_C
from sitl_emu.autopilot.logger.packing import Pack, Row, Value, by_name, row, zeros
from sitl_emu.autopilot.topics import (
    BatteryStatus,
    DistanceSensorSample,
    EscStatus,
    GroundTruth,
    RangingBeaconRange,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorImu,
    SensorMag,
    SensorsStatusImu,
    SystemPower,
    VehicleAcceleration,
    VehicleAirData,
    VehicleImuStatus,
    VehicleMagnetometer,
)
from sitl_emu.core.attitude import heading

NAN = math.nan
SENSOR_DT_US = 4000
SENSOR_DT_S = SENSOR_DT_US * 1e-6
"""Integration time of an IMU sample."""
SIMULATED_IMU = 1310988
SIMULATED_BAROMETER, SIMULATED_MAGNETOMETER, SIMULATED_GPS = 6620172, 197388, 11468804
"""Device ids of PX4's simulated sensors (bus type SIMULATION, DRV_*_DEVTYPE_SIM)."""
DEFAULT_TEMPERATURE = 0
"""vehicle_air_data's temperature_source: nobody measured it."""
ESCS = 12
FIRST_MOTOR = 101
"""Output function of motor 1."""
NO_CURRENT_SENSOR_A = -1.0
IMUS = 4
"""Places in sensors_status_imu."""
DEFAULT_PRIORITY = 50


@row("sensor_combined")
def sensor_combined(pack: Pack, record: SensorCombined) -> bytes:
    """One IMU sample."""
    time_us, (gx, gy, gz), (ax, ay, az), *calibrations = record
    return pack(time_us, gx, gy, gz, SENSOR_DT_US, 0, ax, ay, az, SENSOR_DT_US, 0, 0, *calibrations)


@row("vehicle_acceleration")
def vehicle_acceleration(pack: Pack, record: VehicleAcceleration) -> bytes:
    """Specific force, low-passed."""
    time_us, sample_us, xyz = record
    return pack(time_us, sample_us, *xyz)


@row("vehicle_imu")
def vehicle_imu(pack: Pack, record: SensorCombined) -> bytes:
    """The same sample as changes of angle and velocity."""
    time_us, gyro, accel, *calibrations = record
    ids, times = (SIMULATED_IMU, SIMULATED_IMU), (SENSOR_DT_US, SENSOR_DT_US)
    angles, velocities = [SENSOR_DT_S * value for value in gyro], [SENSOR_DT_S * value for value in accel]
    return pack(time_us, time_us, *ids, *angles, *velocities, *times, 0, 0, *calibrations)


def _raw(topic: str, of: Callable[[SensorImu], Sequence[float]]) -> Row:
    """One sample as the driver tells it."""

    @row(topic)
    def raw(pack: Pack, record: SensorImu) -> bytes:
        time_us = record.timestamp
        return pack(time_us, time_us, SIMULATED_IMU, *of(record), IMU_TEMPERATURE_C, 0, 0, 0, 0, 1)

    return raw


sensor_gyro = _raw("sensor_gyro", lambda record: record.raw_gyro_rad_s)
sensor_accel = _raw("sensor_accel", lambda record: record.raw_accelerometer_m_s2)
vehicle_imu_status = by_name(
    "vehicle_imu_status",
    VehicleImuStatus,
    {
        "accel_device_id": SIMULATED_IMU,
        "gyro_device_id": SIMULATED_IMU,
        **dict.fromkeys(("accel_rate_hz", "gyro_rate_hz", "accel_raw_rate_hz", "gyro_raw_rate_hz"), 1.0 / SENSOR_DT_S),
        **zeros("accel_clipping", "gyro_clipping", "accel_error_count", "gyro_error_count"),
        "temperature_accel": IMU_TEMPERATURE_C,
        "temperature_gyro": IMU_TEMPERATURE_C,
    },
)


@row("sensors_status_imu")
def sensors_status_imu(pack: Pack, record: SensorsStatusImu) -> bytes:
    """Which IMUs there are, and well: one."""
    ids, nothing, others = (SIMULATED_IMU, *(0,) * (IMUS - 1)), (0.0,) * IMUS, (0,) * (IMUS - 1)
    priority = (DEFAULT_PRIORITY, *others)
    return pack(
        0,
        SIMULATED_IMU,
        *ids,
        *nothing,
        SIMULATED_IMU,
        *ids,
        *nothing,
        record.accel_healthy,
        *others,
        *priority,
        record.gyro_healthy,
        *others,
        *priority,
    )


@row("vehicle_air_data")
def vehicle_air_data(pack: Pack, record: VehicleAirData) -> bytes:
    """Pressure altitude, and the density that goes with it."""
    time_us, sample_us, altitude, pressure, temperature, rho, calibrations = record
    told = (SIMULATED_BAROMETER, altitude, pressure, temperature, rho, DEFAULT_TEMPERATURE, calibrations)
    return pack(time_us, sample_us, *told)


@row("sensor_baro")
def sensor_baro(pack: Pack, record: SensorBaro) -> bytes:
    """The barometer's own reading."""
    time_us = record.timestamp
    return pack(time_us, time_us, SIMULATED_BAROMETER, record.raw_pa, record.temperature_c, 0)


@row("vehicle_magnetometer")
def vehicle_magnetometer(pack: Pack, record: VehicleMagnetometer) -> bytes:
    """Field in the body frame, gauss."""
    time_us, sample_us, field, calibrations = record
    return pack(time_us, sample_us, SIMULATED_MAGNETOMETER, *field, calibrations)


@row("sensor_mag")
def sensor_mag(pack: Pack, record: SensorMag) -> bytes:
    """The magnetometer's own reading; its temperature is not known."""
    return pack(record.timestamp, record.timestamp, SIMULATED_MAGNETOMETER, *record.raw_ga, NAN, 0)


def gps(topic: str) -> Row:
    """A row of what the receiver says."""

    def compute(record: SensorGps) -> tuple[Value, ...]:
        north, east = record.vel_n_m_s, record.vel_e_m_s
        return math.hypot(north, east), math.atan2(east, north), record.fix_type >= 3

    return by_name(topic, SensorGps, GPS, ("vel_m_s", "cog_rad", "vel_ned_valid"), compute)


GPS: dict[str, float | str] = {
    "altitude_ellipsoid_m": "altitude_msl_m",
    "device_id": SIMULATED_GPS,
    "s_variance_m_s": 0.4,
    "c_variance_rad": 0.1,
    "hdop": 0.7,
    "vdop": 1.1,
    "heading": NAN,
    "heading_offset": NAN,
    **zeros("noise_per_ms", "jamming_indicator", "timestamp_time_relative", "system_error", "heading_accuracy"),
    **zeros(
        "rtcm_injection_rate", "antenna_offset_x", "antenna_offset_y", "antenna_offset_z", "automatic_gain_control"
    ),
    **zeros("jamming_state", "spoofing_state", "authentication_state", "selected_rtcm_instance", "rtcm_crc_failed"),
    **zeros("rtcm_msg_used", "time_utc_usec"),
}
"""PX4's simulated receiver (SensorGpsSim.cpp) says so much of its accuracy and nothing of date, jamming, antenna and
RTCM."""
distance_sensor = by_name(
    "distance_sensor",
    DistanceSensorSample,
    zeros("mode"),
)


def _battery(record: BatteryStatus) -> tuple[Value, ...]:
    cells = record.cells_v[:14]
    current_a = record.current_a if record.current_a == record.current_a else NO_CURRENT_SENSOR_A
    spread_v = max(cells) - min(cells) if cells else 0.0
    return current_a, spread_v, *cells, *(0.0,) * (14 - len(cells))


battery_status = by_name(
    "battery_status",
    BatteryStatus,
    {
        "temperature": "temperature_c",
        "remaining_capacity_wh": NAN,
        "nominal_voltage": NAN,
        **zeros("full_charge_capacity_wh", "cycle_count", "average_time_to_empty", "manufacture_date"),
        **zeros("state_of_health", "max_error", "interface_error", "faults", "over_discharge_count", "source"),
        **zeros("priority", "is_powering_off", "is_required"),
    },
    ("current_a", "max_cell_voltage_delta", "voltage_cell_v"),
    _battery,
)
system_power = by_name(
    "system_power",
    SystemPower,
    {
        "timestamp": 0,
        **zeros("voltage_payload_v", "sensors3v3", "sensors3v3_valid", "usb_valid", "servo_valid", "periph_5v_oc"),
        **zeros("hipower_5v_oc", "comp_5v_valid", "can1_gps1_5v_valid", "payload_v_valid"),
    },
)
ranging_beacon = by_name(
    "ranging_beacon",
    RangingBeaconRange,
    {"timestamp_sample": "timestamp", **zeros("carrier_freq", "alt_type", "sequence_nr", "status")},
)


@row("esc_status")
def esc_status(pack: Pack, record: EscStatus) -> bytes:
    """The speed of each motor."""
    time_us, rpm, temperature_c = record
    values: list[float] = [time_us, 0, record.online_flags, record.armed_flags, len(rpm), 0]
    for motor, speed in enumerate(rpm[:ESCS]):
        values += (time_us, 0, speed, 0.0, 0.0, temperature_c, 0, 0, 0, FIRST_MOTOR + motor, 0)
    for _ in range(len(rpm), ESCS):
        values += NO_ESC
    return pack(*values)


NO_ESC = (0, 0, 0, 0.0, 0.0, 0.0, 0, 0, 0, 0, 0)


# --- truth -----------------------------------------------------------------------------------------------------


@row("vehicle_attitude_groundtruth")
def vehicle_attitude_groundtruth(pack: Pack, record: GroundTruth) -> bytes:
    """Body to NED."""
    return pack(record.timestamp, record.timestamp, *record.q, 0.0, 0.0, 0.0, 0.0, 0)


@row("vehicle_angular_velocity_groundtruth")
def vehicle_angular_velocity_groundtruth(pack: Pack, record: GroundTruth) -> bytes:
    """Body rates; their derivative is not told."""
    return pack(record.timestamp, record.timestamp, *record.xyz, 0.0, 0.0, 0.0)


vehicle_global_position_groundtruth = by_name(
    "vehicle_global_position_groundtruth",
    GroundTruth,
    {
        "timestamp_sample": "timestamp",
        "alt_ellipsoid": "alt",
        **zeros("delta_alt", "delta_terrain", "eph", "epv", "lat_lon_valid", "alt_valid", "lat_lon_reset_counter"),
        **zeros("alt_reset_counter", "terrain_reset_counter", "terrain_alt_valid", "dead_reckoning"),
    },
    ("terrain_alt",),
    lambda record: (-record.z,),
)
"""PX4's SIH says nothing of validity, and tells the height above its origin as terrain_alt (publish_ground_truth)."""


vehicle_local_position_groundtruth = by_name(
    "vehicle_local_position_groundtruth",
    GroundTruth,
    {
        "timestamp_sample": "timestamp",
        "z_deriv": "vz",
        "unaided_heading": NAN,
        **dict.fromkeys(("xy_valid", "z_valid", "v_xy_valid", "v_z_valid", "xy_global", "z_global"), 1),
        "heading_good_for_control": 1,
        **zeros("delta_xy", "delta_z", "delta_vxy", "delta_vz", "heading_var", "delta_heading", "tilt_var"),
        **zeros("dist_bottom", "dist_bottom_var", "delta_dist_bottom", "eph", "epv", "evh", "evv", "vxy_max", "vz_max"),
        **zeros("hagl_min", "hagl_max_z", "hagl_max_xy", "xy_reset_counter", "z_reset_counter", "vxy_reset_counter"),
        **zeros("vz_reset_counter", "heading_reset_counter", "dist_bottom_valid", "dist_bottom_reset_counter"),
        **zeros("dist_bottom_sensor_bitfield", "dead_reckoning"),
    },
    ("heading",),
    lambda record: (heading(record.q),),
)
