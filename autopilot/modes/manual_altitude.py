"""ALTCTL: sticks tilt the vehicle and command its climb rate; the height is held when the throttle is centred.

Behaves as PX4's FlightTaskManualAltitudeSmoothVel (v1.18) with StickTiltXY: MPC_MAN_TILT_MAX, MPC_Z_VEL_MAX_*,
MPC_ACC_*_MAX, MPC_JERK_MAX, MPC_MAN_Y_MAX, MAN_DEADZONE, MPC_ALT_MODE. Near the ground it climbs and sinks more slowly
(MPC_LAND_ALT1, MPC_LAND_ALT2, MPC_TKO_SPEED, MPC_LAND_SPEED), and no higher above it than the sensors see on which the
estimate rests (hagl_max_*).
"""

import math
from typing import ClassVar, Final

from sitl_emu.autopilot.modes.climb_smoothing import ClimbLimits, ClimbSmoothing
from sitl_emu.autopilot.modes.flight_task import Setpoint, distance_to_ground_m, start_state
from sitl_emu.autopilot.modes.sticks import (
    Horizontal,
    StickYaw,
    acceleration_at,
    centred,
    expo_deadzone,
    low_passed,
    north_east,
    within_unit_length,
)
from sitl_emu.autopilot.modes.terrain_hold import TerrainHold
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    ManualControlSetpoint,
    Topics,
    TrajectorySetpoint,
    VehicleConstraints,
    VehicleLocalPosition,
)

TAKEOFF_THROTTLE: Final = 0.3


class ManualAltitude:
    """The flight task of ALTCTL, and the vertical half of POSCTL and ORBIT."""

    NEEDS_STICKS: ClassVar[bool] = True
    """Without any it does not run (FlightTaskManualAltitude::updateInitialize, _sticks_data_required)."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._climb = ClimbSmoothing()
        self._terrain = TerrainHold()
        self._follows_terrain = False
        self._stick_yaw = StickYaw()
        self._tilt: Horizontal = (0.0, 0.0)
        self._speed_up = self._speed_down = 0.0
        """Limits that the task has put: up below 0 is down."""
        self._velocity_constraint_up = self._velocity_constraint_down = math.inf
        """Limits besides the parameters'."""
        self._z_reset_counter = self._vz_reset_counter = 0
        self._heading_reset_counter = self._bottom_reset_counter = 0
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        value = self._parameters
        self._limits = ClimbLimits(
            value["MPC_Z_VEL_MAX_UP"], value["MPC_Z_VEL_MAX_DN"], value["MPC_ACC_UP_MAX"], value["MPC_ACC_DOWN_MAX"],
            value["MPC_JERK_MAX"],
        )  # fmt: skip
        self._slow_up, self._slow_down = float(value["MPC_TKO_SPEED"]), float(value["MPC_LAND_SPEED"])
        self._fast_above_m, self._slow_below_m = float(value["MPC_LAND_ALT1"]), float(value["MPC_LAND_ALT2"])
        self._height_gain = float(value["MPC_Z_P"])
        self._dead_zone = float(value["MAN_DEADZONE"])
        self._max_acceleration = acceleration_at(value["MPC_MAN_TILT_MAX"])
        self._tilt_time_constant_s = float(value["MC_MAN_TILT_TAU"])
        self._stick_yaw.max_rate = math.radians(value["MPC_MAN_Y_MAX"])
        self._stick_yaw.time_constant_s = value["MPC_MAN_Y_TAU"]
        self._terrain.refresh(value)

    def begin(self) -> None:
        """Be as one that PX4 has made anew."""
        self._climb = ClimbSmoothing()

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint."""
        local = self._topics.vehicle_local_position
        position, velocity, acceleration = start_state(last, local)
        self._climb.go_on(position[2], velocity[2], acceleration[2])
        self._terrain.reset()
        self._follows_terrain = False
        self._stick_yaw.reset(local.heading, local.unaided_heading)
        self._tilt = (0.0, 0.0)
        self._speed_up, self._speed_down = self._limits.speed_up, self._limits.speed_down
        self._note_resets(local)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        local, sticks = self._topics.vehicle_local_position, centred(self._topics.manual_control_setpoint)
        self._take_resets(local)
        yaw = self._turn(local, sticks, dt_s)
        north, east = north_east(*self._tilted(sticks, dt_s), local.heading if math.isnan(yaw.yaw) else yaw.yaw)
        z, vz, az = self._vertical(sticks, dt_s)
        acceleration = (north * self._max_acceleration, east * self._max_acceleration, az)
        setpoint = TrajectorySetpoint(now_us, (NAN, NAN, z), (NAN, NAN, vz), acceleration, yaw.yaw, yaw.yawspeed)
        return setpoint, self._constraints(sticks)

    def _constraints(self, sticks: ManualControlSetpoint) -> VehicleConstraints:
        return VehicleConstraints(self._speed_up, self._speed_down, sticks.throttle > TAKEOFF_THROTTLE)

    # --- jumps of the estimate ----------------------------------------------------------------------------------

    def _note_resets(self, local: VehicleLocalPosition) -> None:
        self._z_reset_counter, self._vz_reset_counter = local.z_reset_counter, local.vz_reset_counter
        self._heading_reset_counter = local.heading_reset_counter
        self._bottom_reset_counter = local.dist_bottom_reset_counter

    def _take_resets(self, local: VehicleLocalPosition) -> None:
        if local.z_reset_counter != self._z_reset_counter:
            self._climb.force_position(local.z)
        if local.vz_reset_counter != self._vz_reset_counter:
            self._climb.force_velocity(local.vz)
        if local.heading_reset_counter != self._heading_reset_counter:
            self._stick_yaw.turned(local.delta_heading)
        if local.dist_bottom_reset_counter != self._bottom_reset_counter:
            self._terrain.forget_height()
        self._note_resets(local)

    # --- sticks -------------------------------------------------------------------------------------------------

    def _turn(self, local: VehicleLocalPosition, sticks: ManualControlSetpoint, dt_s: float) -> StickYaw:
        stick = expo_deadzone(sticks.yaw, self._dead_zone)
        self._stick_yaw.update(stick, local.heading, dt_s, local.unaided_heading)
        return self._stick_yaw

    def _tilted(self, sticks: ManualControlSetpoint, dt_s: float) -> Horizontal:
        """Forward and to the right, as shares of the greatest acceleration."""
        to = within_unit_length(sticks.pitch, sticks.roll)
        self._tilt = low_passed(self._tilt, to, self._tilt_time_constant_s, dt_s)
        return self._tilt

    def _vertical(self, sticks: ManualControlSetpoint, dt_s: float) -> tuple[float, float, float]:
        """Height (NaN while it is not held), velocity and acceleration down."""
        local, climb, limits = self._topics.vehicle_local_position, self._climb, self._limits
        stick = -expo_deadzone(sticks.throttle, self._dead_zone)
        ground = self._ground(local, sticks, stick, climb.position)
        feedback = self._topics.vehicle_local_position_setpoint.vz
        velocity = self._below_ceiling(local, stick, self._asked(stick))
        if (self._speed_up, self._speed_down) != limits[:2]:
            limits = limits._replace(speed_up=self._speed_up, speed_down=self._speed_down)
        climb.update(dt_s, self._slowed(local, velocity), local.z, feedback, limits)
        follows = math.isfinite(ground)
        if follows:
            climb.force_position(ground)
        elif self._follows_terrain:
            climb.force_position(local.z)
        self._follows_terrain = follows
        return ground if follows else climb.position, climb.velocity, climb.acceleration

    def _asked(self, stick: float) -> float:
        """Velocity down for a throttle of -`stick`."""
        limits = self._limits
        if stick > 0.0:
            return stick * min(limits.speed_down, self._velocity_constraint_down)
        return stick * min(limits.speed_up, self._velocity_constraint_up)

    def _ground(
        self, local: VehicleLocalPosition, sticks: ManualControlSetpoint, throttle: float, held: float
    ) -> float:
        """The z that follows the ground; NaN where it does not. `held`: that was held so far."""
        if not self._terrain.mode:
            return NAN
        aside = math.hypot(*(expo_deadzone(each, self._dead_zone) for each in (sticks.pitch, sticks.roll)))
        return self._terrain.update(local, held, abs(throttle) <= EPSILON, aside)

    def _ceiling_m(self, local: VehicleLocalPosition) -> float:
        """How high above the ground it may fly; not finite where anything goes."""
        return local.hagl_max_z

    def _below_ceiling(self, local: VehicleLocalPosition, stick: float, velocity: float) -> float:
        """A velocity down, for a throttle of -`stick`: above the ceiling it sinks; `_speed_up` shrinks on the way up.

        FlightTaskManualAltitude::_respectMaxAltitude. Where the distance to the ground is not measured, limits stay as
        they were when the task began, whatever becomes of their parameters.
        """
        if not local.dist_bottom_valid:
            return velocity
        self._speed_up, self._speed_down = up, down = self._limits.speed_up, self._limits.speed_down
        ceiling_m = self._ceiling_m(local)
        if not math.isfinite(ceiling_m):
            return velocity
        room = self._height_gain * (ceiling_m - local.dist_bottom)
        self._speed_up = max(-down, min(up, room))
        return max(0.0, min(down, -room)) if room < 0.0 and stick <= -EPSILON else velocity

    def _slowed(self, local: VehicleLocalPosition, velocity: float) -> float:
        """A velocity down, no faster than is flown so near to the ground."""
        height = distance_to_ground_m(local, self._topics.home_position)
        low, high = self._slow_below_m, self._fast_above_m
        share = 0.0 if height <= low else 1.0 if height > high else (height - low) / (high - low)
        up = self._slow_up + share * (self._speed_up - self._slow_up)
        down = self._slow_down + share * (self._speed_down - self._slow_down)
        return max(-up, min(down, velocity))
