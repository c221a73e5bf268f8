"""Where home is: set at the first good position, again at arming and takeoff, and by DO_SET_HOME.

PX4's HomePosition (src/modules/commander/HomePosition.cpp, v1.18). COM_HOME_EN 0 leaves home unset. Its place on the
globe is the filter's, and the receiver's as long as the filter has none, if the receiver is good and the filter may use
it (EKF2_GPS_CTRL); its place in the local frame (x, y, z; NaN: none) is there as soon as that frame counts. So either
may be missing, and is worked out from the other in the air (COM_HOME_IN_AIR). A home that somebody gave stays, until
somebody asks for the vehicle's own place; so does home while a mission is flown. On the ground a home that was set by
itself follows the vehicle when it has been moved further than its position may be wrong.

Left out: a home of which the height alone is known. A drift of the receiver's height: home_altitude.py.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.topics import HomePosition, SensorGps, Topics
from sitl_emu.core.geodesy import MapProjection, distance_m

MOVED_AT_LEAST_M: Final = 1.0
RISEN_AT_LEAST_M: Final = 1.5
"""Or twice what the place may be off: hasMovedFromCurrentHomeLocation."""
GOOD_FIX: Final = 2
GOOD_EPH_M: Final = 5.0
GOOD_EPV_M: Final = 10.0
GOOD_SPEED_ACCURACY_M_S: Final = 1.0
"""A receiver that may give a home (HomePosition.cpp)."""
FUSES_POSITION_AND_HEIGHT: Final = 0b11
"""EKF2_GPS_CTRL."""


class _Place(NamedTuple):
    """On the globe."""

    lat: float
    lon: float
    alt: float


def at_vehicle(now_us: int, topics: Topics, ekf2_gps_ctrl: int) -> HomePosition | None:
    """Home where the vehicle is, as far as that is known; None without any position."""
    place, local = _place(topics, ekf2_gps_ctrl), topics.vehicle_local_position
    home = HomePosition(now_us, yaw=0.0, update_count=topics.home_position.update_count + 1)
    if place is not None:
        home = home._replace(valid=True, lat=place.lat, lon=place.lon, alt=place.alt)
    if not topics.failsafe_flags.local_position_invalid:
        roll, pitch, _ = topics.vehicle_attitude.euler
        home = home._replace(x=local.x, y=local.y, z=local.z, roll=roll, pitch=pitch, yaw=local.heading)
    elif place is None:
        return None
    return home


def in_air(now_us: int, topics: Topics, ekf2_gps_ctrl: int) -> HomePosition | None:
    """Home with what it lacks, of a vehicle that has left it; None where nothing is to be done, or can be."""
    home, local = topics.home_position, topics.vehicle_local_position
    if home.manual_home or (home.valid and home.valid_lpos):
        return None
    if not home.valid and not home.valid_lpos:
        return at_vehicle(now_us, topics, ekf2_gps_ctrl)
    if topics.failsafe_flags.local_position_invalid:
        return None
    home = home._replace(timestamp=now_us, update_count=home.update_count + 1)
    if home.valid:
        if not (local.xy_global and local.z_global):
            return None
        x, y = MapProjection(local.ref_lat, local.ref_lon).project(home.lat, home.lon)
        return home._replace(x=x, y=y, z=local.ref_alt - home.alt, roll=math.nan, pitch=math.nan, yaw=math.nan)
    here = _place(topics, ekf2_gps_ctrl)
    if here is None:
        return None
    lat, lon = MapProjection(here.lat, here.lon).reproject(home.x - local.x, home.y - local.y)
    return home._replace(valid=True, lat=lat, lon=lon, alt=here.alt + home.z)  # the height is PX4's, as it is


def at_place(
    now_us: int, topics: Topics, lat_deg: float, lon_deg: float, alt_m: float, yaw_rad: float
) -> HomePosition | None:
    """Home at a place that somebody gave; None without a reference for the local frame."""
    local = topics.vehicle_local_position
    if not all(map(math.isfinite, (lat_deg, lon_deg, alt_m, local.ref_lat, local.ref_lon, local.ref_alt))):
        return None
    x, y = MapProjection(local.ref_lat, local.ref_lon).project(lat_deg, lon_deg)
    count = topics.home_position.update_count + 1
    return HomePosition(
        now_us,
        True,
        lat_deg,
        lon_deg,
        alt_m,
        x,
        y,
        local.ref_alt - alt_m,
        yaw_rad,
        manual_home=True,
        update_count=count,
    )


def wants_setting(topics: Topics, ekf2_gps_ctrl: int) -> bool:
    """Something of home can be known for the first time, or the vehicle is further from it than both may be wrong."""
    home, flags = topics.home_position, topics.failsafe_flags
    if not home.valid_lpos and not flags.local_position_invalid:
        return True
    if not home.valid:
        return _place(topics, ekf2_gps_ctrl) is not None
    local, position = topics.vehicle_local_position, topics.vehicle_global_position
    if home.valid_lpos and local.xy_valid and local.z_valid:
        away_m, above_m = math.hypot(local.x - home.x, local.y - home.y), abs(local.z - home.z)
        return away_m > _least(MOVED_AT_LEAST_M, local.eph) or above_m > _least(RISEN_AT_LEAST_M, local.epv)
    if not position.timestamp:
        return True  # for PX4 the filter's place is 0 N 0 E until it tells one: home follows the receiver
    away_m, above_m = distance_m(home.lat, home.lon, position.lat, position.lon), abs(position.alt - home.alt)
    return away_m > _least(MOVED_AT_LEAST_M, position.eph) or above_m > _least(RISEN_AT_LEAST_M, position.epv)


def _least(at_least_m: float, may_be_off_m: float) -> float:
    return max(at_least_m, 2.0 * may_be_off_m if math.isfinite(may_be_off_m) else at_least_m)


def _place(topics: Topics, ekf2_gps_ctrl: int) -> _Place | None:
    """Where the vehicle is on the globe, by the filter or the receiver."""
    if not topics.failsafe_flags.global_position_invalid:
        position = topics.vehicle_global_position
        return _Place(position.lat, position.lon, position.alt)
    gps = topics.sensor_gps
    if not receiver_gives_home(gps, ekf2_gps_ctrl):
        return None
    return _Place(gps.latitude_deg, gps.longitude_deg, gps.altitude_msl_m)


def receiver_gives_home(gps: SensorGps, ekf2_gps_ctrl: int) -> bool:
    """It is good, and the filter may use it."""
    accurate = gps.eph < GOOD_EPH_M and gps.epv < GOOD_EPV_M and gps.s_variance_m_s < GOOD_SPEED_ACCURACY_M_S
    used = ekf2_gps_ctrl & FUSES_POSITION_AND_HEIGHT == FUSES_POSITION_AND_HEIGHT
    return gps.fix_type >= GOOD_FIX and accurate and used
