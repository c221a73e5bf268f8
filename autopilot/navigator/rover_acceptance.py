"""How near a rover has to come to a waypoint: as near as its turning circle lets it cut the corner.

PX4's rover_ackermann AckermannAutoMode::updateAcceptanceRadius (v1.18): RA_ACC_RAD_GAIN times the distance from the
corner at which the smallest turning circle touches both legs, between NAV_ACC_RAD and RA_ACC_RAD_MAX. PX4 works it out
in the controller and tells the navigator; here the navigator does, and the triplet tells the controller.
"""

import math

from autopilot.navigator.state import Settings
from sitl_emu.core.geodesy import bearing_rad, wrap_pi

Place = tuple[float, float]


def acceptance_radius_m(settings: Settings, previous: Place | None, current: Place, following: Place | None) -> float:
    """Radius in metres; places are (lat_deg, lon_deg). Without both neighbours: NAV_ACC_RAD."""
    smallest = settings.nav_acc_rad_m
    if previous is None or following is None or settings.rover_max_str_ang_rad <= 0.0:
        return smallest
    back = bearing_rad(*current, *previous)
    ahead = bearing_rad(*current, *following)
    half_angle = abs(wrap_pi(back - ahead)) / 2.0
    if half_angle < 1e-3:
        return max(settings.rover_acc_rad_max_m, smallest)
    turning_m = settings.rover_wheel_base_m / math.sin(settings.rover_max_str_ang_rad)
    wanted = settings.rover_acc_rad_gain * turning_m / math.tan(half_angle)
    return max(min(wanted, settings.rover_acc_rad_max_m), smallest)
