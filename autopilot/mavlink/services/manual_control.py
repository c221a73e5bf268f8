"""MANUAL_CONTROL: joystick of a ground station into topics.manual_control_setpoint.

As PX4: x, y, r in -1000..1000, z (throttle) in 0..1000 of the message; the sticks are valid until nothing came for
COM_RC_LOSS_T. COM_RC_IN_MODE 4 (stick input disabled) turns it off.
"""

from typing import Any

from autopilot.mavlink.link import Link
from autopilot.parameters import Parameters
from autopilot.topics import ManualControlSetpoint, Topics
from sitl_emu.core import dialect as mavlink

STICKS_MOVING = 0.05
DISABLED = 4
FULL = 1000.0


class ManualControl:
    """Writer of topics.manual_control_setpoint."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL})
    HAS_TIMER = True

    def __init__(self, topics: Topics, parameters: Parameters, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._parameters = parameters
        self._system_id = system_id
        self._lost_us = 0

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """The message has a target system alone."""
        if message.target != self._system_id or int(self._parameters["COM_RC_IN_MODE"]) == DISABLED:
            return
        pitch, roll, yaw = message.x / FULL, message.y / FULL, message.r / FULL
        throttle = message.z / FULL * 2.0 - 1.0
        before = self._topics.manual_control_setpoint
        moved = max(
            abs(roll - before.roll), abs(pitch - before.pitch), abs(yaw - before.yaw), abs(throttle - before.throttle)
        )
        moving = before.valid and moved > STICKS_MOVING
        self._topics.manual_control_setpoint = ManualControlSetpoint(now_us, True, roll, pitch, yaw, throttle, moving)
        self._lost_us = now_us + int(float(self._parameters["COM_RC_LOSS_T"]) * 1e6)

    def on_time(self, now_us: int) -> None:
        """Sticks that are not heard of any more are not valid."""
        if self._lost_us and now_us >= self._lost_us:
            self._lost_us = 0
            sticks = self._topics.manual_control_setpoint
            self._topics.manual_control_setpoint = sticks._replace(timestamp=now_us, valid=False, sticks_moving=False)
