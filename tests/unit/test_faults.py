"""Faults on their timeline: when they come, what they do to a vehicle, and what is said of wrong ones."""

import operator
from pathlib import Path
from typing import Any

import pytest
import yaml

from sitl_emu import vehicles
from sitl_emu.core.radio import RadioLink, RadioSettings
from sitl_emu.core.simulator_api import (
    HilActuatorControls,
    HilGps,
    HilSensor,
    SimulatedBattery,
    SimulatorMessage,
)
from sitl_emu.missions.companion.companion import Event
from sitl_emu.run import checks
from sitl_emu.run.configs import Fault, FaultData
from sitl_emu.run.faults import Injector, Timeline
from sitl_emu.run.scenario import ScenarioError, load
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HERE = Home(47.397742, 8.545594, 489.4, 0.0)
M_PER_1E7_DEG = 0.0111319
S = 1_000_000


class FakeRun:
    """One vehicle that stands, or hovers, and what a run writes down of it."""

    def __init__(self, faults: list[FaultData], throttle: float = 0.0, model: str = "iris") -> None:
        self.now_us = 0
        self.simulator = VehicleSimulator(vehicles.load(model), HERE, 1, FlatGround(), name="uas")
        self.events: list[tuple[float, str, str]] = []
        self.killed: list[str] = []
        self.cuts: list[tuple[str, bool]] = []
        self.timeline = Timeline(faults)
        self.injector = Injector(self.timeline, self, {"uas": self.simulator}, self, self.killed.append)
        self._throttle = throttle

    def event(self, vehicle: str, event: Event) -> None:
        self.events.append((event.time_us / 1e6, event.kind, event.text))
        self.timeline.hear(event.time_us, vehicle, event.kind, event.text)

    def cut_radio(self, vehicle: str, cut: bool) -> None:
        self.cuts.append((vehicle, cut))

    def lose(self, vehicle: str, process: str, kill: Any) -> None:
        assert (vehicle, process) == ("uas", "companion")
        kill()

    def fly(self, seconds: float) -> list[SimulatorMessage]:
        messages = list[SimulatorMessage]()
        for _ in range(round(seconds * 250)):
            self.injector.step()
            armed = 128 if self._throttle else 0
            controls = HilActuatorControls(self.now_us, 1, (self._throttle,) * 4 + (0.0,) * 12, armed)
            messages += self.simulator.tick(controls)
            self.now_us += 4000
        return messages


def fault(at_s: float | None = 1.0, for_s: float | None = None, **what: Any) -> FaultData:
    return FaultData(
        vehicle="uas",
        fault=Fault(**what),
        at_us=None if at_s is None else round(at_s * S),
        for_us=None if for_s is None else round(for_s * S),
    )


def test_a_fault_comes_at_its_time_and_goes_after_its_while() -> None:
    run = FakeRun([fault(2.0, 1.0, sensor="gps"), fault(1.0, sensor="mag")])
    fixes = [message.time_usec / 1e6 for message in run.fly(5.0) if isinstance(message, HilGps)]
    assert not [time for time in fixes if 2.01 < time < 2.99]
    assert [time for time in fixes if time < 2.0] and [time for time in fixes if time > 3.0]
    assert run.events == [
        (1.0, "fault", "mag off"), (2.0, "fault", "gps off"), (3.0, "fault_ended", "gps on again"),
    ]  # fmt: skip
    assert run.simulator.mag_off
    assert run.injector.told == ["uas: mag off at 1.0 s", "uas: gps off at 2.0 s"]


def test_a_fault_waits_for_the_first_event_that_is_meant() -> None:
    when = FaultData(
        vehicle="uas", fault=Fault(motor=2), event="phase", event_vehicle="ugv", event_text="driving", after_us=S // 2
    )
    run = FakeRun([when])
    run.timeline.hear(0, "ugv", "phase", "waiting: for a target")
    run.timeline.hear(0, "uas", "phase", "driving: no, that is another's")
    run.fly(1.0)
    assert not run.events and run.timeline.waiting == [when]
    run.timeline.hear(run.now_us, "ugv", "phase", "driving: to the target")
    run.fly(1.0)
    assert run.events == [(1.5, "fault", "motor 2 off")] and run.simulator.motor_off == [False, True, False, False]
    run.timeline.hear(run.now_us, "ugv", "phase", "driving: to the next")
    run.fly(1.0)
    assert len(run.events) == 1 and not run.timeline.waiting


def test_a_fault_may_follow_another() -> None:
    second = FaultData(vehicle="uas", fault=Fault(sensor="baro"), event="fault", event_vehicle="uas", after_us=S)
    run = FakeRun([fault(1.0, sensor="gps"), second])
    run.fly(3.0)
    assert [(time, text) for time, _, text in run.events] == [(1.0, "gps off"), (2.0, "baro off")]


@pytest.mark.parametrize("other", [{"sensor": "gps"}, {"motor": 1}])
def test_what_is_off_twice_is_off_until_both_are_over(other: dict[str, Any]) -> None:
    run = FakeRun([fault(1.0, 9.0, **other), fault(2.0, 1.0, **other), fault(4.0, 1.0, sensor="mag")])

    def off() -> bool:
        return run.simulator.gps_off or run.simulator.motor_off[0]

    run.fly(3.5)
    assert off() and run.events[-1][2].endswith("off still")
    run.fly(2.0)
    assert off(), "another sensor's end is not this one's"
    run.fly(5.0)
    assert not off() and run.events[-1][2].endswith("on again")


def test_what_lasts_outlives_a_shorter_one_of_the_same() -> None:
    run = FakeRun([fault(1.0, sensor="baro"), fault(2.0, 1.0, sensor="baro"), fault(2.0, 1.0, sensor="mag")])
    run.fly(4.0)
    assert run.simulator.baro_off and not run.simulator.mag_off


def test_a_radio_that_is_cut_twice_is_cut_until_both_are_over() -> None:
    run = FakeRun([fault(1.0, 5.0, radio="out"), fault(2.0, 1.0, radio="out")])
    run.fly(5.0)
    assert run.cuts[-1] == ("uas", True)
    run.fly(2.0)
    assert run.cuts[-1] == ("uas", False)


@pytest.mark.parametrize(
    ("name", "values", "set_to"),
    [
        ("gps_satellites", (5, 3), "sim_gps_used"),
        ("gps_offset_m", ((30.0, 0.0, 0.0), (0.0, 9.0, 0.0)), "gps_offset_m"),
        ("battery_drain_w", (400.0, 200.0), "battery.extra_power_w"),
    ],
)
def test_of_figures_the_newest_counts_then_the_one_before_it(name: str, values: tuple[Any, Any], set_to: str) -> None:
    """The third is equal to the first, and its end is not that one's."""
    long, short = values
    run = FakeRun([fault(1.0, 6.0, **{name: long}), fault(2.0, 3.0, **{name: short}), fault(3.0, 1.0, **{name: long})])
    figure = operator.attrgetter(set_to)
    right, seen = figure(run.simulator), list[Any]()
    run.fly(0.5)
    for _ in range(7):
        run.fly(1.0)
        seen.append(figure(run.simulator))
    assert seen == [long, short, long, short, long, long, right]


def test_a_motor_that_stops_turns_a_hover_over() -> None:
    run = FakeRun([fault(2.0, motor=1)], throttle=0.78)
    run.fly(2.0)
    assert abs(run.simulator.dynamics.p_rad_s) < 0.1
    run.fly(0.4)
    assert abs(run.simulator.dynamics.p_rad_s) > 1.0


def test_the_gps_is_deceived_and_then_right_again() -> None:
    run = FakeRun([fault(10.0, 10.0, gps_offset_m=(30.0, 0.0, -5.0))])
    fixes = [message for message in run.fly(30.0) if isinstance(message, HilGps)]

    def mean(low_s: float, high_s: float) -> tuple[float, float]:
        seen = [fix for fix in fixes if low_s * 1e6 < fix.time_usec < high_s * 1e6]
        north = sum(fix.lat - HERE.lat_deg * 1e7 for fix in seen) / len(seen) * M_PER_1E7_DEG
        return north, sum(fix.alt / 1e3 - HERE.alt_amsl_m for fix in seen) / len(seen)

    assert mean(10.1, 20) == pytest.approx((30.0, 5.0), abs=2.0)
    assert mean(1, 10) == pytest.approx((0.0, 0.0), abs=2.0) and mean(20.1, 30) == pytest.approx((0.0, 0.0), abs=2.0)


def test_satellites_fewer_than_four_give_no_fix() -> None:
    run = FakeRun([fault(1.0, 1.0, gps_satellites=3)])
    fixes = [(message.time_usec / 1e6, message.fix_type) for message in run.fly(3.0) if isinstance(message, HilGps)]
    assert {fix for time, fix in fixes if 1.01 < time < 2.0} == {0}
    assert {fix for time, fix in fixes if time < 1.0 or time > 2.01} == {3}


def test_the_battery_is_set_and_drained() -> None:
    run = FakeRun([fault(1.0, battery_charge=0.4), fault(2.0, 30.0, battery_drain_w=800.0)])
    told = [message for message in run.fly(40.0) if isinstance(message, SimulatedBattery)]
    percent = [battery.state_of_charge for battery in told]
    assert percent[0] == pytest.approx(100, abs=0.5) and percent[7] == pytest.approx(40, abs=0.5)
    lost = 800.0 * 30.0 / 3600.0 / (4 * 3.8 * 5.1)
    assert percent[-1] == pytest.approx(100 * (0.4 - lost), abs=2)
    assert percent[-1] > percent[-20] - 0.5, "drained no more"


@pytest.mark.parametrize("throttle", [0.0, 0.7])
def test_px4s_own_battery_keeps_the_charge_of_a_fault(throttle: float) -> None:
    """Neither SIM_BAT_MIN_PCT, 50 %, nor disarming undoes it."""
    run = FakeRun([fault(1.0, battery_charge=0.1)], throttle, model="sihsim_hex")
    told = [round(message.state_of_charge) for message in run.fly(5.0) if isinstance(message, SimulatedBattery)]
    assert told[3] > 90 and set(told[7:]) == {10}


def test_radio_and_processes_are_the_runs_affair() -> None:
    run = FakeRun([fault(1.0, 1.0, radio="out"), fault(3.0, kill="companion")])
    run.fly(4.0)
    assert run.cuts == [("uas", True), ("uas", False)]
    assert run.killed == ["companion uas"]
    assert run.injector.killed == ["injected fault: companion uas killed at 3.0 s"]


def test_a_link_that_is_cut_loses_everything() -> None:
    link = RadioLink(RadioSettings(latency_s=0.0), 1, "a>b")
    link.cut = True
    link.send(0, b"lost", 1.0)
    link.cut = False
    link.send(1000, b"heard", 1.0)
    assert link.due(S) == [b"heard"] and link.lost == 1


def test_the_sensors_go_on_ticking_while_one_is_off() -> None:
    run = FakeRun([fault(0.0, sensor="baro"), fault(0.0, sensor="lidar")])
    assert len([message for message in run.fly(1.0) if isinstance(message, HilSensor)]) == 250


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"at_s": 1}, "faults.0.fault: this field is missing"),
        ({"at_s": 1, "fault": {}}, "fault: .*: give exactly one of motor, sensor, gps_satellites"),
        ({"at_s": 1, "fault": {"motor": 1, "radio": "out"}}, "fault: .*: give exactly one of motor"),
        ({"at_s": 1, "fault": {"engine": 1}}, "fault.engine: unknown field; allowed here: motor, sensor"),
        ({"fault": {"motor": 1}}, "faults.0: .*: give either `at_s` or `when`"),
        ({"at_s": 1, "when": {"event": "armed"}, "fault": {"motor": 1}}, "give either `at_s` or `when`"),
        (
            {"when": {"event": "armed", "evnt": 1}, "fault": {"motor": 1}},
            "when.evnt: unknown field; allowed here: event, vehicle",
        ),
        ({"at_s": 1, "for_s": 1, "fault": {"kill": "companion"}}, "`for_s` is for what can end again"),
        ({"at_s": 1, "fault": {"motor": 5}}, "fault.motor: 5: allowed for iris: 1 to 4"),
        (
            {"at_s": 1, "vehicle": "ugv", "fault": {"motor": 1}},
            "motor: 1: allowed for rover: none, as it has no rotors",
        ),
        (
            {"at_s": 1, "vehicle": "uav", "fault": {"motor": 1}},
            "vehicle: 'uav': there is no such vehicle; there are: uas",
        ),
        ({"when": {"event": "armed", "vehicle": "x"}, "fault": {"motor": 1}}, "when.vehicle: 'x': there is no such"),
        (
            {"at_s": 1, "fault": {"sensor": "sonar"}},
            "fault.sensor: 'sonar': Input should be 'gps', 'baro', 'mag' or 'lid",
        ),
        ({"at_s": 1, "fault": {"radio": "out"}}, "fault.radio: the companion of uas has no peer"),
        ({"at_s": 1, "fault": {"kill": "companion"}}, "fault.kill: 'companion': uas has none"),
        ({"at_s": 1, "vehicle": "hex", "fault": {"battery_drain_w": 9}}, "hex has PX4's simulated battery"),
    ],
)
def test_a_wrong_fault_is_told(tmp_path: Path, entry: dict[str, Any], said: str) -> None:
    models = {"uas": "iris", "ugv": "rover", "hex": "sihsim_hex"}
    path = tmp_path / "own.yaml"
    parts = [
        {"name": name, "model": model, "start": {"north_m": 0.0, "east_m": 5.0 * place}}
        for place, (name, model) in enumerate(models.items())
    ]
    scenario = {"name": "own", "world": {"kind": "flat"}, "vehicles": parts, "faults": [{"vehicle": "uas"} | entry]}
    path.write_text(yaml.safe_dump(scenario))
    with pytest.raises(ScenarioError, match=said):
        checks.check(load(path), 1, path)
