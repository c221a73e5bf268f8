"""What Embree sees of a scene: the independent oracle of the rasteriser."""

import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.world.render.scene import MeshRenderer, MeshScene

WIDTH, HEIGHT, FOCAL_PX = 640, 480, 320.0
NOTHING = -1


def seen_by_rays(
    scene: MeshScene, renderer: MeshRenderer, place: npt.NDArray[np.float64], axes: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Objects (NOTHING: none) and depth along the optical axis, m, both (HEIGHT, WIDTH).

    Of the triangles that the renderer has just drawn; `place` and `axes` (columns: right, down, ahead) in NED as it was
    given them. Skips the test where embreex is missing.
    """
    rtcore_scene = pytest.importorskip("embreex.rtcore_scene", reason="embreex has no wheel for this machine")
    from embreex.mesh_construction import TriangleMesh

    drawn, meshes, things = renderer._drawn, scene.meshes, scene.things
    corners, objects = [], []
    for instance, level in zip(drawn.instance[: renderer.count], drawn.level, strict=False):
        first, end, begin, stop = meshes.levels[level]
        own = meshes.corners[first:end].astype(float) @ things.rotation[instance].T + things.place[instance] - place
        corners.append(own[meshes.triangles[begin:stop]])
        objects += [int(things.objects[instance])] * (stop - begin)
    soup = rtcore_scene.EmbreeScene()
    TriangleMesh(soup, np.concatenate(corners).astype(np.float32))
    rays = rays_of(axes).astype(np.float32)
    met = soup.run(np.zeros_like(rays), rays, output=True)
    theirs = np.where(met["primID"] >= 0, np.array([*objects, NOTHING])[met["primID"]], NOTHING)
    return theirs.reshape(HEIGHT, WIDTH), met["tfar"].reshape(HEIGHT, WIDTH)


def rays_of(axes: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(HEIGHT * WIDTH, 3): through the pixels' middles, in NED, 1 long along the optical axis."""
    x, y = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / FOCAL_PX, (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / FOCAL_PX
    grid = np.stack((*np.meshgrid(x, y), np.ones((HEIGHT, WIDTH))), axis=2).reshape(-1, 3)
    return np.asarray(grid @ axes.T)
