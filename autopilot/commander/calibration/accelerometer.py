"""Accelerometer calibration on six sides, and the quick one as it stands (PX4's accelerometer_calibration.cpp).

Six sides give offset and scale of each axis. SENS_BOARD_ROT is not revised: the simulated board is mounted straight.
"""

import math
from collections.abc import Generator

import numpy as np

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps, changed
from sitl_emu.autopilot.commander.calibration.orientation import (
    ALL_SIDES,
    ERROR,
    GRAVITY_M_S2,
    OK,
    SIDES,
    Outcome,
    each_side,
)
from sitl_emu.autopilot.sensors.sensor_calibration import INTERNAL_PRIORITY, ONE, ZERO, Matrix, corrected_accel
from sitl_emu.autopilot.topics import Vector3
from sitl_emu.core.attitude import rotation

SAMPLES = 750
"""Of a side: 3 s at 250 Hz; nobody looks whether the vehicle rests meanwhile (accel_calibration_worker)."""
SIDE_PERCENT = 17
LEAST_OFFSET_M_S2, LEAST_SCALE = 0.01, 0.01
"""Less is none (Accelerometer::set_offset, set_scale)."""
MOST_QUICK_TILT_RAD = math.radians(10.0)
"""Where the estimator's attitude is further from the measured one it is not believed."""


def calibrate(bench: Bench) -> Steps:
    """Write CAL_ACC0_*."""
    bench.started("accel")
    forces: dict[int, Vector3] = {}

    def measure(side: int) -> Outcome:
        bench.info(f"[cal] Hold still, measuring {SIDES[side]} side")
        x, y, z = force = yield from _mean(bench)
        axis = side // 2
        if force[axis] * (1 - 2 * (side % 2)) < 0.0:
            bench.emergency(f"[cal] accel 0 invalid {'XYZ'[axis]}-axis, check rotation")
            return ERROR
        forces[side] = force
        bench.info(f"[cal] {SIDES[side]} side result: [{x:.3f} {y:.3f} {z:.3f}]")
        bench.progress(SIDE_PERCENT * len(forces))
        return OK

    outcome = yield from each_side(bench, ALL_SIDES, measure, lenient=False)
    if outcome != OK:
        return (yield from bench.failed("accel"))
    offset, scale = _fit(forces, bench.corrections.board)
    offset, scale = changed(ZERO, offset, LEAST_OFFSET_M_S2), changed(ONE, scale, LEAST_SCALE)
    bench.save("ACC", priority=INTERNAL_PRIORITY, OFF=offset, SCALE=scale)
    return (yield from bench.done("accel"))


def calibrate_quickly(bench: Bench) -> Steps:
    """Write CAL_ACC0_*OFF so that the newest sample is gravity alone; says nothing (do_accel_calibration_quick).

    Gravity lies where the attitude says, or along the sample where that is too far off.
    """
    yield from ()
    force = bench.accel()
    strength = math.hypot(*force)
    if not 0.0 < strength < math.inf:
        return False
    down_x, down_y, down_z = rotation(bench.topics.vehicle_attitude.q)[6:]
    gravity = -GRAVITY_M_S2 * down_x, -GRAVITY_M_S2 * down_y, -GRAVITY_M_S2 * down_z
    cosine = sum(f * g for f, g in zip(force, gravity, strict=True)) / strength / GRAVITY_M_S2
    if math.acos(max(-1.0, min(1.0, cosine))) > MOST_QUICK_TILT_RAD:
        x, y, z = force
        gravity = x / strength * GRAVITY_M_S2, y / strength * GRAVITY_M_S2, z / strength * GRAVITY_M_S2
    x, y, z = (f - g for f, g in zip(force, gravity, strict=True))
    if math.hypot(x, y, z) > GRAVITY_M_S2:
        return False
    old = bench.corrections
    bench.save("ACC", OFF=changed(old.accel_offset, (x, y, z), LEAST_OFFSET_M_S2), SCALE=old.accel_scale)
    return True


def _mean(bench: Bench) -> Generator[None, None, Vector3]:
    """The mean specific force in the vehicle's frame, by no calibration; it waits for samples as long as it takes."""
    board_alone = bench.corrections._replace(accel_offset=ZERO, accel_scale=ONE)
    total = ZERO
    for _ in range(SAMPLES):
        while not (yield from bench.next_imu()):
            pass
        x, y, z = corrected_accel(bench.accel(), board_alone)
        total = total[0] + x, total[1] + y, total[2] + z
    return total[0] / SAMPLES, total[1] / SAMPLES, total[2] / SAMPLES


def _fit(forces: dict[int, Vector3], board: Matrix | None) -> tuple[Vector3, Vector3]:
    """Offset and scale of each of the sensor's axes from the forces on the six sides, in the vehicle's frame.

    The matrix that makes gravity along the axes of what was measured there; its slant is not kept.
    """
    offset = np.array([0.5 * (forces[2 * axis][axis] + forces[2 * axis + 1][axis]) for axis in range(3)])
    measured = np.array([forces[2 * axis] for axis in range(3)]) - offset
    turned = np.eye(3) if board is None else np.array(board)
    try:
        matrix = np.linalg.inv(measured) * GRAVITY_M_S2
    except np.linalg.LinAlgError:
        matrix = np.eye(3)
    x, y, z = (float(value) for value in turned.T @ offset)
    scale_x, scale_y, scale_z = (float(value) for value in np.diag(turned.T @ matrix @ turned))
    if min(scale_x, scale_y, scale_z) <= 0.0:
        return (x, y, z), ONE
    return (x, y, z), (scale_x, scale_y, scale_z)
