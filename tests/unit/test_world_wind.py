import statistics

import pytest

from sitl_emu.world.wind import Wind


def test_calm() -> None:
    wind = Wind()
    assert wind.calm
    assert wind.at(1_000_000) == (0.0, 0.0, 0.0)


def test_mean_and_gusts() -> None:
    wind = Wind(3.0, -1.0, 0.8, seed=4)
    assert not wind.calm
    values = [wind.at(tick * 20_000) for tick in range(100_000)]
    north, east, down = zip(*values, strict=True)
    assert statistics.fmean(north) == pytest.approx(3.0, abs=0.2)
    assert statistics.fmean(east) == pytest.approx(-1.0, abs=0.2)
    assert statistics.pstdev(north) == pytest.approx(0.8, rel=0.15)
    assert statistics.pstdev(down) == pytest.approx(0.4, rel=0.15)


def test_who_asks_how_often_does_not_matter() -> None:
    one, two = Wind(2.0, 0.0, 1.0, seed=9), Wind(2.0, 0.0, 1.0, seed=9)
    for tick in range(1000):
        value = one.at(tick * 4000)
        one.at(tick * 4000)
    assert two.at(999 * 4000) == value
    assert Wind(2.0, 0.0, 1.0, seed=10).at(999 * 4000) != value
