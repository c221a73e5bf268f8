"""One launched quadrotor serves the MAVSDK tests of a file; each finds it on the ground, disarmed, in Hold."""

from collections.abc import Iterator

import pytest

from tests.interop.mavsdk_vehicle import Vehicle, connected

INSTANCE = 4


@pytest.fixture(scope="module")
def iris() -> Iterator[Vehicle]:
    """The one vehicle."""
    with connected("iris", INSTANCE) as vehicle:
        vehicle.until_ready()
        yield vehicle


@pytest.fixture
def vehicle(iris: Vehicle) -> Iterator[Vehicle]:
    """The vehicle, put back on the ground afterwards."""
    yield iris
    iris.put_down()
