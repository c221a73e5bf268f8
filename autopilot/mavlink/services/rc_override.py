"""RC_CHANNELS_OVERRIDE: channels as if from a receiver (topics.input_rc), shown in RC_CHANNELS.

As PX4 (handle_message_rc_channels_override): up to 18 channels; UINT16_MAX ignores a channel, 0 ignores channels 9 and
above; the last that is not ignored gives their number. One that is ignored before it stays UINT16_MAX, which counts as
full deflection, as nobody else has a value for it. Whether they are flown, rc_update and COM_RC_IN_MODE decide.

The first link on which it came since boot is the receiver, others are not listened to: each has an instance of input_rc
of its own (mavlink_receiver.h, _rc_pub), and who reads reads the first (rc_update.h, RC_CHANNELS.hpp).
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import InputRc, Topics
from sitl_emu.core import dialect as mavlink

CHANNELS = 18
FIRST_CHANNELS = 8
"""Of MAVLink 1's message: there 0 is a value."""
IGNORED = 65535


class RcOverride:
    """Writer of topics.input_rc."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE})
    HAS_TIMER = False

    def __init__(self, topics: Topics, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._system_id = system_id
        self._link: Link | None = None

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Channels up to the last that is set."""
        if message.target_system not in (0, self._system_id) or self._link not in (None, link):
            return
        self._link = link
        channels = [getattr(message, f"chan{number}_raw", 0) for number in range(1, CHANNELS + 1)]
        while channels and (channels[-1] == IGNORED or (len(channels) > FIRST_CHANNELS and channels[-1] == 0)):
            channels.pop()
        self._topics.input_rc = InputRc(now_us, tuple(channels))

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
