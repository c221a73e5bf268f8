"""One autopilot alone, on PX4's ports, which connects to a simulator on TCP 4560+i, as PX4's own SITL does.

    python -P -m autopilot --airframe vehicles/iris/airframe.json --instance 0 --simulator 127.0.0.1

`sitl-emu world` is such a simulator, and so is any that speaks PX4's simulator API. The airframe is a JSON object of
the PX4 parameters that differ from their defaults. The simulator beats time; the process ends when it leaves, on
Ctrl-C or SIGTERM, and when it is told to shut down or reboot. With --root, parameters, missions and logs are kept in
that folder.
"""

import argparse
import json
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import NoReturn

from autopilot import storage
from autopilot.autopilot import Autopilot
from autopilot.parameters import Value
from autopilot.process import measure_load, unix_time_us
from autopilot.sockets import LinkSockets, PortInUseError
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import ChannelClosed
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, connect

LAST_INSTANCE = 249
WAIT_S = 0.5
BAD_INPUT, FAILED = 2, 1


class AirframeError(Exception):
    """An airframe file that can't be read or is wrong; the text is one line for people."""


def main() -> int:
    """Fly until the simulator leaves; the exit status."""
    options = _options()
    try:
        autopilot = make_autopilot(options.airframe, options.instance, options.root)
        sockets = LinkSockets(autopilot.mavlink.links)
    except (AirframeError, PortInUseError, storage.StorageError) as error:
        print(f"autopilot: {error}", file=sys.stderr)
        return BAD_INPUT
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        channel = _connected(sockets, ports.simulator(options.instance), options.simulator)
        print(f"connected to the simulator on {options.simulator}", flush=True)
        fly(autopilot, sockets, channel)
    except ChannelClosed as error:
        print(f"autopilot: {error}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        pass
    finally:
        sockets.close()
        autopilot.close()
    return 0


def make_autopilot(airframe: Path, instance: int, root: Path | None) -> Autopilot:
    """An autopilot with the parameters of an airframe file. Raises AirframeError and StorageError."""
    try:
        parameters: dict[str, Value] = json.loads(airframe.read_text())
    except OSError as error:
        raise AirframeError(f"{airframe}: {error.strerror}") from None
    except ValueError as error:
        raise AirframeError(f"{airframe}: not JSON: {error}") from None
    if not isinstance(parameters, dict):
        raise AirframeError(f"{airframe}: not an airframe; allowed: a JSON object of PX4 parameters")
    for name, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise AirframeError(f"{airframe}: {name}: {value!r}; allowed: a number")
    if root is not None:
        storage.prepare(root)
    try:
        autopilot = Autopilot(parameters, instance, root)
    except KeyError as error:
        raise AirframeError(f"{airframe}: {error.args[0]}: PX4 has no such parameter") from None
    autopilot.mavlink.context.boot_unix_us = unix_time_us()
    return autopilot


def fly(autopilot: Autopilot, sockets: LinkSockets, channel: TcpAutopilotChannel) -> None:
    """Answer the simulator's ticks, and in between whoever speaks on the links. Raises ChannelClosed."""
    sockets.watch(channel.fileno())
    commands = autopilot.topics.vehicle_commands
    while True:
        while ready := sockets.wait(0.0 if channel.ready else WAIT_S):
            for link in ready:
                for datagram in sockets.receive(link):
                    autopilot.on_datagram(link, datagram)
            sockets.flush()
            if sockets.watched_ready or channel.ready:
                break
        channel.send(autopilot.step(channel.receive()))
        sockets.flush()
        measure_load(autopilot)
        if autopilot.topics.vehicle_commands is not commands:
            commands = autopilot.topics.vehicle_commands
            if commands and commands[-1].command.command == mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                return


def _connected(sockets: LinkSockets, port: int, host: str) -> TcpAutopilotChannel:
    """The channel to the simulator, as soon as there is one; what comes on the links meanwhile is lost."""
    told = False
    while True:
        try:
            return connect(port, host)
        except ChannelClosed as error:
            if not told:
                print(f"{error}; waiting for one", flush=True)
                told = True
        for link in sockets.wait(WAIT_S):
            sockets.receive(link)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -P -m autopilot", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--airframe", type=Path, required=True, metavar="FILE", help="PX4 parameters as a JSON object")
    parser.add_argument("--instance", type=int, default=0, metavar="I", help="gives the ports and the system id I+1")
    parser.add_argument(
        "--root", type=Path, metavar="DIR", help="keeps parameters, missions and logs there (default: nothing is kept)"
    )
    parser.add_argument("--simulator", default="127.0.0.1", metavar="HOST", help="where the simulator runs")
    options = parser.parse_args()
    if not 0 <= options.instance <= LAST_INSTANCE:
        parser.error(f"--instance {options.instance}: give 0 to {LAST_INSTANCE}")
    return options


def _interrupt(_number: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
