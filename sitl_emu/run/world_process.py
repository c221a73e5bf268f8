"""The world process of a run: holds the world, the simulators and the radio, and beats time at the asked speed.

The only process of a run that looks at a clock to pace it; all others follow. Its sockets are the simulator's TCP
4560+i (`tcp_channel.py`; in an isolated run any free port), the radio's and the control channels, which it inherits
from the launcher.
"""

import math
import socket
import time
from collections import deque
from pathlib import Path

from sitl_emu.core import ports
from sitl_emu.core.simulator_api import ChannelClosed
from sitl_emu.core.tcp_channel import SimulatorListener
from sitl_emu.run import starts, worlds
from sitl_emu.run.carried import Carried
from sitl_emu.run.conductor import BARRIER_TICKS, Conductor, VehicleInRun
from sitl_emu.run.configs import ROOTFS, VehicleData, WorldConfig
from sitl_emu.run.control import BARRIER_LIMIT_S, ControlChannel, ProcessLostError, inherited
from sitl_emu.run.faults import Injector, Timeline, said
from sitl_emu.run.feed_in_run import FeedInRun
from sitl_emu.run.link_sockets import PortInUseError, PrivateSocket
from sitl_emu.run.memory import settle
from sitl_emu.run.messages import (
    CommandEnded,
    End,
    EventTold,
    Figures,
    Kill,
    Killed,
    Listening,
    Message,
    Over,
    Progress,
    RadioCounts,
    Ready,
    Start,
    Stop,
    VehicleProgress,
    Waiting,
)
from sitl_emu.run.obstacle_socket import ObstacleSocket
from sitl_emu.run.outside_channel import OutsideChannel
from sitl_emu.run.pacing import Pacer
from sitl_emu.run.process import StartError, main, signal_name
from sitl_emu.run.recorder import RunRecorder
from sitl_emu.run.ros.seen import SeenByRos
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.world import World

LARGEST_DATAGRAM_BYTES = 65535
RECEIVE_BUFFER_BYTES = 4 << 20
UNDER_WAY_LIMIT_S = 10.0
START_LIMIT_S = 90.0
STATUS_PERIOD_S = 0.25
SUCCESS = "success"
GRACE_US = 1_000_000
"""Simulated time that a run goes on after its companions are done, so that the logs show how it ended."""


class RadioSocket:
    """The radio's socket for one companion."""

    def __init__(self, opened: socket.socket) -> None:
        self._socket = opened
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self.peer: tuple[str, int] | None = None
        """Where the companion listens; an outside companion is sent nothing until it has spoken."""

    def receive(self, exactly: int | None) -> list[bytes]:
        """Exactly so many datagrams of the peer, or (None) those that wait."""
        datagrams = list[bytes]()
        self._socket.settimeout(0.0 if exactly is None else UNDER_WAY_LIMIT_S)
        while exactly is None or len(datagrams) < exactly:
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM_BYTES)
            except BlockingIOError:
                break
            if exactly is None:
                self.peer = sender
            if sender == self.peer:
                datagrams.append(data)
        return datagrams

    def send(self, data: bytes) -> None:
        """To the companion."""
        if self.peer is not None:
            self._socket.sendto(data, self.peer)


def run(config: WorldConfig, launcher: ControlChannel) -> None:
    """Set the world up, run it until it is over, and tell the launcher how it ended."""
    world = world_of(config)
    names = [vehicle.name for vehicle in config.vehicles]
    timeline = Timeline(config.faults)

    def hear(told: EventTold) -> None:
        launcher.send(told)
        timeline.hear(told.event.time_us, told.vehicle, told.event.kind, told.event.text)

    recorder = RunRecorder(Path(config.folder), names, hear)
    try:
        listeners = [SimulatorListener(_simulator_port(vehicle)) for vehicle in config.vehicles]
    except OSError as error:
        raise StartError(error.strerror or str(error)) from None
    launcher.send(Listening(world.truth(0.0), world.home))
    over = Over("")
    conductor, stopwatch = None, Stopwatch()
    try:
        simulators = [
            starts.simulator(vehicle.name, vehicle.model, vehicle.start, world, config.seed)
            for vehicle in config.vehicles
        ]
        simulation = Simulation(simulators, world.solids, world.areas)
        members = [
            _vehicle(vehicle, simulator, listener, Path(config.folder))
            for vehicle, simulator, listener in zip(config.vehicles, simulation.simulators, listeners, strict=True)
        ]
        ros = inherited(config.ros_fd, "the ROS 2 process") if config.ros_fd is not None else None
        _wait_until_ready(members, ros)
        onlooker = SeenByRos(ros) if ros is not None else None
        conductor = Conductor(members, simulation, config.radio, config.seed, recorder, world.sees, onlooker)
        line = LauncherLine(launcher)
        by_name = {simulator.name: simulator for simulator in simulation.simulators}
        injector = Injector(timeline, conductor, by_name, recorder, line.kill)
        outcome = _beat_time(conductor, injector, line, config, stopwatch)
        left = tuple(f"{fault.vehicle}: {said(fault.fault, True)}" for fault in timeline.waiting)
        over = Over(outcome, faults=tuple(injector.told), faults_left=left)
    except (ProcessLostError, ChannelClosed) as error:
        over = Over("", lost=str(error))
    finally:
        recorder.close()
    launcher.send(over._replace(figures=_figures(conductor, stopwatch) if conductor is not None else None))


def world_of(config: WorldConfig) -> World:
    """The run's world, with the run's gusts. Raises StartError."""
    try:
        world = worlds.kept(config.world, config.seed)
        if any(vehicle.model.parcel is not None for vehicle in config.vehicles):
            worlds.expect_parcels(world)
    except worlds.WorldError as error:
        raise StartError(str(error)) from None
    return world


def _simulator_port(data: VehicleData) -> int:
    """Where the autopilot is to find its simulator; 0: on any free port."""
    return ports.simulator(data.instance) if data.isolated is None else 0


def _vehicle(data: VehicleData, simulator: VehicleSimulator, listener: SimulatorListener, folder: Path) -> VehicleInRun:
    name, carried = data.name, None
    if data.autopilot_fd is None:
        channel = listener.accept(START_LIMIT_S)
        channel.limit_answers(BARRIER_LIMIT_S)
        carried = _carried(data, simulator, folder)
        outside = OutsideChannel(channel, simulator.vehicle, carried)
        vehicle = VehicleInRun(name, simulator, outside, outside=True)
    else:
        autopilot = inherited(data.autopilot_fd, f"autopilot {name}")
        autopilot.expect(Waiting)
        autopilot.send(Start(listener.port))
        channel = listener.accept(START_LIMIT_S)
        channel.limit_answers(BARRIER_LIMIT_S)
        vehicle = VehicleInRun(name, simulator, channel)
        autopilot.expect(Ready)
        vehicle.autopilot = autopilot if data.lockstep else None
    vehicle.model = data.model.model
    if data.companion_fd is not None:
        vehicle.companion = inherited(data.companion_fd, f"companion {name}")
    vehicle.feeds = [
        FeedInRun(
            each.feed,
            inherited(each.fd, f"{each.feed} {name}"),
            each.rate_hz,
            round(each.latency_s * 1e6),
            each.on_gimbal,
        )
        for each in data.feeds
    ]
    if data.tells_obstacles:
        try:
            sender = carried.on_payload_link if carried is not None else None
            end = data.isolated.sensors if data.isolated is not None else None
            private = PrivateSocket.inherited(end) if end is not None else None
            vehicle.obstacle_link = ObstacleSocket(data.instance, sender, private)
        except OSError as error:
            raise StartError(f"UDP port {ports.payload(data.instance).remote}: {error.strerror}") from None
    if data.radio_fd is not None:
        vehicle.peer = RadioSocket(socket.socket(fileno=data.radio_fd))
    return vehicle


def _carried(data: VehicleData, simulator: VehicleSimulator, folder: Path) -> Carried | None:
    """Camera and gimbal for an autopilot from outside, where it is to have them. Raises StartError."""
    if not data.components:
        return None
    root = folder / ROOTFS / data.name if data.model.camera is not None else None
    try:
        return Carried(simulator.vehicle, data.instance, root, video=data.video)
    except PortInUseError as error:
        raise StartError(str(error)) from None


def _wait_until_ready(members: list[VehicleInRun], ros: ControlChannel | None) -> None:
    """Feeds first, then the companions and ROS 2's process, which look for them."""
    for member in members:
        for feed in member.feeds:
            feed.control.expect(Ready)
    if ros is not None:
        ros.send(Start())
        ros.expect(Ready)
    for member in members:
        if member.companion is not None:
            member.companion.expect(Waiting)
            member.companion.send(Start())
    for member in members:
        if member.companion is not None:
            port = member.companion.expect(Ready).peer_port
            if isinstance(member.peer, RadioSocket) and port is not None:
                member.peer.peer = ("127.0.0.1", port)


class LauncherLine:
    """The launcher's channel while the run goes on: what it says, and what it is asked to do."""

    def __init__(self, launcher: ControlChannel) -> None:
        self._launcher = launcher
        self._heard = deque[Message]()
        self.killed = set[str]()
        """Titles of the processes that were killed."""

    def send(self, message: Message) -> None:
        """To the launcher."""
        self._launcher.send(message)

    def poll(self) -> Message | None:
        """What it has said, the oldest first."""
        return self._heard.popleft() if self._heard else self._launcher.poll()

    def kill(self, title: str) -> None:
        """Have a process killed; returns when it is dead."""
        self._launcher.send(Kill(title))
        while not isinstance(message := self._launcher.receive(), Killed):
            self._heard.append(message)
        self.killed.add(title)


def _beat_time(
    conductor: Conductor, injector: Injector, launcher: LauncherLine, config: WorldConfig, stopwatch: "Stopwatch"
) -> str:
    """Tick until the mission is done, its time is up, or the launcher says stop; the outcome."""
    speed, limit_us = config.speed, round(config.time_limit_s * 1e6)
    commands = set(config.commands)
    ours = any(member.companion is not None for member in conductor.vehicles)
    settle()
    pacer = Pacer(math.inf if speed is None else speed)
    shown_s = time.monotonic()
    over_us, outcome, ended = 0, "", dict[str, int]()
    pacer.start()
    while not over_us or conductor.now_us < over_us:
        injector.step()
        conductor.tick()
        pacer.next_tick()
        if (left := pacer.remaining_s()) > 0.0:
            time.sleep(left)
        if conductor.ticks % BARRIER_TICKS:
            continue
        now_s = time.monotonic()
        stopwatch.look(conductor, now_s)
        if now_s - shown_s >= STATUS_PERIOD_S:
            shown_s = now_s
            launcher.send(_progress(conductor, stopwatch.elapsed_s))
        while (message := launcher.poll()) is not None:
            if isinstance(message, Stop):
                over_us, outcome = conductor.now_us, message.why
            elif isinstance(message, CommandEnded):
                ended[message.vehicle] = message.exit_status
        if not over_us:
            crashed = {vehicle.name for vehicle in conductor.vehicles if vehicle.crashed}
            waited_for = {name for name in commands - crashed if f"companion {name}" not in launcher.killed}
            if (ours or commands) and conductor.done and ended.keys() >= waited_for:
                over_us = conductor.now_us + GRACE_US
                failed = [f"companion {name}: {_how(status)}" for name, status in ended.items() if status]
                outcome = "; ".join(failed) or conductor.outcome
            elif off := _shut_down(conductor, commands):
                over_us, outcome = conductor.now_us + GRACE_US, off
            elif conductor.now_us >= limit_us:
                over_us, outcome = conductor.now_us, "time limit reached"
    outcome = "; ".join([*([outcome] if outcome != SUCCESS or not injector.killed else []), *injector.killed])
    conductor.finish()
    for member in conductor.vehicles:
        for control in (member.companion, *(feed.control for feed in member.feeds)):
            if control is not None:
                control.send(End())
    return outcome


def _shut_down(conductor: Conductor, commands: set[str]) -> str:
    """Which autopilots are off, where the run can't go on without them; else empty.

    That is so where a companion of ours has lost its vehicle before it was done, and where no vehicle is left. Commands
    of the user's decide for themselves when they are done.
    """
    off = [member for member in conductor.vehicles if member.off and "autopilot" not in member.lost]
    lost = any(member.companion is not None and not (member.status and member.status.done) for member in off)
    if lost or (not commands and len(off) == len(conductor.vehicles)):
        return f"autopilot shut down: {', '.join(member.name for member in off)}"
    return ""


def _how(status: int) -> str:
    return f"killed by {signal_name(-status)}" if status < 0 else f"exit status {status}"


class Stopwatch:
    """Simulated and wall time from the first arming to the last disarming."""

    def __init__(self) -> None:
        self.elapsed_s = 0.0
        """Wall time since the first look."""
        self._started_s: float | None = None
        self.first: tuple[float, float] | None = None
        self.last: tuple[float, float] | None = None
        self._armed = False

    def look(self, conductor: Conductor, wall_s: float) -> None:
        """Once a barrier."""
        self._started_s = wall_s if self._started_s is None else self._started_s
        self.elapsed_s = wall_s - self._started_s
        armed = any(member.armed for member in conductor.vehicles)
        if armed and self.first is None:
            self.first = (conductor.now_us / 1e6, wall_s)
        if armed or self._armed:
            self.last = (conductor.now_us / 1e6, wall_s)
        self._armed = armed

    @property
    def speed_factor(self) -> float | None:
        """Simulated over wall time; None where nothing armed."""
        if self.first is None or self.last is None or self.last[1] <= self.first[1]:
            return None
        return (self.last[0] - self.first[0]) / (self.last[1] - self.first[1])


def _progress(conductor: Conductor, wall_s: float) -> Progress:
    vehicles = {member.name: _vehicle_progress(member) for member in conductor.vehicles}
    return Progress(conductor.now_us / 1e6, wall_s, vehicles)


def _vehicle_progress(member: VehicleInRun) -> VehicleProgress:
    pose = member.simulator.pose()
    position_m = (round(pose.north_m, 1), round(pose.east_m, 1), round(-pose.down_m, 1))
    return VehicleProgress(member.armed, member.status, position_m, _pictures(member))


def _pictures(member: VehicleInRun) -> int | None:
    """How many its camera has taken; None where it has none."""
    return next((feed.rendered for feed in member.feeds if feed.feed == "camera"), None)


def _figures(conductor: Conductor, stopwatch: Stopwatch) -> Figures:
    return Figures(
        simulated_s=conductor.now_us / 1e6,
        wall_s=stopwatch.elapsed_s,
        speed_factor=stopwatch.speed_factor,
        frames_rendered=sum(_pictures(member) or 0 for member in conductor.vehicles),
        frames_dropped=sum(member.frames_dropped for member in conductor.vehicles),
        radio={name: RadioCounts(*counts) for name, counts in conductor.radio_counts.items()},
        armed_at_end=tuple(member.name for member in conductor.vehicles if member.armed),
        companions={member.name: member.status for member in conductor.vehicles if member.companion is not None},
    )


if __name__ == "__main__":
    main(run, WorldConfig, "the launcher")
