"""Parameters over MAVLink: what is sent, what comes back, as measured on PX4 v1.18."""

import struct
from typing import Any

import pytest

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.mavlink.services.parameter import parameter_hash
from sitl_emu.autopilot.topics import (
    RcParameter,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilSensor
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, only

INT32, REAL32 = 6, 9


def param_set(name: str, value: float, kind: int) -> Any:
    if kind == INT32:
        value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind)


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


def test_what_the_start_has_set_is_told_once_as_soon_as_there_are_links() -> None:
    """As PX4 does, whose parameter_update was published before: send_untransmitted in mavlink_parameters.cpp."""
    peer = Peer()
    peer.parameters.set("CAL_MAG0_PRIO", 75, notify=False)
    peer.parameters.set("CAL_ACC0_ID", 1310996, notify=False)
    told = only(peer.run(0.02), "PARAM_VALUE")
    assert [value.param_id for value in told] == ["CAL_ACC0_ID", "CAL_MAG0_PRIO"]
    assert [value.param_id for value in only(peer.received(ONBOARD), "PARAM_VALUE")] == ["CAL_ACC0_ID", "CAL_MAG0_PRIO"]
    assert only(peer.run(2.0), "PARAM_VALUE") == []


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
    assert peer.texts.events.recent[-1].id == layout("mavlink_param_rc_chan_out_of_bounds")[0]


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
