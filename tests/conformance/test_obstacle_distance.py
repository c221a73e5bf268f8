"""OBSTACLE_DISTANCE and DISTANCE_SENSOR are taken without an answer; a distance to the ground is told again."""

import time
from typing import Any

import pytest

DOWN = 25
METRES = 3.21


@pytest.mark.covers("OBSTACLE_DISTANCE", source="https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE")
def test_obstacles_are_taken_in_silence(station: Any) -> None:
    station.mav.obstacle_distance_send(0, 0, [500] * 72, 5, 20, 2000, 5.0, 0.0, 12)
    assert station.receive("COMMAND_ACK", 0.5) is None


@pytest.mark.covers("DISTANCE_SENSOR", source="https://mavlink.io/en/messages/common.html#DISTANCE_SENSOR")
def test_a_distance_from_outside_is_a_distance_sensor(station: Any) -> None:
    station.command(511, 132, 100_000)
    try:
        for _ in range(20):
            station.mav.distance_sensor_send(0, 20, 1200, round(METRES * 100), 0, 7, DOWN, 0)
            time.sleep(0.05)
        heard = [message.current_distance for message in station.collect("DISTANCE_SENSOR", 1.0, at_least=10)]
        assert round(METRES * 100) in heard
    finally:
        station.command(511, 132, 0)
