"""What a vehicle's telemetry logs tell those who look on: its state, its mission's route, home, texts and events.

From the vehicle's own MAVLink (component 1) on its links to the ground station and to its companion, as logged. A
message that comes often is looked at twice a simulated second: decoding takes most of the time here.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from sitl_emu.gcs.modes import name_of
from sitl_emu.gcs.statustext import TextAssembler
from sitl_emu.run.view import px4_events

AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1."""
ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
PERIOD_S = 0.5
UNKNOWN_CM, UNKNOWN_MV, UNKNOWN_CENTIAMPERE, UNKNOWN_PERCENT, UNKNOWN_COUNT = 65535, 65535, -1, -1, 255
FIXES = ("no GPS", "no fix", "2D", "3D", "DGPS", "RTK float", "RTK fixed", "static", "PPP")
"""GPS_FIX_TYPE."""
GLOBAL_FRAMES, RELATIVE_FRAMES = (0, 5), (3, 6)
"""MAV_FRAME_GLOBAL, ..._RELATIVE_ALT, and their _INT twins."""
FLIGHT_MISSION = 0
"""MAV_MISSION_TYPE."""
SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
"""MAV_SEVERITY."""
LEAST = 6
"""MAV_SEVERITY_INFO: events below it are not for people."""


class State(NamedTuple):
    """What a vehicle said at a moment; only what is new. Names and units: `TelemetryReader`."""

    time_s: float
    fields: dict[str, Any]


class Waypoint(NamedTuple):
    """A place of a mission's item."""

    lat_deg: float
    lon_deg: float
    alt_m: float
    is_relative: bool
    """Whether `alt_m` counts from home, else AMSL."""
    command: int
    """MAV_CMD."""
    item: int
    """Its number in the mission."""


class Route(NamedTuple):
    """A mission that a vehicle has accepted."""

    time_s: float
    waypoints: tuple[Waypoint, ...]


class Text(NamedTuple):
    """STATUSTEXT, or an EVENT in words."""

    time_s: float
    severity: str
    text: str
    kind: str = "statustext"
    """Or "px4"."""


class HomeAt(NamedTuple):
    """HOME_POSITION."""

    time_s: float
    lat_deg: float
    lon_deg: float


Told = State | Route | Text | HomeAt


class TelemetryReader:
    """Reads one link's frames in their order.

    Fields of `State`: mode, armed; battery_percent, battery_v, battery_a; gps, satellites, gps_sigma_m; lat_deg,
    lon_deg, alt_home_m, speed_m_s, climb_m_s, heading_deg; item (of the mission).
    """

    def __init__(self, *, route_alone: bool = False) -> None:
        """`route_alone`: missions and nothing else, of a second link of the same vehicle."""
        self._route_alone = route_alone
        self._system = 0
        self._codec = mavlink.MAVLink(None)
        self._texts = TextAssembler()
        self._looked_s = dict[int, float]()
        self._fields = dict[str, Any]()
        self._upload = dict[int, Waypoint]()
        self._state: dict[int, Callable[[Any], dict[str, Any]]] = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: _heartbeat,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: _sys_status,
            mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: _gps_raw_int,
            mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position_int,
            mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: _mission_current,
        }

    def read(self, time_s: float, frame: bytes) -> Told | None:
        """What a frame tells, if anything; a damaged one tells nothing."""
        number = framing.message_id(frame)
        of_vehicle = self._is_of_vehicle(number, *framing.sender(frame))
        try:
            if number in MISSION_MESSAGES:
                return self._mission(time_s, number, self._decoded(frame), of_vehicle)
            return self._said(time_s, number, frame) if of_vehicle and not self._route_alone else None
        except mavlink.MAVError:
            return None

    def _said(self, time_s: float, number: int, frame: bytes) -> Told | None:
        if number in self._state:
            if time_s - self._looked_s.get(number, -PERIOD_S) < PERIOD_S:
                return None
            self._looked_s[number] = time_s
            return self._changed(time_s, self._state[number](self._decoded(frame)), number)
        if number == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            msg = self._decoded(frame)
            text = self._texts.on_message(msg)
            return None if text is None else Text(time_s, SEVERITIES[min(msg.severity, 7)], text)
        if number == mavlink.MAVLINK_MSG_ID_EVENT:
            msg = self._decoded(frame)
            said, level = px4_events.words(msg.id, bytes(msg.arguments)), msg.log_levels & 0xF
            return Text(time_s, SEVERITIES[level], said, "px4") if said is not None and level <= LEAST else None
        if number == mavlink.MAVLINK_MSG_ID_HOME_POSITION:
            msg = self._decoded(frame)
            return HomeAt(time_s, msg.latitude / 1e7, msg.longitude / 1e7)
        return None

    def _is_of_vehicle(self, number: int, system: int, component: int) -> bool:
        if component != AUTOPILOT:
            return False
        if not self._system and number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._system = system
        return system == self._system

    def _decoded(self, frame: bytes) -> Any:
        return self._codec.decode(bytearray(frame))

    def _changed(self, time_s: float, fields: dict[str, Any], number: int) -> State | None:
        new = {name: value for name, value in fields.items() if self._fields.get(name) != value}
        self._fields |= new
        if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            new["heard_s"] = round(time_s, 2)
        return State(time_s, new) if new else None

    def _mission(self, time_s: float, number: int, msg: Any, of_vehicle: bool) -> Route | None:
        """A mission counts from its last item's acknowledgement on."""
        if msg.mission_type != FLIGHT_MISSION:
            return None
        if number == mavlink.MAVLINK_MSG_ID_MISSION_COUNT and not of_vehicle:
            self._upload = {}
        elif number == mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT and not of_vehicle:
            waypoint = _waypoint(msg)
            if waypoint is not None:
                self._upload[msg.seq] = waypoint
        elif number == mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL and not of_vehicle:
            self._upload = {}
            return Route(time_s, ())
        elif number == mavlink.MAVLINK_MSG_ID_MISSION_ACK and of_vehicle and msg.type == 0 and self._upload:
            waypoints, self._upload = self._upload, {}
            return Route(time_s, tuple(waypoints[item] for item in sorted(waypoints)))
        return None


MISSION_MESSAGES = (
    mavlink.MAVLINK_MSG_ID_MISSION_COUNT,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
    mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
    mavlink.MAVLINK_MSG_ID_MISSION_ACK,
)


def _heartbeat(msg: Any) -> dict[str, Any]:
    return {"mode": name_of(msg.custom_mode), "armed": bool(msg.base_mode & ARMED)}


def _sys_status(msg: Any) -> dict[str, Any]:
    return {
        "battery_percent": msg.battery_remaining if msg.battery_remaining != UNKNOWN_PERCENT else None,
        "battery_v": round(msg.voltage_battery / 1e3, 2) if msg.voltage_battery != UNKNOWN_MV else None,
        "battery_a": round(msg.current_battery / 1e2, 1) if msg.current_battery != UNKNOWN_CENTIAMPERE else None,
    }


def _gps_raw_int(msg: Any) -> dict[str, Any]:
    return {
        "gps": FIXES[msg.fix_type] if msg.fix_type < len(FIXES) else str(msg.fix_type),
        "satellites": msg.satellites_visible if msg.satellites_visible != UNKNOWN_COUNT else None,
        "gps_sigma_m": round(msg.h_acc / 1e3, 2) if msg.h_acc else None,
    }


def _global_position_int(msg: Any) -> dict[str, Any]:
    return {
        "lat_deg": msg.lat / 1e7,
        "lon_deg": msg.lon / 1e7,
        "alt_home_m": round(msg.relative_alt / 1e3, 2),
        "speed_m_s": round(((msg.vx / 100.0) ** 2 + (msg.vy / 100.0) ** 2) ** 0.5, 2),
        "climb_m_s": round(-msg.vz / 100.0, 2),
        "heading_deg": round(msg.hdg / 100.0, 1) if msg.hdg != UNKNOWN_CM else None,
    }


def _mission_current(msg: Any) -> dict[str, Any]:
    return {"item": msg.seq}


def _waypoint(msg: Any) -> Waypoint | None:
    """The place of an item; None where it has none."""
    if msg.frame not in (*GLOBAL_FRAMES, *RELATIVE_FRAMES) or (msg.x == 0 and msg.y == 0):
        return None
    relative = msg.frame in RELATIVE_FRAMES
    return Waypoint(msg.x / 1e7, msg.y / 1e7, round(msg.z, 2), relative, msg.command, msg.seq)
