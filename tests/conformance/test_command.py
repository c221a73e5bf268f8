"""Command protocol: targets, unknown commands."""

from typing import Any

import pytest

PAGE = "https://mavlink.io/en/services/command.html"
RUN_PREARM_CHECKS = 401

pytestmark = pytest.mark.covers("COMMAND_LONG", "COMMAND_ACK", source=PAGE)


@pytest.mark.covers("MAV_CMD_RUN_PREARM_CHECKS", source="measured: answered to component 1 and to all, to no other")
@pytest.mark.parametrize(
    ("offset", "component", "answered"), [(0, 1, True), (0, 0, True), (0, 100, False), (9, 1, False)]
)
def test_targets(station: Any, offset: int, component: int, answered: bool) -> None:
    station.mav.command_long_send(station.system + offset, component, RUN_PREARM_CHECKS, 0, *(0.0,) * 7)
    ack = station.receive("COMMAND_ACK", 3.0 if answered else 0.7)
    assert (ack is not None) == answered
    if answered:
        assert (ack.command, ack.result, ack.target_system, ack.target_component) == (401, 0, 255, 190)


def test_unknown_command(station: Any) -> None:
    assert station.command(31000) == 3
