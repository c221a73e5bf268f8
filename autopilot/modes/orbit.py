"""ORBIT: a circle around a point, at its height, facing as asked (PX4 v1.18's FlightTaskOrbit).

The accepted DO_ORBIT comes in `topics.vehicle_commands`; `topics.orbit_status` says what is flown. On the way to the
circle it flies like AUTO. Sticks don't change radius or speed.
"""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint, start_state
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN3, OrbitStatus, Topics, TrajectorySetpoint, VehicleCommand, VehicleConstraints
from sitl_emu.core.geodesy import MapProjection, wrap_pi

NAN = math.nan
RADIUS_MIN_M = 1.0
DEFAULT_VELOCITY = 1.0
ACCELERATION_MAX = 2.0
ON_CIRCLE_M = 3.0
"""How far from the circle the vehicle still flies around it."""
APPROACH_ACCEPTANCE_M = 1.0
DO_ORBIT = 34
"""MAV_CMD_DO_ORBIT: radius, velocity, yaw behaviour, -, latitude, longitude, altitude."""
FACE_CENTRE, HOLD_INITIAL, UNCONTROLLED, TANGENT, BY_STICKS = range(5)
STATUS_EVERY_US = 500_000


class Orbit:
    """The flight task of ORBIT."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._smoothing = PositionSmoothing()
        self._command_number = 0
        self._centre = (0.0, 0.0, 0.0)
        self._radius, self._velocity, self._behaviour = RADIUS_MIN_M, DEFAULT_VELOCITY, FACE_CENTRE
        self._published_us = 0
        self._on_circle = False
        self._initial_yaw = 0.0
        self._yaw = 0.0
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        parameters, smoothing = self._parameters, self._smoothing
        self._radius_max_m = parameters["MC_ORBIT_RAD_MAX"]
        self._yaw_mode = int(parameters["MC_ORBIT_YAW_MOD"])
        self._yaw_rate = math.radians(parameters["MPC_YAWRAUTO_MAX"])
        self._limits = VehicleConstraints(parameters["MPC_Z_VEL_MAX_UP"], parameters["MPC_Z_VEL_MAX_DN"], False)
        smoothing.set_horizontal_limits(
            parameters["MPC_XY_VEL_MAX"], parameters["MPC_ACC_HOR"], parameters["MPC_JERK_AUTO"]
        )
        self._vertical_limits = (
            (parameters["MPC_Z_V_AUTO_UP"], parameters["MPC_ACC_UP_MAX"]),
            (parameters["MPC_Z_V_AUTO_DN"], parameters["MPC_ACC_DOWN_MAX"]),
        )
        smoothing.cruise_speed = min(parameters["MPC_XY_CRUISE"], parameters["MPC_XY_VEL_MAX"])
        smoothing.xy_acceptance_m = APPROACH_ACCEPTANCE_M
        smoothing.z_acceptance_m = parameters["NAV_MC_ALT_RAD"]
        smoothing.turn_gain = parameters["MPC_XY_TRAJ_P"]
        smoothing.max_xy_error_m, smoothing.max_z_error_m = parameters["MPC_XY_ERR_MAX"], parameters["MPC_Z_ERR_MAX"]

    def activate(self, last: TrajectorySetpoint) -> None:
        """Begin, with a circle around where it is until a command asks for another."""
        local = self._topics.vehicle_local_position
        self._smoothing.reset(*start_state(last, local))
        self._yaw = self._initial_yaw = last.yaw if math.isfinite(last.yaw) else local.heading
        self._take(VehicleCommand(DO_ORBIT))
        self._on_circle = False

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step towards the circle or around it."""
        topics = self._topics
        for record in topics.vehicle_commands:
            if record.number > self._command_number and record.command.command == DO_ORBIT:
                self._command_number = record.number
                self._take(record.command)
                self._published_us = 0
        if now_us - self._published_us >= STATUS_EVERY_US:
            self._publish(now_us)
        local = topics.vehicle_local_position
        from_n, from_e = local.x - self._centre[0], local.y - self._centre[1]
        distance = math.sqrt(from_n * from_n + from_e * from_e)
        u_n, u_e = (from_n / distance, from_e / distance) if distance > 0.0 else (1.0, 0.0)
        height_error = abs(local.z - self._centre[2])
        radius_error = abs(distance - self._radius)
        if not self._on_circle and radius_error < APPROACH_ACCEPTANCE_M and height_error < APPROACH_ACCEPTANCE_M:
            self._on_circle = True
        elif self._on_circle and (radius_error > ON_CIRCLE_M or height_error > ON_CIRCLE_M):
            self._on_circle = False
            self._smoothing.reset((local.x, local.y, local.z), (local.vx, local.vy, local.vz), (0.0, 0.0, 0.0))
        if not self._on_circle:
            return self._approach(now_us, dt_s, u_n, u_e), self._limits
        return self._circle(now_us, dt_s, distance, u_n, u_e), self._limits

    def _approach(self, now_us: int, dt_s: float, u_n: float, u_e: float) -> TrajectorySetpoint:
        """Straight to the nearest point of the circle, facing the centre."""
        local = self._topics.vehicle_local_position
        position = (local.x, local.y, local.z)
        centre = self._centre
        target = (centre[0] + u_n * self._radius, centre[1] + u_e * self._radius, centre[2])
        smoothing = self._smoothing
        smoothing.set_vertical_limits(*self._vertical_limits[0 if target[2] < smoothing.z.position else 1])
        smoothing.update(position, (position, target, target), NAN3, dt_s)
        x, y, z = smoothing.axes
        self._turn_to(math.atan2(-u_e, -u_n), dt_s)
        return TrajectorySetpoint(
            now_us,
            (x.position, y.position, z.position),
            (x.velocity, y.velocity, z.velocity),
            (x.acceleration, y.acceleration, z.acceleration),
            self._yaw,
            NAN,
        )

    def _circle(self, now_us: int, dt_s: float, distance: float, u_n: float, u_e: float) -> TrajectorySetpoint:
        """Along the tangent, and back to the radius."""
        speed, radius = self._velocity, self._radius
        outwards = radius - distance
        velocity = (-u_e * speed + u_n * outwards, u_n * speed + u_e * outwards, NAN)
        centripetal = -speed * speed / radius
        yaw, yawspeed = self._yaw, NAN
        behaviour = self._behaviour
        if behaviour in (FACE_CENTRE, TANGENT):
            yawspeed = speed / radius
            direction = math.copysign(1.0, speed)
            self._turn_to(
                math.atan2(-u_e, -u_n) if behaviour == FACE_CENTRE else math.atan2(direction * u_n, -direction * u_e),
                dt_s,
            )
            yaw = self._yaw
        elif behaviour == HOLD_INITIAL:
            yaw = self._initial_yaw
        elif behaviour == UNCONTROLLED:
            yaw, yawspeed = NAN, 0.0
        return TrajectorySetpoint(
            now_us, (NAN, NAN, self._centre[2]), velocity, (centripetal * u_n, centripetal * u_e, NAN), yaw, yawspeed
        )

    def _turn_to(self, yaw: float, dt_s: float) -> None:
        step = self._yaw_rate * dt_s
        self._yaw = wrap_pi(self._yaw + max(-step, min(step, wrap_pi(yaw - self._yaw))))

    def _take(self, command: VehicleCommand) -> None:
        """A circle as asked for, within the limits; what is NaN is what is flown here and now."""
        local = self._topics.vehicle_local_position
        north, east = local.x, local.y
        if math.isfinite(command.param5) and math.isfinite(command.param6) and math.isfinite(local.ref_lat):
            north, east = MapProjection(local.ref_lat, local.ref_lon).project(command.param5, command.param6)
        down = local.ref_alt - command.param7
        self._centre = (north, east, down if math.isfinite(down) else local.z)
        radius = abs(command.param1) if math.isfinite(command.param1) else RADIUS_MIN_M
        self._radius = max(RADIUS_MIN_M, min(self._radius_max_m, radius))
        speed = abs(command.param2) if math.isfinite(command.param2) else DEFAULT_VELOCITY
        speed = min(speed, math.sqrt(ACCELERATION_MAX * self._radius))
        self._velocity = -speed if command.param1 < 0.0 or command.param2 < 0.0 else speed
        self._behaviour = int(command.param3) if math.isfinite(command.param3) else self._yaw_mode

    def _publish(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        if not math.isfinite(local.ref_lat):
            return
        self._published_us = now_us
        lat, lon = MapProjection(local.ref_lat, local.ref_lon).reproject(self._centre[0], self._centre[1])
        radius = math.copysign(self._radius, self._velocity)
        alt = local.ref_alt - self._centre[2]
        self._topics.orbit_status = OrbitStatus(now_us, radius, 5, lat, lon, alt, self._behaviour)
