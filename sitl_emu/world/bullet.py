"""PyBullet (Bullet physics): loaded where a world has bodies to meet; its shapes, made of ours. Its axes are NED, in m.

Used for geometry (a query against 300 hulls 16 µs, a ray 2 µs) and for loose bodies; vehicles fly by our own dynamics.
"""

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import Quaternion
from sitl_emu.vehicles.dynamics import Vector3
from sitl_emu.world.description import Box, Cylinder, Solid, WorldError

FloatArray = npt.NDArray[np.float64]

STREAMS = (1, 2)
"""Standard output, where older versions speak, and standard error."""
MESH_SUFFIXES = (".obj", ".stl", ".ply", ".glb", ".gltf")


def load(what: str) -> Any:
    """PyBullet's module; `what` of a world needs it. Raises WorldError, which says what to do."""
    try:
        with _quiet():
            import pybullet
    except ImportError:
        raise WorldError(
            f"this world has {what}, which need PyBullet: `pip install pybullet`; "
            "its wheels end with Python 3.11, so make your .venv with python3.11"
        ) from None
    return pybullet


def xyzw(q: Quaternion) -> tuple[float, float, float, float]:
    """A quaternion as Bullet has it."""
    return q[1], q[2], q[3], q[0]


def shape(bullet: Any, client: int, solid: Solid, folder: Path) -> int:
    """Bullet's number of a solid's shape; `folder`: where mesh files lie. Raises WorldError."""
    made: int
    if solid.box is not None:
        made = box(bullet, client, solid.box)
    elif solid.cylinder is not None:
        made = cylinder(bullet, client, solid.cylinder)
    elif solid.hull is not None:
        points = [(north, east, -up) for north, east, up in solid.hull.points_m]
        made = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=points, physicsClientId=client)
    else:
        assert solid.mesh is not None
        points, triangles = read_mesh(folder / solid.mesh.file, solid.mesh.scale)
        made = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=points, indices=triangles, physicsClientId=client)
    if made < 0:
        raise WorldError(f"solids {solid.name!r}: its shape can't be built")
    return made


def box(bullet: Any, client: int, described: Box) -> int:
    """Bullet counts from its middle."""
    half = [0.5 * side for side in described.size_m]
    made: int = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
    return made


def cylinder(bullet: Any, client: int, described: Cylinder) -> int:
    """Bullet counts from its middle."""
    made: int = bullet.createCollisionShape(
        bullet.GEOM_CYLINDER, radius=described.radius_m, height=described.height_m, physicsClientId=client
    )
    return made


def read_mesh(path: Path, scale: float) -> tuple[list[Vector3], list[int]]:
    """Corners (NED, m, about the mesh's origin) and triangles of a mesh file. Raises WorldError."""
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise WorldError(f"mesh file {path}: must be one of {', '.join(MESH_SUFFIXES)}")
    if not path.is_file():
        raise WorldError(f"mesh file {path}: there is no such file")
    import trimesh  # half a second, for worlds with meshes alone

    try:
        loaded = trimesh.load(path, force="mesh")
        corners, triangles = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, int)
    except Exception:  # a parser's any, in words about its insides
        raise WorldError(f"mesh file {path}: can't be read: broken, or no {path.suffix} file of triangles") from None
    if not len(triangles):
        raise WorldError(f"mesh file {path}: there are no triangles in it")
    if path.suffix.lower() in {".glb", ".gltf"}:
        # glTF 2.0: y up, z forward, x to the left
        corners = corners[:, [2, 0, 1]]
    ned = corners * (scale, -scale, -scale)
    return [(float(n), float(e), float(d)) for n, e, d in ned], triangles.ravel().tolist()


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """PyBullet tells when it was built as it is imported, by C's printf, which may keep it in a buffer."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = {number: os.dup(number) for number in STREAMS}
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for number in STREAMS:
        os.dup2(nowhere, number)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)
        for number, stream in kept.items():
            os.dup2(stream, number)
            os.close(stream)
        os.close(nowhere)
