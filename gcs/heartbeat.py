"""HEARTBEAT: ours once a second, and how long we have not heard another's.

Source: https://mavlink.io/en/services/heartbeat.html. A component is taken for lost after `LOST_AFTER_US` without any
message of it (QGroundControl's 3.5 s); callers with lossy links give a longer limit.
"""

from sitl_emu.core import dialect as mavlink

PERIOD_US = 1_000_000
LOST_AFTER_US = 3_500_000
MAV_AUTOPILOT_INVALID = 8
MAV_STATE_ACTIVE = 4
MAVLINK_VERSION = 3


class Heartbeat:
    """Sends one HEARTBEAT a second."""

    def __init__(self, mav_type: int, custom_mode: int = 0) -> None:
        """`mav_type`: MAV_TYPE of this component, 6 a ground station, 18 an onboard controller.

        `custom_mode` is free for whoever is no autopilot.
        """
        self.mav_type, self.custom_mode = mav_type, custom_mode
        self._due_us: int | None = None

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The HEARTBEAT when it is due, the first at once."""
        if self._due_us is not None and now_us < self._due_us:
            return []
        self._due_us = now_us + PERIOD_US
        return [
            mavlink.MAVLink_heartbeat_message(
                self.mav_type, MAV_AUTOPILOT_INVALID, 0, self.custom_mode, MAV_STATE_ACTIVE, MAVLINK_VERSION
            )
        ]


class Watch:
    """Since when a component has been silent. It counts from the first look at it."""

    def __init__(self, lost_after_us: int = LOST_AFTER_US) -> None:
        self.lost_after_us = lost_after_us
        self.heard_us: int | None = None
        self._watched_since_us: int | None = None

    def heard(self, now_us: int) -> None:
        """Something of it has arrived."""
        self.heard_us = now_us

    def lost(self, now_us: int) -> bool:
        """True when it has been silent for longer than the limit."""
        if self._watched_since_us is None:
            self._watched_since_us = now_us
        since_us = self._watched_since_us if self.heard_us is None else self.heard_us
        return now_us - since_us > self.lost_after_us
