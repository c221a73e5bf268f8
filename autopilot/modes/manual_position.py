"""POSCTL: sticks accelerate the vehicle against a drag that limits its speed; centred, it brakes and holds its place.

Behaves as PX4's FlightTaskManualAcceleration (v1.18, MPC_POS_MODE 4); with MPC_POS_MODE 0, sticks as velocities, it is
`manual_direct.py` that flies. `stick_acceleration.py` has the horizontal half. Where the position rests on optical
flow, it flies no faster than that sees (vxy_max), and slowly near its greatest height.
"""

import math
from typing import Final

from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.flight_task import Setpoint, start_state
from sitl_emu.autopilot.modes.manual_altitude import ManualAltitude
from sitl_emu.autopilot.modes.stick_acceleration import StickAcceleration
from sitl_emu.autopilot.modes.sticks import centred, expo_deadzone
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.modes.weather_vane import WeatherVane
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, TrajectorySetpoint, VehicleLocalPosition

HIGH: Final = 0.8
SLOW_M_S: Final = 2.0
"""Share of the greatest height from which on it is slower, and how fast it is there (FlightTaskManualAcceleration)."""


class ManualPosition(ManualAltitude):
    """The flight task of POSCTL."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._horizontal = StickAcceleration(topics, parameters, say, send)
        self._weather_vane = WeatherVane(topics, parameters)
        self._xy_reset_counter = self._vxy_reset_counter = 0
        self._speed_constraint = math.inf
        """A limit of the horizontal speed besides."""
        super().__init__(topics, parameters)

    def refresh(self) -> None:
        """Copy the parameters."""
        super().refresh()
        self._horizontal.refresh(self._parameters)
        self._weather_vane.refresh(self._parameters)
        self._manual_speed = float(self._parameters["MPC_VEL_MANUAL"])

    def begin(self) -> None:
        """Be as one that PX4 has made anew."""
        super().begin()
        self._horizontal.begin()

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint."""
        super().activate(last)
        _, velocity, acceleration = start_state(last, self._topics.vehicle_local_position)
        self._horizontal.reset(velocity[:2], acceleration[:2])

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        local, sticks = self._topics.vehicle_local_position, centred(self._topics.manual_control_setpoint)
        self._take_resets(local)
        yaw = self._turn(local, sticks, dt_s)
        z, vz, az = self._vertical(sticks, dt_s)
        flown, heading = self._horizontal, local.heading if math.isnan(yaw.yaw) else yaw.yaw
        forward, right = expo_deadzone(sticks.pitch, self._dead_zone), expo_deadzone(sticks.roll, self._dead_zone)
        flown.velocity_constraint = min(self._speed_constraint, self._fastest_seen(local))
        flown.update(now_us, forward, right, heading, dt_s)
        (x, y), (vx, vy), (ax, ay) = flown.position, flown.velocity, flown.acceleration
        turn = self._weather_vane.beside_stick(yaw, holds_place=math.isfinite(x + y))
        setpoint = TrajectorySetpoint(now_us, (x, y, z), (vx, vy, vz), (ax, ay, az), *turn)
        return setpoint, self._constraints(sticks)

    def _ceiling_m(self, local: VehicleLocalPosition) -> float:
        """How high above the ground it may fly; not finite where anything goes."""
        return local.hagl_max_xy if math.isfinite(local.hagl_max_xy) else local.hagl_max_z

    def _fastest_seen(self, local: VehicleLocalPosition) -> float:
        """As fast as the estimate allows; infinite where it allows anything, or none at all."""
        fastest, ceiling_m = local.vxy_max, local.hagl_max_xy
        share = local.dist_bottom / ceiling_m if math.isfinite(ceiling_m) and ceiling_m > EPSILON else 0.0
        if share > HIGH:
            fastest = min(fastest, self._manual_speed)
            fastest += min((share - HIGH) / (1.0 - HIGH), 1.0) * (SLOW_M_S - fastest)
        return fastest if math.isfinite(fastest) and fastest >= EPSILON else math.inf

    def _note_resets(self, local: VehicleLocalPosition) -> None:
        super()._note_resets(local)
        self._xy_reset_counter, self._vxy_reset_counter = local.xy_reset_counter, local.vxy_reset_counter

    def _take_resets(self, local: VehicleLocalPosition) -> None:
        if local.xy_reset_counter != self._xy_reset_counter:
            self._horizontal.move(local.delta_xy)
        if local.vxy_reset_counter != self._vxy_reset_counter:
            self._horizontal.velocity = (local.vx, local.vy)
        super()._take_resets(local)
