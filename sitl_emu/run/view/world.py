"""The world of a run, for its page: its picture from above, and its truth at a time. Built when first asked for."""

import threading
from pathlib import Path
from typing import Any

from sitl_emu.run import ground_picture, worlds
from sitl_emu.run.loose_in_run import LooseInRun
from sitl_emu.run.recorder import LOOSE
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.description import WorldError
from sitl_emu.world.world import World, loose_truth


class WorldShown:
    """Asked by many threads; a world answers one at a time."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock = folder, threading.Lock()
        self._world: World | None = None
        self._failed = False
        self._picture: bytes | None = None
        self._loose: LooseInRun | None = None
        self._loose_bytes = -1
        """How much of their file was read."""

    def truth(self, time_s: float) -> dict[str, Any]:
        """`World.truth`, with loose bodies where they were then; nothing where the world can't be built on this
        machine."""
        with self._lock:
            world = self._built()
            if world is None:
                return {}
            loose = self._loose_bodies(world)
            return world.truth(time_s) | ({} if loose is None else {"loose": loose_truth(loose.at(time_s))})

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

    def _loose_bodies(self, world: World) -> LooseInRun | None:
        """None where loose.csv is none, and they are shown where they began. It is read again when it has grown."""
        path = self._folder / LOOSE
        size = path.stat().st_size if path.is_file() else -1
        if size != self._loose_bytes:
            self._loose_bytes = size
            try:
                self._loose = LooseInRun(self._folder, world)
            except Trouble:
                self._loose = None
        return self._loose

    def _built(self) -> World | None:
        if self._world is None and not self._failed:
            try:
                self._world = worlds.kept(str(self._folder / worlds.KEPT_AS))
            except worlds.WorldError:
                self._failed = True
        return self._world
