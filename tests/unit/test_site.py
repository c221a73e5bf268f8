"""Where vehicles of a launch stand, and what their sensors' noise comes from."""

from pathlib import Path

from sitl_emu import vehicles
from sitl_emu.run import site
from sitl_emu.world.home import Home
from sitl_emu.world.simulation import Simulation

IRIS = vehicles.load("iris")
HOME = Home(47.4, 8.5, 490.0, 0.0)


def measured(seed: int, name: str) -> list[object]:
    """What a vehicle at rest measures in a second."""
    simulator = site.plain(HOME, seed).simulator(IRIS, 0.0, name)
    return [simulator.tick(None) for _ in range(250)]


def test_seed_and_name_choose_the_noise() -> None:
    """The same seed, the same noise; another seed (`launch --seed 2`) or another vehicle of a launch, another."""
    first = measured(1, "iris-0")
    assert measured(1, "iris-0") == first
    assert measured(2, "iris-0") != first
    assert measured(1, "iris-1") != first


def test_vehicles_stand_in_a_row_eastwards() -> None:
    here = site.plain(HOME, 1)
    assert here.row([IRIS] * 3) == [0.0, site.SPACING_M, 2.0 * site.SPACING_M]
    assert here.simulator(IRIS, site.SPACING_M, "iris-1").pose().east_m == site.SPACING_M


TOWN = """name: town
solids:
- {name: shed, north_m: 0, east_m: 5, box: {size_m: [3, 3, 4]}}
water:
- {name: pond, level_m: 0.2, polygon_m: [[-3, 11], [-3, 13], [3, 13], [3, 11]]}
"""


def test_what_stands_in_the_row_is_passed_over(tmp_path: Path) -> None:
    """A shed from 3.5 to 6.5 m east holds or is too near to 3 and 6 m, a pond from 11 to 13 m holds 12 m."""
    (tmp_path / "town.yaml").write_text(TOWN)
    here = site.in_world(str(tmp_path / "town.yaml"), 1, print)
    offsets_m = here.row([IRIS] * 4)
    assert offsets_m == [0.0, 9.0, 15.0, 18.0]
    simulators = [here.simulator(IRIS, each, f"iris-{each}") for each in offsets_m]
    assert not Simulation(simulators, here.solids, here.areas).begins_in(["iris"] * 4)


def test_the_first_stands_at_home_whatever_is_there_and_a_row_without_room_ends(tmp_path: Path) -> None:
    (tmp_path / "town.yaml").write_text(
        "name: town\nsolids: [{name: hall, north_m: 0, east_m: 490, box: {size_m: [6, 1000, 4]}}]\n"
    )
    here = site.in_world(str(tmp_path / "town.yaml"), 1, print)
    offsets_m = here.row([IRIS] * 2)
    assert offsets_m == [0.0, site.SPACING_M * (1 + site.MOST_PASSED)]
    simulators = [here.simulator(IRIS, each, f"iris-{each}") for each in offsets_m]
    assert "iris would start in hall" in Simulation(simulators, here.solids, here.areas).begins_in(["iris"] * 2)
