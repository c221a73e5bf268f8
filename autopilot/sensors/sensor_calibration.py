"""Calibration of the sensors: what CAL_* and SENS_BOARD_* say, applied to what a sensor measured, and taken off again.

PX4's src/lib/sensor_calibration (v1.18), for the first instance of each sensor. A gyro loses its offset, an
accelerometer's offset goes before its scale, a magnetometer's before its matrix, a barometer's pressure loses its
offset; then SENS_BOARD_X_OFF, Y_OFF and Z_OFF turn what the board measures into the vehicle's frame. A sensor is
calibrated when one of its CAL_*_ID is its own.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Vector3

INTERNAL_PRIORITY = 50
INSTANCES: Final = 4
SLIGHT_DEG = 1e-4
"""Board offsets below this are none: PX4's simulated airframes come with 1e-6, so as to look calibrated."""
DEVICE_IDS = {"ACC": 1310988, "GYRO": 1310988, "MAG": 197388, "BARO": 6620172}
"""device_id of the first sensor of each kind in PX4's SITL."""
MOST = 1000.0
"""No offset or scale counts for more, in whatever unit: parameters without sense must not reach the estimator."""
MOST_RAD_S = math.radians(2000.0)
"""Nor does a gyro's for more than its full scale."""
SLIGHTEST_SCALE = 1e-3
"""An accelerometer's scale is no smaller."""
LEAST_CHANGE = 0.01
"""A gyro's offset (rad/s), an accelerometer's (m/s²) or its scale that changes by no more is the same calibration still
(Gyroscope::set_offset, Accelerometer::set_offset and set_scale)."""
ZERO: Vector3 = (0.0, 0.0, 0.0)
ONE: Vector3 = (1.0, 1.0, 1.0)
Matrix = tuple[Vector3, Vector3, Vector3]


class Corrections(NamedTuple):
    """What stands between a sensor and its topic; `board` is None where the board sits straight."""

    gyro_offset: Vector3 = ZERO
    accel_offset: Vector3 = ZERO
    accel_scale: Vector3 = ONE
    mag_offset: Vector3 = ZERO
    mag_matrix: Matrix | None = None
    baro_offset_pa: float = 0.0
    board: Matrix | None = None


NONE = Corrections()


def corrections_of(parameters: Parameters) -> Corrections:
    """What the parameters of the first instances say; equal to NONE where they say nothing."""

    def three(name: str, most: float = MOST) -> Vector3:
        x, y, z = (max(-most, min(most, float(parameters[name.format(axis)]))) for axis in "XYZ")
        return x, y, z

    diagonal, odd = three("CAL_MAG0_{}SCALE"), three("CAL_MAG0_{}ODIAG")
    matrix = None
    if diagonal != ONE or odd != ZERO:
        matrix = ((diagonal[0], odd[0], odd[1]), (odd[0], diagonal[1], odd[2]), (odd[1], odd[2], diagonal[2]))
    scale_x, scale_y, scale_z = (max(SLIGHTEST_SCALE, scale) for scale in three("CAL_ACC0_{}SCALE"))
    board_deg = three("SENS_BOARD_{}_OFF")
    return Corrections(
        three("CAL_GYRO0_{}OFF", MOST_RAD_S),
        three("CAL_ACC0_{}OFF"),
        (scale_x, scale_y, scale_z),
        three("CAL_MAG0_{}OFF"),
        matrix,
        float(parameters["CAL_BARO0_OFF"]),
        _rotation(board_deg) if any(abs(angle) > SLIGHT_DEG for angle in board_deg) else None,
    )


def is_calibrated(parameters: Parameters, sensor: str) -> bool:
    """Whether a sensor (a key of DEVICE_IDS) has a calibration of its own."""
    return _slot(parameters, sensor) is not None


def priority(parameters: Parameters, sensor: str) -> int:
    """CAL_…_PRIO of a sensor's calibration: 0 disables it; -1, PX4's default, also without a calibration."""
    slot = _slot(parameters, sensor)
    return -1 if slot is None else int(parameters[f"CAL_{sensor}{slot}_PRIO"])


def _slot(parameters: Parameters, sensor: str) -> int | None:
    """Number of the CAL_… that is a sensor's (FindCurrentCalibrationIndex)."""
    device = DEVICE_IDS[sensor]
    return next((n for n in range(INSTANCES) if int(parameters[f"CAL_{sensor}{n}_ID"]) == device), None)


def corrected_gyro(raw: Vector3, corrections: Corrections) -> Vector3:
    """Body rates of what the gyro measured."""
    return _turned(_minus(raw, corrections.gyro_offset), corrections.board)


def corrected_accel(raw: Vector3, corrections: Corrections) -> Vector3:
    """Specific force of what the accelerometer measured."""
    x, y, z = _minus(raw, corrections.accel_offset)
    sx, sy, sz = corrections.accel_scale
    return _turned((x * sx, y * sy, z * sz), corrections.board)


def corrected_mag(raw: Vector3, corrections: Corrections) -> Vector3:
    """Magnetic field of what the magnetometer measured."""
    return _turned(_turned(_minus(raw, corrections.mag_offset), corrections.mag_matrix), corrections.board)


def raw_gyro(rates: Vector3, corrections: Corrections) -> Vector3:
    """What the gyro measured."""
    x, y, z = _turned_back(rates, corrections.board)
    ox, oy, oz = corrections.gyro_offset
    return x + ox, y + oy, z + oz


def raw_accel(force: Vector3, corrections: Corrections) -> Vector3:
    """What the accelerometer measured."""
    x, y, z = _turned_back(force, corrections.board)
    ox, oy, oz = corrections.accel_offset
    sx, sy, sz = corrections.accel_scale
    return x / sx + ox, y / sy + oy, z / sz + oz


def raw_mag(field: Vector3, corrections: Corrections) -> Vector3:
    """What the magnetometer measured."""
    x, y, z = _turned_back(field, corrections.board)
    if corrections.mag_matrix is not None:
        x, y, z = _turned((x, y, z), _inverse(corrections.mag_matrix))
    ox, oy, oz = corrections.mag_offset
    return x + ox, y + oy, z + oz


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _turned(vector: Vector3, matrix: Matrix | None) -> Vector3:
    if matrix is None:
        return vector
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _turned_back(vector: Vector3, rotation: Matrix | None) -> Vector3:
    if rotation is None:
        return vector
    first, second, third = zip(*rotation, strict=True)
    return _turned(vector, (first, second, third))


def _rotation(angles_deg: Vector3) -> Matrix:
    """Rotation by Euler angles roll, pitch, yaw."""
    (sr, sp, sy), (cr, cp, cy) = (tuple(f(math.radians(a)) for a in angles_deg) for f in (math.sin, math.cos))
    return (
        (cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy),
        (cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy),
        (-sp, sr * cp, cr * cp),
    )


def _inverse(matrix: Matrix) -> Matrix:
    """Inverse of a matrix; itself where it has none."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if determinant == 0.0:
        return matrix
    k = 1.0 / determinant
    return (
        ((e * i - f * h) * k, (c * h - b * i) * k, (b * f - c * e) * k),
        ((f * g - d * i) * k, (a * i - c * g) * k, (c * d - a * f) * k),
        ((d * h - e * g) * k, (b * g - a * h) * k, (a * e - b * d) * k),
    )
