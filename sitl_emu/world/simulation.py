"""The simulation of one world: the vehicles that share it, stepped together, one tick of 4 ms at a time.

Whoever simulates vehicles, `run`, `launch` or `world`, steps them here and nowhere else: what happens between two
vehicles needs both at the same time. A state machine on simulated time, as the simulators are.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sitl_emu.core.simulator_api import HilActuatorControls, SimulatorMessage
from sitl_emu.vehicles.dynamics import Quaternion, Vector3
from sitl_emu.world.contacts import Contacts, Impact
from sitl_emu.world.obstacles import Areas, LoosePose, Obstacles
from sitl_emu.world.parcels import Parcels, ParcelTold
from sitl_emu.world.simulator import TICK_US, VehicleSimulator
from sitl_emu.world.simulator_parameters import set_parameter

if TYPE_CHECKING:
    from sitl_emu.world.description import Loose


class Simulation:
    """All vehicles of one world."""

    def __init__(
        self,
        simulators: Sequence[VehicleSimulator],
        solids: Obstacles | None = None,
        areas: Areas | None = None,
        *,
        isolated: bool = False,
    ) -> None:
        """`solids`: what stands in that world; `areas`: its water and foliage.

        `isolated`: a fault of ours in one simulator (an exception) takes that one out and stands in `faults`; else it
        goes through, and so ends all.
        """
        self.simulators = list(simulators)
        self.faults: dict[int, Exception] = {}
        """By place among `simulators`; what is out is stepped no more, and its sensors say nothing."""
        self._isolated = isolated
        self._ticks = 0
        self._solids = solids
        self._contacts = Contacts(self.simulators, solids, areas)
        self._parcels = Parcels(self.simulators, self.release, solids, areas)

    def tick(self, controls: Sequence[HilActuatorControls | None]) -> list[list[SimulatorMessage]]:
        """Advance all by 4 ms; what each vehicle's sensors say, HIL_SENSOR last, in the order of `simulators`.

        `controls`: each vehicle's, in the same order (None: none came, the last ones hold).
        """
        if self._isolated:
            said = [self._tick_apart(place, last) for place, last in enumerate(controls)]
        else:
            said = [simulator.tick(last) for simulator, last in zip(self.simulators, controls, strict=True)]
        self._ticks += 1
        if self._solids is not None:
            self._solids.step(self._ticks * TICK_US)
        self._parcels.update(self._ticks * TICK_US, self.faults)
        self._contacts.update(self._ticks * TICK_US, self.faults)
        return said

    def begins_in(self, names: Sequence[str]) -> str:
        """Which vehicle stands in something that it could not stand in, for people; empty where none does."""
        return self._contacts.begins_in(names)

    def impacts(self) -> list[Impact]:
        """What vehicles have met since this was asked last."""
        if not self._contacts.impacts:
            return []
        taken, self._contacts.impacts = self._contacts.impacts, []
        return taken

    def parcels_told(self) -> list[ParcelTold]:
        """What has happened to parcels since this was asked last."""
        if not self._parcels.told:
            return []
        taken, self._parcels.told = self._parcels.told, []
        return taken

    def loose_poses(self) -> list[LoosePose]:
        """Where all loose bodies are."""
        return [] if self._solids is None else self._solids.loose_poses()

    def release(
        self,
        body: "Loose",
        place: Vector3,
        q: Quaternion = (1.0, 0.0, 0.0, 0.0),
        velocity: Vector3 = (0.0, 0.0, 0.0),
        spin: Vector3 = (0.0, 0.0, 0.0),
    ) -> None:
        """Let a loose body go now, such as a vehicle's parcel: it falls, tumbles, is met and seen from here on.

        `place`: of its centre of mass (NED, m); `q`: body to NED; `velocity` and `spin`: NED, m/s and rad/s. The places
        that its description gives do not count. Raises WorldError for a name that is taken, a shape that can't be, or
        a world that was not made ready for it (`World.expect_releases`).
        """
        if self._solids is None:
            from sitl_emu.world.description import WorldError

            raise WorldError(f"release: {body.name!r}: this world was not made ready for it (World.expect_releases)")
        self._solids.release(body, place, q, velocity, spin)
        self._contacts.look_again()

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
