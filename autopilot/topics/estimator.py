"""Where and how the vehicle is (writers: estimator/, land_detector.py)."""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN, Quaternion, Vector3


class VehicleAttitude(NamedTuple):
    """Body to NED, with the Euler angles worked out once (roll, pitch, yaw)."""

    timestamp: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    euler: Vector3 = (0.0, 0.0, 0.0)
    delta_q_reset: Quaternion = (1.0, 0.0, 0.0, 0.0)
    quat_reset_counter: int = 0


class VehicleAngularVelocity(NamedTuple):
    """Body rates, bias removed and filtered."""

    timestamp: int = 0
    xyz: Vector3 = (0.0, 0.0, 0.0)
    xyz_derivative: Vector3 = (0.0, 0.0, 0.0)


class VehicleLocalPosition(NamedTuple):
    """NED position, velocity and acceleration from the reference point, as PX4's vehicle_local_position."""

    timestamp: int = 0
    timestamp_sample: int = 0
    xy_valid: bool = False
    z_valid: bool = False
    v_xy_valid: bool = False
    v_z_valid: bool = False
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    delta_xy: tuple[float, float] = (0.0, 0.0)
    xy_reset_counter: int = 0
    delta_z: float = 0.0
    z_reset_counter: int = 0
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    z_deriv: float = 0.0
    delta_vxy: tuple[float, float] = (0.0, 0.0)
    vxy_reset_counter: int = 0
    delta_vz: float = 0.0
    vz_reset_counter: int = 0
    ax: float = 0.0
    ay: float = 0.0
    az: float = 0.0
    heading: float = 0.0
    heading_var: float = NAN
    unaided_heading: float = NAN
    delta_heading: float = 0.0
    heading_reset_counter: int = 0
    heading_good_for_control: bool = False
    tilt_var: float = NAN
    xy_global: bool = False
    z_global: bool = False
    ref_timestamp: int = 0
    ref_lat: float = NAN
    ref_lon: float = NAN
    ref_alt: float = NAN
    dist_bottom_valid: bool = False
    dist_bottom: float = NAN
    dist_bottom_var: float = NAN
    delta_dist_bottom: float = 0.0
    dist_bottom_reset_counter: int = 0
    dist_bottom_sensor_bitfield: int = 0
    eph: float = NAN
    epv: float = NAN
    evh: float = NAN
    evv: float = NAN
    dead_reckoning: bool = False
    vxy_max: float = NAN
    vz_max: float = NAN
    hagl_min: float = NAN
    hagl_max_z: float = NAN
    hagl_max_xy: float = NAN


class VehicleGlobalPosition(NamedTuple):
    """The same as latitude, longitude (deg) and altitude AMSL (m)."""

    timestamp: int = 0
    timestamp_sample: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    alt_ellipsoid: float = NAN
    lat_lon_valid: bool = False
    alt_valid: bool = False
    delta_alt: float = 0.0
    delta_terrain: float = 0.0
    lat_lon_reset_counter: int = 0
    alt_reset_counter: int = 0
    terrain_reset_counter: int = 0
    eph: float = NAN
    epv: float = NAN
    terrain_alt: float = NAN
    terrain_alt_valid: bool = False
    dead_reckoning: bool = False

    @property
    def valid(self) -> bool:
        """Where the vehicle is on the globe is known."""
        return self.lat_lon_valid and self.alt_valid


class WindEstimate(NamedTuple):
    """Wind over ground, NED."""

    timestamp: int = 0
    windspeed_north: float = NAN
    windspeed_east: float = NAN
    variance_north: float = NAN
    variance_east: float = NAN


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
