"""Transcripts of the services: what is sent, what comes back, as measured on PX4 v1.18."""

import math
import struct
from typing import Any

import pytest

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.mavlink.services.parameter import parameter_hash
from sitl_emu.autopilot.topics import (
    GcsHeartbeats,
    ManualControlSetpoint,
    ManualControlSwitches,
    MissionResult,
    RcParameter,
    VehicleAngularVelocity,
    VehicleCommand,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilSensor
from tests.unit.mavlink_peer import ALT_M, GCS, GIMBAL, LAT_DEG, LON_DEG, ONBOARD, Peer, command_long, names, only

INT32, REAL32 = 6, 9
GLOBAL, MISSION_FRAME, RELATIVE, RELATIVE_INT = 0, 2, 3, 6
HOME_X, HOME_Y = 473977418, 85455939
HEARTBEAT_OF_GCS = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)


def param_set(name: str, value: float, kind: int) -> Any:
    if kind == INT32:
        value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind)


def item(seq: int, command: int = 16, frame: int = RELATIVE_INT, **fields: Any) -> Any:
    values: dict[str, Any] = dict.fromkeys(("param1", "param2", "param3", "param4"), 0.0)
    values |= {"x": HOME_X, "y": HOME_Y, "z": 10.0, "mission_type": 0, "current": 0, "autocontinue": 1} | fields
    return mavlink.MAVLink_mission_item_int_message(
        target_system=1, target_component=1, seq=seq, frame=frame, command=command, **values
    )


def count(number: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_count_message(1, 1, number, kind)


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


def upload(peer: Peer, *items: Any, kind: int = 0) -> tuple[int, int]:
    """Upload and return MISSION_ACK's type and mission type."""
    replies = peer.send(count(len(items), kind))
    for each in items:
        assert names(replies) == ["MISSION_REQUEST_INT"], replies
        assert replies[0].seq == each.seq
        replies = peer.send(each)
        if only(replies, "MISSION_ACK"):
            break
    ack = only(replies, "MISSION_ACK")[0]
    return ack.type, ack.mission_type


# --- commands ----------------------------------------------------------------------------------------------


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
    assert (seen[0].param1, seen[0].param2, seen[0].param3) == (29.0, 4.0, 4.0)


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
        (0, 66_667, 15),
        (1, 1, 0),
        (20_000, 20_000, 50),
    ):
        assert peer.send(command_long(511, 30, wanted_us))[0].result == 0
        assert interval() == reported_us
        assert rate() == pytest.approx(hz, abs=0.6)
    for refused in (0, 22, 27, 77, 9999):
        assert peer.send(command_long(511, refused, 100_000))[0].result == 4


def test_requests() -> None:
    peer = Peer()
    assert names(peer.send(command_long(512, 148))) == ["AUTOPILOT_VERSION", "COMMAND_ACK"]
    assert only(peer.send(command_long(510, 148)), "MESSAGE_INTERVAL")[0].interval_us == 0
    assert [reply.result for reply in peer.send(command_long(512, 259))] == [2]
    modes = only(peer.send(command_long(512, 435, 0)), "AVAILABLE_MODES")
    assert [mode.mode_index for mode in modes] == list(range(1, 28))
    assert [reply.result for reply in peer.send(command_long(512, 435, 28))] == [2]
    assert only(peer.send(command_long(512, 435, 5)), "AVAILABLE_MODES")[0].mode_name == "Hold"


def test_nonsense_in_requests_and_intervals_is_answered_as_by_px4() -> None:
    peer = Peer()
    peer.fly_and_run(0.1)
    nan, inf = float("nan"), float("inf")
    assert names(peer.send(command_long(512, nan))) == ["HEARTBEAT", "COMMAND_ACK"]
    assert names(peer.send(command_long(512, 65536 + 30))) == ["ATTITUDE", "COMMAND_ACK"]
    assert [reply.result for reply in peer.send(command_long(512, 435, -3))] == [0]
    assert [reply.result for reply in peer.send(command_long(512, 435, 28))] == [2]
    assert names(peer.send(command_long(512, 261, 1))) == ["STORAGE_INFORMATION", "COMMAND_ACK"]
    assert [reply.result for reply in peer.send(command_long(512, 261, 2))] == [2]
    assert peer.send(command_long(511, inf, 1000))[0].result == 4
    for accepted in ((30, nan), (30, 1e13), (30, -inf), (30, inf), (30, 2e4, 0.4, 0, 0, 0, nan)):
        assert peer.send(command_long(511, *accepted))[0].result == 0
    for refused in ((30, 2e4, 1), (30, 2e4, 0, -2), (30, 2e4, 0, 0, 0, 0, 1)):
        assert peer.send(command_long(511, *refused))[0].result == 4
    assert only(peer.send(command_long(510, 30)), "MESSAGE_INTERVAL")[0].interval_us == 20_000


def test_a_rovers_modes_have_names_instead_of_standards() -> None:
    modes = only(Peer(kind=VehicleKind.ROVER_ACKERMANN).send(command_long(512, 435, 0)), "AVAILABLE_MODES")
    assert [(mode.mode_name, mode.standard_mode) for mode in modes[1:3]] == [("Altitude", 0), ("Position", 0)]


# --- parameters --------------------------------------------------------------------------------------------


def test_parameter_list() -> None:
    peer = Peer()
    values = only(peer.send(mavlink.MAVLink_param_request_list_message(1, 0)), "PARAM_VALUE")
    values += only(peer.run(0.9), "PARAM_VALUE")
    assert len(values) == 948
    assert [(values[0].param_id, values[0].param_index), values[0].param_count] == [("_HASH_CHECK", 65535), 947]
    assert [value.param_index for value in values[1:]] == list(range(947))
    index = {value.param_id: value.param_index for value in values}
    assert (index["SYS_AUTOSTART"], index["MPC_XY_CRUISE"], index["CA_ROTOR11_KM"]) == (894, 621, 147)


def test_the_rovers_list_has_its_own_length() -> None:
    assert len(Peer(kind=VehicleKind.ROVER_ACKERMANN).parameters.announced) == 687


def test_a_module_that_starts_late_adds_its_parameters_to_the_list_and_to_the_hash() -> None:
    """As PX4's VehicleOpticalFlow with the first flow: six parameters, behind which all indices move."""
    peer = Peer()
    before = only(peer.send(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1)), "PARAM_VALUE")[0]
    nothing = mavlink.MAVLink_optical_flow_rad_message(0, 0, 50_000, 0, 0, 0, 0, 0, 0, 0, 0, -1.0)
    for _ in range(2):
        peer.send(nothing)
        after = only(peer.send(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1)), "PARAM_VALUE")[0]
        assert (before.param_count, after.param_count) == (947, 953)
        assert after.param_value != before.param_value
    last = only(peer.send(mavlink.MAVLink_param_request_read_message(1, 1, b"WV_YRATE_MAX", -1)), "PARAM_VALUE")[0]
    assert last.param_index == 952


def test_parameter_read() -> None:
    peer = Peer()

    def read(name: str, index: int = -1) -> list[Any]:
        replies = peer.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index))
        return [(reply.param_id, reply.param_index, reply.param_type) for reply in replies]

    assert read("MC_ROLLRATE_P") == [("MC_ROLLRATE_P", 550, REAL32)]
    assert read("", 1) == [("ATT_EN", 1, INT32)]
    assert read("FW_T_CLMB_MAX") == [("FW_T_CLMB_MAX", 65535, REAL32)]


def param_errors(replies: list[Any]) -> list[tuple[str, int, int]]:
    return [(each.param_id, each.param_index, each.error) for each in only(replies, "PARAM_ERROR")]


@pytest.mark.parametrize(
    ("name", "index", "answer"),
    [
        (b"NO_SUCH_PARAM", -1, ("NO_SUCH_PARAM", -1, 1)),
        (b"mpc_xy_p", -1, ("mpc_xy_p", -1, 1)),
        (b"NO_SUCH_PARAM", -2, ("NO_SUCH_PARAM", -1, 1)),
        (b"", -1, ("", -1, 1)),
        (b"", 947, ("", 947, 1)),
        (b"MPC_XY_P", 5000, ("", 5000, 1)),
    ],
)
def test_what_is_not_there_is_refused(name: bytes, index: int, answer: tuple[str, int, int]) -> None:
    """As a real PX4 v1.18 answers; the field that was not asked by is unset memory there."""
    replies = Peer(system=245, component=191).send(mavlink.MAVLink_param_request_read_message(1, 0, name, index))
    assert param_errors(replies) == [answer]
    assert [(each.target_system, each.target_component) for each in replies] == [(245, 191)]


@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("NO_SUCH_PARAM", 1.0, REAL32, 1),
        ("_HASH_CHECK", 0.0, 5, 5),
        ("MPC_XY_CRUISE", 7.0, 1, 6),
        ("COM_RC_IN_MODE", 1, 5, 6),
        ("MPC_XY_CRUISE", 7.0, INT32, 7),
        ("COM_RC_IN_MODE", 3.0, REAL32, 7),
    ],
)
def test_what_cannot_be_set_is_refused_and_changes_nothing(name: str, value: float, kind: int, error: int) -> None:
    peer = Peer()
    before = {each: peer.parameters[each] for each in ("MPC_XY_CRUISE", "COM_RC_IN_MODE")}
    assert param_errors(peer.send(param_set(name, value, kind))) == [(name, -1, error)]
    assert only(peer.run(0.1), "PARAM_VALUE") == []
    assert {each: peer.parameters[each] for each in before} == before


@pytest.mark.parametrize("target", [(0, 0), (0, 1), (77, 1), (1, 190)])
def test_what_was_meant_for_others_is_not_refused(target: tuple[int, int]) -> None:
    peer = Peer()
    assert peer.send(mavlink.MAVLink_param_request_read_message(*target, b"NO_SUCH_PARAM", -1)) == []
    assert peer.send(mavlink.MAVLink_param_set_message(*target, b"NO_SUCH_PARAM", 1.0, REAL32)) == []


def test_a_value_that_is_limited_at_once_is_told_twice() -> None:
    """999 to who set it, and what the position controller made of it to all links."""
    vehicle = Autopilot({"MAV_TYPE": 13}, 0)
    link = vehicle.mavlink.links[GCS]
    for tick in range(1, 300):
        vehicle.step([HilSensor(tick * 4000, *(0.0,) * 13, 0, 0)])
    link.outbox.clear()
    encoder, parser = mavlink.MAVLink(None, srcSystem=255, srcComponent=190), mavlink.MAVLink(None)
    vehicle.on_datagram(GCS, param_set("MPC_XY_CRUISE", 999.0, REAL32).pack(encoder))
    for tick in range(300, 600):
        vehicle.step([HilSensor(tick * 4000, *(0.0,) * 13, 0, 0)])
    heard = [message for data in link.outbox for message in parser.parse_buffer(data) or []]
    assert [(each.param_id, each.param_value) for each in only(heard, "PARAM_VALUE")] == [
        ("MPC_XY_CRUISE", 999.0),
        ("MPC_XY_CRUISE", 12.0),
    ]


def test_parameter_set_is_echoed_and_announced() -> None:
    peer = Peer()
    echoes = peer.send(param_set("MPC_XY_CRUISE", 6.5, REAL32))
    assert [(echo.param_index, echo.param_value) for echo in echoes] == [(621, 6.5)]
    told = only(peer.run(0.02), "PARAM_VALUE")
    assert [(each.param_id, each.param_value) for each in told] == [("MPC_XY_CRUISE", 6.5)]
    assert [each.param_value for each in only(peer.received(ONBOARD), "PARAM_VALUE")] == [6.5]
    assert len(peer.send(param_set("MPC_XY_CRUISE", 6.5, REAL32))) == 1
    assert only(peer.run(0.02), "PARAM_VALUE") == []
    assert peer.send(param_set("COM_RC_IN_MODE", 99, INT32))[0].param_type == INT32
    assert peer.parameters["COM_RC_IN_MODE"] == 99
    assert peer.parameters["MPC_XY_CRUISE"] == 6.5


def test_all_that_is_not_saved_is_told_with_every_change() -> None:
    peer = Peer()
    peer.send(param_set("MPC_XY_CRUISE", 6.5, REAL32))
    peer.run(0.02)
    peer.send(param_set("COM_RC_IN_MODE", 2, INT32))
    assert [each.param_id for each in only(peer.run(1.0), "PARAM_VALUE")] == ["COM_RC_IN_MODE", "MPC_XY_CRUISE"]
    peer.parameters.unsaved.clear()
    peer.send(param_set("COM_RC_IN_MODE", 3, INT32))
    assert [each.param_id for each in only(peer.run(1.0), "PARAM_VALUE")] == ["COM_RC_IN_MODE"]


def test_changes_of_the_same_second_are_told_together() -> None:
    """mavlink_parameters.h: parameter_update is looked at once a second; after a pause twice in a row."""
    peer = Peer()
    peer.run(5.0)
    told = []
    for value in (1.0, 2.0, 3.0, 4.0):
        peer.send(param_set("MPC_XY_CRUISE", value, REAL32))
        told.append([each.param_value for each in only(peer.run(0.02), "PARAM_VALUE")])
    assert told == [[1.0], [2.0], [], []]
    assert [each.param_value for each in only(peer.run(0.9), "PARAM_VALUE")] == []
    assert [each.param_value for each in only(peer.run(0.1), "PARAM_VALUE")] == [4.0]


def test_nan_and_tiny_changes_are_kept_and_not_told() -> None:
    peer = Peer()
    for value in (float("nan"), 5.0, 5.0 + 2.0**-23):
        assert len(peer.send(param_set("MPC_XY_CRUISE", value, REAL32))) == 1
        assert only(peer.run(0.02), "PARAM_VALUE") == []


def test_a_list_that_is_asked_for_again_begins_again_without_the_hash() -> None:
    peer = Peer()
    request = mavlink.MAVLink_param_request_list_message(1, 1)
    values = only(peer.send(request), "PARAM_VALUE") + only(peer.run(0.3), "PARAM_VALUE")
    values += only(peer.send(request), "PARAM_VALUE") + only(peer.run(1.0), "PARAM_VALUE")
    indices = [value.param_index for value in values]
    assert (indices.count(0), indices.count(65535), indices.count(946)) == (2, 1, 1)


def test_an_unknown_knob_of_a_remote_control_is_told() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_param_map_rc_message(1, 1, b"MPC_XY_P", -1, 3, 0.5, 1.0, 0.0, 2.0))
    assert peer.texts.recent[-1].text == "parameter_rc_channel_index out of bounds\t"


def test_knobs_of_a_remote_control_are_mapped_to_parameters() -> None:
    """By name, or by index; -2 takes it back (mavlink_parameters.cpp)."""
    peer = Peer()
    index = peer.parameters.index["MPC_XY_P"]
    peer.send(mavlink.MAVLink_param_map_rc_message(1, 1, b"MPC_Z_P", -1, 0, 0.5, 1.0, 0.0, 2.0))
    peer.send(mavlink.MAVLink_param_map_rc_message(1, 1, b"", index, 2, 1.0, 0.5, -1.0, 4.0))
    by_name, nothing, by_index = peer.topics.rc_parameter_map
    assert by_name == RcParameter("MPC_Z_P", 0.5, 1.0, 0.0, 2.0)
    assert nothing == RcParameter()
    assert by_index == RcParameter("MPC_XY_P", 1.0, 0.5, -1.0, 4.0)
    peer.send(mavlink.MAVLink_param_map_rc_message(1, 1, b"MPC_Z_P", -2, 0, 0.0, 0.0, 0.0, 0.0))
    assert peer.topics.rc_parameter_map[0] == RcParameter()


def test_counters_do_not_change_the_hash() -> None:
    peer = Peer()
    before = parameter_hash(peer.parameters)
    peer.parameters.set("COM_FLIGHT_UUID", 7)
    assert parameter_hash(peer.parameters) == before


def test_integers_travel_bit_by_bit() -> None:
    peer = Peer()
    for value in (-1, -2147483648, 0x7FC00001):
        peer.send(param_set("COM_FLIGHT_UUID", value, INT32))
        assert peer.parameters["COM_FLIGHT_UUID"] == value


def test_the_hash_follows_the_values() -> None:
    peer = Peer()
    before = parameter_hash(peer.parameters)
    peer.parameters.set("MPC_XY_CRUISE", 6.5)
    assert parameter_hash(peer.parameters) != before
    peer.parameters.set("MPC_XY_CRUISE", peer.parameters.default("MPC_XY_CRUISE"))
    assert parameter_hash(peer.parameters) == before


def test_setting_the_hash_stops_the_list() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_param_request_list_message(1, 1))
    peer.send(mavlink.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 0.0, 5))
    assert only(peer.run(0.1), "PARAM_VALUE") == []


# --- missions ----------------------------------------------------------------------------------------------


def test_mission_upload_and_download() -> None:
    peer = Peer()
    assert upload(peer, item(0, 22), item(1), item(2)) == (0, 0)
    assert [each.command for each in peer.dataman.mission.items] == [22, 16, 16]
    announced = peer.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert [(reply.count, reply.mission_type) for reply in announced] == [(3, 0)]
    for seq in range(3):
        reply = peer.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))[0]
        assert (reply.seq, reply.frame, reply.x, reply.current) == (seq, RELATIVE_INT, HOME_X, int(seq == 0))
    peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0))
    assert peer.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))[0].type == 0
    assert peer.dataman.mission.items == ()


def test_an_upload_is_asked_for_again_and_given_up() -> None:
    peer = Peer()
    peer.send(count(2))
    assert names(peer.send(item(0))) == ["MISSION_REQUEST_INT"]
    repeated = only(peer.run(4.9), "MISSION_REQUEST_INT")
    assert {reply.seq for reply in repeated} == {1}
    assert len(repeated) == pytest.approx(19, abs=1)
    peer.run(0.3)
    assert only(peer.run(1.0), "MISSION_REQUEST_INT") == []
    assert upload(peer, item(0)) == (0, 0)


def test_items_out_of_order() -> None:
    peer = Peer()
    peer.send(count(3))
    assert peer.send(item(2)) == []
    assert peer.send(item(0))[0].seq == 1
    assert peer.send(item(0)) == []
    busy = peer.send(count(3))
    assert [(reply.type, reply.mission_type) for reply in busy] == [(1, 0)]
    peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, 0))
    assert peer.send(item(1))[0].type == 1
    assert any(text.text.startswith("IGN MISSION_ITEM: No transfer") for text in peer.texts.recent)


def test_a_failed_upload_leaves_the_old_plan() -> None:
    peer = Peer()
    upload(peer, item(0))
    assert upload(peer, item(0, 30)) == (3, 0)
    assert len(peer.dataman.mission.items) == 1


@pytest.mark.parametrize(
    ("sent", "result"),
    [
        (item(0, frame=RELATIVE), 0),
        (item(0, frame=MISSION_FRAME), 3),
        (item(0, frame=7), 2),
        (item(0, param3=3.0), 8),
        (item(0, param4=float("nan"), param3=float("nan")), 0),
        (item(0, 178, MISSION_FRAME), 10),
        (item(0, 178, MISSION_FRAME, x=0, y=0, z=0.0, param2=5.0), 0),
        (item(0, 183), 3),
        (item(0, 5001), 12),
        (item(0, 5100), 1),
        (item(0, 189, MISSION_FRAME), 0),
    ],
)
def test_item_rules(sent: Any, result: int) -> None:
    assert upload(Peer(), sent)[0] == result


def test_limits_and_unknown_types() -> None:
    peer = Peer()
    for kind, most in ((0, 10_000), (1, 64), (2, 32)):
        assert names(peer.send(count(most, kind))) == ["MISSION_REQUEST_INT"]
        peer.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, kind))
        assert [reply.type for reply in peer.send(count(most + 1, kind))] == [4]
    assert [(reply.type, reply.mission_type) for reply in peer.send(count(1, 3))] == [(4, 3)]
    assert [(reply.type, reply.mission_type) for reply in peer.send(count(0))] == [(0, 0)]


def test_fence_and_rally() -> None:
    peer = Peer()
    corners = [item(seq, 5001, 5, param1=4.0, z=0.0, mission_type=1) for seq in range(4)]
    assert upload(peer, *corners, kind=1) == (0, 1)
    assert (peer.dataman.fence.items[0].frame, peer.dataman.fence.items[0].autocontinue) == (5, 0)
    assert upload(peer, item(0, 5100, RELATIVE, mission_type=2), kind=2) == (0, 2)
    assert len(peer.dataman.rally.items) == 1
    assert upload(peer, item(0, 5001, 5, param1=2.0, z=0.0, mission_type=1), kind=1)[0] == 1
    assert len(peer.dataman.fence.items) == 4


def test_plan_ids_are_on_the_wire() -> None:
    peer = Peer()
    peer.send(count(1))
    peer.mavlink.on_datagram(0, GCS, bytes(item(0).pack(peer.encoder)))
    frame = next(data for data in peer.mavlink.links[GCS].outbox)
    assert struct.unpack_from("<I", frame, 14) == (peer.dataman.mission.opaque_id,)


def test_plan_ids_are_px4s() -> None:
    peer = Peer()
    upload(peer, item(0, 22), item(1, x=HOME_X + 300), item(2, x=HOME_X + 600))
    assert peer.dataman.mission.opaque_id == 1161622139


def test_mission_current_keeps_its_rate_after_changes() -> None:
    peer = Peer()
    for _ in range(5):
        upload(peer, item(0), item(1))
        peer.run(0.1)
    assert len(only(peer.run(3.0), "MISSION_CURRENT")) == pytest.approx(3, abs=1)


def test_set_current_and_reached() -> None:
    peer = Peer()
    upload(peer, item(0), item(1), item(2))
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    assert only(peer.run(1.1), "MISSION_CURRENT")[-1].seq == 2
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    assert peer.texts.recent[-1].text == "WPM: WP CURR CMD: Not in list\t"
    peer.topics.mission_result = MissionResult(seq_reached=1, seq_reached_timestamp=5)
    assert [reply.seq for reply in only(peer.run(0.1), "MISSION_ITEM_REACHED")] == [1]
    assert [reply.seq for reply in only(peer.run(20.0), "MISSION_ITEM_REACHED")] == [1] * 10


def test_only_one_upload_at_a_time() -> None:
    peer = Peer()
    peer.send(count(2), GCS)
    assert [reply.type for reply in peer.send(count(2), ONBOARD)] == [1]


# --- setpoints and sticks ----------------------------------------------------------------------------------


def position_target(mask: int, frame: int = 1, **fields: float) -> Any:
    values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0) | fields
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, coordinate_frame=frame, type_mask=mask, **values
    )


def test_local_setpoints() -> None:
    peer = Peer()
    peer.now_us = 1000
    peer.send(position_target(0b1101_1111_1000, x=1.0, y=2.0, z=-3.0))
    setpoint = peer.topics.offboard_setpoint
    assert setpoint.timestamp == 1000
    assert setpoint.trajectory is not None
    assert setpoint.trajectory.position == (1.0, 2.0, -3.0)
    assert all(value != value for value in (*setpoint.trajectory.velocity, setpoint.trajectory.yaw))
    peer.send(position_target(0b0101_1100_0111, 8, vx=2.0))
    assert peer.topics.offboard_setpoint.trajectory is not None
    assert peer.topics.offboard_setpoint.trajectory.velocity == pytest.approx((2.0, 0.0, 0.0))


LOCAL_REFUSED = "SET_POSITION_TARGET_LOCAL_NED "


@pytest.mark.parametrize(
    ("mask", "frame", "text"),
    [
        (0xDF8, 1, ""),
        (0x200 | 0xDF8, 1, ""),
        (0x200 | 0xC38, 1, "force not supported"),
        (0xDFF, 1, "invalid"),
        (0xDC7, 8, ""),
        (0xDCF, 8, "invalid"),
        (0xDF8, 7, "coordinate frame 7 unsupported"),
    ],
)
def test_what_px4_refuses_of_local_setpoints(mask: int, frame: int, text: str) -> None:
    """A place; a force without acceleration; with it; nothing; a velocity of the body, whole and not; an offset."""
    peer = Peer()
    peer.now_us = 1000
    peer.send(position_target(mask, frame))
    assert (peer.topics.offboard_setpoint.timestamp == 0) == bool(text)
    assert [each.text for each in peer.texts.recent] == ([f"{LOCAL_REFUSED}{text}\t"] if text else [])


@pytest.mark.parametrize(
    ("frame", "mask", "down_m", "text"),
    [
        (5, 0xDF8, ALT_M - 10.0, ""),
        (6, 0xDF8, -10.0, ""),
        (11, 0xDF8, None, ""),
        (3, 0xDF8, None, "SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 3\t"),
        (3, 0xDC7, math.nan, ""),
        (6, 0xDFF, None, ""),
    ],
)
def test_frames_of_global_setpoints(frame: int, mask: int, down_m: float | None, text: str) -> None:
    """AMSL, above home, above unknown ground, in a frame not of PX4's; a velocity, where it does not count; nothing."""
    peer = Peer()
    peer.run(0.1)
    peer.fly()
    place = (round(LAT_DEG * 1e7), round(LON_DEG * 1e7), 10.0)
    peer.send(mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, mask, *place, *(0.0,) * 8))
    told = peer.topics.offboard_setpoint.trajectory
    assert (told is None) == (down_m is None)
    if told is not None:
        assert told.position[2] == pytest.approx(down_m, abs=0.01, nan_ok=True)
    assert [each.text for each in peer.texts.recent] == [text] * bool(text)


def test_global_setpoints() -> None:
    peer = Peer()
    peer.run(0.1)
    peer.fly()
    message = mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, 6, 0xDF8, round(LAT_DEG * 1e7) + 1000, round(LON_DEG * 1e7), 10.0, 0, 0, 0, 0, 0, 0, 0, 0
    )
    peer.send(message)
    setpoint = peer.topics.offboard_setpoint.trajectory
    assert setpoint is not None
    assert setpoint.position == pytest.approx((11.12, 0.0, -10.0), abs=0.02)
    assert peer.topics.home_position.alt == ALT_M


def test_attitude_and_rates() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0b111, [1, 0, 0, 0], 0, 0, 0, 0.5))
    assert peer.topics.offboard_setpoint.attitude is not None
    assert peer.topics.offboard_setpoint.attitude.thrust_body == (0.0, 0.0, -0.5)
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0x80, [1, 0, 0, 0], 0.1, 0.2, 0.3, 0.5))
    assert peer.topics.offboard_setpoint.rates is not None
    assert peer.topics.offboard_setpoint.rates.rates == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("mask", [0x40, 0x80 | 0x40, 0x80 | 0x1, 0x80 | 0x7])
def test_an_attitude_target_without_thrust_or_without_roll_or_pitch_is_none(mask: int) -> None:
    """mavlink_receiver.cpp, handle_message_set_attitude_target."""
    peer = Peer()
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1, 0, 0, 0], 0.1, 0.2, 0.3, 0.5))
    assert peer.topics.offboard_setpoint.timestamp == 0


def test_thrust_along_all_axes_and_the_present_yaw_rate() -> None:
    peer = Peer()
    peer.topics.vehicle_angular_velocity = VehicleAngularVelocity(1, (0.0, 0.0, 0.7))
    told = [0.0, 0.2, -0.6]
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0x80 | 0x20 | 0x4, [1, 0, 0, 0], 0, 0, 9, 0, told))
    rates = peer.topics.offboard_setpoint.rates
    assert rates is not None
    assert rates.thrust_body == pytest.approx(told) and rates.rates == (0.0, 0.0, 0.7)


def test_a_joystick_is_an_input() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_manual_control_message(1, 500, -1000, 250, 0, 3), ONBOARD)
    sticks = peer.topics.manual_control_mavlink
    assert (sticks.data_source, sticks.pitch, sticks.roll, sticks.throttle, sticks.buttons) == (3, 0.5, -1.0, -0.5, 3)
    peer.send(mavlink.MAVLink_manual_control_message(2, 0, 0, 0, 0, 0), ONBOARD)
    assert peer.topics.manual_control_mavlink is sticks
    peer.send(mavlink.MAVLink_manual_control_message(1, 2000, 0, -500, 0, 0))
    assert peer.topics.manual_control_mavlink[1:6] == (2, 0.0, 0.0, 0.0, 0.0)


def test_auxiliary_sticks_of_a_joystick_are_those_that_it_says_it_has() -> None:
    peer = Peer()
    extensions = {"enabled_extensions": 0b0000_1100, "aux1": 500, "aux2": -1001, "aux3": 700}
    peer.send(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0, **extensions))
    assert peer.topics.manual_control_mavlink.aux == (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_sticks_are_told_with_the_switches_of_the_rc() -> None:
    """Two bits each for return, hold, offboard and kill, at 2, 6, 10 and 12 (PX4's MANUAL_CONTROL.hpp)."""
    peer = Peer()
    peer.topics.manual_control_setpoint = ManualControlSetpoint(
        1, True, 0.5, -0.25, 0.0, -1.0, buttons=7, aux=(1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    )
    peer.topics.manual_control_switches = ManualControlSwitches(1, return_to_launch=1, loiter=3, kill=3)
    told = only(peer.send(command_long(512, 69)), "MANUAL_CONTROL")[0]
    assert (told.x, told.y, told.z, told.r, told.target) == (-250, 500, 0, 0, 1)
    assert told.buttons == 1 << 2 | 3 << 6 | 3 << 12
    assert (told.enabled_extensions, told.aux1, told.aux2, told.aux6) == (0xFC, 1000, 0, -1000)


@pytest.mark.parametrize(
    ("channels", "values"),
    [
        ((1000, 2000, 65535, 1500, 0, 65535, 65535, 65535), (1000, 2000, 0, 1500, 0)),
        ((0,) * 8, (0,) * 8),
        ((1500,) * 8 + (1100, 65534, 0), (1500,) * 8 + (1100, 65534)),
        ((65535,) * 8, ()),
    ],
)
def test_channels_that_are_ignored(channels: tuple[int, ...], values: tuple[int, ...]) -> None:
    """UINT16_MAX ignores any channel, 0 only those above the eighth; PX4 takes 65534 for a value."""
    peer = Peer()
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *channels))
    assert peer.topics.input_rc.values == values


def test_overridden_channels_are_shown() -> None:
    peer = Peer()
    peer.now_us = 1_000_000
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(1500,) * 8))
    shown = only(peer.send(command_long(512, 65)), "RC_CHANNELS")[0]
    assert (shown.chan1_raw, shown.chan9_raw, shown.chancount, shown.rssi) == (1500, 65535, 8, 100)


# --- time, texts, events, files ----------------------------------------------------------------------------


def test_ping_timesync_heartbeat() -> None:
    peer = Peer()
    peer.now_us = 5_000_000
    reply = peer.send(mavlink.MAVLink_ping_message(7, 42, 0, 0))[0]
    assert (reply.seq, reply.target_system, reply.target_component) == (42, 255, 190)
    assert peer.send(mavlink.MAVLink_ping_message(7, 42, 1, 1)) == []
    reply = peer.send(mavlink.MAVLink_timesync_message(0, 123))[0]
    assert (reply.tc1, reply.ts1) == (5_000_000_000, 123)
    peer.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    assert peer.topics.gcs_heartbeats.gcs_us == 5_000_000
    peer.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3), ONBOARD)
    assert peer.topics.gcs_heartbeats.onboard_us == 0, "not a component of this vehicle"


def test_heartbeats_of_components() -> None:
    """By MAV_TYPE; well are those in standby and active (MavlinkReceiver::handle_message_heartbeat)."""
    peer = Peer(system=1, component=191)
    peer.now_us = 5_000_000
    for kind in (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_TYPE_ADSB):
        peer.send(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 0, 3), ONBOARD)
    peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_PARACHUTE, 8, 0, 0, 4, 3), ONBOARD)
    peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_ODID, 8, 0, 0, 5, 3), ONBOARD)
    assert peer.topics.gcs_heartbeats == GcsHeartbeats(0, 5_000_000, 5_000_000, True, 5_000_000, False, 5_000_000)


# --- batteries, aircraft nearby, and numbers of others ----------------------------------------------------------------


def smart_battery(remaining_pct: int, *cells_mv: int) -> Any:
    voltages = [*cells_mv, *(65535,) * (10 - len(cells_mv))]
    return mavlink.MAVLink_battery_status_message(1, 1, 1, 32767, voltages, 150, 12, -1, remaining_pct)


def test_a_battery_of_our_own_system_is_told_beside_ours_and_the_emptiest_in_sys_status() -> None:
    peer = Peer(system=1, component=180)
    peer.fly()
    peer.send(smart_battery(6, 3501, 3502, 3503))
    heard = only(peer.run(2.5), "BATTERY_STATUS")[-2:]
    assert [battery.voltages[:4] for battery in heard] == [[16200, *(65535,) * 3], [3501, 3502, 3503, 65535]]
    assert [(battery.id, battery.battery_remaining, battery.charge_state) for battery in heard] == [
        (0, 100, 1),
        (0, 6, 3),
    ]
    status = only(peer.send(command_long(512, 1)), "SYS_STATUS")[0]
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (10506, 150, 6)


def test_batteries_of_others_are_not_ours() -> None:
    for system, component in ((255, 180), (1, 1)):
        peer = Peer(system=system, component=component)
        peer.send(smart_battery(6, 3500))
        assert not peer.topics.battery_status_outside.connected


def adsb_vehicle(icao_address: int, **changes: float) -> Any:
    fields: dict[str, Any] = {
        "lat": 473977420, "lon": 85455940, "altitude_type": 1, "altitude": 600_000, "heading": 12345,
        "hor_velocity": 5000, "ver_velocity": -250, "callsign": b"HBABC", "emitter_type": 3, "tslc": 2,
        "flags": 0x3F, "squawk": 7000,
    }  # fmt: skip
    return mavlink.MAVLink_adsb_vehicle_message(icao_address, **fields | changes)


def test_aircraft_are_told_again_each_once_on_every_link() -> None:
    peer = Peer()
    for number in (1, 2, 3):
        peer.send(adsb_vehicle(number, flags=0x7F))
    for link in (GCS, ONBOARD):
        heard = only(peer.run(0.1, link), "ADSB_VEHICLE")
        assert [vehicle.ICAO_address for vehicle in heard if vehicle.get_srcSystem() == 1] == [1, 2, 3]
        first = next(vehicle for vehicle in heard if vehicle.get_srcSystem() == 1).to_dict()
        assert first == adsb_vehicle(1).to_dict()
    assert peer.topics.transponder_reports[0].heading == pytest.approx(math.radians(123.45) - math.pi)
    assert peer.send(command_long(512, 246))[-1].result == 2, "nothing new, nothing on request"


def test_of_many_aircraft_the_last_twenty_wait() -> None:
    peer = Peer()
    for number in range(1, 31):
        peer.send(adsb_vehicle(number))
    heard = only(peer.run(0.1), "ADSB_VEHICLE")
    assert [vehicle.ICAO_address for vehicle in heard] == list(range(11, 31))


@pytest.mark.parametrize(
    ("sent", "told"),
    [
        (mavlink.MAVLink_named_value_float_message(7, b"speed", 1.5), {"name": "speed", "value": 1.5}),
        (mavlink.MAVLink_named_value_int_message(7, b"count", -3), {"name": "count", "value": -3.0}),
        (mavlink.MAVLink_named_value_float_message(7, b"tenletters", 1.5), {"name": "tenletter"}),
        (mavlink.MAVLink_debug_message(7, 5, 2.5), {"ind": 5, "value": 2.5}),
        (mavlink.MAVLink_debug_vect_message(b"wind", 7, 1.0, 2.0, 3.0), {"name": "wind", "x": 1.0, "z": 3.0}),
        (mavlink.MAVLink_debug_float_array_message(7, b"many", 9, [4.0] * 58), {"array_id": 9, "data": [4.0] * 58}),
    ],
)
def test_numbers_of_others_are_told_again(sent: Any, told: dict[str, Any]) -> None:
    """Once, by the stream of their name, at our time; a named integer is a float (handle_message_named_value_int)."""
    name = sent.get_type().replace("_INT", "_FLOAT")
    peer = Peer()
    peer.now_us = 3_000_000
    peer.send(sent, ONBOARD)
    heard = [message for message in only(peer.run(2.5), name) if message.get_srcSystem() == 1]
    assert len(heard) == 1
    assert told.items() <= heard[0].to_dict().items()
    assert (heard[0].time_usec if hasattr(heard[0], "time_usec") else heard[0].time_boot_ms * 1000) == 3_000_000


def test_texts_are_cut_into_chunks() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    peer.texts.say(Severity.INFO, "short\t")
    peer.texts.say(Severity.CRITICAL, "x" * 50 + "yz")
    peer.texts.say(Severity.INFO, "y" * 50)
    chunks = only(peer.run(0.11), "STATUSTEXT")
    assert [(chunk.id, chunk.chunk_seq, len(chunk.text), chunk.severity) for chunk in chunks] == [
        (1, 0, 6, 6),
        (2, 0, 50, 2),
        (2, 1, 2, 2),
        (3, 0, 50, 6),
    ]
    assert only(peer.received(GIMBAL), "STATUSTEXT") == []
    assert only(peer.run(0.1), "STATUSTEXT") == []


def test_texts_are_paced_and_a_link_loses_all_but_the_newest_eight() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    for number in range(12):
        peer.texts.say(Severity.INFO, f"text {number}")
    assert [text.text for text in only(peer.run(0.049), "STATUSTEXT")] == ["text 4"]
    rest = [text.text for text in only(peer.run(1.0), "STATUSTEXT")]
    assert rest == [f"text {number}" for number in range(5, 12)]


def test_texts_are_for_ground_stations_that_are_there() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    peer.send(HEARTBEAT_OF_GCS)
    peer.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3), ONBOARD)
    peer.texts.say(Severity.INFO, "heard")
    assert [text.text for text in only(peer.run(0.01), "STATUSTEXT")] == ["heard"]
    assert only(peer.received(ONBOARD), "STATUSTEXT") == []
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=True)
    peer.texts.say(Severity.INFO, "not heard")
    assert only(peer.run(0.01), "STATUSTEXT") == []
    peer.topics.vehicle_status = VehicleStatus(gcs_connection_lost=False)
    assert only(peer.run(0.1), "STATUSTEXT") == []


def request_event(first: int, last: int) -> Any:
    return mavlink.MAVLink_request_event_message(
        target_system=1, target_component=1, first_sequence=first, last_sequence=last
    )
