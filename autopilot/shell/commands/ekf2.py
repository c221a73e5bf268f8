"""ekf2: what the estimator knows (PX4: modules/ekf2, Ekf::print_status)."""

import math
from collections.abc import Iterator, Sequence

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.shell import matrix_text
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, error
from sitl_emu.autopilot.shell.commands.module import default_command
from sitl_emu.core.attitude import euler

TILT_ALIGN = 1
"""Bit of estimator_status.control_mode_flags."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`ekf2 status [-v]`, `ekf2 select_instance`, of which there is one."""
    if list(arguments[:1]) == ["select_instance"]:
        yield error("ekf2", "multi-EKF not active, unable to select instance")
        return SUCCESS
    if list(arguments[:1]) != ["status"]:
        return (yield from default_command("ekf2", True, arguments))
    topics, ekf = vehicle.topics, vehicle.estimator.ekf
    aligned = bool(topics.estimator_status.control_mode_flags & TILT_ALIGN)
    local, global_position = topics.vehicle_local_position.xy_valid, topics.vehicle_global_position.valid
    yield (
        f"\nekf2:0 EKF dt: {ekf.dt_s:.4f}s, attitude: {aligned:d}, "
        f"local position: {local:d}, global position: {global_position:d}\n"
    )
    if "-v" in arguments:
        yield from _states(ekf)
    return SUCCESS


def _states(ekf: Ekf) -> Iterator[str]:
    """States and variances at the horizon, and the covariance; what the buffers hold is left out."""
    state = ekf.state
    down_m = (ekf.origin_alt if math.isfinite(ekf.origin_alt) else 0.0) - state.alt
    turn = f"{_numbers(state.q, '.3f')} (Euler {_numbers([math.degrees(each) for each in euler(state.q)], '.1f')} deg)"
    yield f"\nStates: ({(ekf.latest_us - ekf.time_us) * 1e-6:.4f} seconds ago)\n"
    for name, first, end, value in (
        ("Orientation", cov.ATTITUDE, cov.VELOCITY, turn),
        ("Velocity", cov.VELOCITY, cov.POSITION, _numbers((state.vn, state.ve, state.vd), ".3f")),
        ("Position", cov.POSITION, cov.GYRO_BIAS, _numbers((state.pn, state.pe, down_m), ".3f")),
        ("Gyro Bias", cov.GYRO_BIAS, cov.ACCEL_BIAS, _numbers(state.gyro_bias, ".6f")),
        ("Accel Bias", cov.ACCEL_BIAS, cov.MAG_I, _numbers(state.accel_bias, ".6f")),
        ("Magnetic Field", cov.MAG_I, cov.MAG_B, _numbers(state.mag_i, ".3f")),
        ("Magnetic Bias", cov.MAG_B, cov.WIND, _numbers(state.mag_b, ".3f")),
        ("Wind velocity", cov.WIND, cov.TERRAIN, _numbers(state.wind, ".3f")),
    ):
        variances = _numbers([ekf.variance(index) for index in range(first, end)], ".1e")
        yield f"{name} ({first}-{end - 1}): {value} var: {variances}\n"
    yield f"Terrain position ({cov.TERRAIN}): {state.terrain:.3f} var: {ekf.variance(cov.TERRAIN):.1e}\n"
    yield "\nP:\n"
    yield from matrix_text.lines(ekf.p.tolist())
    yield f"EKF average dt: {ekf.dt_s:.6f} seconds\n"


def _numbers(values: Sequence[float], form: str) -> str:
    return f"[{', '.join(format(value, form) for value in values)}]"
