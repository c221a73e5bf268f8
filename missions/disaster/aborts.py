"""Why a delivery is not made: each reason with its figure, so that what a safe abort was about can be told and tested.

The parcel stays on board. Some reasons concern one place, and the scan goes on (`Reason.of_the_place`); with the others
the vehicle goes home. A pilot who takes over, and a failsafe of the autopilot's, are neither: `Onboard.watch_pilot`
tells them. What was about a place when they did is given up when the vehicle is given back.
"""

import math
from enum import StrEnum

DELIVERED_WITHIN_M = 5.0
"""Of the area: the paper's radius."""
MOST_SIGMA_M = DELIVERED_WITHIN_M / math.sqrt(math.log(20.0))
"""2.9 m: with it 19 of 20 places lie within 5 m (Rayleigh's distribution, P(r > 5 m) = exp(-5² / sigma²) = 1/20)."""
MOST_EPH_M = 5.0
"""That the receiver states of itself; ours: twice what an M8N has under an open sky."""
MOST_WIND_M_S = 12.0
"""Up to which drops were measured (tools/measure_parcel.py)."""
CALMER_M_S = 1.0
"""By so much a wind that ended a delivery has dropped before the next is begun: it comes and goes. Ours."""
MOST_GLITCHES = 1
"""In a row, of a message that comes once a second; ours: one alone is an outlier."""
LEAST_BATTERY_PERCENT = 25
"""With which the vehicle goes home; ours: above PX4's BAT_LOW_THR (15 %), whose failsafe is the last word."""
LONGEST_SILENCE_S = 1.0
"""Of a range finder, which speaks ten times a second, in its range or not; ours."""
OBSTACLE_M = 2.0
"""What stands so much higher than the ground under the vehicle is no ground to drop on; ours."""


class Reason(StrEnum):
    """Why a parcel stayed on board."""

    UNCERTAIN = "uncertain location"
    NOT_PERSISTING = "detection did not persist"
    WIND = "wind"
    DRIFT = "drift"
    LOW_BATTERY = "low battery"
    GEOFENCE = "geofence"
    GPS = "GPS degraded"
    COMPASS = "compass silent"
    RANGE_FINDER = "range finder silent"
    OBSTACLE = "obstacle"
    NO_PLACE = "no safe place"
    PEER = "peer's claim"
    TAKEN = "vehicle was taken over"
    ALONE = "out of touch"

    @property
    def of_the_place(self) -> bool:
        """Whether it concerns one place alone, and the scan goes on."""
        return self not in (Reason.LOW_BATTERY, Reason.GPS, Reason.COMPASS, Reason.RANGE_FINDER, Reason.ALONE)


class Aborted(Exception):
    """A delivery, or the whole mission, is broken off; the text is for people."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(f"{reason}: {text}")
        self.reason = reason


def check_vehicle(
    battery_percent: int | None,
    eph_m: float | None,
    satellites_ok: bool = True,
    gps_glitches: int = 0,
    compass_ok: bool = True,
) -> None:
    """Raises Aborted where the vehicle itself should go home."""
    if battery_percent is not None and battery_percent < LEAST_BATTERY_PERCENT:
        raise Aborted(Reason.LOW_BATTERY, f"{battery_percent} %, less than {LEAST_BATTERY_PERCENT}")
    if not satellites_ok:
        raise Aborted(Reason.GPS, "no fix")
    if eph_m is not None and eph_m > MOST_EPH_M:
        raise Aborted(Reason.GPS, f"the receiver states {eph_m:.1f} m, more than {MOST_EPH_M:g}")
    if gps_glitches > MOST_GLITCHES:
        raise Aborted(Reason.GPS, "the estimator tells of a glitch")
    if not compass_ok:
        raise Aborted(Reason.COMPASS, "where pictures lie hangs on the heading")


def check_location(sigma_m: float) -> None:
    """Raises Aborted for a place that is not known well enough."""
    if sigma_m > MOST_SIGMA_M:
        raise Aborted(Reason.UNCERTAIN, f"one sigma is {sigma_m:.1f} m, more than {MOST_SIGMA_M:.1f}")


def check_wind(wind_m_s: float | None) -> None:
    """Raises Aborted for a wind in which drops were not measured; None: not known."""
    if wind_m_s is not None and wind_m_s > MOST_WIND_M_S:
        raise Aborted(Reason.WIND, f"{wind_m_s:.1f} m/s, more than {MOST_WIND_M_S:g}")


def has_dropped(wind_m_s: float | None) -> bool:
    """Whether a wind that was too strong is so no more; one that nobody knows may be."""
    return wind_m_s is None or wind_m_s <= MOST_WIND_M_S - CALMER_M_S


def check_range_finder(silent_s: float) -> None:
    """Raises Aborted where nothing measures the height over ground: a descent would be blind."""
    if silent_s > LONGEST_SILENCE_S:
        raise Aborted(Reason.RANGE_FINDER, f"nothing heard for {silent_s:.1f} s")


def check_below(met_m: float, highest_m: float) -> None:
    """Raises Aborted where the lidar meets something well above the highest that the ground may be there."""
    if met_m > highest_m + OBSTACLE_M:
        raise Aborted(Reason.OBSTACLE, f"something {met_m - highest_m:.1f} m higher than the ground under the vehicle")
