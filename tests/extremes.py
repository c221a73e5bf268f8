"""Parameters at their extremes, in every phase of a flight: nothing that is set may raise.

PX4 takes any float and any 32-bit integer for any parameter and goes on with what its arithmetic makes of it. A `Scene`
brings a vehicle into a phase of its flight; each case then sets parameters in a fork of that moment and flies on.
tests/unit/test_parameter_extremes.py runs a part of all cases, tools/sweep_parameters.py all of them.
"""

import math
import os
import random
import signal
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command, arm
from sitl_emu.gcs.mission import MissionItem, MissionUpload
from sitl_emu.gcs.set_mode import set_mode
from tests.hostile import TICK_US, Victim

HEX, ROVER = "sihsim_hex", "sihsim_rover_ackermann"
FLOATS = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 0.0, -1.0, 1e-45, 1e-20, 1e9, 65536.5)
INTEGERS = (0, -1, 1, 255, 256, 65_536, 1 << 20, (1 << 31) - 1, -(1 << 31))
LONGEST_S = 60
"""Of one case on a busy machine; what takes longer hangs."""


class Scene(NamedTuple):
    """A phase of a flight: who flies, how the vehicle gets there, and what is done once a parameter is set."""

    name: str
    model: str
    begin: Callable[[Victim], None]
    then: Callable[[Victim], None]


Case = tuple[Mapping[str, Value], ...]
"""Values that are set together, one such set after the other; each is taken back before the next."""


def command(victim: Victim, number: int, *params: float) -> None:
    """A COMMAND_LONG of the ground station, its further params 0."""
    values = (*params, *(0.0,) * (7 - len(params)))
    victim.say(mavlink.MAVLink_command_long_message(1, 1, number, 0, *values))


def mode(victim: Victim, main: int, sub: int = 0) -> None:
    """PX4's modes by their numbers."""
    command(victim, mavlink.MAV_CMD_DO_SET_MODE, 1.0, main, sub)


def _sticks(victim: Victim) -> None:
    victim.say(mavlink.MAVLink_manual_control_message(1, 600, -400, 650, 300, 0))


def _centred(victim: Victim) -> None:
    victim.say(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))


def _armed_takeoff(victim: Victim) -> None:
    victim.run(3.0)
    victim.drive(set_mode(1, "takeoff"))
    victim.drive(arm(1))


def _airborne(victim: Victim) -> None:
    _armed_takeoff(victim)
    victim.run(6.0)


def _at_rest(victim: Victim) -> None:
    victim.run(3.0)


def _try_to_arm(victim: Victim) -> None:
    command(victim, mavlink.MAV_CMD_RUN_PREARM_CHECKS)
    victim.coast(0.1)
    command(victim, mavlink.MAV_CMD_DO_SET_MODE, 1.0, 4.0, 2.0)
    command(victim, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)


def _nothing(victim: Victim) -> None:
    pass


def _in_mode(main: int, sub: int = 0) -> Callable[[Victim], None]:
    """Take off, and change the mode with sticks off their centre."""

    def begin(victim: Victim) -> None:
        _airborne(victim)
        _centred(victim)
        victim.run(0.1)
        mode(victim, main, sub)
        victim.run(0.3)
        _sticks(victim)
        victim.run(0.5)

    return begin


def _stick_moved(victim: Victim) -> None:
    victim.say(mavlink.MAVLink_manual_control_message(1, -900, 1000, 100, -1000, 0))


def _released(victim: Victim) -> None:
    _centred(victim)


def _orbit(victim: Victim) -> None:
    _airborne(victim)
    command(victim, mavlink.MAV_CMD_DO_ORBIT, 5.0, 2.0, 0.0, 0.0, math.nan, math.nan, math.nan)
    victim.run(2.0)


def _mission(victim: Victim) -> None:
    items = [
        MissionItem(6, mavlink.MAV_CMD_NAV_TAKEOFF, x=473977420, y=85455940, z=6.0),
        MissionItem(6, mavlink.MAV_CMD_NAV_WAYPOINT, x=473978000, y=85456000, z=8.0),
        MissionItem(6, mavlink.MAV_CMD_NAV_WAYPOINT, x=473978000, y=85457500, z=6.0),
        MissionItem(6, mavlink.MAV_CMD_NAV_LOITER_TIME, param1=1.0, x=473977420, y=85457500, z=6.0),
        MissionItem(2, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH),
    ]
    victim.run(3.0)
    victim.drive(MissionUpload(1, items))
    victim.drive(set_mode(1, "mission"))
    victim.drive(arm(1))
    victim.run(8.0)


def _next_leg(victim: Victim) -> None:
    command(victim, mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 2.0)


def _offboard_begin(victim: Victim) -> None:
    _airborne(victim)
    for _ in range(4):
        _offboard(victim)
        victim.run(0.2)
    mode(victim, 6)
    _offboard(victim)
    victim.run(0.2)


def _offboard(victim: Victim) -> None:
    victim.say(
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0x0DF8, 9, 5, -6, 0, 0, 0, 0, 0, 0, 0, 0)
    )


def _follow(victim: Victim) -> None:
    _airborne(victim)
    _target(victim)
    mode(victim, 4, 8)
    for _ in range(3):
        _target(victim)
        victim.run(0.3)


def _target(victim: Victim) -> None:
    victim.say(
        mavlink.MAVLink_follow_target_message(
            0, 3, 473978000, 85456000, 490.0, [1.0, 1.0, 0.0], [0.0] * 3, [1.0, 0.0, 0.0, 0.0], [0.0] * 3, [1.0] * 3, 0
        )
    )


def _go_on_following(victim: Victim) -> None:
    _target(victim)
    victim.coast(0.1)
    _target(victim)


def _reposition(victim: Victim) -> None:
    _airborne(victim)
    victim.say(mavlink.MAVLink_command_int_message(1, 1, 0, 192, 0, 0, -1, 1, 0, math.nan, 473979000, 85457000, 495.0))
    victim.run(1.5)


def _driving(victim: Victim) -> None:
    _mission(victim)


def _rover_manual(main: int) -> Callable[[Victim], None]:
    def begin(victim: Victim) -> None:
        victim.run(3.0)
        _centred(victim)
        victim.run(0.1)
        mode(victim, main)
        victim.drive(arm(1))
        _sticks(victim)
        victim.run(1.0)

    return begin


def _pre_armed(victim: Victim) -> None:
    victim.run(3.0)
    victim.drive(Command(1, 1, mavlink.MAV_CMD_RUN_PREARM_CHECKS))


SCENES = (
    Scene("hex on the ground", HEX, _at_rest, _try_to_arm),
    Scene("hex takes off", HEX, _armed_takeoff, _nothing),
    Scene("hex in a mission", HEX, _mission, _next_leg),
    Scene("hex in Position", HEX, _in_mode(3), _stick_moved),
    Scene("hex in Altitude", HEX, _in_mode(2), _stick_moved),
    Scene("hex in Stabilized", HEX, _in_mode(7), _stick_moved),
    Scene("hex in Acro", HEX, _in_mode(5), _stick_moved),
    Scene("hex brakes in Position", HEX, _in_mode(3), _released),
    Scene("hex returns", HEX, _in_mode(4, 5), _nothing),
    Scene("hex lands", HEX, _in_mode(4, 6), _nothing),
    Scene("hex in an orbit", HEX, _orbit, _stick_moved),
    Scene("hex follows", HEX, _follow, _go_on_following),
    Scene("hex obeys setpoints", HEX, _offboard_begin, _offboard),
    Scene("hex is sent away", HEX, _reposition, _nothing),
    Scene("rover at rest", ROVER, _pre_armed, _try_to_arm),
    Scene("rover in a mission", ROVER, _driving, _next_leg),
    Scene("rover in Manual", ROVER, _rover_manual(1), _stick_moved),
    Scene("rover in Acro", ROVER, _rover_manual(5), _stick_moved),
    Scene("rover in Stabilized", ROVER, _rover_manual(7), _stick_moved),
    Scene("rover in Position", ROVER, _rover_manual(3), _stick_moved),
)


def extremes(parameters: Parameters, name: str) -> tuple[Value, ...]:
    """What a parameter is set to, one after the other."""
    return FLOATS if parameters.is_float(name) else INTEGERS


def singles(parameters: Parameters, names: Sequence[str]) -> Iterator[Case]:
    """Each of these parameters at each of its extremes in turn."""
    for name in names:
        yield tuple({name: value} for value in extremes(parameters, name))


def combinations(parameters: Parameters, names: Sequence[str], seed: int, count: int = 40) -> Iterator[Case]:
    """Draws of ten parameters that are set to extremes together, five draws in turn a case."""
    chance = random.Random(seed)
    for _ in range(count):
        yield tuple(
            {name: chance.choice(extremes(parameters, name)) for name in chance.sample(list(names), 10)}
            for _ in range(5)
        )


class Flight:
    """A vehicle in a scene, from which any number of cases is tried."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self._victim = scene, Victim(scene.model)
        self._read = _Read(self._victim.autopilot.parameters)
        scene.begin(self._victim)
        self.parameters = self._victim.autopilot.parameters
        self.parameters.version += 1  # whoever keeps copies reads them anew
        self._victim.coast(0.1)

    def read(self) -> list[str]:
        """Names of the parameters that any module has read so far: no other can break it."""
        return sorted(self._read.names)

    def tried(self, case: Case, ticks: int) -> str:
        """Fly on with these values in turn, so many ticks each, in a copy of the vehicle; the traceback, or nothing."""
        return in_fork(lambda: self._go_on(case, ticks))

    def _go_on(self, case: Case, ticks: int) -> None:
        victim, parameters = self._victim, self.parameters
        for values in case:
            before = {name: parameters.told(name) for name in values}
            try:
                for name, value in values.items():
                    parameters.set(name, value)
                self.scene.then(victim)
                victim.coast(ticks * TICK_US * 1e-6)
            except Exception as error:
                error.add_note(f"{self.scene.name}: {dict(values)}")
                raise
            for name, value in before.items():
                parameters.set(name, value)


class _Read(dict[str, Value]):
    """Values of parameters that remember who was asked for."""

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters._used)
        self.names: set[str] = set()
        parameters._used = self

    def __getitem__(self, name: str) -> Value:
        self.names.add(name)
        return super().__getitem__(name)


def in_fork(action: Callable[[], None]) -> str:
    """Run something in a copy of this process; the traceback of what it raised, empty if it did not."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(LONGEST_S)
        error = ""
        try:
            action()
        except BaseException:
            error = traceback.format_exc(limit=-4)
        os.write(writing, error.encode()[-4000:])
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        error = pipe.read().decode(errors="replace")
    _, status = os.waitpid(child, 0)
    return error or ("" if status == 0 else f"ended by signal {os.WTERMSIG(status)} after {LONGEST_S} s\n")


def place_of(error: str) -> str:
    """The file and line of a traceback's end, and its exception."""
    lines = [line for line in error.strip().splitlines() if line.startswith(("  File ", "    File "))]
    kinds = [line.partition(":")[0] for line in error.splitlines() if line[:1].isalpha() and "Error" in line]
    return " ".join(part.strip() for part in (*lines[-1:], *kinds[-1:])) or error.strip()
