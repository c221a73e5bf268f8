"""A sphere or an ellipsoid through a magnetometer's samples, by Levenberg and Marquardt (PX4's lm_fit.cpp).

What is sought makes `matrix (sample - offset)` as long as the radius for every sample. A sphere seeks offset and
radius, an ellipsoid then offset and matrix. The steps end as PX4's do, soon rather than late.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_STEPS, LEAST_STEPS = 100, 11
DAMPING, DAMPING_FACTOR = 1.0, 10.0
LEAST_DAMPING = 0.001
GOOD_COST = 0.01
WORST_COST = 1e30
RADII_GA = (0.2, 0.7)
"""Of the field anywhere on earth."""
ROWS, COLUMNS = (0, 0, 1), (1, 2, 2)
"""Where the three numbers off the diagonal stand."""


class Ellipsoid(NamedTuple):
    """What stands between samples and a sphere; `matrix` is symmetric."""

    radius: float
    offset: Array
    matrix: Array


def fit(samples: Array, start: Ellipsoid, *, sphere: bool) -> tuple[Ellipsoid, bool]:
    """The best shape that is found from `start`, and whether it will do."""
    shape, cost, damping = start, WORST_COST, DAMPING
    if not len(samples):
        return shape, False
    for step in range(MOST_STEPS):
        errors, slopes = _linearised(samples, shape, sphere=sphere)
        squares, gradient = slopes.T @ slopes, slopes.T @ errors
        one = np.eye(len(gradient))
        tries = [
            _moved(shape, np.asarray(-np.linalg.solve(squares + weight * one, gradient), dtype=float), sphere=sphere)
            for weight in (damping, damping / DAMPING_FACTOR)
        ]
        careful, bold = (_cost(samples, tried) for tried in tries)
        if bold < cost and bold < careful:
            damping /= DAMPING_FACTOR
            shape, cost = tries[1], bold
        elif math.isfinite(careful):
            if careful > cost and bold > cost:
                damping *= DAMPING_FACTOR
            shape, cost = tries[0], min(careful, cost)  # taken although it may be no better, as in PX4
        else:
            continue
        enough = step >= LEAST_STEPS and (cost < GOOD_COST or damping < LEAST_DAMPING)
        if enough and RADII_GA[0] < shape.radius < RADII_GA[1]:
            return shape, True
    return shape, False


def _linearised(samples: Array, shape: Ellipsoid, *, sphere: bool) -> tuple[Array, Array]:
    """By how much the samples lie inside, and how that changes with each number that is sought."""
    relative = samples - shape.offset
    corrected = relative @ shape.matrix
    lengths = np.maximum(np.linalg.norm(corrected, axis=1), np.finfo(float).tiny)
    unit = corrected / lengths[:, None]
    by_offset = unit @ shape.matrix
    if sphere:
        slopes = np.column_stack((np.ones(len(samples)), by_offset))
    else:
        aslant = relative[:, ROWS] * unit[:, COLUMNS] + relative[:, COLUMNS] * unit[:, ROWS]
        slopes = np.column_stack((by_offset, -relative * unit, -aslant))
    return shape.radius - lengths, slopes


def _moved(shape: Ellipsoid, step: Array, *, sphere: bool) -> Ellipsoid:
    if sphere:
        return shape._replace(radius=shape.radius + float(step[0]), offset=shape.offset + step[1:])
    change = np.diag(step[3:6])
    change[ROWS, COLUMNS] = change[COLUMNS, ROWS] = step[6:]
    return shape._replace(offset=shape.offset + step[:3], matrix=shape.matrix + change)


def _cost(samples: Array, shape: Ellipsoid) -> float:
    lengths = np.linalg.norm((samples - shape.offset) @ shape.matrix, axis=1)
    return float(np.linalg.norm(shape.radius - lengths)) / len(samples)
