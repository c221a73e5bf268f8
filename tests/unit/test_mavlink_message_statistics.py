"""Rates of what comes in on a link, as `mavlink status` shows them (mavlink_receiver.cpp)."""

import math

import pytest

from sitl_emu.autopilot.mavlink.message_statistics import SLOTS, MessageStatistics
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS
from tests.unit.shell_console import Console

GROUND, CAMERA = (255, 190), (1, 100)


def test_a_rate_is_of_the_times_between_and_the_last_counts_a_tenth() -> None:
    statistics = MessageStatistics()
    statistics.count(1_000_000, GROUND, 0)
    ((_, first_hz, ago_s),) = statistics.shown(1_250_000, GROUND)
    assert math.isnan(first_hz) and ago_s == 0.25
    statistics.count(1_500_000, GROUND, 0)
    statistics.count(1_600_000, GROUND, 0)
    ((_, rate_hz, _),) = statistics.shown(1_600_000, GROUND)
    assert rate_hz == pytest.approx(0.9 * 2.0 + 0.1 * 10.0)
    statistics.count(1_600_000, GROUND, 0)
    ((_, at_once_hz, _),) = statistics.shown(1_600_000, GROUND)
    assert at_once_hz == 0.0


def test_the_last_to_be_heard_first_is_shown_first_of_its_sender_and_of_ten_seconds() -> None:
    statistics = MessageStatistics()
    for message_id in (0, 76):
        statistics.count(1_000_000, GROUND, message_id)
    statistics.count(5_000_000, CAMERA, 259)
    assert [message_id for message_id, _, _ in statistics.shown(5_000_000, GROUND)] == [76, 0]
    assert statistics.shown(11_000_000, GROUND) == []
    assert [message_id for message_id, _, _ in statistics.shown(11_000_000, CAMERA)] == [259]


def test_there_are_so_many_slots() -> None:
    statistics = MessageStatistics()
    for message_id in range(SLOTS + 3):
        statistics.count(1_000_000, GROUND, message_id)
    assert len(statistics.shown(1_000_000, GROUND)) == SLOTS


def test_they_are_kept_once_somebody_has_asked() -> None:
    console = Console()
    autopilot = console.autopilot
    autopilot.now_us = 1_000_000

    def beat() -> None:
        message = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
        autopilot.mavlink.on_datagram(autopilot.now_us, GCS, bytes(message.pack(mavlink.MAVLink(None, *GROUND))))

    beat()
    assert "sysid:255, compid:190, Total: 1 (lost: 0)\n\tFTP" in console.output("mavlink status")
    beat()
    assert "\t    msgid:    0, Rate:  nan Hz, last 0.00s ago\n" in console.output("mavlink status")
