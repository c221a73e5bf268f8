"""`sitl-emu run`: starts the processes of a scenario, shows how they do, and ends them all whatever happens.

World, cameras, autopilots and companions are processes of their own, joined by control channels that they inherit. When
one dies, the launcher says which, and ends the rest; Ctrl-C and SIGTERM end them too. Each writes what it has to
complain about into `logs/` of the run's folder.
"""

import contextlib
import os
import select
import signal
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from sitl_emu.core import ports
from sitl_emu.run.children import STOP_S, Child, end_all, obituary, start_command, start_process
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.live_view import View
from sitl_emu.run.scenario import Scenario, VehiclePart

LOOPBACK = "127.0.0.1"
POLL_S = 0.1
FINISH_S = 20.0
"""How long processes have after a good end, to make their logs whole on a busy machine."""


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
    """Make a run that `preflight.check` has let pass, from its first process to the end of the last.

    Raises Trouble where it can't be started.
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
            end_all(children, FINISH_S if ending.figures and not ending.figures["lost"] else STOP_S)
    return ending


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
        children.append(start_process("world", "world_process", world_config, world_end, world_fds, folder))
        for title, module, config, end in waiting:
            children.append(start_process(title, module, config, end, [], folder))
        for vehicle, words in commands:
            children.append(start_command(vehicle, words, folder))
    finally:
        for opened in to_close:
            if opened is not launcher_end:
                opened.close()
    return control


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
                    ending.complaint = "\n".join(filter(None, (ending.complaint, obituary(child))))
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
        ending.complaint = obituary(child)
    ending.outcome = ending.complaint.splitlines()[0]
