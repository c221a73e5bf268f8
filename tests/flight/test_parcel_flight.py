"""The whole autopilot drops a parcel by PX4's own commands, and flies on."""

import math
from pathlib import Path

import pytest

from sitl_emu.world.description import read
from sitl_emu.world.parcels import AT_REST, RELEASED
from sitl_emu.world.world import World
from tests.flight.pilot import HOME, Pilot

DO_GRIPPER, RELEASE, GRAB, DO_SET_ACTUATOR = 211, 0.0, 1.0, 187


def laden(wind_m_s: float = 0.0) -> Pilot:
    origin = {"lat_deg": HOME.lat_deg, "lon_deg": HOME.lon_deg, "alt_amsl_m": HOME.alt_amsl_m}
    world = World(read({"name": "x", "origin": origin, "wind": {"north_m_s": wind_m_s}}, "x"), Path())
    world.expect_releases()
    pilot = Pilot("responder", world, parcel=True)
    pilot.take_off(15.0)
    pilot.run(8.0)
    return pilot


@pytest.mark.parametrize(
    ("command", "params"), [(DO_GRIPPER, (1.0, RELEASE)), (DO_SET_ACTUATOR, (-1.0,) + (math.nan,) * 5)]
)
def test_it_is_dropped_by_command_and_the_vehicle_stays(command: int, params: tuple[float, ...]) -> None:
    pilot = laden()
    assert pilot.simulation.parcels_told() == [], "neither take-off nor arming opens it"
    before = pilot.truth
    pilot.command(command, *params)
    pilot.run(12.0)
    told = pilot.simulation.parcels_told()
    assert [each.what for each in told] == [RELEASED, AT_REST]
    assert math.dist(told[0][4:6], (before.north_m, before.east_m)) < 0.5
    assert math.dist(told[1][4:6], told[0][4:6]) < 2.5, "in still air it falls straight down, and tumbles a little"
    after = pilot.truth
    assert after.down_m == pytest.approx(before.down_m, abs=0.6)
    assert math.hypot(after.vn_m_s, after.ve_m_s, after.vd_m_s) < 0.3
    assert pilot.topics.hover_thrust_estimate.hover_thrust == pytest.approx(4.3 / 6.3 * 0.396, abs=0.03)


def test_grabbing_again_drops_nothing() -> None:
    pilot = laden()
    pilot.command(DO_GRIPPER, 1.0, GRAB)
    pilot.run(2.0)
    assert pilot.simulation.parcels_told() == []
