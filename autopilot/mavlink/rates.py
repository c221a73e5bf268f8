"""Which messages each link streams, and how often: PX4 v1.18 SITL as measured (stream/*).

The tables follow what init.d-posix/px4-rc.mavlink and Mavlink::configure_streams_to_default set up together. Rates in
Hz; UNLIMITED sends whenever there is something new. Messages whose data does not exist on a vehicle (a target
attitude on a rover) are not sent, whatever their rate.
"""

UNLIMITED = 0.0

GCS = {
    "HEARTBEAT": 1.0,
    "ADSB_VEHICLE": UNLIMITED,
    "ALTITUDE": 1.0,
    "ATTITUDE": 50.0,
    "ATTITUDE_QUATERNION": 50.0,
    "ATTITUDE_TARGET": 50.0,
    "BATTERY_STATUS": 0.5,
    "CURRENT_MODE": 0.5,
    "DEBUG": 1.0,
    "DEBUG_FLOAT_ARRAY": 1.0,
    "DEBUG_VECT": 1.0,
    "DISTANCE_SENSOR": 0.5,
    "ESC_INFO": 1.0,
    "ESC_STATUS": 1.0,
    "ESTIMATOR_SENSOR_FUSION_STATUS": 0.5,
    "ESTIMATOR_STATUS": 0.5,
    "EXTENDED_SYS_STATE": 1.0,
    "GLOBAL_POSITION_INT": 50.0,
    "GNSS_INTEGRITY": 1.0,
    "GPS_GLOBAL_ORIGIN": 0.1,
    "GPS_RAW_INT": 5.0,
    "HOME_POSITION": 0.5,
    "LINK_NODE_STATUS": 1.0,
    "LOCAL_POSITION_NED": 50.0,
    "MISSION_CURRENT": 1.0,
    "NAMED_VALUE_FLOAT": 1.0,
    "NAV_CONTROLLER_OUTPUT": 1.0,
    "OBSTACLE_DISTANCE": 1.0,
    "OPEN_DRONE_ID_LOCATION": 1.0,
    "OPEN_DRONE_ID_SYSTEM": 1.0,
    "PING": 0.1,
    "ORBIT_EXECUTION_STATUS": 2.0,
    "POSITION_TARGET_GLOBAL_INT": 1.0,
    "POSITION_TARGET_LOCAL_NED": 50.0,
    "RC_CHANNELS": 5.0,
    "SCALED_PRESSURE": 1.0,
    "SERVO_OUTPUT_RAW": 50.0,
    "SYS_STATUS": 1.0,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "VFR_HUD": 4.0,
    "VIBRATION": 0.1,
    "WIND_COV": 0.5,
}
"""Ground station, PX4's mode `normal`."""

ONBOARD = {
    "HEARTBEAT": 1.0,
    "ADSB_VEHICLE": UNLIMITED,
    "ALTITUDE": 10.0,
    "ATTITUDE": 100.0,
    "ATTITUDE_QUATERNION": 50.0,
    "ATTITUDE_TARGET": 10.0,
    "BATTERY_STATUS": 0.5,
    "CURRENT_MODE": 0.5,
    "DEBUG": 10.0,
    "DEBUG_FLOAT_ARRAY": 10.0,
    "DEBUG_VECT": 10.0,
    "DISTANCE_SENSOR": 10.0,
    "ESC_INFO": 10.0,
    "ESC_STATUS": 10.0,
    "ESTIMATOR_SENSOR_FUSION_STATUS": 1.0,
    "ESTIMATOR_STATUS": 1.0,
    "EXTENDED_SYS_STATE": 5.0,
    "GLOBAL_POSITION_INT": 50.0,
    "GNSS_INTEGRITY": 1.0,
    "GPS_GLOBAL_ORIGIN": 1.0,
    "GPS_RAW_INT": UNLIMITED,
    "HIGHRES_IMU": 50.0,
    "HOME_POSITION": 0.5,
    "LINK_NODE_STATUS": 1.0,
    "LOCAL_POSITION_NED": 30.0,
    "MISSION_CURRENT": 1.0,
    "NAMED_VALUE_FLOAT": 10.0,
    "NAV_CONTROLLER_OUTPUT": 10.0,
    "OBSTACLE_DISTANCE": 10.0,
    "ODOMETRY": 30.0,
    "OPEN_DRONE_ID_LOCATION": 1.0,
    "OPEN_DRONE_ID_SYSTEM": 1.0,
    "OPTICAL_FLOW_RAD": 10.0,
    "PING": 1.0,
    "ORBIT_EXECUTION_STATUS": 5.0,
    "POSITION_TARGET_GLOBAL_INT": 10.0,
    "POSITION_TARGET_LOCAL_NED": 10.0,
    "RC_CHANNELS": 20.0,
    "SCALED_PRESSURE": 1.0,
    "SERVO_OUTPUT_RAW": 10.0,
    "SYSTEM_TIME": 1.0,
    "SYS_STATUS": 5.0,
    "TIMESYNC": 10.0,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "VFR_HUD": 10.0,
    "VIBRATION": 0.5,
    "WIND_COV": 10.0,
}
"""Offboard API, PX4's mode `onboard`; the payload link has the same, within its data rate."""

GIMBAL = {"HEARTBEAT": 1.0, "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": 20.0, "MISSION_CURRENT": 1.0}

GIMBAL_STREAMS = {
    "normal": {"GIMBAL_DEVICE_SET_ATTITUDE": 5.0, "GIMBAL_MANAGER_STATUS": 0.5},
    "onboard": {"GIMBAL_DEVICE_SET_ATTITUDE": 5.0, "GIMBAL_MANAGER_STATUS": 0.5},
    "gimbal": {"GIMBAL_DEVICE_SET_ATTITUDE": 20.0},
}
"""What comes to a mode's streams on a vehicle whose gimbal manager runs (MNT_MODE_IN)."""
CAMERA_STREAMS = {
    "normal": {"CAMERA_TRIGGER": UNLIMITED, "CAMERA_IMAGE_CAPTURED": UNLIMITED},
    "onboard": {"CAMERA_TRIGGER": UNLIMITED, "CAMERA_IMAGE_CAPTURED": UNLIMITED},
}
"""And on one whose camera trigger runs (TRIG_MODE)."""

RATES = {"normal": GCS, "onboard": ONBOARD, "onboard_low_bandwidth": ONBOARD, "gimbal": GIMBAL, "wire": {}}
"""By link mode."""

NORMAL_DEFAULT_HZ = {
    "ATTITUDE": 15.0,
    "ATTITUDE_QUATERNION": 15.0,
    "ATTITUDE_TARGET": 2.0,
    "GLOBAL_POSITION_INT": 5.0,
    "GPS_RAW_INT": 1.0,
    "LOCAL_POSITION_NED": 1.0,
    "POSITION_TARGET_LOCAL_NED": 1.5,
    "SERVO_OUTPUT_RAW": 1.0,
}
"""What SET_MESSAGE_INTERVAL 0 ("default") goes back to on the ground station's link, where it differs from GCS."""

CONSTANT = frozenset({"ADSB_VEHICLE", "HEARTBEAT", "MISSION_CURRENT", "PING", "GPS_RAW_INT"})
"""Streams that a data rate limit does not slow down."""

DATA_RATE_BYTES_PER_S = {"onboard_low_bandwidth": 4000.0}
"""Limited links by mode; the others' limits (4 MB/s) are never reached."""

SMALLEST_MULTIPLIER = 0.05
OVERHEAD_BYTES = 12
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
    """Interval of a rate; 0 for UNLIMITED."""
    return round(1e6 / hz) if hz > 0.0 else 0


def default_hz(mode: str, name: str) -> float | None:
    """Rate that SET_MESSAGE_INTERVAL 0 goes back to; None: the link does not stream it."""
    if mode == "normal" and name in NORMAL_DEFAULT_HZ:
        return NORMAL_DEFAULT_HZ[name]
    return RATES[mode].get(name)
