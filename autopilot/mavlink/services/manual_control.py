"""MANUAL_CONTROL: joystick of a ground station into topics.manual_control_mavlink.

https://mavlink.io/en/services/manual_control.html. As PX4: x, y, r in -1000..1000, z (throttle) in 0..1000; an axis out
of its range is at its centre, and so is an auxiliary one that enabled_extensions does not name. Whether these sticks
are flown, autopilot/manual_control/manual_control.py decides.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import SOURCE_MAVLINK_0, Aux, ManualControlInput, Topics
from sitl_emu.core import dialect as mavlink

FULL = 1000
FIRST_AUX_BIT = 2
"""Of enabled_extensions: aux1; the two before are pitch and roll angles, which PX4 does not know."""


class ManualControl:
    """Writer of topics.manual_control_mavlink."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL})
    HAS_TIMER = False

    def __init__(self, topics: Topics, links: Sequence[Link], system_id: int) -> None:
        """Writes into `topics`; the number of the link tells one joystick from another."""
        self._topics = topics
        self._sources = {link.name: SOURCE_MAVLINK_0 + number for number, link in enumerate(links)}
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """The message has a target system alone."""
        if message.target not in (0, self._system_id):
            return
        throttle = message.z / FULL * 2.0 - 1.0 if 0 <= message.z <= FULL else 0.0
        self._topics.manual_control_mavlink = ManualControlInput(
            now_us,
            self._sources.get(link.name, SOURCE_MAVLINK_0),
            _axis(message.y),
            _axis(message.x),
            _axis(message.r),
            throttle,
            message.buttons,
            _aux(message),
        )

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself: manual_control notices when sticks are lost."""


def _aux(message: Any) -> Aux:
    values = (message.aux1, message.aux2, message.aux3, message.aux4, message.aux5, message.aux6)
    enabled = message.enabled_extensions >> FIRST_AUX_BIT
    one, two, three, four, five, six = (
        _axis(value) if enabled >> number & 1 else 0.0 for number, value in enumerate(values)
    )
    return one, two, three, four, five, six


def _axis(value: int) -> float:
    return value / FULL if -FULL <= value <= FULL else 0.0
