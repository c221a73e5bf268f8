"""PX4's parameters that are about its simulator, handed to ours: wind, battery, satellites, sensors that are off.

In a real PX4 with SIH the simulator reads them itself. Here the autopilot knows no simulator, so whoever has both in
one process passes them on whenever a parameter has changed.
"""

from autopilot.parameters import Parameters
from sitl_emu.world.simulator import VehicleSimulator


class SimulatedParameters:
    """Keeps one simulator to what its autopilot's SIH_* and SIM_* parameters say."""

    def __init__(self, parameters: Parameters, simulator: VehicleSimulator) -> None:
        self._parameters, self._simulator = parameters, simulator
        self._version = -1

    def update(self) -> None:
        """Pass on what has changed; cheap when nothing has."""
        parameters, simulator = self._parameters, self._simulator
        if parameters.version == self._version:
            return
        self._version = parameters.version
        simulator.sih_wind_n = float(parameters["SIH_WIND_N"])
        simulator.sih_wind_e = float(parameters["SIH_WIND_E"])
        simulator.sim_bat_drain = float(parameters["SIM_BAT_DRAIN"])
        simulator.sim_bat_min_pct = float(parameters["SIM_BAT_MIN_PCT"])
        simulator.sim_gps_used = int(parameters["SIM_GPS_USED"])
        simulator.barometer.offset_pa = float(parameters["SIM_BARO_OFF_P"])
        simulator.barometer.temperature_offset_c = float(parameters["SIM_BARO_OFF_T"])
        simulator.magnetometer.offset_gauss = (
            float(parameters["SIM_MAG_OFFSET_X"]),
            float(parameters["SIM_MAG_OFFSET_Y"]),
            float(parameters["SIM_MAG_OFFSET_Z"]),
        )
