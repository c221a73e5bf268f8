"""`sitl-emu launch`: autopilots with the simulator in the same process, one process per vehicle.

The lightest way to fly: for ground stations, MAVSDK and swarms. Everything is imported once, then a process is forked
for each vehicle; each runs unthrottled until it is armable, and at the asked speed from then on. Stays until Ctrl-C.
"""

import gc
import math
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple, NoReturn

import vehicles
from autopilot.autopilot import Autopilot
from autopilot.process import Pacer, serve, unix_time_us
from autopilot.sockets import LinkSockets, PortInUseError
from autopilot.topics import CommandRecord
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.run import payload, state
from sitl_emu.run.loss_timeouts import loss_timeouts
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

SPACING_M = 3.0
"""Vehicles of one launch stand side by side, eastwards."""
BOOT_LIMIT_US = 20_000_000
"""An autopilot that is not armable after so much simulated time gets its asked speed all the same."""
STANDBY = 3
SHUT_DOWN = 2
"""PREFLIGHT_REBOOT_SHUTDOWN.param1; 1 is a reboot."""
PX4_HOME = Home(47.397742, 8.545594, 489.4, 0.0)
"""PX4's default home, near Zürich (SIH_LOC_LAT0, SIH_LOC_LON0, SIH_LOC_H0)."""


class ShutDownError(Exception):
    """The vehicle was told to shut down."""


class OrphanedError(Exception):
    """The launcher has died, and so its vehicles end too."""


class Wanted(NamedTuple):
    """One vehicle to launch."""

    model: str
    instance: int


class Options(NamedTuple):
    """What is the same for all vehicles of a launch."""

    speed: float
    """Times real time; inf for no limit."""
    home: Home
    gcs: tuple[str, int] | None
    state: Path
    """The folder that holds a folder for each vehicle: parameters, missions, logs."""
    fresh: bool
    """Whether to forget what was set in earlier launches."""


def launch(wanted: Sequence[Wanted], options: Options, say: Callable[[str], None]) -> int:
    """Start a process per vehicle and stay until they end; the exit status.

    Raises vehicles.UnknownModel and Trouble before anything is started.
    """
    for model in {vehicle.model for vehicle in wanted}:
        vehicles.load(model)
    roots = [state.prepare(options.state, *vehicle, fresh=options.fresh) for vehicle in wanted]
    children = {}
    gc.collect()
    gc.freeze()
    for place, vehicle in enumerate(wanted):
        pid = os.fork()
        if pid == 0:
            _child(vehicle, place, roots[place], options)
        children[pid] = vehicle
    say(port_table(wanted))
    say(f"parameters, missions and logs are kept in {options.state}")
    return _wait_for(children, say)


def port_table(wanted: Sequence[Wanted]) -> str:
    """Who listens and sends where, for people."""
    rows = [("vehicle", "system id", "ground station", "MAVSDK / companion", "simulator seed")]
    for model, instance in wanted:
        gcs, onboard = ports.gcs(instance), ports.onboard(instance)
        rows.append(
            (
                f"{model} (instance {instance})",
                str(ports.system_id(instance)),
                f"udp {gcs.remote} (from {gcs.local})",
                f"udp {onboard.remote} (from {onboard.local})",
                str(instance),
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def fly(vehicle: Wanted, place: int, root: Path, options: Options) -> None:
    """Run one vehicle from power-on: simulator and autopilot, tick by tick, until it is told to reboot.

    Raises PortInUseError, ShutDownError and OrphanedError.
    """
    data = vehicles.load(vehicle.model)
    autopilot = Autopilot(data.airframe, vehicle.instance, root)
    for name, value in loss_timeouts(options.speed).items():
        autopilot.parameters.set(name, value)
    autopilot.mavlink.context.boot_unix_us = unix_time_us()
    payload.plug_in(data, autopilot)
    sockets = LinkSockets(autopilot.mavlink.links, options.gcs)
    simulator = VehicleSimulator(
        data,
        options.home,
        seed=vehicle.instance,
        terrain=FlatGround(),
        start_east_m=place * SPACING_M,
        name=vehicle.model,
    )
    try:
        _fly_on(autopilot, sockets, simulator, options.speed)
    finally:
        sockets.close()
        autopilot.close()


def _fly_on(autopilot: Autopilot, sockets: LinkSockets, simulator: VehicleSimulator, speed: float) -> None:
    """Tick by tick until it is told to reboot. Raises ShutDownError and OrphanedError."""
    parent = os.getppid()
    simulated_parameters = SimulatedParameters(autopilot.parameters, simulator)
    channel = MemoryChannel()
    boot, pacer = Pacer(math.inf), Pacer(speed)
    pace, controls, commands = boot, None, autopilot.topics.vehicle_commands
    while True:
        simulated_parameters.update()
        channel.simulator.send(simulator.tick(controls))
        channel.autopilot.send(autopilot.step(channel.autopilot.receive()))
        controls = channel.simulator.receive()
        if pace is boot and _booted(autopilot):
            pace = pacer
            pacer.start()
        serve(autopilot, sockets, pace)
        if autopilot.topics.vehicle_commands is not commands:
            commands = autopilot.topics.vehicle_commands
            if (wanted := power_wanted(commands)) is not None:
                if wanted == SHUT_DOWN:
                    raise ShutDownError
                return
        if os.getppid() != parent:
            raise OrphanedError


def power_wanted(commands: tuple[CommandRecord, ...]) -> int | None:
    """REBOOT or SHUT_DOWN when the newest accepted command asks for it (MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN.param1)."""
    if not commands or commands[-1].command.command != mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
        return None
    return int(commands[-1].command.param1)


def _booted(autopilot: Autopilot) -> bool:
    return autopilot.topics.vehicle_status.system_status >= STANDBY or autopilot.now_us > BOOT_LIMIT_US


def _child(vehicle: Wanted, place: int, root: Path, options: Options) -> NoReturn:
    """The forked process of a vehicle; never returns to the code of its parent, which alone hears Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _shut_down)
    status = 1
    try:
        while True:
            fly(vehicle, place, root, options)
    except PortInUseError as error:
        print(f"sitl-emu: {vehicle.model} (instance {vehicle.instance}): {error}", file=sys.stderr)
    except (OrphanedError, ShutDownError):
        status = 0
    except Exception:  # a fault of ours: os._exit would hide it
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _shut_down(_number: int, _frame: FrameType | None) -> NoReturn:
    raise ShutDownError


def _wait_for(children: dict[int, Wanted], say: Callable[[str], None]) -> int:
    """Wait until Ctrl-C, SIGTERM or the death of a vehicle ends them all."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    status = 0
    try:
        while children and status == 0:
            pid, code = os.wait()
            vehicle = children.pop(pid)
            if code == 0:
                say(f"{vehicle.model} (instance {vehicle.instance}) was shut down")
            else:
                say(f"{vehicle.model} (instance {vehicle.instance}) ended: {_how(code)}; ending the others")
                status = 1
    except KeyboardInterrupt:
        pass
    finally:
        for pid in children:
            os.kill(pid, signal.SIGTERM)
        for pid in children:
            os.waitpid(pid, 0)
    return status


def _how(code: int) -> str:
    if os.WIFSIGNALED(code):
        return f"killed by {signal.Signals(os.WTERMSIG(code)).name}"
    return f"exit status {os.waitstatus_to_exitcode(code)}"
