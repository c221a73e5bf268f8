"""Where the rays of many followed corners cross: `geolocation.Intersection`, of all corners of a frame at once."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera_model import FloatArray
from sitl_emu.missions.companion.geolocation import HOME_HEIGHT_SIGMA_M, LEAST_DROP, LEAST_RANGE_M, RAY_SIGMA_RAD

Numbers = npt.NDArray[np.int64]
PRIOR_WEIGHT = 1.0 / HOME_HEIGHT_SIGMA_M**2


class Crossings(NamedTuple):
    """Running least-squares intersections: one corner a row, in every array."""

    numbers: Numbers
    normal: FloatArray
    """(n, 3, 3): of the normal equations, the prior among it."""
    pulled: FloatArray
    """(n, 3): their right side, of home's height as the prior, which is 0."""
    squares: FloatArray
    """(n,): of the rays' origins, weighed: what is left of it at the point is how far they pass by."""
    weights: FloatArray
    """(n,), 1/m²: of all rays together."""
    counts: Numbers
    """(n,): how many rays."""
    firsts: FloatArray
    """(n, 3): each corner's first ray."""
    cosines: FloatArray
    """Of the widest angle between a corner's first ray and another."""

    def part(self, rows: Numbers | npt.NDArray[np.bool_]) -> "Crossings":
        """Some of the corners."""
        arrays: tuple[Any, ...] = self
        return Crossings(*(each[rows] for each in arrays))

    def points(self) -> FloatArray:
        """(n, 3): the points nearest to all rays, metres NED."""
        return np.asarray(np.linalg.solve(self.normal, self.pulled[..., None])[..., 0])

    def covariances(self) -> FloatArray:
        """(n, 3, 3): how well the rays tell the points."""
        return np.asarray(np.linalg.inv(self.normal))

    def residuals_m(self) -> FloatArray:
        """How far the rays pass by their point, root mean square."""
        points = self.points()
        normal = self.normal.copy()
        normal[:, 2, 2] -= PRIOR_WEIGHT
        across = np.einsum("ni,nij,nj->n", points, normal, points)
        squares = across - 2.0 * np.einsum("ni,ni->n", self.pulled, points) + self.squares
        return np.asarray(np.sqrt(np.maximum(squares, 0.0) / self.weights))

    def with_rays(self, numbers: Numbers, origins_m: FloatArray, directions: FloatArray) -> "Crossings":
        """Of these corners, each with one more ray: (n, 3) from, (n, 3) unit vectors. Others are left out."""
        at = {number: row for row, number in enumerate(self.numbers.tolist())}
        rows = np.array([at.get(number, -1) for number in numbers.tolist()], np.int64)
        both: Iterator[tuple[Any, Any]] = zip(self, none_yet(1), strict=True)
        before = Crossings(*(np.concatenate(pair) for pair in both)).part(rows)
        range_m = np.maximum(-origins_m[:, 2] / np.maximum(directions[:, 2], LEAST_DROP), LEAST_RANGE_M)
        weights = 1.0 / (range_m * RAY_SIGMA_RAD) ** 2
        across = weights[:, None, None] * (np.eye(3) - directions[:, :, None] * directions[:, None, :])
        pulled = np.einsum("nij,nj->ni", across, origins_m)
        firsts = np.where(before.counts[:, None] == 0, directions, before.firsts)
        cosines = np.clip(np.einsum("ni,ni->n", directions, firsts), -1.0, 1.0)
        return Crossings(
            numbers,
            before.normal + across,
            before.pulled + pulled,
            before.squares + np.einsum("ni,ni->n", pulled, origins_m),
            before.weights + weights,
            before.counts + 1,
            firsts,
            np.minimum(before.cosines, cosines),
        )


def none_yet(corners: int = 0) -> Crossings:
    """Of corners without rays; their numbers are -1."""
    return Crossings(
        np.full(corners, -1, np.int64),
        np.broadcast_to(np.diag((1e-9, 1e-9, PRIOR_WEIGHT)), (corners, 3, 3)).copy(),
        np.zeros((corners, 3)),
        np.zeros(corners),
        np.zeros(corners),
        np.zeros(corners, np.int64),
        np.zeros((corners, 3)),
        np.ones(corners),
    )
