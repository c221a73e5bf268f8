"""A corn field as something that cameras look at (camera.Scene)."""

from collections.abc import Sequence

from sitl_emu.world.camera import OtherVehicle
from sitl_emu.world.description import Thing
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.renderer import Renderer
from sitl_emu.world.kinds.corn_field.visitors import Visitors


class FieldScene:
    """One field; its plants stand still."""

    def __init__(self, field: CornField, shared_memory: int | None = None, things: Sequence[Thing] = ()) -> None:
        """`shared_memory`: of the cameras of this field, see whole.py; `things`: of its description."""
        self.field, self._shared_memory = field, shared_memory
        self._visitors = Visitors(field, things)

    @property
    def moves(self) -> bool:
        """See camera.Scene."""
        return self._visitors.move

    def put_vehicles(self, others: Sequence[OtherVehicle]) -> None:
        """See camera.ShowsVehicles."""
        self._visitors.put(others)

    @property
    def seed(self) -> int:
        """See camera.Scene."""
        return self.field.seed

    def ground_m(self, north_m: float, east_m: float) -> float:
        """See camera.Scene."""
        return self.field.terrain.height_m(north_m, east_m)

    def renderer(self, width: int, height: int, focal_px: float) -> Renderer:
        """See camera.Scene."""
        return Renderer(self.field, width, height, focal_px, self._shared_memory, self._visitors)
