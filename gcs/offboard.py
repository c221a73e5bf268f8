"""Offboard control: a stream of setpoints, and the change of mode once PX4 has heard it.

Source: https://docs.px4.io/v1.18/en/flight_modes/offboard.html: setpoints have to come at 2 Hz or more, for a second
before the mode is asked for, and as long as it is flown (COM_OF_LOSS_T). Frames and masks:
https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED. Attitude setpoints are not offered here.
"""

import math

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.set_mode import set_mode

PERIOD_US = 50_000
BEFORE_MODE_US = 1_000_000
FRAME_LOCAL_NED = 1

IGNORE_POSITION = 7
IGNORE_VELOCITY = 56
IGNORE_ACCELERATION = 448
IGNORE_YAW = 1024
IGNORE_YAW_RATE = 2048


def position_ned(
    system: int, north_m: float, east_m: float, down_m: float, yaw_rad: float | None = None
) -> mavlink.MAVLink_message:
    """A place in the local frame, with or without a heading."""
    mask = IGNORE_VELOCITY | IGNORE_ACCELERATION | IGNORE_YAW_RATE | (IGNORE_YAW if yaw_rad is None else 0)
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, system, 1, FRAME_LOCAL_NED, mask, north_m, east_m, down_m, 0, 0, 0, 0, 0, 0, yaw_rad or 0.0, 0
    )


def velocity_ned(
    system: int, north_m_s: float, east_m_s: float, down_m_s: float, yaw_rate_rad_s: float = 0.0
) -> mavlink.MAVLink_message:
    """A velocity in the local frame with a yaw rate."""
    mask = IGNORE_POSITION | IGNORE_ACCELERATION | IGNORE_YAW
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0,
        system,
        1,
        FRAME_LOCAL_NED,
        mask,
        math.nan,
        math.nan,
        math.nan,
        north_m_s,
        east_m_s,
        down_m_s,
        0,
        0,
        0,
        0,
        yaw_rate_rad_s,
    )


class Offboard:
    """Streams `setpoint` at 20 Hz and asks for offboard mode after a second; `command.outcome` tells of the mode."""

    def __init__(self, system: int, setpoint: mavlink.MAVLink_message) -> None:
        """`setpoint` may be replaced at any time."""
        self.setpoint = setpoint
        self.command: Command = set_mode(system, "offboard")
        self.done = False
        self._began_us: int | None = None
        self._due_us = 0

    def stop(self) -> None:
        """Ends the stream; PX4 falls back to COM_OBL_RC_ACT unless another mode was set before."""
        self.done = True

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the ack of the mode."""
        return self.command.on_message(now_us, msg)

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The setpoint when it is due, and the command for the mode."""
        if self.done:
            return []
        if self._began_us is None:
            self._began_us = self._due_us = now_us
        out: list[mavlink.MAVLink_message] = []
        if now_us >= self._due_us:
            self._due_us += PERIOD_US
            out.append(self.setpoint)
        if now_us - self._began_us >= BEFORE_MODE_US:
            out += self.command.on_time(now_us)
        return out
