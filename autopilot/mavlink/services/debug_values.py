"""Numbers that others want to see: NAMED_VALUE_FLOAT, NAMED_VALUE_INT, DEBUG, DEBUG_VECT, DEBUG_FLOAT_ARRAY.

https://mavlink.io/en/messages/common.html#NAMED_VALUE_FLOAT. As PX4: the last of each kind is kept, from anybody, and
told again by the stream of its name on every link; a named integer becomes a named float.
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import DebugArray, DebugKeyValue, DebugValue, DebugVect, Topics
from sitl_emu.core import dialect as mavlink

NAME_BYTES = 9
"""Of ten: the last is PX4's zero."""


class DebugValues:
    """Writer of debug_key_value, debug_value, debug_vect and debug_array."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT,
            mavlink.MAVLINK_MSG_ID_NAMED_VALUE_INT,
            mavlink.MAVLINK_MSG_ID_DEBUG,
            mavlink.MAVLINK_MSG_ID_DEBUG_VECT,
            mavlink.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY,
        }
    )
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep it, stamped with our time."""
        topics = self._topics
        message_id = message.get_msgId()
        if message_id == mavlink.MAVLINK_MSG_ID_DEBUG:
            topics.debug_value = DebugValue(now_us, message.ind, message.value)
        elif message_id == mavlink.MAVLINK_MSG_ID_DEBUG_VECT:
            topics.debug_vect = DebugVect(now_us, _name(message), (message.x, message.y, message.z))
        elif message_id == mavlink.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY:
            topics.debug_array = DebugArray(now_us, message.array_id, _name(message), tuple(message.data))
        else:
            topics.debug_key_value = DebugKeyValue(now_us, _name(message), float(message.value))

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def _name(message: Any) -> bytes:
    name: str = message.name
    return name.encode("ascii", "replace")[:NAME_BYTES]
