"""What the cameras of a launch in a world see, as pictures, as video and for ROS 2: a process per camera draws it.

Drawing takes longer than a tick, and a world may take seconds to be painted: the vehicles fly on meanwhile. The
autopilot is told when a picture is there; a frame, of video and for ROS 2 alike, is drawn when the one before is done.
A process is started at a camera's first picture, or at once where its frames are wanted.
"""

import contextlib
import os
import socket
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from sitl_emu.components.card import FOLDER
from sitl_emu.core import frame_ring
from sitl_emu.core.simulator_api import CameraZoom, GimbalState, HilActuatorControls, PictureTaken
from sitl_emu.run import cameras, poses, worlds
from sitl_emu.run.children import STOP_S, Child, end_all, obituary_of_lost, start_process
from sitl_emu.run.configs import CameraConfig, RingData, VideoData
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.messages import (
    End,
    FrameTaken,
    Photograph,
    Photographed,
    Ready,
    Render,
    Rendered,
    SendVideo,
    VehicleAt,
)
from sitl_emu.run.pacing import clock_s
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.world import World

MODE_FLAG_SAFETY_ARMED = 128


class Sitter(NamedTuple):
    """A vehicle: it is seen by others, and its camera, if it has one, takes pictures."""

    name: str
    model: str
    """As `sitl_emu.vehicles.load` takes it."""
    data: Vehicle
    root: Path
    """The folder that stands for its autopilot's file system."""
    video: VideoData | None = None
    """Where its camera's video goes; None: it sends none."""
    ring: RingData | None = None
    """The shared memory that its camera's frames go to; None: nobody reads them."""

    @property
    def on_gimbal(self) -> bool:
        """Whether its camera is."""
        return self.data.camera is not None and self.data.camera.mount == "gimbal"


@dataclass
class _Studio:
    """A vehicle's process that draws."""

    child: Child
    control: ControlChannel
    every_s: float
    """Between two frames of its video."""
    asked: list[int] = field(default_factory=list)
    """Pictures that are not there yet."""
    frames: int = 0
    """Asked for."""
    taken_us: int = 0
    """When the last of them was, in simulated time."""
    busy: bool = True
    """It is being set up, or draws a frame."""
    due_s: float = 0.0
    """When the next frame is."""


class Photographer:
    """Has pictures and video drawn, each picture where its vehicle's autopilot finds it."""

    def __init__(
        self,
        world: World,
        seed: int,
        simulation: Simulation,
        sitters: Sequence[Sitter],
        clock: Callable[[], float] = clock_s,
    ) -> None:
        """`sitters` in the order of the simulation. Raises OSError where the world can't be kept for a while.

        `seed`: of the cameras' noise. `clock`: by which frames are drawn, s.
        """
        self._seed, self._simulation, self._sitters, self._clock = seed, simulation, sitters, clock
        self._folder = tempfile.TemporaryDirectory(prefix="sitl_emu-")
        self._world = worlds.keep(world, Path(self._folder.name))
        (Path(self._folder.name) / "logs").mkdir()
        self._shared = os.fdopen(os.memfd_create("sitl_emu-cameras"), "rb")
        self._studios: dict[int, _Studio] = {}
        self._filmed = set[int]()
        self._rings = {place: sitter.ring for place, sitter in enumerate(sitters) if sitter.ring is not None}
        self.frames: list[tuple[int, FrameTaken]] = []
        """Frames that lie in the rings, with their vehicles' places; emptied by who reads them."""
        self.gimbals: dict[int, GimbalState] = {}
        """Where gimbals look, by the places of their vehicles."""
        self.zooms: dict[int, CameraZoom] = {}
        """How far cameras have zoomed, likewise."""
        self.complaints: list[str] = []
        """Why pictures could not be drawn, for people; emptied by who tells them."""
        for place, sitter in enumerate(sitters):
            if sitter.video is not None or sitter.ring is not None:
                self._open(place)

    def take(self, place: int, number: int, controls: Sequence[HilActuatorControls | None]) -> None:
        """Have a picture drawn. `controls`: what the autopilots of all vehicles have said last."""
        studio = self._studios.get(place) or self._open(place)
        studio.asked.append(number)
        time_us = self._simulation.simulators[place].time_usec
        with contextlib.suppress(ProcessLostError):  # `taken` finds it gone, too
            studio.control.send(Photograph(number, time_us, *self._seen_from(place, controls)))

    def taken(self) -> list[tuple[int, PictureTaken]]:
        """With their vehicles' places, the pictures that are there, or can't be drawn, since this was asked last."""
        found = list[tuple[int, PictureTaken]]()
        for place, studio in list(self._studios.items()):
            try:
                while (message := studio.control.poll()) is not None:
                    if isinstance(message, Photographed):
                        studio.asked.remove(message.number)
                        found.append((place, PictureTaken(message.number, True)))
                    elif isinstance(message, Ready | Rendered):
                        studio.busy = False
                        if isinstance(message, Rendered) and place in self._rings:
                            self.frames.append((place, FrameTaken("camera", message.index, studio.taken_us)))
            except ProcessLostError:
                found += [(place, PictureTaken(number, False)) for number in studio.asked]
                del self._studios[place]
                studio.control.close()
                self.complaints.append(obituary_of_lost(studio.child))
                self._remove_ring(place)
        return found

    def send_video(self, place: int, running: bool) -> None:
        """Send the video of a camera from now on, or no more."""
        if running:
            self._filmed.add(place)
        else:
            self._filmed.discard(place)
        studio = self._studios.get(place)
        if studio is not None:
            with contextlib.suppress(ProcessLostError):
                studio.control.send(SendVideo(running))

    def forget_frames(self) -> None:
        """Nobody reads frames any more."""
        self._rings.clear()
        self.frames.clear()

    def film(self, flying: Collection[int], controls: Sequence[HilActuatorControls | None]) -> None:
        """Have the frames drawn that are due, of vehicles that are on; each tick."""
        if not self._filmed and not self._rings:
            return
        now_s = self._clock()
        for place in self._filmed | self._rings.keys():
            studio = self._studios.get(place)
            if studio is None or studio.busy or now_s < studio.due_s or place not in flying:
                continue
            in_beat = now_s - studio.due_s < studio.every_s
            studio.due_s = (studio.due_s if in_beat else now_s) + studio.every_s
            studio.busy = True
            studio.taken_us = self._simulation.simulators[place].time_usec
            with contextlib.suppress(ProcessLostError):
                studio.control.send(Render(studio.frames, studio.taken_us, *self._seen_from(place, controls)))
            studio.frames += 1

    def close(self) -> None:
        """End all that draw. May be called twice."""
        for studio in self._studios.values():
            with contextlib.suppress(ProcessLostError):
                studio.control.send(End())
            studio.control.close()
        end_all([studio.child for studio in self._studios.values()], STOP_S)
        self._studios.clear()
        for place in range(len(self._sitters)):
            self._remove_ring(place)
        self._shared.close()
        self._folder.cleanup()

    def _remove_ring(self, place: int) -> None:
        """Of a camera whose process has ended: one that began anew would write to another, which nobody reads."""
        self._rings.pop(place, None)
        if (ring := self._sitters[place].ring) is not None:
            frame_ring.remove_if_left(ring.name)

    def _seen_from(self, place: int, controls: Sequence[HilActuatorControls | None]) -> poses.SeenFrom:
        pose = self._simulation.simulators[place].pose()
        loose, others = self._simulation.loose_poses(), self._others(place, controls)
        on_gimbal, zoom = self._sitters[place].on_gimbal, self.zooms.get(place)
        return poses.seen_from(pose, on_gimbal, self.gimbals.get(place), loose, others, zoom)

    def _others(self, place: int, controls: Sequence[HilActuatorControls | None]) -> Iterator[VehicleAt]:
        for other, sitter in enumerate(self._sitters):
            if other != place:
                said = controls[other]
                armed = said is not None and said.mode & MODE_FLAG_SAFETY_ARMED != 0
                where = poses.body(self._simulation.simulators[other].pose())
                yield VehicleAt(sitter.name, sitter.model, where, armed)

    def _open(self, place: int) -> _Studio:
        sitter = self._sitters[place]
        (sitter.root / FOLDER).mkdir(exist_ok=True)
        ours, its = socket.socketpair()
        camera = cameras.of_data(sitter.data)
        config = CameraConfig(
            folder=self._folder.name,
            start_us=0,
            seed=self._seed,
            name=sitter.name,
            world=str(self._world),
            camera=camera,
            ring=self._rings.get(place),
            card=str(sitter.root),
            shared_fd=self._shared.fileno(),
            video=sitter.video,
        )
        title = f"camera {sitter.name}"
        with its:
            child = start_process(title, "camera_process", config, its, Path(self._folder.name))
        studio = self._studios[place] = _Studio(child, ControlChannel(ours, title), 1.0 / camera.rate_hz)
        if place in self._filmed:
            self.send_video(place, True)
        return studio
