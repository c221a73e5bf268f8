"""The house rules that a test can check (import-linter checks the borders between rooms beside this)."""

import ast
import re
import tomllib
from pathlib import Path

from sitl_emu.autopilot.mavlink import rates, silent_streams, streams
from sitl_emu.core import dialect as mavlink

ROOT = Path(__file__).parents[2]
ROOMS = ("sitl_emu", "vehicles", "autopilot", "gcs", "missions")
GENERATED = {ROOT / "sitl_emu/core/dialect.py", ROOT / "sitl_emu/core/dialect_enums.py"}
FILES = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py")) if path not in GENERATED]

CLOCK_FILES = {
    "sitl_emu/run/pacing.py": "paces a tick",
    "sitl_emu/run/world_process.py": "paces a run",
    "sitl_emu/run/children.py": "gives processes time to end",
    "sitl_emu/run/campaign/dask_pool.py": "bounds how long a scheduler is waited for",
    "sitl_emu/run/campaign/flight.py": "says how long a run took",
    "sitl_emu/run/camera_process.py": "stamps video",
    "sitl_emu/run/launcher.py": "gives the world time to say how it ends",
    "sitl_emu/run/launch.py": "says now and then how many vehicles have begun",
    "sitl_emu/run/run_command.py": "names a run's folder",
    "sitl_emu/run/serve_world.py": "paces a world",
    "sitl_emu/run/detect.py": "waits for frames, and says how long a look takes",
    "missions/companion/main.py": "the companion on hardware",
    "missions/companion/live_frames.py": "waits for frames, stamps those of a stream",
}
"""Who may look at a clock, and what for."""
SOCKET_FILES = {
    "sitl_emu/run/link_sockets.py",
    "sitl_emu/run/dds_socket.py",
    "sitl_emu/run/dds_agent.py",
    "sitl_emu/run/obstacle_socket.py",
    "sitl_emu/run/addresses.py",
    "sitl_emu/core/tcp_channel.py",
    "sitl_emu/run/control.py",
    "sitl_emu/run/wiring.py",
    "sitl_emu/run/campaign/dask_pool.py",
    "sitl_emu/run/children.py",
    "sitl_emu/run/photographer.py",
    "sitl_emu/run/range_feeds.py",
    "sitl_emu/run/ros_line.py",
    "sitl_emu/run/preflight.py",
    "sitl_emu/run/world_process.py",
    "sitl_emu/run/view/listening.py",
    "sitl_emu/run/view/opening.py",
    "sitl_emu/run/view/page_process.py",
    "sitl_emu/run/view/server.py",
    "missions/companion/links.py",
}
PX4_PORTS = re.compile(r"\b(14550|18570|14580|14540|14549|14280|14030|13030|13280|4560)\b")
SERVICES_OF_A_COMMAND = {
    "actuator_test": "MAV_CMD_ACTUATOR_TEST",
    "identity": "what a vehicle says of itself, asked by MAV_CMD_REQUEST_MESSAGE",
    "streams": "what comes without being asked for",
    "calibration": "MAV_CMD_PREFLIGHT_CALIBRATION",
    "failure_injection": "MAV_CMD_INJECT_FAILURE",
    "component_metadata": "MAV_CMD_REQUEST_MESSAGE, and then files over FTP",
}
"""What MAVLink describes as a service of its own, and is a command to the autopilot."""
OF_ALL_LINKS = {"framing"}
"""Conformance tests of what lies below all services."""
NOTHING_TO_CONFORM_TO = {
    "system_time": "heard without effect",
    "command_sender": "PX4 gives commands to others in flown missions alone",
    "velocity_limits": "SET_VELOCITY_LIMITS is of development.xml, which the suite does not speak",
    "radio_status": "it shows in the log and in `mavlink status` alone",
    "onboard_computer_status": "it shows in an arming check alone, where COM_CC_TEMP_WARN asks for it",
}
WITHOUT_A_CLIENT_OF_OURS = {
    "command_sender": "its other half answers commands, and what it answers is its own affair",
    "radio_status": "radios tell it, not who speaks over them",
    "streams": "each is heard by who needs it; gcs/telemetry.py hears most of them",
    "framing": "sitl_emu/core/framing.py, on both sides",
}


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def imported(path: Path) -> set[str]:
    names = set[str]()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts if parts[0] == "sitl_emu" else ("sitl_emu", *parts)).removesuffix(".__init__")


def within_reach(start: str, imports: dict[str, set[str]]) -> set[str]:
    """Everything that a module imports, and what that imports in its turn."""
    reached, waiting = set[str](), [start]
    while waiting:
        new = imports[waiting.pop()] - reached
        reached |= new
        waiting += new
    return reached


def test_no_module_imports_itself_in_a_circle() -> None:
    """Neither at its top nor hidden in a function or under TYPE_CHECKING."""
    modules = {dotted(path): path for path in FILES}
    imports = dict[str, set[str]]()
    for name, path in modules.items():
        found = imported(path) & set(modules)
        packages = {n for n in found if any(other.startswith(f"{n}.") for other in found)}
        imports[name] = found - packages - {name}  # of `from package import module` the module counts
    circular = sorted(name for name in modules if name in within_reach(name, imports))
    assert not circular, f"import themselves in a circle: {circular}"


def test_only_process_files_read_a_clock() -> None:
    readers = {name_of(path) for path in FILES if imported(path) & {"time", "asyncio", "sched"}}
    assert readers <= set(CLOCK_FILES), f"also read a clock: {sorted(readers - set(CLOCK_FILES))}"


def test_only_process_files_open_sockets() -> None:
    openers = {name_of(path) for path in FILES if imported(path) & {"socket", "socketserver", "asyncio"}}
    assert openers <= SOCKET_FILES, f"also open sockets: {sorted(openers - SOCKET_FILES)}"


def test_every_stream_is_named_as_a_message() -> None:
    known = {
        name.removeprefix("MAVLINK_MSG_ID_").lower() for name in dir(mavlink) if name.startswith("MAVLINK_MSG_ID_")
    }
    unknown = {name.lower() for name in streams.modules()} - known
    assert streams.modules() and not unknown, f"no messages: {sorted(unknown)}"


def test_every_message_in_the_rate_table_has_a_stream() -> None:
    missing = set(rates.STREAMS) - set(streams.modules())
    assert not missing, f"no stream: {sorted(missing)}"


def test_a_silent_stream_has_nothing_to_say() -> None:
    assert not set(silent_streams.SILENT) & set(streams.modules())


def services() -> set[str]:
    """Modules with a class that lists its MESSAGES or COMMANDS (the others help one), and the components aboard."""
    found = set[str]()
    for path in (ROOT / "autopilot/mavlink/services").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = {ast.unparse(node.target)} if isinstance(node, ast.AnnAssign) else set[str]()
            if isinstance(node, ast.Assign):
                names = {ast.unparse(target) for target in node.targets}
            if names & {"MESSAGES", "COMMANDS"} and not (isinstance(node, ast.AnnAssign) and node.value is None):
                found.add(path.stem)
    return found | {"camera"}


def conformance_tests() -> set[str]:
    """Each service has a file, or a folder of files."""
    folder = ROOT / "tests/conformance"
    files = {path.stem.removeprefix("test_") for path in folder.glob("test_*.py")}
    return files | {path.parent.name for path in folder.glob("*/test_*.py")}


def test_every_service_has_its_conformance_test() -> None:
    assert services() - conformance_tests() == set(NOTHING_TO_CONFORM_TO)
    assert conformance_tests() - services() - OF_ALL_LINKS == set(SERVICES_OF_A_COMMAND)


def test_every_service_has_its_client_half_under_the_same_name() -> None:
    clients = {path.stem for path in (ROOT / "gcs").glob("*.py")}
    missing = (services() | conformance_tests()) - clients - set(WITHOUT_A_CLIENT_OF_OURS)
    assert not missing, f"no gcs/ half of {sorted(missing)}"


def test_every_arming_check_has_a_test() -> None:
    checks = {path.stem for path in (ROOT / "autopilot/commander/arming_checks").glob("*.py")} - {"__init__"}
    tests = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    untested = sorted(check for check in checks if not re.search(rf"\b{check}\b", tests))
    assert not untested, f"no test mentions: {untested}"


def test_px4s_ports_stand_in_ports_alone() -> None:
    """As numbers, that is; in texts for people they may be named. `gcs/` keeps literals of its own."""
    offenders = list[str]()
    for path in FILES:
        if name_of(path) == "sitl_emu/core/ports.py" or path.is_relative_to(ROOT / "gcs"):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, int) and PX4_PORTS.fullmatch(str(node.value)):
                offenders.append(f"{name_of(path)}:{node.lineno}")
    assert not offenders


def test_the_ground_side_knows_only_mavlink_of_ours() -> None:
    of_core = "dialect|framing"
    for room, rooms, core in (("gcs", "gcs", of_core), ("missions", "gcs|missions", f"{of_core}|frame_ring")):
        allowed = re.compile(rf"sitl_emu(\.core(\.({core})\b.*)?|\.({rooms})\b.*)?")
        for path in sorted((ROOT / room).rglob("*.py")):
            ours = {name for name in imported(path) if name.split(".")[0] == "sitl_emu"}
            wrong = {name for name in ours if not allowed.fullmatch(name)}
            assert not wrong, f"{name_of(path)} imports {sorted(wrong)}"


def test_conformance_tests_import_nothing_of_ours() -> None:
    for path in sorted((ROOT / "tests/conformance").rglob("*.py")):
        ours = {name for name in imported(path) if name.split(".")[0] in ROOMS}
        assert not ours, f"{path.name} imports {sorted(ours)}"


def test_the_wheel_carries_every_data_file() -> None:
    """What lies in the packages beside code and READMEs goes with them."""
    carried = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["*"]
    data = [
        path
        for room in ROOMS
        for path in (ROOT / room).rglob("*.*")
        if path.suffix not in (".py", ".md") and path.parent.name != "__pycache__"
    ]
    left = [name_of(path) for path in data if not any(path.match(pattern) for pattern in carried)]
    assert data and not left


def test_generated_files_say_so_in_line_one() -> None:
    assert all("do not edit" in path.read_text().splitlines()[0] for path in GENERATED)


def test_every_module_says_what_it_is() -> None:
    silent = [name_of(path) for path in FILES if not ast.get_docstring(ast.parse(path.read_text()))]
    assert not silent
