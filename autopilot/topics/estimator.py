"""Where and how the vehicle is (writers: estimator/, land_detector.py)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from autopilot.topics.values import NAN, Quaternion, Vector3


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
    """Writer: land_detector.py; once a second, and when one of the first six has changed."""

    timestamp: int = 0
    landed: bool = True
    maybe_landed: bool = True
    ground_contact: bool = True
    freefall: bool = False
    in_ground_effect: bool = False
    at_rest: bool = False
    """It is landed, and has neither moved nor shaken for a second."""
    in_descend: bool = False
    has_low_throttle: bool = False
    vertical_movement: bool = False
    horizontal_movement: bool = False
    rotational_movement: bool = False
    close_to_ground_or_skipped_check: bool = False
