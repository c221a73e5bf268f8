"""Arming with somebody's leave (COM_ARM_AUTH_*)."""

from typing import Any

import pytest

from sitl_emu.autopilot.commander.commander import Commander
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import FakeVehicle, item

ARM_DISARM, REQUEST = 400, 3001
ACCEPTED, TEMPORARILY_REJECTED, DENIED, IN_PROGRESS = 0, 1, 2, 5
AUTHORIZER = 77
REFUSAL = "Arming denied: Resolve system health failures first"


class Asker(FakeVehicle):
    """A vehicle that has to ask, and what it gave to others."""

    def __init__(self, method: int = 0) -> None:
        super().__init__(COM_ARM_AUTH_REQ=1, COM_ARM_AUTH_ID=AUTHORIZER, COM_ARM_AUTH_MET=method, MAV_SYS_ID=1)
        self.outgoing = OutgoingCommands()
        self.commander = Commander(
            self.topics, self.parameters, self.dataman, self._say, lambda *event: None, None, self.outgoing
        )
        self.run(3.0)
        self.take_texts()

    def answer(self, result: int, reason: int = 0, number: int = 0, to: int = 1) -> None:
        """The authorizer's COMMAND_ACK."""
        ack: Any = mavlink.MAVLink_command_ack_message(REQUEST, result, reason, number, to, 1)
        self.outgoing.on_answer[REQUEST](self.now_us, ack)
        self.step()

    def later(self) -> list[int]:
        """Later answers to the arming command."""
        results = [ack.result for ack in self.topics.vehicle_command_acks]
        self.topics.vehicle_command_acks = ()
        return results


def test_the_arming_command_is_answered_when_leave_is_given() -> None:
    vehicle = Asker()
    assert vehicle.command(ARM_DISARM, 1) is None
    (request,) = vehicle.outgoing.waiting
    assert (request.command, request.target_system, request.target_component) == (REQUEST, AUTHORIZER, 0)
    vehicle.answer(IN_PROGRESS)
    vehicle.answer(ACCEPTED, number=60, to=2)
    assert not now(vehicle.armed) and vehicle.later() == []
    vehicle.answer(ACCEPTED, number=60)
    assert vehicle.armed
    assert vehicle.later() == [ACCEPTED]
    assert vehicle.take_texts() == ["Arm auth: Authorized for the next 60 seconds", "Armed by external command"]


def test_leave_holds_for_its_time() -> None:
    vehicle = Asker()
    vehicle.command(ARM_DISARM, 1)
    vehicle.answer(ACCEPTED, number=5)
    vehicle.result(ARM_DISARM, 0)
    vehicle.run(1.0)
    assert vehicle.arm() == ACCEPTED
    vehicle.result(ARM_DISARM, 0)
    vehicle.run(5.0)
    assert vehicle.command(ARM_DISARM, 1) is None
    assert len(vehicle.outgoing.waiting) == 2


def test_who_asks_does_so_whatever_else_is_wrong() -> None:
    """PX4's systemCheck is one of the checks; a throttle that is not safe is denied before."""
    vehicle = Asker()
    vehicle.battery = vehicle.battery._replace(warning=2)
    vehicle.run(0.2)
    vehicle.take_texts()
    assert vehicle.command(ARM_DISARM, 1) is None
    vehicle.answer(ACCEPTED, number=60)
    assert vehicle.later() == [TEMPORARILY_REJECTED]
    assert vehicle.take_texts() == ["Arm auth: Authorized for the next 60 seconds", REFUSAL]


def test_a_pilot_and_a_mission_wait_for_leave_too() -> None:
    vehicle = Asker()
    vehicle.commander._arming.arm(vehicle.now_us, by="stick gesture")
    vehicle.answer(ACCEPTED, number=60)
    assert vehicle.armed and vehicle.later() == []
    assert vehicle.take_texts()[1:] == ["Armed by stick gesture"]
    vehicle = Asker()
    vehicle.upload(item(22, 0, 0, 10), item(16, 20, 0, 10))
    vehicle.run(3.0)
    vehicle.take_texts()
    assert vehicle.command(mavlink.MAV_CMD_MISSION_START) is None
    vehicle.run(2.5)
    assert vehicle.later() == [TEMPORARILY_REJECTED]
    assert vehicle.take_texts()[-2:] == [REFUSAL, "Switching to Mission is currently not available"]


@pytest.mark.parametrize(
    ("result", "reason", "said"),
    [
        (TEMPORARILY_REJECTED, 0, ["Arm auth: Temporarily rejected"]),
        (DENIED, 0, ["Arm auth: Denied"]),
        (DENIED, 1, []),
        (DENIED, 2, ["Arm auth: Denied, waypoint 4 have a invalid value"]),
        (DENIED, 5, ["Arm auth: Denied because of bad weather"]),
    ],
)
def test_no_leave(result: int, reason: int, said: list[str]) -> None:
    vehicle = Asker()
    vehicle.command(ARM_DISARM, 1)
    vehicle.answer(result, reason, number=4)
    assert not vehicle.armed
    assert vehicle.later() == [TEMPORARILY_REJECTED]
    assert vehicle.take_texts() == [*said, REFUSAL]


def test_nobody_answers() -> None:
    vehicle = Asker()
    vehicle.command(ARM_DISARM, 1)
    vehicle.run(1.2)
    assert vehicle.later() == [TEMPORARILY_REJECTED]
    assert vehicle.take_texts() == ["Arm auth: No response", REFUSAL]


def test_a_refusal_that_is_reported_has_the_authorizer_asked_again() -> None:
    """PX4's HealthAndArmingChecks::update runs the checks again for their texts, and that one asks; once each 2 s."""
    vehicle = Asker()
    vehicle.run(3.0)
    vehicle.take_texts()
    events: list[str] = []
    vehicle.commander._checks._send_event = lambda event, *_: events.append(event)
    vehicle.command(ARM_DISARM, 1)
    vehicle.run(1.2)
    assert vehicle.later() == [] and len(vehicle.outgoing.waiting) == 2
    assert "check_system_arm_auth_failed" in events
    vehicle.run(1.2)
    assert vehicle.later() == [TEMPORARILY_REJECTED] and len(vehicle.outgoing.waiting) == 2
    assert vehicle.take_texts() == ["Arm auth: No response", "Arm auth: No response", REFUSAL]


def test_by_two_requests_the_first_is_rejected() -> None:
    vehicle = Asker(method=1)
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Arm auth: Requesting authorization...", REFUSAL]
    vehicle.answer(ACCEPTED, number=10)
    assert not vehicle.armed and vehicle.later() == []
    assert vehicle.arm() == ACCEPTED
