"""Where a multicopter is and is to be, as its position control sees it: the velocity filtered, jumps taken out.

PX4's MulticopterPositionControl::set_vehicle_states (src/modules/mc_pos_control, v1.18): a notch filter of the velocity
(MPC_VEL_NF_FRQ, MPC_VEL_NF_BW), then a low-pass (MPC_VEL_LP); another low-pass of its derivative (MPC_VELD_LP).
A setpoint that is older than a jump of the estimate is moved along (adjustSetpointForEKFResets).
"""

from typing import Final

from sitl_emu.autopilot.control.mc_att_control import FLT_EPSILON
from sitl_emu.autopilot.control.mc_pos_control import States
from sitl_emu.autopilot.estimator.imu_filter import NotchFilter, alpha
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN, TrajectorySetpoint, Vector3, VehicleLocalPosition
from sitl_emu.core.geodesy import wrap_pi

SAMPLE_HZ: Final = 125.0
"""How often local positions come, which PX4 measures."""


class VehicleStates:
    """Filters vehicle_local_position into the states that are controlled."""

    def __init__(self, parameters: Parameters) -> None:
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        self._velocity_derivative: Vector3 = (0.0, 0.0, 0.0)
        self._resets = (0, 0)
        self._notch = (0.0, 0.0)
        self._set_notch(*self._notch)
        self.refresh(parameters)

    def refresh(self, parameters: Parameters) -> None:
        """Copy the parameters: they have changed."""
        self._velocity_cutoff = float(parameters["MPC_VEL_LP"])
        self._velocity_derivative_cutoff = float(parameters["MPC_VELD_LP"])
        notch = float(parameters["MPC_VEL_NF_FRQ"]), float(parameters["MPC_VEL_NF_BW"])
        if notch != self._notch:
            self._set_notch(*notch)

    def _set_notch(self, centre_hz: float, bandwidth_hz: float) -> None:
        self._notch = (centre_hz, bandwidth_hz)
        self._notch_n, self._notch_e, self._notch_d = [NotchFilter(SAMPLE_HZ, *self._notch) for _ in range(3)]

    def update(self, local: VehicleLocalPosition, dt: float) -> States:
        """The states after one more sample."""
        vn, ve, vd = local.vx, local.vy, local.vz
        ln, le, ld = self._velocity
        dn, de, dd = self._velocity_derivative
        if not self._notch_n.through:
            vn, ve, vd = self._notch_n.update(vn), self._notch_e.update(ve), self._notch_d.update(vd)
        if self._velocity_cutoff > 0.0:
            weight = alpha(self._velocity_cutoff, dt)
            vn, ve, vd = ln + weight * (vn - ln), le + weight * (ve - le), ld + weight * (vd - ld)
        weight = alpha(self._velocity_derivative_cutoff, dt)
        self._velocity = velocity = (vn, ve, vd)
        dn += weight * ((vn - ln) / dt - dn)
        de += weight * ((ve - le) / dt - de)
        dd += weight * ((vd - ld) / dt - dd)
        if not (local.v_xy_valid and vn == vn and ve == ve):
            self._velocity, dn, de = (0.0, 0.0, self._velocity[2]), 0.0, 0.0
            self._reset_notch_xy()
        if not (local.v_z_valid and vd == vd):
            self._velocity, dd = (*self._velocity[:2], 0.0), 0.0
            self._notch_d.reset()
        self._velocity_derivative = derivative = (dn, de, dd)
        self._follow_jumps(local)
        if local.xy_valid and local.z_valid and local.v_xy_valid and local.v_z_valid:
            return States((local.x, local.y, local.z), velocity, derivative, local.heading)
        x, y = (local.x, local.y) if local.xy_valid else (NAN, NAN)
        if not local.v_xy_valid:
            vn = ve = NAN
        return States(
            (x, y, local.z if local.z_valid else NAN),
            (vn, ve, vd if local.v_z_valid else NAN),
            derivative,
            local.heading,
        )

    def _follow_jumps(self, local: VehicleLocalPosition) -> None:
        """What is filtered jumps with the estimate, after the jump has been filtered: PX4 does so in this order.

        Where no low-pass has held it back (MPC_VEL_LP 0) it counts twice: the derivative kicks one way, then the other.
        """
        resets = (local.vxy_reset_counter, local.vz_reset_counter)
        if resets == self._resets:
            return
        (vn, ve, vd), before, self._resets = self._velocity, self._resets, resets
        if resets[0] != before[0]:
            vn, ve = vn + local.delta_vxy[0], ve + local.delta_vxy[1]
            self._reset_notch_xy()
        if resets[1] != before[1]:
            vd += local.delta_vz
            self._notch_d.reset()
        self._velocity = (vn, ve, vd)

    def _reset_notch_xy(self) -> None:
        self._notch_n.reset()
        self._notch_e.reset()


class LastSetpoint:
    """The last setpoint that came; `value` is where that is now: until the next comes it jumps with the estimate."""

    def __init__(self) -> None:
        self._told = self.value = TrajectorySetpoint()
        self._resets = (0, 0, 0, 0, 0)

    def replace(self, value: TrajectorySetpoint) -> None:
        """Until the next comes it is this."""
        self.value = value

    def update(self, told: TrajectorySetpoint, local: VehicleLocalPosition) -> None:
        """One more step, with the setpoint that came last; in every mode, so that no old jump moves a new setpoint."""
        if told is not self._told:
            self._told = self.value = told
        resets = (
            local.xy_reset_counter,
            local.z_reset_counter,
            local.vxy_reset_counter,
            local.vz_reset_counter,
            local.heading_reset_counter,
        )
        if resets != self._resets:
            place, height, speed, climb, turn = (new != old for new, old in zip(resets, self._resets, strict=True))
            self._resets = resets
            if 0 < self.value.timestamp < local.timestamp:
                (x, y, z), (vx, vy, vz) = self.value.position, self.value.velocity
                if place:
                    x, y = x + local.delta_xy[0], y + local.delta_xy[1]
                if speed:
                    vx, vy = vx + local.delta_vxy[0], vy + local.delta_vxy[1]
                self.value = self.value._replace(
                    position=(x, y, z + local.delta_z if height else z),
                    velocity=(vx, vy, vz + local.delta_vz if climb else vz),
                    yaw=wrap_pi(self.value.yaw + local.delta_heading) if turn else self.value.yaw,
                )


def climb_velocity(
    setpoint: TrajectorySetpoint, local: VehicleLocalPosition, velocity_down: float, land_speed: float
) -> float:
    """The vertical velocity that is controlled: the height's derivative has less bias where no height is held.

    Blended in over the landing speed, so that there is no step.
    """
    wanted = setpoint.velocity[2]
    holds_none = setpoint.position[2] != setpoint.position[2] and abs(wanted) > FLT_EPSILON
    if not (holds_none and local.z_valid and local.v_z_valid and local.z_deriv == local.z_deriv):
        return velocity_down
    weight = min(abs(wanted) / land_speed, 1.0) if land_speed > 0.0 else 1.0
    return local.z_deriv * weight + local.vz * (1.0 - weight)
