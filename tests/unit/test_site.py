"""Where vehicles of a launch stand, and what their sensors' noise comes from."""

from sitl_emu import vehicles
from sitl_emu.run import site
from sitl_emu.world.home import Home

IRIS = vehicles.load("iris")
HOME = Home(47.4, 8.5, 490.0, 0.0)


def measured(seed: int, name: str, place: int = 0) -> list[object]:
    """What a vehicle at rest measures in a second."""
    simulator = site.plain(HOME, seed).simulator(IRIS, place, name)
    return [simulator.tick(None) for _ in range(250)]


def test_seed_and_name_choose_the_noise() -> None:
    """The same seed, the same noise; another seed (`launch --seed 2`) or another vehicle of a launch, another."""
    first = measured(1, "iris-0")
    assert measured(1, "iris-0") == first
    assert measured(2, "iris-0") != first
    assert measured(1, "iris-1") != first


def test_vehicles_stand_in_a_row_eastwards() -> None:
    here = site.plain(HOME, 1)
    east_m = [here.simulator(IRIS, place, f"iris-{place}").pose().east_m for place in range(3)]
    assert east_m == [0.0, site.SPACING_M, 2.0 * site.SPACING_M]
