"""GLOBAL_POSITION_SENSOR: where a source other than GNSS says that the vehicle is (topics.aux_global_position).

https://mavlink.io/en/messages/common.html#GLOBAL_POSITION_SENSOR. As PX4 (handle_message_global_position_sensor): from
anybody, stamped with our time. Whether it is flown by, the filter decides (EKF2_AGPn_*).
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import AuxGlobalPosition, Topics, with_instance
from sitl_emu.core import dialect as mavlink


class GlobalPositionSensor:
    """Writer of aux_global_position."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_SENSOR})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """All that a link tells is one source, whatever its id."""
        lat, lon = message.lat * 1e-7, message.lon * 1e-7
        place = (lat, lon, message.alt, message.eph, message.epv)
        told = AuxGlobalPosition(now_us, now_us, message.id, *place, source=message.source, publisher=link.name)
        self._topics.aux_global_position = with_instance(self._topics.aux_global_position, told)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
