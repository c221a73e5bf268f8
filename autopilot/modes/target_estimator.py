"""Where the target of FOLLOW_TARGET is, between the messages that tell it. PX4's TargetEstimator (v1.18).

An alpha-beta-gamma filter on positions and velocities in the local frame; FLW_TGT_RS says how eagerly it follows what
it is told. A target that tells no velocity gets one from its positions. A measurement that is not finite is not fused,
and a state that is not finite is forgotten. A target that falls silent is taken to stand where it was last.
"""

import math

from sitl_emu.autopilot.topics import NAN3, FollowTarget, Vector3, VehicleLocalPosition
from sitl_emu.core.geodesy import MapProjection

STALE_US = 3_000_000
POSITION_EVERY_US, VELOCITY_EVERY_US = 500_000, 100_000
"""MINIMUM_TIME_BETWEEN_POS_FUSIONS_MS and _VEL_: messages that come more often bring nothing new."""
SAME = 2.0 * 2.0**-23
"""Two measurements that differ by no more (2 FLT_EPSILON) are one that was sent again."""
ACCELERATION_MAX = 20.0
LONGEST_S, SHORTEST_S = 20.0, 1e-3
AT_REST: Vector3 = (0.0, 0.0, 0.0)


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
        self._measured_position = self._measured_velocity = NAN3
        self._heard_us = self._position_us = self._velocity_us = 0

    @property
    def valid(self) -> bool:
        """It is known where the target is."""
        return math.isfinite(self.position[0])

    def predict(self, now_us: int, dt_s: float) -> None:
        """Time passes."""
        if not self.valid:
            return
        self._rest_if_stale(now_us)
        self.position = _plus(_plus(self.position, self.velocity, dt_s), self.acceleration, 0.5 * dt_s * dt_s)
        self.velocity = _plus(self.velocity, self.acceleration, dt_s)

    def fuse(self, now_us: int, target: FollowTarget, local: VehicleLocalPosition) -> None:
        """A FOLLOW_TARGET came."""
        if not math.isfinite(local.ref_lat) or self._position_us >= target.timestamp:
            return
        north, east = MapProjection(local.ref_lat, local.ref_lon).project(target.lat, target.lon)
        position, velocity = (north, east, local.ref_alt - target.alt), target.velocity
        if not self._heard_us:
            self.position, self.acceleration = position, AT_REST
            self.velocity = velocity if _is_finite(velocity) else AT_REST
            self._measured_position, self._measured_velocity = position, velocity
        self._heard_us = target.timestamp
        if _is_news(position, self._measured_position, now_us - self._position_us, POSITION_EVERY_US):
            dt_s = _interval_s(target.timestamp - self._position_us)
            self._position_us, self._measured_position = target.timestamp, position
            to_p, to_v, to_a = self._by_position
            error = _minus(position, self.position)
            self.position = _plus(self.position, error, to_p)
            self.velocity = _plus(self.velocity, error, to_v / dt_s)
            self.acceleration = _plus(self.acceleration, error, to_a / (dt_s * dt_s))
        if _is_news(velocity, self._measured_velocity, now_us - self._velocity_us, VELOCITY_EVERY_US):
            dt_s = _interval_s(target.timestamp - self._velocity_us)
            self._velocity_us, self._measured_velocity = target.timestamp, velocity
            to_v, to_a = self._by_velocity
            error = _minus(velocity, self.velocity)
            self.velocity = _plus(self.velocity, error, to_v)
            self.acceleration = _plus(self.acceleration, error, to_a / dt_s)
        size = math.hypot(*self.acceleration)
        if size > ACCELERATION_MAX:
            self.acceleration = _plus(AT_REST, self.acceleration, ACCELERATION_MAX / size)
        self._rest_if_stale(now_us)
        if not (_is_finite(self.position) and _is_finite(self.velocity) and _is_finite(self.acceleration)):
            self.reset()

    def _rest_if_stale(self, now_us: int) -> None:
        if now_us - self._heard_us >= STALE_US:
            self.velocity = self.acceleration = AT_REST


def _is_news(measured: Vector3, before: Vector3, elapsed_us: int, interval_us: int) -> bool:
    """Whether a measurement is to be fused (TargetEstimator::measurement_can_be_fused)."""
    if not _is_finite(measured) or elapsed_us <= interval_us:
        return False
    changed = not _is_finite(before) or math.hypot(*_minus(measured, before)) > SAME
    return changed or elapsed_us > 2 * interval_us


def _interval_s(elapsed_us: int) -> float:
    return max(SHORTEST_S, min(LONGEST_S, elapsed_us * 1e-6))


def _is_finite(vector: Vector3) -> bool:
    return math.isfinite(vector[0]) and math.isfinite(vector[1]) and math.isfinite(vector[2])


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: Vector3, b: Vector3, times: float) -> Vector3:
    return a[0] + b[0] * times, a[1] + b[1] * times, a[2] + b[2] * times
