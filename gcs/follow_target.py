"""Being followed: where we are, streamed, and the change of mode.

Sources: https://mavlink.io/en/messages/common.html#FOLLOW_TARGET and
https://docs.px4.io/v1.18/en/flight_modes_mc/follow_me.html: PX4 wants our position once a second at least, and takes
the distance and side that it keeps from FLW_TGT_DST, FLW_TGT_FA and FLW_TGT_HT.
"""

import math
from typing import NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.set_mode import set_mode

PERIOD_US = 200_000
POSITION_AND_VELOCITY = 3
"""Bits of est_capabilities."""


class Target(NamedTuple):
    """Where the thing is that is to be followed, and how it moves in NED."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    v_north: float = 0.0
    v_east: float = 0.0
    v_down: float = 0.0


class FollowTarget:
    """Streams `target` five times a second and asks for follow-me mode; `command.outcome` tells of the mode."""

    def __init__(self, system: int, target: Target) -> None:
        """`target` is to be replaced as it moves."""
        self.target = target
        self.command: Command = set_mode(system, "follow_me")
        self.done = False
        self._due_us: int | None = None

    def stop(self) -> None:
        """Ends the stream; PX4 then waits where it is."""
        self.done = True

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the ack of the mode."""
        return self.command.on_message(now_us, msg)

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The position when it is due, and the command for the mode."""
        if self.done:
            return []
        if self._due_us is not None and now_us < self._due_us:
            return self.command.on_time(now_us)
        self._due_us = now_us + PERIOD_US
        return [self._message(now_us), *self.command.on_time(now_us)]

    def _message(self, now_us: int) -> mavlink.MAVLink_message:
        lat_deg, lon_deg, alt_amsl_m, *velocity = self.target
        unknown = (math.nan,) * 3
        return mavlink.MAVLink_follow_target_message(
            now_us // 1000,
            POSITION_AND_VELOCITY,
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            alt_amsl_m,
            velocity,
            unknown,
            (1.0, 0.0, 0.0, 0.0),
            unknown,
            unknown,
            0,
        )
