"""All that stands in a scene, as the arrays that the kernels read."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.kernel import F32, I32
from sitl_emu.world.render.model import WHITE, Colour, Model, lengths
from sitl_emu.world.render.raster import Instances, Meshes

Matrix = npt.NDArray[np.float64]
UNTURNED = np.eye(3)


class Stage:
    """Meshes and their instances. An object is what a pixel is said to show; it may have several instances."""

    def __init__(self) -> None:
        self.names: list[str] = []
        """Of objects, by number."""
        self.labels: list[str] = []
        self._corners: list[F32] = []
        self._uv: list[F32] = []
        self._triangles: list[tuple[I32, F32, I32, F32]] = []
        self._corner_count = self._triangle_count = 0
        self._levels: list[tuple[int, int, int, int]] = []
        self._errors: list[float] = []
        self._radii: list[float] = []
        """Of each level."""
        self._rows: list[tuple[int, int, Matrix, Sequence[float], int, int, Colour]] = []

    def add_object(self, name: str, label: str) -> int:
        """Its number."""
        self.names.append(name)
        self.labels.append(label)
        return len(self.names) - 1

    def add_triangles(self, model: Model) -> tuple[int, int]:
        """Triangles alone, which several levels may share: their range."""
        first = self._triangle_count
        self._triangles.append((model.triangles, model.normals, model.materials, model.tints))
        self._triangle_count += len(model.triangles)
        return first, self._triangle_count

    def add_level(self, corners: F32, uv: F32, triangles: tuple[int, int], error_m: float = 0.0) -> int:
        """A level of detail: its number; those of one mesh are added one after another, the finest first."""
        first = self._corner_count
        self._corners.append(corners)
        self._uv.append(uv)
        self._corner_count += len(corners)
        self._levels.append((first, self._corner_count, *triangles))
        self._errors.append(error_m)
        self._radii.append(float(lengths(corners.astype(np.float64)).max()))
        return len(self._levels) - 1

    def add_model(self, model: Model, *coarser: tuple[Model, float]) -> tuple[int, int]:
        """A mesh with coarser levels and how far they err: its first level and their count."""
        first = self.add_level(model.corners, model.uv, self.add_triangles(model))
        for level, error_m in coarser:
            self.add_level(level.corners, level.uv, self.add_triangles(level), error_m)
        return first, 1 + len(coarser)

    def place(
        self, mesh: tuple[int, int], number: int, at: Sequence[float], turn: Matrix = UNTURNED, flags: int = 0,
        tint: Colour = WHITE,
    ) -> int:  # fmt: skip
        """An instance of a mesh for an object: its number, the row in `Instances`."""
        self._rows.append((*mesh, turn, at, number, flags, tint))
        return len(self._rows) - 1

    def packed(self) -> tuple[Meshes, Instances]:
        """As the kernels read them; corners, poses, flags and radii may be changed in place."""
        # What was joined is kept instead of its parts: they would take as much memory once more
        self._corners, self._uv = [np.concatenate(self._corners)], [np.concatenate(self._uv)]
        indices, normals, materials, tints = (np.concatenate(parts) for parts in zip(*self._triangles, strict=True))
        self._triangles = [(indices, normals, materials, tints)]
        meshes = Meshes(
            self._corners[0], self._uv[0], indices, normals, materials, tints,
            np.array(self._levels, np.int32), np.array(self._errors, np.float32),
        )  # fmt: skip
        first, count, turn, at, number, flags, tint = zip(*self._rows, strict=True)
        radius = [max(self._radii[f : f + c]) for f, c in zip(first, count, strict=True)]
        instances = Instances(
            np.array(first, np.int32), np.array(count, np.int32), np.array(turn, np.float64), np.array(at, np.float64),
            np.array(radius), np.array(flags, np.int32), np.array(number, np.int32), np.array(tint, np.float32),
        )  # fmt: skip
        return meshes, instances
