"""Which missions are flown at all, and what is told of the others; after PX4's FeasibilityChecker."""

import pytest

from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.storage.dataman import FENCE, MissionItem, Plan
from sitl_emu.core import dialect as mavlink

from .navigation_fake import item
from .navigator_missions import LAND, NO_MISSION, NOT_STARTED, RTL, SPEED, TAKEOFF, WAYPOINT, mission_state, uploaded

VTOL_TAKEOFF, CONDITION_DELAY = 84, 112


@pytest.mark.parametrize(
    ("items", "parameters", "event"),
    [
        ((item(LAND),), {}, "navigator_mis_starts_w_landing"),
        ((item(WAYPOINT, 5, 0, 5), item(TAKEOFF, 0, 0, 5)), {}, "navigator_mis_takeoff_not_first"),
        ((item(TAKEOFF, 0, 0, 0),), {}, "navigator_mis_takeoff_too_low"),
        ((item(VTOL_TAKEOFF, 0, 0, 5),), {}, "navigator_mis_vtol_items"),
        ((item(CONDITION_DELAY), item(LAND)), {}, "navigator_mis_unsup_cmd"),
        ((item(WAYPOINT, 5, 0, 5), item(LAND)), {"MIS_TKO_LAND_REQ": 1}, "navigator_mis_takeoff_missing"),
        ((item(TAKEOFF, 5, 0, 5), item(RTL)), {"MIS_TKO_LAND_REQ": 2}, "navigator_mis_land_missing"),
        ((item(TAKEOFF, 5, 0, 5),), {"MIS_TKO_LAND_REQ": 3}, "navigator_mis_takeoff_or_land_missing"),
        ((item(TAKEOFF, 5, 0, 5),), {"MIS_TKO_LAND_REQ": 4}, "navigator_mis_add_land_or_rm_to"),
        ((item(WAYPOINT, 5, 0, 5), item(LAND)), {"MIS_TKO_LAND_REQ": 5}, "navigator_mis_add_to_or_rm_land"),
    ],
)
def test_missions_that_cannot_be_flown(
    items: tuple[MissionItem, ...], parameters: dict[str, float], event: str
) -> None:
    """PX4 tells it as an event without a text."""
    vehicle = uploaded(*items, rover=False, **parameters)
    assert mission_state(vehicle) == NO_MISSION
    assert layout(event)[0] in {told.id for told in vehicle.events.recent}
    assert vehicle.take_texts() == []
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, 0, 0) == 2


@pytest.mark.parametrize("required", [1, 2, 3, 4, 5])
def test_a_mission_with_takeoff_and_landing_is_what_all_want(required: int) -> None:
    vehicle = uploaded(item(SPEED, 0, 0, 0, 1, 3.0), item(TAKEOFF, 0, 0, 5), item(LAND), MIS_TKO_LAND_REQ=required)
    assert mission_state(vehicle) == NOT_STARTED


def test_a_mission_is_checked_by_the_parameters_of_its_moment() -> None:
    """Navigator::run takes new parameters before anything else, also when an upload wakes it."""
    vehicle = uploaded(item(TAKEOFF, 0, 0, 5))
    vehicle.parameters.set("MIS_TKO_LAND_REQ", 3)
    vehicle.upload(item(TAKEOFF, 0, 0, 6))
    vehicle.navigator.mission_changed(vehicle.now_us)
    assert mission_state(vehicle) == NO_MISSION


def test_a_first_place_far_away_is_told_and_flown() -> None:
    vehicle = uploaded(item(WAYPOINT, 500.5, 0, 5), MIS_DIST_1WP=400)
    assert mission_state(vehicle) == NOT_STARTED
    event = vehicle.events.recent[-1]
    assert (event.id, int.from_bytes(event.arguments, "little")) == (layout("navigator_mis_first_wp_far")[0], 500)


def test_a_mission_has_to_lie_within_the_fence() -> None:
    vehicle = uploaded(item(TAKEOFF, 0, 0, 5), item(SPEED), item(WAYPOINT, 30, 0, 5))
    assert mission_state(vehicle) == NOT_STARTED
    circle = item(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0, 0, 0, 20.0)
    vehicle.dataman.store(FENCE, Plan((circle,), 1), 0)
    vehicle.run(0.1)
    assert vehicle.take_texts() == ["Geofence violation for waypoint 3"]
    assert mission_state(vehicle) == NO_MISSION
    vehicle.dataman.store(FENCE, Plan(), 0)
    vehicle.run(0.1)
    assert mission_state(vehicle) == NOT_STARTED
