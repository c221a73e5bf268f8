"""What others tell the vehicle over MAVLink and from ROS 2 (writers: mavlink/services/, uxrce_dds_client/)."""

from typing import Final, NamedTuple, TypeVar

from sitl_emu.autopilot.topics.sensors import DistanceSensorSample
from sitl_emu.autopilot.topics.values import NAN, NAN3, Quaternion, Vector3

FRAME_UNKNOWN, FRAME_NED, FRAME_FRD, FRAME_BODY_FRD = range(4)
"""vehicle_odometry POSE_FRAME and VELOCITY_FRAME."""
MOST_INSTANCES: Final = 10
"""ORB_MULTI_MAX_INSTANCES (uORB.h)."""


class VehicleOdometry(NamedTuple):
    """A pose and velocity from outside; NaN where something is not told."""

    timestamp: int = 0
    """When it was so (timestamp_sample)."""
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
    told_us: int = 0
    """When it came in."""
    angular_velocity: Vector3 = NAN3
    """rad/s about the body's axes; for the log alone, as the filter takes no notice of it."""


class AuxGlobalPosition(NamedTuple):
    """Where a source other than GNSS says that the vehicle is: degrees, m AMSL; NaN where something is not told."""

    timestamp: int
    timestamp_sample: int
    id: int
    """Of the source."""
    lat: float
    lon: float
    alt: float = NAN
    eph: float = NAN
    epv: float = NAN
    lat_lon_reset_counter: int = 0
    source: int = 0
    """GLOBAL_POSITION_SRC: what it is."""
    publisher: str = ""
    """Name of the link that it came by, or DDS and its id."""


Instance = TypeVar("Instance", DistanceSensorSample, AuxGlobalPosition)


def with_instance(known: tuple[Instance, ...], told: Instance) -> tuple[Instance, ...]:
    """Each publisher keeps the place that it got with its first sample, while there are some (uORB's instances)."""
    instances = {each.publisher: each for each in known}
    if told.publisher in instances or len(known) < MOST_INSTANCES:
        instances[told.publisher] = told
    return tuple(instances.values())


class OnboardComputerStatus(NamedTuple):
    """What a companion computer says of itself: the temperature of its board, °C, and for the log the rest."""

    timestamp: int = 0
    temperature_board: int = 127
    """127: unknown."""
    uptime: int = 0
    type: int = 0
    cpu_cores: tuple[int, ...] = (0,) * 8
    cpu_combined: tuple[int, ...] = (0,) * 10
    gpu_cores: tuple[int, ...] = (0,) * 4
    gpu_combined: tuple[int, ...] = (0,) * 10
    temperature_core: tuple[int, ...] = (0,) * 8
    fan_speed: tuple[int, ...] = (0,) * 4
    ram_usage: int = 0
    ram_total: int = 0
    storage_type: tuple[int, ...] = (0,) * 4
    storage_usage: tuple[int, ...] = (0,) * 4
    storage_total: tuple[int, ...] = (0,) * 4
    link_type: tuple[int, ...] = (0,) * 6
    link_tx_rate: tuple[int, ...] = (0,) * 6
    link_rx_rate: tuple[int, ...] = (0,) * 6
    link_tx_max: tuple[int, ...] = (0,) * 6
    link_rx_max: tuple[int, ...] = (0,) * 6


class RadioStatus(NamedTuple):
    """What a telemetry radio tells: RADIO_STATUS, in PX4's words."""

    timestamp: int = 0
    rssi: int = 0
    remote_rssi: int = 0
    txbuf: int = 0
    """How much of its buffer is free, %."""
    noise: int = 0
    remote_noise: int = 0
    rxerrors: int = 0
    fix: int = 0
    """Packets that error correction has mended."""


class SensorOpticalFlow(NamedTuple):
    """One sample: angles in rad over a time, quality 0..255; NaN where the sensor has no gyro or no range (m)."""

    pixel_flow: tuple[float, float] = (0.0, 0.0)
    delta_angle: Vector3 = NAN3
    integration_timespan_us: int = 0
    quality: int = 0
    distance_m: float = NAN
    timestamp: int = 0
    device_id: int = 0


class VehicleOpticalFlow(NamedTuple):
    """Flow about the body's x and y axes, rad/s, free of rotation: moving forward flows +y, moving right -x."""

    timestamp: int = 0
    x: float = NAN
    y: float = NAN
    quality: int = 0
    integration_timespan_us: int = 0
    pixel_flow: tuple[float, float] = (0.0, 0.0)
    """Integrated over that time, rotation included, and the rotation; rad."""
    delta_angle: Vector3 = (0.0, 0.0, 0.0)
    distance_m: float = NAN
    device_id: int = 0
    max_flow_rate: float = NAN
    min_ground_distance: float = NAN
    max_ground_distance: float = NAN
    """What the sensor can do, by SENS_FLOW_MAXR, SENS_FLOW_MINHGT and SENS_FLOW_MAXHGT; for the log alone."""


class ObstacleDistance(NamedTuple):
    """OBSTACLE_DISTANCE: cm (65535 unknown), degrees; frame is a MAV_FRAME; timestamp: of the newest measurement."""

    timestamp: int = 0
    frame: int = 0
    distances: tuple[int, ...] = ()
    increment: float = 0.0
    min_distance: int = 0
    max_distance: int = 0
    angle_offset: float = 0.0
    told_us: int = 0
    """When collision prevention told what it knows, whether it is new or not; 0: never."""
    sensor_type: int = 0
    """MAV_DISTANCE_SENSOR."""


class LandingTargetPose(NamedTuple):
    """Where to land precisely, NED from the local origin; timestamp 0: never told."""

    timestamp: int = 0
    x_abs: float = NAN
    y_abs: float = NAN
    z_abs: float = NAN
    vx_rel: float = NAN
    """The target's velocity from the vehicle, north and east, m/s; variances."""
    vy_rel: float = NAN
    cov_vx_rel: float = NAN
    cov_vy_rel: float = NAN
    rel_vel_ekf2_valid: bool = False
    """It stands, and was seen just now."""
    x_rel: float = 0.0
    """From the vehicle, where rel_pos_valid; nobody knows of what MAVLink tells as a place."""
    y_rel: float = 0.0
    z_rel: float = 0.0
    rel_pos_valid: bool = False


class FiducialMarkerPosReport(NamedTuple):
    """Where a camera sees the target of a precision landing: m in a frame that `q` turns into NED, variances in m²."""

    timestamp: int = 0
    """When it saw it (timestamp_sample)."""
    rel_pos: Vector3 = NAN3
    cov_rel_pos: Vector3 = NAN3
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class FollowTarget(NamedTuple):
    """Last FOLLOW_TARGET: degrees, m AMSL, m/s NED; velocity is not finite where the target tells none."""

    timestamp: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    velocity: Vector3 = NAN3


class VelocityLimits(NamedTuple):
    """Last SET_VELOCITY_LIMITS: m/s and rad/s; not finite where there is no limit."""

    timestamp: int = 0
    horizontal_velocity: float = NAN
    vertical_velocity: float = NAN
    yaw_rate: float = NAN


class GcsHeartbeats(NamedTuple):
    """When a ground station was last heard, and components of this vehicle (0: never); who of them said to be well."""

    gcs_us: int = 0
    onboard_us: int = 0
    parachute_us: int = 0
    parachute_healthy: bool = False
    open_drone_id_us: int = 0
    open_drone_id_healthy: bool = False
    adsb_us: int = 0


class TransponderReport(NamedTuple):
    """uORB transponder_report: an aircraft nearby. Degrees, m AMSL, heading in 0..2π, m/s; `number` counts up."""

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
