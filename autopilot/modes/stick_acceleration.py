"""Sticks as horizontal acceleration: a drag limits the speed and brakes; where the vehicle stops it holds its place.

Behaves as PX4's StickAccelerationXY (flight_mode_manager/tasks/Utility, v1.18): MPC_VEL_MANUAL, _SIDE and _BACK,
MPC_ACC_HOR, MPC_JERK_MAX, with collision prevention (CP_DIST). The velocity is what the acceleration adds up to.
"""

import math
from typing import Final

from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.collision_prevention import CollisionPrevention
from sitl_emu.autopilot.modes.sticks import GRAVITY, Horizontal, north_east, within_unit_length
from sitl_emu.autopilot.modes.vectors import shortened
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN, Topics

BRAKE_BOOST_MIN: Final = 2.0
BRAKE_TIME_CONSTANT_S: Final = 0.8
LEAST_SPEED: Final = 0.1
"""A division by none is avoided; ours."""


class StickAcceleration:
    """`position` (NaN while it moves), `velocity` and `acceleration` are the setpoints, north and east."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._topics = topics
        self._collision_prevention = CollisionPrevention(topics, parameters, say, send)
        self.position: Horizontal = (NAN, NAN)
        self.velocity: Horizontal = (0.0, 0.0)
        self.acceleration: Horizontal = (0.0, 0.0)
        self._slewed: Horizontal = (0.0, 0.0)
        self._brake_boost = 1.0
        self.velocity_constraint = math.inf
        """A limit of the speed besides."""
        self._fastest = 0.0
        """As that and MPC_VEL_MANUAL have it, slewed."""
        self.refresh(parameters)
        self._fastest = self._speed

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self._speed = max(float(value["MPC_VEL_MANUAL"]), LEAST_SPEED)
        self._aside, self._back = float(value["MPC_VEL_MAN_SIDE"]), float(value["MPC_VEL_MAN_BACK"])
        self._acceleration, self._jerk = float(value["MPC_ACC_HOR"]), float(value["MPC_JERK_MAX"])
        self._collision_prevention.refresh(value)

    def begin(self) -> None:
        """Be as one that PX4 has made anew."""
        self._brake_boost, self._fastest = 1.0, self._speed

    def reset(self, velocity: Horizontal, acceleration: Horizontal) -> None:
        """Go on from there."""
        self.position, self.velocity, self.acceleration = (NAN, NAN), velocity, (0.0, 0.0)
        self._slewed = acceleration

    def move(self, delta: Horizontal) -> None:
        """The estimator's position has jumped by so much."""
        self.position = self.position[0] + delta[0], self.position[1] + delta[1]

    def update(self, now_us: int, forward: float, right: float, heading: float, dt_s: float) -> None:
        """One step. `forward`, `right`: sticks of -1..1 with their curve; `heading`: from which they count."""
        step = self._acceleration * dt_s
        self._fastest += max(-step, min(step, min(self.velocity_constraint, self._speed) - self._fastest))
        fastest = min(self._speed, self._fastest)
        # Because of the drag the mean acceleration is half of this
        most = 2.0 * self._acceleration * fastest / self._speed
        forward, right = self._scaled(*within_unit_length(forward, right))
        north, east = north_east(forward, right, heading)
        wanted = north * most, east * most
        if self._collision_prevention.active:
            wanted = self._collision_prevention.limit(now_us, wanted, self.velocity)
        drag = self._drag(most / max(fastest, LEAST_SPEED), not north and not east, dt_s)
        (vx, vy), (before_x, before_y) = self.velocity, self.acceleration
        turns = _sign(before_x) != _sign(wanted[0]) or _sign(before_y) != _sign(wanted[1])
        asks_nothing = wanted[0] * wanted[0] + wanted[1] * wanted[1] < EPSILON
        if (asks_nothing or turns) and vx * vx + vy * vy < (drag[0] * drag[0] + drag[1] * drag[1]) * dt_s * dt_s:
            # The drag would turn the vehicle round
            drag, vx, vy = (0.0, 0.0), 0.0, 0.0
        ax, ay = self._without_jerk(wanted[0] - drag[0], wanted[1] - drag[1], dt_s)
        tilt = self._topics.takeoff_status.tilt_limit
        if math.isfinite(tilt):
            ax, ay = shortened(ax, ay, math.tan(tilt) * GRAVITY)
        self.velocity, self.acceleration = (vx + ax * dt_s, vy + ay * dt_s), (ax, ay)
        self._lock()

    def _scaled(self, forward: float, right: float) -> Horizontal:
        """By how fast it may go to the side and back; below 0 these are as fast as forward."""
        if self._aside >= 0.0:
            right *= self._aside / self._speed
        if self._back >= 0.0 and forward < 0.0:
            forward *= self._back / self._speed
        return forward, right

    def _drag(self, coefficient: float, is_centred: bool, dt_s: float) -> Horizontal:
        """Against the velocity; boosted where it brakes, and then by the square root below 1 m/s, so that it stops."""
        boost = max(BRAKE_BOOST_MIN, math.sqrt(self._speed)) if is_centred else 1.0
        self._brake_boost += (boost - self._brake_boost) * dt_s / (BRAKE_TIME_CONSTANT_S + dt_s)
        vx, vy = self.velocity
        speed = math.sqrt(vx * vx + vy * vy)
        by_root = 1.0 / math.sqrt(speed) if 0.0 < speed < 1.0 else 1.0
        brakes = max(0.0, min(1.0, self._brake_boost - 1.0))
        share = coefficient * self._brake_boost * (brakes * by_root + 1.0 - brakes)
        return share * vx, share * vy

    def _without_jerk(self, ax: float, ay: float, dt_s: float) -> Horizontal:
        """No faster from the last acceleration than the jerk allows, both axes at a time."""
        dx, dy = ax - self.acceleration[0], ay - self.acceleration[1]
        change = math.sqrt(dx * dx + dy * dy)
        step = self._jerk * dt_s / change if change > EPSILON else 0.0
        (slewed_x, slewed_y), most_x, most_y = self._slewed, abs(dx) * step, abs(dy) * step
        slewed_x += max(-most_x, min(most_x, ax - slewed_x))
        slewed_y += max(-most_y, min(most_y, ay - slewed_y))
        self._slewed = slewed_x, slewed_y
        return self._slewed

    def _lock(self) -> None:
        """Hold the place where it stops; when it moves again go on with what the position controller asked for."""
        (vx, vy), is_held = self.velocity, math.isfinite(self.position[0])
        moves = vx * vx + vy * vy > EPSILON
        if not moves and not is_held:
            local = self._topics.vehicle_local_position
            self.position = local.x, local.y
        elif moves and is_held:
            self.position = NAN, NAN
            feedback = self._topics.vehicle_local_position_setpoint
            if math.isfinite(feedback.vx) and math.isfinite(feedback.vy):
                self.velocity = feedback.vx, feedback.vy


def _sign(value: float) -> int:
    return (value > 0.0) - (value < 0.0)
