"""goto_setpoint: to a place by a smoothed trajectory, with limits of one's own (PX4 v1.18's GotoControl).

There mc_pos_control makes trajectory_setpoint of it, wherever it controls position and nobody else writes one; here
OFFBOARD does. Limits that a setpoint gives count below the vehicle's own and scale the acceleration with them, once the
trajectory is no faster. Without a new one for half a second the last trajectory setpoint stays.
"""

import math
from typing import Final

from sitl_emu.autopilot.modes.heading_smoothing import HeadingSmoothing
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import GotoSetpoint, TrajectorySetpoint, VehicleLocalPosition

TIMEOUT_US: Final = 500_000
STANDS: Final = (0.0, 0.0, 0.0)


class GotoControl:
    """The trajectory to the place that is asked for."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._smoothing, self._heading = PositionSmoothing(is_single=True), HeadingSmoothing()
        # What PX4 leaves at 0
        self._smoothing.turn_gain = self._smoothing.z_acceptance_m = self._smoothing.max_z_error_m = 0.0
        self._smoothing.xy_acceptance_m = 0.0
        self._runs = self._turns = False
        self._last = TrajectorySetpoint()
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        get = self._parameters.__getitem__
        self._cruise, self._fastest = get("MPC_XY_CRUISE"), get("MPC_XY_VEL_MAX")
        self._acceleration, self._jerk = get("MPC_ACC_HOR"), get("MPC_JERK_AUTO")
        self._up, self._down = get("MPC_Z_V_AUTO_UP"), get("MPC_Z_V_AUTO_DN")
        self._acceleration_up, self._acceleration_down = get("MPC_ACC_UP_MAX"), get("MPC_ACC_DOWN_MAX")
        self._yaw_rate, self._yaw_acceleration = (
            math.radians(get(name)) for name in ("MPC_YAWRAUTO_MAX", "MPC_YAWRAUTO_ACC")
        )
        self._smoothing.max_xy_error_m = get("MPC_XY_ERR_MAX")

    def stop(self) -> None:
        """Nobody asks for a place: the next trajectory begins where the vehicle is then."""
        self._runs = self._turns = False
        self._last = TrajectorySetpoint()

    def update(self, now_us: int, dt_s: float, goto: GotoSetpoint, local: VehicleLocalPosition) -> TrajectorySetpoint:
        """One step; the last one where the setpoint is too old or no place, or where the vehicle is not known."""
        place = (local.x, local.y, local.z)
        if now_us >= goto.timestamp + TIMEOUT_US or not math.isfinite(sum(place) + sum(goto.position)):
            self._runs = False
            return self._last
        smoothing = self._smoothing
        if not self._runs:
            smoothing.reset(place, (local.vx, local.vy, local.vz), (local.ax, local.ay, local.az))
            self._heading.reset(local.heading)
            self._runs = True
        self._limit(goto)
        smoothing.update(place, (goto.position,) * 3, STANDS, dt_s)
        axes = smoothing.axes
        self._last = TrajectorySetpoint(
            now_us,
            (axes[0].position, axes[1].position, axes[2].position),
            (axes[0].velocity, axes[1].velocity, axes[2].velocity),
            (axes[0].acceleration, axes[1].acceleration, axes[2].acceleration),
            *self._turn(goto, local.heading, dt_s),
            (axes[0].jerk, axes[1].jerk, axes[2].jerk),
        )
        return self._last

    def _limit(self, goto: GotoSetpoint) -> None:
        x, y, z = self._smoothing.axes
        speed, share = _limited(goto.max_horizontal_speed, self._cruise, math.hypot(x.velocity, y.velocity))
        self._smoothing.cruise_speed = speed
        self._smoothing.set_horizontal_limits(self._fastest, self._acceleration * share, self._jerk)
        rises = goto.position[2] < z.position
        most, acceleration = (self._up, self._acceleration_up) if rises else (self._down, self._acceleration_down)
        speed, share = _limited(goto.max_vertical_speed, most, abs(z.velocity))
        self._smoothing.set_vertical_limits(speed, acceleration * share)

    def _turn(self, goto: GotoSetpoint, heading: float, dt_s: float) -> tuple[float, float]:
        """Yaw and its rate; NaN where the setpoint controls no heading."""
        if not (math.isfinite(goto.heading) and math.isfinite(heading)):
            self._turns = False
            return math.nan, math.nan
        if not self._turns:
            self._heading.reset(heading)
            self._turns = True
        rate, share = _limited(goto.max_heading_rate, self._yaw_rate, abs(self._heading.rate))
        self._heading.set_limits(rate, self._yaw_acceleration * share)
        self._heading.update(goto.heading, dt_s)
        return self._heading.heading, self._heading.rate


def _limited(asked: float, most: float, present: float) -> tuple[float, float]:
    """The limit, and the share of the acceleration that goes with it; `asked`: NaN for the vehicle's own."""
    if not math.isfinite(asked):
        return most, 1.0
    limit = max(0.0, min(asked, most))
    return limit, limit / most if present <= limit and most > 0.0 else 1.0
