"""The second paper's classes: water, ruins and fire, over the worlds that `variation.py` draws."""

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from sitl_emu.world import polygons
from sitl_emu.world.description import Ground
from sitl_emu.world.lens import Intrinsics
from sitl_emu.world.render.truth import Area, masked_regions
from tools.detector import variation
from tools.detector.plan import Frame, Job, Plan, Subject, World, dealt
from tools.detector.recorder import Eye

FloatArray = npt.NDArray[np.float64]
AREAS = (
    Area("water_body", ("water",), gap_m=3.0, least_m2=4.0),
    Area("debris_field", ("debris slab", "debris wall", "debris beam"), 3.0, 3.0, ignored=("debris rubble",)),
    Area("fire_region", ("fire",), gap_m=3.0, least_m2=1.5, burns=True),
)
"""The paper's classes. What makes a region of them is ours."""
NEAREST_M = 1.5
"""Frames with anything nearer to the camera are taken elsewhere."""
TRIES = 20
SHORE_M = 0.1
"""Water as shallow as this is a shore: its bottom is seen, and what lies under it looks like land in the shade."""
SHORES = 0.7
"""Of the places in a flood near which pictures are taken to learn from; ours. Of its water 0.15 is so shallow (18
floods of seed 4), as of the other pictures' places."""
LAWNS, PAVED = 0.6, ("asphalt", "concrete")
"""Of these shores those on open ground: there shallow water looks like shade, and networks that had seen it on streets
for the most part gave 5 cm of it over a lawn a share of 0.0 to 0.2. Ours."""
WET_TRIES, WET_PLACES = 4000, 100
MOST_REGIONS = 255
"""Of a picture's, that are known by their pixels: of later ones, which are single stones, by their boxes."""


def jobs(plan: Plan) -> list[Job]:
    """The usual family's worlds are dealt kind by kind; the other families are sets of their own."""
    worlds = math.ceil(plan.images / plan.per_world)
    others = math.ceil(plan.held_out / plan.per_world)
    usual = [Job(plan, "usual", k, dealt(k // len(variation.KINDS))) for k in range(worlds)]
    return usual + [Job(plan, family, k, family) for family in variation.FAMILIES[1:] for k in range(others)]


def draw(job: Job) -> World:
    """One world's frames."""
    drawn = variation.world(job.number, job.family, job.plan.seed)
    about = {"kind": drawn.description.name, "haze_1_m": drawn.haze_1_m,
             "sun_deg": drawn.description.light.elevation_deg}  # fmt: skip
    return World(about, _frames(job, drawn))


def _frames(job: Job, drawn: variation.Drawn) -> Iterator[Frame]:
    eye = Eye(drawn, Intrinsics(job.plan.width, job.plan.height))
    rng = np.random.default_rng((job.plan.seed, job.number, variation.FAMILIES.index(job.family), 13))
    targets = targets_of(drawn, rng, SHORES if job.split == "train" else None)
    recorder = eye.recorder
    for _ in range(job.plan.per_world):
        for _ in range(TRIES):
            shot = variation.shot(rng, drawn, targets)
            image = eye.take(shot)
            if recorder.view.depth_m.min() > NEAREST_M:
                break
        seen = masked_regions(recorder.scene, recorder.view, recorder.camera, AREAS, shot.time_s)
        regions = np.zeros(image.shape[:2], np.uint8)
        for number, (_, mask) in enumerate(seen[:MOST_REGIONS], start=1):
            regions[mask] = number
        yield Frame(image, [one for one, _ in seen], shot._asdict(), regions)


def targets_of(
    drawn: variation.Drawn, rng: np.random.Generator, shores: float | None = None
) -> list[tuple[float, float]]:
    """Places (north, east) where something of the classes is, or near; so large a share of water's are shores.

    None: as many as there are.
    """
    described = drawn.description
    places = [(each.north_m, each.east_m) for each in described.solids if each.label.startswith("debris")]
    for fire in described.fires:
        corners = np.array(fire.polygon_m)
        shares = rng.dirichlet(np.ones(len(corners)), 40)
        places += [(float(n), float(e)) for n, e in shares @ corners]
    for water in described.water:
        area = np.array(described.area_m)
        north, east = rng.uniform(area.min(axis=0), area.max(axis=0), (WET_TRIES, 2)).T
        ground_m = np.array([drawn.terrain.height_m(n, e) for n, e in zip(north, east, strict=True)])
        deep_m = np.where(polygons.inside(water.polygon_m, north, east), water.level_m - ground_m, 0.0)
        deep, shallow = deep_m > SHORE_M, (deep_m > 0.0) & (deep_m <= SHORE_M)
        parts = [(deep | shallow, 1.0)]
        if shores is not None:
            lawn = shallow & ~is_paved(described.ground, north, east)
            parts = [(deep, 1.0 - shores), (lawn, LAWNS * shores), (shallow & ~lawn, (1.0 - LAWNS) * shores)]
        for wet, share in parts:
            there = list(zip(north[wet].tolist(), east[wet].tolist(), strict=True))
            places += there[: round(share * WET_PLACES)]
    return places


def is_paved(ground: Ground, north: FloatArray, east: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether places lie on a street or a pavement; what lies on top counts."""
    paved = np.full(north.shape, ground.use in PAVED)
    for land in ground.land:
        paved[polygons.inside(land.polygon_m, north, east)] = land.use in PAVED
    return paved


SUBJECT = Subject(tuple(area.label for area in AREAS), jobs, draw)
