"""Position and velocity control of a multicopter: from a trajectory setpoint to a thrust vector.

PX4's PositionControl and ControlMath (src/modules/mc_pos_control/PositionControl, v1.18): position P, velocity PID on
acceleration, thrust direction by acceleration, tilt limit, thrust limits with priority for the vertical, a horizontal
margin, and anti-windup. Pure maths on scalars: no topics, no time but dt.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.topics import NAN, NAN3, Quaternion, TrajectorySetpoint, Vector3

GRAVITY_M_S2: Final = 9.80665
SMALLEST: Final = 1e-6
LEAST_THRUST: Final = 0.001
"""Whatever MPC_THR_MIN is: a thrust of none has no direction that tells an attitude (setThrustLimits)."""
BLIND_DESCENT_M_S2: Final = 0.3
LEAST_HOVER_THRUST, MOST_HOVER_THRUST = 0.05, 0.9
"""PositionControl.hpp's HOVER_THRUST_MIN and _MAX."""


class PositionControlGains(NamedTuple):
    """MPC_XY_P, MPC_Z_P, MPC_{XY,Z}_VEL_{P,I,D}_ACC, MPC_THR_XY_MARG, MPC_ACC_DECOUPLE."""

    xy_p: float
    z_p: float
    xy_vel_p: float
    xy_vel_i: float
    xy_vel_d: float
    z_vel_p: float
    z_vel_i: float
    z_vel_d: float
    thrust_xy_margin: float
    decouple: bool


class Limits(NamedTuple):
    """Speeds (m/s, positive), thrust (0..1), tilt (rad)."""

    speed_xy: float
    speed_up: float
    speed_down: float
    thrust_min: float
    thrust_max: float
    tilt: float


class States(NamedTuple):
    """Where the vehicle is: NED position, velocity and its derivative, NaN where unknown; yaw."""

    position: Vector3
    velocity: Vector3
    acceleration: Vector3
    yaw: float


class PositionControl:
    """The cascade; `velocity_sp`, `acceleration_sp` and `thrust_sp` tell what the last update came to."""

    def __init__(self) -> None:
        self.velocity_sp: Vector3 = NAN3
        self.acceleration_sp: Vector3 = NAN3
        self.thrust_sp: Vector3 = (0.0, 0.0, 0.0)
        self.hover_thrust = 0.5
        self._int_n = self._int_e = self._int_d = 0.0

    def reset_integral(self) -> None:
        """Forget what the velocity integrators have learnt."""
        self._int_n = self._int_e = self._int_d = 0.0

    def reset_integral_xy(self) -> None:
        """The same of the horizontal ones, while nothing controls that velocity."""
        self._int_n = self._int_e = 0.0

    def update_hover_thrust(self, hover_thrust: float) -> None:
        """Take a new hover thrust and change the vertical integrator so that the thrust stays what it was."""
        previous = self.hover_thrust
        self.hover_thrust = hover_thrust = max(LEAST_HOVER_THRUST, min(MOST_HOVER_THRUST, hover_thrust))
        acceleration = self.acceleration_sp[2]
        if acceleration == acceleration:
            self._int_d += (acceleration - GRAVITY_M_S2) * previous / hover_thrust + GRAVITY_M_S2 - acceleration

    def update(
        self, setpoint: TrajectorySetpoint, states: States, gains: PositionControlGains, limits: Limits, dt: float
    ) -> Vector3:
        """The thrust vector (NED, normalised, hover is (0, 0, -hover_thrust)); `setpoint` has to be `complete`."""
        xy_p, z_p, pxy, ixy, dxy, pz, iz, dz, margin, decouple = gains
        speed_xy, speed_up, speed_down, thrust_min, thrust_max, tilt_max = limits
        thrust_min = max(thrust_min, LEAST_THRUST)
        (sn, se, sd), (vn, ve, vd), (an, ae, ad) = setpoint.position, setpoint.velocity, setpoint.acceleration
        (pn, pe, pd), (un, ue, ud), (dn, de, dd) = states.position, states.velocity, states.acceleration
        # Position: what it asks for has priority over the feed-forward where both exceed the speed limit.
        if sn == sn:
            gn, ge = (sn - pn) * xy_p, (se - pe) * xy_p
            vn, ve = (vn, ve) if vn == vn else (0.0, 0.0)
            vn, ve = constrain_xy(gn, ge, vn, ve, speed_xy)
        elif vn == vn:
            vn, ve = constrain_xy(0.0, 0.0, vn, ve, speed_xy)
        if sd == sd:
            gd = (sd - pd) * z_p
            vd = gd + vd if vd == vd else gd
        if vd == vd:
            vd = -speed_up if vd < -speed_up else (speed_down if vd > speed_down else vd)
        self.velocity_sp = (vn, ve, vd)
        # Velocity
        en, ee, ed = vn - un, ve - ue, vd - ud
        if en == en:
            bn, be = en * pxy + self._int_n - dn * dxy, ee * pxy + self._int_e - de * dxy
            an, ae = (an + bn, ae + be) if an == an else (bn, be)
        else:
            en = ee = 0.0
        if ed == ed:
            bd = ed * pz + max(-GRAVITY_M_S2, min(GRAVITY_M_S2, self._int_d)) - dd * dz
            ad = ad + bd if ad == ad else bd
        else:
            ed = 0.0
        self.acceleration_sp = (an, ae, ad)
        tn, te, td = self._thrust(an, ae, ad, tilt_max, thrust_min, decouple)
        # Anti-windup in the vertical
        if (td >= -thrust_min and ed >= 0.0) or (td <= -thrust_max and ed <= 0.0):
            ed = 0.0
        # The vertical comes first, but leaves the horizontal its margin
        xy = math.hypot(tn, te)
        spared = min(xy, margin)
        td = max(td, -math.sqrt(max(thrust_max * thrust_max - spared * spared, 0.0)))
        xy_max = math.sqrt(max(thrust_max * thrust_max - td * td, 0.0))
        if xy > xy_max:
            tn, te = tn / xy * xy_max, te / xy * xy_max
        # Anti-windup in the horizontal: track what was produced
        produced = GRAVITY_M_S2 / self.hover_thrust
        produced_n, produced_e = tn * produced, te * produced
        if an * an + ae * ae > produced_n * produced_n + produced_e * produced_e:
            back = 2.0 / pxy if pxy > 0.0 else 0.0
            en -= back * (an - produced_n)
            ee -= back * (ae - produced_e)
        self._int_n += en * ixy * dt
        self._int_e += ee * ixy * dt
        self._int_d = max(-GRAVITY_M_S2, min(GRAVITY_M_S2, self._int_d + ed * iz * dt))
        self.thrust_sp = (tn, te, td)
        return self.thrust_sp

    def _thrust(
        self, an: float, ae: float, ad: float, tilt_max: float, thrust_min: float, decouple: bool
    ) -> tuple[float, float, float]:
        hover = self.hover_thrust
        force_up = GRAVITY_M_S2 if decouple else GRAVITY_M_S2 - ad
        xy = math.hypot(an, ae)
        tilt = math.atan2(xy, force_up)
        if tilt > tilt_max:
            tilt = tilt_max
        cos_tilt = math.cos(tilt)
        vertical = ad * (hover / GRAVITY_M_S2) - hover
        collective = max(-vertical / cos_tilt, thrust_min)
        if xy < SMALLEST:
            # Exactly upside down, as on the ground with MPC_ACC_DECOUPLE 0, it leans (ControlMath::limitTilt)
            north = -collective * math.sin(tilt) if force_up < 0.0 else 0.0
            return north, 0.0, -collective * cos_tilt
        across = collective * math.sin(tilt) / xy
        return an * across, ae * across, -collective * cos_tilt


def complete(setpoint: TrajectorySetpoint, states: States) -> bool:
    """Whether every axis has something to follow, and the state that this needs is known."""
    (sn, se, sd), (vn, ve, vd), (an, ae, ad) = setpoint.position, setpoint.velocity, setpoint.acceleration
    pn, _, pd = states.position
    un, _, ud = states.velocity
    if not (sn == sn or vn == vn or an == an) or not (sd == sd or vd == vd or ad == ad):
        return False
    if (sn == sn) != (se == se) or (vn == vn) != (ve == ve) or (an == an) != (ae == ae):
        return False
    if (sn == sn and pn != pn) or (sd == sd and pd != pd):
        return False
    return (un == un or not (sn == sn or vn == vn)) and (ud == ud or not (sd == sd or vd == vd))


def failsafe_setpoint(states: States, land_speed_m_s: float) -> TrajectorySetpoint:
    """What is flown when a setpoint cannot be (generateFailsafeSetpoint): stop and wait; sink where it cannot stop.

    Without a horizontal velocity it keeps level, without a vertical one it sinks by a bit less than hover thrust.
    """
    vn, _, vd = states.velocity
    stops, knows_climb = vn == vn, vd == vd
    xy, level = (0.0, NAN) if stops else (NAN, 0.0)
    if not knows_climb:
        return TrajectorySetpoint(0, NAN3, (xy, xy, NAN), (level, level, BLIND_DESCENT_M_S2))
    return TrajectorySetpoint(0, NAN3, (xy, xy, 0.0 if stops else land_speed_m_s), (level, level, NAN))


def constrain_xy(n0: float, e0: float, n1: float, e1: float, largest: float) -> tuple[float, float]:
    """(n0, e0) + (n1, e1), no longer than `largest`; the first has priority, the second gets what is left."""
    n, e = n0 + n1, e0 + e1
    if n * n + e * e <= largest * largest:
        return n, e
    first = math.hypot(n0, e0)
    if first >= largest:
        if first <= 0.0 or largest <= 0.0:
            return 0.0, 0.0
        return n0 / first * largest, e0 / first * largest
    second = math.hypot(n1, e1)
    if math.hypot(n1 - n0, e1 - e0) < 0.001:
        return n0 / first * largest, e0 / first * largest
    if first < 0.001:
        return n1 / second * largest, e1 / second * largest
    un, ue = n1 / second, e1 / second
    along = un * n0 + ue * e0
    rest = first * first - largest * largest
    scale = -along + math.sqrt(along * along - rest)
    return n0 + un * scale, e0 + ue * scale


def attitude_of_thrust(thrust: Vector3, yaw: float) -> tuple[Quaternion, float]:
    """Attitude whose up is along a thrust vector (NED) and whose heading is `yaw`, and the thrust's size."""
    tn, te, td = thrust
    size = math.sqrt(tn * tn + te * te + td * td)
    if size < SMALLEST:
        return (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)), 0.0
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    zx, zy, zz = -tn / size, -te / size, -td / size
    # body x: perpendicular to body z, in the vertical plane of the heading
    xx, xy, xz = cos_yaw * zz, sin_yaw * zz, -(cos_yaw * zx + sin_yaw * zy)
    if zz < 0.0:
        xx, xy, xz = -xx, -xy, -xz
    length = math.sqrt(xx * xx + xy * xy + xz * xz)
    if length < SMALLEST:
        xx, xy, xz, length = 0.0, 0.0, 1.0, 1.0
    xx /= length
    xy /= length
    xz /= length
    yx, yy, yz = zy * xz - zz * xy, zz * xx - zx * xz, zx * xy - zy * xx
    return from_matrix(xx, yx, zx, xy, yy, zy, xz, yz, zz), size


def from_matrix(
    m00: float, m01: float, m02: float, m10: float, m11: float, m12: float, m20: float, m21: float, m22: float
) -> Quaternion:
    """Quaternion of a rotation matrix (Shepperd's method)."""
    trace = m00 + m11 + m22
    if trace > 0.0:
        s = math.sqrt(trace + 1.0)
        k = 0.5 / s
        return 0.5 * s, (m21 - m12) * k, (m02 - m20) * k, (m10 - m01) * k
    if m00 >= m11 and m00 >= m22:
        s = math.sqrt(m00 - m11 - m22 + 1.0)
        k = 0.5 / s
        return (m21 - m12) * k, 0.5 * s, (m01 + m10) * k, (m02 + m20) * k
    if m11 >= m22:
        s = math.sqrt(m11 - m22 - m00 + 1.0)
        k = 0.5 / s
        return (m02 - m20) * k, (m01 + m10) * k, 0.5 * s, (m12 + m21) * k
    s = math.sqrt(m22 - m00 - m11 + 1.0)
    k = 0.5 / s
    return (m10 - m01) * k, (m02 + m20) * k, (m12 + m21) * k, 0.5 * s
