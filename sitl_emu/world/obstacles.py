"""What is on the ground, as physics and lidar ask for it: `solids.Solids` and `areas.WaterAndFoliage` answer.

They are loaded only for worlds that have such.
"""

from typing import TYPE_CHECKING, NamedTuple, Protocol

from sitl_emu.vehicles.description import Body
from sitl_emu.vehicles.dynamics import Quaternion, Vector3

if TYPE_CHECKING:
    from sitl_emu.world.description import Loose


class Contact(NamedTuple):
    """Where a body meets something."""

    point: Vector3
    """NED, m, on the other's surface."""
    normal: Vector3
    """Unit vector out of the other."""
    depth_m: float
    """How far the body has sunk in; negative: a gap."""
    other: str
    velocity: Vector3 = (0.0, 0.0, 0.0)
    """Of the other, NED, where it moves by itself."""


class LoosePose(NamedTuple):
    """Where a loose body is."""

    described: "Loose"
    place: Vector3
    """Of its centre of mass, NED, m."""
    q: Quaternion
    """Body (north, east, down, as it was described) to NED."""
    centre_m: Vector3 = (0.0, 0.0, 0.0)
    """The centre of mass, in the body: from the middle of a box or cylinder, the origin of a hull or mesh."""


class Pushable(Protocol):
    """What a contact's impulse moves: a vehicle (`dynamics.Dynamics`), or a loose body."""

    @property
    def north_m(self) -> float:
        """Of the centre of mass."""

    @property
    def east_m(self) -> float:
        """Of the centre of mass."""

    @property
    def down_m(self) -> float:
        """Of the centre of mass."""

    def velocity_at(self, arm: Vector3) -> Vector3:
        """Velocity NED of the point `arm` (NED, m) away from the centre of mass."""
        ...

    def mobility(self, arm: Vector3, direction: Vector3) -> float:
        """How much an impulse at `arm` along a unit vector changes the velocity there along it, 1/kg."""
        ...

    def push(self, arm: Vector3, impulse: Vector3) -> None:
        """Take an impulse (NED, N s) at `arm`."""
        ...


class Obstacles(Protocol):
    """All that stands in a world, at one time."""

    @property
    def fastest_m_s(self) -> float:
        """Of all that moves."""

    def step(self, now_us: int) -> None:
        """Advance what is loose by a tick of 4 ms, to a time."""
        ...

    def release(self, described: "Loose", place: Vector3, q: Quaternion, velocity: Vector3, spin: Vector3) -> None:
        """Let a new loose body go. Raises WorldError."""
        ...

    def loose_body(self, name: str) -> Pushable | None:
        """The loose body of a name; None: what has this name is none."""
        ...

    def lies_still(self, name: str) -> bool:
        """Whether a loose body has been at rest for a while, half a second. Raises KeyError."""
        ...

    def loose_poses(self) -> list[LoosePose]:
        """Where all loose bodies are."""
        ...

    def set_time(self, time_s: float) -> None:
        """Put what moves where it is then."""
        ...

    def add_body(self, body: Body) -> int:
        """A vehicle's spheres; its number for `touching`. It is no obstacle to others."""
        ...

    def touching(self, body: int, place: Vector3, q: Quaternion, within_m: float) -> list[Contact]:
        """Contacts of a vehicle's spheres, and gaps up to `within_m`, at a pose."""
        ...

    def ray(self, origin: Vector3, direction: Vector3, reach_m: float) -> tuple[float, Vector3] | None:
        """How far a ray (NED; unit vector) goes, m, and the normal of what it meets; None: nothing."""
        ...

    def surface(self, north_m: float, east_m: float, down_m: float) -> tuple[float, float, float] | None:
        """Height and rise, to north and east, of what lies below a place; None: the ground."""
        ...


class Water(Protocol):
    """One of a world's waters, as `description.Water` has it."""

    @property
    def name(self) -> str:
        """Its own."""

    @property
    def level_m(self) -> float:
        """Height of its surface above the origin."""

    @property
    def current_north_m_s(self) -> float:
        """How fast it flows northwards."""

    @property
    def current_east_m_s(self) -> float:
        """How fast it flows eastwards."""


class Areas(Protocol):
    """Water and foliage of a world."""

    def water_at(self, north_m: float, east_m: float, down_m: float) -> Water | None:
        """The water in which a place lies; None: it is dry."""
        ...

    def heard(self, origin: Vector3, direction: Vector3, range_m: float, reach_m: float) -> float:
        """How far (m) a laser range finder measures along a beam that meets ground or a solid at `range_m`.

        `reach_m`: how far it can hear. inf: nothing comes back.
        """
        ...
