"""Parameters that a rover's control obeys, copied when they change: RO_*, RA_*, PP_*, NAV_ACC_RAD, CA_R_REV."""

import math
from typing import NamedTuple

from sitl_emu.autopilot.parameters import Parameters

EPSILON = 1.1920929e-07
"""FLT_EPSILON: what is not above it, is none in PX4."""
STEEPEST = 0.99
"""Dead zone and super-exponential curve of a stick at most (PX4: math::superexpo, math::deadzone)."""


class RoverParameters(NamedTuple):
    """In m, rad and s; yaw rates in rad/s."""

    wheel_base_m: float
    max_steering_rad: float
    steering_rate: float
    """RA_STR_RATE_LIM over the largest angle: of the normalised steering, 1/s; 0 for none."""
    acceptance_m: float
    acceptance_gain: float
    acceptance_max_m: float
    speed_limit: float
    full_throttle_speed: float
    acceleration: float
    deceleration: float
    jerk: float
    speed_reduction: float
    speed_p: float
    speed_i: float
    speed_threshold: float
    yaw_p: float
    yaw_rate_p: float
    yaw_rate_i: float
    yaw_rate_limit: float
    yaw_rate_threshold: float
    yaw_acceleration: float
    yaw_rate_correction: float
    stick_dead_zone: float
    stick_expo: float
    stick_super_expo: float
    ahead_gain: float
    ahead_min_m: float
    ahead_max_m: float
    reversible: bool

    @property
    def steers_at_a_rate(self) -> bool:
        """Whether yaw rates can be controlled (AckermannRateControl::runSanityChecks)."""
        least = min(self.full_throttle_speed, self.wheel_base_m, self.max_steering_rad, self.yaw_rate_limit)
        return least >= EPSILON

    @property
    def drives_at_a_speed(self) -> bool:
        """Whether speeds can be controlled (AckermannSpeedControl::runSanityChecks)."""
        return min(self.full_throttle_speed, self.speed_limit) >= EPSILON

    def feasible_yaw_rate(self, speed: float) -> float:
        """The greatest yaw rate that the largest steering angle gives at a speed."""
        return abs(speed) * math.tan(self.max_steering_rad) / self.wheel_base_m

    @property
    def least_cornering_speed(self) -> float:
        """Below it the largest steering angle does not reach the largest yaw rate: RO_SPEED_RED goes no lower."""
        return self.wheel_base_m * self.yaw_rate_limit / math.tan(self.max_steering_rad)


def rover_parameters(parameters: Parameters) -> RoverParameters:
    """Copy what a rover's control needs."""
    get = parameters.__getitem__
    angle, steering_rate = float(get("RA_MAX_STR_ANG")), math.radians(get("RA_STR_RATE_LIM"))
    limits_steering = angle > EPSILON and get("RA_STR_RATE_LIM") > EPSILON
    return RoverParameters(
        wheel_base_m=float(get("RA_WHEEL_BASE")),
        max_steering_rad=angle,
        steering_rate=steering_rate / angle if limits_steering else 0.0,
        acceptance_m=float(get("NAV_ACC_RAD")),
        acceptance_gain=float(get("RA_ACC_RAD_GAIN")),
        acceptance_max_m=float(get("RA_ACC_RAD_MAX")),
        speed_limit=float(get("RO_SPEED_LIM")),
        full_throttle_speed=float(get("RO_MAX_THR_SPEED")),
        acceleration=float(get("RO_ACCEL_LIM")),
        deceleration=float(get("RO_DECEL_LIM")),
        jerk=float(get("RO_JERK_LIM")),
        speed_reduction=float(get("RO_SPEED_RED")),
        speed_p=float(get("RO_SPEED_P")),
        speed_i=float(get("RO_SPEED_I")),
        speed_threshold=float(get("RO_SPEED_TH")),
        yaw_p=float(get("RO_YAW_P")),
        yaw_rate_p=float(get("RO_YAW_RATE_P")),
        yaw_rate_i=float(get("RO_YAW_RATE_I")),
        yaw_rate_limit=math.radians(get("RO_YAW_RATE_LIM")),
        yaw_rate_threshold=math.radians(get("RO_YAW_RATE_TH")),
        yaw_acceleration=math.radians(get("RO_YAW_ACCEL_LIM")),
        yaw_rate_correction=float(get("RO_YAW_RATE_CORR")),
        stick_dead_zone=max(0.0, min(STEEPEST, get("RO_YAW_STICK_DZ"))),
        stick_expo=max(0.0, min(1.0, get("RO_YAW_EXPO"))),
        stick_super_expo=max(0.0, min(STEEPEST, get("RO_YAW_SUPEXPO"))),
        ahead_gain=float(get("PP_LOOKAHD_GAIN")),
        ahead_min_m=float(get("PP_LOOKAHD_MIN")),
        ahead_max_m=float(get("PP_LOOKAHD_MAX")),
        reversible=bool(int(get("CA_R_REV")) & 1),
    )
