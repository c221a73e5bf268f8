"""`sitl-emu run`: starts the processes of a scenario, shows how they do, and ends them all whatever happens.

World, cameras, autopilots and companions are processes of their own, joined by control channels that they inherit. When
one dies, the launcher says which, and ends the rest; Ctrl-C and SIGTERM end them too. Each writes what it has to
complain about into `logs/` of the run's folder.
"""

import contextlib
import errno
import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from sitl_emu.core import ports
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.live_view import View
from sitl_emu.run.process import EXIT_EXPLAINED
from sitl_emu.run.scenario import Scenario, VehiclePart
from sitl_emu.run.trouble import Trouble

LOOPBACK = "127.0.0.1"
POLL_S = 0.1
LAST_INSTANCE = 249
"""Its system id is 250, PX4's largest."""
MAX_OWN_OFFBOARD = 8
"""The last instance whose offboard port no other has."""
STOP_S = 2.0
"""How long processes have to end by themselves when a run goes wrong; then they get SIGTERM, and at last SIGKILL."""
FINISH_S = 20.0
"""How long they have after a good end, to make their logs whole on a busy machine."""
LOG_LINES = 12


class RunError(Trouble):
    """A run that can't be started; the text is one line for people."""


@dataclass
class Child:
    """A process of the run."""

    title: str
    process: subprocess.Popen[bytes]
    log: Path
    command: bool = False
    """A companion of the user's; it may end when it likes."""


@dataclass
class Ending:
    """How a run ended."""

    outcome: str
    figures: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    home: list[float] = field(default_factory=list)
    complaint: str = ""
    """What went wrong with a process, for people; empty where nothing did."""


@dataclass(frozen=True)
class Wanted:
    """A run to be made."""

    scenario: Scenario
    seed: int
    speed: float | None
    """Times real time; None: as fast as it goes."""
    folder: Path
    gcs: tuple[str, int] | None = None
    first_instance: int = 0


class Stopped(Exception):
    """Ctrl-C or SIGTERM."""


def run(wanted: Wanted, view: View) -> Ending:
    """Make a run that `check` has let pass, from its first process to the end of the last.

    Raises RunError where it can't be started.
    """
    (wanted.folder / "logs").mkdir()
    (wanted.folder / "frames").mkdir()
    children: list[Child] = []
    ending = Ending("interrupted")
    with _stoppable():
        try:
            world = _start(wanted, children)
            try:
                _watch(world, children, view, ending)
            except Stopped:
                _stop(world, ending)
        except Stopped:
            pass
        finally:
            _end(children, FINISH_S if ending.figures and not ending.figures["lost"] else STOP_S)
    return ending


def check(scenario: Scenario, first_instance: int) -> None:
    """Raise RunError for what is seen to keep a run from starting, while nothing has been written yet."""
    last = first_instance + len(scenario.vehicles) - 1
    if last > LAST_INSTANCE:
        raise RunError(
            f"the last of {len(scenario.vehicles)} vehicles would be instance {last}, but instances end at "
            f"{LAST_INSTANCE}, as PX4's system ids do at {ports.system_id(LAST_INSTANCE)}: choose a smaller --instance"
        )
    for vehicle in scenario.vehicles:
        if vehicle.companion is not None and vehicle.companion.command is not None:
            program = vehicle.companion.command[0]
            if shutil.which(program) is None:
                raise RunError(f"companion {vehicle.name}: can't start {program!r}: there is no such program")
    _check_sharing(scenario, first_instance)
    _check_ports(scenario, first_instance)


def _check_sharing(scenario: Scenario, first_instance: int) -> None:
    """Raise RunError where two companions would listen on one port."""
    of_companions = dict[int, str]()
    for instance, vehicle in enumerate(scenario.vehicles, first_instance):
        if vehicle.companion is None or "{connect}" not in "".join(vehicle.companion.command or ["{connect}"]):
            continue
        port = ports.onboard(instance).remote
        if port in of_companions:
            raise RunError(
                f"the companions of {of_companions[port]} and {vehicle.name} would share UDP port {port}, as PX4 "
                f"gives it to all instances above {MAX_OWN_OFFBOARD}: choose a smaller --instance"
            )
        of_companions[port] = vehicle.name


def _check_ports(scenario: Scenario, first_instance: int) -> None:
    """Raise RunError naming the first port in use, who needs it and what to do about it."""
    for instance, vehicle in enumerate(scenario.vehicles, first_instance):
        needed = [
            (socket.SOCK_DGRAM, "0.0.0.0", ports.gcs(instance).local, "ground station link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.onboard(instance).local, "offboard link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.payload(instance).local, "payload link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.gimbal(instance).local, "gimbal link"),
            (socket.SOCK_STREAM, LOOPBACK, ports.simulator(instance), "simulator"),
        ]
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            needed.append((socket.SOCK_DGRAM, LOOPBACK, ports.onboard(instance).remote, "companion"))
        for kind, address, port, user in needed:
            with socket.socket(socket.AF_INET, kind) as tried:
                if kind == socket.SOCK_STREAM:
                    tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                try:
                    tried.bind((address, port))
                except OSError as error:
                    if error.errno != errno.EADDRINUSE:
                        raise
                    name = "UDP" if kind == socket.SOCK_DGRAM else "TCP"
                    raise RunError(
                        f"{name} port {port}, which the {user} of vehicle {vehicle.name} (instance {instance}) needs, "
                        f"is in use: end the program that holds it (`ss -lpn 'sport = :{port}'` tells which), "
                        "or start this run with another --instance"
                    ) from None


@contextlib.contextmanager
def _stoppable() -> Iterator[None]:
    """Let SIGINT and SIGTERM raise Stopped once; while it ends its processes, the launcher hears neither."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        raise Stopped

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _start(wanted: Wanted, children: list[Child]) -> ControlChannel:
    """Start all processes; the launcher's end of the world's control channel."""
    scenario, folder = wanted.scenario, wanted.folder
    options = scenario.world.options
    common = {"folder": str(folder), "start_us": scenario.start_us, "seed": wanted.seed}
    with_companion = [vehicle for vehicle in scenario.vehicles if vehicle.companion is not None]
    has_radio = len(with_companion) > 1
    to_close: list[socket.socket] = []
    world_parts: list[dict[str, Any]] = []
    waiting: list[tuple[str, str, dict[str, Any], socket.socket]] = []
    commands: list[tuple[VehiclePart, dict[str, str]]] = []

    def channel() -> tuple[socket.socket, socket.socket]:
        both = socket.socketpair()
        to_close.extend(both)
        return both

    for instance, vehicle in enumerate(scenario.vehicles, wanted.first_instance):
        companion, camera, name = vehicle.companion, vehicle.camera, vehicle.name
        lockstep = companion is not None and companion.mission is not None
        ring = f"sitl_emu-{os.getpid()}-{name}"
        part: dict[str, Any] = {
            "name": name,
            "model": vehicle.model,
            "instance": instance,
            "lockstep": lockstep,
            "start": vehicle.start if isinstance(vehicle.start, str) else vehicle.start.model_dump(),
            "companion_fd": None,
            "camera": None,
            "radio_fd": None,
        }
        world_end, autopilot_end = channel()
        part["autopilot_fd"] = world_end.fileno()
        config: dict[str, Any] = {**common, "name": name, "model": vehicle.model, "instance": instance}
        config |= {"lockstep": lockstep, "gcs": wanted.gcs}
        waiting.append((f"autopilot {name}", "autopilot_process", config, autopilot_end))
        if camera is not None:
            world_end, camera_end = channel()
            part["camera"] = {"fd": world_end.fileno(), "rate_hz": camera.rate_hz, "latency_s": camera.latency_s}
            config = {**common, "name": name, "mount": camera.mount, "ring": ring}
            config["world"] = scenario.world.model_dump()
            waiting.append((f"camera {name}", "camera_process", config, camera_end))
        radio_port = None
        if has_radio and companion is not None:
            radio = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            to_close.append(radio)
            radio.bind((LOOPBACK, 0))
            radio_port = radio.getsockname()[1]
            part["radio_fd"] = radio.fileno()
        if companion is not None and companion.mission is not None:
            world_end, companion_end = channel()
            part["companion_fd"] = world_end.fileno()
            config = {**common, "name": name, "instance": instance, "mission": companion.mission}
            config |= {"options": companion.options, "radio_port": radio_port, "gcs": wanted.gcs}
            config["ring"] = ring if camera is not None else None
            config["inference_latency_us"] = round(companion.inference_latency_s * 1e6)
            waiting.append((f"companion {name}", "companion_process", config, companion_end))
        elif companion is not None:
            words = {
                "connect": f"udpin:{LOOPBACK}:{ports.onboard(instance).remote}",
                "peer": f"udpout:{LOOPBACK}:{radio_port}" if radio_port is not None else "",
                "camera": f"shm:{ring}" if camera is not None else "",
                "out": str(folder),
                "seed": str(wanted.seed),
            }
            commands.append((vehicle, words))
        world_parts.append(part)

    launcher_end, world_end = channel()
    world_config = {
        **common,
        "world": {"kind": scenario.world.kind, "options": options},
        "vehicles": world_parts,
        "radio": scenario.peer_radio.settings()._asdict(),
        "speed": wanted.speed,
        "time_limit_s": scenario.time_limit_s,
        "commands": [vehicle.name for vehicle, _ in commands if vehicle.companion and not vehicle.companion.background],
    }
    world_fds = [part["autopilot_fd"] for part in world_parts]
    world_fds += [part[key] for part in world_parts for key in ("companion_fd", "radio_fd") if part[key] is not None]
    world_fds += [part["camera"]["fd"] for part in world_parts if part["camera"] is not None]
    control = ControlChannel(launcher_end, "the world process")
    try:
        children.append(_process("world", "world_process", world_config, world_end, world_fds, folder))
        for title, module, config, end in waiting:
            children.append(_process(title, module, config, end, [], folder))
        for vehicle, words in commands:
            children.append(_command(vehicle, words, folder))
    finally:
        for opened in to_close:
            if opened is not launcher_end:
                opened.close()
    return control


def _process(
    title: str, module: str, config: dict[str, Any], end: socket.socket, more_fds: list[int], folder: Path
) -> Child:
    log = folder / "logs" / f"{title.replace(' ', '-')}.log"
    arguments = [sys.executable, "-P", "-m", f"sitl_emu.run.{module}", str(end.fileno()), json.dumps(config)]
    with log.open("wb") as output:
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            pass_fds=[end.fileno(), *more_fds],
            start_new_session=True,
            env={**os.environ, **THRIFT},
        )
    return Child(title, process, log)


THRIFT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_THRESHOLD_": str(1 << 30),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 32),
}
"""The processes share the cores: numerical libraries that each take them all would only be in each other's way. And
the C library (glibc) is told to keep the memory of a frame for the next one: handing it back and fetching it anew
made 3000 page faults a frame, a third of a detector's time."""


def _command(vehicle: VehiclePart, words: dict[str, str], folder: Path) -> Child:
    assert vehicle.companion is not None and vehicle.companion.command is not None
    arguments = list(vehicle.companion.command)
    for name, value in words.items():
        arguments = [argument.replace("{" + name + "}", value) for argument in arguments]
    title = f"companion {vehicle.name}"
    log = folder / "logs" / f"companion-{vehicle.name}.log"
    try:
        with log.open("wb") as output:
            process = subprocess.Popen(
                arguments, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )
    except OSError as error:
        raise RunError(f"{title}: can't start {arguments[0]!r}: {error.strerror}") from None
    return Child(title, process, log, command=True)


def _watch(world: ControlChannel, children: list[Child], view: View, ending: Ending) -> None:
    """Pass on to the view what the world says, until the run is over or a process has died."""
    told = set[str]()
    while True:
        select.select([world], [], [], POLL_S)
        try:
            while (message := world.poll()) is not None:
                if "status" in message:
                    view.status(message["status"])
                elif "event" in message:
                    view.event(message["event"])
                elif "listening" in message:
                    ending.truth, ending.home = message["truth"], message["home"]
                elif "over" in message:
                    ending.figures, ending.outcome = message["over"], message["over"]["outcome"]
                    if lost := message["over"]["lost"]:
                        _blame(ending, children, lost)
                    return
        except ProcessLostError:
            _blame(ending, children, "the world process has gone")
            return
        for child in children:
            status = child.process.poll()
            if status is None or child.title in told:
                continue
            if child.command:
                told.add(child.title)
                if status:
                    ending.complaint = "\n".join(filter(None, (ending.complaint, _obituary(child))))
                world.send({"command_ended": [child.title.removeprefix("companion "), status]})
            elif child.title != "world":
                _blame(ending, children, f"{child.title} has ended")
                return


def _stop(world: ControlChannel, ending: Ending) -> None:
    """Ask the world to make an end, and what its figures are."""
    until = time.monotonic() + STOP_S / 2
    with contextlib.suppress(ProcessLostError):
        world.send({"stop": "interrupted"})
        while time.monotonic() < until:
            select.select([world], [], [], POLL_S)
            while (message := world.poll()) is not None:
                if "over" in message:
                    ending.figures = message["over"]
                    return


def _blame(ending: Ending, children: list[Child], lost: str) -> None:
    """Name the process that died first: one that was killed or failed, rather than one that ended for want of it."""
    until = time.monotonic() + 0.5
    while time.monotonic() < until and not any(child.process.poll() for child in children):
        time.sleep(0.02)
    dead = [child for child in children if child.process.poll() and not child.command]
    if not dead:
        ending.complaint = lost
    else:
        child = min(dead, key=lambda child: child.process.returncode)
        ending.complaint = _obituary(child)
    ending.outcome = ending.complaint.splitlines()[0]


def _obituary(child: Child) -> str:
    status = child.process.returncode
    last = child.log.read_text(errors="replace").strip().splitlines()[-LOG_LINES:]
    if status < 0:
        how = f"{child.title} (pid {child.process.pid}) was killed by {signal.Signals(-status).name}"
        return f"{how}; its log is {child.log}"
    if status == EXIT_EXPLAINED and last and not child.command:
        return f"{child.title}: {last[-1]}"
    said = "".join(f"\n  {line}" for line in last)
    how = f"{child.title} (pid {child.process.pid}) ended with exit status {status}"
    return f"{how}; its log {child.log} ends:{said}" if said else f"{how} without a word"


def _end(children: list[Child], patience_s: float) -> None:
    """End all processes: by themselves when they see the world go, then by SIGTERM, then by SIGKILL."""
    _signal([child for child in children if child.command or child.title == "world"], signal.SIGTERM)
    if _wait(children, patience_s):
        return
    _signal(children, signal.SIGTERM)
    if _wait(children, STOP_S / 2):
        return
    _signal(children, signal.SIGKILL)
    _wait(children, STOP_S)


def _signal(children: list[Child], number: signal.Signals) -> None:
    for child in children:
        if child.process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.process.pid, number)


def _wait(children: list[Child], limit_s: float) -> bool:
    until = time.monotonic() + limit_s
    for child in children:
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.process.wait(max(0.0, until - time.monotonic()))
    return all(child.process.poll() is not None for child in children)
