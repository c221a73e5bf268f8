"""STABILIZED and ACRO: from sticks to an attitude or to rates, and a thrust.

PX4's MulticopterAttitudeControl::generate_attitude_setpoint and throttle_curve (src/modules/mc_att_control), and the
acro part of MulticopterRateControl (v1.18). The throttle's middle is the hover thrust as it is estimated, as
MPC_THR_HOVER has it (MPC_THR_CURVE 2), or the middle (1); in ACRO it is the thrust itself. What counts as hover thrust,
as the least thrust in the air and as the greatest after arming moves slowly to where it has to be.
"""

import math

from sitl_emu.autopilot.modes.sticks import StickYaw, expo_deadzone
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    ManualControlSetpoint,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
    VehicleStatus,
)
from sitl_emu.core.attitude import Quaternion, product

LEAST_SLEW_1_S, MOST_SLEW_1_S, HOVER_SLEW_1_S = 0.05, 0.5, 0.05
"""Of the least and the greatest thrust and of the hover thrust, per second."""
HOVER_RANGE = (0.05, 0.9)
ARMING_GESTURE = -0.9
"""Throttle below which the yaw stick may mean to arm: no heading is held."""
YAW_AND_ALL = 2
"""MC_AIRMODE."""
BY_ESTIMATE, STRAIGHT, BY_PARAMETER = 0, 1, 2
"""MPC_THR_CURVE."""
SUPER_EXPO_MOST = 0.99


class ManualAttitude:
    """What of the sticks depends on the moments before."""

    def __init__(self, parameters: Parameters) -> None:
        self._least = self._most = 0.0
        self._hover = float(parameters["MPC_THR_HOVER"])
        self._estimated = False
        self._tilt = (0.0, 0.0)
        self._yaw = StickYaw()
        self.refresh(parameters)

    def refresh(self, parameters: Parameters) -> None:
        """Copy the parameters."""

        def get(name: str) -> float:
            return float(parameters[name])

        self._tilt_max, self._tilt_tau_s = max(0.0, math.radians(get("MPC_MAN_TILT_MAX"))), get("MC_MAN_TILT_TAU")
        self._yaw.max_rate, self._yaw.time_constant_s = math.radians(get("MPC_MAN_Y_MAX")), get("MPC_MAN_Y_TAU")
        self._dead_zone = get("MAN_DEADZONE")
        self._curve, self._air_mode = int(get("MPC_THR_CURVE")), int(get("MC_AIRMODE"))
        self._thrust_min, self._thrust_max = get("MPC_MANTHR_MIN"), get("MPC_THR_MAX")
        self._thrust_hover, self._spoolup_s = get("MPC_THR_HOVER"), get("COM_SPOOLUP_TIME")
        self._rates = tuple(math.radians(get(f"MC_ACRO_{axis}_MAX")) for axis in "RPY")
        self._expo, self._super_expo = get("MC_ACRO_EXPO"), get("MC_ACRO_SUPEXPO")
        self._expo_yaw, self._super_expo_yaw = get("MC_ACRO_EXPO_Y"), get("MC_ACRO_SUPEXPOY")
        if not self._estimated:
            self._hover = self._thrust_hover

    def let_go(self, heading: float = NAN, unaided: float = NAN) -> None:
        """The sticks do not lead: where they were is forgotten. `unaided`: the heading by the gyroscopes alone."""
        self._tilt = (0.0, 0.0)
        self._yaw.reset(heading, unaided)

    def turned(self, delta_heading: float) -> None:
        """The estimate of the heading has jumped: one that is held jumps with it, and the vehicle does not turn."""
        self._yaw.turned(delta_heading)

    def follow(self, now_us: int, dt_s: float, status: VehicleStatus, landed: bool, hover_thrust: float | None) -> None:
        """The limits of the thrust, in every mode. `hover_thrust`: as it is estimated; None: it is not."""
        spooled_up = status.armed and now_us - status.armed_time > self._spoolup_s * 1e6
        self._least = _towards(self._least, 0.0 if landed else self._thrust_min, LEAST_SLEW_1_S * dt_s)
        self._most = _towards(self._most, 1.0, MOST_SLEW_1_S * dt_s) if spooled_up else 0.0
        if hover_thrust is not None:
            self._estimated = True
        if self._estimated:
            wanted = self._thrust_hover if hover_thrust is None else hover_thrust
            low, high = HOVER_RANGE
            self._hover = _towards(self._hover, max(low, min(high, wanted)), HOVER_SLEW_1_S * dt_s)

    def attitude(
        self, now_us: int, dt_s: float, sticks: ManualControlSetpoint, heading: float, unaided: float = NAN
    ) -> VehicleAttitudeSetpoint:
        """STABILIZED: roll and pitch sticks together are one tilt, in the direction of the stick."""
        if sticks.throttle < ARMING_GESTURE and self._air_mode != YAW_AND_ALL:
            self._yaw.yaw = NAN
        self._yaw.update(expo_deadzone(sticks.yaw, self._dead_zone), heading, dt_s, unaided)
        share = dt_s / (max(self._tilt_tau_s, 0.0) + dt_s)
        (x, y), most = self._tilt, self._tilt_max
        x, y = x + (sticks.roll * most - x) * share, y + (-sticks.pitch * most - y) * share
        self._tilt = x, y
        tilt = math.hypot(x, y)
        shrink = most / tilt if tilt > most else 1.0
        yaw = heading if math.isnan(self._yaw.yaw) else self._yaw.yaw
        turn: Quaternion = (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
        q_d = product(turn, _about_level_axis(x * shrink, y * shrink))
        return VehicleAttitudeSetpoint(now_us, q_d, self._yaw.yawspeed, (0.0, 0.0, -self._thrust(sticks.throttle)))

    def rates(self, now_us: int, sticks: ManualControlSetpoint) -> VehicleRatesSetpoint:
        """ACRO: sticks are rates."""
        roll, pitch, yaw = self._rates
        rates = (
            roll * super_expo(sticks.roll, self._expo, self._super_expo),
            pitch * super_expo(-sticks.pitch, self._expo, self._super_expo),
            yaw * super_expo(sticks.yaw, self._expo_yaw, self._super_expo_yaw),
        )
        return VehicleRatesSetpoint(now_us, rates, (0.0, 0.0, -(sticks.throttle + 1.0) / 2.0))

    def _thrust(self, throttle: float) -> float:
        least, most = self._least, self._thrust_max
        if self._curve == STRAIGHT:
            thrust = least + (most - least) * (throttle + 1.0) / 2.0
        else:
            hover = self._thrust_hover if self._curve == BY_PARAMETER else self._hover
            thrust = hover + throttle * ((most - hover) if throttle > 0.0 else (hover - least))
        return min(thrust, self._most)


def super_expo(value: float, cube: float, steepness: float) -> float:
    """A stick of -1 to 1 with a share of its cube, and steeper towards its ends (math::superexpo)."""
    x = max(-1.0, min(1.0, value))
    share, steep = max(0.0, min(1.0, cube)), max(0.0, min(SUPER_EXPO_MOST, steepness))
    return ((1.0 - share) * x + share * x * x * x) * (1.0 - steep) / (1.0 - abs(x) * steep)


def _towards(value: float, wanted: float, step: float) -> float:
    return value + max(-step, min(step, wanted - value))


def _about_level_axis(x: float, y: float) -> Quaternion:
    """A turn by the length of (x, y) about that axis."""
    angle = math.hypot(x, y)
    share = math.sin(angle / 2.0) / angle if angle > 0.0 else 0.5
    return math.cos(angle / 2.0), x * share, y * share, 0.0
