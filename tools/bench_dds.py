"""How long a setpoint takes from a ROS 2 node's `write` to the motors, through DDS, the agent's process and a tick.

    python tools/bench_dds.py [COUNT]        # --help explains it; needs pip install 'sitl-emu[ros2]'

An iris stands armed in OFFBOARD, in real time, in this process; so does the node, a participant of its own. Each
setpoint (vehicle_attitude_setpoint) asks for another thrust than the one before. `taken` ends when the autopilot has
read it, `motors` when the first tick is over whose motors follow it; an attitude setpoint passes position control,
which does not run in every tick. ROS_DOMAIN_ID chooses the domain.
"""

import argparse
import math
import os
import select
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any, Final

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.topic import Topic as DdsTopic

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.uxrce_dds_client import cdr, dds_topics
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import SUBSCRIPTIONS
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.run import dds_socket, dds_types
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.home import Home
from sitl_emu.world.simulator import VehicleSimulator

INSTANCE: Final = 80
TICK_S: Final = 0.004
SETTLED_S: Final = 12
"""Simulated, until it may be armed."""
THRUSTS: Final = (0.1, 0.3)
CHANGED: Final = 0.05
"""Of the motors' mean, more than its gyros' noise makes."""
EVERY_S: Final = 0.0507
"""Between two setpoints: no whole number of ticks, so that all moments within one are met."""
ASK_S: Final = 0.5
LIMIT_S: Final = 20.0
QOS: Final = Qos(
    Policy.Reliability.BestEffort,
    Policy.Durability.Volatile,
    Policy.History.KeepLast(1),
    dds_types.PLAIN_CDR,
)


class Vehicle:
    """The autopilot with its simulator, and its line to the agent."""

    def __init__(self, line: dds_socket.DdsSocket) -> None:
        iris = vehicles.load("iris")
        home = Home(47.397742, 8.545594, 489.4, 0.0)
        self._simulator = VehicleSimulator(iris, home, seed=1, terrain=FlatGround())
        self._channel, self._line = MemoryChannel(), line
        self.autopilot = Autopilot(iris.airframe, INSTANCE)
        self._client = self.autopilot.start_uxrce_dds_client()
        self._controls: Any = None

    @property
    def motors(self) -> float:
        """The mean of what drives them."""
        return statistics.fmean(self._controls.controls[:4])

    def tick(self) -> None:
        """One."""
        self._channel.simulator.send(self._simulator.tick(self._controls))
        self._channel.autopilot.send(self.autopilot.step(self._channel.autopilot.receive()))
        self._controls = self._channel.simulator.receive()
        for link in self.autopilot.mavlink.links:
            link.outbox.clear()
        self._line.send(self._client.outbox)

    def listen(self, until_s: float) -> bool:
        """Take what comes before a time; whether anything did."""
        readable, _, _ = select.select([self._line], [], [], max(0.0, until_s - time.perf_counter()))
        for sample in self._line.receive() if readable else ():
            self._client.on_sample(self.autopilot.now_us, sample)
        return bool(readable)


class Node:
    """The node's writers."""

    def __init__(self) -> None:
        self._participant = DomainParticipant(dds_socket.domain())
        self._writers = {
            topic.name: (self._writer(topic), topic.type)
            for topic in SUBSCRIPTIONS
            if topic.name in ("offboard_control_mode", "vehicle_attitude_setpoint", "vehicle_command")
        }

    def _writer(self, topic: dds_topics.Topic) -> DataWriter[Any]:
        name = dds_topics.dds_name(topic, "in", dds_socket.namespace(INSTANCE))
        return DataWriter(self._participant, DdsTopic(self._participant, name, dds_types.carried(topic.type)), qos=QOS)

    @property
    def is_heard(self) -> bool:
        """On all topics."""
        return all(writer.get_matched_subscriptions() for writer, _ in self._writers.values())

    def write(self, topic: str, **fields: Any) -> None:
        """A message, of now."""
        writer, kind = self._writers[topic]
        writer.write(dds_types.sample(dds_types.carried(kind), cdr.Writer(kind).write(**fields)))

    def ask(self, command: int, *params: float) -> None:
        """A command."""
        told = {f"param{place}": value for place, value in enumerate(params, 1)}
        self.write("vehicle_command", command=command, target_system=INSTANCE + 1, target_component=1, **told)

    def push(self, thrust: float) -> None:
        """A setpoint: level, so much thrust."""
        self.write("vehicle_attitude_setpoint", q_d=(1.0, 0.0, 0.0, 0.0), thrust_body=(0.0, 0.0, -thrust))


class Stopwatch:
    """Beats the ticks, and measures."""

    def __init__(self, vehicle: Vehicle, node: Node) -> None:
        self._vehicle, self._node = vehicle, node
        self._tick_s = time.perf_counter()
        self._beat_s = self._tick_s
        self.taken_s: list[float] = []
        self.motors_s: list[float] = []

    def tick(self, each: Callable[[], None] = lambda: None) -> None:
        """In real time; `each` is called whenever a sample came."""
        self._tick_s += TICK_S
        while time.perf_counter() < self._tick_s:
            if self._vehicle.listen(self._tick_s):
                each()
        self._vehicle.tick()
        if time.perf_counter() >= self._beat_s:
            self._beat_s += 0.1
            self._node.write("offboard_control_mode", attitude=True)

    def until(self, true: Callable[[], bool], ask: Callable[[], None]) -> None:
        """Tick until something is so, and ask for it twice a second."""
        end_s, ask_s = time.perf_counter() + LIMIT_S, 0.0
        while not true():
            if time.perf_counter() >= ask_s:
                ask_s = time.perf_counter() + ASK_S
                ask()
            self.tick()
            if time.perf_counter() > end_s:
                sys.exit("it has not come about")

    def measure(self, thrust: float) -> None:
        """One setpoint."""
        next_s = time.perf_counter() + EVERY_S
        while time.perf_counter() < next_s:  # within the tick's wait, not at its beginning
            if next_s > self._tick_s + TICK_S:
                self.tick()
        before, status = self._vehicle.motors, self._vehicle.autopilot.topics
        known = status.offboard_setpoint.attitude
        began_s = time.perf_counter()
        self._node.push(thrust)
        taken = list[float]()

        def look() -> None:
            if not taken and status.offboard_setpoint.attitude is not known:
                taken.append(time.perf_counter() - began_s)

        while abs(self._vehicle.motors - before) < CHANGED:
            self.tick(look)
            if time.perf_counter() - began_s > 1.0:
                return  # lost: best effort
        self.motors_s.append(time.perf_counter() - began_s)
        self.taken_s += taken


def told(name: str, times_s: list[float]) -> str:
    """A line of figures."""
    ordered = sorted(1000.0 * each for each in times_s)
    ninety = ordered[math.ceil(0.9 * len(ordered)) - 1]
    return f"{name}: median {statistics.median(ordered):.2f} ms, nine of ten within {ninety:.2f}, all {ordered[-1]:.2f}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, nargs="?", default=200, help="setpoints, 200")
    count = parser.parse_args().count
    agent = dds_socket.Agent([INSTANCE])
    vehicle, node = Vehicle(agent.sockets[INSTANCE]), Node()
    for _ in range(round(SETTLED_S / TICK_S)):
        vehicle.tick()
    topics = vehicle.autopilot.topics
    watch = Stopwatch(vehicle, node)
    watch.until(lambda: node.is_heard, lambda: None)
    watch.until(lambda: topics.offboard_setpoint.attitude is not None, lambda: node.push(THRUSTS[0]))
    watch.until(lambda: topics.vehicle_status.nav_state is NavState.OFFBOARD, lambda: node.ask(176, 1.0, 6.0))
    for number in range(count):
        # it disarms itself after a while on the ground (COM_DISARM_PRFLT)
        watch.until(lambda: topics.vehicle_status.armed, lambda: node.ask(400, 1.0))
        watch.until(lambda: vehicle.motors > 0.0, lambda: node.push(THRUSTS[0]))
        watch.measure(THRUSTS[(number + 1) % 2])
    load = os.getloadavg()[0]
    print(f"{len(watch.motors_s)} of {count} setpoints arrived; load {load:.1f} on {os.cpu_count()} cores")
    print(told("taken", watch.taken_s))
    print(told("motors", watch.motors_s))
    agent.close()


if __name__ == "__main__":
    main()
