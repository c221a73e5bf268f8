"""Sticks of a joystick, streamed for as long as somebody holds them.

Source: https://mavlink.io/en/services/manual_control.html. 25 times a second, as QGroundControl does; PX4 takes the
sticks for lost COM_RC_LOSS_T after the last message, and flies them where COM_RC_IN_MODE lets it.
"""

from typing import NamedTuple

from sitl_emu.core import dialect as mavlink

PERIOD_US = 40_000
FULL = 1000


class Sticks(NamedTuple):
    """-1..1, forward, right and clockwise positive; the throttle 0..1."""

    pitch: float = 0.0
    roll: float = 0.0
    throttle: float = 0.5
    yaw: float = 0.0
    buttons: int = 0
    """A bit a button."""


class ManualControl:
    """Streams `sticks`, which may be replaced at any time, until it is stopped."""

    def __init__(self, system: int, sticks: Sticks = Sticks()) -> None:  # noqa: B008 (immutable)
        self.system = system
        self.sticks = sticks
        self.done = False
        self._due_us: int | None = None

    def stop(self) -> None:
        """Lets go of the sticks."""
        self.done = True

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Nobody answers."""
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The sticks when they are due."""
        if self.done or (self._due_us is not None and now_us < self._due_us):
            return []
        self._due_us = now_us + PERIOD_US
        pitch, roll, throttle, yaw = (round(max(-1.0, min(1.0, axis)) * FULL) for axis in self.sticks[:4])
        return [
            mavlink.MAVLink_manual_control_message(
                self.system, pitch, roll, max(0, throttle), yaw, self.sticks.buttons & 0xFFFF
            )
        ]
