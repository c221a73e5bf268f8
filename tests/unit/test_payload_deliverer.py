"""The gripper, as who commands it sees it: an answer at once, and one when it is done. A mission waits for it."""

import pytest

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.payload.payload_deliverer import PayloadDeliverer
from sitl_emu.autopilot.topics import Topics, VehicleCommand, VehicleCommandAck
from sitl_emu.autopilot.vehicle_kind import VehicleKind

from .navigation_fake import STEP_US, FakeVehicle, item

TAKEOFF, WAYPOINT, LAND, DO_SET_ACTUATOR, MAV_FRAME_MISSION = 22, 16, 21, 187, 2
DO_GRIPPER, RELEASE, GRAB = 211, 0.0, 1.0
ACCEPTED, TEMPORARILY_REJECTED, DENIED, FAILED, IN_PROGRESS = (0, 0, 0), (1, 0, 0), (2, 0, 0), (4, 0, 0), (5, 255, 0)
CANCELLED = 6


class Gripper:
    """A gripper and its clock."""

    def __init__(self, **parameters: float) -> None:
        self.topics, self.outgoing = Topics(), OutgoingCommands()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, parameters)
        self.deliverer = PayloadDeliverer(self.topics, self.parameters, self.outgoing)
        self.now_us = 0

    def command(self, action: float) -> tuple[int, ...]:
        """The first answer; none where it comes with others."""
        return tuple(self.deliverer.handle_command(self.now_us, VehicleCommand(DO_GRIPPER, 0.0, action)) or ())

    def run(self, seconds: float) -> list[tuple[int, ...]]:
        """Later answers within a time."""
        self.topics.vehicle_command_acks = tuple[VehicleCommandAck, ...]()
        for _ in range(round(seconds * 50)):
            self.now_us += 20_000
            self.deliverer.update(self.now_us)
        return [(ack.result, ack.progress, ack.result_param2) for ack in self.topics.vehicle_command_acks]


def test_it_closes_at_the_start_and_opens_on_command() -> None:
    gripper = Gripper()
    assert gripper.deliverer.state == "GRABBING"
    assert gripper.run(1.1) == [IN_PROGRESS, ACCEPTED]
    assert gripper.deliverer.state == "GRABBED"
    assert gripper.command(GRAB) == ACCEPTED
    assert gripper.command(RELEASE) == IN_PROGRESS
    assert gripper.run(0.5) == []
    assert gripper.command(RELEASE) == TEMPORARILY_REJECTED
    assert gripper.run(0.6) == [ACCEPTED]
    assert gripper.command(RELEASE) == ACCEPTED
    assert gripper.run(2.0) == []


def test_what_it_commands_itself_names_nobody() -> None:
    """send_gripper_vehicle_command: so it goes out on every link, and its answers to whoever was heard."""
    gripper = Gripper()
    gripper.run(1.1)
    (told,) = gripper.outgoing.waiting
    assert told[:3] == (DO_GRIPPER, 0.0, GRAB)
    assert (told.target_system, told.target_component, told.from_external) == (0, 0, False)
    acks = gripper.topics.vehicle_command_acks
    assert [(ack.command.source_system, ack.command.source_component) for ack in acks] == [(0, 0)] * 2


def test_who_asked_for_what_is_cancelled_hears_it_first() -> None:
    """PayloadDeliverer::handle_vehicle_command: CANCELLED to the first, then IN_PROGRESS to the other."""
    gripper = Gripper(PD_GRIPPER_TO=3.0)
    gripper.run(3.1)
    assert gripper.command(RELEASE) == IN_PROGRESS
    gripper.run(1.0)
    other = VehicleCommand(DO_GRIPPER, 0.0, GRAB, source_system=9)
    gripper.topics.vehicle_command_acks = tuple[VehicleCommandAck, ...]()
    assert gripper.deliverer.handle_command(gripper.now_us, other) is None
    acks = [(ack.command.source_system, ack.result) for ack in gripper.topics.vehicle_command_acks]
    assert acks == [(0, CANCELLED), (9, IN_PROGRESS[0])]
    assert gripper.run(2.9) == []
    assert gripper.run(0.2) == [ACCEPTED]


def test_what_is_no_action_cancels_too_but_ends_nothing() -> None:
    gripper = Gripper()
    gripper.run(1.1)
    assert gripper.command(RELEASE) == IN_PROGRESS
    gripper.topics.vehicle_command_acks = tuple[VehicleCommandAck, ...]()
    assert gripper.command(7.0) == ()
    assert [ack.result for ack in gripper.topics.vehicle_command_acks] == [CANCELLED, DENIED[0]]
    assert gripper.run(1.1) == [ACCEPTED] and gripper.deliverer.state == "RELEASED"


def test_what_it_cannot_do() -> None:
    gripper = Gripper()
    gripper.run(1.1)
    assert gripper.command(2.0) == gripper.command(float("nan")) == DENIED
    assert Gripper(PD_GRIPPER_TYPE=-1).command(RELEASE) == FAILED


def test_its_parameters_count_once() -> None:
    """PayloadDeliverer::configure_gripper: a gripper that is there is not set up anew, and never taken away."""
    gripper = Gripper(PD_GRIPPER_TYPE=-1, PD_GRIPPER_TO=2.0)
    assert gripper.run(5.0) == []
    gripper.parameters.set("PD_GRIPPER_TYPE", 0)
    assert gripper.run(2.3) == [IN_PROGRESS, ACCEPTED]
    gripper.parameters.set("PD_GRIPPER_TYPE", -1)
    gripper.parameters.set("PD_GRIPPER_TO", 9.0)
    assert gripper.command(RELEASE) == IN_PROGRESS
    assert gripper.run(1.9) == [] and gripper.run(0.2) == [ACCEPTED]


class Mission(FakeVehicle):
    """A vehicle with a gripper that takes three seconds, on a mission that opens it."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(PD_GRIPPER_TYPE=0, PD_GRIPPER_TO=3.0, **parameters)
        self.deliverer = PayloadDeliverer(self.topics, self.parameters, OutgoingCommands())
        self.waited_s = 0.0
        self.run(4.0)
        self.upload(
            item(TAKEOFF, 0, 0, 20),
            item(DO_GRIPPER, 0, 0, 0, 1, RELEASE),
            item(DO_SET_ACTUATOR, 0, 0, 0, 0.5)._replace(frame=MAV_FRAME_MISSION),
            item(WAYPOINT, 10, 0, 20),
            item(LAND, 100, 0, 0),
        )
        self.run(0.1)
        self.set_mode(4, 4)
        assert self.arm() == 0
        self.run_until_disarmed()

    def step(self) -> None:
        super().step()
        self.deliverer.update(self.now_us)
        if self.topics.mission_result.seq_current == 1:
            self.waited_s += STEP_US * 1e-6


def test_a_mission_gives_the_gripper_its_time() -> None:
    mission = Mission(MIS_COMMAND_TOUT=10.0)
    assert mission.waited_s == pytest.approx(10.0, abs=0.2)
    assert mission.topics.gripper.position == -1.0
    assert mission.topics.actuator_set.values[0] == 0.5
    assert len(mission.topics.vehicle_command_acks) == 2  # of the start's; nobody outside has asked


def test_a_mission_does_not_wait_for_a_slower_gripper() -> None:
    assert Mission(MIS_COMMAND_TOUT=1.0).waited_s == pytest.approx(1.0, abs=0.2)
    assert Mission().waited_s < 0.2
