"""The client half of each service against a stand-in for PX4, over links that lose what a pattern says."""

import inspect
import itertools
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs import heartbeat, modes, offboard, parameter, statustext
from sitl_emu.gcs import telemetry as telemetry_module
from sitl_emu.gcs.command import Command, arm, gripper
from sitl_emu.gcs.mission import (
    FENCE,
    MissionClear,
    MissionDownload,
    MissionItem,
    MissionSetCurrent,
    MissionUpload,
)
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.gcs.telemetry import Range, Telemetry
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.missions.companion.wire import STREAMS_NOT_READ
from tests.typed import now
from tests.unit.companion_px4 import MissionServer, on_the_wire

US = 1_000_000
ITEMS = [MissionItem(3, 16, x=404700000 + i, y=-869900000, z=15.0) for i in range(12)]


def talk(service: Any, server: Any, lost: Callable[[], bool] = lambda: False, limit_s: float = 120.0) -> float:
    """Lets both ends talk until the service is done; `lost` says what is lost, each way. Returns the seconds needed."""
    for now_us in range(0, round(limit_s * US), 20_000):
        to_server = service.on_time(now_us)
        to_client = server.on_time(now_us) if hasattr(server, "on_time") else []
        while to_server or to_client:
            answers = [server.on_message(now_us, on_the_wire(msg, 255, 190)) for msg in to_server if not lost()]
            to_client.extend(itertools.chain.from_iterable(answers))
            to_server = [
                answer
                for msg in to_client
                if not lost()
                for answer in service.on_message(now_us, on_the_wire(msg, 1, 1))
            ]
            to_client = []
        if service.done:
            return now_us / US
    raise AssertionError("not done in time")


def losing(pattern: str) -> Callable[[], bool]:
    """Loses where the pattern, repeated, has an x."""
    signs = itertools.cycle(pattern)
    return lambda: next(signs) == "x"


THIRTY_PERCENT = ["x..", "..x.x......x..x.x..", ".x..x....xxx........", "xx.....x.......x..x."]


@pytest.mark.parametrize("pattern", [".", *THIRTY_PERCENT])
def test_a_mission_is_uploaded_over_a_link_that_loses_a_third(pattern: str) -> None:
    server = MissionServer()
    upload = MissionUpload(1, ITEMS)
    talk(upload, server, losing(pattern))
    assert upload.outcome is not None
    assert upload.outcome.accepted
    assert [(item.x, item.z, item.command) for item in server.items[0]] == [(i.x, i.z, i.command) for i in ITEMS]
    assert upload.progress == 1.0


@pytest.mark.parametrize("pattern", [".", *THIRTY_PERCENT])
def test_a_mission_is_downloaded_over_a_link_that_loses_a_third(pattern: str) -> None:
    server = MissionServer()
    talk(MissionUpload(1, ITEMS, FENCE), server)
    download = MissionDownload(1, FENCE)
    talk(download, server, losing(pattern))
    assert download.items == ITEMS


def test_an_upload_without_loss_takes_no_time() -> None:
    assert talk(MissionUpload(1, ITEMS), MissionServer()) < 0.1


def test_a_refused_item_is_told_by_name_and_not_tried_again() -> None:
    server = MissionServer()
    server.refuse = 5
    upload = MissionUpload(1, ITEMS)
    assert talk(upload, server) < 1.0
    assert upload.outcome == (False, 5, "invalid item")


def test_an_upload_to_nobody_ends() -> None:
    upload = MissionUpload(1, ITEMS, tries=2)
    talk(upload, MissionServer(), lambda: True)
    assert upload.outcome == (False, None, "no answer in 2 tries")


def test_an_ack_of_an_older_transfer_does_not_end_an_upload() -> None:
    upload = MissionUpload(1, ITEMS)
    upload.on_time(0)
    upload.on_message(1000, on_the_wire(mavlink.MAVLink_mission_ack_message(255, 190, 0, 0), 1, 1))
    assert not upload.done


def test_answers_of_another_system_are_not_taken() -> None:
    upload = MissionUpload(1, ITEMS)
    upload.on_time(0)
    request = mavlink.MAVLink_mission_request_int_message(255, 190, 0, 0)
    assert upload.on_message(1000, on_the_wire(request, 2, 1)) == []
    assert len(upload.on_message(1000, on_the_wire(request, 1, 1))) == 1


def test_an_empty_plan_is_uploaded_too() -> None:
    upload = MissionUpload(1, [], FENCE)
    talk(upload, MissionServer())
    assert upload.outcome is not None
    assert upload.outcome.accepted


def test_clear_and_set_current() -> None:
    server = MissionServer()
    talk(MissionUpload(1, ITEMS), server)
    clear = MissionClear(1)
    talk(clear, server, losing("x."))
    assert server.items[0] == []
    current = MissionSetCurrent(1, 3)
    assert [m.get_type() for m in current.on_time(0)] == ["MISSION_SET_CURRENT"]
    current.on_message(1, on_the_wire(mavlink.MAVLink_mission_current_message(2), 1, 1))
    assert not current.done
    current.on_message(2, on_the_wire(mavlink.MAVLink_mission_current_message(3), 1, 1))
    assert current.outcome is not None
    assert current.outcome.accepted


def ack(command: int, result: int, progress: int = 255) -> Any:
    return on_the_wire(mavlink.MAVLink_command_ack_message(command, result, progress, 0, 255, 190), 1, 1)


def test_a_command_is_repeated_with_its_confirmation_counted_up() -> None:
    command = arm(1)
    sent = [msg for t in range(0, 3 * US, 100_000) for msg in command.on_time(t)]
    assert [msg.confirmation for msg in sent] == [0, 1, 2, 3, 4, 5]
    command.on_message(3 * US, ack(400, 0))
    assert command.outcome == (True, 0, "accepted")
    assert command.on_time(10 * US) == []


def test_a_command_in_progress_is_waited_for() -> None:
    command = Command(1, 1, 241)
    command.on_time(0)
    command.on_message(1000, ack(241, 5, 40))
    assert command.progress == 40
    assert command.on_time(5 * US) == []
    command.on_message(6 * US, ack(241, 4))
    assert command.outcome == (False, 4, "failed")


def test_a_repetition_that_is_refused_while_the_first_is_carried_out_ends_nothing() -> None:
    """payload_deliverer.cpp: the same action while it is at it is TEMPORARILY_REJECTED; its IN_PROGRESS was lost."""
    opening = gripper(1, open_it=True)
    assert not now(opening.may_have_begun)
    opening.on_time(0)
    assert now(opening.may_have_begun) and len(opening.on_time(US // 2)) == 1
    opening.on_message(US // 2, ack(211, 1))
    assert not opening.done and opening.on_time(US // 2 + 1000) == []
    opening.on_message(US, ack(211, 0))
    assert opening.outcome == (True, 0, "accepted")


def test_what_is_refused_for_now_is_refused_at_once_and_if_it_may_be_a_repetition_at_its_last_try() -> None:
    once, often = arm(1), arm(1)
    once.on_time(0)
    once.on_message(1000, ack(400, 1))
    assert once.outcome == (False, 1, "temporarily rejected")
    often.on_time(0)
    for t in range(US // 2, 5 * US, US // 2):
        assert len(often.on_time(t)) == 1
        often.on_message(t + 1000, ack(400, 1))
    assert not often.done and often.on_time(5 * US) == []
    assert often.outcome == (False, 1, "temporarily rejected")


@pytest.mark.parametrize(("result", "begun"), [(1, True), (2, False), (3, False), (4, False), (6, True)])
def test_whether_what_was_asked_may_have_begun(result: int, begun: bool) -> None:
    opening = gripper(1, open_it=True)
    opening.on_time(0)
    opening.on_message(1000, ack(211, result))
    assert opening.done and opening.may_have_begun is begun


def test_a_command_that_nobody_answers_ends() -> None:
    command = set_mode(1, "mission")
    first = command.on_time(0)[0]
    assert (first.param1, first.param2, first.param3) == (1, 4, 4)
    for t in range(0, 20 * US, 100_000):
        command.on_time(t)
    assert command.outcome == (False, None, "no answer to 10 tries")


def test_the_ack_of_another_command_or_component_is_not_taken() -> None:
    command = arm(1)
    command.on_time(0)
    command.on_message(1, ack(176, 0))
    command.on_message(1, on_the_wire(mavlink.MAVLink_command_ack_message(400, 0, 0, 0, 255, 190), 1, 191))
    assert not command.done


class ParameterServer:
    """PX4's half: integers bytewise, `_HASH_CHECK` first."""

    def __init__(self) -> None:
        self.values: dict[str, tuple[float | int, int]] = {f"P_{i}": (i * 1.5, 9) for i in range(40)}
        self.values["COUNT"] = (-7, 6)

    def value(self, name: str) -> Any:
        value, kind = self.values[name]
        wire = struct.unpack("<f", struct.pack("<i", value))[0] if kind == 6 else value
        index = list(self.values).index(name)
        return mavlink.MAVLink_param_value_message(name.encode(), wire, kind, len(self.values), index)

    def on_message(self, now_us: int, msg: Any) -> list[Any]:
        if msg.get_type() == "PARAM_REQUEST_LIST":
            hash_check = mavlink.MAVLink_param_value_message(b"_HASH_CHECK", 1.0, 5, len(self.values), 65535)
            return [hash_check, *(self.value(name) for name in self.values)]
        if msg.get_type() == "PARAM_REQUEST_READ":
            name = msg.param_id if msg.param_index == -1 else list(self.values)[msg.param_index]
            return [self.value(name)]
        if msg.get_type() == "PARAM_SET":
            kind = self.values[msg.param_id][1]
            raw = struct.unpack("<i", struct.pack("<f", msg.param_value))[0] if kind == 6 else msg.param_value
            self.values[msg.param_id] = (raw, kind)
            return [self.value(msg.param_id)]
        return []


def test_all_parameters_come_through_a_link_that_loses_a_third() -> None:
    server, listing = ParameterServer(), parameter.ParameterList(1)
    talk(listing, server, losing("..x.x......x..x.x.."))
    assert listing.complete
    assert listing.parameters["COUNT"].value == -7
    assert listing.parameters["P_39"].value == 58.5


def test_a_parameter_is_set_and_read_back() -> None:
    server = ParameterServer()
    change = parameter.ParameterSet(1, "COUNT", 12345678)
    talk(change, server, losing("x.."))
    assert change.accepted
    read = parameter.ParameterRead(1, "COUNT")
    talk(read, server, losing(".x."))
    assert read.parameter is not None
    assert read.parameter.value == 12345678


def test_a_parameter_of_another_type_is_not_taken_for_set() -> None:
    change = parameter.ParameterSet(1, "COUNT", 3.0)
    talk(change, ParameterServer())
    assert not change.accepted


def test_heartbeats_go_out_once_a_second_and_silence_is_noticed() -> None:
    mine = heartbeat.Heartbeat(6)
    assert sum(len(mine.on_time(t)) for t in range(0, 10 * US, 20_000)) == 10
    watch = heartbeat.Watch()
    assert not watch.lost(0)
    watch.heard(2 * US)
    assert not watch.lost(5 * US)
    assert watch.lost(6 * US)


def test_offboard_streams_for_a_second_before_it_asks_for_the_mode() -> None:
    control = offboard.Offboard(1, offboard.velocity_ned(1, 1.0, 0.0, 0.0))
    sent = [(t, msg.get_type()) for t in range(0, 2 * US, 50_000) for msg in control.on_time(t)]
    commands = [t for t, kind in sent if kind == "COMMAND_LONG"]
    assert commands[0] == US
    assert sum(kind == "SET_POSITION_TARGET_LOCAL_NED" for _, kind in sent) == 40


def test_an_offboard_place_ignores_all_but_itself() -> None:
    place = on_the_wire(offboard.position_ned(1, 3.0, -2.0, -10.0), 255, 190)
    assert (place.x, place.y, place.z, place.coordinate_frame) == (3.0, -2.0, -10.0, 1)
    assert place.type_mask == 0b1101_1111_1000
    turned = on_the_wire(offboard.position_ned(1, 3.0, -2.0, -10.0, yaw_rad=1.5), 255, 190)
    assert (turned.type_mask, turned.yaw) == (0b1001_1111_1000, 1.5)


def test_long_texts_travel_in_chunks() -> None:
    text = "Companion yields: pilot chose position, and this text is longer than fifty bytes, even twice"
    assembler = statustext.TextAssembler()
    heard = [assembler.on_message(on_the_wire(m, 1, 191)) for m in statustext.messages_of(text, 6, 7)]
    assert heard == [None, text]
    exact = "x" * 100
    heard = [assembler.on_message(on_the_wire(m, 1, 191)) for m in statustext.messages_of(exact, 6, 8)]
    assert heard == [None, None, exact]
    assert assembler.on_message(on_the_wire(statustext.messages_of("short", 6, 9)[0], 1, 191)) == "short"


def test_modes_have_names() -> None:
    assert modes.name_of(4 << 16 | 5 << 24) == "return"
    assert modes.name_of(99 << 16) == "99.0"


def position(ms: int, north_m: float, speed: float) -> Any:
    lat = round(404700000 + north_m / 6371000.0 * 57.29577951 * 1e7)
    msg = mavlink.MAVLink_global_position_int_message(ms, lat, -869900000, 230000, 15000, round(speed * 100), 0, 0, 0)
    return on_the_wire(msg, 1, 1)


def test_the_pose_at_a_frames_time_lies_between_two_messages() -> None:
    telemetry = Telemetry(1)
    for ms, north in ((1000, 0.0), (1020, 0.1), (1040, 0.2)):
        telemetry.on_message(ms * 1000, position(ms, north, 5.0))
        half = (ms - 1000) / 40.0 * 0.05
        telemetry.on_message(
            ms * 1000, on_the_wire(mavlink.MAVLink_attitude_quaternion_message(ms, 1, 0, 0, half, 0, 0, 0), 1, 1)
        )
    pose = telemetry.pose_at(1_030_000)
    assert pose is not None
    assert (pose.lat_deg - 40.47) * 111194.93 == pytest.approx(0.15, abs=0.005)
    assert pose.yaw_rad == pytest.approx(2 * 0.0375, abs=0.001)
    assert telemetry.pose_at(999_000) is None
    assert telemetry.pose_at(1_100_000) is not None
    assert telemetry.pose_at(1_200_000) is None


def test_telemetry_hears_its_own_autopilot_alone() -> None:
    telemetry = Telemetry()
    telemetry.on_message(0, on_the_wire(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), 1, 191))
    assert telemetry.system == 0
    beat = mavlink.MAVLink_heartbeat_message(13, 12, 157, 4 << 16 | 4 << 24, 4, 3)
    telemetry.on_message(0, on_the_wire(beat, 3, 1))
    assert (telemetry.system, telemetry.mode, telemetry.armed) == (3, "mission", True)
    telemetry.on_message(0, on_the_wire(mavlink.MAVLink_heartbeat_message(13, 12, 29, 0, 4, 3), 1, 1))
    assert telemetry.armed


def test_telemetry_knows_battery_mission_and_lidar() -> None:
    telemetry = Telemetry(1)
    for msg in (
        mavlink.MAVLink_sys_status_message(0, 0, 0x10000000, 0, 16000, -1, 87, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_mission_current_message(4),
        mavlink.MAVLink_mission_item_reached_message(3),
        mavlink.MAVLink_distance_sensor_message(1000, 20, 1200, 354, 0, 0, 25, 0),
    ):
        telemetry.on_message(0, on_the_wire(msg, 1, 1))
    assert (telemetry.prearm_ok, telemetry.battery_percent) == (True, 87)
    assert (telemetry.mission_current, telemetry.mission_reached) == (4, 3)
    assert list(telemetry.ranges) == [Range(1_000_000, 3.54, 25)]
    nothing_in_range = mavlink.MAVLink_distance_sensor_message(1050, 20, 1200, 1201, 0, 0, 25, 0)
    telemetry.on_message(0, on_the_wire(nothing_in_range, 1, 1))
    forward = mavlink.MAVLink_distance_sensor_message(1100, 20, 1200, 777, 0, 0, 0, 0)
    telemetry.on_message(0, on_the_wire(forward, 1, 1))
    assert telemetry.range_at(1_080_000, within_us=100_000) == Range(1_000_000, 3.54, 25)
    assert telemetry.range_at(1_080_000, within_us=100_000, orientation=0) == Range(1_100_000, 7.77, 0)
    assert telemetry.range_at(1_200_001, within_us=100_000) is None


def test_only_a_range_finder_that_looks_down_is_heard_as_one() -> None:
    telemetry = Telemetry(1)
    for boot_ms, orientation in ((1000, 25), (3000, 0), (3100, 24)):
        said = mavlink.MAVLink_distance_sensor_message(boot_ms, 20, 1200, 354, 0, 0, orientation, 0)
        telemetry.on_message(0, on_the_wire(said, 1, 1))
    assert telemetry.range_heard_us == 1_000_000


def test_what_was_known_by_the_time_of_another_boot_is_known_no_more() -> None:
    telemetry = Telemetry(1)

    def tell(boot_ms: int) -> None:
        for msg in (
            mavlink.MAVLink_attitude_quaternion_message(boot_ms, 1, 0, 0, 0, 0, 0, 0),
            mavlink.MAVLink_global_position_int_message(boot_ms, 474_000_000, 85_000_000, 489_000, 0, 0, 0, 0, 0),
            mavlink.MAVLink_distance_sensor_message(boot_ms, 20, 1200, 354, 0, 0, 25, 0),
        ):
            telemetry.on_message(0, on_the_wire(msg, 1, 1))

    home = mavlink.MAVLink_home_position_message(474_000_000, 85_000_000, 489_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
    telemetry.on_message(0, on_the_wire(home, 1, 1))
    tell(600_000)
    tell(599_100)  # overtaken on its way
    assert telemetry.boot_time_us == 600_000_000 and telemetry.home is not None
    tell(5_000)
    assert (telemetry.boot_time_us, telemetry.range_heard_us) == (5_000_000, 5_000_000)
    assert now(telemetry.home) is None
    assert [one.time_us for one in telemetry.ranges] == [5_000_000]
    assert telemetry.pose_at(5_000_000) is not None and telemetry.pose_at(600_000_000) is None


def test_telemetry_knows_how_good_the_receiver_says_it_is() -> None:
    telemetry = Telemetry(1)
    said = mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 70, 110, 0, 0, 16, 0, 2100, 3500, 400, 0, 0)
    telemetry.on_message(0, on_the_wire(said, 1, 1))
    assert [telemetry.eph_m, telemetry.epv_m] == [2.1, 3.5]
    unknown = mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 70, 110, 0, 0, 16)
    telemetry.on_message(0, on_the_wire(unknown, 1, 1))
    assert [telemetry.eph_m, telemetry.epv_m] == [None, None]


def test_a_tlog_holds_big_endian_times_and_raw_frames(tmp_path: Path) -> None:
    with TlogWriter(tmp_path / "x.tlog") as log:
        log.write(1_700_000_000_000_001, b"\xfd\x00")
    assert (tmp_path / "x.tlog").read_bytes() == bytes.fromhex("00060a24181e4001") + b"\xfd\x00"
    with pytest.raises(OSError, match=r"no/x\.tlog.*choose another folder"):
        TlogWriter(tmp_path / "no" / "x.tlog")


def test_glitches_of_the_receiver_count_as_long_as_the_estimator_tells_of_them() -> None:
    telemetry = Telemetry(1)
    counts = []
    for flags in (831, 831 | mavlink.ESTIMATOR_GPS_GLITCH, 831 | mavlink.ESTIMATOR_GPS_GLITCH, 831):
        telemetry.on_message(0, on_the_wire(mavlink.MAVLink_estimator_status_message(0, flags, *[0.0] * 8), 1, 1))
        counts.append(telemetry.gps_glitches)
    assert counts == [0, 1, 2, 0]


def test_a_compass_that_is_in_use_and_not_healthy_is_not_ok() -> None:
    telemetry, told = Telemetry(1), []
    mag, others = mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG, mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    for enabled, healthy in ((others, others), (others | mag, others | mag), (others | mag, others)):
        status = mavlink.MAVLink_sys_status_message(others | mag, enabled, healthy, *[0] * 10)
        telemetry.on_message(0, on_the_wire(status, 1, 1))
        told.append(telemetry.compass_ok)
    assert told == [True, True, False]


def test_a_companion_s_link_decodes_all_that_telemetry_reads() -> None:
    source = inspect.getsource(telemetry_module)
    read = re.findall(r'"([A-Z][A-Z_]+)"', source)
    ids = {name: getattr(mavlink, f"MAVLINK_MSG_ID_{name}", None) for name in read}
    assert {"ESTIMATOR_STATUS", "GPS_RAW_INT", "HEARTBEAT"} <= ids.keys() and None not in ids.values()
    assert not {name for name, number in ids.items() if number in STREAMS_NOT_READ}
