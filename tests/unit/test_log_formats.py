"""What is logged: PX4's names, types and order, and nothing that nobody has told."""

import importlib
import json
import struct
from pathlib import Path
from typing import NamedTuple

import pytest

from sitl_emu.autopilot.commander.mode_requirements import SELECTABLE_MODES, VALID_MODES, modes_that_need_local_position
from sitl_emu.autopilot.logger import logged_topics, packing, ulog
from sitl_emu.autopilot.logger.rows import commander, control, sensors
from sitl_emu.autopilot.topics import (
    ActuatorOutputs,
    ControlAllocatorStatus,
    DistanceSensorSample,
    EscStatus,
    FailsafeFlags,
    HomePosition,
    SensorGps,
    SensorsStatusImu,
    Topics,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.c_types import STRUCT_CODES

make_log_formats = importlib.import_module("tools.make_log_formats")
DEFINITION = """
# A message.
uint64 timestamp # us
uint8 STATE_ON = 1
bool valid
float32[3] wind
EscReport[2] esc
float64 lat
uint16 count
# TOPICS first_topic second_topic
"""


def fields_of(topic: str, row: packing.Row, record: object) -> dict[str, object]:
    return {name: value for _, name, value in packing.unpacked(topic, row(record))}


def test_fields_stand_in_the_order_in_which_px4_logs_them() -> None:
    assert make_log_formats.fields(DEFINITION) == (
        "uint64_t timestamp; double lat; float[3] wind; uint16_t count; bool valid; esc_report[2] esc"
    )
    assert make_log_formats.topics("Wind", DEFINITION) == ["first_topic", "second_topic"]
    assert make_log_formats.topics("EstimatorAidSource1d", "uint64 timestamp") == ["estimator_aid_source1d"]


def test_a_folder_of_definitions_becomes_formats(tmp_path: Path) -> None:
    (tmp_path / "versioned").mkdir()
    (tmp_path / "EscReport.msg").write_text("uint64 timestamp\nint32 esc_rpm\n")
    (tmp_path / "versioned" / "Wind.msg").write_text(DEFINITION)
    known = make_log_formats.formats(tmp_path)
    assert set(known) == {"esc_report", "wind", "first_topic", "second_topic"}
    assert set(make_log_formats.chosen(known, {"second_topic"})) == {"second_topic", "esc_report"}


def test_the_table_is_in_order() -> None:
    """As the tool leaves it: sizes fall, and every type is one that the table or ULog knows."""
    table = json.loads(Path(packing.__file__).with_name("formats.json").read_text())
    assert list(table) == sorted(table)
    for fields in packing.FORMATS.values():
        kinds = [ulog.array_length(kind)[0] for kind, _ in fields]
        known = [struct.calcsize(f"<{STRUCT_CODES[kind]}") for kind in kinds if kind in STRUCT_CODES]
        assert known == sorted(known, reverse=True)
        assert all(kind in packing.FORMATS for kind in kinds[len(known) :])
        assert fields[0] == ("uint64_t", "timestamp")


def test_every_field_has_to_be_told() -> None:
    class Unfinished(NamedTuple):
        timestamp: int = 0
        takeoff_state: int = 0

    with pytest.raises(ValueError, match=r"takeoff_status\.tilt_limit"):
        packing.by_name("takeoff_status", Unfinished)


def test_what_nobody_has_written_is_not_logged_as_if_it_were_known() -> None:
    """Records of a fresh vehicle that have a time have none yet: the logger leaves them out."""
    vehicle = logged_topics.Vehicle(modules=VehicleKind.MULTICOPTER.traits.modules, functions=[101], system_id=1)
    for topic in logged_topics.logged_topics(0, vehicle):
        record = getattr(Topics(), topic.source)
        assert getattr(record, "timestamp", 0) == 0, topic.name


def test_speed_controllers() -> None:
    told = fields_of("esc_status", sensors.esc_status, EscStatus(5_000_000, (6100, 0, 6200)))
    assert (told["esc_count"], told["esc_online_flags"], told["esc_armed_flags"]) == (3, 7, 7)
    escs = [told[f"esc[{n}]"] for n in range(12)]
    reports = [{name: value for _, name, value in esc} for esc in escs if isinstance(esc, list)]
    assert [report["esc_rpm"] for report in reports] == [6100, 0, 6200] + [0] * 9
    assert [report["actuator_function"] for report in reports[:4]] == [101, 102, 103, 0]
    assert fields_of("esc_status", sensors.esc_status, EscStatus(1, (0, 0)))["esc_armed_flags"] == 0


def test_receiver_and_range_finder_are_sihs() -> None:
    """SensorGpsSim.cpp knows no date; the range finder's id is simulator_sih/sih.hpp's."""
    fix = fields_of("sensor_gps", sensors.gps("sensor_gps"), SensorGps(5_000_000, fix_type=3))
    assert (fix["device_id"], fix["time_utc_usec"], fix["vel_ned_valid"]) == (11468804, 0, True)
    ranged = fields_of("distance_sensor", sensors.distance_sensor, DistanceSensorSample(1, 0.5, 0.1, 12.0))
    assert ranged["device_id"] == 10092548


def test_unused_outputs_and_actuators_say_so() -> None:
    outputs = fields_of("actuator_outputs", control.actuator_outputs, ActuatorOutputs(1, (0.5,), (1500,)))
    assert (outputs["noutputs"], outputs["output"]) == (16, (1500.0, *(900.0,) * 15))
    status = ControlAllocatorStatus(1, actuator_saturation=(-2, 0, *(2,) * 14))
    told = fields_of("control_allocator_status", control.control_allocator_status, status)
    assert told["actuator_saturation"] == (-2, 0, *(2,) * 14)


def test_modes_and_what_they_need() -> None:
    """As a real PX4's log says it (../shared/px4/ulog, failsafe_flags of sihsim_hex)."""
    flags = FailsafeFlags(mode_req_local_position=modes_that_need_local_position(flies=True))
    told = fields_of("failsafe_flags", commander.failsafe_flags, flags)
    assert told["mode_req_local_position"] == 7_995_448
    assert told["mode_req_local_position_relaxed"] == 262_340
    assert told["mode_req_prevent_arming"] == 3_944_480
    assert (VALID_MODES, SELECTABLE_MODES) == (2_147_411_455, 8_308_223)


@pytest.mark.parametrize("place", ["globe", "local frame"])
def test_of_a_home_zeros_are_told_where_it_has_no_place(place: str) -> None:
    """As a real PX4's log says it before the filter is ready (../shared/px4/ulog, home_position of sihsim_hex)."""
    home = HomePosition(1, True, 47.4, 8.5, 490.0, yaw=0.0)
    if place == "local frame":
        home = HomePosition(1, x=1.0, y=2.0, z=-3.0, yaw=0.0)
    told = fields_of("home_position", commander.home_position, home)
    on_globe = place == "globe"
    assert (told["valid_hpos"], told["valid_alt"], told["valid_lpos"]) == (on_globe, on_globe, not on_globe)
    assert [told[name] for name in ("lat", "lon", "alt")] == ([47.4, 8.5, 490.0] if on_globe else [0.0] * 3)
    assert [told[name] for name in "xyz"] == ([0.0] * 3 if on_globe else [1.0, 2.0, -3.0])


def test_an_imu_that_failed_is_not_healthy() -> None:
    told = fields_of("sensors_status_imu", sensors.sensors_status_imu, SensorsStatusImu(gyro_healthy=False))
    assert told["accel_healthy"] == (True, False, False, False)
    assert told["gyro_healthy"] == (False,) * 4
