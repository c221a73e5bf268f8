"""The fleet's loop on fakes: what happens to one vehicle is its own."""

import math
from collections.abc import Callable, Sequence

import pytest

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import (
    STATE_BOOT,
    STATE_POWEROFF,
    AutopilotChannel,
    AutopilotState,
    BesideMessage,
    HilActuatorControls,
    HilSensor,
    SimulatorParameter,
)
from sitl_emu.run.fleet import Fleet, Host, Member
from sitl_emu.run.pacing import Pacer
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.4, 8.5, 490.0, 0.0)
Act = Callable[["FakeHost"], Sequence[BesideMessage]]


class FakeHost:
    """An autopilot that counts its ticks, and does in a tick what `acts` says of it."""

    def __init__(self, acts: dict[int, Act] | None = None, boots_in: int = 2) -> None:
        self.ticks = self.closed = self.kept_time = 0
        self.off = False
        self.read_links: list[int] = []
        self.times_us: list[int] = []
        self._acts, self._boots_in = acts or {}, boots_in

    @property
    def booted(self) -> bool:
        return self.ticks >= self._boots_in

    def tick(self, channel: AutopilotChannel) -> None:
        self.ticks += 1
        sensor = channel.receive()[-1]
        assert isinstance(sensor, HilSensor)
        self.times_us.append(sensor.time_usec)
        act = self._acts.get(self.ticks)
        channel.send(HilActuatorControls(sensor.time_usec, 1, (0.1 * self.ticks,), 0), act(self) if act else ())

    def read(self, link: int) -> None:
        if link == 3:
            raise ValueError("this link breaks it")
        self.read_links.append(link)

    def keep_time(self) -> None:
        self.kept_time += 1

    def close(self) -> None:
        self.closed += 1
        self.off = True


class FakeWait:
    """Says once what lies ready."""

    def __init__(self) -> None:
        self.ready: list[tuple[Host, int] | None] = []

    def wait(self, timeout_s: float) -> list[tuple[Host, int] | None]:
        ready, self.ready = self.ready, []
        return ready


def simulator(place: int = 0) -> VehicleSimulator:
    """They stand apart, so that they have nothing to do with one another."""
    east_m = 10.0 * place
    return VehicleSimulator(vehicles.load("iris"), HOME, 1, FlatGround(), start_east_m=east_m, name=f"{place}")


class Abyss:
    """Ground that there is only as long as nobody flies."""

    flown = False

    def height_m(self, north_m: float, east_m: float) -> float:
        if self.flown:
            raise OverflowError("no such place")
        return 0.0


def breaks(_host: FakeHost) -> Sequence[BesideMessage]:
    raise ZeroDivisionError("a fault of ours")


def says(message: BesideMessage) -> Act:
    return lambda _host: [message]


class Launch:
    """A fleet of fakes, flown for so many ticks."""

    def __init__(self, *hosts: FakeHost, renewed: bool = False) -> None:
        self.hosts, self.wait, self.said = hosts, FakeWait(), list[str]()
        renew = simulator if renewed else None
        members = [Member(f"iris {place}", host, renew) for place, host in enumerate(hosts)]
        self.simulation = Simulation([simulator(place) for place in range(len(hosts))], isolated=True)
        self.fleet = Fleet(members, self.simulation, self.wait, self.said.append)

    def fly(self, ticks: int) -> None:
        left = iter(range(ticks))
        self.fleet.fly(Pacer(math.inf), lambda: next(left, None) is None)


def test_a_fault_of_an_autopilot_is_reported_and_its_mates_fly_on(capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = FakeHost(), FakeHost({5: breaks})
    launch = Launch(bad, good)
    launch.fly(20)
    assert (good.ticks, bad.ticks, bad.closed, good.closed) == (20, 5, 1, 0)
    assert launch.fleet.failed
    reported = capsys.readouterr().err
    assert "iris 0 has failed" in reported and "ZeroDivisionError: a fault of ours" in reported


def test_a_fault_of_a_simulator_takes_only_its_vehicle_out(capsys: pytest.CaptureFixture[str]) -> None:
    one, other = FakeHost(), FakeHost()
    launch = Launch(one, other)
    abyss = Abyss()
    launch.simulation.replace(1, VehicleSimulator(vehicles.load("iris"), HOME, 1, abyss, start_east_m=10.0))
    abyss.flown = True
    launch.fly(10)
    assert (one.ticks, other.ticks, other.closed) == (10, 0, 1)
    assert "OverflowError: no such place" in capsys.readouterr().err


def test_a_datagram_that_breaks_one_vehicle_breaks_no_other(capsys: pytest.CaptureFixture[str]) -> None:
    one, other = FakeHost(), FakeHost()
    launch = Launch(one, other)
    launch.wait.ready = [(one, 0), (other, 3), (other, 0), None]
    launch.fly(10)
    assert one.read_links == [0] and other.read_links == [] and other.closed == 1
    assert one.ticks == 10 > other.ticks
    assert "this link breaks it" in capsys.readouterr().err


def test_the_fleet_ends_when_all_were_shut_down_each_at_its_time() -> None:
    off = AutopilotState(STATE_POWEROFF)
    one, other = FakeHost({4: says(off)}), FakeHost({9: says(off)})
    launch = Launch(one, other)
    launch.fly(100)
    assert (one.ticks, other.ticks) == (4, 9)
    assert launch.said == ["iris 0 was shut down", "iris 1 was shut down"]
    assert not launch.fleet.failed


@pytest.mark.parametrize("renewed", [True, False])
def test_at_a_reboot_a_simulator_that_is_the_vehicles_own_begins_anew_and_a_world_goes_on(renewed: bool) -> None:
    one, other = FakeHost({6: says(AutopilotState(STATE_BOOT))}), FakeHost()
    Launch(one, other, renewed=renewed).fly(10)
    after = [4000, 8000] if renewed else [28000, 32000]
    assert one.times_us[:8] == [4000, 8000, 12000, 16000, 20000, 24000, *after]
    assert other.times_us == [4000 * tick for tick in range(1, 11)]


def test_nobody_is_listened_to_before_all_are_armable() -> None:
    quick, slow = FakeHost(boots_in=2), FakeHost(boots_in=8)
    launch = Launch(quick, slow)
    launch.wait.ready = [(quick, 0)]
    launch.fly(7)
    assert quick.read_links == [] and quick.kept_time == 0
    launch.fly(4)
    assert quick.read_links == [0] and quick.kept_time > 0


def test_what_an_autopilot_says_of_its_simulator_reaches_its_own() -> None:
    one, other = FakeHost({2: says(SimulatorParameter("SIM_GPS_USED", 4.0))}), FakeHost()
    launch = Launch(one, other)
    launch.fly(3)
    assert [each.sim_gps_used for each in launch.simulation.simulators] == [4, 16]
