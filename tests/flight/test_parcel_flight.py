"""The whole autopilot drops a parcel by PX4's own commands, and flies on."""

import math
from pathlib import Path

import pytest

from sitl_emu import vehicles
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.missions.companion.release_point import Parcel, Wind, release_point
from sitl_emu.world.description import read
from sitl_emu.world.parcels import AT_REST, RELEASED
from sitl_emu.world.world import World
from tests.flight.pilot import HOME, Pilot
from tests.typed import present

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


def test_let_go_where_it_is_worked_out_it_rests_near_the_place() -> None:
    """Flying past at 4 m/s in a wind of 7 m/s from behind, both as the truth has them."""
    pilot, data = laden(wind_m_s=7.0), present(vehicles.load("responder").release).parcel
    start, place_m = pilot.truth, (pilot.truth.north_m + 60.0, pilot.truth.east_m)
    pilot.autopilot.parameters.set("MPC_XY_CRUISE", 4.0)
    lat, lon = MapProjection(HOME.lat_deg, HOME.lon_deg).reproject(start.north_m + 110.0, start.east_m)
    home_amsl_m = HOME.alt_amsl_m
    pilot.send(
        mavlink.MAVLink_command_int_message(
            1, 1, 0, 192, 0, 0, -1, 1, 0, math.nan, round(lat * 1e7), round(lon * 1e7), home_amsl_m - start.down_m
        )
    )
    parcel = Parcel(data.mass_kg, data.drag_m2, 0.5 * data.size_m[2])

    def is_there() -> bool:
        now = pilot.truth
        velocity, up_m = (now.vn_m_s, now.ve_m_s, now.vd_m_s), -now.down_m - data.centre_m[2]
        wind = Wind(7.0, 0.0, up_m, exponent=0.0)
        return now.north_m >= release_point(place_m, parcel, up_m, velocity, wind)[0]

    pilot.until(is_there, 60.0)
    assert pilot.truth.vn_m_s > 3.0, "it is under way"
    pilot.command(DO_GRIPPER, 1.0, RELEASE)
    pilot.run(8.0)
    told = pilot.simulation.parcels_told()
    assert [each.what for each in told] == [RELEASED, AT_REST]
    assert told[0].north_m < place_m[0] - 5.0, "before the place"
    assert math.dist(told[1][4:6], place_m) < 4.0, "and it rests near it"


def test_grabbing_again_drops_nothing() -> None:
    pilot = laden()
    pilot.command(DO_GRIPPER, 1.0, GRAB)
    pilot.run(2.0)
    assert pilot.simulation.parcels_told() == []
