"""A four-wheeled, Ackermann-steered ground vehicle on terrain: a single-track model whose body follows the ground.

Equations, with u, v the velocity along body x and y, r the yaw rate, δ the steering angle of the (mean) front wheel,
a and b the distances from the centre of mass to front and rear axle, N = m g cos θ the load, g_x, g_y gravity along
the body axes that lie in the ground's plane:

- steering δ̇ = (δ_max c₀ - δ)/τ_s;  motor command ċ = (c₁ - c)/τ_m
- drive at the rear axle F = F_stall (c - u/u_free), at most μ N b-share of the load: a DC drive, which brakes when the
  command is less than the speed; rolling resistance c_r N against u
- tyres: F_f = -C (v + a r - u tan δ)/U, F_r = -C (v - b r)/U, U = max(|u|, 0.5 m/s) (below that, slip angles mean
  nothing), each at most μ times its load; m (v̇ + u r) = F_f + F_r + m g_y;  I_z ṙ = a F_f - b F_r.
  The pair (v, r) is stepped implicitly, as stiff tyres ask
- brake: with no command and slower than 1 m/s the drive's brake closes (as an electric wheelchair's does), and
  c_r becomes holding_friction; once it stands, it stays on any slope with tan θ ≤ holding_friction
- body: roll, pitch and height follow the ground's plane under the four wheels, each as a critically damped
  second-order system (the suspension)

The ground's plane is level between samples 2 cm apart. Not modelled: lateral load transfer, wheels one by one, tipping
over, jumps, wind.
Sources: R. Rajamani, Vehicle Dynamics and Control, ch. 2 (single-track model); J. Y. Wong, Theory of Ground Vehicles
(rolling resistance).
"""

import math
from typing import Final

from sitl_emu.core.attitude import quaternion
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import STEP_S, Dynamics, Height, Quaternion, Vector3, slope_angles

SLIP_SPEED_M_S: Final = 0.5
BRAKE_M_S: Final = 1.0
BRAKE_COMMAND: Final = 0.01
GROUND_FRESH_M: Final = 0.02


class Ackermann(Dynamics):
    """State and step of the rover. controls: (steering -1..1, motor -1..1)."""

    def __init__(
        self,
        vehicle: Vehicle,
        height: Height,
        north_m: float = 0.0,
        east_m: float = 0.0,
        yaw_rad: float = 0.0,
        gravity_m_s2: float = 9.80665,
    ) -> None:
        """Raises ValueError for a vehicle without chassis."""
        if vehicle.chassis is None:
            raise ValueError(f"{vehicle.model} has no chassis")
        chassis = self._chassis = vehicle.chassis
        self._height, self._gravity = height, gravity_m_s2
        self._mass, self._izz = vehicle.mass_kg, vehicle.inertia_kg_m2[2]
        self._rear = chassis.centre_to_rear_axle_m
        self._front = chassis.wheelbase_m - self._rear
        self._steer_lag = 1.0 - math.exp(-STEP_S / chassis.steer_time_constant_s)
        self._motor_lag = 1.0 - math.exp(-STEP_S / chassis.motor_time_constant_s)
        self._follow = chassis.suspension_rad_s
        self.steer_angle_rad = 0.0
        self._motor = 0.0
        self._u = self._v = 0.0
        self._yaw = yaw_rad
        self.north_m, self.east_m = north_m, east_m
        self._ground_at = (math.inf, math.inf, 0.0)
        self._ground = (0.0, 0.0, 0.0)
        self._look_at_ground()
        self._height_m, self._roll, self._pitch = self._ground
        self._climb = self._roll_rate = self._pitch_rate = 0.0
        self.down_m = -self._height_m
        self.vn_m_s = self.ve_m_s = self.vd_m_s = 0.0
        self.q: Quaternion = quaternion(self._roll, self._pitch, yaw_rad)
        self.p_rad_s = self.q_rad_s = self.r_rad_s = 0.0
        self.ax_m_s2 = gravity_m_s2 * math.sin(self._pitch)
        self.ay_m_s2 = -gravity_m_s2 * math.cos(self._pitch) * math.sin(self._roll)
        self.az_m_s2 = -gravity_m_s2 * math.cos(self._pitch) * math.cos(self._roll)
        self.power_w = 0.0
        self.running = False
        self.drive = 1.0
        self.wrecked = False
        self._jolt = (0.0, 0.0)
        """Specific force of impulses since the last step, forward and right."""

    def motor_speeds(self) -> tuple[float, ...]:
        """The motor's is not told: none."""
        return ()

    def step(self, controls: tuple[float, ...], wind_n_m_s: float, wind_e_m_s: float, wind_d_m_s: float) -> None:
        """Advance by 4 ms."""
        chassis, dt, mass, gravity = self._chassis, STEP_S, self._mass, self._gravity
        steering, command = (controls[0], controls[1]) if len(controls) >= 2 and not self.wrecked else (0.0, 0.0)
        delta = self.steer_angle_rad
        delta += self._steer_lag * (chassis.max_steer_angle_rad * steering - delta)
        self.steer_angle_rad = delta
        motor = self._motor = self._motor + self._motor_lag * (self.drive * command - self._motor)

        sin_roll, cos_roll = math.sin(self._roll), math.cos(self._roll)
        sin_pitch, cos_pitch = math.sin(self._pitch), math.cos(self._pitch)
        gx, gy, gz = -gravity * sin_pitch, gravity * cos_pitch * sin_roll, gravity * cos_pitch * cos_roll
        load = mass * gz
        u, v, r = self._u, self._v, self.r_rad_s

        # along: drive, rolling resistance, slope
        share = self._front / chassis.wheelbase_m
        drive = _within(
            chassis.stall_force_n * (motor - u / chassis.free_speed_m_s), chassis.tyre_friction * load * share
        )
        braked = abs(u) < BRAKE_M_S and abs(motor) < BRAKE_COMMAND
        pull = mass * math.sqrt(gx * gx + gy * gy)
        if braked and u == 0.0 and pull <= chassis.holding_friction * load:
            u2 = v2 = r2 = 0.0
            self.running = False
            self.power_w = 0.0
        else:
            rest = mass * u + dt * (drive + mass * (gx + v * r))
            resistance = dt * load * (chassis.holding_friction if braked else chassis.rolling_resistance)
            u2 = (rest - _within(rest, resistance)) / mass
            v2, r2 = self._tyres(u2, v, r, math.tan(delta), gy, load)
            self.running = True
            self.power_w = abs(drive * u) / chassis.motor_efficiency + abs(motor * drive) * 0.1
        self._u, self._v = u2, v2
        ax, ay = (u2 - u) / dt - r2 * v2, (v2 - v) / dt + r2 * u2

        # the body follows the ground
        yaw = self._yaw
        k = dt * self._follow
        height, roll, pitch = self._ground
        self._roll_rate += k * (self._follow * (roll - self._roll) - 2.0 * self._roll_rate)
        self._pitch_rate += k * (self._follow * (pitch - self._pitch) - 2.0 * self._pitch_rate)
        climb = self._climb
        self._climb += k * (self._follow * (height - self._height_m) - 2.0 * self._climb)
        self._roll += dt * self._roll_rate
        self._pitch += dt * self._pitch_rate
        self._height_m += dt * self._climb
        az = -(self._climb - climb) / dt

        # Euler rates to body rates; r is the rate about the body's down axis
        yaw_rate = (r2 + sin_roll * self._pitch_rate) / (cos_roll * cos_pitch)
        self.p_rad_s = self._roll_rate - sin_pitch * yaw_rate
        self.q_rad_s = cos_roll * self._pitch_rate + sin_roll * cos_pitch * yaw_rate
        self.r_rad_s = r2
        yaw = self._yaw = math.remainder(yaw + dt * yaw_rate, math.tau)
        self.q = quaternion(self._roll, self._pitch, yaw)

        # over ground: the motion lies in the plane of the ground; height follows it
        c, s = math.cos(yaw), math.sin(yaw)
        forward = u2 * cos_pitch + v2 * sin_roll * sin_pitch
        right = v2 * cos_roll
        self.vn_m_s, self.ve_m_s = c * forward - s * right, s * forward + c * right
        self.vd_m_s = -self._climb
        self.north_m += dt * self.vn_m_s
        self.east_m += dt * self.ve_m_s
        self.down_m = -self._height_m
        jx, jy = self._jolt
        self._jolt = (0.0, 0.0)
        self.ax_m_s2, self.ay_m_s2, self.az_m_s2 = ax - gx + jx, ay - gy + jy, az - gz
        self._look_at_ground()

    # --- contacts: see dynamics.Dynamics; what has wheels is pushed along the ground and turned about its yaw -----

    def velocity_at(self, arm: Vector3) -> Vector3:
        """See Dynamics."""
        return self.vn_m_s - self.r_rad_s * arm[1], self.ve_m_s + self.r_rad_s * arm[0], self.vd_m_s

    def mobility(self, arm: Vector3, direction: Vector3) -> float:
        """See Dynamics."""
        lever = arm[0] * direction[1] - arm[1] * direction[0]
        return 1.0 / self._mass + lever * lever / self._izz

    def push(self, arm: Vector3, impulse: Vector3) -> None:
        """See Dynamics."""
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        n, e = impulse[0] / self._mass, impulse[1] / self._mass
        x, y = c * n + s * e, c * e - s * n
        self._u, self._v = self._u + x, self._v + y
        self.vn_m_s, self.ve_m_s = self.vn_m_s + n, self.ve_m_s + e
        self.r_rad_s += (arm[0] * impulse[1] - arm[1] * impulse[0]) / self._izz
        jx, jy = self._jolt
        self._jolt = (jx + x / STEP_S, jy + y / STEP_S)

    def shift(self, north_m: float, east_m: float, down_m: float) -> None:
        """See Dynamics; it stays on the ground."""
        self.north_m, self.east_m = self.north_m + north_m, self.east_m + east_m
        self._look_at_ground()

    def wreck(self) -> None:
        """See Dynamics."""
        self.wrecked = True

    def _tyres(self, u: float, v: float, r: float, tan_delta: float, gy: float, load: float) -> tuple[float, float]:
        """(v, r) after a step; implicit in both."""
        chassis, dt, mass, izz = self._chassis, STEP_S, self._mass, self._izz
        a, b = self._front, self._rear
        k = dt * chassis.cornering_stiffness_n_rad / max(abs(u), SLIP_SPEED_M_S)
        m11, m12 = mass + 2.0 * k, k * (a - b) + dt * mass * u
        m21, m22 = k * (a - b), izz + k * (a * a + b * b)
        steer = k * u * tan_delta
        b1, b2 = mass * (v + dt * gy) + steer, izz * r + a * steer
        inverse = 1.0 / (m11 * m22 - m12 * m21)
        v2, r2 = (b1 * m22 - m12 * b2) * inverse, (m11 * b2 - m21 * b1) * inverse
        # what the tyres did (as impulses), and whether they can
        front, rear = -k * (v2 + a * r2 - u * tan_delta), -k * (v2 - b * r2)
        grip = dt * chassis.tyre_friction * load / chassis.wheelbase_m
        if abs(front) > grip * b or abs(rear) > grip * a:
            front, rear = _within(front, grip * b), _within(rear, grip * a)
            v2 = v + dt * (gy - u * r) + (front + rear) / mass
            r2 = r + (a * front - b * rear) / izz
        return v2, r2

    def _look_at_ground(self) -> None:
        """Take the plane under the wheels anew when the rover has moved 2 cm or turned accordingly."""
        north, east, yaw = self.north_m, self.east_m, self._yaw
        north0, east0, yaw0 = self._ground_at
        if abs(north - north0) + abs(east - east0) + 0.5 * abs(yaw - yaw0) < GROUND_FRESH_M:
            return
        self._ground_at = (north, east, yaw)
        c, s = math.cos(yaw), math.sin(yaw)
        a, b, half = self._front, self._rear, 0.5 * self._chassis.track_m
        height = self._height
        wheels = [
            height(north + c * x - s * y, east + s * x + c * y) for x in (a, -b) for y in (-half, half)
        ]  # front left, front right, rear left, rear right
        front, rear = 0.5 * (wheels[0] + wheels[1]), 0.5 * (wheels[2] + wheels[3])
        forward = (front - rear) / (a + b)
        right = 0.5 * (wheels[1] + wheels[3] - wheels[0] - wheels[2]) / (2.0 * half)
        roll, pitch = slope_angles(forward * c - right * s, forward * s + right * c, yaw)
        axles = rear + forward * b
        self._ground = (axles + self._chassis.centre_height_m * math.cos(pitch) * math.cos(roll), roll, pitch)


def _within(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value
