"""ALTCTL and POSCTL with MPC_POS_MODE 0: sticks are velocities, at once; where it stops, height and place are held.

Behaves as PX4's FlightTaskManualAltitude and FlightTaskManualPosition (v1.18), without what smooths them in the other
modes: MPC_VEL_MANUAL, _SIDE and _BACK, MPC_Z_VEL_MAX_*, MPC_HOLD_MAX_XY, MPC_HOLD_MAX_Z. Limits near the ground and
below a ceiling, terrain and yaw are those of `manual_altitude.py`. Left out: the least height above the ground.
"""

import math
from typing import Final

from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.modes.manual_altitude import ManualAltitude
from sitl_emu.autopilot.modes.sticks import Horizontal, centred, expo_deadzone, north_east, within_unit_length
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.modes.weather_vane import WeatherVane
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    ManualControlSetpoint,
    Topics,
    TrajectorySetpoint,
    VehicleLocalPosition,
)

LEAST_SPEED_M_S: Final = 0.3
"""By which a place can be changed, however slow the estimate wants it (FlightTaskManualPosition::_scaleSticks)."""
LEAST_FULL_SPEED_M_S: Final = 0.1
"""A division by none is avoided; ours."""


class DirectAltitude(ManualAltitude):
    """The flight task of ALTCTL."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._z = NAN
        """Held; NaN while it climbs or sinks."""
        super().__init__(topics, parameters)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Hold the height it has."""
        super().activate(last)
        self._z = self._topics.vehicle_local_position.z

    def _take_resets(self, local: VehicleLocalPosition) -> None:
        if local.z_reset_counter != self._z_reset_counter and math.isfinite(self._z):
            self._z = local.z
        super()._take_resets(local)

    def _vertical(self, sticks: ManualControlSetpoint, dt_s: float) -> tuple[float, float, float]:
        """Height (NaN while it is not held) and velocity down; no acceleration."""
        local = self._topics.vehicle_local_position
        stick = -expo_deadzone(sticks.throttle, self._dead_zone)
        ground = self._ground(local, sticks, stick, self._z)
        if self._terrain.follows:
            self._z = ground
        elif abs(stick) > EPSILON:
            self._z = NAN
        elif math.isnan(self._z) and self._terrain.stopped(local):
            self._z = local.z
        return self._z, self._slowed(local, self._below_ceiling(local, stick, self._asked(stick))), NAN


class DirectPosition(DirectAltitude):
    """The flight task of POSCTL."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._weather_vane = WeatherVane(topics, parameters)
        self._place: Horizontal = (NAN, NAN)
        """Held; NaN while it moves."""
        self._xy_reset_counter = 0
        super().__init__(topics, parameters)

    def refresh(self) -> None:
        """Copy the parameters."""
        super().refresh()
        value = self._parameters
        self._fastest = max(float(value["MPC_VEL_MANUAL"]), LEAST_FULL_SPEED_M_S)
        self._aside, self._back = float(value["MPC_VEL_MAN_SIDE"]), float(value["MPC_VEL_MAN_BACK"])
        self._stands_below = float(value["MPC_HOLD_MAX_XY"])
        self._weather_vane.refresh(value)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Hold the place where it is."""
        super().activate(last)
        local = self._topics.vehicle_local_position
        self._place = (local.x, local.y)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        local, sticks = self._topics.vehicle_local_position, centred(self._topics.manual_control_setpoint)
        self._take_resets(local)
        velocity = self._velocity(local, sticks)
        yaw = self._turn(local, sticks, dt_s)
        z, vz, _ = self._vertical(sticks, dt_s)
        self._hold_place(local, velocity)
        turn = self._weather_vane.beside_stick(yaw, holds_place=math.isfinite(self._place[0]))
        setpoint = TrajectorySetpoint(now_us, (*self._place, z), (*velocity, vz), NAN3, *turn)
        return setpoint, self._constraints(sticks)

    def _velocity(self, local: VehicleLocalPosition, sticks: ManualControlSetpoint) -> Horizontal:
        """North and east, from the heading that is held or, while it turns, the vehicle's."""
        forward, right = within_unit_length(
            expo_deadzone(sticks.pitch, self._dead_zone), expo_deadzone(sticks.roll, self._dead_zone)
        )
        if self._aside >= 0.0:
            right *= self._aside / self._fastest
        if self._back >= 0.0 and forward < 0.0:
            forward *= self._back / self._fastest
        speed = self._fastest
        if math.isfinite(local.vxy_max):
            speed = max(LEAST_SPEED_M_S, min(speed, local.vxy_max))
        heading = self._stick_yaw.yaw
        return north_east(forward * speed, right * speed, local.heading if math.isnan(heading) else heading)

    def _hold_place(self, local: VehicleLocalPosition, velocity: Horizontal) -> None:
        """Where no stick asks for a velocity and it has become slow enough (_updateXYlock)."""
        if math.hypot(*velocity) >= EPSILON:
            self._place = NAN, NAN
        elif math.isnan(self._place[0]):
            stands = self._stands_below < EPSILON or math.hypot(local.vx, local.vy) < self._stands_below
            self._place = (local.x, local.y) if stands else (NAN, NAN)

    def _note_resets(self, local: VehicleLocalPosition) -> None:
        super()._note_resets(local)
        self._xy_reset_counter = local.xy_reset_counter

    def _take_resets(self, local: VehicleLocalPosition) -> None:
        if local.xy_reset_counter != self._xy_reset_counter and math.isfinite(self._place[0]):
            self._place = local.x, local.y
        super()._take_resets(local)
