"""What tests of the mission protocol leave: no plan, and no transfer under way."""

from collections.abc import Iterator
from typing import Any

import pytest

from .plans import ACCEPTED, ALL, CANCELLED, FENCE, MISSION, RALLY, clear, end, settled_count

NAVIGATOR_S, CLEARINGS = 1.0, 3


@pytest.fixture(scope="module", autouse=True)
def none_left(station: Any) -> Iterator[None]:
    """PX4's navigator tells a mission anew whose current item it sets (MissionBase::setMissionIndex): one that was
    cleared right behind its upload is then there again, and is cleared again."""
    yield
    for _ in range(CLEARINGS):
        station.collect("MISSION_CURRENT", NAVIGATOR_S, at_least=1)
        if settled_count(station, 0) == 0:
            break
        end(station, ACCEPTED)
        clear(station, ALL)
    end(station, ACCEPTED)


@pytest.fixture(autouse=True)
def empty(station: Any) -> Iterator[None]:
    """Every test begins and ends without a transfer and without a plan."""
    yield
    for kind in (MISSION, FENCE, RALLY):
        end(station, CANCELLED, kind)
    clear(station, ALL)
