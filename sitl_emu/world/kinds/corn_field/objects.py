"""What lies in a corn field beside the corn: targets to find and distractors that look a little like them.

A target is a weed patch or a patch of diseased corn, 0.5 to 2 m across. Distractors are what a scout's eye stumbles
over: bare soil, puddles, crop residue, shade, corn that is pale for want of nitrogen, corn that is lush. No colour
belongs to one class: weeds are as green as corn, diseased leaves as brown and yellow as residue and soil.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

TARGET_KINDS = ("weed", "disease")
DISTRACTOR_KINDS = ("bare_soil", "puddle", "residue", "shade", "pale_corn", "lush_corn")
PAINTED = TARGET_KINDS + DISTRACTOR_KINDS
"""What is part of the field's painting."""
GROWS_IN_ROWS = ("disease", "pale_corn", "lush_corn")
"""Kinds that are a state of the corn plants, so that they exist where rows are."""


class FieldObject(NamedTuple):
    """A patch of the field: where it is, what it is, and its outline.

    The outline is r(a) = radius_m * (1 + sum of amplitude * cos(k * a + phase)), with k counted from 2 and the angle a
    from north over east: harmonic 1 would only move the centre.
    """

    kind: str
    north_m: float
    east_m: float
    radius_m: float
    harmonics: tuple[tuple[float, float], ...]
    """(amplitude, phase_rad) of k = 2, 3, ..."""
    seed: int
    """Seed of what is inside: its plants and its shade of colour."""

    @property
    def is_target(self) -> bool:
        """Whether the mission should find it."""
        return self.kind in TARGET_KINDS


def outline_factor(thing: FieldObject, angle_rad: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """Outline radius over `radius_m` at angles counted from north over east."""
    factor = np.ones(angle_rad.shape)
    for k, (amplitude, phase) in enumerate(thing.harmonics, start=2):
        factor += amplitude * np.cos(k * angle_rad + phase)
    return factor


def outline(thing: FieldObject, points: int = 40) -> npt.NDArray[np.float64]:
    """Outline as (points, 2) north, east in metres."""
    angle = np.arange(points) * (math.tau / points)
    radius = thing.radius_m * outline_factor(thing, angle)
    return np.stack((thing.north_m + radius * np.cos(angle), thing.east_m + radius * np.sin(angle)), axis=1)


def inside(
    thing: FieldObject, north_m: npt.NDArray[np.float64], east_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Which points lie within the outline."""
    d_north, d_east = north_m - thing.north_m, east_m - thing.east_m
    limit = thing.radius_m * outline_factor(thing, np.arctan2(d_east, d_north))
    return np.asarray(d_north * d_north + d_east * d_east <= limit * limit)
