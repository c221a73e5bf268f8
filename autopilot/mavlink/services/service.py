"""What every service looks like to the dispatcher."""

import math
from typing import Any, ClassVar, Protocol

from sitl_emu.autopilot.mavlink.link import Link


class Service(Protocol):
    """A state machine that is handed the messages it lists, and the time if it wants it."""

    MESSAGES: ClassVar[frozenset[int]]
    """MAVLink ids that it wants."""
    HAS_TIMER: bool
    """Whether `on_time` does anything."""

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """A message of the list came in on a link; answer by `link.send...`."""
        ...

    def on_time(self, now_us: int) -> None:
        """A tick passed."""
        ...


def is_for(message: Any, system_id: int, broadcast: bool) -> bool:
    """Whether a targeted message is for this autopilot; `broadcast` accepts target system 0 as well."""
    system, component = message.target_system, message.target_component
    return (system == system_id or (broadcast and system == 0)) and component in (0, 1)


def finite_or_nan(value: float) -> float:
    """A number as it came, NaN for an infinite one: neither is a number to PX4's code, which asks for finite ones."""
    return value if math.isfinite(value) else math.nan
