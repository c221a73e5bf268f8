"""device_id of sensors whose messages come over MAVLink (PX4: lib/drivers/device/Device.hpp, drv_sensor.h)."""

from typing import Final

from sitl_emu.autopilot.mavlink.link import Link

DISTANCE: Final = 0x94
FLOW: Final = 0xB2
"""DRV_DIST_DEVTYPE_MAVLINK, DRV_FLOW_DEVTYPE_MAVLINK."""
BUS_TYPE: Final = 6
"""DeviceBusType_MAVLINK."""
INSTANCES: Final = ("gcs", "onboard", "payload", "gimbal", "display")
"""Links in their order; those behind them are wired to devices."""


def device_id(kind: int, system: int, link: Link) -> int:
    """Of a sensor of this system that speaks on a link."""
    bus = INSTANCES.index(link.name) if link.name in INSTANCES else len(INSTANCES)
    return kind << 16 | system << 8 | bus << 3 | BUS_TYPE
