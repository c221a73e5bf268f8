"""MAVSDK geofence: polygons and circles go up, come down as they were, and are cleared."""

from collections.abc import Iterator

import pytest
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, Point, Polygon

from tests.interop.mavsdk_vehicle import Vehicle

CORNERS = ((47.39, 8.53), (47.39, 8.56), (47.41, 8.56), (47.41, 8.53))
PLACE_TOLERANCE_DEG = 1e-7


@pytest.fixture
def geofence(vehicle: Vehicle) -> Iterator[Geofence]:
    fence = Geofence(vehicle.system)
    yield fence
    fence.clear_geofence()


def test_a_fence_comes_down_as_it_went_up(geofence: Geofence) -> None:
    inside = Polygon([Point(*corner) for corner in CORNERS], FenceType.INCLUSION)
    tree = Circle(Point(47.405, 8.555), 20.0, FenceType.EXCLUSION)
    geofence.upload_geofence(GeofenceData([inside], [tree]))
    down = geofence.download_geofence()
    assert [(one.fence_type, len(one.points)) for one in down.polygons] == [(FenceType.INCLUSION, 4)]
    for point, (lat_deg, lon_deg) in zip(down.polygons[0].points, CORNERS, strict=True):
        assert (point.latitude_deg, point.longitude_deg) == pytest.approx((lat_deg, lon_deg), abs=PLACE_TOLERANCE_DEG)
    (circle,) = down.circles
    assert (circle.fence_type, circle.radius) == (FenceType.EXCLUSION, 20.0)


def test_a_cleared_fence_is_empty(geofence: Geofence) -> None:
    geofence.upload_geofence(GeofenceData([], [Circle(Point(*CORNERS[0]), 5000.0, FenceType.INCLUSION)]))
    geofence.clear_geofence()
    down = geofence.download_geofence()
    assert (down.polygons, down.circles) == ([], [])
