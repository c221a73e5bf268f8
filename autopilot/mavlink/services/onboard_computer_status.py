"""ONBOARD_COMPUTER_STATUS: how hot a companion computer's board is (topics.onboard_computer_status; COM_CC_TEMP_WARN).

https://mavlink.io/en/messages/common.html#ONBOARD_COMPUTER_STATUS. As PX4 (handle_message_onboard_computer_status):
from anybody, stamped with our time. The rest of what it says is for the log.
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import OnboardComputerStatus as Status
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

TOLD = Status._fields[1:]
"""The topic's fields have the message's names."""


class OnboardComputerStatus:
    """Writer of onboard_computer_status."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_ONBOARD_COMPUTER_STATUS})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep the last."""
        told = {name: getattr(message, name) for name in TOLD}
        for name, value in told.items():
            if isinstance(value, list):
                told[name] = tuple(value)
        self._topics.onboard_computer_status = Status(now_us, **told)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
