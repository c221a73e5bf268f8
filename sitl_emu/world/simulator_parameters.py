"""PX4's parameters that are about its simulator, as an autopilot tells them: wind, battery, sensors, figures.

`SIMULATOR_PARAMETERS` of the simulator API lists them. What they mean stands with PX4's simulators
(src/modules/simulation: simulator_sih, battery_simulator, sensor_*_sim, v1.18).
"""

from collections.abc import Callable

from sitl_emu.vehicles.battery import Px4Battery
from sitl_emu.world.sih_figures import FIGURES, with_figure
from sitl_emu.world.simulator import VehicleSimulator

Setter = Callable[[VehicleSimulator, float], None]


def set_parameter(simulator: VehicleSimulator, name: str, value: float) -> None:
    """Do as a parameter says; one that no simulator of ours knows is passed over, as another's may know it."""
    setter = _SETTERS.get(name)
    if setter is not None:
        setter(simulator, value)


def _sih_distsnsr_ovr(simulator: VehicleSimulator, value: float) -> None:
    simulator.sih_distsnsr_ovr = value


def _sih_rngbc_noise(simulator: VehicleSimulator, value: float) -> None:
    simulator.sih_rngbc_noise = value


def _sih_wind_n(simulator: VehicleSimulator, value: float) -> None:
    simulator.sih_wind_n = value


def _sih_wind_e(simulator: VehicleSimulator, value: float) -> None:
    simulator.sih_wind_e = value


def _bat1_n_cells(simulator: VehicleSimulator, value: float) -> None:
    if isinstance(simulator.battery, Px4Battery):
        simulator.battery.bat1_n_cells = round(value)


def _bat1_v_charged(simulator: VehicleSimulator, value: float) -> None:
    if isinstance(simulator.battery, Px4Battery):
        simulator.battery.bat1_v_charged = value


def _bat1_v_empty(simulator: VehicleSimulator, value: float) -> None:
    if isinstance(simulator.battery, Px4Battery):
        simulator.battery.bat1_v_empty = value


def _sim_bat_drain(simulator: VehicleSimulator, value: float) -> None:
    simulator.sim_bat_drain = value


def _sim_bat_min_pct(simulator: VehicleSimulator, value: float) -> None:
    simulator.sim_bat_min_pct = value


def _sim_gps_used(simulator: VehicleSimulator, value: float) -> None:
    simulator.sim_gps_used = round(value)


def _sim_baro_off_p(simulator: VehicleSimulator, value: float) -> None:
    simulator.barometer.offset_pa = value


def _sim_baro_off_t(simulator: VehicleSimulator, value: float) -> None:
    simulator.barometer.temperature_offset_c = value


def _sim_mag_offset(axis: int) -> Setter:
    def setter(simulator: VehicleSimulator, value: float) -> None:
        x, y, z = simulator.magnetometer.offset_gauss
        simulator.magnetometer.offset_gauss = ((value, y, z), (x, value, z), (x, y, value))[axis]

    return setter


def _figure(name: str) -> Setter:
    def setter(simulator: VehicleSimulator, value: float) -> None:
        vehicle = with_figure(simulator.vehicle, name, value)
        if vehicle is not simulator.vehicle:
            simulator.describe(vehicle)

    return setter


_SETTERS: dict[str, Setter] = {
    **{name: _figure(name) for name in FIGURES},
    "BAT1_N_CELLS": _bat1_n_cells,
    "BAT1_V_CHARGED": _bat1_v_charged,
    "BAT1_V_EMPTY": _bat1_v_empty,
    "SIH_DISTSNSR_OVR": _sih_distsnsr_ovr,
    "SIH_RNGBC_NOISE": _sih_rngbc_noise,
    "SIH_WIND_E": _sih_wind_e,
    "SIH_WIND_N": _sih_wind_n,
    "SIM_BARO_OFF_P": _sim_baro_off_p,
    "SIM_BARO_OFF_T": _sim_baro_off_t,
    "SIM_BAT_DRAIN": _sim_bat_drain,
    "SIM_BAT_MIN_PCT": _sim_bat_min_pct,
    "SIM_GPS_USED": _sim_gps_used,
    "SIM_MAG_OFFSET_X": _sim_mag_offset(0),
    "SIM_MAG_OFFSET_Y": _sim_mag_offset(1),
    "SIM_MAG_OFFSET_Z": _sim_mag_offset(2),
}
