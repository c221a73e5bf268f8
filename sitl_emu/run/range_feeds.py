"""What depth cameras and scanning lidars of a launch measure for ROS 2: a process each, as in a run.

A vehicle has those that its data list (`[depth]` and `[lidar]` of its vehicle.toml). To measure takes longer than a
tick, and nobody waits for it: a frame is asked for when it is due, in simulated time, and the one before is done. When
a process has died that is told, and its vehicle flies on.
"""

import contextlib
import dataclasses
import socket
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sitl_emu.core import frame_ring
from sitl_emu.core.simulator_api import GimbalState
from sitl_emu.run import poses, worlds
from sitl_emu.run.children import STOP_S, Child, end_all, obituary_of_lost, start_process
from sitl_emu.run.configs import DepthDescription, LidarDescription, RangeConfig, RingData, RosVehicleData
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.messages import End, FrameTaken, Ready, Render, Rendered, VehicleAt
from sitl_emu.vehicles import TOML, VehicleError
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.world import World

DEPTH, LIDAR = "depth", "lidar"
"""The feeds, as `messages.FrameTaken` names them."""
GIMBAL = "gimbal"
"""`Camera.mount` of a vehicle's data."""
RING_SLOTS = 8
"""Frames that a feed's memory holds: more than ROS 2's process is behind where it can follow at all."""


def of_data(data: Vehicle) -> tuple[DepthDescription | None, LidarDescription | None]:
    """The depth camera and the scanning lidar that a vehicle's data list. Raises VehicleError."""
    if data.depth is None and data.lidar is None:
        return None, None
    from sitl_emu.run.scenario_parts.feeds import DepthPart, LidarPart, checked  # pydantic: slow to import

    where = f"{data.model}/{TOML}"
    try:
        depth = None if data.depth is None else DepthPart(**checked(DepthPart, data.depth, f"{where}: {DEPTH}"))
        lidar = None if data.lidar is None else LidarPart(**checked(LidarPart, data.lidar, f"{where}: {LIDAR}"))
    except ValueError as error:
        raise VehicleError(str(error)) from None
    turned = data.camera is not None and data.camera.mount == GIMBAL
    if depth is not None and depth.description.camera.on_gimbal and not turned:
        raise VehicleError(f"{where}: {DEPTH}.mount: a launch follows the gimbal of a vehicle whose camera it carries")
    return (
        None if depth is None else dataclasses.replace(depth.description, tells_obstacles=False),
        None if lidar is None else dataclasses.replace(lidar.description, tells_obstacles=False),
    )


@dataclass(eq=False)
class _Feed:
    """A feed's process."""

    place: int
    """Of its vehicle, in the simulation."""
    name: str
    on_gimbal: bool
    ring: str
    every_us: float
    child: Child
    control: ControlChannel
    frames: int = 0
    """Asked for."""
    taken_us: int = 0
    """When the last of them was, in simulated time."""
    due_us: float = 0.0
    busy: bool = True
    """It is being set up, or measures."""


class RangeFeeds:
    """Has frames measured, and says when they lie in their rings."""

    def __init__(
        self, vehicles: Sequence[RosVehicleData], models: Sequence[str], simulation: Simulation, world: World, seed: int
    ) -> None:
        """`vehicles` and their `models` (as `vehicles.load` takes them) in the order of the simulation.

        `seed`: of what is measured.

        Raises OSError where the world can't be kept for a while.
        """
        self._simulation, self._named = simulation, [(e.name, m) for e, m in zip(vehicles, models, strict=True)]
        self._folder = tempfile.TemporaryDirectory(prefix="sitl_emu-")
        folder = Path(self._folder.name)
        (folder / "logs").mkdir()
        kept = worlds.keep(world, folder)
        self._feeds = [
            _started(place, name, each, kept, seed) for place, each in enumerate(vehicles) for name in _of(each)
        ]
        self.complaints: list[str] = []
        """Of what is not measured any more, for people; emptied by who tells them."""

    def measured(self) -> list[tuple[int, FrameTaken]]:
        """With their vehicles' places, the frames that are there since this was asked last."""
        found = list[tuple[int, FrameTaken]]()
        for feed in list(self._feeds):
            try:
                while (message := feed.control.poll()) is not None:
                    if isinstance(message, Ready | Rendered):
                        feed.busy = False
                    if isinstance(message, Rendered):
                        found.append((feed.place, FrameTaken(feed.name, message.index, feed.taken_us)))
            except ProcessLostError:
                self._feeds.remove(feed)
                feed.control.close()  # what waits to be told of more hears that nothing comes
                self.complaints.append(f"ROS 2 hears it no more: {obituary_of_lost(feed.child)}")
                _leave(feed)
        return found

    def ask(self, now_us: int, gimbals: Mapping[int, GimbalState]) -> None:
        """Have the frames measured that are due. `gimbals`: where they look, by their vehicles' places."""
        loose = self._simulation.loose_poses()
        for feed in self._feeds:
            if feed.busy or now_us < feed.due_us:
                continue
            in_beat = now_us - feed.due_us < feed.every_us
            feed.due_us = (feed.due_us if in_beat else now_us) + feed.every_us
            feed.busy, feed.taken_us = True, now_us
            pose = self._simulation.simulators[feed.place].pose()
            others = self._others(feed.place)
            seen_from = poses.seen_from(pose, feed.on_gimbal, gimbals.get(feed.place), loose, others)
            with contextlib.suppress(ProcessLostError):  # `measured` finds it gone, too
                feed.control.send(Render(feed.frames, now_us, *seen_from))
            feed.frames += 1

    def _others(self, place: int) -> Iterator[VehicleAt]:
        """Whether motors turn is for pictures alone."""
        for other, (name, model) in enumerate(self._named):
            if other != place:
                yield VehicleAt(name, model, poses.body(self._simulation.simulators[other].pose()), False)

    def close(self) -> None:
        """End all that measure. May be called twice."""
        for feed in self._feeds:
            with contextlib.suppress(ProcessLostError):
                feed.control.send(End())
            feed.control.close()
        end_all([feed.child for feed in self._feeds], STOP_S)
        for feed in self._feeds:
            _leave(feed)
        self._feeds.clear()
        self._folder.cleanup()


def _of(vehicle: RosVehicleData) -> list[str]:
    return [name for name, described in ((DEPTH, vehicle.depth), (LIDAR, vehicle.lidar)) if described is not None]


def _started(place: int, name: str, vehicle: RosVehicleData, world: Path, seed: int) -> _Feed:
    ring = vehicle.rings[name]
    config = RangeConfig(
        folder=str(world.parent),
        start_us=0,
        seed=seed,
        name=vehicle.name,
        world=str(world),
        ring=RingData(name=ring, slots=RING_SLOTS),
        depth=vehicle.depth if name == DEPTH else None,
        lidar=vehicle.lidar if name == LIDAR else None,
    )
    ours, its = socket.socketpair()
    title = f"{name} {vehicle.name}"
    with its:
        child = start_process(title, "range_process", config, its, world.parent)
    on_gimbal = name == DEPTH and vehicle.depth is not None and vehicle.depth.camera.on_gimbal
    return _Feed(place, name, on_gimbal, ring, 1e6 / config.rate_hz, child, ControlChannel(ours, title))


def _leave(feed: _Feed) -> None:
    """Close what a feed had, and remove what a process that was killed has left."""
    feed.control.close()
    frame_ring.remove_if_left(feed.ring)
