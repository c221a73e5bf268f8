"""Sensors and batteries, as the simulator and others tell them (writers: sensors/, mavlink/services/)."""

from typing import Final, NamedTuple

from sitl_emu.autopilot.topics.values import NAN, NAN3, Quaternion, Vector3


class SensorCombined(NamedTuple):
    """Means over one integral of VehicleIMU; biases are still in it, the estimator knows them."""

    timestamp: int = 0
    gyro_rad_s: Vector3 = (0.0, 0.0, 0.0)
    accelerometer_m_s2: Vector3 = (0.0, 0.0, -9.80665)
    accel_calibration_count: int = 0
    gyro_calibration_count: int = 0


class SensorImu(NamedTuple):
    """One sample of gyro and accelerometer, calibrated, and as the drivers tell it (uORB sensor_gyro, sensor_accel)."""

    timestamp: int = 0
    gyro_rad_s: Vector3 = (0.0, 0.0, 0.0)
    accelerometer_m_s2: Vector3 = (0.0, 0.0, -9.80665)
    raw_gyro_rad_s: Vector3 = (0.0, 0.0, 0.0)
    raw_accelerometer_m_s2: Vector3 = (0.0, 0.0, -9.80665)


class VehicleAcceleration(NamedTuple):
    """Writer: sensors/vehicle_acceleration.py. Specific force without its bias, low-passed (IMU_ACCEL_CUTOFF), m/s²."""

    timestamp: int = 0
    timestamp_sample: int = 0
    xyz: Vector3 = (0.0, 0.0, -9.80665)


class SensorBaro(NamedTuple):
    """VehicleAirData, as far as it is used."""

    timestamp: int = 0
    pressure_pa: float = NAN
    baro_alt_m: float = NAN
    temperature_c: float = NAN
    raw_pa: float = NAN
    """As the driver tells it (uORB sensor_baro): without CAL_BARO0_OFF."""


class VehicleAirData(NamedTuple):
    """Means of barometer samples at SENS_BARO_RATE."""

    timestamp: int = 0
    timestamp_sample: int = 0
    baro_alt_meter: float = NAN
    baro_pressure_pa: float = NAN
    ambient_temperature: float = NAN
    rho: float = NAN
    calibration_count: int = 0


class SensorMag(NamedTuple):
    """Magnetic field in the body frame, gauss, calibrated, and as the driver tells it (uORB sensor_mag)."""

    timestamp: int = 0
    magnetometer_ga: Vector3 = NAN3
    raw_ga: Vector3 = NAN3


class VehicleMagnetometer(NamedTuple):
    """Means of magnetometer samples at SENS_MAG_RATE, gauss."""

    timestamp: int = 0
    timestamp_sample: int = 0
    magnetometer_ga: Vector3 = NAN3
    calibration_count: int = 0


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
    s_variance_m_s: float = NAN
    hdop: float = NAN
    vdop: float = NAN
    timestamp_sample: int = 0
    """When it was measured; 0: as it came."""


OWN_DISTANCE_SENSOR: Final = 10092548
"""device_id of SIH's range finder (sih.hpp)."""


class DistanceSensorSample(NamedTuple):
    """uORB distance_sensor: current_distance is NaN when nothing is in range, and negative below the ground."""

    timestamp: int = 0
    current_distance: float = NAN
    min_distance: float = NAN
    max_distance: float = NAN
    orientation: int = 25
    h_fov: float = 0.0
    signal_quality: int = -1
    """Percent; 0 where nothing is seen, -1 where the sensor does not tell."""
    told_distance: float = NAN
    """What a sensor of others said, within its range or not; NaN for our own."""
    type: int = 0
    """MAV_DISTANCE_SENSOR; 0 is a laser."""
    variance: float = 0.0
    v_fov: float = 0.0
    q: Quaternion = (0.0, 0.0, 0.0, 0.0)
    """Where it looks if its orientation is 100, MAV_SENSOR_ROTATION_CUSTOM; zeros of our own."""
    publisher: str = ""
    """Name of the link that it came by; empty for our own."""
    device_id: int = OWN_DISTANCE_SENSOR


class SensorsStatusImu(NamedTuple):
    """Writer: sensors/sensors.py. Whether the IMU's parts say something new."""

    accel_healthy: bool = True
    gyro_healthy: bool = True


class SystemPower(NamedTuple):
    """PX4's system_power_simulator tells this for ever: 5 V from one brick."""

    voltage5v_v: float = 5.0
    usb_connected: bool = False
    brick_valid: int = 1


class VehicleImuStatus(NamedTuple):
    """Writer: sensors/vehicle_imu.py, 10 times a second: how the IMU shakes, mean and variance of its last samples."""

    timestamp: int = 0
    accel_vibration_metric: float = 0.0
    gyro_vibration_metric: float = 0.0
    delta_angle_coning_metric: float = 0.0
    mean_accel: Vector3 = NAN3
    mean_gyro: Vector3 = NAN3
    var_accel: Vector3 = NAN3
    var_gyro: Vector3 = NAN3


ESC_TEMPERATURE_C: Final = 50.0
"""What SIH's speed controllers say; they measure nothing but their speed (sih.cpp, publish_esc_status)."""


class EscStatus(NamedTuple):
    """What speed controllers tell: revolutions a minute by motor. All that are there are online."""

    timestamp: int = 0
    rpm: tuple[int, ...] = ()
    temperature_c: float = ESC_TEMPERATURE_C

    @property
    def online_flags(self) -> int:
        """Bit per controller."""
        return (1 << len(self.rpm)) - 1

    @property
    def armed_flags(self) -> int:
        """Bit per controller: all, once any motor turns (sih.cpp)."""
        return self.online_flags if any(self.rpm) else 0


class RangingBeaconRange(NamedTuple):
    """uORB ranging_beacon: the distance (m) to a radio beacon, its place, and their standard deviations (m)."""

    timestamp: int = 0
    beacon_id: int = 0
    range: float = NAN
    range_accuracy: float = NAN
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    hacc: float = NAN
    vacc: float = NAN


class BatteryStatus(NamedTuple):
    """remaining is 0..1; warning is MAV_BATTERY_CHARGE_STATE-like 0 none, 1 low, 2 critical, 3 emergency.

    Current, charge and what was drawn of it are -1 where they are not known.
    """

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
    current_average_a: float = NAN
    scale: float = 1.0
    """Charged voltage over the present one: what a thrust setpoint may be multiplied by (MC_BAT_SCALE_EN)."""
    cell_count: int = 0
    internal_resistance_estimate: float = NAN
    """Of a cell, ohm."""
    ocv_estimate: float = NAN
    ocv_estimate_filtered: float = NAN
    """Voltage that the battery would have without load."""
    volt_based_soc_estimate: float = NAN
    voltage_prediction: float = NAN
    prediction_error: float = NAN
    estimation_covariance_norm: float = NAN
    id: int = 1
    """Counted from 1; 0 of a battery that MAVLink told of (MavlinkReceiver::handle_message_battery_status)."""
    capacity: int = 0
    """mAh; 0 where nobody knows it."""


class GroundTruth(NamedTuple):
    """What the simulator says is true (HIL_STATE_QUATERNION); no one flies by it. x, y, z from where it first was."""

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
    ax: float = NAN
    ay: float = NAN
    az: float = NAN
    """NED, without gravity."""
