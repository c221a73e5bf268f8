"""Where a moving thing of a world is at a time, and how fast: pure functions of its path."""

from bisect import bisect_right

from sitl_emu.world.description import Thing


def velocity_at(thing: Thing, time_s: float) -> tuple[float, float]:
    """(north, east) in m/s: of the leg that it is on; on a waypoint, of the next."""
    path = thing.path
    if thing.repeats and path and path[-1].at_s > 0.0:
        time_s %= path[-1].at_s
    after = bisect_right([waypoint.at_s for waypoint in path], time_s)
    if after in (0, len(path)):
        return 0.0, 0.0
    one, other = path[after - 1], path[after]
    length_s = other.at_s - one.at_s
    return (other.north_m - one.north_m) / length_s, (other.east_m - one.east_m) / length_s


def place_at(thing: Thing, time_s: float) -> tuple[float, float]:
    """(north_m, east_m): evenly from waypoint to waypoint; before the first and after the last it stands there."""
    path = thing.path
    if not path:
        return thing.north_m, thing.east_m
    if thing.repeats and path[-1].at_s > 0.0:
        time_s %= path[-1].at_s
    after = bisect_right([waypoint.at_s for waypoint in path], time_s)
    if after == 0 or after == len(path):
        end = path[0 if after == 0 else -1]
        return end.north_m, end.east_m
    one, other = path[after - 1], path[after]
    share = (time_s - one.at_s) / (other.at_s - one.at_s)
    return one.north_m + share * (other.north_m - one.north_m), one.east_m + share * (other.east_m - one.east_m)
