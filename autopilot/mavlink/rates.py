"""Which messages each link streams, and how often: PX4 v1.18 SITL as measured (stream/*).

The tables follow what init.d-posix/px4-rc.mavlink and Mavlink::configure_streams_to_default set up together. Rates in
Hz; UNLIMITED sends whenever there is something new. Messages whose data does not exist on a vehicle (a target
attitude on a rover) are not sent, whatever their rate.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from sitl_emu.core.c_types import float32, truncated

UNLIMITED: Final = 0.0
OFF: Final = -1.0


class Rates(NamedTuple):
    """How often a message is streamed on a link of each mode, in Hz; None: not at all, until somebody asks for it."""

    normal: float | None = None
    """Ground station."""
    onboard: float | None = None
    """Offboard API; the payload link has the same, within its data rate."""
    gimbal: float | None = None
    custom: float | None = None
    """What draws the vehicle."""
    normal_default: float | None = None
    """What SET_MESSAGE_INTERVAL 0 ("default") goes back to on the ground station's link, where that is another; OFF
    where the mode does not stream it, and px4-rc.mavlink alone does.
    """
    constant: bool = False
    """A data rate limit does not slow it down."""


STREAMS: Mapping[str, Rates] = {
    "HEARTBEAT": Rates(normal=1.0, onboard=1.0, gimbal=1.0, custom=1.0, constant=True),
    "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": Rates(gimbal=20.0),
    "ADSB_VEHICLE": Rates(normal=5.0, onboard=5.0, constant=True),
    "ALTITUDE": Rates(normal=1.0, onboard=10.0),
    "ATTITUDE": Rates(normal=50.0, onboard=100.0, normal_default=15.0),
    "ATTITUDE_QUATERNION": Rates(normal=50.0, onboard=50.0, normal_default=10.0),
    "ATTITUDE_TARGET": Rates(normal=50.0, onboard=10.0, normal_default=2.0),
    "AVAILABLE_MODES": Rates(normal=0.3, onboard=0.3),
    "BATTERY_STATUS": Rates(normal=0.5, onboard=0.5),
    "CURRENT_MODE": Rates(normal=0.5, onboard=0.5),
    "DEBUG": Rates(normal=1.0, onboard=10.0),
    "DEBUG_FLOAT_ARRAY": Rates(normal=1.0, onboard=10.0),
    "DEBUG_VECT": Rates(normal=1.0, onboard=10.0),
    "DISTANCE_SENSOR": Rates(normal=0.5, onboard=10.0),
    "ESC_INFO": Rates(normal=1.0, onboard=10.0),
    "ESC_STATUS": Rates(normal=1.0, onboard=10.0),
    "ESTIMATOR_SENSOR_FUSION_STATUS": Rates(normal=0.5, onboard=1.0),
    "ESTIMATOR_STATUS": Rates(normal=0.5, onboard=1.0),
    "EXTENDED_SYS_STATE": Rates(normal=1.0, onboard=5.0),
    "GLOBAL_POSITION_INT": Rates(normal=50.0, onboard=50.0, normal_default=5.0),
    "GLOBAL_POSITION_SENSOR": Rates(normal=5.0),
    "GNSS_INTEGRITY": Rates(normal=1.0, onboard=1.0),
    "GPS_GLOBAL_ORIGIN": Rates(normal=1.0, onboard=1.0),
    "GPS_RAW_INT": Rates(normal=5.0, onboard=UNLIMITED, constant=True),
    "HIGHRES_IMU": Rates(onboard=50.0),
    "HIL_ACTUATOR_CONTROLS": Rates(custom=200.0),
    "HIL_STATE_QUATERNION": Rates(custom=25.0),
    "HOME_POSITION": Rates(normal=0.5, onboard=0.5),
    "LINK_NODE_STATUS": Rates(normal=1.0, onboard=1.0),
    "LOCAL_POSITION_NED": Rates(normal=50.0, onboard=30.0, normal_default=1.0),
    "MISSION_CURRENT": Rates(normal=1.0, onboard=1.0, gimbal=1.0, custom=1.0, constant=True),
    "NAMED_VALUE_FLOAT": Rates(normal=1.0, onboard=10.0),
    "NAV_CONTROLLER_OUTPUT": Rates(normal=1.0, onboard=10.0),
    "OBSTACLE_DISTANCE": Rates(normal=1.0, onboard=10.0),
    "ODOMETRY": Rates(onboard=30.0),
    "OPEN_DRONE_ID_LOCATION": Rates(normal=1.0, onboard=1.0),
    "OPEN_DRONE_ID_SYSTEM": Rates(normal=1.0, onboard=1.0),
    "OPTICAL_FLOW_RAD": Rates(normal=10.0, onboard=10.0, normal_default=OFF),
    "PING": Rates(normal=0.1, onboard=1.0, constant=True),
    "ORBIT_EXECUTION_STATUS": Rates(normal=2.0, onboard=5.0),
    "POSITION_TARGET_GLOBAL_INT": Rates(normal=1.0, onboard=10.0),
    "POSITION_TARGET_LOCAL_NED": Rates(normal=50.0, onboard=10.0, normal_default=1.5),
    "RC_CHANNELS": Rates(normal=20.0, onboard=20.0, normal_default=5.0),
    "SCALED_PRESSURE": Rates(normal=1.0, onboard=1.0),
    "SERVO_OUTPUT_RAW": Rates(normal=50.0, onboard=10.0, normal_default=1.0),
    "SYSTEM_TIME": Rates(onboard=1.0),
    "SYS_STATUS": Rates(normal=1.0, onboard=5.0),
    "TIMESYNC": Rates(onboard=10.0),
    "TIME_ESTIMATE_TO_TARGET": Rates(normal=1.0, onboard=1.0),
    "VFR_HUD": Rates(normal=4.0, onboard=10.0),
    "VIBRATION": Rates(normal=0.1, onboard=0.5),
    "WIND_COV": Rates(normal=0.5, onboard=10.0),
    "GIMBAL_DEVICE_SET_ATTITUDE": Rates(normal=5.0, onboard=5.0, gimbal=20.0),
    "GIMBAL_MANAGER_STATUS": Rates(normal=0.5, onboard=0.5),
    "CAMERA_TRIGGER": Rates(onboard=UNLIMITED),
    "CAMERA_IMAGE_CAPTURED": Rates(normal=UNLIMITED, onboard=UNLIMITED),
}


def by_mode(streams: Mapping[str, Rates]) -> dict[str, dict[str, float]]:
    """By link mode: the messages that are streamed from the start, and their rates."""
    normal = {name: row.normal for name, row in streams.items() if row.normal is not None}
    onboard = {name: row.onboard for name, row in streams.items() if row.onboard is not None}
    gimbal = {name: row.gimbal for name, row in streams.items() if row.gimbal is not None}
    custom = {name: row.custom for name, row in streams.items() if row.custom is not None}
    return {
        "normal": normal,
        "onboard": onboard,
        "onboard_low_bandwidth": onboard,
        "gimbal": gimbal,
        "custom": custom,
        "wire": {},
    }


RATES = {**by_mode(STREAMS), "wire": {"CAMERA_TRIGGER": UNLIMITED}}
"""A camera on a wire of ours is asked for images as one on a link in onboard mode is."""
CONSTANT = frozenset(name for name, row in STREAMS.items() if row.constant)
DATA_RATE_BYTES_PER_S = {"onboard_low_bandwidth": 4000.0}
"""Limited links by mode; the others' limits are never reached."""

SMALLEST_MULTIPLIER: Final = 0.05
OVERHEAD_BYTES: Final = 12
"""What PX4 counts per frame beside the payload."""


def multiplier(limit_bytes_per_s: float, streams: list[tuple[str, int, float]]) -> float:
    """Factor on the rates of a limited link.

    `streams` holds name, payload bytes and nominal Hz of everything that is sent. Constant streams are served
    first, the rest is scaled to what remains (Mavlink::update_rate_mult).
    """
    constant = sum((size + OVERHEAD_BYTES) * hz for name, size, hz in streams if name in CONSTANT)
    scaled = sum((size + OVERHEAD_BYTES) * hz for name, size, hz in streams if name not in CONSTANT)
    if scaled <= 0.0:
        return 1.0
    return min(1.0, max(SMALLEST_MULTIPLIER, (limit_bytes_per_s - constant) / scaled))


def interval_us(hz: float) -> int:
    """Interval of a rate, a float32 cut off as in Mavlink::configure_stream; 0 for UNLIMITED."""
    return truncated(float32(1e6 / float32(hz))) if hz > 0.0 else 0


def default_hz(mode: str, name: str) -> float | None:
    """Rate that SET_MESSAGE_INTERVAL 0 goes back to; None: the link does not stream it."""
    row = STREAMS.get(name)
    if mode == "normal" and row is not None and row.normal_default is not None:
        return None if row.normal_default == OFF else row.normal_default
    return RATES[mode].get(name)
