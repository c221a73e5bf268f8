"""Down over a place, and where a parcel is let go.

The vehicle goes down to `release_height_m` over the ground, which the lidar finds and measures below 8 m, and stands
where `release_point.py` says, by the wind that the autopilot estimates (WIND_COV; calm where it estimates none), until
the parcel, let go now, would meet the ground within `AIMED_M` of the place.
"""

import math
from collections.abc import Callable

from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import body_to_ned
from sitl_emu.missions.companion.onboard import Script
from sitl_emu.missions.companion.release_point import Wind, fall
from sitl_emu.missions.disaster import aborts
from sitl_emu.missions.disaster.aborts import Aborted, Reason
from sitl_emu.missions.disaster.flying import HEIGHT_M, STANDING_M, Flying
from sitl_emu.missions.disaster.travel import Travel

AIMED_M, STEADY_M_S = 0.7, 0.5
DRIFT_S, DESCENT_S = 20.0, 60.0
"""In which that has to come, and the vehicle to be down; ours."""
GROUND_SIGMAS = 2.0
"""Of the ground's height, within which it is looked for."""
LIDAR_REACH_M, LIDAR_FRESH_US = 7.5, 200_000
"""TF-Luna's 8 m, less how far the height may be off; and how old a range may be."""


class Descent:
    """Of one flight."""

    def __init__(self, flight: Flying, travel: Travel) -> None:
        self._flight, self._travel, self._onboard = flight, travel, flight.onboard
        self.below_m = 0.0
        """Height over home of the ground that the parcel is to fall on."""

    def down(self, to_m: Corner) -> Script:
        """Down to the release height over the ground, which the lidar finds. Raises Aborted for what stands there."""
        flight, release_m = self._flight, self._flight.settings.release_height_m
        guess_m, sigma_m = flight.ground.at(to_m, flight.settings.ground_sigma_m)
        self.below_m, sent_m = guess_m, math.inf
        lowest_m = guess_m - GROUND_SIGMAS * sigma_m - HEIGHT_M
        since_us = self._onboard.now_us
        while True:
            flight.check()
            if self._onboard.now_us - since_us > DESCENT_S * 1e6:
                raise Aborted(Reason.DRIFT, f"not over the place after {DESCENT_S:.0f} s")
            if release_m <= LIDAR_REACH_M:
                aborts.check_range_finder(self._lidar_silent_s)
            seen_m = self._lidar_m()
            if seen_m is not None:
                aborts.check_below(seen_m, guess_m + GROUND_SIGMAS * sigma_m)
                self.below_m = seen_m
            height_m = self.below_m + release_m
            if self._travel.is_there(to_m, height_m, STANDING_M):
                if seen_m is not None or release_m > LIDAR_REACH_M:
                    return
                if self.below_m < lowest_m:
                    raise Aborted(Reason.NO_PLACE, f"no ground {release_m:g} m under the vehicle")
                self.below_m -= HEIGHT_M
            if abs(height_m - sent_m) > HEIGHT_M / 2.0:
                yield from self._travel.send(to_m, height_m)
                sent_m = height_m
            yield

    @property
    def _lidar_silent_s(self) -> float:
        telemetry = self._onboard.telemetry
        heard_us = telemetry.range_heard_us
        return math.inf if heard_us is None else (telemetry.boot_time_us - heard_us) / 1e6

    def _lidar_m(self) -> float | None:
        """The height over home of what the lidar meets under the vehicle; None where it meets nothing."""
        telemetry = self._onboard.telemetry
        near, attitude = telemetry.range_at(telemetry.boot_time_us, LIDAR_FRESH_US), telemetry.attitude
        if near is None or attitude is None:
            return None
        return self._flight.altitude_m - near.distance_m * float(body_to_ned(attitude.q)[2, 2])

    def aim(self, place_m: Corner, is_sure: Callable[[], bool]) -> Script:
        """Until a parcel let go now would come down at the place, and `is_sure`. Raises Aborted for wind and drift."""
        onboard = self._onboard
        since_us, sent_m = onboard.now_us, None
        while True:
            self._flight.check()
            aborts.check_wind(onboard.telemetry.wind_m_s)
            north_m, east_m = self._impact_m()
            miss = place_m[0] - north_m, place_m[1] - east_m
            if is_sure() and math.hypot(*miss) <= AIMED_M and onboard.telemetry.speed_m_s <= STEADY_M_S:
                return
            if onboard.now_us - since_us > DRIFT_S * 1e6:
                raise Aborted(Reason.DRIFT, f"{math.hypot(*miss):.1f} m off after {DRIFT_S:.0f} s")
            aim_m = self._flight.here_m[0] + miss[0], self._flight.here_m[1] + miss[1]
            if sent_m is None or (math.dist(aim_m, sent_m) > AIMED_M / 2.0 and onboard.telemetry.speed_m_s < 0.3):
                yield from self._travel.send(aim_m, self.below_m + self._flight.settings.release_height_m)
                sent_m = aim_m
            yield from steps.pause(onboard, 0.25)

    def _impact_m(self) -> Corner:
        """Where a parcel that is let go now would meet the ground."""
        place, told, parcel = self._onboard.telemetry.place, self._onboard.telemetry.wind, self._flight.settings.parcel
        assert place is not None and parcel is not None
        height_m = max(self._flight.altitude_m - self.below_m, 1.0)
        wind = Wind(*told, height_m) if told is not None else Wind(0.0, 0.0)
        falls = fall(parcel, height_m, (place.v_north, place.v_east, place.v_down), wind)
        return self._flight.here_m[0] + falls.north_m, self._flight.here_m[1] + falls.east_m
