"""SYS_STATUS: which sensors and systems are there and well, and the battery (PX4: streams/SYS_STATUS.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, battery_status
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_SYS_STATUS
UNKNOWN_VOLTAGE: Final = 65535


def stamp(now_us: int, context: Context) -> tuple[int, int, int]:
    """Whenever the vehicle's status, the computer's load or the battery is told."""
    topics = context.topics
    return topics.vehicle_status.timestamp, topics.cpuload.timestamp, topics.battery_status.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """Health as the commander reports it."""
    health = context.topics.health_report
    battery = context.topics.battery_status
    voltage_mv, current_ca, remaining_pct = UNKNOWN_VOLTAGE, -1, -1
    if battery.connected:
        voltage_mv = min(max(truncated(product(battery.voltage_v, 1000.0)), 0), UNKNOWN_VOLTAGE)
        current_ca = battery_status.current_ca(battery.current_a)
        if battery.remaining != battery_status.UNKNOWN:
            remaining_pct = math.ceil(product(battery.remaining, 100.0))
    return (
        health.present,
        health.enabled,
        health.health,
        truncated(context.topics.cpuload.load * 1000.0),
        voltage_mv,
        current_ca,
        0,
        0,
        0,
        0,
        0,
        0,
        remaining_pct,
        health.present_extended,
        health.enabled_extended,
        health.health_extended,
    )
