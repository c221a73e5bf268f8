"""A whole vehicle in one process, autopilot, simulator and payload, flown over MAVLink by a ground station."""

import math
from collections.abc import Callable
from typing import Any

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import NavState
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.run import components as payload
from sitl_emu.world.contacts import Impact
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, Pose, VehicleSimulator
from sitl_emu.world.world import World

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICK_S = 0.004
BEAT_TICKS = 250


class Pilot:
    """`every(hz, make)` sends a message again and again; `heard` is what came back on the first link."""

    def __init__(self, model: str, world: World | None = None, *, parcel: bool = False, **parameters: float) -> None:
        """`world`: instead of flat ground; the vehicle starts at its origin, and it lies at HOME.

        `parcel`: whether what its release can carry hangs there.
        """
        vehicle = vehicles.with_parcel(vehicles.load(model), {}) if parcel else vehicles.load(model)
        self.autopilot = Autopilot({**vehicle.airframe, **parameters}, 0)
        payload.plug_in(vehicle, self.autopilot)
        solids = world.solids if world is not None else None
        terrain = world.terrain if world is not None else FlatGround()
        areas = world.areas if world is not None else None
        self.simulator = VehicleSimulator(vehicle, HOME, 1, terrain, name=model, obstacles=solids, areas=areas)
        self.simulation = Simulation([self.simulator], solids, areas)
        self.topics = self.autopilot.topics
        self.heard: list[Any] = []
        self.wanted: frozenset[str] = frozenset()
        self._channel = MemoryChannel()
        self._controls: Any = None
        self._ticks = 0
        self._again: list[tuple[int, Callable[[], Any]]] = []
        self._encoder: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self._decoder: Any = mavlink.MAVLink(None)

    @property
    def truth(self) -> Pose:
        """Where the vehicle really is."""
        return self.simulator.pose()

    def send(self, message: Any) -> None:
        """To the autopilot, on the ground station's link."""
        self.autopilot.on_datagram(0, bytes(message.pack(self._encoder)))
        self._encoder.seq = (self._encoder.seq + 1) & 255

    def command(self, number: int, *params: float) -> None:
        """A COMMAND_LONG."""
        padded = params + (0.0,) * (7 - len(params))
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *padded))

    def every(self, hz: float, make: Callable[[], Any]) -> None:
        """Send what `make` makes, from now on; None: nothing."""
        self._again.append((round(1.0 / hz / TICK_S), make))

    def run(self, seconds: float) -> None:
        """Fly on."""
        for _ in range(round(seconds / TICK_S)):
            self._step()

    def until(self, condition: Callable[[], bool], limit_s: float = 120.0) -> None:
        """Fly on until something is so; raises AssertionError when it does not come about."""
        for _ in range(round(limit_s / TICK_S)):
            if condition():
                return
            self._step()
        texts = [text.text for text in self.autopilot.texts.recent]
        raise AssertionError(f"not within {limit_s} s; said {texts}")

    def until_armable(self) -> None:
        """The checks pass."""
        self.until(lambda: self.topics.vehicle_status.pre_flight_checks_pass, 30.0)

    def take_off(self, up_m: float) -> None:
        """Arm and climb to a height above home."""
        self.until_armable()
        self.autopilot.parameters.set("MIS_TAKEOFF_ALT", up_m)
        self.command(22, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)
        self.command(400, 1)
        self.until(
            lambda: self.topics.vehicle_status.nav_state is NavState.AUTO_LOITER and -self.truth.down_m > up_m - 1
        )

    def until_impact(self) -> list[Impact]:
        """It has met something: what."""
        met: list[Impact] = []

        def has_met() -> bool:
            met.extend(self.simulation.impacts())
            return bool(met)

        self.until(has_met)
        return met

    def until_disarmed(self) -> None:
        """Landed."""
        self.until(lambda: not self.topics.vehicle_status.armed)

    def _step(self) -> None:
        self._channel.simulator.send(self.simulation.tick([self._controls])[0])
        self._channel.autopilot.send(self.autopilot.step(self._channel.autopilot.receive()))
        self._controls = self._channel.simulator.receive()
        self._ticks += 1
        if self._ticks % BEAT_TICKS == 0:
            self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        for ticks, make in self._again:
            if self._ticks % ticks == 0 and (message := make()) is not None:
                self.send(message)
        links = self.autopilot.mavlink.links
        if self.wanted:
            for data in links[0].outbox:
                found = self._decoder.parse_buffer(data) or []
                self.heard += [message for message in found if message.get_type() in self.wanted]
        for link in links:
            link.outbox.clear()
