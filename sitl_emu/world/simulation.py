"""The simulation of one world: the vehicles that share it, stepped together, one tick of 4 ms at a time.

Whoever simulates vehicles, `run`, `launch` or `world`, steps them here and nowhere else: what happens between two
vehicles needs both at the same time. A state machine on simulated time, as the simulators are.
"""

from collections.abc import Sequence

from sitl_emu.core.simulator_api import HilActuatorControls, SimulatorMessage
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.simulator_parameters import set_parameter


class Simulation:
    """All vehicles of one world."""

    def __init__(self, simulators: Sequence[VehicleSimulator], *, isolated: bool = False) -> None:
        """`isolated`: a fault of ours in one simulator (an exception) takes that one out and stands in `faults`.

        Else it goes through, and so ends all.
        """
        self.simulators = list(simulators)
        self.faults: dict[int, Exception] = {}
        """By place among `simulators`; what is out is stepped no more, and its sensors say nothing."""
        self._isolated = isolated

    def tick(self, controls: Sequence[HilActuatorControls | None]) -> list[list[SimulatorMessage]]:
        """Advance all by 4 ms; what each vehicle's sensors say, HIL_SENSOR last, in the order of `simulators`.

        `controls`: each vehicle's, in the same order (None: none came, the last ones hold).
        """
        if self._isolated:
            return [self._tick_apart(place, last) for place, last in enumerate(controls)]
        return [simulator.tick(last) for simulator, last in zip(self.simulators, controls, strict=True)]

    def replace(self, place: int, simulator: VehicleSimulator) -> None:
        """Put a vehicle that begins anew in the place of one that is gone."""
        self.simulators[place] = simulator
        self.faults.pop(place, None)

    def set_parameter(self, place: int, name: str, value: float) -> None:
        """Do as one vehicle's autopilot says by a SIM_* or SIH_* parameter of its own."""
        set_parameter(self.simulators[place], name, value)

    def _tick_apart(self, place: int, controls: HilActuatorControls | None) -> list[SimulatorMessage]:
        if place in self.faults:
            return []
        try:
            return self.simulators[place].tick(controls)
        except Exception as fault:
            self.faults[place] = fault
            return []
