"""`sitl-emu launch`: autopilots with their simulator in the same process.

The lightest way to fly: for ground stations, MAVSDK and swarms. A vehicle has a process of its own, as a PX4 has, or
shares one and its loop with others (`--per-process`, `--world`): `launched` is what a process does. For several
processes everything is imported and read from files once, then they are forked, so that they share it; where there is
one, it is the launcher's own. Stays until Ctrl-C.
"""

import os
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.run import memory, models, state
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.home import Home

if TYPE_CHECKING:
    from sitl_emu.run.launched import Crew

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "1")
"""Else NumPy's linear algebra takes a buffer for each core, which matrices as small as a filter's never use, and its
threads spin. NumPy reads it when it is imported: hence no module that this one imports at its top may import it."""
ENDING = {signal.SIGINT, signal.SIGTERM}
TELL_EVERY_S = 2.0
"""How often it is told how many vehicles have begun. Ours."""
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
    """Where the first vehicle stands; of no meaning in a world, which has its own."""
    gcs: tuple[str, int] | None
    state: Path
    """The folder that holds a folder for each vehicle: parameters, missions, logs."""
    fresh: bool
    """Whether to forget what was set in earlier launches."""
    per_process: int | None = None
    """How many vehicles share a process; None: one, and in a world all."""
    world: str | None = None
    """The world that they share, by its kind or its file; None: a level plain."""
    seed: int = 1
    """Of the world, and of the noise of all sensors."""
    tlog: Path | None = None
    """The folder of the telemetry logs; None: none are kept."""
    video: bool = False
    """Whether what cameras see is sent to the ground station."""
    parcels: bool = False
    """Whether those that have a release carry a parcel."""
    dds: bool = False
    """Whether they speak to ROS 2."""


def launch(wanted: Sequence[Wanted], options: Options, say: Callable[[str], None]) -> int:
    """Start all vehicles and stay until they end; the exit status, 1 where one has failed.

    Raises VehicleError and Trouble before anything is started.
    """
    os.environ.setdefault(*ONE_THREAD)
    with memory.all_stays():
        crews = _crews(wanted, options, say)

    def welcome() -> None:
        say(port_table(wanted))
        say(f"parameters, missions and logs are kept in {options.state}")
        if options.dds:
            say(_ros_line(wanted))
        if options.video:
            host = options.gcs[0] if options.gcs is not None else "this machine"
            sent = [vehicle.instance for vehicle in wanted if models.load(vehicle.model).camera is not None]
            say(f"video: {host}, udp {', '.join(str(ports.video(instance)) for instance in sent)}")

    if len(crews) == 1:
        from sitl_emu.run import launched

        return launched.main(crews[0], say, welcome)
    begun, began = os.pipe()
    children = _fork(crews, began, say)
    os.close(began)
    return _wait_for(children, begun, welcome, say)


def _crews(wanted: Sequence[Wanted], options: Options, say: Callable[[str], None]) -> "list[Crew]":
    """Who flies with whom in a process, where, and with which files. Raises VehicleError and Trouble."""
    names = {vehicle.model: models.load(vehicle.model).model for vehicle in wanted}
    if options.video:
        _check_video(wanted, options)
    if options.parcels:
        _check_parcels(wanted, options)
    if options.dds:
        from sitl_emu.run import dds_socket

        dds_socket.check(len(wanted))
    if options.dds and options.world is not None:
        from sitl_emu.run import range_feeds

        for model in names:
            range_feeds.of_data(models.load(model))
    if options.tlog is not None:
        state.make(options.tlog)
    from sitl_emu.run import site
    from sitl_emu.run.launched import Crew, Launched
    from sitl_emu.run.pacing import unix_time_us

    here = site.plain(options.home, options.seed)
    if options.world is not None:
        here = site.in_world(options.world, options.seed, say, parcels=options.parcels)
    offsets_m = here.row([models.load(vehicle.model) for vehicle in wanted])
    launched = [
        Launched(model, instance, offset_m, state.prepare(options.state, names[model], instance, fresh=options.fresh))
        for (model, instance), offset_m in zip(wanted, offsets_m, strict=True)
    ]
    each = options.per_process or (1 if options.world is None else len(launched))
    start_us = unix_time_us()
    return [
        Crew(
            launched[at : at + each],
            here,
            options.world is not None,
            options.speed,
            options.gcs,
            options.tlog,
            options.video,
            options.parcels,
            options.dds,
            options.dds and at == 0,
            None if options.speed == 1.0 else start_us,
        )
        for at in range(0, len(launched), each)
    ]


def _check_video(wanted: Sequence[Wanted], options: Options) -> None:
    """Raise Trouble where no video can be sent."""
    if options.world is None:
        raise Trouble("--camera: without --world there is nothing to see; give one, such as --world corn_field")
    if not any(models.load(vehicle.model).camera for vehicle in wanted):
        raise Trouble(f"--camera: {', '.join(dict.fromkeys(each.model for each in wanted))}: no camera is on board")
    from sitl_emu.run import video_sender

    video_sender.check()


def _check_parcels(wanted: Sequence[Wanted], options: Options) -> None:
    """Raise VehicleError or Trouble where no parcel can be carried, or there is nothing that it could fall on."""
    if options.world is None:
        raise Trouble("--parcel: without --world there is nowhere to fall to; give one, such as --world flat")
    vehicles.with_parcels([models.load(vehicle.model) for vehicle in wanted])


def _fork(crews: "Sequence[Crew]", began: int, say: Callable[[str], None]) -> "dict[int, Crew]":
    """A process for each crew, by its number; `began` as `_child` has it.

    Leaves ENDING blocked, for `_wait_for`: what a signal's handler raised in a hook of os.fork would be lost. One that
    waits ends the forking.
    """
    _preload({vehicle.model for crew in crews for vehicle in crew.vehicles})
    launcher = os.getpid()
    children = {}
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    for crew in crews:
        if signal.sigpending() & ENDING:
            break
        pid = os.fork()
        if pid == 0:
            _child(crew, launcher, began, say)
        children[pid] = crew
    return children


def _preload(models: set[str]) -> None:
    """Import and read what all vehicles have in common, and keep the garbage collector from writing into it."""
    from sitl_emu.run import launched

    for model in models:
        launched.preload(model)
    memory.settle()


def _ros_line(wanted: Sequence[Wanted]) -> str:
    from sitl_emu.run import dds_socket

    topics = ["/" + "/".join(filter(None, (dds_socket.namespace(each.instance), "fmu"))) for each in wanted]
    return f"ROS 2: domain {dds_socket.domain()}, {', '.join(topics)}"


def port_table(wanted: Sequence[Wanted]) -> str:
    """Who listens and sends where, for people."""
    rows = [("vehicle", "system id", "ground station", "MAVSDK / companion")]
    for model, instance in wanted:
        gcs, onboard = ports.gcs(instance), ports.onboard(instance)
        rows.append(
            (
                f"{model} (instance {instance})",
                str(ports.system_id(instance)),
                f"udp {gcs.remote} (from {gcs.local})",
                f"udp {onboard.remote} (from {onboard.local})",
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def _child(crew: "Crew", launcher: int, began: int, say: Callable[[str], None]) -> NoReturn:
    """The forked process of a crew; never returns to the code of its parent, which alone hears Ctrl-C.

    `began`: the end of a pipe that gets a byte when the vehicles' ports are open, and is closed.
    """

    def tell_launcher() -> None:
        os.write(began, b"\0")
        os.close(began)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    status = 1
    try:
        from sitl_emu.run import launched

        status = launched.main(crew, say, tell_launcher, launcher)
    except Trouble as trouble:
        print(f"sitl-emu: {trouble}", file=sys.stderr)
    except Exception:  # a fault of ours: os._exit would hide it
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _wait_for(children: "dict[int, Crew]", begun: int, welcome: Callable[[], None], say: Callable[[str], None]) -> int:
    """Wait until Ctrl-C, SIGTERM, or all have ended. A process that dies is named, and the others fly on.

    `begun`: the pipe of `_child`. Where a vehicle cannot begin, what it said of that stands alone: no `welcome`.
    """

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    status = 0
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        if not _all_begin(begun, len(children), say):
            return 1
        welcome()
        while children:
            pid, code = os.wait()
            crew = children.pop(pid)
            if code != 0:
                say(f"{', '.join(vehicle.title for vehicle in crew.vehicles)} ended: {_how(code)}")
                status = 1
    except KeyboardInterrupt:
        pass
    finally:
        for pid in children:
            os.kill(pid, signal.SIGTERM)
        for pid in children:
            _, code = os.waitpid(pid, 0)
            status = status or (0 if code in (0, signal.SIGTERM) else 1)  # who had not begun is ended by the signal
    return status


def _all_begin(begun: int, count: int, say: Callable[[str], None]) -> bool:
    """Wait until each of `count` children has opened its ports or died; whether all have opened them."""
    heard, tell_at_s = 0, time.monotonic() + TELL_EVERY_S
    with open(begun, "rb", buffering=0) as pipe:
        while True:
            if select.select([pipe], [], [], TELL_EVERY_S)[0]:
                told = pipe.read(count)
                if not told:
                    return heard == count
                heard += len(told)
            if time.monotonic() > tell_at_s:
                tell_at_s += TELL_EVERY_S
                say(f"{heard} of {count} processes have begun")


def _how(code: int) -> str:
    if os.WIFSIGNALED(code):
        return f"killed by {signal.Signals(os.WTERMSIG(code)).name}"
    return f"exit status {os.waitstatus_to_exitcode(code)}"
