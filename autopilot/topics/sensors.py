"""Sensors and batteries, as the simulator and others tell them (writers: autopilot/sensors.py, mavlink/services/)."""

from typing import NamedTuple

from autopilot.topics.values import NAN, NAN3, Quaternion, Vector3


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
