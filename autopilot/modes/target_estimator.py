"""Where the target of FOLLOW_TARGET is, between the messages that tell it. PX4's TargetEstimator (v1.18).

An alpha-beta-gamma filter on positions and velocities in the local frame; FLW_TGT_RS says how eagerly it follows what
it is told. A target that falls silent is taken to stand where it was last.
"""

import math

from autopilot.topics import NAN3, FollowTarget, Vector3, VehicleLocalPosition
from sitl_emu.core.geodesy import MapProjection

STALE_US = 3_000_000
POSITION_EVERY_US, VELOCITY_EVERY_US = 500_000, 100_000
"""Messages that come more often are not believed to bring anything new."""
ACCELERATION_MAX = 20.0
LONGEST_S, SHORTEST_S = 20.0, 1e-3


class TargetEstimator:
    """Position, velocity and acceleration of the target, NED from the local origin; NaN before the first message."""

    def __init__(self) -> None:
        self.reset()
        self.set_responsiveness(0.1)

    def set_responsiveness(self, value: float) -> None:
        """FLW_TGT_RS: 1 is smoothest."""
        beta = max(0.1, min(1.0, value)) ** (1.0 / 3.0)
        beta_v = 0.9 * beta
        self._by_position = (1.0 - beta**3, 1.5 * (1.0 - beta) ** 2 * (1.0 + beta), (1.0 - beta) ** 3)
        self._by_velocity = (1.0 - beta_v**2, (1.0 - beta_v) ** 2)

    def reset(self) -> None:
        """Know nothing."""
        self.position = self.velocity = self.acceleration = NAN3
        self._heard_us = self._position_us = self._velocity_us = 0

    @property
    def valid(self) -> bool:
        """It is known where the target is."""
        return math.isfinite(self.position[0])

    def predict(self, now_us: int, dt_s: float) -> None:
        """Time passes."""
        if not self.valid:
            return
        if now_us - self._heard_us >= STALE_US:
            self.velocity = self.acceleration = (0.0, 0.0, 0.0)
        p, v, a = self.position, self.velocity, self.acceleration
        half = 0.5 * dt_s * dt_s
        self.position = (p[0] + v[0] * dt_s + a[0] * half, p[1] + v[1] * dt_s + a[1] * half,
                         p[2] + v[2] * dt_s + a[2] * half)  # fmt: skip
        self.velocity = (v[0] + a[0] * dt_s, v[1] + a[1] * dt_s, v[2] + a[2] * dt_s)

    def fuse(self, now_us: int, target: FollowTarget, local: VehicleLocalPosition) -> None:
        """A FOLLOW_TARGET came."""
        if not math.isfinite(local.ref_lat):
            return
        north, east = MapProjection(local.ref_lat, local.ref_lon).project(target.lat, target.lon)
        measured = (north, east, local.ref_alt - target.alt)
        if not all(math.isfinite(value) for value in (*measured, *target.velocity)):
            return
        self._heard_us = now_us
        if not self.valid:
            self.position, self.velocity, self.acceleration = measured, target.velocity, (0.0, 0.0, 0.0)
        if now_us - self._position_us > POSITION_EVERY_US:
            dt_s = max(SHORTEST_S, min(LONGEST_S, (now_us - self._position_us) * 1e-6))
            self._position_us = now_us
            to_p, to_v, to_a = self._by_position
            error = _minus(measured, self.position)
            self.position = _plus(self.position, error, to_p)
            self.velocity = _plus(self.velocity, error, to_v / dt_s)
            self.acceleration = _plus(self.acceleration, error, to_a / (dt_s * dt_s))
        if now_us - self._velocity_us > VELOCITY_EVERY_US:
            dt_s = max(SHORTEST_S, min(LONGEST_S, (now_us - self._velocity_us) * 1e-6))
            self._velocity_us = now_us
            to_v, to_a = self._by_velocity
            error = _minus(target.velocity, self.velocity)
            self.velocity = _plus(self.velocity, error, to_v)
            self.acceleration = _plus(self.acceleration, error, to_a / dt_s)
        size = math.hypot(*self.acceleration)
        if size > ACCELERATION_MAX:
            self.acceleration = _plus((0.0, 0.0, 0.0), self.acceleration, ACCELERATION_MAX / size)


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: Vector3, b: Vector3, times: float) -> Vector3:
    return a[0] + b[0] * times, a[1] + b[1] * times, a[2] + b[2] * times
