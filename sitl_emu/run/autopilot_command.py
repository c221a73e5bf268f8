"""`python -P -m sitl_emu.autopilot`: one autopilot alone, on PX4's ports, for whatever simulator listens on TCP 4560+i.

    python -P -m sitl_emu.autopilot --model iris --simulator 127.0.0.1

`sitl-emu world` is such a simulator, and so is any that speaks PX4's simulator API. --model takes a vehicle's airframe
and what it carries, camera and gimbal; --airframe takes an airframe of one's own, a JSON object of the PX4 parameters
that differ from their defaults. The simulator beats time; the process ends when it leaves, on Ctrl-C or SIGTERM, and
when it is told to shut down. Told to reboot, the autopilot begins anew on the same connection. With --root,
parameters, missions and logs are kept in that folder; with --tlog, what passes on the links.
"""

import argparse
import json
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import NoReturn

from sitl_emu.autopilot.parameters import Value, table
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import ports
from sitl_emu.core.c_types import FLOAT32_MAX
from sitl_emu.core.simulator_api import ChannelClosed
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, connect
from sitl_emu.run import models
from sitl_emu.run.addresses import address_of, check_host
from sitl_emu.run.autopilot_host import AutopilotHost, Hosted, HostPoll, wait_for_tick
from sitl_emu.run.link_sockets import Poll, PortInUseError
from sitl_emu.run.trouble import Trouble
from sitl_emu.vehicles import VehicleError

LAST_INSTANCE = 249
WAIT_S = 0.5
BAD_INPUT, FAILED = 2, 1


class AirframeError(Exception):
    """An airframe file that can't be read or is wrong; the text is one line for people."""


def main() -> int:
    """Fly until the simulator leaves; the exit status."""
    options = _options()
    poll: HostPoll = Poll()
    try:
        host = AutopilotHost(_hosted(options), poll)
    except (AirframeError, VehicleError, Trouble, PortInUseError, storage.StorageError) as error:
        return _complain(str(error), BAD_INPUT)
    except OSError as error:
        return _complain(f"{error.filename or options.tlog}: {error.strerror}", BAD_INPUT)
    for number in (signal.SIGINT, signal.SIGTERM):  # a script's background job begins with SIGINT ignored
        signal.signal(number, _interrupt)
    try:
        channel = _connected(poll, ports.simulator(options.instance), options.simulator)
        _say(f"connected to the simulator on {options.simulator}")
        _fly(host, poll, channel)
    except ChannelClosed as error:
        return _complain(str(error), FAILED)
    except KeyboardInterrupt:
        pass
    finally:
        host.close()
    return 0


def read_airframe(file: Path) -> dict[str, Value]:
    """The parameters of an airframe file. Raises AirframeError."""
    try:
        parameters: dict[str, Value] = json.loads(file.read_text())
    except OSError as error:
        raise AirframeError(f"{file}: {error.strerror}") from None
    except ValueError as error:
        raise AirframeError(f"{file}: not JSON: {error}") from None
    except RecursionError:
        raise AirframeError(f"{file}: nested too deeply; allowed: a JSON object of PX4 parameters") from None
    if not isinstance(parameters, dict):
        raise AirframeError(f"{file}: not an airframe; allowed: a JSON object of PX4 parameters")
    for name, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise AirframeError(f"{file}: {name}: {value!r}; allowed: a number")
        if not abs(value) <= FLOAT32_MAX:  # NaN neither
            raise AirframeError(f"{file}: {name}: {value!r}; allowed: a finite number, as a float32 too")
        if name not in table():
            raise AirframeError(f"{file}: {name}: PX4 has no such parameter")
    return parameters


def _hosted(options: argparse.Namespace) -> Hosted:
    """What to host. Raises AirframeError, VehicleError, Trouble, StorageError and OSError."""
    instance: int = options.instance
    check_host(options.simulator, f"--simulator {options.simulator}")
    if options.root is not None:
        storage.prepare(options.root)
    if options.tlog is not None:
        options.tlog.mkdir(parents=True, exist_ok=True)
    vehicle = models.load(options.model) if options.model is not None else None
    return Hosted(
        instance=instance,
        airframe=vehicle.airframe if vehicle is not None else read_airframe(options.airframe),
        camera=vehicle.camera if vehicle is not None else None,
        gimbal=vehicle.gimbal if vehicle is not None else None,
        root=options.root,
        gcs=address_of(options.gcs, ports.GCS_REMOTE) if options.gcs is not None else None,
        tlog=options.tlog / f"autopilot-{instance}" if options.tlog is not None else None,
    )


def _connected(poll: HostPoll, port: int, host: str) -> TcpAutopilotChannel:
    """The channel to the simulator, as soon as there is one; what comes on the links meanwhile is lost."""
    told = False
    while True:
        try:
            channel = connect(port, host)
        except ChannelClosed as error:
            if not told:
                _say(f"{error}; waiting for one")
                told = True
        else:
            poll.watch(channel.fileno(), None)
            return channel
        for key in poll.wait(WAIT_S):
            if key is not None:
                key[0].drop(key[1])


def _fly(host: AutopilotHost, poll: HostPoll, channel: TcpAutopilotChannel) -> None:
    """Answer the simulator's ticks, and in between whoever speaks on the links. Raises ChannelClosed."""
    boots = host.boots
    while not host.off:
        wait_for_tick(poll, channel)
        host.tick(channel)
        host.keep_time()
        if host.boots != boots:
            boots = host.boots
            _say("the autopilot was rebooted")
    _say("the autopilot was shut down")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -P -m sitl_emu.autopilot", description=(__doc__ or "").split("\n\n")[0]
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--model", metavar="MODEL", help="a vehicle, or its folder: its airframe, camera and gimbal")
    what.add_argument("--airframe", type=Path, metavar="FILE", help="PX4 parameters as a JSON object")
    parser.add_argument("--instance", type=int, default=0, metavar="I", help="gives the ports and the system id I+1")
    parser.add_argument(
        "--root", type=Path, metavar="DIR", help="keeps parameters, missions and logs there (default: nothing is kept)"
    )
    parser.add_argument(
        "--tlog", type=Path, metavar="DIR", help="keeps a telemetry log (.tlog) of each link there, where none is yet"
    )
    parser.add_argument(
        "--gcs", metavar="HOST[:PORT]", help="where the ground station is (default: on this machine, port 14550)"
    )
    parser.add_argument("--simulator", default="127.0.0.1", metavar="HOST", help="where the simulator runs")
    options = parser.parse_args()
    if not 0 <= options.instance <= LAST_INSTANCE:
        parser.error(f"--instance {options.instance}: give 0 to {LAST_INSTANCE}")
    return options


def _say(text: str) -> None:
    print(text, flush=True)


def _complain(text: str, status: int) -> int:
    print(f"autopilot: {text}", file=sys.stderr)
    return status


def _interrupt(_number: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt
