"""Parcels that vehicles carry: let go when the release opens, and followed until they lie still.

A release opens when one of its outputs falls to OPENS_AT. PX4's gripper function gives -1 to release and 1 to grab
(src/lib/mixer_module/functions/FunctionGripper.hpp, v1.18), an actuator of a set what MAV_CMD_DO_SET_ACTUATOR says,
-1..1; both are 0 while the vehicle is disarmed (SimulatorMavlink.cpp), and so hold. What falls is a loose body
(`loose.py`), which begins where the parcel hung, as it moved and turned there.
"""

from collections.abc import Callable, Container, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from sitl_emu.core.attitude import rotated, rotation
from sitl_emu.vehicles.description import Parcel
from sitl_emu.vehicles.multicopter import Multicopter
from sitl_emu.world.obstacles import Areas, Obstacles
from sitl_emu.world.simulator import VehicleSimulator

if TYPE_CHECKING:
    from sitl_emu.world.description import Loose

OPENS_AT: Final = -0.5
"""Ours: half of what PX4's gripper gives."""
RELEASED, IN_WATER, AT_REST = "parcel released", "parcel in water", "parcel at rest"


class ParcelTold(NamedTuple):
    """Something has happened to a parcel."""

    time_us: int
    place: int
    """Of the vehicle that carried it, among those of the simulation."""
    what: str
    """RELEASED, IN_WATER or AT_REST."""
    name: str
    """The loose body's."""
    north_m: float
    east_m: float
    down_m: float
    """Of its centre."""
    water: str = ""
    """Into which it fell."""

    @property
    def text(self) -> str:
        """For people."""
        water = f" ({self.water})" if self.water else ""
        return f"{self.north_m:.2f} m north, {self.east_m:.2f} m east, {-self.down_m:.2f} m up{water}"


class Parcels:
    """All parcels of one world, aboard or not."""

    def __init__(
        self,
        simulators: Sequence[VehicleSimulator],
        release: Callable[..., None],
        solids: Obstacles | None,
        areas: Areas | None,
    ) -> None:
        """`simulators` is looked at anew each time, as contacts do; `release` is the simulation's."""
        self._simulators, self._release = simulators, release
        self._solids, self._areas = solids, areas
        self._aboard = [place for place, each in enumerate(simulators) if each.vehicle.parcel is not None]
        self._fallen: dict[int, str] = {}
        """Names of those that do not yet lie still, by their vehicles' places."""
        self._wet: set[str] = set()
        self.told: list[ParcelTold] = []
        """Since it was taken last; whoever reads it empties it."""

    def update(self, now_us: int, out: Container[int] = ()) -> None:
        """After every vehicle has made its step; those at the places `out` are there no more. Raises WorldError."""
        for place in self._aboard[:]:
            if place not in out and _is_open(self._simulators[place]):
                self._aboard.remove(place)
                self._let_go(now_us, place)
        for place, name in list(self._fallen.items()):
            self._follow(now_us, place, name)

    def _let_go(self, now_us: int, place: int) -> None:
        simulator = self._simulators[place]
        body, parcel = simulator.dynamics, simulator.vehicle.parcel
        assert isinstance(body, Multicopter) and isinstance(parcel, Parcel)
        matrix = rotation(body.q)
        north, east, down = rotated(matrix, parcel.centre_m)
        centre = (body.north_m + north, body.east_m + east, body.down_m + down)
        velocity = body.velocity_at((north, east, down))
        spin = rotated(matrix, (body.p_rad_s, body.q_rad_s, body.r_rad_s))
        name = self._name(place)
        self._release(loose_parcel(name, parcel), centre, body.q, velocity, spin)
        body.drop()
        self._fallen[place] = name
        self.told.append(ParcelTold(now_us, place, RELEASED, name, *centre))

    def _name(self, place: int) -> str:
        """After its vehicle; where several have one name (a launch's), with its number among them."""
        name = self._simulators[place].name
        before = sum(each.name == name for each in self._simulators[:place])
        return parcel_name(name) + (f" {before + 1}" if before else "")

    def _follow(self, now_us: int, place: int, name: str) -> None:
        assert self._solids is not None
        body: Any = self._solids.loose_body(name)
        centre = (body.north_m, body.east_m, body.down_m)
        water = self._areas.water_at(*centre) if self._areas is not None and name not in self._wet else None
        if water is not None:
            self._wet.add(name)
            self.told.append(ParcelTold(now_us, place, IN_WATER, name, *centre, water.name))
        if self._solids.lies_still(name):
            del self._fallen[place]
            self.told.append(ParcelTold(now_us, place, AT_REST, name, *centre))


def parcel_name(vehicle: str) -> str:
    """The loose body that a vehicle's parcel becomes."""
    return f"parcel of {vehicle}"


def loose_parcel(name: str, parcel: Parcel) -> "Loose":
    """What falls."""
    from sitl_emu.world.description import Box, Loose  # for worlds that have such

    return Loose(
        name, 0.0, 0.0, mass_kg=parcel.mass_kg, box=Box(parcel.size_m), drag_m2=parcel.drag_m2,
        friction=parcel.friction, restitution=parcel.restitution, rolling_m=parcel.rolling_m,
    )  # fmt: skip


def _is_open(simulator: VehicleSimulator) -> bool:
    release, controls = simulator.vehicle.release, simulator.controls
    return release is not None and any(
        output <= len(controls) and controls[output - 1] <= OPENS_AT for output in release.outputs
    )
