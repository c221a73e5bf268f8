"""Standstill: zero velocity and rotation at rest, and a very uncertain standstill where nothing else aids.

PX4's EKF2, aid_sources/ZeroVelocityUpdate, ZeroGyroUpdate and fake_pos_control.cpp (v1.18).
"""

import math

from autopilot.estimator import covariance as cov
from autopilot.estimator.filter import Filter
from autopilot.estimator.gps_checks import LEAST_FIX
from autopilot.topics import Topics

ZERO_VELOCITY_VARIANCE = 1e-6
STILL_RAD_S = 0.05
STILL_M_S2 = 0.6
STILL_GPS_M_S = 0.6


def at_rest(topics: Topics, kalman: Filter) -> bool:
    """Disarmed or not yet taken off, landed, and the IMU is quiet."""
    state = kalman.state
    if topics.vehicle_status.armed and topics.vehicle_status.vehicle_type != "multicopter":
        return False
    if not topics.vehicle_land_detected.landed or state.dt_s <= 0.0:
        return False
    gps = topics.sensor_gps
    if gps.fix_type >= LEAST_FIX and math.hypot(gps.vel_n_m_s, gps.vel_e_m_s) > STILL_GPS_M_S:
        return False
    quiet = STILL_RAD_S * state.dt_s
    if abs(state.turn_x) > quiet or abs(state.turn_y) > quiet or abs(state.turn_z) > quiet:
        return False
    force = math.hypot(state.dvn, state.dve, state.dvd) / state.dt_s
    return abs(force - 9.80665) < STILL_M_S2


def fuse_rest(kalman: Filter) -> None:
    """Zero velocity, zero rotation; and before there is a GPS fix, zero motion from where it stands."""
    state, fuse = kalman.state, kalman.fuse
    for index, velocity in enumerate((state.vn, state.ve, state.vd), cov.VELOCITY):
        fuse(index, -velocity, ZERO_VELOCITY_VARIANCE)
    variance = kalman.settings["EKF2_GYR_NOISE"] ** 2
    turns = (state.turn_x, state.turn_y, state.turn_z)
    for index, (turn, bias) in enumerate(zip(turns, state.gyro_bias, strict=True), cov.GYRO_BIAS):
        fuse(index, turn / state.dt_s - bias, variance)
    if not kalman.xy_started:
        fuse(cov.POSITION, -state.pn, 0.25)
        fuse(cov.POSITION + 1, -state.pe, 0.25)


def fuse_fake_velocity(now_us: int, kalman: Filter) -> None:
    """Nothing aids: a very uncertain standstill keeps the tilt from wandering (EKF2's fake position fusion)."""
    if kalman.xy_valid(now_us):
        return
    state, variance = kalman.state, kalman.settings["EKF2_NOAID_NOISE"] ** 2
    kalman.fuse(cov.VELOCITY, -state.vn, variance)
    kalman.fuse(cov.VELOCITY + 1, -state.ve, variance)
