"""ORBIT: a circle around a point, at its height, facing as asked (PX4 v1.18's FlightTaskOrbit).

The accepted DO_ORBIT comes in `topics.vehicle_commands`; `topics.orbit_status` says what is flown. It flies straight to
the circle, at once and with the limits of AUTO; on it, the speed is slewed and the height held as in ALTCTL. What a
command leaves out (NaN) stays as it was. Sticks change radius and speed. A radius that is not flown is told, and the
vehicle stays where it is.
"""

import math
from typing import ClassVar

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.flight_task import Setpoint, start_state
from sitl_emu.autopilot.modes.heading_smoothing import HeadingSmoothing
from sitl_emu.autopilot.modes.manual_altitude import ManualAltitude
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.modes.sticks import centred, expo_deadzone
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN3,
    ManualControlSetpoint,
    OrbitStatus,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleCommand,
)
from sitl_emu.core.c_types import rounded, truncated
from sitl_emu.core.geodesy import MapProjection

NAN = math.nan
RADIUS_MIN_M = 1.0
DEFAULT_VELOCITY = 1.0
ACCELERATION_MAX = 2.0
ON_CIRCLE_M = 2.0
NOWHERE_M = 1e-5
DO_ORBIT = 34
"""MAV_CMD_DO_ORBIT: radius, velocity, yaw behaviour, -, latitude, longitude, altitude."""
FACE_CENTRE, HOLD_INITIAL, UNCONTROLLED, TANGENT, BY_STICKS, UNCHANGED = range(6)
COMMAND_COUNTS_US = 200_000
"""A command that is older when the mode begins is not flown (FlightModeManager.cpp)."""


class Orbit(ManualAltitude):
    """The flight task of ORBIT."""

    NEEDS_STICKS: ClassVar[bool] = False

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._say = say
        self._send = send
        self._smoothing = PositionSmoothing(is_single=True)
        self._smoothing.max_z_error_m = 0.0  # PX4 leaves it: the height waits for nobody
        self._heading = HeadingSmoothing()
        self._command_number = 0
        self._centre: Vector3 = (0.0, 0.0, 0.0)
        self._radius, self._velocity, self._behaviour = RADIUS_MIN_M, DEFAULT_VELOCITY, FACE_CENTRE
        self._clockwise = True
        self._approaching = True
        self._orbiting = False
        self._slewed = 0.0
        self._initial_yaw = 0.0
        self._flown = TrajectorySetpoint()
        self._refused: TrajectorySetpoint | None = None
        """Where to stay, after a command that can't be flown."""
        super().__init__(topics, parameters)

    def refresh(self) -> None:
        """Copy the parameters."""
        super().refresh()
        parameters, smoothing = self._parameters, self._smoothing
        self._radius_max_m = float(parameters["MC_ORBIT_RAD_MAX"])
        self._yaw_mode = int(parameters["MC_ORBIT_YAW_MOD"])
        self._velocity_max = abs(float(parameters["MPC_XY_VEL_MAX"]))
        self._slew_m_s2 = float(parameters["MPC_ACC_HOR"])
        self._heading.set_limits(
            math.radians(parameters["MPC_YAWRAUTO_MAX"]), math.radians(parameters["MPC_YAWRAUTO_ACC"])
        )
        smoothing.set_horizontal_limits(
            parameters["MPC_XY_VEL_MAX"], parameters["MPC_ACC_HOR"], parameters["MPC_JERK_AUTO"]
        )
        self._vertical_limits = (
            (parameters["MPC_Z_V_AUTO_UP"], parameters["MPC_ACC_UP_MAX"]),
            (parameters["MPC_Z_V_AUTO_DN"], parameters["MPC_ACC_DOWN_MAX"]),
        )
        smoothing.cruise_speed = parameters["MPC_XY_CRUISE"]
        smoothing.xy_acceptance_m = ON_CIRCLE_M
        smoothing.z_acceptance_m = parameters["NAV_MC_ALT_RAD"]
        smoothing.turn_gain = parameters["MPC_XY_TRAJ_P"]
        smoothing.max_xy_error_m = parameters["MPC_XY_ERR_MAX"]

    def activate(self, last: TrajectorySetpoint) -> None:
        """Begin, with a circle around where it is until a command asks for another."""
        super().activate(last)
        local = self._topics.vehicle_local_position
        position, velocity, acceleration = start_state(last, local)
        self._smoothing.reset(position, velocity, acceleration)
        self._heading.reset(
            last.yaw if math.isfinite(last.yaw) else local.heading,
            last.yawspeed if math.isfinite(last.yawspeed) else 0.0,
        )
        self._centre = (local.x, local.y, local.z)
        self._radius, self._velocity, self._behaviour = RADIUS_MIN_M, DEFAULT_VELOCITY, FACE_CENTRE
        self._clockwise = True
        self._approaching, self._orbiting = True, False
        self._slewed = 0.0
        self._initial_yaw = local.heading
        self._flown = TrajectorySetpoint(0, position, velocity, acceleration, self._heading.heading, 0.0)
        self._refused = None

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step towards the circle or around it."""
        sticks = centred(self._topics.manual_control_setpoint)
        for record in self._topics.vehicle_commands:
            if record.number > self._command_number:
                self._command_number = record.number
                if record.command.command == DO_ORBIT and now_us < record.timestamp + COMMAND_COUNTS_US:
                    self._take(now_us, record.command)
        if self._refused is not None:
            return self._refused, self._constraints(sticks)
        self._orbiting = True
        self._adjust(sticks, dt_s)
        flown = self._flown
        if self._approaching and self._is_on_circle():
            self._approaching = False
            self._slewed = 0.0
            self._climb.go_on(*(_or(a, b) for a, b in zip(_vertical_of(flown), self._vertical_state(), strict=True)))
        self._flown = self._approach(now_us, dt_s) if self._approaching else self._circle(now_us, dt_s, sticks)
        self._publish(now_us)
        return self._flown, self._constraints(sticks)

    # --- what is flown ------------------------------------------------------------------------------------------

    def _approach(self, now_us: int, dt_s: float) -> TrajectorySetpoint:
        """Straight to the nearest point of the circle, facing the centre."""
        local = self._topics.vehicle_local_position
        position, centre, smoothing = (local.x, local.y, local.z), self._centre, self._smoothing
        to_n, to_e = centre[0] - local.x, centre[1] - local.y
        distance = math.hypot(to_n, to_e)
        share = (distance - self._radius) / distance if distance > NOWHERE_M else 0.0
        target = (local.x + to_n * share, local.y + to_e * share, centre[2])
        smoothing.set_vertical_limits(*self._vertical_limits[0 if self._flown.velocity[2] < 0.0 else 1])
        smoothing.update(position, (target, target, target), NAN3, dt_s)
        x, y, z = smoothing.axes
        self._heading.update(math.atan2(to_e, to_n), dt_s)
        return TrajectorySetpoint(
            now_us,
            (x.position, y.position, z.position),
            (x.velocity, y.velocity, z.velocity),
            (x.acceleration, y.acceleration, z.acceleration),
            self._heading.heading,
            self._heading.rate,
        )

    def _circle(self, now_us: int, dt_s: float, sticks: ManualControlSetpoint) -> TrajectorySetpoint:
        """Along the tangent, and back to the radius."""
        local = self._topics.vehicle_local_position
        self._take_resets(local)
        z, vz, az = self._vertical(sticks, dt_s)
        from_n, from_e, from_d = (place - c for place, c in zip((local.x, local.y, local.z), self._centre, strict=True))
        distance = math.hypot(from_n, from_e)
        u_n, u_e = (from_n / distance, from_e / distance) if distance > NOWHERE_M else (0.0, 0.0)
        step = self._slew_m_s2 * dt_s
        self._slewed += max(-step, min(step, self._velocity - self._slewed))
        speed, outwards = self._slewed, self._radius - distance
        velocity = (-u_e * speed + u_n * outwards, u_n * speed + u_e * outwards, vz)
        # The centripetal acceleration's direction is that of all three axes.
        space = math.hypot(distance, from_d)
        inwards = -speed * speed / self._radius / space if space > NOWHERE_M else 0.0
        yaw, yawspeed = self._yaw_on_circle(from_n, from_e, sticks, dt_s)
        if math.isfinite(yaw):
            self._heading.update(yaw, dt_s)
        else:
            self._heading.rest(dt_s)
        # What is smoothed is what sticks find: they turn the vehicle away from it, and let go it turns back
        self._stick_yaw.yaw = self._heading.heading
        acceleration = (inwards * from_n, inwards * from_e, az)
        return TrajectorySetpoint(now_us, (NAN, NAN, z), velocity, acceleration, self._heading.heading, yawspeed)

    def _yaw_on_circle(
        self, from_n: float, from_e: float, sticks: ManualControlSetpoint, dt_s: float
    ) -> tuple[float, float]:
        """Where to look, NaN for where it looks; and how fast that turns."""
        behaviour = self._behaviour
        self._turn(self._topics.vehicle_local_position, sticks, dt_s)
        if behaviour == HOLD_INITIAL:
            return self._initial_yaw, NAN
        if behaviour == UNCONTROLLED:
            return NAN, 0.0
        if behaviour == BY_STICKS:
            return self._stick_yaw.yaw, self._stick_yaw.yawspeed
        if behaviour == TANGENT:
            direction = 1.0 if self._clockwise else -1.0
            return math.atan2(direction * from_n, -direction * from_e), self._velocity / self._radius
        return math.atan2(-from_e, -from_n), self._velocity / self._radius

    def _is_on_circle(self) -> bool:
        local, centre = self._topics.vehicle_local_position, self._centre
        distance = math.hypot(local.x - centre[0], local.y - centre[1])
        return abs(distance - self._radius) < ON_CIRCLE_M and abs(local.z - centre[2]) < self._smoothing.z_acceptance_m

    def _vertical_state(self) -> Vector3:
        local = self._topics.vehicle_local_position
        return local.z, local.vz, local.az

    # --- what is asked for --------------------------------------------------------------------------------------

    def _take(self, now_us: int, command: VehicleCommand) -> None:
        """A circle as asked for; one that is too small or too large is refused, and what was flown ends."""
        local = self._topics.vehicle_local_position
        if self._refused is not None:
            self.activate(TrajectorySetpoint())
        clockwise, radius, speed = self._velocity > 0.0, self._radius, abs(self._velocity)
        if math.isfinite(command.param1):
            clockwise, radius = command.param1 > 0.0, abs(command.param1)
        if math.isfinite(command.param2):
            speed = command.param2
        good = RADIUS_MIN_M <= radius <= self._radius_max_m
        if good:
            self._clockwise = clockwise
            self._radius, self._velocity = self._feasible(radius, speed if clockwise else -speed)
        else:
            self._say(Severity.CRITICAL, "Orbit radius limit exceeded\t")
            self._send("orbit_radius_exceeded", Severity.ALERT)
        self._look(command.param3)
        good = self._go(command) and good
        if not self._approaching and not self._is_on_circle():
            self._approaching = True
            flown = self._flown
            self._smoothing.reset((local.x, local.y, local.z), flown.velocity, flown.acceleration)
        if not good:
            place = (local.x, local.y, local.z)
            self._refused = TrajectorySetpoint(now_us, place, (0.0, 0.0, 0.0), (0.0, 0.0, NAN), local.heading, 0.0)

    def _look(self, behaviour: float) -> None:
        """Whereto, from now on."""
        if math.isfinite(behaviour):
            if rounded(behaviour) != UNCHANGED:
                self._behaviour = truncated(behaviour)
            elif not self._orbiting:
                self._behaviour = self._yaw_mode
        self._initial_yaw = self._topics.vehicle_local_position.heading

    def _go(self, command: VehicleCommand) -> bool:
        """Take the centre; false if the vehicle does not know where on earth it is."""
        local = self._topics.vehicle_local_position
        known = math.isfinite(local.ref_lat)
        north, east, down = self._centre
        good = True
        if math.isfinite(command.param5) and math.isfinite(command.param6):
            if known:
                north, east = MapProjection(local.ref_lat, local.ref_lon).project(command.param5, command.param6)
            good = known
        if math.isfinite(command.param7):
            if known:
                down = local.ref_alt - command.param7
            good = known
        self._centre = (north, east, down)
        return good

    def _adjust(self, sticks: ManualControlSetpoint, dt_s: float) -> None:
        """Radius and speed by sticks, in a frame that looks at the centre, or along the circle."""
        pitch, roll = expo_deadzone(sticks.pitch, self._dead_zone), expo_deadzone(sticks.roll, self._dead_zone)
        if self._behaviour == TANGENT:
            direction = 1.0 if self._clockwise else -1.0
            closer, faster = direction * roll, direction * pitch
        else:
            closer, faster = pitch, roll
        self._radius, self._velocity = self._feasible(
            self._radius - closer * dt_s * self._smoothing.cruise_speed,
            self._velocity + faster * dt_s * self._slew_m_s2,
        )

    def _feasible(self, radius: float, velocity: float) -> tuple[float, float]:
        """Both within their limits; rather slower than wider."""
        radius = max(RADIUS_MIN_M, min(self._radius_max_m, radius))
        velocity = max(-self._velocity_max, min(self._velocity_max, velocity))
        if velocity * velocity >= ACCELERATION_MAX * radius:
            velocity = math.copysign(math.sqrt(ACCELERATION_MAX * radius), velocity)
        return radius, velocity

    def _publish(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        if not math.isfinite(local.ref_lat):
            return
        lat, lon = MapProjection(local.ref_lat, local.ref_lon).reproject(self._centre[0], self._centre[1])
        radius = math.copysign(self._radius, self._velocity)
        alt = local.ref_alt - _or(self._flown.position[2], local.z)
        self._topics.orbit_status = OrbitStatus(
            now_us, radius, lat=lat, lon=lon, alt=alt, yaw_behaviour=self._behaviour
        )


def _vertical_of(setpoint: TrajectorySetpoint) -> Vector3:
    return setpoint.position[2], setpoint.velocity[2], setpoint.acceleration[2]


def _or(value: float, default: float) -> float:
    return value if math.isfinite(value) else default
