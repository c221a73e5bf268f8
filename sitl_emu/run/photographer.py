"""Pictures of the MAVLink cameras of a launch in a world: a process that draws is started at a vehicle's first picture.

Drawing takes longer than a tick, and a world may take seconds to be painted: the vehicles fly on meanwhile, and the
autopilot is told when a picture is there.
"""

import contextlib
import socket
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from sitl_emu.components.card import FOLDER
from sitl_emu.core.simulator_api import GimbalState, PictureTaken
from sitl_emu.run import cameras, worlds
from sitl_emu.run.children import STOP_S, Child, end_all, obituary, start_process
from sitl_emu.run.configs import CameraConfig
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.messages import BodyPose, End, Photograph, Photographed
from sitl_emu.run.poses import head_of
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.camera import Posed
from sitl_emu.world.world import World


class Sitter(NamedTuple):
    """A vehicle whose camera takes pictures."""

    name: str
    data: Vehicle
    root: Path
    """The folder that stands for its autopilot's file system."""


class _Studio(NamedTuple):
    """A vehicle's process that draws."""

    child: Child
    control: ControlChannel
    asked: list[int]


class Photographer:
    """Has pictures drawn, each where its vehicle's autopilot finds it."""

    def __init__(self, world: World, sitters: Mapping[int, Sitter]) -> None:
        """`sitters` by their places in the simulation. Raises OSError where the world can't be kept for a while."""
        self._sitters = sitters
        self._folder = tempfile.TemporaryDirectory(prefix="sitl_emu-")
        self._world = worlds.keep(world, Path(self._folder.name))
        (Path(self._folder.name) / "logs").mkdir()
        self._studios: dict[int, _Studio] = {}
        self.gimbals: dict[int, GimbalState] = {}
        """Where gimbals look, by the places of their vehicles."""
        self.complaints: list[str] = []
        """Why pictures could not be drawn, for people; emptied by who tells them."""

    def take(self, place: int, number: int, time_us: int, pose: Posed) -> None:
        """Have a picture drawn."""
        studio = self._studios.get(place) or self._open(place)
        where = BodyPose(pose.north_m, pose.east_m, pose.down_m, pose.q)
        camera = self._sitters[place].data.camera
        on_gimbal = camera is not None and camera.mount == "gimbal"
        head = head_of(self.gimbals.get(place), where.q) if on_gimbal else None
        studio.asked.append(number)
        with contextlib.suppress(ProcessLostError):  # `taken` finds it gone, too
            studio.control.send(Photograph(number, time_us, where, head))

    def taken(self) -> list[tuple[int, PictureTaken]]:
        """With their vehicles' places, the pictures that are there, or can't be drawn, since this was asked last."""
        found = list[tuple[int, PictureTaken]]()
        for place, studio in list(self._studios.items()):
            try:
                while (message := studio.control.poll()) is not None:
                    if isinstance(message, Photographed):
                        studio.asked.remove(message.number)
                        found.append((place, PictureTaken(message.number, True)))
            except ProcessLostError:
                found += [(place, PictureTaken(number, False)) for number in studio.asked]
                del self._studios[place]
                studio.child.process.wait(STOP_S)
                self.complaints.append(obituary(studio.child))
        return found

    def close(self) -> None:
        """End all that draw."""
        for studio in self._studios.values():
            with contextlib.suppress(ProcessLostError):
                studio.control.send(End())
            studio.control.close()
        end_all([studio.child for studio in self._studios.values()], STOP_S)
        self._folder.cleanup()

    def _open(self, place: int) -> _Studio:
        sitter = self._sitters[place]
        (sitter.root / FOLDER).mkdir(exist_ok=True)
        ours, its = socket.socketpair()
        config = CameraConfig(
            folder=self._folder.name,
            start_us=0,
            seed=0,
            name=sitter.name,
            world=str(self._world),
            camera=cameras.of_data(sitter.data),
            ring=None,
            card=str(sitter.root),
        )
        title = f"camera {sitter.name}"
        with its:
            child = start_process(title, "camera_process", config, its, Path(self._folder.name))
        studio = self._studios[place] = _Studio(child, ControlChannel(ours, title), [])
        return studio
