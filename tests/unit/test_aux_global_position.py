"""Auxiliary global positions: the filter flies by places that are no GNSS fixes, as EKF2_AGPn_* say."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.topics import AuxGlobalPosition
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import ONBOARD, Peer, only

from .estimator_feed import ALT_M, Feed
from .test_estimator import circle

EVERY_TICKS = 25
"""10 Hz."""
ALONE = {"EKF2_GPS_CTRL": 0, "EKF2_AGP0_ID": 7, "EKF2_AGP0_CTRL": 1}


class Placed(Feed):
    """A feed beside which a source with an id of its own tells where the vehicle is."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(circle, **parameters)
        self.number, self.told, self.resets, self.offset_m = 7, True, 0, 0.0

    def step(self) -> None:
        super().step()
        if self.told and self.ticks % EVERY_TICKS == 0:
            (x, y, _), _, _ = self.path(self.time_s)
            lat, lon = self.projection.reproject(x + self.offset_m, y)
            now_us = self.ticks * 4000
            place = AuxGlobalPosition(now_us, now_us, self.number, lat, lon, ALT_M, 0.5, 1.0, self.resets)
            self.topics.aux_global_position = (place,)

    def error_m(self) -> float:
        (x, y, _), _, _ = self.path(self.time_s)
        here = self.topics.vehicle_global_position
        north, east = self.projection.project(here.lat, here.lon)
        return math.hypot(north - x - self.offset_m, east - y)

    def flags(self) -> tuple[bool, bool]:
        """Wanted and in use, of the first slot."""
        told = self.topics.estimator_fusion_control
        return told.agp_intended[0], told.agp_active[0]


def test_without_gps_it_knows_its_place_on_earth() -> None:
    feed = Placed(**ALONE)
    feed.run(30.0)
    local = feed.topics.vehicle_local_position
    assert local.xy_valid and local.v_xy_valid and feed.topics.vehicle_global_position.valid
    assert feed.error_m() < 1.0
    assert feed.flags() == (True, True) and feed.topics.estimator_status_flags.cs_aux_gpos


@pytest.mark.parametrize(
    "changes", [{"EKF2_AGP0_CTRL": 0}, {"EKF2_AGP0_ID": 0}, {"EKF2_AGP0_ID": 8}, {"EKF2_SENS_EN": 0}]
)
def test_what_is_not_wanted_is_not_fused(changes: dict[str, Any]) -> None:
    feed = Placed(**ALONE | changes)
    feed.run(10.0)
    assert not feed.topics.vehicle_local_position.xy_valid and not feed.flags()[1]


def test_an_unknown_source_takes_a_free_slot_for_the_next_start() -> None:
    feed = Placed(**ALONE)
    feed.number = 9
    feed.run(5.0)
    assert (feed.parameters["EKF2_AGP0_ID"], feed.parameters["EKF2_AGP1_ID"]) == (7, 9)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_when_it_falls_silent_so_does_the_position() -> None:
    feed = Placed(**ALONE)
    feed.run(15.0)
    feed.told = False
    feed.run(8.0)
    assert feed.flags() == (True, False)
    assert not feed.topics.vehicle_local_position.xy_valid


def test_a_jump_is_refused_for_seven_seconds_unless_it_is_told() -> None:
    feed = Placed(**ALONE)
    feed.run(15.0)
    feed.offset_m = 40.0
    feed.run(2.0)
    assert feed.error_m() > 35.0
    feed.resets = 1
    feed.run(0.5)
    assert feed.error_m() < 1.5
    feed.offset_m = 0.0
    feed.run(9.0)
    assert feed.error_m() < 1.5


def test_beside_gps_one_that_disagrees_is_given_up() -> None:
    feed = Placed(**ALONE | {"EKF2_GPS_CTRL": 7})
    feed.run(15.0)
    assert feed.flags() == (True, True)
    feed.offset_m = 40.0
    feed.run(9.0)
    assert not feed.flags()[1]
    assert feed.error_m() == pytest.approx(40.0, abs=1.5)


def test_a_source_keeps_the_slot_of_its_first_id() -> None:
    """AuxGlobalPosition::update maps each instance once."""
    feed = Placed(**ALONE)
    feed.run(10.0)
    feed.number = 9
    feed.run(10.0)
    assert feed.flags() == (True, True)
    assert feed.estimator.ekf.settings["EKF2_AGP1_ID"] == 0


def told_by(number: int, lat: int = 473977420) -> Any:
    return mavlink.MAVLink_global_position_sensor_message(
        1, 1, number, 0, 0, mavlink.GLOBAL_POSITION_SRC_VISION, 0, lat, 85455940, 490.0, 489.0, 0.5, 1.5
    )


def test_sources_speak_mavlink_and_are_told_again() -> None:
    """handle_message_global_position_sensor, streams/GLOBAL_POSITION_SENSOR.hpp: both altitudes are above the sea."""
    peer = Peer()
    peer.run(0.1)
    peer.send(told_by(7))
    peer.send(told_by(9), ONBOARD)
    peer.send(told_by(8, 910000000))
    nowhere = peer.topics.aux_global_position[0]
    assert nowhere.id == 8 and nowhere.lat == pytest.approx(91.0)
    peer.send(told_by(7, 473977430))
    first, second = peer.topics.aux_global_position
    assert (first.id, first.timestamp, first.alt) == (7, peer.now_us, 489.0)
    assert first.lat == pytest.approx(47.397743, abs=1e-9)
    assert (second.id, second.eph, second.epv) == (9, 0.5, 1.5)
    told = only(peer.run(0.5), "GLOBAL_POSITION_SENSOR")
    assert [(each.id, each.alt, each.alt_ellipsoid, each.eph) for each in told] == [
        (7, 489.0, 489.0, 0.5),
        (9, 489.0, 489.0, 0.5),
    ]
    assert {each.source for each in told} == {mavlink.GLOBAL_POSITION_SRC_VISION}
