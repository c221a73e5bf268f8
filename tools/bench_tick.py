"""CPU of one tick, by module: where the time of a flying autopilot goes.

    python tools/bench_tick.py [MODEL] [SECONDS]

Flies a vehicle in its simulator, in one process without sockets, with a ground station's heartbeat on the first link,
and prints µs of CPU a tick (4 ms simulated): all together, and, of plain Python (SITL_EMU_PURE=1), for every module of
`autopilot.Autopilot`, less what the measuring itself costs. Compiled modules can't be looked into.
"""

import math
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sitl_emu import compiled, vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICK_S = 0.004
MODULES = ("sensors", "estimator", "land_detector", "commander", "navigator", "flight_modes", "logger", "mavlink")


class Flight:
    """A vehicle that is ticked; answers of its links are thrown away."""

    def __init__(self, model: str, root: Path) -> None:
        vehicle = vehicles.load(model)
        storage.prepare(root)
        self.autopilot = Autopilot(vehicle.airframe, 0, root)
        self.simulator = VehicleSimulator(vehicle, HOME, 0, FlatGround(), name=model)
        self.rover = vehicle.propulsion is None
        self.channel = MemoryChannel()
        self.controls: Any = None
        self.ticks = 0
        self.station = mavlink.MAVLink(None, 255, 190)

    def tick(self) -> None:
        """Simulator, autopilot, and what the links have to say."""
        channel, autopilot = self.channel, self.autopilot
        channel.simulator.send(self.simulator.tick(self.controls))
        channel.autopilot.send(autopilot.step(channel.autopilot.receive()))
        self.controls = channel.simulator.receive()
        self.ticks += 1
        if self.ticks % 250 == 0:
            self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        for link in autopilot.mavlink.links:
            link.outbox.clear()

    def say(self, message: Any) -> None:
        """A datagram from the ground station."""
        self.autopilot.on_datagram(0, bytes(message.pack(self.station)))

    def command(self, command: int, *params: float) -> None:
        """COMMAND_LONG."""
        filled = [*params, *[math.nan] * (7 - len(params))]
        self.say(mavlink.MAVLink_command_long_message(1, 1, command, 0, *filled))

    def run(self, seconds: float) -> float:
        """CPU seconds that it took."""
        begin = time.thread_time()
        for _ in range(round(seconds / TICK_S)):
            self.tick()
        return time.thread_time() - begin


def measured(method: Callable[..., Any], spent: dict[str, float], name: str, cost: float) -> Callable[..., Any]:
    """The method, with its CPU added up, less the `cost` of looking at the clock."""
    clock = time.thread_time

    def call(*arguments: Any) -> Any:
        begin = clock()
        result = method(*arguments)
        spent[name] = spent.get(name, 0.0) + clock() - begin - cost
        return result

    return call


def clock_cost() -> float:
    """CPU seconds that show between two looks at the clock with nothing between them."""
    clock = time.thread_time
    looks = sorted(-(clock() - clock()) for _ in range(1001))
    return looks[500]


def main(model: str, seconds: float, root: Path) -> None:
    """Take off (or, a rover, arm), and measure; what is logged lies in `root`."""
    flight = Flight(model, root)
    flight.run(5.0)
    flight.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    if not flight.rover:
        flight.command(mavlink.MAV_CMD_NAV_TAKEOFF)
    flight.run(15.0)
    autopilot = flight.autopilot
    armed, up = autopilot.topics.actuator_armed.armed, -flight.simulator.pose().down_m
    print(f"{model}: {'armed' if armed else 'NOT ARMED'}, {up:.1f} m up")
    total = flight.run(seconds)
    ticks = round(seconds / TICK_S)
    print(f"{'all, ' + ('compiled' if compiled.in_use() else 'plain Python'):24}{total / ticks * 1e6:8.2f} µs")
    if compiled.in_use():
        return
    spent: dict[str, float] = {}
    cost = clock_cost()
    timed: list[tuple[Any, str, str]] = [(getattr(autopilot, name), "update", name) for name in MODULES]
    timed += [
        (autopilot.control, "update_position", "control: position"),
        (autopilot.control, "update_rate", "control: rate, motors"),
        (flight.simulator, "tick", "(simulator)"),
    ]
    for owner, method, name in timed:
        setattr(owner, method, measured(getattr(owner, method), spent, name, cost))
    flight.run(seconds)
    for _, _, name in timed:
        print(f"{name:24}{spent.get(name, 0.0) / ticks * 1e6:8.2f} µs")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        main(sys.argv[1] if sys.argv[1:] else "sihsim_hex", float(sys.argv[2]) if sys.argv[2:] else 20.0, Path(folder))
