"""Bearing along a line: the vehicle heads for the point of the path that is one look-ahead distance away.

Behaves as PX4's PurePursuit (src/lib/pure_pursuit, v1.18; R. C. Coulter, "Implementation of the Pure Pursuit Path
Tracking Algorithm", CMU 1992) with PP_LOOKAHD_GAIN, _MIN, _MAX. The path has no end: who has passed its target by more
than the look-ahead follows it further on.
"""

import math

from sitl_emu.autopilot.control.rover_control import clamp
from sitl_emu.autopilot.control.rover_parameters import EPSILON
from sitl_emu.autopilot.topics import PurePursuitStatus

Place = tuple[float, float]
"""North and east in metres."""


def lookahead_m(speed: float, gain: float, least_m: float, most_m: float) -> float:
    """Look-ahead distance for a speed in m/s."""
    return clamp(gain * abs(speed), least_m, most_m)


def target_bearing(target: Place, start: Place, place: Place, ahead_m: float) -> float:
    """Bearing in rad to drive from `place` for the line from `start` to `target`."""
    to_n, to_e = target[0] - place[0], target[1] - place[1]
    leg_n, leg_e = target[0] - start[0], target[1] - start[1]
    leg = math.hypot(leg_n, leg_e)
    if leg < EPSILON or math.hypot(to_n, to_e) < ahead_m:
        return math.atan2(to_e, to_n)
    u_n, u_e = leg_n / leg, leg_e / leg
    off_n, off_e = place[0] - start[0], place[1] - start[1]
    along = off_n * u_n + off_e * u_e
    path_n, path_e = along * u_n - off_n, along * u_e - off_e
    across = math.hypot(path_n, path_e)
    if across > ahead_m:
        if (path_n + off_n) * leg_n + (path_e + off_e) * leg_e < EPSILON:
            return math.atan2(-off_e, -off_n)
        if (path_n - to_n) * leg_n + (path_e - to_e) * leg_e > EPSILON:
            return math.atan2(to_e, to_n)
        return math.atan2(path_e, path_n)
    onwards = math.sqrt(ahead_m * ahead_m - across * across)
    return math.atan2(path_e + onwards * u_e, path_n + onwards * u_n)


def pursuit(now_us: int, target: Place, start: Place, place: Place, ahead_m: float) -> PurePursuitStatus:
    """Where `target_bearing` leads, and how far the vehicle is from the line and its end."""
    to_n, to_e = target[0] - place[0], target[1] - place[1]
    leg_n, leg_e = target[0] - start[0], target[1] - start[1]
    leg = math.hypot(leg_n, leg_e)
    # a line without length has no side, which in PX4 is an error of 0
    right_m = (leg_n * (place[1] - start[1]) - leg_e * (place[0] - start[0])) / leg if leg >= EPSILON else 0.0
    bearing = target_bearing(target, start, place, ahead_m)
    return PurePursuitStatus(now_us, ahead_m, bearing, right_m, math.hypot(to_n, to_e), math.atan2(to_e, to_n))
