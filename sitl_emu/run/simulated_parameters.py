"""PX4's parameters that are about its simulator, told to it: wind, battery, satellites, offsets of sensors.

In a real PX4 with SIH the simulator reads them itself. Here the autopilot knows no simulator, and the simulator no
parameters: they travel beside the simulator API, over memory and TCP alike, so that they act wherever ours flies.
"""

from collections.abc import Sequence

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.core.simulator_api import SIMULATOR_PARAMETERS, SimulatorParameter


class SimulatedParameters:
    """What of one autopilot's SIH_* and SIM_* parameters its simulator has not been told yet."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._told: dict[str, float] = {}
        self._version = -1

    def changed(self) -> Sequence[SimulatorParameter]:
        """Those that have changed since the last call, at first all; cheap when nothing has."""
        parameters = self._parameters
        if parameters.version == self._version:
            return ()
        self._version = parameters.version
        new = {name: value for name in SIMULATOR_PARAMETERS if self._told.get(name) != (value := parameters[name])}
        self._told.update(new)
        return [SimulatorParameter(name, float(value)) for name, value in new.items()]
