"""The world of a run, for its page: its picture from above, and its truth at a time. Built when first asked for."""

import threading
from pathlib import Path
from typing import Any

from sitl_emu.run import ground_picture, worlds
from sitl_emu.world.description import WorldError
from sitl_emu.world.world import World


class WorldShown:
    """Asked by many threads; a world answers one at a time."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock = folder, threading.Lock()
        self._world: World | None = None
        self._failed = False
        self._picture: bytes | None = None

    def truth(self, time_s: float) -> dict[str, Any]:
        """`World.truth`; nothing where the world can't be built on this machine."""
        with self._lock:
            world = self._built()
            return world.truth(time_s) if world is not None else {}

    def picture(self) -> bytes | None:
        """A JPEG of the area, north up: the run's own, if it has kept one by now, else drawn. None: it can't be."""
        kept = self._folder / ground_picture.FILE
        with self._lock:
            if self._picture is None and kept.is_file():
                self._picture = kept.read_bytes()
            if self._picture is None and (world := self._built()) is not None:
                self._picture = self._drawn(world)
            return self._picture

    def _drawn(self, world: World) -> bytes | None:
        try:
            photo = world.photo()
        except WorldError:
            return None
        return None if photo is None else ground_picture.encoded(photo)

    def _built(self) -> World | None:
        if self._world is None and not self._failed:
            try:
                self._world = worlds.kept(str(self._folder / worlds.KEPT_AS))
            except worlds.WorldError:
                self._failed = True
        return self._world
