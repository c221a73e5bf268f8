"""MAVSDK info: what the vehicle is, how long it has flown, and how fast its time runs."""

import math
from typing import Any

from mavsdk.plugins.info import Info, InfoError

from tests.interop.mavsdk_vehicle import SPEED, Vehicle, until


def test_it_is_px4_1_18_with_an_id_of_its_own(vehicle: Vehicle) -> None:
    info = Info(vehicle.system)
    version = info.get_version()
    assert (version.flight_sw_major, version.flight_sw_minor, version.flight_sw_patch) == (1, 18, 0)
    assert version.flight_sw_version_type == version.FlightSoftwareVersionType.RELEASE
    assert len(info.get_identification().hardware_uid) == 36
    assert info.get_identification().legacy_uid != 0
    assert info.get_product().vendor_id == 0


def test_the_speed_factor_is_that_of_launch(vehicle: Vehicle) -> None:
    """MAVSDK's means a few arrivals: of a vehicle that catches up on a busy machine it reads more for a moment."""
    info = Info(vehicle.system)

    def is_that_of_launch(_: Any) -> bool:
        try:
            return math.isclose(info.get_speed_factor(), float(SPEED), rel_tol=0.2)
        except InfoError:  # not received yet
            return False

    until(vehicle.telemetry, "odometry", is_that_of_launch)


def test_flight_information_comes_by_itself(vehicle: Vehicle) -> None:
    assert until(Info(vehicle.system), "flight_information").time_boot_ms > 0
