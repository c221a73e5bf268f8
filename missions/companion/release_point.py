"""Where to let a parcel go, so that it lands on a place: pure functions of wind, height and speed.

Model: a point mass with drag that grows with the square of its speed against the air and is the same from all sides
(the point-mass trajectory of exterior ballistics: R. L. McCoy, Modern Exterior Ballistics, chapter 5, without spin and
lift): m v' = m g - ½ ρ C_d A |v - w| (v - w). The wind blows level and grows with the height over ground by Hellmann's
power law, w(h) = w_known (h / h_known)^a, with a of about 1/7 over open land and 0 where it is the same at all heights.
Solved by Runge and Kutta's fourth-order method. The ground is level, at the height of the place.

It says where a parcel meets the ground; from there it slides and tumbles on. Gusts are not known beforehand.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

STEP_S = 0.01
GRAVITY_M_S2 = 9.80665
SEA_LEVEL_KG_M3 = 1.225
"""Density of the standard atmosphere (ISO 2533)."""
OPEN_LAND = 1.0 / 7.0
LEAST_HEIGHT_M = 0.1
"""Below it the wind is as there."""

State = npt.NDArray[np.float64]
"""North, east, height over ground (m), and velocity north, east, down (m/s)."""


class Parcel(NamedTuple):
    """What falls."""

    mass_kg: float
    drag_m2: float
    """Drag coefficient times area."""
    half_height_m: float = 0.0
    """How high its centre is when it meets the ground."""


class Wind(NamedTuple):
    """What is known of the wind: where the air moves to, at a height."""

    north_m_s: float
    east_m_s: float
    at_height_m: float = 10.0
    """Over ground: the vehicle's own, where its estimator tells the wind (WIND_COV)."""
    exponent: float = OPEN_LAND


class Fall(NamedTuple):
    """How a parcel fell, from where it was let go to the ground."""

    north_m: float
    east_m: float
    time_s: float
    velocity_m_s: tuple[float, float, float]
    """North, east, down, at the ground."""


def fall(
    parcel: Parcel,
    height_m: float,
    velocity_m_s: tuple[float, float, float],
    wind: Wind,
    air_kg_m3: float = SEA_LEVEL_KG_M3,
) -> Fall:
    """The fall of a parcel whose centre is so high over the ground when it is let go with a velocity (NED)."""
    state = np.array([0.0, 0.0, height_m, *velocity_m_s])
    time_s, before = 0.0, state
    while state[2] > parcel.half_height_m:
        before = state
        state = _stepped(state, parcel, wind, air_kg_m3)
        time_s += STEP_S
    if time_s > 0.0:
        back = (parcel.half_height_m - state[2]) / (before[2] - state[2])
        state, time_s = state + back * (before - state), time_s - back * STEP_S
    north, east, _, vn, ve, vd = (float(part) for part in state)
    return Fall(north, east, time_s, (vn, ve, vd))


def release_point(
    place_m: tuple[float, float],
    parcel: Parcel,
    height_m: float,
    velocity_m_s: tuple[float, float, float],
    wind: Wind,
    delay_s: float = 0.0,
    air_kg_m3: float = SEA_LEVEL_KG_M3,
) -> tuple[float, float]:
    """Where (north, east, m) the release is to be commanded, so that the parcel meets the ground at a place.

    `height_m` and `velocity_m_s` (NED) are those at the release; `delay_s` goes by from the command to it.
    """
    falls = fall(parcel, height_m, velocity_m_s, wind, air_kg_m3)
    north_m = place_m[0] - falls.north_m - delay_s * velocity_m_s[0]
    return north_m, place_m[1] - falls.east_m - delay_s * velocity_m_s[1]


def _stepped(state: State, parcel: Parcel, wind: Wind, air_kg_m3: float) -> State:
    """After STEP_S."""
    first = _changes(state, parcel, wind, air_kg_m3)
    second = _changes(state + 0.5 * STEP_S * first, parcel, wind, air_kg_m3)
    third = _changes(state + 0.5 * STEP_S * second, parcel, wind, air_kg_m3)
    fourth = _changes(state + STEP_S * third, parcel, wind, air_kg_m3)
    return state + STEP_S / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)


def _changes(state: State, parcel: Parcel, wind: Wind, air_kg_m3: float) -> State:
    """How fast the state changes."""
    grows = (max(float(state[2]), LEAST_HEIGHT_M) / wind.at_height_m) ** wind.exponent
    against = state[3:] - np.array([grows * wind.north_m_s, grows * wind.east_m_s, 0.0])
    slowed = -0.5 * air_kg_m3 * parcel.drag_m2 / parcel.mass_kg * np.linalg.norm(against) * against
    vn, ve, vd = state[3:]
    return np.array([vn, ve, -vd, slowed[0], slowed[1], slowed[2] + GRAVITY_M_S2])
