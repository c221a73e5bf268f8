"""Streams of PX4 v1.18 that never have anything to say on our vehicles: their intervals can be set and asked, no more.

From mavlink_messages.cpp and Mavlink::configure_streams_to_default.
"""

from collections.abc import Mapping

from sitl_emu.autopilot.mavlink.rates import UNLIMITED, Rates, by_mode

SILENT: Mapping[str, Rates] = {
    "BATTERY_INFO": Rates(),
    "COMMAND_LONG": Rates(normal=UNLIMITED, onboard=UNLIMITED, gimbal=UNLIMITED, custom=UNLIMITED),
    "EFI_STATUS": Rates(normal=2.0, onboard=2.0),
    "ESC_EEPROM": Rates(normal=UNLIMITED, onboard=UNLIMITED),
    "FIGURE_EIGHT_EXECUTION_STATUS": Rates(normal=5.0, onboard=5.0),
    "FUEL_STATUS": Rates(normal=1.0, onboard=1.0),
    "GIMBAL_DEVICE_ATTITUDE_STATUS": Rates(normal=5.0, onboard=5.0),
    "GPS2_RAW": Rates(normal=1.0, onboard=UNLIMITED),
    "GPS_STATUS": Rates(normal=1.0, onboard=1.0),
    "HYGROMETER_SENSOR": Rates(normal=0.1, onboard=1.0),
    "MOUNT_ORIENTATION": Rates(normal=10.0, onboard=10.0),
    "OPEN_DRONE_ID_ARM_STATUS": Rates(normal=1.0, onboard=1.0),
    "RAW_RPM": Rates(normal=2.0, onboard=5.0),
    "SCALED_IMU2": Rates(),
    "SCALED_IMU3": Rates(),
    "SCALED_PRESSURE2": Rates(),
    "SCALED_PRESSURE3": Rates(),
}
RATES = by_mode(SILENT)
"""By link mode, in Hz, those that run from the start."""
