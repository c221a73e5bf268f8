"""Calibration of the sensors: what CAL_* and SENS_BOARD_* say, applied to what a sensor measured, and taken off again.

PX4's src/lib/sensor_calibration (v1.18), for the first instance of each sensor. A gyro loses its offset, an
accelerometer's offset goes before its scale, a magnetometer's before its matrix, a barometer's pressure loses its
offset; then SENS_BOARD_ROT turns what the board measures into the vehicle's frame, and SENS_BOARD_X_OFF, Y_OFF and
Z_OFF level it. A sensor is calibrated when one of its CAL_*_ID is its own, and no other calibration counts; of that,
scales of 0 and less and changes too small to matter do not.
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
"""No scale is smaller (ours)."""
LEAST_CHANGE, LEAST_MAG_CHANGE_GA = 0.01, 0.005
"""An offset of a gyro (rad/s), an accelerometer (m/s²) or a barometer (Pa), a scale, or a magnetometer's offset that
changes by no more is the same still (Gyroscope::set_offset, Accelerometer::set_offset and set_scale, …)."""
BOARD_ROTATIONS_DEG: tuple[Vector3, ...] = (
    *((0.0, 0.0, yaw) for yaw in range(0, 360, 45)),
    *((180.0, 0.0, yaw) for yaw in (0, 45, 90, 135)),
    (0.0, 180.0, 0.0),
    *((180.0, 0.0, yaw) for yaw in (225, 270, 315)),
    *((90.0, 0.0, yaw) for yaw in (0, 45, 90, 135)),
    *((270.0, 0.0, yaw) for yaw in (0, 45, 90, 135)),
    *((0.0, 90.0, 0.0), (0.0, 270.0, 0.0), (0.0, 180.0, 90.0), (0.0, 180.0, 270.0)),
    *((90.0, 90.0, 0.0), (180.0, 90.0, 0.0), (270.0, 90.0, 0.0), (90.0, 180.0, 0.0), (270.0, 180.0, 0.0)),
    *((90.0, 270.0, 0.0), (180.0, 270.0, 0.0), (270.0, 270.0, 0.0), (90.0, 180.0, 90.0), (90.0, 0.0, 270.0)),
    *((90.0, 68.0, 293.0), (0.0, 315.0, 0.0), (90.0, 315.0, 0.0)),
)
"""Roll, pitch and yaw of each SENS_BOARD_ROT (lib/conversion/rotation.h)."""
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


def corrections_of(parameters: Parameters, before: Corrections = NONE, *, first: bool = True) -> Corrections:
    """What the parameters make of the corrections before; equal to NONE where they say nothing.

    `first`: the gyro had no calibration yet, so that its offset counts however small it is.
    """

    def three(slot: int, name: str, most: float = MOST) -> Vector3:
        x, y, z = (max(-most, min(most, float(parameters[name.format(slot, axis)]))) for axis in "XYZ")
        return x, y, z

    told = NONE
    if (slot := _slot(parameters, "GYRO")) is not None:
        offset = three(slot, "CAL_GYRO{}_{}OFF", MOST_RAD_S)
        told = told._replace(gyro_offset=offset if first else _changed(before.gyro_offset, offset))
    if (slot := _slot(parameters, "ACC")) is not None:
        offset = _changed(before.accel_offset, three(slot, "CAL_ACC{}_{}OFF"))
        told = told._replace(
            accel_offset=offset, accel_scale=_changed_scale(before.accel_scale, three(slot, "CAL_ACC{}_{}SCALE"))
        )
    if (slot := _slot(parameters, "MAG")) is not None:
        offset = _changed(before.mag_offset, three(slot, "CAL_MAG{}_{}OFF"), LEAST_MAG_CHANGE_GA)
        diagonal, odd = _parts(before.mag_matrix)
        diagonal = _changed_scale(diagonal, three(slot, "CAL_MAG{}_{}SCALE"))
        odd = _changed(odd, three(slot, "CAL_MAG{}_{}ODIAG"))
        told = told._replace(mag_offset=offset, mag_matrix=_symmetric(diagonal, odd))
    if (slot := _slot(parameters, "BARO")) is not None:
        offset_pa = float(parameters[f"CAL_BARO{slot}_OFF"])
        is_same = abs(offset_pa - before.baro_offset_pa) <= LEAST_CHANGE
        told = told._replace(baro_offset_pa=before.baro_offset_pa if is_same else offset_pa)
    return told._replace(board=_board(parameters))


def _changed(before: Vector3, told: Vector3, least: float = LEAST_CHANGE) -> Vector3:
    return told if math.dist(before, told) > least else before


def _changed_scale(before: Vector3, told: Vector3) -> Vector3:
    if min(told) <= 0.0:
        return before
    x, y, z = (max(SLIGHTEST_SCALE, scale) for scale in told)
    return _changed(before, (x, y, z))


def _symmetric(diagonal: Vector3, odd: Vector3) -> Matrix | None:
    if diagonal == ONE and odd == ZERO:
        return None
    return (diagonal[0], odd[0], odd[1]), (odd[0], diagonal[1], odd[2]), (odd[1], odd[2], diagonal[2])


def _parts(symmetric: Matrix | None) -> tuple[Vector3, Vector3]:
    """Diagonal, and what is beside it."""
    if symmetric is None:
        return ONE, ZERO
    (a, b, c), (_, d, e), (_, _, f) = symmetric
    return (a, d, f), (b, c, e)


def _board(parameters: Parameters) -> Matrix | None:
    """From the board's axes to the vehicle's; a SENS_BOARD_ROT that is none leaves it straight (GetBoardRotation)."""
    number = int(parameters["SENS_BOARD_ROT"])
    mounted_deg = BOARD_ROTATIONS_DEG[number] if 0 <= number < len(BOARD_ROTATIONS_DEG) else ZERO
    x_deg, y_deg, z_deg = (float(parameters[f"SENS_BOARD_{axis}_OFF"]) for axis in "XYZ")
    leans = max(abs(x_deg), abs(y_deg), abs(z_deg)) > SLIGHT_DEG
    level = _rotation((x_deg, y_deg, z_deg)) if leans else None
    if mounted_deg == ZERO:
        return level
    mounted = _rotation(mounted_deg)
    return mounted if level is None else _product(level, mounted)


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


def _product(a: Matrix, b: Matrix) -> Matrix:
    first, second, third = (_turned(column, a) for column in zip(*b, strict=True))
    return (
        (first[0], second[0], third[0]),
        (first[1], second[1], third[1]),
        (first[2], second[2], third[2]),
    )


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
