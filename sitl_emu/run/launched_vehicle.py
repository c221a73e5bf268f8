"""A vehicle of `sitl-emu launch`: autopilot, simulator, sockets and the loop that ticks them, in one process.

It runs unthrottled until it is armable, and at the asked speed from then on. While it runs unthrottled it speaks, but
does not listen: what is sent to it waits until it is armable. A script that arms as soon as position and home are there
would otherwise hit the second, in PX4's time, until the commander trusts them. `launch` begins it.
"""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

import vehicles
from autopilot import events
from autopilot.autopilot import Autopilot
from autopilot.process import Pacer, clock_s, serve, unix_time_us
from autopilot.sockets import LinkSockets, PortInUseError
from autopilot.topics import CommandRecord
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import MemoryChannel, SimulatorParameter
from sitl_emu.payload.camera import Camera
from sitl_emu.payload.gimbal import Gimbal
from sitl_emu.run import payload
from sitl_emu.run.launch import SPACING_M, Options, Wanted
from sitl_emu.run.loss_timeouts import loss_timeouts
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator

BOOT_LIMIT_US = 20_000_000
"""An autopilot that is not armable after so much simulated time gets its asked speed all the same."""
STANDBY = 3
SHUT_DOWN = 2
"""PREFLIGHT_REBOOT_SHUTDOWN.param1; 1 is a reboot."""


class ShutDownError(Exception):
    """The vehicle was told to shut down."""


class OrphanedError(Exception):
    """The launcher has died, and so its vehicles end too."""


def preload(model: str) -> None:
    """Read what every vehicle of a model reads from files when it begins, into caches that forked processes share."""
    data = vehicles.load(model)
    payload.plug_in(data, Autopilot(data.airframe, 0))
    events.table()


def main(
    vehicle: Wanted,
    place: int,
    root: Path,
    options: Options,
    on_begun: Callable[[], None],
    launcher: int | None = None,
) -> int:
    """Fly, and begin anew at each reboot, until the vehicle is shut down (SIGTERM does too); the exit status.

    `on_begun` is called once, when its ports are open. `launcher` is the process that forked this one, whose death ends
    it as well.
    """
    signal.signal(signal.SIGTERM, shut_down)
    try:
        fly(vehicle, place, root, options, on_begun, launcher)
        while True:
            fly(vehicle, place, root, options, lambda: None, launcher)
    except PortInUseError as error:
        print(f"sitl-emu: {vehicle.model} (instance {vehicle.instance}): {error}", file=sys.stderr)
        return 1
    except (OrphanedError, ShutDownError):
        return 0


def fly(
    vehicle: Wanted,
    place: int,
    root: Path,
    options: Options,
    on_begun: Callable[[], None],
    launcher: int | None,
) -> None:
    """Run one vehicle from power-on: simulator and autopilot, tick by tick, until it is told to reboot.

    `on_begun` is called when its ports are open. Raises PortInUseError, ShutDownError and OrphanedError.
    """
    data = vehicles.load(vehicle.model)
    autopilot = Autopilot(data.airframe, vehicle.instance, root)
    for name, value in loss_timeouts(options.speed).items():
        autopilot.parameters.set(name, value)
    autopilot.mavlink.context.boot_unix_us = unix_time_us()
    devices = payload.plug_in(data, autopilot)
    sockets = LinkSockets(autopilot.mavlink.links, options.gcs)
    on_begun()
    simulator = VehicleSimulator(
        data,
        options.home,
        seed=vehicle.instance,
        terrain=FlatGround(),
        start_east_m=place * SPACING_M,
        name=vehicle.model,
    )
    try:
        _fly_on(autopilot, sockets, simulator, devices, options.speed, launcher)
    finally:
        sockets.close()
        autopilot.close()


def _fly_on(
    autopilot: Autopilot,
    sockets: LinkSockets,
    simulator: VehicleSimulator,
    devices: Sequence[Camera | Gimbal],
    speed: float,
    launcher: int | None,
) -> None:
    """Tick by tick until it is told to reboot. Raises ShutDownError and OrphanedError."""
    simulated_parameters = SimulatedParameters(autopilot.parameters)
    simulation, channel = Simulation([simulator]), MemoryChannel()
    pacer, booted = Pacer(speed), False
    controls, commands = None, autopilot.topics.vehicle_commands
    while True:
        channel.simulator.send(simulation.tick([controls])[0])
        channel.autopilot.send(autopilot.step(channel.autopilot.receive()), simulated_parameters.changed())
        controls = channel.simulator.receive()
        for message in channel.simulator.beside():
            if isinstance(message, SimulatorParameter):
                simulation.set_parameter(0, *message)
        if not booted and (booted := _booted(autopilot)):
            pacer.start()
        if booted:
            serve(autopilot, sockets, pacer)
        else:
            sockets.flush()
        for device in devices:
            device.keep_alive(clock_s())
        if autopilot.topics.vehicle_commands is not commands:
            commands = autopilot.topics.vehicle_commands
            if (wanted := power_wanted(commands)) is not None:
                if wanted == SHUT_DOWN:
                    raise ShutDownError
                return
        if launcher is not None and os.getppid() != launcher:
            raise OrphanedError


def power_wanted(commands: tuple[CommandRecord, ...]) -> int | None:
    """REBOOT or SHUT_DOWN when the newest accepted command asks for it (MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN.param1)."""
    if not commands or commands[-1].command.command != mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
        return None
    return int(commands[-1].command.param1)


def _booted(autopilot: Autopilot) -> bool:
    return autopilot.topics.vehicle_status.system_status >= STANDBY or autopilot.now_us > BOOT_LIMIT_US


def shut_down(_number: int, _frame: FrameType | None) -> NoReturn:
    """A signal's handler: raises ShutDownError."""
    raise ShutDownError
