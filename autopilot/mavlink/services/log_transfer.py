"""Log download: LOG_REQUEST_LIST and following (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

The emulator keeps no logs on board yet: the list is empty, and requests for data go unanswered.
"""

from typing import Any

from autopilot.mavlink.link import Link
from autopilot.mavlink.services.service import is_for
from sitl_emu.core import dialect as mavlink


class LogTransfer:
    """Says that there are no logs."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_LOG_REQUEST_LIST})
    HAS_TIMER = False

    def __init__(self, system_id: int) -> None:
        """`system_id` is ours."""
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """An entry with num_logs 0 means none."""
        if is_for(message, self._system_id, broadcast=True) and message.start == 0:
            link.send_fields(mavlink.MAVLINK_MSG_ID_LOG_ENTRY, 0, 0, 0, 0, 0)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
