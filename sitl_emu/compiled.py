"""Compiled forms of the modules that run in every tick, found instead of the very sources that they were made from.

`make setup` compiles them with mypyc where there is a C compiler (tools/compile_hot_modules.py). What was made lies in
the environment (`sys.prefix`), in a folder named by a digest of the sources: whoever changes one of these runs plain
Python again, until it is compiled anew. Both fly the same to the last bit (tests/flight/test_compiled.py).
Constants of these modules are `Final`: any other name of a module is looked up in its dictionary at every use.
SITL_EMU_PURE=1 in the environment: plain Python.
"""

import contextlib
import functools
import importlib.util
import io
import os
import sys
from collections.abc import Mapping, Sequence
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec
from pathlib import Path
from types import ModuleType

PACKAGE = "sitl_emu"
HOT: dict[str, tuple[str, ...]] = {
    "autopilot": (
        "autopilot.py",
        "commander/[!_]*.py",
        "commander/arming_checks/*.py",
        "commander/calibration/worker.py",
        "constants.py",
        "control/actuator_group_test.py",
        "control/actuator_test.py",
        "control/control.py",
        "control/control_allocator.py",
        "control/control_power.py",
        "control/hover_thrust_estimator.py",
        "control/mc_*.py",
        "control/multicopter.py",
        "control/peripherals.py",
        "control/takeoff.py",
        "estimator/*.py",
        "estimator/aid_sources/*.py",
        "land_detector/*.py",
        "logger/logger.py",
        "mavlink/context.py",
        "mavlink/encoder.py",
        "mavlink/link.py",
        "mavlink/mavlink.py",
        "mavlink/rates.py",
        "mavlink/services/command.py",
        "mavlink/services/command_sender.py",
        "mavlink/services/event.py",
        "mavlink/services/ftp.py",
        "mavlink/services/log_streaming.py",
        "mavlink/services/log_transfer.py",
        "mavlink/services/mission.py",
        "mavlink/services/parameter.py",
        "mavlink/services/shell.py",
        "mavlink/services/signing.py",
        "mavlink/services/statustext.py",
        "mavlink/signature.py",
        "mavlink/stream.py",
        "mavlink/streams/[!_]*.py",
        "modes/auto.py",
        "modes/flight_modes.py",
        "modes/flight_task.py",
        "modes/heading_smoothing.py",
        "modes/position_smoothing.py",
        "modes/trajectory_constraints.py",
        "modes/vectors.py",
        "modes/velocity_smoothing.py",
        "navigator/navigator.py",
        "parameters/parameters.py",
        "parameters/subscription_interval.py",
        "sensors/battery.py",
        "sensors/battery_estimator.py",
        "sensors/data_validator.py",
        "sensors/imu_integrator.py",
        "sensors/sensors.py",
        "sensors/vehicle_acceleration.py",
        "sensors/vehicle_imu.py",
        "topics/topics.py",
    ),
    "core": ("attitude.py", "c_types.py", "framing.py", "geodesy.py", "simulator_api.py"),
    "vehicles": ("*ackermann.py", "battery.py", "dynamics.py", "multicopter.py", "rigid_body.py"),
    "world": ("atmosphere.py", "noise.py", "sensors/*.py", "simulator.py", "wind.py"),
}
"""Files by room: what a hovering tick spends its time in (tools/bench_tick.py)."""
FOLDER = Path(sys.prefix) / "lib" / "sitl_emu_compiled"
LIST = "modules.txt"
"""In a folder of compiled modules: their names, one a line."""
LIBRARY = f"{PACKAGE}__mypyc"
"""mypyc puts all modules into this one; theirs only hand them out."""
ASKED_FOR = (LIBRARY, *(f"{PACKAGE}.{room}." for room in HOT))
"""How names begin that may be those of compiled modules: for others nothing is looked up."""


def sources(rooms: dict[str, Path]) -> dict[str, Path]:
    """The files of HOT by module name, sorted; `rooms`: the folder of each room."""
    found = {}
    for room, patterns in HOT.items():
        for pattern in patterns:
            for path in rooms[room].glob(pattern):
                parts = path.relative_to(rooms[room]).with_suffix("").parts
                if parts[-1] != "__init__":
                    found[".".join((PACKAGE, room, *parts))] = path
    return dict(sorted(found.items()))


def folder(files: Mapping[str, Path | str]) -> Path:
    """Where the compiled forms of these sources belong, for this Python. Raises OSError."""
    from hashlib import blake2b  # 3 ms that `sitl-emu --help` does without

    digest = blake2b(sys.implementation.cache_tag.encode(), digest_size=12)
    for name, path in sorted(files.items()):
        digest.update(name.encode())
        with io.open_code(str(path)) as source:
            digest.update(source.read())
    return FOLDER / digest.hexdigest()


class Finder:
    """Finds compiled modules. Whether there are some of just these sources it looks when it is first asked for one."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """As importlib asks."""
        if not fullname.startswith(ASKED_FOR) or fullname not in self.files:
            return None
        return importlib.util.spec_from_file_location(fullname, self.files[fullname])

    @functools.cached_property
    def files(self) -> dict[str, str]:
        """The library of each compiled module; empty where none were made of these sources."""
        here = str(Path(__file__).parent)
        for place in FOLDER.iterdir():
            with contextlib.suppress(OSError):  # one of its sources is no longer there
                stems = {name: name.replace(".", "/") for name in (place / LIST).read_text().split()}
                inside = {name: stem.removeprefix(PACKAGE) for name, stem in stems.items() if "/" in stem}
                if folder({name: f"{here}{stem}.py" for name, stem in inside.items()}) == place:
                    return {name: f"{place}/{stem}{EXTENSION_SUFFIXES[0]}" for name, stem in stems.items()}
        return {}


def in_use() -> bool:
    """Whether this process runs compiled modules."""
    return any(isinstance(finder, Finder) and finder.files for finder in sys.meta_path)


def leave() -> None:
    """Begin this command again as plain Python, if it runs compiled modules: for tools that look into them."""
    if in_use():
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, "SITL_EMU_PURE": "1"})


def install() -> None:
    """Have the compiled modules found from now on, where there are some of just these sources."""
    if not os.environ.get("SITL_EMU_PURE") and FOLDER.is_dir():
        sys.meta_path.insert(0, Finder())
