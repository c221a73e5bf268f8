"""Heights by sticks that follow the ground (MPC_ALT_MODE 1 and 2): PX4's FlightTaskManualAltitude (v1.18).

1: the distance to the ground is held whenever the throttle is centred; 2: only while the vehicle stands, and its other
sticks are centred. Without a distance to the bottom the height is held by the estimate, as with 0. None is held that is
too low for the sensors on which the estimate rests (hagl_min).

A height over the ground outlives what is flown aside: who climbs while the vehicle still moves, and lets go when it
stands, goes back to the height at which it stood before, as a real PX4 does (2.1 m down in a flight of random sticks).
"""

import math
from typing import Final

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN, VehicleLocalPosition

FOLLOWS: Final = 1
FOLLOWS_AT_REST: Final = 2
CENTRED: Final = 0.001
RESTS_AT: Final = 0.5
"""Share of MPC_HOLD_MAX_XY below which it stands."""


class TerrainHold:
    """Of one task."""

    def __init__(self) -> None:
        self.mode = 0
        self._max_speed = self._max_climb = 0.0
        self._is_at_rest = False
        self._height = NAN
        """Over the ground, that is held."""
        self.follows = False
        """It is the ground that counts, whether a height over it is held yet or not."""

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self.mode = int(value["MPC_ALT_MODE"])
        self._max_speed, self._max_climb = float(value["MPC_HOLD_MAX_XY"]), float(value["MPC_HOLD_MAX_Z"])

    def reset(self) -> None:
        """Hold nothing."""
        self._is_at_rest, self._height, self.follows = False, NAN, False

    def stopped(self, local: VehicleLocalPosition) -> bool:
        """Whether it climbs or sinks slowly enough for a height to be held (MPC_HOLD_MAX_Z)."""
        return self._max_climb <= 0.0 or abs(local.vz) < self._max_climb

    def forget_height(self) -> None:
        """The distance to the ground has jumped."""
        self._height = NAN

    def update(self, local: VehicleLocalPosition, held: float, is_centred: bool, stick_xy: float) -> float:
        """The z to hold; NaN where the ground is not followed. `held`: z that was held so far, NaN for none;
        `is_centred`: the throttle is; `stick_xy`: how far the others are deflected."""
        height = local.dist_bottom if local.dist_bottom_valid else NAN
        known = math.isfinite(height)
        stopped = self.stopped(local)
        if self.mode == FOLLOWS_AT_REST:
            self._decide(local, held, height, stick_xy, stopped)
        self.follows = known and (self.mode == FOLLOWS or self._is_at_rest)
        if not self.follows:
            if is_centred and stopped and not math.isfinite(held):
                self._height = NAN
            return NAN
        if not is_centred:
            self._height = NAN
            return NAN
        if math.isnan(self._height):
            if not stopped:
                return NAN
            self._height = max(height, local.hagl_min) if math.isfinite(local.hagl_min) else height
        return local.z - (self._height - height)

    def _decide(self, local: VehicleLocalPosition, held: float, height: float, stick_xy: float, stopped: bool) -> None:
        """Whether the ground is followed now; where that changes, the error in height stays what it was."""
        speed, known = math.hypot(local.vx, local.vy), math.isfinite(height)
        moves = stick_xy > CENTRED
        if self._is_at_rest:
            self._is_at_rest = not moves and speed <= self._max_speed and known
            if not known:
                self._height = NAN
        elif not moves and stopped and speed < RESTS_AT * self._max_speed and known:
            self._is_at_rest = True
            if math.isfinite(held):
                self._height = height - (held - local.z)
