"""What a vehicle last said of itself, and where it was at a given moment.

Source: https://mavlink.io/en/messages/common.html. The vehicle's own stamps (`time_boot_ms`) order the history, so
that a camera frame can be given the pose of its moment (`pose_at`): attitude by spherical interpolation, position by
cubic Hermite between two GLOBAL_POSITION_INT, whose velocities are known. Nothing is extrapolated for longer than 0.1
s.
"""

import math
from collections import deque
from typing import NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.heartbeat import Watch
from sitl_emu.gcs.modes import name_of

HISTORY = 256
"""Poses kept: 5 s at PX4's 50 Hz."""
EXTRAPOLATE_US = 100_000
GIMBAL_EXTRAPOLATE_US = 200_000
"""A gimbal tells ten times a second where it looks, and holds still for the most part."""
REBOOT_US = 1_000_000
"""A boot time that falls by more is another boot's, and no message that was overtaken; ours."""
GIMBAL_DEVICE_ATTITUDE_STATUS = 285
YAW_LOCK, YAW_IN_VEHICLE, YAW_IN_EARTH_FRAME = 16, 32, 64
"""GIMBAL_DEVICE_FLAGS."""
MODE_FLAG_SAFETY_ARMED = 128
PREARM_CHECK = 0x10000000
LOOKS_DOWN = 25
"""MAV_SENSOR_ROTATION_PITCH_270."""


class Place(NamedTuple):
    """GLOBAL_POSITION_INT in degrees, metres and metres a second (velocity in NED)."""

    time_us: int
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_home_m: float
    v_north: float
    v_east: float
    v_down: float


class Range(NamedTuple):
    """DISTANCE_SENSOR: the distance that a lidar or a sonar measured, and when, in the vehicle's boot time."""

    time_us: int
    distance_m: float
    orientation: int
    """MAV_SENSOR_ORIENTATION: 25 looks down (MAV_SENSOR_ROTATION_PITCH_270)."""


class Attitude(NamedTuple):
    """ATTITUDE_QUATERNION: body FRD to NED, w first."""

    time_us: int
    q: tuple[float, float, float, float]


class GimbalAttitude(NamedTuple):
    """GIMBAL_DEVICE_ATTITUDE_STATUS: where what a gimbal carries looks, w first; roll and pitch against the horizon.

    The gimbal's boot time is taken for the vehicle's.
    """

    time_us: int
    q: tuple[float, float, float, float]
    is_north: bool
    """Whether its yaw counts from north, else from the vehicle's heading."""


class Pose(NamedTuple):
    """Where a vehicle was and how it lay at one moment of its own time."""

    time_us: int
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_home_m: float
    v_north: float
    v_east: float
    v_down: float
    q: tuple[float, float, float, float]

    @property
    def yaw_rad(self) -> float:
        """Heading from north over east."""
        w, x, y, z = self.q
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _slerp(
    a: tuple[float, float, float, float], b: tuple[float, float, float, float], t: float
) -> tuple[float, float, float, float]:
    """Between two attitudes that are close (normalised linear: the angle between samples is a few degrees)."""
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    w, x, y, z = ((1.0 - t) * p + t * sign * q for p, q in zip(a, b, strict=True))
    norm = math.sqrt(w * w + x * x + y * y + z * z) or 1.0
    return w / norm, x / norm, y / norm, z / norm


def _hermite(p0: float, v0: float, p1: float, v1: float, dt: float, t: float) -> float:
    """Cubic from p0 to p1 with the slopes v0 and v1 (per second), `t` in 0..1 of `dt` seconds."""
    t2, t3 = t * t, t * t * t
    bend = (t3 - 2.0 * t2 + t) * v0 + (t3 - t2) * v1
    return p0 + (3.0 * t2 - 2.0 * t3) * (p1 - p0) + bend * dt


def _turned(yaw_rad: float, q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """An attitude that counts from a heading, to NED."""
    c, s = math.cos(yaw_rad / 2.0), math.sin(yaw_rad / 2.0)
    w, x, y, z = q
    return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w


def _gimbal_attitude(msg: mavlink.MAVLink_message) -> GimbalAttitude:
    w, x, y, z = msg.q
    is_north = bool(msg.flags & YAW_IN_EARTH_FRAME) or bool(msg.flags & YAW_LOCK and not msg.flags & YAW_IN_VEHICLE)
    return GimbalAttitude(msg.time_boot_ms * 1000, (w, x, y, z), is_north)


METRES_PER_DEG = math.radians(1.0) * 6371000.0


class Wind(NamedTuple):
    """WIND_COV: where the air moves to, m/s, at the vehicle's own height."""

    north_m_s: float
    east_m_s: float


class Telemetry:
    """The latest state of the autopilot of one system."""

    def __init__(self, system: int = 0) -> None:
        """`system` 0: the system of the first autopilot that is heard."""
        self.system = system
        self.watch = Watch()
        self.mav_type = 0
        self.custom_mode = 0
        self.base_mode = 0
        self.system_status = 0
        self.landed_state = 0
        self.prearm_ok = False
        self.battery_percent: int | None = None
        self.compass_ok = True
        """Whether its magnetometer works, as far as it has said (SYS_STATUS: enabled, and not healthy)."""
        self.place: Place | None = None
        self.home: tuple[float, float, float] | None = None
        self.mission_current = 0
        self.mission_reached: int | None = None
        self.eph_m: float | None = None
        """Horizontal accuracy (one sigma) that the GNSS receiver states of itself (GPS_RAW_INT.h_acc; sensor_gps.eph in
        PX4); None if it states none."""
        self.epv_m: float | None = None
        """The same of the height."""
        self.has_fix = False
        """Whether the receiver has a position (GPS_RAW_INT.fix_type from 3D on)."""
        self.gps_glitches = 0
        """How many ESTIMATOR_STATUS in a row have told of one: the receiver's place lies beyond its gate."""
        self.wind: Wind | None = None
        """As the autopilot estimates it; None where it does not (PX4: EKF2_DRAG_CTRL, of a multicopter)."""
        self.ranges: deque[Range] = deque(maxlen=HISTORY)
        """Distances measured, in the order they came; what was out of the sensor's range is left out."""
        self.range_heard_us: int | None = None
        """When a range finder that looks down spoke last, by the vehicle's boot time, in its range or not; None: none
        has."""
        self.boot_time_us = 0
        self._unix_ahead_us: int | None = None
        self._places: deque[Place] = deque(maxlen=HISTORY)
        self._attitudes: deque[Attitude] = deque(maxlen=HISTORY)
        self._gimbals: deque[GimbalAttitude] = deque(maxlen=HISTORY)

    @property
    def mode(self) -> str:
        """Name of the flight mode (gcs.modes), "" before the first heartbeat."""
        return name_of(self.custom_mode) if self.watch.heard_us is not None else ""

    @property
    def armed(self) -> bool:
        """Whether the heartbeat says so."""
        return bool(self.base_mode & MODE_FLAG_SAFETY_ARMED)

    @property
    def landed(self) -> bool:
        """Whether it stands on the ground."""
        return self.landed_state == 1

    @property
    def attitude(self) -> Attitude | None:
        """The latest attitude."""
        return self._attitudes[-1] if self._attitudes else None

    @property
    def speed_m_s(self) -> float:
        """Horizontal speed, infinite while unknown."""
        return math.hypot(self.place.v_north, self.place.v_east) if self.place else math.inf

    @property
    def wind_m_s(self) -> float | None:
        """Horizontal speed of the wind, None while unknown."""
        return math.hypot(*self.wind) if self.wind is not None else None

    @property
    def ready(self) -> bool:
        """Pre-arm checks pass, position and home are known."""
        return self.prearm_ok and self.place is not None and self.home is not None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> None:
        """Takes what an autopilot (component 1) of our system says, and where a gimbal looks; no more is looked at."""
        if msg.get_msgId() == GIMBAL_DEVICE_ATTITUDE_STATUS and msg.get_srcSystem() == self.system:
            self._gimbals.append(_gimbal_attitude(msg))
        if msg.get_srcComponent() != 1 or self.system not in (0, msg.get_srcSystem()):
            return
        kind = msg.get_type()
        if self.system == 0:
            if kind != "HEARTBEAT":
                return
            self.system = msg.get_srcSystem()
        if kind in ("ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT"):
            self._note_boot_time(msg.time_boot_ms * 1000)
        if kind == "ATTITUDE_QUATERNION":
            self._attitudes.append(Attitude(msg.time_boot_ms * 1000, (msg.q1, msg.q2, msg.q3, msg.q4)))
        elif kind == "GLOBAL_POSITION_INT":
            self.place = Place(
                msg.time_boot_ms * 1000,
                msg.lat * 1e-7,
                msg.lon * 1e-7,
                msg.alt * 1e-3,
                msg.relative_alt * 1e-3,
                msg.vx * 1e-2,
                msg.vy * 1e-2,
                msg.vz * 1e-2,
            )
            self._places.append(self.place)
        elif kind == "HEARTBEAT":
            self.mav_type, self.custom_mode, self.base_mode = msg.type, msg.custom_mode, msg.base_mode
            self.system_status = msg.system_status
        elif kind == "CURRENT_MODE":
            self.custom_mode = msg.custom_mode
        elif kind == "EXTENDED_SYS_STATE":
            self.landed_state = msg.landed_state
        elif kind == "SYS_STATUS":
            self.prearm_ok = bool(msg.onboard_control_sensors_health & PREARM_CHECK)
            failed = msg.onboard_control_sensors_enabled & ~msg.onboard_control_sensors_health
            self.compass_ok = not failed & mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
            self.battery_percent = msg.battery_remaining if msg.battery_remaining >= 0 else None
        elif kind == "HOME_POSITION":
            self.home = (msg.latitude * 1e-7, msg.longitude * 1e-7, msg.altitude * 1e-3)
        elif kind == "MISSION_CURRENT":
            self.mission_current = msg.seq
        elif kind == "MISSION_ITEM_REACHED":
            self.mission_reached = msg.seq
        elif kind == "DISTANCE_SENSOR":
            if msg.orientation == LOOKS_DOWN:
                self.range_heard_us = msg.time_boot_ms * 1000
            if msg.min_distance <= msg.current_distance <= msg.max_distance:
                self.ranges.append(Range(msg.time_boot_ms * 1000, msg.current_distance / 100.0, msg.orientation))
        elif kind == "GPS_RAW_INT":
            self.eph_m = msg.h_acc / 1000.0 if msg.h_acc else None
            self.epv_m = msg.v_acc / 1000.0 if msg.v_acc else None
            self.has_fix = msg.fix_type >= mavlink.GPS_FIX_TYPE_3D_FIX
        elif kind == "ESTIMATOR_STATUS":
            self.gps_glitches = self.gps_glitches + 1 if msg.flags & mavlink.ESTIMATOR_GPS_GLITCH else 0
        elif kind == "WIND_COV":
            self.wind = Wind(msg.wind_x, msg.wind_y)
        elif kind == "SYSTEM_TIME" and msg.time_unix_usec:
            self._unix_ahead_us = msg.time_unix_usec - now_us
        self.watch.heard(now_us)

    def _note_boot_time(self, time_us: int) -> None:
        """The newest; what was known by the time of another boot is known no more, nor is home."""
        if time_us < self.boot_time_us - REBOOT_US:
            self.boot_time_us, self.range_heard_us, self.home = 0, None, None
            for history in (self.ranges, self._places, self._attitudes, self._gimbals):
                history.clear()
        self.boot_time_us = max(self.boot_time_us, time_us)

    def unix_us(self, now_us: int) -> int:
        """Microseconds since 1970 by the autopilot's clock, at the runner's time; 0 as long as it does not know."""
        return now_us + self._unix_ahead_us if self._unix_ahead_us is not None else 0

    def range_at(self, time_us: int, within_us: int, orientation: int = LOOKS_DOWN) -> Range | None:
        """The range measured nearest to a moment of the vehicle's boot time; None if none was within `within_us`."""
        near = [
            one for one in self.ranges if one.orientation == orientation and abs(one.time_us - time_us) <= within_us
        ]
        return min(near, key=lambda one: abs(one.time_us - time_us), default=None)

    def gimbal_at(self, time_us: int, yaw_rad: float) -> tuple[float, float, float, float] | None:
        """The attitude (to NED) of what the gimbal carries, at a moment at which the vehicle headed for `yaw_rad`.

        None if it is not (or no longer, or not yet) known.
        """
        gimbals = self._gimbals
        if not gimbals or time_us < gimbals[0].time_us or time_us > gimbals[-1].time_us + GIMBAL_EXTRAPOLATE_US:
            return None
        at = next((i for i in range(len(gimbals) - 1, -1, -1) if gimbals[i].time_us <= time_us), 0)
        a, b = gimbals[at], gimbals[min(at + 1, len(gimbals) - 1)]
        span = b.time_us - a.time_us
        q = _slerp(a.q, b.q, (time_us - a.time_us) / span) if span > 0 and a.is_north == b.is_north else a.q
        return q if a.is_north else _turned(yaw_rad, q)

    def pose_at(self, time_us: int) -> Pose | None:
        """The pose at a moment of the vehicle's boot time; None if it is not (or no longer, or not yet) known."""
        place, attitude = self._place_at(time_us), self._attitude_at(time_us)
        if place is None or attitude is None:
            return None
        return Pose(time_us, *place[1:], attitude)

    def _place_at(self, time_us: int) -> Place | None:
        places = self._places
        if not places or time_us < places[0].time_us or time_us > places[-1].time_us + EXTRAPOLATE_US:
            return None
        after = next((i for i in range(len(places) - 1, -1, -1) if places[i].time_us <= time_us), 0)
        a = places[after]
        if after == len(places) - 1:
            return _moved(a, time_us)
        b = places[after + 1]
        dt = (b.time_us - a.time_us) * 1e-6
        t = (time_us - a.time_us) * 1e-6 / dt if dt > 0.0 else 0.0
        per_lon = METRES_PER_DEG * math.cos(math.radians(a.lat_deg))
        return Place(
            time_us,
            _hermite(a.lat_deg, a.v_north / METRES_PER_DEG, b.lat_deg, b.v_north / METRES_PER_DEG, dt, t),
            _hermite(a.lon_deg, a.v_east / per_lon, b.lon_deg, b.v_east / per_lon, dt, t),
            _hermite(a.alt_amsl_m, -a.v_down, b.alt_amsl_m, -b.v_down, dt, t),
            _hermite(a.alt_home_m, -a.v_down, b.alt_home_m, -b.v_down, dt, t),
            *(p + t * (q - p) for p, q in zip(a[5:], b[5:], strict=True)),
        )

    def _attitude_at(self, time_us: int) -> tuple[float, float, float, float] | None:
        attitudes = self._attitudes
        if not attitudes or time_us < attitudes[0].time_us or time_us > attitudes[-1].time_us + EXTRAPOLATE_US:
            return None
        after = next((i for i in range(len(attitudes) - 1, -1, -1) if attitudes[i].time_us <= time_us), 0)
        a = attitudes[after]
        if after == len(attitudes) - 1:
            return a.q
        b = attitudes[after + 1]
        span = b.time_us - a.time_us
        return _slerp(a.q, b.q, (time_us - a.time_us) / span if span > 0 else 0.0)


def _moved(place: Place, time_us: int) -> Place:
    """A place carried on with its velocity."""
    dt = (time_us - place.time_us) * 1e-6
    per_lon = METRES_PER_DEG * math.cos(math.radians(place.lat_deg))
    return place._replace(
        time_us=time_us,
        lat_deg=place.lat_deg + place.v_north * dt / METRES_PER_DEG,
        lon_deg=place.lon_deg + place.v_east * dt / per_lon,
        alt_amsl_m=place.alt_amsl_m - place.v_down * dt,
        alt_home_m=place.alt_home_m - place.v_down * dt,
    )
