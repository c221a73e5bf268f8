"""A multicopter: rigid body with six degrees of freedom, in scalars, one semi-implicit step of 4 ms.

Equations (body FRD, world NED, q body to NED, R its matrix):

- rotor i: u̇ᵢ = (d cᵢ - uᵢ)/τ (cᵢ the control 0..1, d what the battery's voltage leaves, uᵢ speed over greatest speed),
  thrust Tᵢ = T_max uᵢ², reaction torque κ Tᵢ (positive yaw for a ccw rotor)
- moment: M = Σ (-yᵢ Tᵢ, xᵢ Tᵢ, ±κ Tᵢ) - ω × (I ω + h e_z) - k_ω ω + ground, with h = Σ ±J Ω uᵢ of the rotors
- drag by body axis, of the velocity v_a against the air: F = -(k₁ + k₂ |v_a|) v_a
- ω' = ω + dt I⁻¹ M;  q' = q ⊗ (1, ω' dt/2), normalised
- v' = v + dt (R f + g e_z), f = (thrust + drag + ground)/m being what the accelerometer feels;  p' = p + dt (v + v')/2

Ground: the gear's feet make a plane `height_m` below the centre of mass. In contact, a spring-damper along the
ground's normal (natural frequency GEAR_RAD_S, so that standing gives way by 11 mm), Coulomb friction that holds what
it can hold (a vehicle at rest stays exactly where it is, on a slope too), and moments that turn the gear's plane onto
the ground as far as the load on it reaches (load · half the stance). SIH's own (`gear.is_px4s`,
Sih::equations_of_motion): below the ground, and as long as the forces on it point down, the vehicle is held where it
is, whatever its attitude does; the first step takes all its speed. One that brakes as it comes down sinks in.

A parcel on the release moves the centre of mass by c from the origin of the body, which stays where the centre of mass
is without it (rotors, gear, sensors and what is reported are told from there). Then m, I are those of both; forces of
rotors and air have the moment M - c × F about the centre of mass; its velocity v + R (ω × c) is what F and g change,
and what is left of it after the step without R' (ω' × c) is v'. Its drag is added to the vehicle's, at sea level's
density. Let go, both go on as they were: the momentum of the two together does not change.
Not modelled: ground effect, blade flapping, vortex ring, feet one by one.
PX4 for comparison: src/modules/simulation/simulator_sih (v1.18); `sihsim_hex` is its hexacopter, with its numbers.
"""

import math
from typing import Final

from sitl_emu.core.attitude import quaternion, rotated, rotation
from sitl_emu.vehicles import rigid_body
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import STEP_S, Dynamics, Height, Quaternion, Surface, Vector3, slope, slope_angles
from sitl_emu.vehicles.inertia import laden

GEAR_RAD_S: Final = 30.0
GEAR_DAMPING: Final = 1.0
CLOSING_M_S: Final = 40.0
"""Faster than any vehicle meets the ground: how long the height above it need not be asked for."""
SLOPE_REACH_M: Final = 0.3
SLOPE_FRESH_M: Final = 0.1
"""The ground's plane is taken anew when the vehicle has moved so far along it."""
LOOKS_TICKS: Final = 5
"""Where roofs and walls may stand below, the surface is looked for at least this often."""
AIR_KG_M3: Final = 1.225
"""Of the standard atmosphere at sea level, for a parcel's drag."""
CAN_STAND_COS: Final = 0.5
"""A wreck that lies on its side or back is not turned onto its gear: cosine of the tilt from which on."""


class Multicopter(Dynamics):
    """State and step of a multicopter. Starts at rest on the ground.

    `motor_off[i]` stops rotor i, whatever its control says.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        height: Height,
        north_m: float = 0.0,
        east_m: float = 0.0,
        yaw_rad: float = 0.0,
        gravity_m_s2: float = 9.80665,
        surface: Surface | None = None,
    ) -> None:
        """`surface`: what else than the ground may carry it. Raises ValueError for a vehicle without propulsion."""
        self.describe(vehicle)
        gear, rotors = self._gear, len(self._rotors)
        self._height, self._surface = height, surface
        self._gravity = gravity_m_s2
        self._held = False
        self.motor_off = [False] * rotors
        self._still = (0.0,) * rotors
        self.speeds = list(self._still)
        """Rotor speeds over the greatest, 0..1."""
        self.north_m, self.east_m = north_m, east_m
        self.vn_m_s = self.ve_m_s = self.vd_m_s = 0.0
        self.p_rad_s = self.q_rad_s = self.r_rad_s = 0.0
        self.power_w = 0.0
        self.running = False
        self.drive = 1.0
        self.wrecked = False
        self.struck_ground_m_s = 0.0
        """Closing speed of the hardest meeting with the ground so far."""
        self._jolt: Vector3 | None = None
        """Specific force of impulses since the last step, body's axes."""
        self._plane = slope(height, north_m, east_m, SLOPE_REACH_M)
        self._plane_at = (north_m, east_m)
        roll, pitch = slope_angles(self._plane[1], self._plane[2], yaw_rad)
        self.q: Quaternion = quaternion(roll, pitch, yaw_rad)
        normal = 1.0 / math.sqrt(1.0 + self._plane[1] ** 2 + self._plane[2] ** 2)
        # where the gear carries the weight, so that the vehicle starts at rest
        give = 0.0 if gear.is_px4s else gravity_m_s2 / GEAR_RAD_S**2 * normal
        self.down_m = -self._plane[0] - (self._gear_height - give) / normal
        up = from_body_down(self.q)
        self.ax_m_s2, self.ay_m_s2, self.az_m_s2 = (-gravity_m_s2 * component for component in up)
        self._check_in = 0

    def describe(self, vehicle: Vehicle) -> None:
        """From now on it is as heavy, strong and wide as this vehicle, which has as many rotors and its parcel.

        Raises ValueError for a vehicle without propulsion.
        """
        if vehicle.propulsion is None or vehicle.aerodynamics is None or vehicle.gear is None:
            raise ValueError(f"{vehicle.model} is no multicopter")
        propulsion, air, gear = vehicle.propulsion, vehicle.aerodynamics, vehicle.gear
        self._gear = gear
        self._alone = vehicle.mass_kg, vehicle.inertia_kg_m2, air.quadratic_n_s2_m2
        self._mass, offset, self._inertia = laden(vehicle)
        self._offset: Vector3 | None = offset if vehicle.parcel is not None else None
        """The centre of mass, from the body's origin; None: there."""
        self._gear_height = gear.height_m
        self._half_length, self._half_width, self._friction = gear.half_length_m, gear.half_width_m, gear.friction
        self._is_px4s = gear.is_px4s
        x, y, z = air.quadratic_n_s2_m2
        hangs = 0.5 * AIR_KG_M3 * vehicle.parcel.drag_m2 if vehicle.parcel is not None else 0.0
        self._linear, self._quadratic = air.linear_n_s_m, (x + hangs, y + hangs, z + hangs)
        self._has_quadratic = any(self._quadratic)
        self._angular = air.angular_n_m_s
        self._lag = 1.0 - math.exp(-STEP_S / propulsion.time_constant_s)
        self._thrust_max = propulsion.thrust_max_n
        self._power_max = propulsion.power_max_w
        signs = [1.0 if rotor.turns == "ccw" else -1.0 for rotor in propulsion.rotors]
        t_max = propulsion.thrust_max_n
        yaw_arm, momentum = propulsion.torque_per_thrust_m * t_max, propulsion.angular_momentum_max_kg_m2_s
        # a rotor that turns ccw (negative about body z) pushes the body the other way
        self._rotors = [
            (i, -rotor.position_m[1] * t_max, rotor.position_m[0] * t_max, sign * yaw_arm, -sign * momentum)
            for i, (rotor, sign) in enumerate(zip(propulsion.rotors, signs, strict=True))
        ]

    def step(self, controls: tuple[float, ...], wind_n_m_s: float, wind_e_m_s: float, wind_d_m_s: float) -> None:
        """Advance by 4 ms; too few controls count as zeros."""
        # rotors
        speeds, lag, off = self.speeds, self._lag, self.motor_off
        drive = 0.0 if self.wrecked else self.drive
        if len(controls) < len(speeds):
            controls = controls + self._still[len(controls) :]
        lift = mx = my = mz = spin = cubes = 0.0
        for i, roll_arm, pitch_arm, yaw_arm, momentum in self._rotors:
            u = speeds[i]
            u += lag * ((0.0 if off[i] else drive * controls[i]) - u)
            speeds[i] = u
            square = u * u if u >= 0.0 else -u * u  # turned backwards it pushes as hard, downwards (ours)
            lift += square
            cubes += square * u
            spin += momentum * u
            mx += roll_arm * square
            my += pitch_arm * square
            mz += yaw_arm * square
        lift *= self._thrust_max
        self.power_w = cubes * self._power_max
        self.running = lift > 1e-7

        # rotation matrix, body to NED
        w, x, y, z = self.q
        xx, yy, zz = x * x, y * y, z * z
        xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
        r00, r01, r02 = 1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)
        r10, r11, r12 = 2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)
        r20, r21, r22 = 2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)

        # drag against the air, in the body frame
        vn, ve, vd = self.vn_m_s, self.ve_m_s, self.vd_m_s
        an, ae, ad = vn - wind_n_m_s, ve - wind_e_m_s, vd - wind_d_m_s
        kx, ky, kz = self._linear
        if self._has_quadratic:
            speed = math.sqrt(an * an + ae * ae + ad * ad)
            qx, qy, qz = self._quadratic
            kx, ky, kz = kx + qx * speed, ky + qy * speed, kz + qz * speed
        mass = self._mass
        fx = -kx * (r00 * an + r10 * ae + r20 * ad)
        fy = -ky * (r01 * an + r11 * ae + r21 * ad)
        fz = -kz * (r02 * an + r12 * ae + r22 * ad) - lift

        # moments
        p, q, r = self.p_rad_s, self.q_rad_s, self.r_rad_s
        ix, iy, iz = self._inertia
        dx, dy, dz = self._angular
        mx -= dx * p + (iz - iy) * q * r + spin * q
        my -= dy * q + (ix - iz) * p * r - spin * p
        mz -= dz * r + (iy - ix) * p * q
        before = None
        if self._offset is not None:
            cx, cy, cz = self._offset
            mx, my, mz = mx - cy * fz + cz * fy, my - cz * fx + cx * fz, mz - cx * fy + cy * fx
            before = self._swing()

        dt = STEP_S
        fn = r00 * fx + r01 * fy + r02 * fz
        fe = r10 * fx + r11 * fy + r12 * fz
        fd = r20 * fx + r21 * fy + r22 * fz
        self._check_in -= 1
        if self._check_in < 0:
            ground, rise_n, rise_e = self._ground()
            k = 1.0 / math.sqrt(1.0 + rise_n * rise_n + rise_e * rise_e)
            north0, east0 = self._plane_at
            above = -self.down_m - ground - rise_n * (self.north_m - north0) - rise_e * (self.east_m - east0)
            clearance = above * k - self._gear_height
            if clearance > 0.0:
                self._held = False
                self._check_in = int(clearance / (CLOSING_M_S * dt))
                if self._surface is not None:
                    self._check_in = min(self._check_in, LOOKS_TICKS)
            elif self._is_px4s:
                weight = mass * self._gravity
                presses = fd + weight > 0.0
                if presses:
                    stop = 0.0 if self._held else mass / dt
                    if not self._held:
                        self.struck_ground_m_s = max(self.struck_ground_m_s, vd)
                    fn, fe, fd = -stop * vn, -stop * ve, -stop * vd - weight
                self._held = presses
            else:
                # normal of the ground, pointing up, in NED
                nn, ne, nd = -rise_n * k, -rise_e * k, -k
                v_normal = vn * nn + ve * ne + vd * nd
                load = mass * (-clearance * GEAR_RAD_S**2 - 2.0 * GEAR_DAMPING * GEAR_RAD_S * v_normal)
                if load > 0.0:
                    self.struck_ground_m_s = max(self.struck_ground_m_s, -v_normal)
                    fn, fe, fd = fn + load * nn, fe + load * ne, fd + load * nd
                    # friction: what would stop the sliding within this step, if the load allows it
                    tn = mass * vn + dt * fn
                    te = mass * ve + dt * fe
                    td = mass * vd + dt * (fd + mass * self._gravity)
                    along = tn * nn + te * ne + td * nd
                    tn, te, td = tn - along * nn, te - along * ne, td - along * nd
                    slide, hold = math.sqrt(tn * tn + te * te + td * td), self._friction * load * dt
                    if slide > 0.0:
                        grip = (-1.0 if slide <= hold else -hold / slide) / dt
                        fn, fe, fd = fn + grip * tn, fe + grip * te, fd + grip * td
                    # the gear's plane turns onto the ground: error = body z × -normal, in the body frame
                    bx = -(r00 * nn + r10 * ne + r20 * nd)
                    by = -(r01 * nn + r11 * ne + r21 * nd)
                    stiff, damp = GEAR_RAD_S**2, 2.0 * GEAR_DAMPING * GEAR_RAD_S
                    if self.wrecked and -(r02 * nn + r12 * ne + r22 * nd) < CAN_STAND_COS:
                        stiff = 0.0
                    mx += _within(ix * (-stiff * by - damp * p), load * self._half_width)
                    my += _within(iy * (stiff * bx - damp * q), load * self._half_length)
                    mz -= _within(iz * r / dt + mz, self._friction * load * self._half_width)
            if clearance <= 0.0:
                fx = r00 * fn + r10 * fe + r20 * fd
                fy = r01 * fn + r11 * fe + r21 * fd
                fz = r02 * fn + r12 * fe + r22 * fd

        # what an accelerometer feels, then velocity and position
        self.ax_m_s2, self.ay_m_s2, self.az_m_s2 = fx / mass, fy / mass, fz / mass
        if self._jolt is not None:
            jx, jy, jz = self._jolt
            self._jolt = None
            self.ax_m_s2, self.ay_m_s2, self.az_m_s2 = self.ax_m_s2 + jx, self.ay_m_s2 + jy, self.az_m_s2 + jz
        k = dt / mass
        vn2, ve2, vd2 = vn + fn * k, ve + fe * k, vd + fd * k + self._gravity * dt
        self.vn_m_s, self.ve_m_s, self.vd_m_s = vn2, ve2, vd2
        k = 0.5 * dt
        self.north_m += (vn + vn2) * k
        self.east_m += (ve + ve2) * k
        self.down_m += (vd + vd2) * k

        # rates and attitude
        p += dt * mx / ix
        q += dt * my / iy
        r += dt * mz / iz
        self.p_rad_s, self.q_rad_s, self.r_rad_s = p, q, r
        p, q, r = p * k, q * k, r * k
        w2, x2 = w - p * x - q * y - r * z, x + p * w + r * y - q * z
        y2, z2 = y + q * w - r * x + p * z, z + r * w + q * x - p * y
        k = 1.0 / math.sqrt(w2 * w2 + x2 * x2 + y2 * y2 + z2 * z2)
        self.q = (w2 * k, x2 * k, y2 * k, z2 * k)
        if before is not None:
            self._follow(before)

    def drop(self) -> None:
        """Let the parcel go."""
        self._mass, self._inertia, self._quadratic = self._alone
        self._has_quadratic = any(self._quadratic)
        self._offset = None

    def motor_speeds(self) -> list[float]:
        """See Dynamics; SIH's speed controllers tell another (throttle_to_rpm in aero.hpp) than what lifts it."""
        if self._is_px4s:
            return [math.sqrt(max(0.0, min(1.0, speed))) for speed in self.speeds]
        return self.speeds

    # --- contacts: see dynamics.Dynamics ---------------------------------------------------------------------

    def velocity_at(self, arm: Vector3) -> Vector3:
        """See Dynamics."""
        velocity, rates = (self.vn_m_s, self.ve_m_s, self.vd_m_s), (self.p_rad_s, self.q_rad_s, self.r_rad_s)
        return rigid_body.velocity_at(velocity, rates, self.q, arm)

    def mobility(self, arm: Vector3, direction: Vector3) -> float:
        """See Dynamics."""
        return rigid_body.mobility(self.q, self._mass, self._inertia, self._from_centre(arm), direction)

    def push(self, arm: Vector3, impulse: Vector3) -> None:
        """See Dynamics."""
        n, e, d = impulse[0] / self._mass, impulse[1] / self._mass, impulse[2] / self._mass
        before = self._swing() if self._offset is not None else None
        p, q, r = rigid_body.turn(self.q, self._inertia, self._from_centre(arm), impulse)
        self.p_rad_s, self.q_rad_s, self.r_rad_s = self.p_rad_s + p, self.q_rad_s + q, self.r_rad_s + r
        if before is not None:
            after = self._swing()
            n, e, d = n + before[0] - after[0], e + before[1] - after[1], d + before[2] - after[2]
        self.vn_m_s, self.ve_m_s, self.vd_m_s = self.vn_m_s + n, self.ve_m_s + e, self.vd_m_s + d
        x, y, z = to_body(self.q, (n / STEP_S, e / STEP_S, d / STEP_S))
        jx, jy, jz = self._jolt or (0.0, 0.0, 0.0)
        self._jolt = (jx + x, jy + y, jz + z)

    def shift(self, north_m: float, east_m: float, down_m: float) -> None:
        """See Dynamics."""
        self.north_m, self.east_m, self.down_m = self.north_m + north_m, self.east_m + east_m, self.down_m + down_m

    def wreck(self) -> None:
        """See Dynamics: all rotors stop, for good."""
        self.wrecked = True

    def _swing(self) -> Vector3:
        """Velocity (NED) of the centre of mass against the body's origin: R (ω × c)."""
        offset = self._offset or (0.0, 0.0, 0.0)
        return rotated(rotation(self.q), rigid_body.cross((self.p_rad_s, self.q_rad_s, self.r_rad_s), offset))

    def _follow(self, before: Vector3) -> None:
        """What was reckoned as the centre of mass's is the origin's, whose swing has changed from `before`."""
        n, e, d = before
        n2, e2, d2 = self._swing()
        n, e, d = n - n2, e - e2, d - d2
        self.vn_m_s, self.ve_m_s, self.vd_m_s = self.vn_m_s + n, self.ve_m_s + e, self.vd_m_s + d
        half = 0.5 * STEP_S
        self.north_m, self.east_m, self.down_m = self.north_m + half * n, self.east_m + half * e, self.down_m + half * d
        x, y, z = to_body(self.q, (n / STEP_S, e / STEP_S, d / STEP_S))
        self.ax_m_s2, self.ay_m_s2, self.az_m_s2 = self.ax_m_s2 + x, self.ay_m_s2 + y, self.az_m_s2 + z

    def _from_centre(self, arm: Vector3) -> Vector3:
        """An arm (NED) from the centre of mass instead of the body's origin."""
        if self._offset is None:
            return arm
        n, e, d = rotated(rotation(self.q), self._offset)
        return arm[0] - n, arm[1] - e, arm[2] - d

    def _ground(self) -> tuple[float, float, float]:
        """The plane below, at `_plane_at`; the ground's is kept while the vehicle stays near."""
        if self._surface is not None:
            self._plane_at = (self.north_m, self.east_m)
            return self._surface(self.north_m, self.east_m, self.down_m)
        north0, east0 = self._plane_at
        if abs(self.north_m - north0) + abs(self.east_m - east0) > SLOPE_FRESH_M:
            self._plane_at = (self.north_m, self.east_m)
            self._plane = slope(self._height, self.north_m, self.east_m, SLOPE_REACH_M)
        return self._plane


def from_body_down(q: Quaternion) -> tuple[float, float, float]:
    """The world's down axis in the body frame."""
    w, x, y, z = q
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


def to_body(q: Quaternion, vector: Vector3) -> Vector3:
    """A vector (NED) in the body's axes."""
    r = rotation(q)
    n, e, d = vector
    return r[0] * n + r[3] * e + r[6] * d, r[1] * n + r[4] * e + r[7] * d, r[2] * n + r[5] * e + r[8] * d


def _within(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value
