"""What the client half of a MAVLink service looks like to whoever drives it."""

from typing import Protocol

from sitl_emu.core import dialect as mavlink


class Service(Protocol):
    """A state machine which talks to one component until it is done."""

    @property
    def done(self) -> bool:
        """True when it has ended, well or not; it neither sends nor hears anything more."""
        ...

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """A message came in that was addressed to us or to all; returns what to send."""
        ...

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Time has passed; returns what to send (the first call sends the first request)."""
        ...
