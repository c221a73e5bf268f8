"""Weed and disease in corn, from the air and from a rover's mast; and the first paper's things, over other worlds.

Fields are of seeds that no mission is likely to fly. `light` holds fields under a low, warm sun; there is no `asset`.
"""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import camera_model
from sitl_emu.missions.companion.camera_model import CameraModel, camera_pose, project
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.description import Light
from sitl_emu.world.kinds.corn_field import field as corn
from sitl_emu.world.kinds.corn_field.objects import FieldObject, outline
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.lens import MAST, NADIR, Intrinsics
from sitl_emu.world.render.truth import Seen, things_in
from tools.detector import variation
from tools.detector.plan import Frame, Job, Plan, Subject, World, dealt
from tools.detector.recorder import Eye

Rng = np.random.Generator
PATCHES = ("weed", "disease")
THINGS = {"truck": "truck", "car": "car", "person": "person", "stop_sign": "stop sign"}
"""By the world's label, what they are called."""
FIRST_SEED = 10_000
STAGES = (8, 5, 7, 8, 6, 7)
"""Growth stages of the fields, in turn: the more the rows close, the harder it is."""
TARGETS, DISTRACTORS = 16, 56
"""More than a mission meets: a field is dear, a look at it cheap."""
SMALL_SHARE, SMALL_M = 0.5, (0.36, 0.55)
"""So many of a field's weeds are of a radius that our networks miss; the others as a mission has them."""
SMALL_LOOKS, LOOKALIKE_LOOKS = 0.5, 0.2
"""Of the pictures of corn: so many are taken near a patch, a small one more often, and so many near a look-alike."""
LOOKALIKES = ("residue", "pale_corn")
"""What a network of ours takes for disease: all of the six that it reported alone on fields 300 to 313."""
THINGS_SHARE, MAST_SHARE = 0.25, 0.20
"""Of the worlds; the others are corn from the air and, every third picture, from the mast."""
SEEDS = {"corn": 0, "light": 5_000, "mast": 7_000}
"""Where the seeds of each family's fields begin, counted from FIRST_SEED."""
FAMILIES = ("corn", "things", "light", "mast")
LEAST_PX, LEAST_SHARE = 9.0, 0.25
"""A patch with a shorter side, or of which the picture cuts off more, is ignored."""
CAMERA_UP_M = 0.2
"""Of the rover's body, from which its mast is counted."""
LIFT = 0.3
"""How high an outline is seen, of the plants' height."""
NEAREST_M = 0.8
TRIES = 20


def jobs(plan: Plan) -> list[Job]:
    """Each family is dealt by itself."""
    worlds = math.ceil(plan.images / plan.per_world)
    things, mast = round(THINGS_SHARE * worlds), round(MAST_SHARE * worlds)
    counts = {"corn": worlds - things - mast, "things": things, "mast": mast}
    made = [Job(plan, family, k, dealt(k)) for family, count in counts.items() for k in range(count)]
    return made + [Job(plan, "light", k, "light") for k in range(math.ceil(plan.held_out / plan.per_world))]


def draw(job: Job) -> World:
    """One world's frames."""
    if job.family == "things":
        drawn = variation.world(job.number, "usual", job.plan.seed + FIRST_SEED)
        light = drawn.description.light
        about = {"kind": drawn.description.name, "haze_1_m": drawn.haze_1_m, "sun_deg": light.elevation_deg}
        return World(about, _of_things(job, drawn))
    field = field_of(job)
    about = {"kind": "corn_field", "haze_1_m": 0.0, "sun_deg": field.light.elevation_deg}
    return World(about, _of_corn(job, field))


def _rng(job: Job) -> Rng:
    return np.random.default_rng((job.plan.seed, job.number, FAMILIES.index(job.family), 17))


# --- corn -------------------------------------------------------------------------------------------------------------


def field_of(job: Job) -> corn.CornField:
    """A job's field."""
    is_light = job.family == "light"
    seed = FIRST_SEED * job.plan.seed + SEEDS[job.family] + job.number
    stage = STAGES[job.number % len(STAGES)]
    field = corn.build(seed, targets=TARGETS, distractors=DISTRACTORS, growth_stage=stage)
    rng = np.random.default_rng((seed, 18))
    elevation_deg, warmth = ((8.0, 22.0), (1.08, 1.22)) if is_light else ((25.0, 70.0), (0.9, 1.15))
    light = Light(
        azimuth_deg=field.light.azimuth_deg,
        elevation_deg=float(rng.uniform(*elevation_deg)),
        gain=float(rng.uniform(0.95, 1.45)),
        warmth=float(rng.uniform(*warmth)),
    )
    return dataclasses.replace(field, light=light, objects=tuple(_shrunk(rng, thing) for thing in field.objects))


def _shrunk(rng: Rng, thing: FieldObject) -> FieldObject:
    """Now and then a small weed instead of a weed."""
    is_small, radius_m = rng.random() < SMALL_SHARE, float(rng.uniform(*SMALL_M))
    return thing._replace(radius_m=radius_m) if thing.kind == "weed" and is_small else thing


def _of_corn(job: Job, field: corn.CornField) -> Iterator[Frame]:
    """From the air, at any heading, and from a mast in front of a patch or a distractor."""
    rng, lens = _rng(job), Intrinsics(job.plan.width, job.plan.height)
    scene = FieldScene(field)
    nadir, mast = Camera(scene, NADIR, lens), Camera(scene, MAST, lens)
    model = CameraModel(
        lens.width, lens.height, lens.focal_px, lens.focal_px, (lens.width - 1) / 2, (lens.height - 1) / 2
    )
    # What is small is what is missed: the more often it is looked at.
    weights = np.array([1.0 / thing.radius_m**2 for thing in field.targets])
    small_first = weights / weights.sum()
    lookalikes = [thing for thing in field.objects if thing.kind in LOOKALIKES]
    for k in range(job.plan.per_world):
        near = float(rng.random())
        if near < SMALL_LOOKS:
            thing = field.targets[int(rng.choice(len(field.targets), p=small_first))]
        else:
            others = lookalikes if near < SMALL_LOOKS + LOOKALIKE_LOOKS and lookalikes else field.objects
            thing = others[int(rng.integers(len(others)))]
        is_low = job.family == "mast" or k % 3 == 2
        pose = _in_front(rng, field, thing) if is_low else _over(rng, field, thing)
        mount = camera_model.MAST if is_low else camera_model.NADIR
        image = (mast if is_low else nadir).render(pose, int(rng.integers(1 << 40)))
        above = -pose.down_m - field.terrain.height_m(pose.north_m, pose.east_m)
        shot = {"north_m": pose.north_m, "east_m": pose.east_m, "above_m": above, "is_mast": is_low}
        yield Frame(image, patches(field, model, pose, mount), shot)


def _tilted(rng: Rng, sigma_rad: float, heading_rad: float) -> tuple[float, float, float, float]:
    return quaternion(float(rng.normal(scale=sigma_rad)), float(rng.normal(scale=sigma_rad)), heading_rad)


def _over(rng: Rng, field: corn.CornField, thing: FieldObject) -> Pose:
    """Above something, or now and then anywhere: mostly 9 to 24 m, else 5 to 40 m."""
    low, high = (9.0, 24.0) if rng.random() < 0.8 else (5.0, 40.0)
    above = math.exp(float(rng.uniform(math.log(low), math.log(high))))
    if rng.random() < 0.15:
        north, east = rng.uniform(-5.0, field.size_m[0] + 5.0), rng.uniform(-5.0, field.size_m[1] + 5.0)
    else:
        north, east = np.array((thing.north_m, thing.east_m)) + rng.uniform(-0.7, 0.7, 2) * above
    down = -field.terrain.height_m(float(north), float(east)) - above
    return Pose(float(north), float(east), down, _tilted(rng, 0.06, float(rng.uniform(0, math.tau))))


def _in_front(rng: Rng, field: corn.CornField, thing: FieldObject) -> Pose:
    """A rover's place, mostly along the rows."""
    along = 0.0 if rng.random() < 0.5 else math.pi
    yaw = along + float(rng.normal(scale=0.15)) if rng.random() < 0.7 else float(rng.uniform(0, math.tau))
    ahead, aside = float(rng.uniform(0.2, 3.5)), float(rng.normal(scale=0.4))
    north = thing.north_m - ahead * math.cos(yaw) - aside * math.sin(yaw)
    east = thing.east_m - ahead * math.sin(yaw) + aside * math.cos(yaw)
    down = -field.terrain.height_m(north, east) - CAMERA_UP_M
    return Pose(north, east, down, _tilted(rng, 0.04, yaw + float(rng.normal(scale=0.15))))


def patches(field: corn.CornField, model: CameraModel, pose: Pose, mount: camera_model.Mount) -> list[Seen]:
    """The boxes of all targets' outlines."""
    camera = camera_pose((pose.north_m, pose.east_m, pose.down_m), pose.q, mount)
    lift = LIFT * field.plant_height_m
    found = []
    for thing in field.targets:
        corners = [
            project(model, camera, (n, e, -field.terrain.height_m(n, e) - lift)) for n, e in outline(thing).tolist()
        ]
        ahead = [corner for corner in corners if corner is not None]
        if len(ahead) == len(corners):
            found += _boxed(thing.kind, np.array(ahead), model)
    return found


def _boxed(label: str, corners: npt.NDArray[np.float64], model: CameraModel) -> list[Seen]:
    """The box of an outline in pixels, or none if the picture does not reach it."""
    size = np.array((model.width, model.height), np.float64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    inner_low, inner_high = np.clip(low, 0, size), np.clip(high, 0, size)
    sides = inner_high - inner_low
    if sides.min() < 1.0:
        return []
    least_px = LEAST_PX * model.height / 480.0
    share = sides.prod() / (high - low).prod()
    is_ignored = bool(sides.min() < least_px or share < LEAST_SHARE)
    left, top, right, bottom = (round(float(each), 2) for each in (*inner_low, *inner_high))
    box = (left, top, right, bottom)
    return [Seen(label, label, box, None, round(float(sides.prod())), 0.0, bool(share < 1.0), is_ignored)]


# --- things -----------------------------------------------------------------------------------------------------------


def _of_things(job: Job, drawn: variation.Drawn) -> Iterator[Frame]:
    """From the air, and two times of three from beside: a sign is nothing from above."""
    rng = _rng(job)
    eye = Eye(drawn, Intrinsics(job.plan.width, job.plan.height))
    recorder = eye.recorder
    things = [thing for thing in drawn.description.things if thing.label in THINGS]
    places = [(thing.north_m, thing.east_m) for thing in things]
    labels = sorted({thing.label for thing in things})
    for k in range(job.plan.per_world):
        for _ in range(TRIES):
            if k % 3 and things:
                label = labels[int(rng.integers(len(labels)))]
                alike = [place for place, thing in zip(places, things, strict=True) if thing.label == label]
                shot = _beside(rng, alike[int(rng.integers(len(alike)))])
            else:
                shot = variation.shot(rng, drawn, places)
            image = eye.take(shot)
            if recorder.view.depth_m.min() > NEAREST_M:
                break
        least_px = LEAST_PX * job.plan.height / 480.0
        seen = things_in(recorder.scene, recorder.view, recorder.camera, THINGS, least_px)
        hidden = [one._replace(is_ignored=one.is_ignored or one.hidden > 1.0 - LEAST_SHARE) for one in seen]
        yield Frame(image, hidden, shot._asdict())


def _beside(rng: Rng, place: tuple[float, float]) -> variation.Shot:
    """4 to 18 m away, 1.2 to 6 m up, and looking that way."""
    away, above = float(rng.uniform(4.0, 18.0)), math.exp(float(rng.uniform(math.log(1.2), math.log(6.0))))
    heading = float(rng.uniform(-math.pi, math.pi))
    north, east = place[0] - away * math.cos(heading), place[1] - away * math.sin(heading)
    below = math.atan2(above - 1.0, away)
    return variation.Shot(
        north, east, above, heading + float(rng.normal(scale=0.3)),
        0.5 * math.pi - below + float(rng.normal(scale=0.1)), float(rng.normal(scale=0.04)),
        float(rng.uniform(1.0, 120.0)),
    )  # fmt: skip


SUBJECT = Subject((*PATCHES, *THINGS.values()), jobs, draw)
