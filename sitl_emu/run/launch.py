"""`sitl-emu launch`: autopilots with the simulator in the same process, one process per vehicle.

The lightest way to fly: for ground stations, MAVSDK and swarms. What a process does is `launched_vehicle`. For a fleet
everything is imported and read from files once, then a process is forked for each vehicle, so that they share it; a
single vehicle flies in the launcher's own process. Stays until Ctrl-C.
"""

import gc
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple, NoReturn

from sitl_emu.core import ports
from sitl_emu.run import models, state
from sitl_emu.world.home import Home

SPACING_M = 3.0
"""Vehicles of one launch stand side by side, eastwards."""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "1")
"""Else NumPy's linear algebra takes a buffer for each core, which matrices as small as a filter's never use."""
PX4_HOME = Home(47.397742, 8.545594, 489.4, 0.0)
"""PX4's default home, near Zürich (SIH_LOC_LAT0, SIH_LOC_LON0, SIH_LOC_H0)."""


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

    Raises VehicleError and Trouble before anything is started.
    """
    names = {vehicle.model: models.load(vehicle.model).model for vehicle in wanted}
    roots = [state.prepare(options.state, names[model], at, fresh=options.fresh) for model, at in wanted]
    os.environ.setdefault(*ONE_THREAD)

    def welcome() -> None:
        say(port_table(wanted))
        say(f"parameters, missions and logs are kept in {options.state}")

    if len(wanted) == 1:
        return _fly_alone(wanted[0], roots[0], options, welcome, say)
    begun, began = os.pipe()
    children = _fork(wanted, roots, options, began)
    os.close(began)
    return _wait_for(children, begun, welcome, say)


def _fly_alone(
    vehicle: Wanted, root: Path, options: Options, welcome: Callable[[], None], say: Callable[[str], None]
) -> int:
    """A single vehicle needs no other process; Ctrl-C and SIGTERM shut it down."""
    from sitl_emu.run import launched_vehicle

    signal.signal(signal.SIGINT, launched_vehicle.shut_down)
    status = launched_vehicle.main(vehicle, 0, root, options, welcome)
    if status == 0:
        say(f"{vehicle.model} (instance {vehicle.instance}) was shut down")
    return status


def _fork(wanted: Sequence[Wanted], roots: Sequence[Path], options: Options, began: int) -> dict[int, Wanted]:
    """A process for each vehicle of a fleet, by its number; `began` as `_child` has it."""
    _preload({vehicle.model for vehicle in wanted})
    launcher = os.getpid()
    children = {}
    for place, vehicle in enumerate(wanted):
        pid = os.fork()
        if pid == 0:
            _child(vehicle, place, roots[place], options, launcher, began)
        children[pid] = vehicle
    return children


def _preload(models: set[str]) -> None:
    """Import and read what all vehicles have in common, and keep the garbage collector from writing into it."""
    from sitl_emu.run import launched_vehicle

    for model in models:
        launched_vehicle.preload(model)
    gc.collect()
    gc.freeze()


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


def _child(vehicle: Wanted, place: int, root: Path, options: Options, launcher: int, began: int) -> NoReturn:
    """The forked process of a vehicle; never returns to the code of its parent, which alone hears Ctrl-C.

    `began`: the end of a pipe that gets a byte when the vehicle's ports are open, and is closed.
    """

    def tell_launcher() -> None:
        os.write(began, b"\0")
        os.close(began)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    status = 1
    try:
        from sitl_emu.run import launched_vehicle

        status = launched_vehicle.main(vehicle, place, root, options, tell_launcher, launcher)
    except Exception:  # a fault of ours: os._exit would hide it
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _wait_for(children: dict[int, Wanted], begun: int, welcome: Callable[[], None], say: Callable[[str], None]) -> int:
    """Wait until Ctrl-C, SIGTERM or the death of a vehicle ends them all.

    `begun`: the pipe of `_child`. Where a vehicle cannot begin, what it said of that stands alone: no `welcome`.
    """

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    status = 0
    try:
        if not _all_begin(begun, len(children)):
            return 1
        welcome()
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


def _all_begin(begun: int, count: int) -> bool:
    """Wait until each of `count` children has opened its ports or died; whether all have opened them."""
    with open(begun, "rb") as pipe:
        return len(pipe.read()) == count


def _how(code: int) -> str:
    if os.WIFSIGNALED(code):
        return f"killed by {signal.Signals(os.WTERMSIG(code)).name}"
    return f"exit status {os.waitstatus_to_exitcode(code)}"
