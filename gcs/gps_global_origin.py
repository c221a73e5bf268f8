"""Where on Earth the local frame of a vehicle begins that has no GPS of its own.

Source: https://mavlink.io/en/messages/common.html#SET_GPS_GLOBAL_ORIGIN. GPS_GLOBAL_ORIGIN tells the origin as it then
is: PX4 sends it when it has changed, and when it is asked for. PX4 keeps the one it has while its filter is in the air
or fuses GPS.
"""

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.question import Question

AS_SET_DEG_E7, AS_SET_MM = 10, 100
"""As near as a place comes back that has been through an autopilot's own numbers."""


class SetGpsGlobalOrigin(Question):
    """Sets the origin; `origin` is what the vehicle answered, (lat, lon in 1e-7 deg, altitude in mm)."""

    def __init__(self, system: int, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> None:
        super().__init__(system)
        self.place = (round(lat_deg * 1e7), round(lon_deg * 1e7), round(alt_amsl_m * 1e3))
        self.origin: tuple[int, int, int] | None = None

    @property
    def accepted(self) -> bool:
        """Whether the origin is where it was wanted."""
        return self.origin is not None and all(
            abs(is_at - wanted) <= limit
            for is_at, wanted, limit in zip(
                self.origin, self.place, (AS_SET_DEG_E7, AS_SET_DEG_E7, AS_SET_MM), strict=True
            )
        )

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the answer. One that names another place may be older than the question: it is asked again."""
        asked = self._sent > 0 and not self.done
        if asked and msg.get_type() == "GPS_GLOBAL_ORIGIN" and msg.get_srcSystem() == self.target[0]:
            self.origin = (msg.latitude, msg.longitude, msg.altitude)
            self.done = self.accepted
        return []

    def _messages(self) -> list[mavlink.MAVLink_message]:
        ask = mavlink.MAVLink_command_long_message(
            *self.target, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, *(0.0,) * 6
        )  # PX4 tells a new origin once
        return [mavlink.MAVLink_set_gps_global_origin_message(self.target[0], *self.place), ask]
