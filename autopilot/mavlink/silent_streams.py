"""Streams of PX4 v1.18 that never have anything to say on our vehicles: their intervals can be set and asked, no more.

From mavlink_messages.cpp and Mavlink::configure_streams_to_default.
"""

from autopilot.mavlink.rates import UNLIMITED

NAMES = frozenset(
    {
        *("BATTERY_INFO", "COLLISION", "COMMAND_LONG", "EFI_STATUS", "GIMBAL_DEVICE_ATTITUDE_STATUS"),
        *("GIMBAL_DEVICE_INFORMATION", "GPS2_RAW", "GPS_RTCM_DATA", "GPS_STATUS", "HYGROMETER_SENSOR"),
        *("MOUNT_ORIENTATION", "RAW_RPM", "SCALED_IMU2", "SCALED_IMU3"),
        *("SCALED_PRESSURE2", "SCALED_PRESSURE3", "UAVIONIX_ADSB_OUT_CFG", "UAVIONIX_ADSB_OUT_DYNAMIC"),
    }
)
NORMAL = {
    "COLLISION": UNLIMITED,
    "EFI_STATUS": 2.0,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": 1.0,
    "GPS2_RAW": 1.0,
    "GPS_STATUS": 1.0,
    "RAW_RPM": 2.0,
}
ONBOARD = {
    "COLLISION": UNLIMITED,
    "EFI_STATUS": 2.0,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": 1.0,
    "GPS2_RAW": UNLIMITED,
    "GPS_STATUS": 1.0,
    "MOUNT_ORIENTATION": 10.0,
    "RAW_RPM": 5.0,
}
RATES = {"normal": NORMAL, "onboard": ONBOARD, "onboard_low_bandwidth": ONBOARD}
"""By link mode, in Hz, those that run from the start."""
