"""MAVSDK events: every event is understood, and why a vehicle cannot arm is told, then taken back."""

import queue
from typing import Any

import pytest
from mavsdk.exceptions import MavsdkError
from mavsdk.plugins.events import Events, LogLevel
from mavsdk.plugins.failure import Failure, FailureType, FailureUnit

from tests.interop.mavsdk_vehicle import STEP_LIMIT_S, Vehicle, until


def until_event(heard: queue.Queue[Any], name: str) -> Any:
    """The next event of a name; raises queue.Empty when it does not come in time."""
    while (event := heard.get(timeout=STEP_LIMIT_S)).event_name != name:
        pass
    return event


def test_arming_and_disarming_are_told(vehicle: Vehicle) -> None:
    vehicle.until_ready()
    events = Events(vehicle.system)
    until(events, "health_and_arming_checks")  # MAVSDK has read what the events mean
    heard: queue.Queue[Any] = queue.Queue()
    handle = events.subscribe_events(lambda event, _user_data: heard.put(event))
    vehicle.action.arm()
    armed = until_event(heard, "commander_armed_by")
    vehicle.action.disarm()
    disarmed = until_event(heard, "commander_disarmed_by")
    events.unsubscribe_events(handle)
    assert (armed.event_namespace, armed.log_level) == ("px4", LogLevel.INFO)
    assert armed.message.startswith("Armed by ")
    assert disarmed.message.startswith("Disarmed by ")


def test_without_a_position_it_is_told_why_it_cannot_arm(vehicle: Vehicle) -> None:
    vehicle.until_ready()
    events, failure = Events(vehicle.system), Failure(vehicle.system)
    until(events, "health_and_arming_checks", lambda report: report.current_mode_intention.can_arm_or_run)
    failure.inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    try:
        report = until(
            events, "health_and_arming_checks", lambda report: not report.current_mode_intention.can_arm_or_run
        )
        unhealthy = {problem.health_component for problem in report.current_mode_intention.problems}
        assert "global_position_estimate" in unhealthy
        assert "gps" not in unhealthy  # PX4 finds no fault with a GPS that is silent (estimatorCheck.cpp)
        with pytest.raises(MavsdkError):
            vehicle.action.arm()
    finally:
        failure.inject(FailureUnit.SENSOR_GPS, FailureType.OK, 0)
    until(events, "health_and_arming_checks", lambda report: report.current_mode_intention.can_arm_or_run)
