"""PX4's SIH Ackermann rover, so that the reference rover drives here as PX4 drives there.

Behaviour: src/modules/simulation/simulator_sih/sih.cpp of PX4 v1.18, its rover dynamics, and what flights of it show.
Body x forward, y right; v = (vx, vy) in the body frame, r the yaw rate, u₀ steering and u₁ throttle after a common lag:

- F_x = F_max u₁;  steering angle δ = δ_max u₀
- rolling (|vx| > 0.05):  F_y = C δ - m |vx| r - 2 C vy/|vx|;  M_z = L C δ - C L² r/|vx|;  else both 0
- friction: rolling μ_r m g along -v; between 0.01 and 0.05 m/s kinetic, or what stops it when nothing pushes; below
  that, static friction takes away up to μ_s m g of the push
- drag: k_v v², squared *per axis of the Earth-fixed frame*: the same throttle drives 3.0 m/s north and 2.55 m/s east
- ω̇ = (M_z - k_w r)/I_z

It stands level, whatever the terrain: SIH's ground is flat. A step is SIH's: explicit Euler over 4 ms (IMU_INTEG_RATE
250 in init.d-posix/px4-rc.simulator). That is too long for the slip of a rover that hardly rolls ahead, which
overshoots from step to step, and so it does here: it is what makes PX4's rover wander where it stands.
The lag counts once for every output that comes (Sih::read_motors), not for the time that has passed: with a rover's
100 Hz it is 2.5 times as long as SIH_T_TAU says, and where no output comes, because the vehicle is disarmed, nothing
changes.
"""

import math
from typing import Final

from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import STEP_S, Dynamics, Height, Quaternion, Vector3

ROLLING_M_S: Final = 0.05
STATIC_M_S: Final = 0.01
FRICTION_GRAVITY_M_S2: Final = 9.81
"""Of Sih::generate_rover_ackermann_dynamics, wherever the vehicle is."""
FASTEST_RAD_S: Final = 6.0 * math.pi
"""Sih::equations_of_motion."""
FASTEST_M_S: Final = 50.0
"""Ours: what overshoots stays within."""


class SihAckermann(Dynamics):
    """State and step of the rover. controls: (steering -1..1, throttle -1..1)."""

    def __init__(
        self,
        vehicle: Vehicle,
        height: Height,
        north_m: float = 0.0,
        east_m: float = 0.0,
        yaw_rad: float = 0.0,
        gravity_m_s2: float = 9.80665,
        lat_deg: float = 0.0,
        lon_deg: float = 0.0,
    ) -> None:
        """`lat_deg`, `lon_deg`: the world's origin, which matters for the drag. ValueError for another vehicle."""
        if vehicle.sih_rover is None:
            raise ValueError(f"{vehicle.model} is no SIH rover")
        self._rover = vehicle.sih_rover
        self._mass, self._izz = vehicle.mass_kg, vehicle.inertia_kg_m2[2]
        self._height = height
        lat, lon = math.radians(lat_deg), math.radians(lon_deg)
        # rows: Earth-fixed axes in north and east components
        self._earth = (
            (-math.sin(lat) * math.cos(lon), -math.sin(lon)),
            (-math.sin(lat) * math.sin(lon), math.cos(lon)),
            (math.cos(lat), 0.0),
        )
        self._lag = STEP_S / self._rover.thrust_time_constant_s
        self._steering = self._throttle = 0.0
        self._yaw = yaw_rad
        self.north_m, self.east_m, self.down_m = north_m, east_m, -height(north_m, east_m)
        self.vn_m_s = self.ve_m_s = self.vd_m_s = 0.0
        self.q: Quaternion = (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))
        self.p_rad_s = self.q_rad_s = self.r_rad_s = 0.0
        self.ax_m_s2 = self.ay_m_s2 = 0.0
        self.az_m_s2 = -gravity_m_s2
        self.power_w = 0.0
        self.running = False
        self.drive = 1.0
        self.wrecked = False

    def motor_speeds(self) -> tuple[float, ...]:
        """Of the motor, over the greatest, as SIH's speed controller tells it: never backwards."""
        return (math.sqrt(max(0.0, min(1.0, self._throttle))),)

    def step(self, controls: tuple[float, ...], wind_n_m_s: float, wind_e_m_s: float, wind_d_m_s: float) -> None:
        """Advance by 4 ms; too few controls: none came. The rover's drag does not know wind, as SIH's does not."""
        if len(controls) >= 2 and not self.wrecked:
            self._steering += self._lag * (controls[0] - self._steering)
            self._throttle += self._lag * (controls[1] - self._throttle)
        fx, fy = self._move(STEP_S)
        self.ax_m_s2, self.ay_m_s2 = fx / self._mass, fy / self._mass
        down = -self._height(self.north_m, self.east_m)
        self.vd_m_s, self.down_m = (down - self.down_m) / STEP_S, down
        half = 0.5 * self._yaw
        self.q = (math.cos(half), 0.0, 0.0, math.sin(half))

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
        self.vn_m_s += impulse[0] / self._mass
        self.ve_m_s += impulse[1] / self._mass
        self.r_rad_s += (arm[0] * impulse[1] - arm[1] * impulse[0]) / self._izz

    def shift(self, north_m: float, east_m: float, down_m: float) -> None:
        """See Dynamics; it stays on the ground."""
        self.north_m, self.east_m = self.north_m + north_m, self.east_m + east_m

    def wreck(self) -> None:
        """See Dynamics."""
        self.wrecked = True
        self._steering = self._throttle = 0.0

    def _move(self, dt: float) -> tuple[float, float]:
        """Advance by `dt` s; the sum of forces in the body frame."""
        rover, mass = self._rover, self._mass
        weight = mass * FRICTION_GRAVITY_M_S2
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        vn, ve, r = self.vn_m_s, self.ve_m_s, self.r_rad_s
        vx, vy = c * vn + s * ve, c * ve - s * vn
        push = rover.throttle_force_max_n * self._throttle
        side = moment = 0.0
        rolling = abs(vx)
        if rolling > ROLLING_M_S:
            steer = rover.steer_angle_max_rad * self._steering
            stiffness, length = rover.cornering_stiffness_n_rad, rover.wheelbase_m
            side = stiffness * steer - mass * rolling * r - 2.0 * stiffness * vy / rolling
            moment = length * stiffness * steer - stiffness * length * length * r / rolling
        fx, fy = push, side
        self.running = abs(push) + abs(side) > 1e-7
        speed = math.sqrt(vn * vn + ve * ve)
        if speed < STATIC_M_S:
            hold = rover.static_friction * weight
            fx, fy = fx - _within(fx, hold), fy - _within(fy, hold)
            fn, fe = c * fx - s * fy, s * fx + c * fy
        else:
            fn, fe = c * fx - s * fy, s * fx + c * fy
            if speed >= ROLLING_M_S:
                k = rover.rolling_friction * weight / speed
                for north, east in self._earth:
                    along = north * vn + east * ve
                    drag = rover.kdv * along * abs(along)
                    fn, fe = fn - drag * north, fe - drag * east
            else:
                k = rover.kinetic_friction * weight / speed if self.running else mass / dt
            fn, fe = fn - k * vn, fe - k * ve
        vn2 = _within(vn + dt * fn / mass, FASTEST_M_S)
        ve2 = _within(ve + dt * fe / mass, FASTEST_M_S)
        self.north_m += 0.5 * dt * (vn + vn2)
        self.east_m += 0.5 * dt * (ve + ve2)
        self.vn_m_s, self.ve_m_s = vn2, ve2
        self.r_rad_s = _within(r + dt * (moment - rover.kdw * r) / self._izz, FASTEST_RAD_S)
        self._yaw = math.remainder(self._yaw + dt * r, math.tau)
        return c * fn + s * fe, c * fe - s * fn


def _within(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value
