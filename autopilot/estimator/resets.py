"""How the filter's state is set anew: what jumps, what becomes unknown with it, and who is told.

PX4's EKF2 (src/modules/ekf2/EKF: ekf_helper.cpp, position_fusion.cpp, velocity_fusion.cpp, yaw_fusion.cpp, v1.18). The
output predictor follows each jump at once; `Ekf.resets` counts them and tells by how much, for whoever controls.
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.state import LARGEST_VELOCITY_M_S, ZERO
from sitl_emu.autopilot.topics import NAN, Quaternion, Vector3
from sitl_emu.core.attitude import product
from sitl_emu.core.geodesy import MapProjection, wrap_pi

LEAST_VARIANCE: Final = 0.01**2
YAW_RESET_TURNS_VELOCITY_RAD: Final = 0.3
LOWEST_ALTITUDE_M: Final = -12_000.0
HIGHEST_ALTITUDE_M: Final = 100_000.0
EQUATORIAL_RADIUS_M: Final = 6378137.0
ECCENTRICITY_SQUARED: Final = 0.0818191908425**2
"""WGS 84 (src/lib/lat_lon_alt/lat_lon_alt.hpp)."""


def reset_velocity(ekf: Ekf, velocity: Vector3, variances: Vector3) -> None:
    """Velocity NED, m/s."""
    reset_horizontal_velocity(ekf, velocity[:2], variances[:2])
    reset_vertical_velocity(ekf, velocity[2], variances[2])


def reset_horizontal_velocity(ekf: Ekf, velocity: tuple[float, float], variances: tuple[float, float]) -> None:
    """North and east, m/s, within what a state may be; NaN keeps a variance."""
    velocity = (_limited(velocity[0]), _limited(velocity[1]))
    ekf.apply()
    ekf.predict_covariance()
    state, resets = ekf.state, ekf.resets
    delta = (velocity[0] - state.vn, velocity[1] - state.ve)
    state.vn, state.ve = velocity
    told = [
        max(LEAST_VARIANCE, variance) if math.isfinite(variance) else ekf.variance(cov.VELOCITY + axis)
        for axis, variance in enumerate(variances)
    ]
    cov.uncorrelate(ekf.p, cov.VELOCITY, (told[0], told[1]))
    # Else a position that nothing aids would jump as well.
    cov.uncorrelate(ekf.p, cov.POSITION, (ekf.variance(cov.POSITION), ekf.variance(cov.POSITION + 1)))
    ekf.output.reset_horizontal_velocity(*delta)
    first = resets.vel_ne == ekf.counts[0]
    n, e = (0.0, 0.0) if first else resets.vel_ne_change
    resets.vel_ne_change = (n + delta[0], e + delta[1])
    resets.vel_ne += 1
    ekf.hor_vel_fused_us = ekf.time_us


def reset_vertical_velocity(ekf: Ekf, velocity: float, variance: float) -> None:
    """Down, m/s, within what a state may be; NaN keeps the variance."""
    velocity = _limited(velocity)
    ekf.apply()
    ekf.predict_covariance()
    resets = ekf.resets
    delta = velocity - ekf.state.vd
    ekf.state.vd = velocity
    if math.isfinite(variance):
        cov.uncorrelate(ekf.p, cov.VELOCITY + 2, (max(LEAST_VARIANCE, variance),))
    cov.uncorrelate(ekf.p, cov.HEIGHT, (ekf.variance(cov.HEIGHT),))
    ekf.output.reset_vertical_velocity(delta)
    first = resets.vel_d == ekf.counts[1]
    resets.vel_d_change = delta if first else resets.vel_d_change + delta
    resets.vel_d += 1
    ekf.ver_vel_fused_us = ekf.time_us


def _limited(velocity: float) -> float:
    return min(max(velocity, -LARGEST_VELOCITY_M_S), LARGEST_VELOCITY_M_S)


def reset_vertical_velocity_to_zero(ekf: Ekf) -> None:
    """Nobody knows it: zero, and very uncertain."""
    reset_vertical_velocity(ekf, 0.0, 10.0)


def reset_horizontal_position(ekf: Ekf, place: tuple[float, float], variances: tuple[float, float]) -> None:
    """North and east in the local frame, m."""
    ekf.apply()
    ekf.predict_covariance()
    state = ekf.state
    delta = (place[0] - state.pn, place[1] - state.pe)
    state.pn, state.pe = place
    ekf.output.reset_position(*delta, 0.0)
    if ekf.flags.ev_pos:
        for bias, shift in zip(ekf.ev_pos_bias, delta, strict=True):
            bias.bias -= shift
    for axis, variance in enumerate(variances):
        if math.isfinite(variance):
            cov.uncorrelate(ekf.p, cov.POSITION + axis, (max(LEAST_VARIANCE, variance),))
    _count_position_reset(ekf, delta)
    ekf.hor_pos_fused_us = ekf.time_us


def jumped_horizontally(ekf: Ekf, delta: tuple[float, float], told: tuple[float, float]) -> None:
    """The position was moved by `delta` (m), and the output follows at once; whoever controls it hears `told`."""
    ekf.output.reset_position(*delta, 0.0)
    _count_position_reset(ekf, told)
    ekf.hor_pos_fused_us = ekf.time_us


def _count_position_reset(ekf: Ekf, delta: tuple[float, float]) -> None:
    resets = ekf.resets
    first = resets.pos_ne == ekf.counts[2]
    n, e = (0.0, 0.0) if first else resets.pos_ne_change
    resets.pos_ne_change = (n + delta[0], e + delta[1])
    resets.pos_ne += 1


def reset_to_place(ekf: Ekf, latitude_deg: float, longitude_deg: float, variance: float) -> None:
    """The vehicle is at this place. Without an origin it becomes one, less what was counted from the start.

    The last known place stays where it was on the globe.
    """
    origin = ekf.origin
    if origin is None:
        origin = MapProjection(latitude_deg, longitude_deg)
        if ekf.local_horizontal_valid:
            origin = MapProjection(*origin.reproject(-ekf.state.pn, -ekf.state.pe))
        _set_origin(ekf, origin)
        n, e = origin.project(latitude_deg, longitude_deg)
        away_n, away_e = from_nowhere_m(latitude_deg, longitude_deg, latitude_deg)
        ekf.last_known_position = (ekf.last_known_position[0] + n - away_n, ekf.last_known_position[1] + e - away_e)
    reset_horizontal_position(ekf, origin.project(latitude_deg, longitude_deg), (variance, variance))


def from_nowhere_m(latitude_deg: float, longitude_deg: float, seen_from_deg: float) -> tuple[float, float]:
    """How far north and east of 0° N 0° E a place lies, by the Earth's curvature at latitude `seen_from_deg`.

    There PX4 counts from before it has an origin. The exponent is LatLonAlt's (computeRadiiOfCurvature): 5/2, where the
    ellipsoid has 3/2.
    """
    seen_from = math.radians(seen_from_deg)
    flattened = 1.0 - ECCENTRICITY_SQUARED * math.sin(seen_from) ** 2
    meridian_m = EQUATORIAL_RADIUS_M * (1.0 - ECCENTRICITY_SQUARED) / flattened**2.5
    parallel_m = EQUATORIAL_RADIUS_M / math.sqrt(flattened) * math.cos(seen_from)
    return meridian_m * math.radians(latitude_deg), parallel_m * math.radians(longitude_deg)


def _set_origin(ekf: Ekf, origin: MapProjection) -> None:
    ekf.origin, ekf.origin_us = origin, ekf.time_us
    ekf.state.set_latitude(origin.lat0_deg)
    ekf.output.gravity_m_s2 = ekf.state.gravity_m_s2


def is_altitude(altitude_m: float) -> bool:
    """It may be one of a vehicle (checkAltitudeValidity in EKF/ekf_helper.cpp); NaN is none."""
    return LOWEST_ALTITUDE_M < altitude_m < HIGHEST_ALTITUDE_M


def initialise_altitude(ekf: Ekf, altitude_m: float, variance: float) -> None:
    """The altitude AMSL is known: heights count from here on, or from where they were counted before."""
    if not math.isfinite(ekf.origin_alt):
        ekf.origin_alt = altitude_m - ekf.state.alt if ekf.local_vertical_valid else altitude_m
    reset_altitude(ekf, altitude_m, variance)


def reset_altitude(ekf: Ekf, altitude_m: float, variance: float) -> None:
    """Altitude AMSL (or above where it began, without one), and with it all that is kept relative to it."""
    ekf.apply()
    ekf.predict_covariance()
    state, flags = ekf.state, ekf.flags
    delta_d = state.alt - altitude_m
    state.alt = altitude_m
    if math.isfinite(variance):
        cov.uncorrelate(ekf.p, cov.HEIGHT, (max(LEAST_VARIANCE, variance),))
    ekf.output.reset_position(0.0, 0.0, delta_d)
    _count_height_reset(ekf, delta_d)
    if flags.baro_hgt:
        ekf.baro_bias.bias += delta_d
    if flags.ev_hgt:
        ekf.ev_hgt_bias.bias -= delta_d
    if flags.gps_hgt:
        ekf.gnss_hgt_bias.bias += delta_d
    count_terrain_reset(ekf, delta_d)
    state.terrain += delta_d
    ekf.hgt_fused_us = ekf.time_us


def _count_height_reset(ekf: Ekf, delta_d: float) -> None:
    resets = ekf.resets
    first = resets.pos_d == ekf.counts[3]
    resets.pos_d_change = delta_d if first else resets.pos_d_change + delta_d
    resets.pos_d += 1


def count_terrain_reset(ekf: Ekf, delta_d: float) -> None:
    """The height above ground jumped."""
    resets = ekf.resets
    first = resets.hagl == ekf.counts[5]
    resets.hagl_change = delta_d if first else resets.hagl_change + delta_d
    resets.hagl += 1


def reset_gyro_bias(ekf: Ekf) -> None:
    """Another gyro, or calibrated anew: its bias is unknown again."""
    ekf.apply()
    ekf.predict_covariance()
    ekf.state.gyro_bias = ZERO
    cov.uncorrelate(ekf.p, cov.GYRO_BIAS, (ekf.settings["EKF2_GBIAS_INIT"] ** 2,) * 3)


def reset_accel_bias(ekf: Ekf) -> None:
    """Another accelerometer, or calibrated anew: its bias is unknown again."""
    ekf.apply()
    ekf.predict_covariance()
    ekf.state.accel_bias = ZERO
    cov.uncorrelate(ekf.p, cov.ACCEL_BIAS, (ekf.settings["EKF2_ABIAS_INIT"] ** 2,) * 3)


def reset_yaw(ekf: Ekf, yaw: float, variance: float) -> None:
    """Heading, rad; NaN keeps the variance."""
    ekf.apply()
    ekf.predict_covariance()
    if math.isfinite(variance) and variance > 0.0:
        cov.uncorrelate(ekf.p, cov.YAW, (variance,))
    turn = wrap_pi(yaw - ekf.state.yaw)
    _turn_by(ekf, turn)
    ekf.heading_fused_us = ekf.time_us
    if not ekf.north_east_aiding and abs(turn) > YAW_RESET_TURNS_VELOCITY_RAD:
        _turn_velocity(ekf, turn)


def reset_yaw_by_fusion(ekf: Ekf, yaw: float, variance: float) -> None:
    """Force a heading into the state by fusion, so that what hangs on the heading follows it."""
    ekf.apply()
    ekf.predict_covariance()
    before = ekf.state.q
    h = np.zeros(cov.STATES)
    h[cov.YAW] = 1.0
    ph, innovation_variance = ekf.innovation_variance(h, variance)
    gain = ph / innovation_variance
    gain[cov.YAW] = 1.0
    turn = wrap_pi(yaw - ekf.state.yaw)
    ekf.fuse_by(gain, ph, -turn, innovation_variance)
    _tell_yaw_reset(ekf, before)
    ekf.heading_fused_us = ekf.time_us
    if not ekf.north_east_aiding and abs(turn) > YAW_RESET_TURNS_VELOCITY_RAD:
        _turn_velocity(ekf, turn)


def _turn_by(ekf: Ekf, turn: float) -> None:
    before = ekf.state.q
    ekf.state.turn(0.0, 0.0, turn)
    _tell_yaw_reset(ekf, before)


def _tell_yaw_reset(ekf: Ekf, before: Quaternion) -> None:
    w, x, y, z = before
    change = product(ekf.state.q, (w, -x, -y, -z))
    ekf.output.reset_quaternion(change)
    ekf.on_yaw_change = change
    resets = ekf.resets
    resets.quat_change = change if resets.quat == ekf.counts[4] else product(change, resets.quat_change)
    resets.quat += 1


def _turn_velocity(ekf: Ekf, turn: float) -> None:
    cosine, sine = math.cos(turn), math.sin(turn)
    n, e = ekf.state.vn, ekf.state.ve
    variance = max(ekf.variance(cov.VELOCITY), ekf.variance(cov.VELOCITY + 1))
    reset_horizontal_velocity(ekf, (cosine * n - sine * e, sine * n + cosine * e), (variance, variance))


def move_origin(ekf: Ekf, latitude_deg: float, longitude_deg: float, altitude_amsl_m: float) -> None:
    """The local frame begins elsewhere; the vehicle stays where it is on the globe. What is no altitude changes none.

    Without an origin before, a position that may be used stays as it is in the local frame; one that may not was
    counted from 0° N 0° E, and stays there.
    """
    ekf.apply()
    state, before = ekf.state, ekf.origin
    if before is None and not ekf.local_horizontal_valid:
        before = MapProjection(0.0, 0.0)
    _set_origin(ekf, MapProjection(latitude_deg, longitude_deg))
    if before is not None and ekf.origin is not None:
        place = ekf.origin.project(*before.reproject(state.pn, state.pe))
        known = ekf.origin.project(*before.reproject(*ekf.last_known_position))
        delta = (place[0] - state.pn, place[1] - state.pe)
        state.pn, state.pe = place
        ekf.last_known_position = known
        ekf.output.reset_position(*delta, 0.0)
        _count_position_reset(ekf, delta)
    else:
        _count_position_reset(ekf, (0.0, 0.0))
        ekf.hor_pos_fused_us = ekf.time_us
    if is_altitude(altitude_amsl_m):
        _move_origin_altitude(ekf, altitude_amsl_m)


def _move_origin_altitude(ekf: Ekf, altitude_amsl_m: float) -> None:
    """Where heights count from; PX4 tells the jump with the wrong sign (setAltOrigin in EKF/ekf_helper.cpp)."""
    if not math.isfinite(ekf.origin_alt) and ekf.local_vertical_valid:
        above_start = ekf.state.alt
        ekf.origin_alt = altitude_amsl_m
        reset_altitude(ekf, above_start + altitude_amsl_m, NAN)
        return
    change = altitude_amsl_m - ekf.origin_alt if math.isfinite(ekf.origin_alt) else 0.0
    ekf.origin_alt = altitude_amsl_m
    _count_height_reset(ekf, -change)
    count_terrain_reset(ekf, -change)
