"""Which processes a run has, and the sockets that join them.

The world process holds a control channel to every autopilot, camera and companion of ours, and the radio's socket for
each companion where there are several. All sockets are made here before any process is started, so that each inherits
its own, and closed here when all have them.
"""

import math
import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from sitl_emu import vehicles
from sitl_emu.core import frame_ring, ports
from sitl_emu.run import models, worlds
from sitl_emu.run.children import Child, start_command, start_process
from sitl_emu.run.configs import (
    ROOTFS,
    AutopilotConfig,
    CameraConfig,
    CompanionConfig,
    FeedData,
    IsolatedLinks,
    LinkEnd,
    ProcessConfig,
    RangeConfig,
    RingData,
    RosConfig,
    RosVehicleData,
    StartPlace,
    VehicleData,
    VideoData,
    WorldConfig,
)
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.outside_autopilot import environment, filled
from sitl_emu.run.scenario import Scenario
from sitl_emu.run.scenario_parts.vehicle import CompanionPart, VehiclePart

LOOPBACK = "127.0.0.1"


class Wanted(NamedTuple):
    """A run to be made."""

    scenario: Scenario
    seed: int
    speed: float | None
    """Times real time; None: as fast as it goes."""
    folder: Path
    gcs: tuple[str, int] | None = None
    first_instance: int = 0
    video: bool = False
    """Whether what cameras see is sent to the ground station."""
    dds: bool = False
    """Whether our autopilots speak to ROS 2, which is told of clock, sensors and frames, too."""
    isolated: bool = False
    """Whether it keeps to itself: no ground station, none of PX4's ports, so that many runs go on side by side."""


class Process(NamedTuple):
    """A process of ours that is to be started."""

    title: str
    module: str
    config: ProcessConfig
    end: socket.socket
    """Its end of the control channel."""


class Command(NamedTuple):
    """A program of the user's that is to be started: a companion, or an autopilot from outside."""

    title: str
    arguments: list[str]
    env: dict[str, str]
    """What is added to the environment."""


class Member(NamedTuple):
    """A vehicle: what the world process is told of it, and its other processes."""

    data: VehicleData
    processes: list[Process]
    autopilot: Command | None
    companion: Command | None


class Sockets:
    """The sockets that join the processes of a run, and the memory that its cameras share."""

    def __init__(self) -> None:
        self.opened: list[socket.socket] = []
        self._shared_fd: int | None = None

    def channel(self) -> tuple[socket.socket, socket.socket]:
        """A control channel: the world's end, and the other."""
        both = socket.socketpair()
        self.opened.extend(both)
        return both

    def packets(self) -> tuple[socket.socket, socket.socket]:
        """A control channel that keeps packets apart, so that what has no room can be left out."""
        both = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.opened.extend(both)
        return both

    def radio(self) -> socket.socket:
        """A UDP socket of the radio, on a port of its own."""
        radio = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.opened.append(radio)
        radio.bind((LOOPBACK, 0))
        return radio

    def link(self) -> tuple[LinkEnd, LinkEnd]:
        """Both ends of a link of UDP datagrams, on free ports."""
        one, other = self.radio(), self.radio()
        one_port, other_port = one.getsockname()[1], other.getsockname()[1]
        return LinkEnd(fd=one.fileno(), other_port=other_port), LinkEnd(fd=other.fileno(), other_port=one_port)

    def shared_fd(self) -> int:
        """Memory of the cameras, one for all: without a name, and gone with the last process that holds it."""
        if self._shared_fd is None:
            self._shared_fd = os.memfd_create("sitl_emu-cameras")
        return self._shared_fd

    def close(self) -> None:
        """In this process; who has inherited one keeps it."""
        for opened in self.opened:
            opened.close()
        if self._shared_fd is not None:
            os.close(self._shared_fd)


@contextmanager
def _sockets() -> Iterator[Sockets]:
    sockets = Sockets()
    try:
        yield sockets
    finally:
        sockets.close()


def start(wanted: Wanted, children: list[Child]) -> ControlChannel:
    """Start all processes, which are added to `children`; the launcher's end of the world's control channel.

    Raises Trouble where a companion's command can't be started.
    """
    launcher_end, world_end = socket.socketpair()
    control = ControlChannel(launcher_end, "the world process")
    with _sockets() as sockets, world_end:
        numbered = enumerate(wanted.scenario.vehicles, wanted.first_instance)
        members = [_member(wanted, instance, vehicle, sockets) for instance, vehicle in numbered]
        ros = _ros(wanted, sockets) if wanted.dds else None
        config = _world(wanted, members, ros[0] if ros is not None else None)
        children.append(start_process("world", "world_process", config, world_end, wanted.folder))
        if ros is not None:
            children.append(start_process(*ros[1], wanted.folder))
        for member in members:
            for process in member.processes:
                children.append(start_process(*process, wanted.folder))
            if member.autopilot is not None:
                children.append(start_command(*member.autopilot, wanted.folder, autopilot=True))
        for member in members:
            if member.companion is not None:
                children.append(start_command(*member.companion, wanted.folder))
    return control


def _ros(wanted: Wanted, sockets: Sockets) -> tuple[int, Process]:
    """The world's end of the channel to who tells ROS 2 of it, and that process."""
    world_end, end = sockets.packets()
    told = tuple(
        RosVehicleData(
            name=vehicle.name,
            instance=instance,
            range_finder=models.as_set(vehicle.model_data).sensors.lidar is not None,
            camera=vehicle.camera_description,
            depth=vehicle.depth_description,
            lidar=vehicle.lidar_description,
            rings=_rings(vehicle),
        )
        for instance, vehicle in enumerate(wanted.scenario.vehicles, wanted.first_instance)
    )
    config = RosConfig(folder=str(wanted.folder), start_us=wanted.scenario.start_us, seed=wanted.seed, vehicles=told)
    return world_end.fileno(), Process("ros", "ros_process", config, end)


def _world(wanted: Wanted, members: list[Member], ros_fd: int | None) -> WorldConfig:
    by_command = [each for each in wanted.scenario.vehicles if each.companion and each.companion.command]
    return WorldConfig(
        folder=str(wanted.folder),
        start_us=wanted.scenario.start_us,
        seed=wanted.seed,
        world=str(wanted.folder / worlds.KEPT_AS),
        vehicles=tuple(member.data for member in members),
        radio=wanted.scenario.peer_radio.settings(),
        speed=wanted.speed,
        time_limit_s=wanted.scenario.time_limit_s,
        faults=tuple(fault.data for fault in wanted.scenario.faults),
        commands=tuple(each.name for each in by_command if each.companion and not each.companion.background),
        ros_fd=ros_fd,
    )


def _member(wanted: Wanted, instance: int, vehicle: VehiclePart, sockets: Sockets) -> Member:
    """A vehicle's processes, and the sockets that join them to the world process."""
    companion = vehicle.companion
    has_radio = sum(other.companion is not None for other in wanted.scenario.vehicles) > 1
    radio = sockets.radio() if has_radio and companion is not None else None
    radio_port = radio.getsockname()[1] if radio is not None else None
    processes, command = list[Process](), None
    links = _links(wanted, vehicle, sockets)
    outside = _outside_autopilot(wanted, instance, vehicle) if vehicle.autopilot is not None else None
    autopilot_fd = None if outside is not None else _autopilot(wanted, instance, vehicle, links, sockets, processes)
    feeds = _feeds(wanted, instance, vehicle, sockets, processes)
    companion_fd = None
    if companion is not None and companion.mission is not None:
        companion_fd = _companion(wanted, instance, vehicle, companion, radio_port, links, sockets, processes)
    elif companion is not None:
        words = _words(wanted, instance, vehicle, radio_port)
        arguments = [filled(argument, words) for argument in companion.command or ()]
        command = Command(f"companion {vehicle.name}", arguments, {})
    place = vehicle.start
    data = VehicleData(
        name=vehicle.name,
        model=vehicle.model_data,
        instance=instance,
        lockstep=_in_lockstep(vehicle),
        start=place if isinstance(place, str) else StartPlace(**place.model_dump()),
        autopilot_fd=autopilot_fd,
        components=vehicle.autopilot is not None and vehicle.autopilot.components,
        companion_fd=companion_fd,
        radio_fd=radio.fileno() if radio is not None else None,
        feeds=feeds,
        tells_obstacles=vehicle.tells_obstacles,
        video=_sends_video(wanted, vehicle),
        isolated=links.world,
    )
    return Member(data, processes, outside, command)


class _Links(NamedTuple):
    """The ends of a vehicle's links in an isolated run, by the process that holds them; None in any other run."""

    autopilot: IsolatedLinks | None = None
    companion: IsolatedLinks | None = None
    world: IsolatedLinks | None = None


def _links(wanted: Wanted, vehicle: VehiclePart, sockets: Sockets) -> _Links:
    if not wanted.isolated:
        return _Links()
    onboard = sockets.link() if vehicle.companion is not None else (None, None)
    payload = sockets.link() if vehicle.tells_obstacles else (None, None)
    return _Links(
        IsolatedLinks(companion=onboard[0], sensors=payload[0]),
        IsolatedLinks(companion=onboard[1]),
        IsolatedLinks(sensors=payload[1]),
    )


def _sends_video(wanted: Wanted, vehicle: VehiclePart) -> bool:
    return wanted.video and has_video(vehicle)


def has_video(vehicle: VehiclePart) -> bool:
    """Whether a vehicle has a camera that draws frames and says over MAVLink where they are to be seen."""
    announces = vehicle.autopilot is None or vehicle.autopilot.components
    return vehicle.camera is not None and announces and vehicles.load(vehicle.model).camera is not None


def _in_lockstep(vehicle: VehiclePart) -> bool:
    """Whether the autopilot takes part in barriers: ours, with a companion of ours."""
    return vehicle.autopilot is None and vehicle.companion is not None and vehicle.companion.mission is not None


FEWEST_SLOTS, MORE_SLOTS = 8, 4
"""Of a ring; and how many more than the frames that are under way at a time."""


class Feed(NamedTuple):
    """A feed of a vehicle's, and the process that fills it."""

    name: str
    """"camera", "depth" or "lidar"."""
    rate_hz: float
    latency_s: float
    on_gimbal: bool
    module: str
    config: Callable[..., ProcessConfig]
    """Takes what all processes are told, and the ring."""


def _feeds_of(vehicle: VehiclePart) -> list[Feed]:
    camera, depth, lidar = vehicle.camera_description, vehicle.depth_description, vehicle.lidar_description
    feeds = list[Feed]()
    if camera is not None:
        make: Callable[..., ProcessConfig] = partial(CameraConfig, camera=camera)
        feeds.append(Feed("camera", camera.rate_hz, camera.latency_s, camera.on_gimbal, "camera_process", make))
    if depth is not None:
        make = partial(RangeConfig, depth=depth)
        feeds.append(
            Feed("depth", depth.camera.rate_hz, depth.camera.latency_s, depth.camera.on_gimbal, "range_process", make)
        )
    if lidar is not None:
        make = partial(RangeConfig, lidar=lidar)
        feeds.append(Feed("lidar", lidar.rate_hz, lidar.latency_s, False, "range_process", make))
    return feeds


def _rings(vehicle: VehiclePart) -> dict[str, str]:
    """The names of the shared memory of a vehicle's feeds, by feed."""
    return {feed.name: f"sitl_emu-{os.getpid()}-{vehicle.name}-{feed.name}" for feed in _feeds_of(vehicle)}


def remove_rings(wanted: Wanted) -> None:
    """Remove what the processes of feeds that were killed have left in shared memory."""
    for vehicle in wanted.scenario.vehicles:
        for ring in _rings(vehicle).values():
            frame_ring.remove_if_left(ring)


def _autopilot(
    wanted: Wanted, instance: int, vehicle: VehiclePart, links: _Links, sockets: Sockets, processes: list[Process]
) -> int:
    world_end, end = sockets.channel()
    config = AutopilotConfig(
        folder=str(wanted.folder),
        start_us=wanted.scenario.start_us,
        seed=wanted.seed,
        name=vehicle.name,
        model=vehicle.model_data,
        instance=instance,
        lockstep=_in_lockstep(vehicle),
        gcs=wanted.gcs,
        tells_obstacles=vehicle.tells_obstacles,
        video=_sends_video(wanted, vehicle),
        dds=wanted.dds,
        isolated=links.autopilot,
    )
    processes.append(Process(f"autopilot {vehicle.name}", "autopilot_process", config, end))
    return world_end.fileno()


def _outside_autopilot(wanted: Wanted, instance: int, vehicle: VehiclePart) -> Command:
    """An autopilot of the user's, with a folder of its own."""
    assert vehicle.autopilot is not None
    rootfs = wanted.folder.resolve() / ROOTFS / vehicle.name
    rootfs.mkdir(parents=True)
    data = models.as_set(vehicle.model_data)
    words = {
        "instance": str(instance),
        "port": str(ports.simulator(instance)),
        "name": vehicle.name,
        "model": vehicle.model,
        "rootfs": str(rootfs),
        "out": str(wanted.folder.resolve()),
        "seed": str(wanted.seed),
        "python": sys.executable,
    }
    arguments = [filled(argument, words) for argument in vehicle.autopilot.command]
    env = environment(data, vehicle.autopilot.environment, words)
    return Command(f"autopilot {vehicle.name}", arguments, env)


def _feeds(
    wanted: Wanted, instance: int, vehicle: VehiclePart, sockets: Sockets, processes: list[Process]
) -> tuple[FeedData, ...]:
    rings, told = _rings(vehicle), list[FeedData]()
    for feed in _feeds_of(vehicle):
        world_end, end = sockets.channel()
        under_way = math.ceil(feed.rate_hz * feed.latency_s)
        config = feed.config(
            folder=str(wanted.folder),
            start_us=wanted.scenario.start_us,
            seed=wanted.seed,
            name=vehicle.name,
            world=str(wanted.folder / worlds.KEPT_AS),
            ring=RingData(name=rings[feed.name], slots=max(FEWEST_SLOTS, under_way + MORE_SLOTS)),
        )
        if isinstance(config, CameraConfig):
            card = wanted.folder / ROOTFS / vehicle.name
            video = _video(wanted, instance) if _sends_video(wanted, vehicle) else None
            config = replace(config, shared_fd=sockets.shared_fd(), card=str(card), video=video)
        processes.append(Process(f"{feed.name} {vehicle.name}", feed.module, config, end))
        told.append(
            FeedData(
                feed=feed.name,
                on_gimbal=feed.on_gimbal,
                fd=world_end.fileno(),
                rate_hz=feed.rate_hz,
                latency_s=feed.latency_s,
            )
        )
    return tuple(told)


def _video(wanted: Wanted, instance: int) -> VideoData:
    from sitl_emu.components.video_stream import BIT_RATE  # with MAVLink's messages, for who sends video alone

    host = wanted.gcs[0] if wanted.gcs is not None else LOOPBACK
    return VideoData(host=host, port=ports.video(instance), bit_rate=BIT_RATE)


def _companion(
    wanted: Wanted,
    instance: int,
    vehicle: VehiclePart,
    companion: CompanionPart,
    radio_port: int | None,
    links: _Links,
    sockets: Sockets,
    processes: list[Process],
) -> int:
    assert companion.mission is not None
    world_end, end = sockets.channel()
    config = CompanionConfig(
        folder=str(wanted.folder),
        start_us=wanted.scenario.start_us,
        seed=wanted.seed,
        name=vehicle.name,
        instance=instance,
        lockstep=_in_lockstep(vehicle),
        mission=companion.mission,
        options=companion.options,
        radio_port=radio_port,
        rings=_rings(vehicle),
        inference_latency_us=round(companion.inference_latency_s * 1e6),
        isolated=links.companion,
    )
    processes.append(Process(f"companion {vehicle.name}", "companion_process", config, end))
    return world_end.fileno()


def _words(wanted: Wanted, instance: int, vehicle: VehiclePart, radio_port: int | None) -> dict[str, str]:
    """What a companion's command may name in braces."""
    feeds = {feed: f"shm:{ring}" for feed, ring in _rings(vehicle).items()}
    return {
        "connect": f"udpin:{LOOPBACK}:{ports.onboard(instance).remote}",
        "peer": f"udpout:{LOOPBACK}:{radio_port}" if radio_port is not None else "",
        "camera": feeds.get("camera", ""),
        "depth": feeds.get("depth", ""),
        "lidar": feeds.get("lidar", ""),
        "calibration": str(vehicle.calibration(wanted.folder) or ""),
        "depth_calibration": str(vehicle.depth_calibration(wanted.folder) or ""),
        "out": str(wanted.folder),
        "seed": str(wanted.seed),
        "python": sys.executable,
    }
