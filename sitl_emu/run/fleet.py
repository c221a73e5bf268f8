"""A fleet: vehicles of one process, autopilots and simulators, ticked by one loop with one wait for all their sockets.

It runs unthrottled until all are armable, and at the asked speed from then on. While it runs unthrottled the vehicles
speak, but do not listen: what is sent to them waits until they are armable. A script that arms as soon as position and
home are there would otherwise hit the second, in PX4's time, until the commander trusts them.

Whatever happens to a vehicle is its own: when it reboots, is shut down, or a fault of ours ends it, the others fly on.
"""

import sys
import traceback
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Protocol

from sitl_emu.core.simulator_api import (
    STATE_BOOT,
    STATE_POWEROFF,
    AutopilotChannel,
    BesideMessage,
    CameraTrigger,
    CameraZoom,
    GimbalState,
    HilActuatorControls,
    MemoryChannel,
    PictureTaken,
    SimulatorMessage,
    SimulatorParameter,
    VideoState,
)
from sitl_emu.run.pacing import Pacer
from sitl_emu.run.site import NO_ROOM
from sitl_emu.run.trouble import Trouble
from sitl_emu.world import contacts
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator

NO_CONTROLS = HilActuatorControls(0, 1, (0.0,) * 16, 0)
"""What drives a vehicle whose autopilot has failed: its motors stand still."""


class Host(Protocol):
    """A hosted autopilot (`autopilot_host`)."""

    @property
    def off(self) -> bool: ...  # noqa: D102
    @property
    def booted(self) -> bool: ...  # noqa: D102
    def tick(self, channel: AutopilotChannel) -> None: ...  # noqa: D102
    def read(self, link: int) -> None: ...  # noqa: D102
    def keep_time(self) -> None: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


Controls = Sequence[HilActuatorControls | None]
"""What the autopilots of all vehicles have said last."""


class Photographer(Protocol):
    """Who draws pictures and video (`photographer`)."""

    gimbals: dict[int, GimbalState]
    zooms: dict[int, CameraZoom]
    complaints: list[str]

    def take(self, place: int, number: int, controls: Controls) -> None: ...  # noqa: D102
    def taken(self) -> list[tuple[int, PictureTaken]]: ...  # noqa: D102
    def send_video(self, place: int, running: bool) -> None: ...  # noqa: D102
    def film(self, flying: Collection[int], controls: Controls) -> None: ...  # noqa: D102


class Ros(Protocol):
    """Who tells ROS 2 of the world (`ros_line`)."""

    def begin(self) -> None: ...  # noqa: D102
    def sensed(self, sensed: Sequence[Sequence[SimulatorMessage]]) -> None: ...  # noqa: D102
    def tell(self) -> None: ...  # noqa: D102


class Wait(Protocol):
    """The wait for all sockets (`link_sockets.Poll`)."""

    def wait(self, timeout_s: float) -> "Sequence[tuple[Host, int] | None]": ...  # noqa: D102


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One vehicle of a fleet."""

    name: str
    """For people."""
    host: Host
    renew: Callable[[], VehicleSimulator] | None
    """Makes the simulator with which it begins anew at a reboot, as PX4's SIH does, which is part of it; None: the
    vehicle stays where it is in its world, as it does with any other simulator."""


class Fleet:
    """Vehicles that are ticked together until all have ended."""

    def __init__(
        self,
        members: Sequence[Member],
        simulation: Simulation,
        wait: Wait,
        say: Callable[[str], None],
        photographer: Photographer | None = None,
        ros: Ros | None = None,
    ) -> None:
        """`simulation` holds the simulators of `members`, in their order; `say` tells who ended or crashed.

        `photographer`: who draws the pictures that their cameras take, if anybody does. `ros`: who tells ROS 2 of the
        world, if anybody does: while all goes at the asked speed. Raises Trouble where a vehicle stands in something.
        """
        if told := simulation.begins_in([member.name for member in members]):
            raise Trouble(f"{told}; {NO_ROOM}")
        self._photographer, self._ros = photographer, ros
        self._simulation, self._wait, self._say = simulation, wait, say
        self._flying = dict(enumerate(members))
        self._names = [member.name for member in members]
        self._channels = [MemoryChannel() for _ in members]
        self._controls: list[HilActuatorControls | None] = [None] * len(members)
        self._rebooted = False
        self.failed = False
        """Whether a fault of ours ended one of them."""

    def fly(self, pacer: Pacer, stopped: Callable[[], bool]) -> None:
        """Tick until all have ended, or `stopped` says so."""
        paced = False
        while self._flying and not stopped():
            self.tick()
            if self._rebooted:  # one alone catches up with the clock once more; among others it takes the time it takes
                self._rebooted = False
                paced = paced and any(member.host.booted for member in self._flying.values())
            elif not paced and all(member.host.booted for member in self._flying.values()):
                paced = True
                pacer.start()
                if self._ros is not None:
                    self._ros.begin()
            if paced:
                self._serve(pacer)

    def tick(self) -> None:
        """4 ms: all simulators, then all autopilots."""
        sensed = self._simulation.tick(self._controls)
        if self._ros is not None:
            self._ros.sensed(sensed)
        for impact in self._simulation.impacts():
            self._say(contacts.told(impact, self._names))
        for news in self._simulation.parcels_told():
            self._say(f"{self._names[news.place]}: {news.what}: {news.text}")
        if self._photographer is not None:
            for place, taken in self._photographer.taken():
                sensed[place].insert(0, taken)
            while self._photographer.complaints:
                self._say(self._photographer.complaints.pop())
            self._photographer.film(self._flying, self._controls)
        for place, member in list(self._flying.items()):
            channel = self._channels[place]
            try:
                if (fault := self._simulation.faults.get(place)) is not None:
                    raise fault
                channel.simulator.send(sensed[place])
                member.host.tick(channel.autopilot)
                self._controls[place] = channel.simulator.receive()
                for message in channel.simulator.beside():
                    self._heed(place, message)
            except Exception as fault:
                self._lose(place, fault)

    def _heed(self, place: int, message: BesideMessage) -> None:
        member = self._flying[place]
        if isinstance(message, SimulatorParameter):
            self._simulation.set_parameter(place, *message)
        elif isinstance(message, GimbalState | CameraZoom | CameraTrigger | VideoState):
            self._picture(place, message)
        elif message.system_status == STATE_BOOT:
            self._rebooted = True
            if member.renew is not None:
                self._simulation.replace(place, member.renew())
                self._controls[place] = None
        elif message.system_status == STATE_POWEROFF:
            del self._flying[place]
            self._say(f"{member.name} was shut down")

    def _picture(self, place: int, message: GimbalState | CameraZoom | CameraTrigger | VideoState) -> None:
        if self._photographer is None:
            return
        if isinstance(message, GimbalState):
            self._photographer.gimbals[place] = message
        elif isinstance(message, CameraZoom):
            self._photographer.zooms[place] = message
        elif isinstance(message, VideoState):
            self._photographer.send_video(place, message.running)
        else:
            self._photographer.take(place, message.number, self._controls)

    def _serve(self, pacer: Pacer) -> None:
        """Until the next tick is due, hand what arrives to the autopilots, which answer."""
        if not pacer.next_tick():
            return
        for member in self._flying.values():
            member.host.keep_time()
        if self._ros is not None:
            self._ros.tell()
        left = pacer.remaining_s()
        while True:
            for host, link in filter(None, self._wait.wait(left)):
                if not host.off:
                    self._read(host, link)
            left = pacer.remaining_s()
            if left <= 0.0:
                return

    def _read(self, host: Host, link: int) -> None:
        try:
            host.read(link)
        except Exception as fault:
            self._lose(next(place for place, member in self._flying.items() if member.host is host), fault)

    def _lose(self, place: int, fault: Exception) -> None:
        """A fault of ours has ended a vehicle: say so, free its ports, leave it with its motors off."""
        member = self._flying.pop(place)
        self.failed = True
        self._controls[place] = NO_CONTROLS
        print(f"sitl-emu: {member.name} has failed, by a fault of the emulator:", file=sys.stderr)
        traceback.print_exception(fault)
        try:
            member.host.close()
        except Exception:
            traceback.print_exc()
