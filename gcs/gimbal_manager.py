"""A gimbal's other end: find its manager, take control, point it.

Source: https://mavlink.io/en/services/gimbal_v2.html. The manager (on PX4 the autopilot, where MNT_MODE_IN is 0 or
above) tells what the gimbal can, who is in control and where it looks; commands and set-points go to the manager, never
to the device. One that has not found its gimbal yet denies it, and is asked again. Who is not in control is refused. A
region of interest needs no control.
"""

import math
from typing import Any

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.message_request import MessageRequest

AUTOPILOT = 1
INFORMATION, STATUS, DEVICE_ATTITUDE_STATUS = 280, 281, 285
DO_GIMBAL_MANAGER_PITCHYAW, DO_GIMBAL_MANAGER_CONFIGURE = 1000, 1001
DO_SET_ROI_LOCATION, DO_SET_ROI_NONE = 195, 197
UNCHANGED, RELEASE = -1, -3
"""In DO_GIMBAL_MANAGER_CONFIGURE."""
STABILIZED = 4 | 8
"""ROLL_LOCK and PITCH_LOCK."""
YAW_LOCK = 16
FRAME_GLOBAL = 0

Quaternion = tuple[float, float, float, float]
UNKNOWN_Q: Quaternion = (math.nan, math.nan, math.nan, math.nan)


class GimbalManager:
    """The manager of one system, and the gimbal behind it; hand it every message and the time."""

    def __init__(self, system: int, component: int = AUTOPILOT) -> None:
        self.target = (system, component)
        self.information: Any = None
        """GIMBAL_MANAGER_INFORMATION: what it can, and its stops."""
        self.status: Any = None
        """GIMBAL_MANAGER_STATUS: who is in control."""
        self.attitude: Any = None
        """GIMBAL_DEVICE_ATTITUDE_STATUS."""
        self._request = self._ask()

    @property
    def done(self) -> bool:
        """Whether it is known if there is a gimbal."""
        return self._request.done

    @property
    def ready(self) -> bool:
        """Whether there is one."""
        return self.information is not None

    @property
    def refusal(self) -> str:
        """Why there is no gimbal, in words."""
        return self._request.refusal

    @property
    def in_control(self) -> tuple[int, int]:
        """System and component of who is in primary control; (0, 0) for nobody."""
        status = self.status
        return (0, 0) if status is None else (status.primary_control_sysid, status.primary_control_compid)

    @property
    def angles_deg(self) -> tuple[float, float, float] | None:
        """(roll, pitch, yaw) as it tells; yaw against north if `yaw_is_north`, else against the vehicle's heading."""
        return None if self.attitude is None else euler_deg(tuple(self.attitude.q))

    @property
    def yaw_is_north(self) -> bool:
        """What its yaw angle counts from."""
        return self.attitude is not None and bool(self.attitude.flags & YAW_LOCK)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Keeps what the manager and its gimbal say."""
        if msg.get_srcSystem() != self.target[0]:
            return []
        kind = msg.get_msgId()
        if kind == DEVICE_ATTITUDE_STATUS:
            self.attitude = msg
        elif msg.get_srcComponent() == self.target[1]:
            if kind == STATUS:
                self.status = msg
            elif kind == INFORMATION:
                self.information = msg
            self._request.on_message(now_us, msg)
            if kind == STATUS and self.information is None and self._request.done:
                self._request = self._ask()  # it has found its gimbal since
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for the manager."""
        return self._request.on_time(now_us)

    # --- commands: to be driven as any other -------------------------------------------------------------------

    def take_control(self, system: int, component: int) -> Command:
        """Make (system, component), which is us, the one whose set-points count."""
        return self._command(DO_GIMBAL_MANAGER_CONFIGURE, system, component, UNCHANGED, UNCHANGED)

    def release_control(self) -> Command:
        """Nobody is in control any more, if it was us."""
        return self._command(DO_GIMBAL_MANAGER_CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED)

    def point(self, pitch_deg: float, yaw_deg: float, *, yaw_is_north: bool = False) -> Command:
        """Look there; -90 is straight down. Yaw is against the vehicle's heading unless `yaw_is_north`."""
        flags = STABILIZED | (YAW_LOCK if yaw_is_north else 0)
        return self._command(DO_GIMBAL_MANAGER_PITCHYAW, pitch_deg, yaw_deg, math.nan, math.nan, flags)

    def look_at(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Command:
        """Look at a place from where the vehicle is; as it moves on, PX4 does not aim anew (output_mavlink.cpp)."""
        place = (round(lat_deg * 1e7), round(lon_deg * 1e7), alt_amsl_m)
        return Command(*self.target, DO_SET_ROI_LOCATION, (), place, FRAME_GLOBAL)

    def look_ahead(self) -> Command:
        """No place is looked at any more."""
        return self._command(DO_SET_ROI_NONE)

    # --- set-points: sent as often as they change, and not acknowledged ----------------------------------------

    def turn(self, pitch_rate_deg_s: float, yaw_rate_deg_s: float) -> mavlink.MAVLink_message:
        """Turn at these rates until the next set-point, for two seconds at most (PX4: output.cpp).

        By GIMBAL_MANAGER_SET_ATTITUDE: PX4 knows no SET_PITCHYAW.
        """
        rates = (0.0, math.radians(pitch_rate_deg_s), math.radians(yaw_rate_deg_s))
        return mavlink.MAVLink_gimbal_manager_set_attitude_message(*self.target, STABILIZED, 0, UNKNOWN_Q, *rates)

    def stick(self, pitch: float, yaw: float) -> mavlink.MAVLink_message:
        """A joystick, -1..1 each; the manager knows how fast that is."""
        return mavlink.MAVLink_gimbal_manager_set_manual_control_message(
            *self.target, STABILIZED, 0, math.nan, math.nan, pitch, yaw
        )

    def _ask(self) -> MessageRequest:
        return MessageRequest(self.target[0], INFORMATION, self.target[1])

    def _command(self, number: int, *params: float) -> Command:
        return Command(*self.target, number, params)


def euler_deg(q: Quaternion) -> tuple[float, float, float]:
    """(roll, pitch, yaw) of a quaternion (w first), yaw before pitch before roll."""
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)
