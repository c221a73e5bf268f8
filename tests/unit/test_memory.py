"""A vehicle's memory does not grow while it flies: whoever keeps something a second forgets something a second."""

import gc
import math
import tracemalloc
from pathlib import Path

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICKS_A_SECOND = 250
CLIMB_S, WARM_S, WATCHED_S = 10, 8, 20
GROWTH_KIB_MIN = 60.0
"""Ours: a sixth of what keeping one float of every tick would take (250 Hz · 60 s · 24 bytes of a float)."""


class Flight:
    """An autopilot with its log, whose ground station listens on the first link."""

    def __init__(self, root: Path) -> None:
        vehicle = vehicles.load("sihsim_hex")
        storage.prepare(root)
        self.autopilot = Autopilot(vehicle.airframe, 0, root)
        self._simulator = VehicleSimulator(vehicle, HOME, 0, FlatGround())
        self._controls: HilActuatorControls | None = None
        self._station = mavlink.MAVLink(None, 255, 190)

    def say(self, message: mavlink.MAVLink_message) -> None:
        self.autopilot.on_datagram(0, bytes(message.pack(self._station)))

    def run(self, seconds: int) -> None:
        for _ in range(seconds):
            self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            for _ in range(TICKS_A_SECOND):
                self._controls = self.autopilot.step(self._simulator.tick(self._controls))
                for link in self.autopilot.mavlink.links:
                    link.outbox.clear()


def autopilot_kib() -> float:
    """What the autopilot's own code has allocated and keeps; the simulator's noise comes in batches of thousands."""
    gc.collect()
    taken = tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(True, "*/autopilot/*")])
    return sum(trace.size for trace in taken.traces) / 1024.0


def test_memory_does_not_grow_in_hover(tmp_path: Path) -> None:
    flight = Flight(tmp_path)
    flight.run(12)
    nan = math.nan
    flight.say(mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    flight.say(mavlink.MAVLink_command_long_message(1, 1, 22, 0, nan, nan, nan, nan, nan, nan, nan))
    flight.run(CLIMB_S)
    tracemalloc.start()
    try:
        flight.run(WARM_S)
        before_kib = autopilot_kib()
        flight.run(WATCHED_S)
        growth_kib_min = (autopilot_kib() - before_kib) * 60.0 / WATCHED_S
    finally:
        tracemalloc.stop()
        flight.autopilot.close()
    assert flight.autopilot.topics.vehicle_status.armed
    assert not flight.autopilot.topics.vehicle_land_detected.landed
    assert growth_kib_min < GROWTH_KIB_MIN
