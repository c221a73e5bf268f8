"""Commands, message requests and intervals: what is sent, what comes back, as measured on PX4 v1.18."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.mavlink.services.command_sender import CommandSender
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, command_long, names, only
from tests.unit.plan_messages import GLOBAL, HOME_X, HOME_Y

IMAGE_START: int = mavlink.MAV_CMD_IMAGE_START_CAPTURE


def test_a_later_answer_goes_to_whom_gave_the_command_on_its_link() -> None:
    peer = Peer(handle_command=lambda now_us, command: answer_later(peer.topics, command, CommandResult(0)))
    assert peer.send(command_long(211, 0, 1), ONBOARD) == []
    peer.run(0.01)
    peer.send(command_long(211, 0, 1), ONBOARD)
    acks = only(peer.run(0.01, ONBOARD), "COMMAND_ACK")
    assert [(ack.command, ack.result, ack.target_system, ack.target_component) for ack in acks] == [(211, 0, 255, 190)]
    assert only(peer.run(0.05, ONBOARD) + peer.received(GCS), "COMMAND_ACK") == []


def test_a_requested_message_knows_what_was_commanded_a_moment_ago() -> None:
    peer = Peer()
    peer.run(1.0)
    request = command_long(mavlink.MAV_CMD_REQUEST_MESSAGE, 0)
    assert only(peer.send(request), "HEARTBEAT")[0].base_mode & 128 == 0
    peer.topics.vehicle_status = peer.topics.vehicle_status._replace(armed=True)
    assert only(peer.send(request), "HEARTBEAT")[0].base_mode & 128


@pytest.mark.parametrize(
    ("target", "answered"),
    [
        ((1, 1), True),
        ((1, 0), True),
        ((0, 0), True),
        ((0, 1), True),
        ((0, 190), False),
        ((2, 1), False),
        ((1, 100), False),
    ],
)
def test_command_targets(target: tuple[int, int], answered: bool) -> None:
    acks = only(Peer().send(command_long(400, 1.0, target=target)), "COMMAND_ACK")
    assert [(ack.command, ack.result, ack.target_system, ack.target_component) for ack in acks] == (
        [(400, 0, 255, 190)] if answered else []
    )


def test_commands_reach_their_owner_in_degrees() -> None:
    seen: list[VehicleCommand] = []

    def handle(now_us: int, command: VehicleCommand) -> CommandResult | None:
        seen.append(command)
        return None

    peer = Peer(handle)
    nan = float("nan")
    message = mavlink.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, -1, 1, 0, nan, HOME_X, HOME_Y, 20.0)
    assert peer.send(message) == []
    assert (seen[0].command, seen[0].frame) == (192, 3)
    assert seen[0].param5 == pytest.approx(47.3977418)
    assert (seen[0].param7, seen[0].source_system) == (20.0, 255)


def command_int(command: int, *params: float, x: int = 0, y: int = 0, z: float = 0.0, frame: int = GLOBAL) -> Any:
    """A COMMAND_INT with the rest of its parameters 0."""
    fields: list[Any] = [1, 1, frame, command, 0, 0, *params, *(0.0,) * (4 - len(params)), x, y, z]
    return mavlink.MAVLink_command_int_message(*fields)


@pytest.mark.parametrize(
    ("sent", "place"),
    [
        (command_int(192, x=473977418, y=-85455939), (47.3977418, -8.5455939)),
        (command_int(192, x=473977418, y=-85455939, frame=6), (47.3977418, -8.5455939)),
        (command_int(192, x=123456, y=-20000, frame=1), (12.3456, -2.0)),
        (command_int(192, x=123456, y=-20000, frame=2), (0.0123456, -0.002)),
        (command_int(187, x=5000000, y=-10000000), (0.5, -1.0)),
        (command_int(310, x=101, y=-2), (101.0, -2.0)),
        (command_int(241, x=1), (1.0, 0.0)),
        (command_int(192, x=0x7FFFFFFF, y=0), (214.7483647, 0.0)),
        (command_long(310, 0.0, 0.0, 0.0, 0.0, 101.0, 0.25), (101.0, 0.25)),
    ],
)
def test_only_a_place_is_scaled(sent: Any, place: tuple[float, float]) -> None:
    seen: list[VehicleCommand] = []
    Peer(lambda now_us, command: seen.append(command)).send(sent)
    assert (seen[0].param5, seen[0].param6) == pytest.approx(place)


def test_a_place_is_left_out_by_both_of_its_numbers() -> None:
    seen: list[VehicleCommand] = []
    Peer(lambda now_us, command: seen.append(command)).send(command_int(310, x=0x7FFFFFFF, y=0x7FFFFFFF))
    assert math.isnan(seen[0].param5)
    assert math.isnan(seen[0].param6)


@pytest.mark.parametrize(
    ("sent", "rover", "denied"),
    [
        (command_long(20, 1.0), False, True),
        (command_long(20, math.nan, 0.0, -0.0), False, False),
        (command_long(20, math.inf), False, True),
        (command_long(21, 10.0, 2.0, 0.0, 90.0, 47.0, 8.0, 500.0), False, False),
        (command_long(21, 0.0, 0.0, 1.0), False, True),
        (command_long(22, -1.0, 0.0, 0.0, math.nan, math.nan, math.nan, 500.0), False, False),
        (command_long(22, -1.0, 0.0, 0.0, math.nan, math.nan, math.nan, 500.0), True, True),
        (command_long(22, 0.0, 1.0), False, True),
        (command_long(84, 0.0, 0.0, 1.0), False, False),
        (command_long(84, 0.0, 1.0), False, True),
        (command_long(195, 1.0, 0.0, 0.0, 0.0, 47.0, 8.0, 500.0), False, False),
        (command_long(400, 1.0, 21196.0, 1.0), False, True),
        (command_long(16, 0.0, 0.0, 5.0), False, True),
        (command_long(31000, *(1.0,) * 7), False, False),
        (command_int(611, x=473977418, y=85455939, z=488.0), False, False),
        (command_int(611, 1.0, x=473977418, y=85455939, z=488.0), False, True),
        (command_int(20, x=1), False, True),
        (command_int(20, x=0x7FFFFFFF, y=0x7FFFFFFF), False, False),
        (command_int(192, x=0x7FF80000, y=0x7FF80000), False, True),
        (command_long(192, 0.0, 0.0, 0.0, 0.0, 2147483648.0, 2147483648.0), False, True),
        (command_long(192, 0.0, 0.0, 0.0, 0.0, 2147483648.0, 0.0), False, False),
    ],
)
def test_what_a_command_has_no_use_for_is_denied(sent: Any, rover: bool, denied: bool) -> None:
    """DENIED is 2; what gets through is answered 0 here."""
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN if rover else VehicleKind.MULTICOPTER)
    assert [ack.result for ack in only(peer.send(sent), "COMMAND_ACK")] == [2 if denied else 0]


def test_a_mistaken_place_is_denied_whoever_it_was_meant_for() -> None:
    message = mavlink.MAVLink_command_int_message(7, 9, 0, 192, 0, 0, *(0.0,) * 4, 0x7FF80000, 0x7FF80000, 0.0)
    assert [ack.result for ack in only(Peer().send(message), "COMMAND_ACK")] == [2]


def test_set_mode_is_acked_as_a_command() -> None:
    seen: list[VehicleCommand] = []

    def handle(now_us: int, command: VehicleCommand) -> CommandResult:
        seen.append(command)
        return CommandResult(0)

    peer = Peer(handle)
    replies = peer.send(mavlink.MAVLink_set_mode_message(1, 29, 4 << 16 | 4 << 24))
    assert (replies[0].command, replies[0].result) == (176, 0)
    assert seen[0][1:8] == (29.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0)
    (told,) = peer.topics.commands_told
    assert (told.command, told.result) == (seen[0], CommandResult(0)), "the log has the answer, too"


def test_message_intervals() -> None:
    peer = Peer()
    peer.fly_and_run(0.2)

    def interval() -> int:
        return int(only(peer.send(command_long(510, 30)), "MESSAGE_INTERVAL")[0].interval_us)

    def rate() -> float:
        return len(only(peer.fly_and_run(2.0), "ATTITUDE")) / 2.0

    assert interval() == 20_000
    for wanted_us, reported_us, hz in (
        (100_000, 100_000, 10),
        (-1, -1, 0),
        (0, 66_666, 15),
        (1, 1, 0),
        (20_000, 20_000, 50),
    ):
        assert peer.send(command_long(511, 30, wanted_us))[0].result == 0
        assert interval() == reported_us
        assert rate() == pytest.approx(hz, abs=0.6)
    for refused in (0, 22, 27, 77, 9999):
        assert peer.send(command_long(511, refused, 100_000))[0].result == 4


@pytest.mark.parametrize(
    ("wanted_us", "reported_us"),
    [
        *((98.0, 97), (33_333.0, 33_333), (50_000.6, 50_000), (0.5, -1), (2e12, -1)),
        *((math.inf, -1), (-math.inf, -1), (3e9, -(1 << 31))),
    ],
)
def test_an_interval_goes_by_way_of_a_rate(wanted_us: float, reported_us: int) -> None:
    """In float32, and cut off (set_message_interval, Mavlink::configure_stream)."""
    peer = Peer()
    peer.send(command_long(511, 30, wanted_us))
    assert only(peer.send(command_long(510, 30)), "MESSAGE_INTERVAL")[0].interval_us == reported_us


@pytest.mark.parametrize(
    ("number", "stop", "told"),
    [(105, -1.0, [-1, 0, -1, 0]), (105, 0.0, [-1, 0, -1, 0]), (253, -1.0, [50_000, -1, 0, -1])],
)
def test_to_stop_a_stream_that_is_not_there_makes_one_without_an_interval(
    number: int, stop: float, told: list[int]
) -> None:
    """HIGHRES_IMU and STATUSTEXT on a ground station's link; 0 goes back to a default that HIGHRES_IMU has not."""
    peer, intervals = Peer(), []
    for _ in told:
        intervals.append(only(peer.send(command_long(510, number)), "MESSAGE_INTERVAL")[0].interval_us)
        peer.send(command_long(511, number, stop))
    assert intervals == told


@pytest.mark.parametrize(
    ("asked", "number", "interval_us"),
    [(30.4, 30, 20_000), (-1.0, 0, 1_000_000), (-2.0, 65535, -1), (65566.0, 30, -1), (math.nan, 0, -1)],
)
def test_which_interval_is_asked_for(asked: float, number: int, interval_us: int) -> None:
    """(int)(param1 + 0.5f), of which the answer has 16 bits (MavlinkReceiver::get_message_interval)."""
    for request in (command_long(510, asked), command_long(512, 244, asked)):
        (told,) = only(Peer().send(request), "MESSAGE_INTERVAL")
        assert (told.message_id, told.interval_us) == (number, interval_us)


def test_half_a_message_less_than_none_is_none_that_there_is() -> None:
    """REQUEST_MESSAGE rounds halves away from 0 (roundf)."""
    assert [reply.result for reply in Peer().send(command_long(512, -0.5))] == [2]


def test_an_interval_of_hours_is_none() -> None:
    peer = Peer()
    peer.fly_and_run(0.2)
    assert peer.send(command_long(511, 30, 3.6e9))[0].result == 0
    assert len(only(peer.fly_and_run(1.0), "ATTITUDE")) > 200
    assert only(peer.send(command_long(510, 30)), "MESSAGE_INTERVAL")[0].interval_us < 0


def test_requests() -> None:
    peer = Peer()
    assert names(peer.send(command_long(512, 148))) == ["AUTOPILOT_VERSION", "COMMAND_ACK"]
    assert only(peer.send(command_long(510, 148)), "MESSAGE_INTERVAL")[0].interval_us == 0
    assert [reply.result for reply in peer.send(command_long(512, 259))] == [2]
    modes = only(peer.send(command_long(512, 435, 0)), "AVAILABLE_MODES")
    assert [mode.mode_index for mode in modes] == list(range(1, 28))
    assert [reply.result for reply in peer.send(command_long(512, 435, 28))] == [2]
    assert only(peer.send(command_long(512, 435, 5)), "AVAILABLE_MODES")[0].mode_name == "Hold"


def test_who_manages_a_gimbal_says_so() -> None:
    """With MNT_MODE_IN 4 (Mavlink::send_autopilot_capabilities)."""
    peer = Peer()
    told = []
    for mode in (-1, 4):
        peer.parameters.set("MNT_MODE_IN", mode)
        peer.now_us += 4000
        told.append(only(peer.send(command_long(512, 148)), "AUTOPILOT_VERSION")[0].capabilities)
    assert told == [59647, 59647 | 262144]


def test_nonsense_in_requests_and_intervals_is_answered_as_by_px4() -> None:
    peer = Peer()
    peer.fly_and_run(0.1)
    peer.now_us += 4000
    peer.fly()
    nan, inf = float("nan"), float("inf")
    assert names(peer.send(command_long(512, nan))) == ["HEARTBEAT", "COMMAND_ACK"]
    assert names(peer.send(command_long(512, 65536 + 30))) == ["ATTITUDE", "COMMAND_ACK"]
    assert [reply.result for reply in peer.send(command_long(512, 435, -3))] == [0]
    assert [reply.result for reply in peer.send(command_long(512, 435, 28))] == [2]
    assert names(peer.send(command_long(512, 261, 1))) == ["STORAGE_INFORMATION", "COMMAND_ACK"]
    assert [reply.result for reply in peer.send(command_long(512, 261, 2))] == [2]
    assert peer.send(command_long(511, inf, 1e6))[0].result == 0, "it is HEARTBEAT's, whose rate it is"
    for accepted in ((30, nan), (30, 1e13), (30, -inf), (30, inf), (30, 2e4, 0.4, 0, 0, 0, nan)):
        assert peer.send(command_long(511, *accepted))[0].result == 0
    for refused in ((30, 2e4, 1), (30, 2e4, 0, -2), (30, 2e4, 0, 0, 0, 0, 1)):
        assert peer.send(command_long(511, *refused))[0].result == 4
    assert only(peer.send(command_long(510, 30)), "MESSAGE_INTERVAL")[0].interval_us == 20_000


def test_a_rovers_modes_have_names_instead_of_standards() -> None:
    modes = only(Peer(kind=VehicleKind.ROVER_ACKERMANN).send(command_long(512, 435, 0)), "AVAILABLE_MODES")
    assert [(mode.mode_name, mode.standard_mode) for mode in modes[1:3]] == [("Altitude", 0), ("Position", 0)]


def test_what_a_component_answers_is_told_to_the_log() -> None:
    """With who is answered as its target, and as another's (vehicle_command_ack.from_external)."""
    camera = Peer(system=1, component=100)
    camera.send(mavlink.MAVLink_command_ack_message(IMAGE_START, 4, 50, -7, 1, 1))
    camera.send(mavlink.MAVLink_command_ack_message(IMAGE_START, 0, 0, 0, 255, 190))
    (told,) = camera.topics.commands_told
    assert (told.command.command, told.result, told.from_outside) == (IMAGE_START, (4, 50, -7), True)
    assert (told.command.source_system, told.command.source_component) == (1, 1)


@pytest.mark.parametrize(("to", "repeats"), [((1, 1), 0), ((0, 0), 0), ((255, 190), 3), ((1, 191), 3)])
def test_an_answer_to_somebody_else_ends_no_command_of_ours(to: tuple[int, int], repeats: int) -> None:
    """As when a ground station has asked the camera for the same (MavlinkReceiver::handle_message_command_ack)."""
    camera = Peer(system=1, component=100)
    outgoing = OutgoingCommands()
    sender = CommandSender(lambda: camera.mavlink.links, outgoing, 1, camera.topics)
    outgoing.give(VehicleCommand(IMAGE_START, target_system=1, target_component=100))
    sender.on_time(0)
    ack = mavlink.MAVLink_command_ack_message(IMAGE_START, 0, 0, 0, *to)
    link = camera.mavlink.links[GCS]
    for message in link.parse(bytes(ack.pack(camera.encoder))):
        sender.on_message(1, message, link)
    for now_us in range(0, 5_000_000, 100_000):
        sender.on_time(now_us)
    link.flush()
    assert len(only(camera.received(), "COMMAND_LONG")) == 1 + repeats
