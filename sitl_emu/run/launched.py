"""A process of `sitl-emu launch`: the vehicles that fly in it, from their data to their end. `launch` begins it."""

import contextlib
import functools
import os
import resource
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NamedTuple

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.events import events
from sitl_emu.core import ports
from sitl_emu.run import components, models
from sitl_emu.run.autopilot_host import AutopilotHost, Hosted, HostPoll
from sitl_emu.run.dds_socket import Agent, DdsSocket
from sitl_emu.run.fleet import Fleet, Member
from sitl_emu.run.link_sockets import Poll, PortInUseError
from sitl_emu.run.memory import trim_heap
from sitl_emu.run.pacing import Pacer, clock_s, unix_time_us
from sitl_emu.run.site import Site
from sitl_emu.vehicles import Vehicle, with_parcel
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator

if TYPE_CHECKING:
    from sitl_emu.run.configs import RosVehicleData
    from sitl_emu.run.photographer import Photographer
    from sitl_emu.run.ros_line import RosLine


LOOPBACK = "127.0.0.1"
RING_SLOTS = 8
"""Frames that a camera's memory holds: half a second of 15 Hz; ROS 2's process reads each as it is told of it."""


class Launched(NamedTuple):
    """One vehicle of a launch."""

    model: str
    """Its name, or its folder."""
    instance: int
    offset_m: float
    """How far east of the first of the row in which the vehicles of a launch stand."""
    root: Path
    """Where it keeps its files."""

    @property
    def title(self) -> str:
        """For people."""
        return f"{self.model} (instance {self.instance})"


class Crew(NamedTuple):
    """The vehicles of one process, and what they have in common."""

    vehicles: Sequence[Launched]
    site: Site
    shared: bool
    """The site is a world which stays as it is when a vehicle reboots; else the vehicle begins anew at its place."""
    speed: float
    """Times real time; inf for no limit."""
    gcs: tuple[str, int] | None
    tlog: Path | None
    """The folder of the telemetry logs; None: none are kept."""
    video: bool = False
    """Whether what their cameras see is sent to the ground station."""
    parcels: bool = False
    """Whether those that have a release carry a parcel."""
    dds: bool = False
    """Whether they speak to ROS 2."""
    tells_clock: bool = False
    """Whether ROS 2 hears /clock from it."""
    start_us: int | None = None
    """The date at which simulated time began; None: the computer's clock is the time."""


def preload(model: str) -> None:
    """Read what every vehicle of a model reads from files when it begins, into caches that forked processes share."""
    data = models.load(model)
    components.plug_in(data, Autopilot(data.airframe, 0))
    events.table()


def main(crew: Crew, say: Callable[[str], None], on_begun: Callable[[], None], launcher: int | None = None) -> int:
    """Fly until all vehicles were shut down, or SIGTERM or Ctrl-C; the exit status, 1 where one has failed.

    `on_begun` is called when all ports are open and the vehicles have their places. `launcher` is the process that
    forked this one, whose death ends it as well. Raises Trouble where a vehicle would start in something.
    """
    asked_to_end, flying = list[int](), False

    def end(number: int, _frame: FrameType | None) -> None:
        # Looked at between ticks: an exception that is raised wherever a signal falls may be lost there.
        asked_to_end.append(number)
        if not flying:
            raise KeyboardInterrupt

    _allow_files()
    poll: HostPoll = Poll()
    status = 0
    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as stack:
        signal.signal(signal.SIGTERM, end)
        hosts, agent = list[AutopilotHost](), None
        for each in crew.vehicles:
            try:
                if crew.dds and agent is None:
                    agent = stack.enter_context(contextlib.closing(_agent(crew)))
                dds = agent.sockets[each.instance] if agent is not None else None
                hosts.append(stack.enter_context(contextlib.closing(_host(crew, each, poll, dds))))
            except PortInUseError as error:
                print(f"sitl-emu: {each.title}: {error}", file=sys.stderr)
                return 1
            except OSError as error:
                where = f"{error.filename}: " if error.filename else ""
                print(f"sitl-emu: {each.title}: {where}{error.strerror}", file=sys.stderr)
                return 1
        if launcher is None:  # else the launcher has done so
            trim_heap()
        renewals = [functools.partial(_simulator, crew, each) for each in crew.vehicles]
        members = [
            Member(each.title, host, None if crew.shared else renewal)
            for each, host, renewal in zip(crew.vehicles, hosts, renewals, strict=True)
        ]
        simulators = [renewal() for renewal in renewals]
        simulation = Simulation(simulators, crew.site.solids, crew.site.areas, isolated=True)
        photographer = _photographer(crew, simulation)
        if photographer is not None:
            stack.enter_context(contextlib.closing(photographer))
        ros = _ros(crew, simulation, hosts, photographer, say)
        if ros is not None:
            stack.enter_context(contextlib.closing(ros))
        fleet = Fleet(members, simulation, poll, say, photographer, ros)
        on_begun()
        flying = True
        try:
            fleet.fly(Pacer(crew.speed), lambda: bool(asked_to_end) or launcher not in (None, os.getppid()))
        finally:
            status = 1 if fleet.failed else 0
    return status


def _agent(crew: Crew) -> Agent:
    """Who speaks DDS for the vehicles of a crew. Raises OSError."""
    return Agent([vehicle.instance for vehicle in crew.vehicles])


def _host(crew: Crew, vehicle: Launched, poll: HostPoll, dds: DdsSocket | None = None) -> AutopilotHost:
    data = models.load(vehicle.model)
    hosted = Hosted(
        instance=vehicle.instance,
        airframe=data.airframe,
        camera=data.camera,
        gimbal=data.gimbal,
        root=vehicle.root,
        gcs=crew.gcs,
        speed=crew.speed,
        tlog=crew.tlog / f"{data.model}-{vehicle.instance}" if crew.tlog is not None else None,
        mates=len(crew.vehicles),
        tells_gimbal=_is_drawn(crew, data) and data.camera is not None and data.camera.mount == "gimbal",
        pictures=_is_drawn(crew, data),
        video=crew.video and _is_drawn(crew, data),
        start_us=crew.start_us,
        display=True,
        dds=dds,
        tells_clock=crew.tells_clock,
    )
    return AutopilotHost(hosted, poll)


def _is_drawn(crew: Crew, data: Vehicle) -> bool:
    """Whether what a vehicle's camera takes pictures of is drawn: in a world there is something to see."""
    return crew.site.world is not None and data.camera is not None


def _photographer(crew: Crew, simulation: Simulation) -> "Photographer | None":
    """Who draws what the cameras of a crew see; None where nothing is to be drawn. Raises OSError."""
    data = [models.load(vehicle.model) for vehicle in crew.vehicles]
    if crew.site.world is None or not any(_is_drawn(crew, each) for each in data):
        return None
    from sitl_emu.components.video_stream import BIT_RATE
    from sitl_emu.run.configs import RingData, VideoData
    from sitl_emu.run.photographer import Photographer, Sitter

    host = crew.gcs[0] if crew.gcs is not None else LOOPBACK
    sitters = []
    for (model, instance, _, root), each in zip(crew.vehicles, data, strict=True):
        films = crew.video and _is_drawn(crew, each)
        video = VideoData(host=host, port=ports.video(instance), bit_rate=BIT_RATE) if films else None
        ring = RingData(name=_ring(instance, "camera"), slots=RING_SLOTS) if films and crew.dds else None
        sitters.append(Sitter(_name(each, instance), model, each, root, video, ring))
    # what ROS 2 hears comes as often in simulated time as a camera has it
    clock = (lambda: simulation.simulators[0].time_usec * 1e-6) if crew.dds else clock_s
    return Photographer(crew.site.world, crew.site.seed, simulation, sitters, clock)


def _ros(
    crew: Crew,
    simulation: Simulation,
    hosts: Sequence[AutopilotHost],
    photographer: "Photographer | None",
    say: Callable[[str], None],
) -> "RosLine | None":
    """Who tells ROS 2 of the world that a crew shares; None where it shares none, or does not speak to ROS 2.

    Raises OSError.
    """
    if crew.site.world is None or not crew.dds:
        return None
    from sitl_emu.run.range_feeds import RangeFeeds
    from sitl_emu.run.ros_line import RosLine

    vehicles = [_ros_vehicle(crew, each) for each in crew.vehicles]
    start_us = crew.start_us if crew.start_us is not None else unix_time_us()

    def time_0_us() -> int | None:
        return next((host.dds_start_us for host in hosts if not host.off), None)

    measures = any(each.depth is not None or each.lidar is not None for each in vehicles)
    models_of = [each.model for each in crew.vehicles]
    ranges = RangeFeeds(vehicles, models_of, simulation, crew.site.world, crew.site.seed) if measures else None
    return RosLine(vehicles, simulation, photographer, start_us, time_0_us, say, ranges)


def _ros_vehicle(crew: Crew, vehicle: Launched) -> "RosVehicleData":
    from sitl_emu.run import cameras, range_feeds
    from sitl_emu.run.configs import RosVehicleData

    data = models.load(vehicle.model)
    films = crew.video and _is_drawn(crew, data)
    depth, lidar = range_feeds.of_data(data)
    feeds = {"camera": films, range_feeds.DEPTH: depth is not None, range_feeds.LIDAR: lidar is not None}
    return RosVehicleData(
        name=_name(data, vehicle.instance),
        instance=vehicle.instance,
        range_finder=data.sensors.lidar is not None,
        camera=cameras.of_data(data) if films else None,
        depth=depth,
        lidar=lidar,
        rings={feed: _ring(vehicle.instance, feed) for feed, there in feeds.items() if there},
    )


def _name(data: Vehicle, instance: int) -> str:
    """A vehicle's: of its noise, in pictures of others, and before its frames in ROS 2."""
    return f"{data.model}-{instance}"


def _ring(instance: int, feed: str) -> str:
    """The shared memory of a vehicle's feed."""
    return f"sitl_emu-{os.getpid()}-{instance}-{feed}"


def _simulator(crew: Crew, vehicle: Launched) -> VehicleSimulator:
    data = models.load(vehicle.model)
    if crew.parcels and data.release is not None:
        data = with_parcel(data, {})
    return crew.site.simulator(data, vehicle.offset_m, _name(data, vehicle.instance))


def _allow_files() -> None:
    """Let the process open as many files as the system allows it: a vehicle takes four sockets and its logs."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
