"""Areas on the ground: polygons by their corners, in metres north and east of any origin."""

import math
from collections.abc import Sequence

Corner = tuple[float, float]


def contains(corners: Sequence[Corner], north_m: float, east_m: float, margin_m: float = 0.0) -> bool:
    """Whether a place lies in a polygon, or within `margin_m` of its edge."""
    inside, near = False, False
    for (n1, e1), (n2, e2) in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        if (e1 > east_m) != (e2 > east_m) and north_m < (n2 - n1) * (east_m - e1) / (e2 - e1) + n1:
            inside = not inside
        length2 = (n2 - n1) ** 2 + (e2 - e1) ** 2
        t = ((north_m - n1) * (n2 - n1) + (east_m - e1) * (e2 - e1)) / length2 if length2 > 0.0 else 0.0
        t = min(1.0, max(0.0, t))
        near |= math.hypot(north_m - n1 - t * (n2 - n1), east_m - e1 - t * (e2 - e1)) < margin_m
    return inside or near
