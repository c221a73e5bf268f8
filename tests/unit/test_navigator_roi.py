"""DO_SET_ROI and its kin: the region of interest that the navigator makes of them."""

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.topics import Topics, VehicleRoi
from tests.unit.vehicle_command import vehicle_command

NAV_ROI, LOCATION, WPNEXT_OFFSET, NONE, SET_ROI = 80, 195, 196, 197, 201


def made_of(number: int, *params: float) -> VehicleRoi:
    topics = Topics()
    Roi(cast(Any, SimpleNamespace(topics=topics))).take(vehicle_command(number, *params))
    return topics.vehicle_roi


def test_a_location_an_offset_and_none() -> None:
    assert made_of(LOCATION, 0, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi(3, 47.4, 8.5, 500.0)
    offset = made_of(WPNEXT_OFFSET, 0, 0, 0, 0, 10.0, 20.0, 30.0)
    assert offset.mode == 1
    angles = (offset.pitch_offset, offset.roll_offset, offset.yaw_offset)
    assert angles == pytest.approx([math.radians(value) for value in (10.0, 20.0, 30.0)])
    assert made_of(NONE, 0, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi()


@pytest.mark.parametrize("number", [NAV_ROI, SET_ROI])
@pytest.mark.parametrize(("value", "mode"), [(0.0, 0), (1.0, 1), (3.0, 3), (4.9, 4), (math.nan, 0), (256.0, 0)])
def test_the_deprecated_commands_choose_a_mode_alone(number: int, value: float, mode: int) -> None:
    assert made_of(number, value, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi(mode, 0.0, 0.0, 0.0)
