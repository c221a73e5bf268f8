"""The noise of a run's cameras follows from the run's seed, also in a world file, which is painted by another."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu import vehicles
from sitl_emu.run import camera_process, cameras, worlds
from sitl_emu.run.configs import CameraConfig
from sitl_emu.world.camera import Camera, Pose

FILE = "name: own\nground: {use: soil}\n"
ABOVE = Pose(0.0, 0.0, -12.0, (1.0, 0.0, 0.0, 0.0))


def picture(kept: Path, seed: int, model: str) -> npt.NDArray[np.float64]:
    """(height, width, 3), BGR: as the camera's process draws it."""
    described = cameras.of_data(vehicles.load(model))
    config = CameraConfig(
        folder=str(kept.parent), start_us=0, seed=seed, name="uas", world=str(kept), camera=described, ring=None
    )
    scene = worlds.kept(str(kept), is_met=False).scene()
    return np.asarray(camera_process.camera_of(config, scene).render(ABOVE, 100_000)).astype(float)


@pytest.mark.parametrize("model", ["responder", "m600"])
def test_a_files_pictures_differ_by_their_noise_alone(tmp_path: Path, model: str) -> None:
    """By a camera with figures of its own, and by the plain one."""
    (tmp_path / "own.yaml").write_text(FILE)
    kept = worlds.keep(worlds.build(str(tmp_path / "own.yaml"), 1, {}), tmp_path)
    first, other, again = (picture(kept, seed, model) for seed in (1, 2, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert abs(float((first - other).mean())) < 0.5, "it is the same ground in the same light"


@pytest.mark.parametrize("kind", ["corn_field", "debris_field"])
def test_a_generated_worlds_pictures_have_the_noise_of_the_seed_it_is_made_from(tmp_path: Path, kind: str) -> None:
    kept = worlds.keep(worlds.build(kind, 5, {}), tmp_path)
    described = cameras.of_data(vehicles.load("m600"))
    scene = worlds.kept(str(kept), is_met=False).scene()
    bare = Camera(scene, cameras.mount(described), cameras.intrinsics(described), "uas", described.sensor)
    assert np.array_equal(picture(kept, 5, "m600"), bare.render(ABOVE, 100_000))
