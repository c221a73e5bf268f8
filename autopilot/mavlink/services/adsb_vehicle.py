"""ADSB_VEHICLE: aircraft nearby, for the navigator's traffic avoidance, and to be told again on every link.

https://mavlink.io/en/messages/common.html#ADSB_VEHICLE, as PX4's handle_message_adsb_vehicle: from anybody, stamped
with our time.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import Topics, TransponderReport, queue_transponder_report
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, product

KNOWN_FLAGS = 0x3F
"""ADSB_FLAGS of coordinates, altitude, heading, velocity, callsign and squawk."""


class AdsbVehicle:
    """Writer of transponder_reports (`navigator fake_traffic` is another)."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_ADSB_VEHICLE})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Queue what it says."""
        report = TransponderReport(
            now_us,
            0,
            message.ICAO_address,
            message.lat * 1e-7,
            message.lon * 1e-7,
            message.altitude_type,
            message.altitude / 1000.0,
            product(float32(float32(message.heading / 100.0) / 180.0), math.pi),
            message.hor_velocity / 100.0,
            message.ver_velocity / 100.0,
            message.callsign.encode("ascii", "replace"),
            message.emitter_type,
            message.tslc,
            message.flags & KNOWN_FLAGS,
            message.squawk,
        )
        queue_transponder_report(self._topics, report)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
