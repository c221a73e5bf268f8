"""PX4's SIH Ackermann rover, so that the reference rover drives here as PX4 drives there.

Behaviour: src/modules/simulation/simulator_sih/sih.cpp of PX4 v1.18, its rover dynamics, and what flights of it show.
Body x forward, y right; v = (vx, vy) in the body frame, r the yaw rate, u₀ steering and u₁ throttle after a common lag:

- F_x = F_max u₁;  steering angle δ = δ_max u₀
- rolling (|vx| > 0.05):  F_y = C δ - m |vx| r - 2 C vy/|vx|;  M_z = L C δ - C L² r/|vx|;  else both 0
- friction: rolling μ_r m g along -v; between 0.01 and 0.05 m/s kinetic, or what stops it when nothing pushes; below
  that, static friction takes away up to μ_s m g of the push
- drag: k_v v², squared *per axis of the Earth-fixed frame*: the same throttle drives 3.0 m/s north and 2.55 m/s east
- ω̇ = (M_z - k_w r)/I_z
- ground (Sih::equations_of_motion): below its start it holds the rover while the forces on it press down: it stops its
  fall once, and bears these forces from then on. What the Earth's turning does, -2 ω cos φ times the speed east, is
  none of them: on its way east the rover rises, until it is above its start and falls anew; on its way west it sinks

Friction is along all of its velocity, also down. Hence a rover that nothing pushes can fall: see `rounds_away`.
It stands level, whatever the terrain: SIH's ground is flat. A step is SIH's: explicit Euler over 4 ms (IMU_INTEG_RATE
250 in init.d-posix/px4-rc.simulator). That is too long for the slip of a rover that hardly rolls ahead, which
overshoots from step to step, and so it does here: it is what makes PX4's rover wander where it stands.
The lag counts once for every output that comes (Sih::read_motors), not for the time that has passed: with a rover's
100 Hz it is 2.5 times as long as SIH_T_TAU says, and where no output comes, because the vehicle is disarmed, nothing
changes.
"""

import math
from typing import Final

from sitl_emu.core.c_types import float32, product
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
EARTH_SPIN_RATE: Final = 7.2921150e-5
"""CONSTANTS_EARTH_SPIN_RATE of src/lib/geo/geo.h, rad/s."""
ROUNDING_N: Final = 1e-4
"""Ours: forces that differ by less than this cancel in SIH's float32, and what is left of them is chance."""
STEPS_TO_CATCH: Final = 10
"""Ours: what SIH's ground catches, it catches within three or so."""


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
        self._place = lat_deg, lon_deg, gravity_m_s2
        self.describe(vehicle)
        self._height = height
        lat, lon = math.radians(lat_deg), math.radians(lon_deg)
        # rows: Earth-fixed axes in north, east and down components
        self._earth = (
            (-math.sin(lat) * math.cos(lon), -math.sin(lon), -math.cos(lat) * math.cos(lon)),
            (-math.sin(lat) * math.sin(lon), math.cos(lon), -math.cos(lat) * math.sin(lon)),
            (math.cos(lat), 0.0, -math.sin(lat)),
        )
        self._turning = -2.0 * EARTH_SPIN_RATE * math.cos(lat)
        self._depth_m = self._sinking_m_s = 0.0
        self._is_held = False
        self._steering = self._throttle = 0.0
        self._yaw = yaw_rad
        self._ground_m = -height(north_m, east_m)
        self.north_m, self.east_m, self.down_m = north_m, east_m, self._ground_m
        self.vn_m_s = self.ve_m_s = self.vd_m_s = 0.0
        self.q: Quaternion = (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))
        self.p_rad_s = self.q_rad_s = self.r_rad_s = 0.0
        self.ax_m_s2 = self.ay_m_s2 = 0.0
        self.az_m_s2 = -gravity_m_s2
        self.power_w = 0.0
        self.running = False
        self.drive = 1.0
        self.wrecked = False

    def describe(self, vehicle: Vehicle) -> None:
        """See Dynamics. ValueError for what is no SIH rover."""
        if vehicle.sih_rover is None:
            raise ValueError(f"{vehicle.model} is no SIH rover")
        self._rover = vehicle.sih_rover
        self._mass, self._izz = vehicle.mass_kg, vehicle.inertia_kg_m2[2]
        self._weight = self._mass * self._place[2]
        self._falls = rounds_away(*self._place, self._mass)
        self._lag = STEP_S / self._rover.thrust_time_constant_s

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
        ground = -self._height(self.north_m, self.east_m)
        self.vd_m_s = self._sinking_m_s + (ground - self._ground_m) / STEP_S
        self._ground_m, self.down_m = ground, ground + self._depth_m
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
        """See Dynamics; it stays as high as it is."""
        self.north_m, self.east_m = self.north_m + north_m, self.east_m + east_m

    def wreck(self) -> None:
        """See Dynamics."""
        self.wrecked = True
        self._steering = self._throttle = 0.0

    def _move(self, dt: float) -> tuple[float, float]:
        """Advance by `dt` s; the sum of forces ahead and to the right, in the body frame."""
        rover, mass = self._rover, self._mass
        weight = mass * FRICTION_GRAVITY_M_S2
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        vn, ve, vd, r = self.vn_m_s, self.ve_m_s, self._sinking_m_s, self.r_rad_s
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
        fd = 0.0
        speed = math.sqrt(vn * vn + ve * ve + vd * vd)
        if speed < STATIC_M_S:
            hold = rover.static_friction * weight
            fx, fy = fx - _within(fx, hold), fy - _within(fy, hold)
            fn, fe = c * fx - s * fy, s * fx + c * fy
        else:
            fn, fe = c * fx - s * fy, s * fx + c * fy
            if speed >= ROLLING_M_S:
                k = rover.rolling_friction * weight / speed
                for north, east, down in self._earth:
                    along = north * vn + east * ve + down * vd
                    drag = rover.kdv * along * abs(along)
                    fn, fe, fd = fn - drag * north, fe - drag * east, fd - drag * down
            else:
                k = rover.kinetic_friction * weight / speed if self.running else mass / dt
            fn, fe, fd = fn - k * vn, fe - k * ve, fd - k * vd
        self._fall(dt, fd)
        vn2 = _within(vn + dt * fn / mass, FASTEST_M_S)
        ve2 = _within(ve + dt * fe / mass, FASTEST_M_S)
        self.north_m += 0.5 * dt * (vn + vn2)
        self.east_m += 0.5 * dt * (ve + ve2)
        self.vn_m_s, self.ve_m_s = vn2, ve2
        self.r_rad_s = _within(r + dt * (moment - rover.kdw * r) / self._izz, FASTEST_RAD_S)
        self._yaw = math.remainder(self._yaw + dt * r, math.tau)
        return c * fn + s * fe, c * fe - s * fn

    def _fall(self, dt: float, friction: float) -> None:
        """Up and down, by `dt` s, with friction and drag along down (N)."""
        mass, sinking = self._mass, self._sinking_m_s
        force_down = self._weight + friction
        if abs(force_down) < ROUNDING_N:
            force_down = 0.0 if self._falls else ROUNDING_N
        was_held, self._is_held = self._is_held, self._depth_m > 0.0 and force_down > 0.0
        force = friction
        if self._is_held:
            force = -self._weight if was_held else -self._weight - mass * sinking / dt
        self.az_m_s2 = force / mass
        self._sinking_m_s += dt * ((force + self._weight) / mass + self._turning * self.ve_m_s)
        self._depth_m += 0.5 * dt * (sinking + self._sinking_m_s)


def rounds_away(lat_deg: float, lon_deg: float, gravity_m_s2: float, mass_kg: float) -> bool:
    """Whether the force with which SIH's rover, standing there from boot, presses on the ground is rounded away.

    It first falls for a step, as it is not below its start. From then on friction stops it as if nothing else acted,
    which takes away just what its weight gives it in a step: no force is left for the ground to hold, and the rover
    sinks at g dt, 0.039 m/s, until it is driven. What SIH's float32 leaves of the two mostly lets the ground catch it,
    and in about one place of ten does not; PX4's default home is such a place. Where nothing decides but zeros, on the
    equator at 0° E, this says that it falls, and SIH's does not.
    """
    lat, lon = math.radians(float32(lat_deg)), math.radians(float32(lon_deg))
    down = (-math.cos(lat) * math.cos(lon), -math.cos(lat) * math.sin(lon), -math.sin(lat))
    weight = [product(product(axis, gravity_m_s2), mass_kg) for axis in down]
    spin, per_kg, per_s = float32(EARTH_SPIN_RATE), float32(1.0 / mass_kg), float32(1.0 / float32(STEP_S))
    velocity = [0.0, 0.0, 0.0]
    for _ in range(STEPS_TO_CATCH):
        friction = [product(product(v, mass_kg), per_s) for v in velocity]
        force = [float32(w - f) for w, f in zip(weight, friction, strict=True)]
        force_down = 0.0
        for axis, along in zip(down, force, strict=True):
            force_down = float32(force_down + product(axis, along))
        if any(velocity) and force_down > 0.0:
            return False
        turning = (product(2.0, product(spin, velocity[1])), -product(2.0, product(spin, velocity[0])), 0.0)
        rates = [float32(product(f, per_kg) + t) for f, t in zip(force, turning, strict=True)]
        velocity = [float32(v + product(rate, STEP_S)) for v, rate in zip(velocity, rates, strict=True)]
    return True


def _within(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value
