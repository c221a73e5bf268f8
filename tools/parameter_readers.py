"""Which module reads which parameter, seen while vehicles boot, look at vision, fly all modes, a mission and failsafes.

    python tools/parameter_readers.py

Access to the autopilot's parameters is recorded with the module that asks, so that a parameter counts as read when
running code reads it, not when its name stands somewhere. Saving, telling and logging parameters is no reading: it asks
for all of them in another way. The flights are simulated and seeded, and so the result is the same each time.
"""

import ast
import functools
import math
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sitl_emu import compiled, vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.simulator_parameters import set_parameter

ROOT = Path(__file__).resolve().parents[1]
HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICKS_A_SECOND = 250
FLOWN = ("sihsim_hex", "m600", "sihsim_rover_ackermann", "rover")
BOOT_S, CLIMB_S, VISION_S, MODE_S, MISSION_S, LOSS_S = 8.0, 6.0, 2.0, 0.6, 10.0, 3.0
WRONG_S, WRONG_M = 9.0, (30.0, 0.0, 30.0)
"""So long a receiver is so far off: the filter goes by it in the end (its reset_timeout_max is 7 s)."""
OUTSIDE = {"EKF2_EV_CTRL": 15, "EKF2_OF_CTRL": 1, "EKF2_DRAG_CTRL": 1}
"""What makes the filter look at vision, optical flow and drag; none of these vehicles' airframes does."""
NAN = math.nan
VELOCITY_ONLY = 0b110111000111
"""POSITION_TARGET_TYPEMASK that leaves position, acceleration, yaw and its rate out."""
RELATIVE_INT, MISSION_FRAME = 6, 2
CALIBRATIONS = ((1, 0, 0, 0, 0, 0, 0), (0, 1, 0, 0, 0, 0, 0), (0, 0, 0, 0, 1, 0, 0), (0, 0, 0, 0, 2, 0, 0))
"""MAV_CMD_PREFLIGHT_CALIBRATION: gyroscope, magnetometer, accelerometer, level."""
TAKE_ALL = ("sitl_emu.autopilot.estimator", "sitl_emu.autopilot.logger")
"""Who copies all values, or all of a prefix: here those count as read that a module of the package names."""
Readers = dict[str, set[str]]


def file_name(module: str) -> str:
    """Where a module or package lies in the checkout, without `.py`: rooms lie at its top."""
    inner = module.removeprefix("sitl_emu.").replace(".", "/")
    return inner if (ROOT / inner.split("/")[0]).is_dir() else f"sitl_emu/{inner}"


class Flight:
    """A vehicle whose ground station commands and does not listen."""

    def __init__(self, model: str, root: Path) -> None:
        storage.prepare(root)
        data = vehicles.load(model)
        self.rover = data.propulsion is None
        self.autopilot = Autopilot(data.airframe, 0, root)
        self.simulator = VehicleSimulator(data, HOME, 0, FlatGround(), name=model)
        self._simulated = SimulatedParameters(self.autopilot.parameters)
        self._controls: HilActuatorControls | None = None
        self._station = mavlink.MAVLink(None, 255, 190)

    def say(self, message: mavlink.MAVLink_message) -> None:
        """A datagram of the ground station."""
        self.autopilot.on_datagram(0, bytes(message.pack(self._station)))

    def command(self, number: int, *params: float) -> None:
        """COMMAND_LONG."""
        self.say(mavlink.MAVLink_command_long_message(1, 1, number, 0, *params, *[NAN] * (7 - len(params))))

    def run(self, seconds: float, heard: bool = True) -> None:
        """Ticks, with a heartbeat of the ground station each second where it is `heard`."""
        for tick in range(round(seconds * TICKS_A_SECOND)):
            if heard and tick % TICKS_A_SECOND == 0:
                self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            for parameter in self._simulated.changed():
                set_parameter(self.simulator, *parameter)
            self._controls = self.autopilot.step(self.simulator.tick(self._controls))
            for link in self.autopilot.mavlink.links:
                link.outbox.clear()


@functools.cache
def _named_in(package: str) -> dict[str, set[str]]:
    """Words that the modules of a package name, and which of them do."""
    found: dict[str, set[str]] = defaultdict(set)
    for path in sorted((ROOT / file_name(package)).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found[node.value].add(".".join(("sitl_emu", *path.relative_to(ROOT).with_suffix("").parts)))
    return found


@contextmanager
def recorded() -> Iterator[Readers]:
    """Parameters that are read meanwhile, and by which modules. Raises RuntimeError in compiled code."""
    if compiled.in_use():
        raise RuntimeError("compiled modules have no frames that tell who asks: set SITL_EMU_PURE=1")
    readers: Readers = defaultdict(set)
    original = Parameters.__getitem__

    def recording(self: Parameters, name: str) -> Value:
        module = sys._getframe(1).f_globals["__name__"]
        package = module.rpartition(".")[0]
        readers[name] |= _named_in(package).get(name, set()) if package in TAKE_ALL else {module}
        return original(self, name)

    Parameters.__getitem__ = recording  # type: ignore[method-assign]
    try:
        yield readers
    finally:
        Parameters.__getitem__ = original  # type: ignore[method-assign]


def readers() -> Readers:
    """Fly, and say who read what."""
    with tempfile.TemporaryDirectory() as folder, recorded() as found:
        for model in FLOWN:
            _fly(Flight(model, Path(folder) / model))
    return {name: modules for name, modules in found.items() if modules}


def _fly(flight: Flight) -> None:
    flight.run(BOOT_S)
    for which in CALIBRATIONS:
        flight.command(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, *which)
        flight.run(MODE_S)
        flight.command(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, *[0] * 7)
    flight.run(2.0)
    flight.command(mavlink.MAV_CMD_INJECT_FAILURE, 0, 0, 0)
    flight.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    if not flight.rover:
        flight.command(mavlink.MAV_CMD_NAV_TAKEOFF)
    flight.run(CLIMB_S)
    _look_from_outside(flight)
    _fly_modes(flight)
    _fly_mission(flight)
    _fall_into_failsafes(flight)
    flight.autopilot.close()


def _look_from_outside(flight: Flight) -> None:
    """Vision and optical flow, as a vehicle that stands above its home sees them, and the drag of its rotors."""
    parameters = flight.autopilot.parameters
    for name in OUTSIDE:
        parameters.set(name, OUTSIDE[name])
    for _ in range(round(VISION_S * 20)):
        pose: list[Any] = [0, mavlink.MAV_FRAME_LOCAL_FRD, mavlink.MAV_FRAME_BODY_FRD, 0.0, 0.0, -2.5, [1.0, 0, 0, 0]]
        rest: list[Any] = [*[0.0] * 6, [NAN] * 21, [NAN] * 21, 0, mavlink.MAV_ESTIMATOR_TYPE_VISION, 100]
        flight.say(mavlink.MAVLink_odometry_message(*pose, *rest))
        flight.say(mavlink.MAVLink_optical_flow_rad_message(0, 0, 50_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 255, 0, -1.0))
        flight.run(0.05)
    for name in OUTSIDE:
        parameters.set(name, 0)


def _fly_modes(flight: Flight) -> None:
    """Every mode with sticks held, and what needs a command of its own."""
    for state in NavState:
        if state is NavState.TERMINATION:
            continue
        flight.command(mavlink.MAV_CMD_DO_SET_MODE, 1, FLIGHT_MODES[state].main_mode, FLIGHT_MODES[state].sub_mode)
        for _ in range(round(MODE_S * 20)):
            flight.say(mavlink.MAVLink_manual_control_message(1, 300, -200, 600, 100, 0))
            flight.say(mavlink.MAVLink_rc_channels_override_message(1, 1, 1600, 1400, 1500, 1450, *[1500] * 4))
            target: list[Any] = [0, 1, 1, 1, VELOCITY_ONLY, *[0.0] * 3, 1.0, *[0.0] * 7]
            flight.say(mavlink.MAVLink_set_position_target_local_ned_message(*target))
            flight.run(0.05)
    flight.command(mavlink.MAV_CMD_DO_ORBIT, 10, 2, 0, NAN, HOME.lat_deg, HOME.lon_deg, HOME.alt_amsl_m + 10)
    flight.run(MODE_S)
    flight.command(mavlink.MAV_CMD_DO_GRIPPER, 1, 0)
    flight.command(mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, 1, 0)
    flight.run(MODE_S)
    flight.command(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -20, 0, NAN, NAN, 0, 0, 0)
    flight.command(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, NAN, HOME.lat_deg + 1e-4, HOME.lon_deg, HOME.alt_amsl_m + 8)
    flight.run(MODE_S)


def _fly_mission(flight: Flight) -> None:
    """Upload (asking is not waited for: the items come in order) and fly: a place, a delay, back, home."""
    x, y = round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7)
    items = [(16, RELATIVE_INT, x + 100, y, 8.0), (93, MISSION_FRAME, 0, 0, 0.0), (16, RELATIVE_INT, x, y + 100, 8.0)]
    items.append((20, MISSION_FRAME, 0, 0, 0.0))
    flight.say(mavlink.MAVLink_mission_count_message(1, 1, len(items)))
    for seq, (command, frame, lat, lon, alt) in enumerate(items):
        hold_s = float(command == mavlink.MAV_CMD_NAV_DELAY)
        fields: list[Any] = [1, 1, seq, frame, command, 0, 1, hold_s, 0.0, 0.0, 0.0, lat, lon, alt]
        flight.say(mavlink.MAVLink_mission_item_int_message(*fields))
    flight.command(mavlink.MAV_CMD_MISSION_START, 0, 0)
    flight.run(MISSION_S)


def _fall_into_failsafes(flight: Flight) -> None:
    """A geofence, an empty battery, a lost ground station and a wrong receiver, one after the other."""
    parameters = flight.autopilot.parameters
    fence = {"GF_ACTION": 1, "GF_MAX_HOR_DIST": 1.0}
    for changes in (fence, {"SIM_BAT_DRAIN": 5, "SIM_BAT_MIN_PCT": 0, "COM_LOW_BAT_ACT": 3}):
        for name, value in changes.items():
            parameters.set(name, value)
        flight.run(LOSS_S)
    for name, value in {"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 1}.items():
        parameters.set(name, value)
    flight.run(2 * LOSS_S, heard=False)
    flight.simulator.gps_offset_m = WRONG_M
    flight.run(WRONG_S)


if __name__ == "__main__":
    compiled.leave()
    for name, modules in sorted(readers().items()):
        print(f"{name:24}{', '.join(sorted(modules))}")
