"""Batteries: one that its load drains, and PX4's simulated one.

`LoadBattery`: current I = P/V of the actuators and the avionics, state of charge s̄ = -I/capacity, open-circuit
voltage per cell between empty and full along a lithium discharge curve (steep at both ends, flat between), terminal
voltage V = V_oc - R I, smoothed over 0.5 s of load (the slow part of the sag).
`Px4Battery`: src/modules/simulation/battery_simulator of PX4 v1.18: while armed it loses its charge within
SIM_BAT_DRAIN seconds, but not below SIM_BAT_MIN_PCT; disarmed it is full; the voltage is linear in the charge, between
what the parameters BAT1_* say of an empty and of a full battery.
Both may be read at any time: `voltage_v`, `current_a` (NaN: unknown), `remaining` 0..1, `drive` 0..1, the share of
their full speed that motors reach (a brushless motor's speed follows its voltage).
Not modelled: temperature, ageing, recovery beyond the sag's own.
"""

import itertools
from typing import Final

from sitl_emu.vehicles.description import Battery

SAG_TIME_S: Final = 0.5
SHORTEST_DRAIN_S: Final = 1.0
"""SIM_BAT_DRAIN counts for no less (BatterySimulator::Run)."""
CURVE = ((0.0, 0.0), (0.05, 0.22), (0.15, 0.38), (0.40, 0.50), (0.60, 0.62), (0.80, 0.80), (0.95, 0.93), (1.0, 1.0))
"""Charge against height of the cell's voltage between empty and full: a generic lithium-polymer discharge curve."""


class LoadBattery:
    """Drained by what the vehicle does."""

    def __init__(self, battery: Battery) -> None:
        self._battery = battery
        self.remaining = 1.0
        self.current_a = 0.0
        self.voltage_v = battery.cells * battery.cell_full_v
        self.extra_power_w = 0.0
        """What something else takes: a fault."""

    def set_charge(self, charge: float) -> None:
        """Have it hold so much of 1 from now on."""
        self.remaining = charge

    def step(self, dt_s: float, power_w: float, armed: bool) -> None:
        """Advance; an empty battery stays empty."""
        battery = self._battery
        current = (power_w + battery.avionics_power_w + self.extra_power_w) / max(self.voltage_v, 1.0)
        self.current_a += min(1.0, dt_s / SAG_TIME_S) * (current - self.current_a)
        self.remaining = max(0.0, self.remaining - current * dt_s / (3600.0 * battery.capacity_ah))
        cell = battery.cell_empty_v + (battery.cell_full_v - battery.cell_empty_v) * _curve(self.remaining)
        self.voltage_v = battery.cells * cell - battery.internal_resistance_ohm * self.current_a

    @property
    def drive(self) -> float:
        """Voltage over that of a full battery without load: how fast motors turn at a command; empty, it is dead: 0."""
        full_v = self._battery.cells * self._battery.cell_full_v
        return max(self.voltage_v / full_v, 0.0) if self.remaining > 0.0 else 0.0


class Px4Battery:
    """PX4's BatterySimulator; `sim_bat_drain` (s), `sim_bat_min_pct` (%) and `bat1_…` are PX4's parameters."""

    def __init__(self, battery: Battery) -> None:
        self.bat1_n_cells, self.bat1_v_empty, self.bat1_v_charged = (
            battery.cells, battery.cell_empty_v, battery.cell_full_v,
        )  # fmt: skip
        self.sim_bat_drain = 60.0
        self.sim_bat_min_pct = 50.0
        self.remaining = self.most = 1.0
        """What it holds, and what it holds at most: a fault's charge, above which neither parameters nor disarming
        bring it (ours: PX4's own knows no faults)."""
        self.current_a = 0.0
        self.voltage_v = battery.cells * battery.cell_full_v

    def set_charge(self, charge: float) -> None:
        """Have it hold so much of 1 from now on, and never more again."""
        self.remaining = self.most = charge

    def step(self, dt_s: float, power_w: float, armed: bool) -> None:
        """Advance; the load plays no part."""
        if armed:
            drained = self.remaining - dt_s / max(self.sim_bat_drain, SHORTEST_DRAIN_S)
            self.remaining = min(max(drained, 0.01 * self.sim_bat_min_pct, 0.0), self.most)
        else:
            self.remaining = self.most
        cell = self.bat1_v_empty + (self.bat1_v_charged - self.bat1_v_empty) * self.remaining
        self.voltage_v = self.bat1_n_cells * cell

    @property
    def drive(self) -> float:
        """PX4's SIH knows no voltage: motors turn as with a full battery, always."""
        return 1.0


def battery_model(battery: Battery) -> LoadBattery | Px4Battery:
    """The model that a vehicle's data asks for."""
    return Px4Battery(battery) if battery.kind == "px4" else LoadBattery(battery)


def _curve(charge: float) -> float:
    for (x0, y0), (x1, y1) in itertools.pairwise(CURVE):
        if charge <= x1:
            return y0 + (y1 - y0) * (charge - x0) / (x1 - x0)
    return 1.0
