import dataclasses
import itertools

import pytest

from sitl_emu import vehicles
from sitl_emu.vehicles.battery import LoadBattery, Px4Battery, battery_model


def test_sags_under_load_and_recovers() -> None:
    data = vehicles.load("iris").battery
    battery = LoadBattery(data)
    full = battery.voltage_v
    for _ in range(20):
        battery.step(0.2, 300.0, True)
    loaded = battery.voltage_v
    assert battery.current_a == pytest.approx(305.0 / loaded, rel=0.01)
    assert full - loaded > 0.9 * data.internal_resistance_ohm * battery.current_a
    for _ in range(40):
        battery.step(0.2, 0.0, True)
    assert loaded < battery.voltage_v < full


@pytest.mark.parametrize("model", ["iris", "m600", "responder", "rover"])
def test_energy_taken_is_the_energy_it_holds(model: str) -> None:
    data = vehicles.load(model).battery
    battery, power, seconds = LoadBattery(data), 5.0 * data.capacity_ah * data.cells, 0.0
    while battery.remaining > 0.0:
        battery.step(0.2, power, True)
        seconds += 0.2
        assert battery.voltage_v > data.cells * data.cell_empty_v * 0.9
    energy_wh = (power + data.avionics_power_w) * seconds / 3600.0
    mean_v = energy_wh / data.capacity_ah
    assert data.cell_empty_v < mean_v / data.cells < data.cell_full_v
    assert battery.remaining == 0.0


def test_voltage_falls_with_charge() -> None:
    battery = LoadBattery(dataclasses.replace(vehicles.load("iris").battery, capacity_ah=0.1))
    seen = [battery.voltage_v]
    for _ in range(600):
        battery.step(0.2, 20.0, True)
        seen.append(battery.voltage_v)
    assert all(later <= earlier + 1e-9 for earlier, later in itertools.pairwise(seen))


def test_motors_are_as_fast_as_the_voltage_lets_them_be_and_an_empty_battery_is_dead() -> None:
    data = vehicles.load("iris").battery
    battery = LoadBattery(dataclasses.replace(data, capacity_ah=0.02))
    assert battery.drive == 1.0
    while battery.remaining > 0.0:
        assert battery.drive == pytest.approx(battery.voltage_v / (data.cells * data.cell_full_v))
        last = battery.drive
        battery.step(0.2, 20.0, True)
    assert 0.8 < last < 0.9 and battery.drive == 0.0
    assert battery_model(vehicles.load("sihsim_hex").battery).drive == 1.0


def test_px4s_battery_drains_as_measured() -> None:
    """PX4 v1.18, SIM_BAT_DRAIN 60, SIM_BAT_MIN_PCT 0: 1.67 %/s; 15.99 V at 90 %, 15.27 V at 50 %, 14.73 V at 20 %."""
    battery = battery_model(vehicles.load("sihsim_hex").battery)
    assert isinstance(battery, Px4Battery)
    battery.sim_bat_min_pct = 0.0
    assert battery.voltage_v == pytest.approx(16.2)
    seen: dict[int, float] = {}
    for tick in range(1, 301):
        battery.step(0.2, 0.0, True)
        seen.setdefault(round(100 * battery.remaining), battery.voltage_v)
        assert battery.remaining == pytest.approx(1.0 - tick * 0.2 / 60.0, abs=1e-6)
    assert [seen[90], seen[50], seen[20]] == pytest.approx([15.994, 15.274, 14.734], abs=0.05)
    battery.step(0.2, 0.0, False)
    assert battery.remaining == 1.0


def test_px4s_battery_stops_at_its_minimum() -> None:
    battery = Px4Battery(vehicles.load("sihsim_hex").battery)
    for _ in range(1000):
        battery.step(0.2, 0.0, True)
    assert battery.remaining == pytest.approx(0.5)
    assert battery.voltage_v == pytest.approx(15.3)


def test_px4s_battery_is_never_fuller_than_a_fault_left_it() -> None:
    battery = Px4Battery(vehicles.load("sihsim_hex").battery)
    battery.set_charge(0.8)
    battery.step(3.0, 0.0, True)
    assert battery.remaining == pytest.approx(0.75), "it drains from there"
    battery.step(0.2, 0.0, False)
    assert battery.remaining == 0.8
    battery.set_charge(0.1)
    for armed in (True, False):
        battery.step(0.2, 0.0, armed)
        assert battery.remaining == 0.1
    assert battery.voltage_v == pytest.approx(14.58)


def test_px4s_battery_lasts_a_second_at_least() -> None:
    battery = Px4Battery(vehicles.load("sihsim_hex").battery)
    battery.sim_bat_drain, battery.sim_bat_min_pct = 0.0, 0.0
    battery.step(0.2, 0.0, True)
    assert battery.remaining == pytest.approx(0.8)
