"""BATTERY_STATUS of a component of this vehicle: a battery that tells of itself, in the place of the autopilot's own.

https://mavlink.io/en/messages/common.html#BATTERY_STATUS, as PX4's handle_message_battery_status: only from the
vehicle's own system; the voltage is that of its cells together, the warning follows from its charge (BAT_LOW_THR,
BAT_CRIT_THR, BAT_EMERGEN_THR) where it knows that. It is published as the first battery (mavlink_receiver.h), which
the autopilot's own takes back with its next sample, unless that is not published at all (BAT1_SOURCE).
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.battery import battery_warning
from sitl_emu.autopilot.topics import BatteryStatus as BatteryStatusSample
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32

AUTOPILOT = 1
NO_CELL = 65535
NO_TEMPERATURE = 32767
UNKNOWN = -1


class BatteryStatus:
    """Writer of battery_status, beside sensors/battery.py."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_BATTERY_STATUS})
    HAS_TIMER = False

    def __init__(self, topics: Topics, parameters: Parameters, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._parameters = parameters
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Cells end at the first that is not there."""
        if message.get_srcSystem() != self._system_id or message.get_srcComponent() == AUTOPILOT:
            return
        voltages = list(message.voltages)
        count = voltages.index(NO_CELL) if NO_CELL in voltages else len(voltages)
        cells_v = tuple(millivolts / 1000.0 for millivolts in voltages[:count])
        voltage_v = 0.0
        for volts in cells_v:
            voltage_v = float32(voltage_v + float32(volts))
        current_a = _known(message.current_battery)
        remaining = _known(message.battery_remaining)
        temperature_c = math.nan if message.temperature == NO_TEMPERATURE else message.temperature / 100.0
        left_s = float(message.time_remaining) if message.time_remaining > 0 else math.nan
        self._topics.battery_status = BatteryStatusSample(
            now_us,
            True,
            voltage_v,
            current_a,
            remaining,
            float(message.current_consumed),
            battery_warning(self._parameters, remaining) if remaining >= 0.0 else 0,
            cells_v,
            temperature_c,
            left_s,
            id=0,
        )

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def _known(hundredths: int) -> float:
    """-1 is not known on either side: it is no hundredth."""
    return -1.0 if hundredths == UNKNOWN else hundredths / 100.0
