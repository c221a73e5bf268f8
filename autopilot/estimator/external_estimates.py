"""Estimates from outside, by command: position, heading, wind.

PX4's EKF2 (resetGlobalPosToExternalObservation in EKF/ekf.cpp, resetHeadingToExternalObservation in EKF/ekf.h,
EKF/wind.cpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.ekf import INITIAL_WIND_VARIANCE, Ekf
from sitl_emu.autopilot.estimator.resets import (
    initialise_altitude,
    is_altitude,
    jumped_horizontally,
    reset_horizontal_position,
    reset_horizontal_velocity,
    reset_to_place,
    reset_yaw,
    reset_yaw_by_fusion,
)

LEAST_ACCURACY_M: Final = 0.01
GATE: Final = 10.0
FORCING_VARIANCE: Final = 0.1
"""With so little noise a gain is nearly one: the position is taken, and what correlates with it follows."""
FIRM_ACCURACY_M: Final = 1.0
UNKNOWN_WIND_VARIANCE: Final = 10.0


def take_position(ekf: Ekf, place: tuple[float, float, float], accuracy_m: float, measured_us: int) -> None:
    """`place`: latitude, longitude (deg), altitude (m AMSL, NaN: keep), where the vehicle was at `measured_us`."""
    latitude_deg, longitude_deg, altitude_m = place
    variance = max(accuracy_m, LEAST_ACCURACY_M) ** 2
    altitude_known = is_altitude(altitude_m)
    if ekf.origin is None:
        reset_to_place(ekf, latitude_deg, longitude_deg, variance)
        if altitude_known:
            initialise_altitude(ekf, altitude_m, variance)
        return
    ekf.apply()
    ekf.predict_covariance()
    state = ekf.state
    north, east = ekf.origin.project(latitude_deg, longitude_deg)
    if ekf.local_horizontal_valid:
        late_s = (ekf.time_us - measured_us) * 1e-6
        north, east = north + state.vn * late_s, east + state.ve * late_s
        altitude_m -= state.vd * late_s
    innovation = (state.pn - north, state.pe - east)
    own = (ekf.variance(cov.POSITION), ekf.variance(cov.POSITION + 1))
    ratio = sum(part * part / (GATE * GATE * (spread + variance)) for part, spread in zip(innovation, own, strict=True))
    firm = accuracy_m < FIRM_ACCURACY_M or ratio > 1.0
    if not ekf.flags.in_air or firm or ekf.flags.horizontal_position_aids():
        reset_horizontal_position(ekf, (north, east), (variance, variance))
        velocity = (state.vn - state.wind[0], state.ve - state.wind[1])
        reset_horizontal_velocity(ekf, velocity, (ekf.variance(cov.VELOCITY), ekf.variance(cov.VELOCITY + 1)))
        cov.uncorrelate(ekf.p, cov.WIND, (UNKNOWN_WIND_VARIANCE, UNKNOWN_WIND_VARIANCE))
        state.wind = (0.0, 0.0)
    else:
        _fuse_position(ekf, (north, east), variance)
    ekf.last_known_position = (north, east)
    if altitude_known:
        initialise_altitude(ekf, altitude_m, variance)
        ekf.last_known_alt = altitude_m


def _fuse_position(ekf: Ekf, place: tuple[float, float], variance: float) -> None:
    """While only inertia tells where it is: by fusion, so that heading and velocity are corrected as well."""
    ekf.flags.heading_observable = True
    state = ekf.state
    before = (state.pn, state.pe)
    innovation = (state.pn - place[0], state.pe - place[1])
    for axis in range(2):
        row = ekf.p[cov.POSITION + axis].copy()
        forced = row / (float(row[cov.POSITION + axis]) + FORCING_VARIANCE)
        ekf.correct(forced, innovation[axis])
        told = float(row[cov.POSITION + axis]) + variance
        ekf.fuse(row, 0.0, told)
    jumped_horizontally(ekf, (state.pn - before[0], state.pe - before[1]), (-innovation[0], -innovation[1]))


def take_heading(ekf: Ekf, heading_rad: float, accuracy_rad: float) -> None:
    """Turn the heading; the compass has to prove itself again."""
    if not ekf.initialised:
        return
    ekf.flags.heading_observable = True
    if ekf.flags.yaw_align:
        reset_yaw_by_fusion(ekf, heading_rad, accuracy_rad**2)
    else:
        reset_yaw(ekf, heading_rad, accuracy_rad**2)
        ekf.flags.yaw_align = True
    ekf.flags.mag_heading_consistent = False
    ekf.flags.yaw_manual = True


def take_wind(ekf: Ekf, speed_m_s: float, from_rad: float, speed_accuracy: float, direction_accuracy: float) -> None:
    """Set the wind states; `from_rad` is where the wind comes from. A speed that is none is 0, as of math::max."""
    speed_m_s, towards = speed_m_s if 0.0 < speed_m_s < math.inf else 0.0, from_rad + math.pi
    north, east = math.cos(towards), math.sin(towards)
    ekf.state.wind = (speed_m_s * north, speed_m_s * east)
    across = (speed_m_s * direction_accuracy) ** 2
    along = speed_accuracy**2
    for index, (ahead, aside) in enumerate(((north, east), (east, north)), cov.WIND):
        variance = along * ahead * ahead + across * aside * aside
        if math.isfinite(variance):
            cov.uncorrelate(ekf.p, index, (min(INITIAL_WIND_VARIANCE, variance),))
