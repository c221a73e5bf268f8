"""Other clocks: what their owners answer to TIMESYNC, and what the times are then that they state."""

from sitl_emu.autopilot.mavlink.services.timesync import TimeOffset
from sitl_emu.core import dialect as mavlink

from .mavlink_peer import GCS, ONBOARD, Peer

AHEAD_US = 5_000_000_000
"""The other side's clock is so far ahead of ours."""
COVARIANCE = [0.0] * 21


def heard(
    answers: int, ahead_us: int = AHEAD_US, round_trip_us: int = 0, offset: TimeOffset | None = None
) -> TimeOffset:
    """After so many answers, a tenth of a second apart."""
    found = TimeOffset() if offset is None else offset
    for number in range(1, answers + 1):
        asked_us = number * 100_000
        found.update(asked_us + round_trip_us, asked_us + round_trip_us // 2 + ahead_us, asked_us)
    return found


def test_a_clock_is_known_after_500_answers() -> None:
    """CONVERGENCE_WINDOW of lib/timesync/Timesync.hpp."""
    assert heard(499).sync_stamp(7, AHEAD_US + 3) == 7
    assert heard(500).sync_stamp(7, AHEAD_US + 3) == 3


def test_half_of_the_way_there_and_back_is_the_way_back_and_a_slow_answer_is_none() -> None:
    """MAX_RTT_SAMPLE: 10 ms."""
    assert heard(500, round_trip_us=9_000).sync_stamp(7, AHEAD_US + 3) == 3
    assert not heard(500, round_trip_us=10_000).converged
    assert not heard(500, round_trip_us=-1).converged, "nobody has asked yet"


def test_a_clock_that_drifts_is_followed() -> None:
    """By 50 ppm: 5 us in each tenth of a second."""
    offset = TimeOffset()
    for number in range(1, 3001):
        now_us = number * 100_000
        offset.update(now_us, now_us + AHEAD_US + 5 * number, now_us)
    assert abs(offset.sync_stamp(0, AHEAD_US + 5 * 3000)) < 500


def test_a_clock_that_jumped_is_unknown_after_eleven_answers() -> None:
    """MAX_DEVIATION_SAMPLE, MAX_CONSECUTIVE_HIGH_DEVIATION."""
    offset = heard(500)
    heard(10, 2 * AHEAD_US, offset=offset)
    assert offset.sync_stamp(7, AHEAD_US + 3) == 3
    heard(1, 2 * AHEAD_US, offset=offset)
    assert not offset.converged
    assert heard(500, 2 * AHEAD_US, offset=offset).sync_stamp(7, 2 * AHEAD_US + 3) == 3


def test_what_is_seen_counts_from_when_it_was_seen_on_a_link_whose_clock_is_known() -> None:
    peer = Peer(system=1, component=191)
    for _ in range(500):
        peer.now_us += 100_000
        peer.send(mavlink.MAVLink_timesync_message((peer.now_us + AHEAD_US) * 1000, peer.now_us * 1000), ONBOARD)
    seen_us = peer.now_us - 40_000
    told_us = seen_us + AHEAD_US
    pose = mavlink.MAVLink_vision_position_estimate_message(told_us, 1.0, 2.0, -3.0, 0.0, 0.0, 0.0, COVARIANCE, 0)
    odometry = mavlink.MAVLink_odometry_message(
        told_us, 1, 12, 1.0, 2.0, -3.0, [1.0, 0.0, 0.0, 0.0], *(0.0,) * 6, COVARIANCE, COVARIANCE, 0, 0, 100
    )
    target = mavlink.MAVLink_landing_target_message(
        told_us, 0, 1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, [1.0, 0.0, 0.0, 0.0], 2, 1
    )
    for link, expected_us in ((ONBOARD, seen_us), (GCS, peer.now_us)):
        for message in (pose, odometry):
            peer.send(message, link)
            assert peer.topics.vehicle_visual_odometry.timestamp == expected_us
        peer.send(target, link)
        assert peer.topics.landing_target_pose.timestamp == expected_us
