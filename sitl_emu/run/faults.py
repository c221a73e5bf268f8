"""Faults of a run on their timeline: at a simulated time, or when an event comes; some end again.

A state machine on simulated time: the same seed gives the same faults at the same ticks. Sensors, motors, GPS and
battery fail in the simulator, the radio in its links. A process is killed at the next barrier, at which it waits, so
that all it did before is the same in every run. Where faults of one thing overlap, the one that began last counts, and
the thing is right again when all are over.
"""

import dataclasses
import heapq
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from sitl_emu.missions.companion.companion import Event
from sitl_emu.run.configs import Fault, FaultData
from sitl_emu.vehicles.battery import LoadBattery
from sitl_emu.world.simulator import VehicleSimulator

NEVER_US = 1 << 62


class Change(NamedTuple):
    """A fault begins, or ends."""

    data: FaultData
    begins: bool


class Timeline:
    """Which faults begin and end when."""

    def __init__(self, faults: Sequence[FaultData]) -> None:
        self._due: list[tuple[int, int, Change]] = []
        self._count = 0
        self.waiting = [fault for fault in faults if fault.at_us is None]
        """Those whose event has not come."""
        for fault in faults:
            if fault.at_us is not None:
                self._plan(fault.at_us, fault)

    @property
    def next_us(self) -> int:
        """When the next change is due."""
        return self._due[0][0] if self._due else NEVER_US

    def hear(self, now_us: int, vehicle: str, event: str, text: str) -> None:
        """An event has come: faults that wait for it follow."""
        for fault in list(self.waiting):
            if (vehicle, event) == (fault.event_vehicle, fault.event) and fault.event_text in text:
                self.waiting.remove(fault)
                self._plan(now_us + fault.after_us, fault)

    def due(self, now_us: int) -> list[Change]:
        """What begins and ends by now, in order."""
        changes = list[Change]()
        while self.next_us <= now_us:
            changes.append(heapq.heappop(self._due)[2])
        return changes

    def _plan(self, at_us: int, fault: FaultData) -> None:
        self._push(at_us, Change(fault, True))
        if fault.for_us is not None:
            self._push(at_us + fault.for_us, Change(fault, False))

    def _push(self, at_us: int, change: Change) -> None:
        self._count += 1
        heapq.heappush(self._due, (at_us, self._count, change))


class Run(Protocol):
    """What the injector needs of the conductor."""

    @property
    def now_us(self) -> int: ...  # noqa: D102

    def cut_radio(self, vehicle: str, cut: bool) -> None:
        """Cut a vehicle's radio off, or join it again."""
        ...

    def lose(self, vehicle: str, process: str, kill: Callable[[], None]) -> None:
        """Go on without a process of a vehicle from the next barrier on, where `kill` is called."""
        ...


class Recorder(Protocol):
    """Where events are kept."""

    def event(self, vehicle: str, event: Event) -> None: ...  # noqa: D102


class Injector:
    """Lets the faults of a timeline happen."""

    def __init__(
        self,
        timeline: Timeline,
        run: Run,
        simulators: Mapping[str, VehicleSimulator],
        recorder: Recorder,
        kill: Callable[[str], None],
    ) -> None:
        """`simulators` by vehicle; `kill` kills a process by its title, "companion uas" say, and returns when it is."""
        self.timeline = timeline
        self._run, self._simulators, self._recorder, self._kill = run, simulators, recorder, kill
        self._active = dict[tuple[str, str], list[FaultData]]()
        """By vehicle and what is wrong with it: the faults that have begun and are not over, in that order."""
        self._satellites = dict[str, int]()
        """By vehicle: how many it used before its faults of that kind."""
        self.told: list[str] = []
        """The faults that have begun, in words."""
        self.killed: list[str] = []
        """Those of them that killed a process."""

    def step(self) -> None:
        """Once a tick, before it."""
        now_us = self._run.now_us
        if now_us < self.timeline.next_us:
            return
        for data, begins in self.timeline.due(now_us):
            vehicle, text = data.vehicle, said(data.fault, begins)
            active = self._active.setdefault((vehicle, _what(data.fault)), [])
            if begins:
                active.append(data)
                self.told.append(f"{vehicle}: {text} at {now_us / 1e6:.1f} s")
            else:
                active[:] = [each for each in active if each is not data]  # another may be equal
            if active and not begins:
                text = f"{said(data.fault, True)}: over, but {said(active[-1].fault, True)} still"
            self._recorder.event(vehicle, Event(now_us, "fault" if begins else "fault_ended", text, {}))
            self._apply(vehicle, data.fault, active[-1].fault if active else None)

    def _apply(self, vehicle: str, fault: Fault, acting: Fault | None) -> None:
        """Make what a fault is about as `acting`, another of the same, wants it; None: right again."""
        simulator, off = self._simulators[vehicle], acting is not None
        if fault.motor is not None:
            simulator.motor_off[fault.motor - 1] = off
        elif fault.sensor is not None:
            _SENSORS[fault.sensor](simulator, off)
        elif fault.gps_satellites is not None:
            if acting is not None and acting.gps_satellites is not None:
                self._satellites.setdefault(vehicle, simulator.sim_gps_used)
                simulator.sim_gps_used = acting.gps_satellites
            else:
                simulator.sim_gps_used = self._satellites.pop(vehicle)
        elif fault.gps_offset_m is not None:
            offset_m = acting.gps_offset_m if acting is not None else None
            simulator.gps_offset_m = offset_m or (0.0, 0.0, 0.0)
        elif fault.battery_charge is not None:
            simulator.battery.set_charge(fault.battery_charge)
        elif fault.battery_drain_w is not None:
            assert isinstance(simulator.battery, LoadBattery), "checked before the run"
            drain_w = acting.battery_drain_w if acting is not None else None
            simulator.battery.extra_power_w = drain_w or 0.0
        elif fault.radio is not None:
            self._run.cut_radio(vehicle, off)
        elif fault.kill is not None:
            title = f"{fault.kill} {vehicle}"
            self.killed.append(f"injected fault: {title} killed at {self._run.now_us / 1e6:.1f} s")
            self._run.lose(vehicle, fault.kill, lambda: self._kill(title))


def _what(fault: Fault) -> str:
    """What is wrong, for telling whether two faults are about the same: of motors and sensors each is its own."""
    names = (field.name for field in dataclasses.fields(fault))
    name, value = next((name, value) for name in names if (value := getattr(fault, name)) is not None)
    return f"{name} {value}" if name in ("motor", "sensor") else name


def said(fault: Fault, begins: bool) -> str:
    """A fault's beginning or end in words."""
    if fault.motor is not None:
        return f"motor {fault.motor} {'off' if begins else 'on again'}"
    if fault.sensor is not None:
        return f"{fault.sensor} {'off' if begins else 'on again'}"
    if fault.gps_satellites is not None:
        return f"GPS uses {fault.gps_satellites} satellites" if begins else "GPS uses its satellites again"
    if fault.gps_offset_m is not None:
        north, east, down = fault.gps_offset_m
        moved = f"GPS is wrong by {north:g} m north, {east:g} m east, {down:g} m down"
        return moved if begins else "GPS is right again"
    if fault.battery_charge is not None:
        return f"battery at {fault.battery_charge:.0%}"
    if fault.battery_drain_w is not None:
        return f"battery drained by {fault.battery_drain_w:g} W more" if begins else "battery drained no more"
    if fault.radio is not None:
        return "peer radio out" if begins else "peer radio back"
    return f"{fault.kill} killed"


def _gps(simulator: VehicleSimulator, off: bool) -> None:
    simulator.gps_off = off


def _baro(simulator: VehicleSimulator, off: bool) -> None:
    simulator.baro_off = off


def _mag(simulator: VehicleSimulator, off: bool) -> None:
    simulator.mag_off = off


def _lidar(simulator: VehicleSimulator, off: bool) -> None:
    simulator.lidar_off = off


_SENSORS: dict[str, Callable[[VehicleSimulator, bool], None]] = {
    "gps": _gps,
    "baro": _baro,
    "mag": _mag,
    "lidar": _lidar,
}
