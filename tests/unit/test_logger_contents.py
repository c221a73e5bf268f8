"""What a log holds: topics under PX4's names and at its rates, parameters, texts and events."""

import hashlib
import json
import lzma
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog
from pyulog.px4 import PX4ULog
from pyulog.ulog2csv import convert_ulog2csv

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.control.control_allocator import ControlAllocator
from sitl_emu.autopilot.logger import logged_topics, packing
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.logger.rows import commander, control, estimator
from sitl_emu.autopilot.mavlink.component_metadata import files
from sitl_emu.autopilot.mavlink.context import BOOT_UNIX_US
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import (
    ActuatorOutputs,
    HoverThrustEstimate,
    InputRc,
    MissionResult,
    OffboardSetpoint,
    Topics,
    VehicleAttitude,
    VehicleAttitudeSetpoint,
    VehicleCommand,
    VehicleLocalPosition,
    VehicleRoi,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator
from tests.unit.logger_rig import FIRST, TICK_US, Rig
from tests.unit.rover_body import RoverBody

# --- what --------------------------------------------------------------------------------------------------


def test_every_topic_is_packed_whole() -> None:
    """Every row has as many values as PX4's fields, also of records that nobody has written."""
    for kind in VehicleKind:
        vehicle = logged_topics.Vehicle(kind.traits.modules, [101, 102, 103, 104], 1)
        for topic in logged_topics.logged_topics(0xFFF, vehicle):
            if topic.find is not None:
                continue  # nobody has spoken yet
            record = getattr(Topics(), topic.source)
            assert len(topic.row(record)) == packing.size_of(topic.name), topic.name


@pytest.mark.parametrize("factor", [0.0, 0.4, 1.0])
def test_motors_are_logged_as_the_allocator_asks_for_them(factor: float) -> None:
    """Before the curve of THR_MDL_FAC, which PX4 applies after what it logs."""
    asked = (0.0, 0.002, 0.3432, 1.0)
    allocator = ControlAllocator([], factor)
    row = control.actuators("actuator_motors", (101, 102, 103, 104), 101, (0,), factor)
    packed = row(ActuatorOutputs(7, tuple(allocator.signal(thrust) for thrust in asked)))
    assert struct.unpack_from("<4f", packed, 16) == pytest.approx(asked, abs=1e-6)


def test_a_motor_that_stands_still_while_others_turn_is_logged_as_no_number() -> None:
    """As ControlAllocator::publish_actuator_controls has it; of a vehicle that stands, all are 0."""
    row = control.actuators("actuator_motors", (101, 102), 101, (0,))
    one_off = struct.unpack_from("<2f", row(ActuatorOutputs(7, (0.0, 0.5), (900, 1500))), 16)
    assert math.isnan(one_off[0]) and one_off[1] == 0.5
    assert struct.unpack_from("<2f", row(ActuatorOutputs(7, (0.0, 0.0), (900, 900))), 16) == (0.0, 0.0)


def test_numbers_that_their_fields_cannot_hold_lose_no_record() -> None:
    whole = estimator.vehicle_attitude(VehicleAttitude(7, (1.0, 0.0, 0.0, 0.0)))
    packed = estimator.vehicle_attitude(VehicleAttitude(7, (1e300, 0.0, 0.0, 0.0)))
    assert (len(packed), packed[16:20]) == (len(whole), struct.pack("<f", math.inf))
    command = commander.vehicle_command(VehicleCommand(400, 1e300, target_system=257))
    assert len(command) == packing.size_of("vehicle_command")


def test_what_a_log_says_of_who_wrote_it(tmp_path: Path) -> None:
    """write_version in logger.cpp; SITL has no UUID (platforms/posix/include/system_config.h), and we no toolchain."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(0.1)
    rig.logger.shut_down()
    told = rig.read(FIRST).msg_info_dict
    assert {name: told[name] for name in told if name.startswith(("ver_", "sys_"))} == {
        "ver_sw": "sitl-emu",
        "ver_sw_release": 0x011200FF,
        "ver_vendor_sw_release": 255,
        "ver_hw": "PX4_SITL",
        "ver_data_format": 2,
        "sys_name": "PX4",
        "sys_os_name": "Linux",
    }
    written = (tmp_path / "log" / FIRST).read_bytes()
    for name in ("ver_sw_release", "ver_vendor_sw_release", "ver_data_format"):
        assert f"uint32_t {name}".encode() in written
    assert b"int32_t time_ref_utc" in written and b"uint64_t boot_time_utc_us" in written


def test_values_arrive_under_px4s_names(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2, **{f"PWM_MAIN_FUNC{n}": 100.0 + n for n in range(1, 5)})
    topics = rig.topics
    rig.run(0.1)
    now = rig.now_us
    topics.vehicle_attitude = VehicleAttitude(now, (0.5, -0.5, 0.5, -0.5), (0.1, 0.2, 0.3))
    topics.vehicle_local_position = VehicleLocalPosition(
        now,
        now,
        True,
        True,
        x=1.0,
        y=2.0,
        z=-3.0,
        z_deriv=0.5,
        heading=0.7,
        xy_global=True,
        ref_lat=47.0,
        eph=0.25,
        xy_reset_counter=3,
    )
    topics.actuator_outputs = ActuatorOutputs(now, (0.1, 0.2, 0.3, 0.4), (1100, 1200, 1300, 1400))
    command = VehicleCommand(400, 1.0, param5=47.5, source_system=255, target_system=1)
    tell(topics, now, command)
    tell(topics, now, command, CommandResult(4, 50, -1))
    tell(topics, now, command, CommandResult(0), from_outside=True)
    rig.texts.say(Severity.INFO, "[logger] x\t", "logger_open_file_sess", 3, 258)
    topics.input_rc = InputRc(now, (1500, 1100))
    rig.parameters.set("MPC_XY_P", 0.5)
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)

    def row(name: str) -> dict[str, float]:
        data = log.get_dataset(name).data
        return {field: float(column[-1]) for field, column in data.items()}

    attitude, local = row("vehicle_attitude"), row("vehicle_local_position")
    assert [attitude[f"q[{n}]"] for n in range(4)] == [0.5, -0.5, 0.5, -0.5]
    assert (attitude["timestamp"], attitude["timestamp_sample"]) == (now, now)
    assert (local["x"], local["y"], local["z"], local["z_deriv"], local["xy_reset_counter"]) == (1.0, 2.0, -3.0, 0.5, 3)
    assert (local["xy_valid"], local["v_xy_valid"], local["xy_global"], local["z_global"]) == (1, 0, 1, 0)
    assert (local["ref_lat"], local["eph"], local["delta_xy[1]"]) == (47.0, 0.25, 0.0)
    assert math.isnan(local["evh"])
    motors, outputs = row("actuator_motors"), row("actuator_outputs")
    assert [motors[f"control[{n}]"] for n in range(4)] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert math.isnan(motors["control[4]"])
    assert (outputs["noutputs"], outputs["output[3]"], outputs["output[4]"]) == (16, 1400, 900)
    given = row("vehicle_command")
    assert (given["timestamp"], given["command"], given["param1"], given["param5"]) == (now, 400, 1.0, 47.5)
    assert (given["source_system"], given["target_system"], given["from_external"]) == (255, 1, 1)
    assert list(log.get_dataset("vehicle_command_ack").data["from_external"]) == [0, 1]
    answer = {name: column[0] for name, column in log.get_dataset("vehicle_command_ack").data.items()}
    assert (answer["command"], answer["result"], answer["result_param1"], answer["result_param2"]) == (400, 4, 50, -1)
    assert (answer["target_system"], answer["timestamp"]) == (255, now)
    event, radio = row("event"), row("input_rc")
    assert (event["id"], [event[f"arguments[{n}]"] for n in range(4)]) == (21312348, [3, 0, 2, 1])
    assert (event["event_sequence"], event["log_levels"]) == (2, 0x66)
    assert (radio["values[1]"], radio["values[2]"], radio["channel_count"], radio["input_source"]) == (1100, 0, 2, 6)
    imu = row("sensor_combined")
    assert [imu[f"gyro_rad[{n}]"] for n in range(3)] == pytest.approx([0.1, 0.2, 0.3])
    assert [imu[f"accelerometer_m_s2[{n}]"] for n in range(3)] == pytest.approx([1.0, 2.0, -9.8])
    assert imu["gyro_integral_dt"] == 4000
    assert "[commander] [logger] x\t" in [text.message for text in log.logged_messages]
    assert [(name, value) for _, name, value in log.changed_parameters] == [("MPC_XY_P", 0.5)]
    assert log.initial_parameters["MPC_XY_P"] == pytest.approx(0.95)


def test_changed_parameters_are_logged_until_disarming_with_all_that_are_not_saved(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(0.1)
    rig.parameters.set("MPC_XY_P", 0.5)
    rig.run(0.1)
    rig.parameters.set("COM_FLIGHT_UUID", 3, notify=False)
    rig.run(0.1)
    rig.parameters.set("MPC_Z_P", 0.7)
    rig.run(0.1)
    rig.arm(False)
    rig.run(0.1)
    rig.parameters.set("LND_FLIGHT_T_LO", 9)
    rig.run(2.0)
    changed = rig.read(FIRST).changed_parameters
    assert [name for _, name, _ in changed] == ["MPC_XY_P", "COM_FLIGHT_UUID", "MPC_XY_P", "MPC_Z_P"]


@pytest.mark.parametrize("limit_mib", [1024, 0])
def test_a_log_begins_with_what_was_said_last_before_it(tmp_path: Path, limit_mib: int) -> None:
    """Four texts and sixteen events wait in uORB for a logger that does not read: of its own, if they are as many."""
    rig = Rig(tmp_path, SDLOG_MAX_SIZE=limit_mib)
    for number in range(20):
        rig.texts.say(Severity.INFO, f"text {number}\t", "commander_armed_by", 1.0)
    rig.run(1.0)
    rig.arm()
    rig.texts.say(Severity.INFO, "Armed by external command\t")
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read("2026-01-01/00_00_01.ulg")
    said = [message.message for message in log.logged_messages]
    before = f"[logger] Max log file size: {limit_mib} MiB" if limit_mib else "[commander] Armed by external command\t"
    assert said == [
        before,
        "[logger] Start file log (type: full)",
        "[logger] [logger] ./log/2026-01-01/00_00_01.ulg\t",
        "[logger] Opened full log file: ./log/2026-01-01/00_00_01.ulg",
    ]
    assert log.logged_messages[0].timestamp == pytest.approx(1e6, abs=30_000)
    events = log.get_dataset("event").data
    assert list(events["event_sequence"][:16]) == list(range(6, 22))


def test_a_text_is_logged_at_the_level_of_the_console(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(0.1)
    for severity in (Severity.EMERGENCY, Severity.CRITICAL, Severity.WARNING, Severity.INFO):
        rig.texts.say(severity, severity.name)
    rig.run(1.0)
    rig.logger.shut_down()
    told = {message.message: message.log_level_str() for message in rig.read(FIRST).logged_messages}
    assert [told[f"[commander] {name}"] for name in ("EMERGENCY", "CRITICAL", "WARNING", "INFO")] == [
        "ERROR",
        "WARNING",
        "WARNING",
        "INFO",
    ]
    assert [text.severity for text in rig.texts.recent][-4:-2] == [Severity.EMERGENCY, Severity.CRITICAL]


def test_an_event_that_is_not_for_the_log_leaves_no_gap_in_it(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(0.1)
    for name in ("commander_armed_by", "stick_gesture_disabled_by_arm_switch", "commander_armed_by"):
        arguments = (1.0,) * (name == "commander_armed_by")
        rig.texts.say(Severity.INFO, "", name, *arguments)
        rig.run(0.1)
    rig.logger.shut_down()
    sequence = list(rig.read(FIRST).get_dataset("event").data["event_sequence"])
    assert len(sequence) == 3 and sequence == list(range(sequence[0], sequence[0] + 3)), "the first: the opened file"


def test_numbers_that_do_not_fit_end_nothing(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(0.1)
    rig.topics.vehicle_local_position = VehicleLocalPosition(
        rig.now_us, x=1e300, y=-1e300, z=math.inf, vx=math.nan, xy_reset_counter=257
    )
    tell(rig.topics, rig.now_us, VehicleCommand(-1, 1e300, source_system=256))
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    local, command = (log.get_dataset(name).data for name in ("vehicle_local_position", "vehicle_command"))
    assert (local["x"][-1], local["y"][-1], local["z"][-1]) == (math.inf, -math.inf, math.inf)
    assert math.isnan(local["vx"][-1])
    assert local["xy_reset_counter"][-1] == 1
    assert (command["command"][-1], command["param1"][-1], command["source_system"][-1]) == (0xFFFFFFFF, math.inf, 0)


def test_what_nobody_has_written_is_not_logged(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(3.0)
    rig.logger.shut_down()
    logged = {dataset.name for dataset in rig.read(FIRST).data_list if len(dataset.data["timestamp"])}
    assert "sensor_combined" in logged
    assert not logged & {"vehicle_attitude", "vehicle_local_position", "battery_status", "position_setpoint_triplet"}


def test_what_its_writer_has_not_told_yet_is_not_logged(tmp_path: Path) -> None:
    """MulticopterHoverThrustEstimator::publishInvalidStatus: only what was valid before."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    rig.topics.hover_thrust_estimate = HoverThrustEstimate()
    rig.run(1.0)
    rig.topics.hover_thrust_estimate = HoverThrustEstimate(rig.now_us, 0.5, True)
    rig.run(1.0)
    rig.logger.shut_down()
    assert len(rig.read(FIRST).get_dataset("hover_thrust_estimate").data["timestamp"]) == 1


def test_a_region_of_interest_is_logged_once_there_is_one(tmp_path: Path) -> None:
    """Navigator publishes vehicle_roi on its command alone."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(2.0)
    set_us = rig.now_us
    rig.topics.vehicle_roi = VehicleRoi(3, 47.4, 8.5, 500.0, timestamp=set_us)
    rig.run(2.0)
    rig.logger.shut_down()
    data = rig.read(FIRST).get_dataset("vehicle_roi").data
    assert list(data["timestamp"]) == [set_us] and list(data["lat"]) == [47.4]


def test_a_record_that_stays_is_logged_once(tmp_path: Path) -> None:
    """Of what may come in every tick, too."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    rig.topics.vehicle_attitude = VehicleAttitude(rig.now_us)
    rig.run(1.0)
    rig.logger.shut_down()
    assert len(rig.read(FIRST).get_dataset("vehicle_attitude").data["timestamp"]) == 1


def test_states_are_logged_when_they_change_and_twice_a_second(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2)
    for tick in range(1250):
        armed = tick >= 500
        rig.topics.vehicle_status = VehicleStatus(rig.now_us + TICK_US, armed=armed)
        rig.run(TICK_US * 1e-6)
    rig.logger.shut_down()
    data = rig.read(FIRST).get_dataset("vehicle_status").data
    assert 10 <= len(data["timestamp"]) <= 13
    armed_at_us = data["timestamp"][list(data["arming_state"]).index(2)]
    assert 2_000_000 <= armed_at_us <= 2_120_000


def test_records_without_a_time_are_states() -> None:
    topics = Topics()
    for topic in (*logged_topics.COMMON, *logged_topics.NOT_BY_DEFAULT, *logged_topics.OF_SOME_KINDS):
        assert topic.state or hasattr(topic.record(topics), "timestamp"), topic.name


def test_what_px4_publishes_on_change_alone_is_logged_so(tmp_path: Path) -> None:
    """mission_result (Navigator::publish_mission_result): first as it is, and no more until it changes."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    for seq_reached in (*[MissionResult().seq_reached] * 500, *[3] * 500):
        rig.topics.mission_result = MissionResult(rig.now_us + TICK_US, seq_reached=seq_reached)
        rig.run(TICK_US * 1e-6)
    rig.logger.shut_down()
    data = rig.read(FIRST).get_dataset("mission_result").data
    assert list(data["seq_reached"]) == [MissionResult().seq_reached, 3]


@pytest.mark.parametrize(
    ("profile", "topic", "hz"), [(1, "vehicle_acceleration", 20), (8, "vehicle_acceleration", 250)]
)
def test_profile_gives_the_rates(tmp_path: Path, profile: int, topic: str, hz: int) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_PROFILE=profile)
    rig.run(5.0)
    rig.logger.shut_down()
    count = len(rig.read(FIRST).get_dataset(topic).data["timestamp"])
    assert count / 5.0 == pytest.approx(hz, rel=0.05)


# --- with a whole vehicle ----------------------------------------------------------------------------------


def flown(model: str, root: Path, seconds: float) -> Path:
    """The log of a vehicle that stands and is armed."""
    storage.prepare(root)
    vehicle = vehicles.load(model)
    simulator = VehicleSimulator(vehicle, Home(47.4, 8.5, 490.0, 0.0), seed=3, terrain=FlatGround())
    autopilot, channel = Autopilot(vehicle.airframe, 0, root), MemoryChannel()
    actuators = None
    for _ in range(round(seconds * 250)):
        channel.simulator.send(simulator.tick(actuators))
        channel.autopilot.send(autopilot.step(channel.autopilot.receive()))
        actuators = channel.simulator.receive()
    autopilot.logger.shut_down()
    return root / "log" / autopilot.logger.files[0]


ESTIMATOR_HZ = {
    **dict.fromkeys(("estimator_status", "estimator_states", "estimator_fusion_control"), 100.0),
    **dict.fromkeys((f"estimator_innovation{what}" for what in ("s", "_variances", "_test_ratios")), 100.0),
}
"""As in the logs of PX4's simulation (SIH)."""


@pytest.mark.parametrize("model", ["sihsim_hex", "sihsim_rover_ackermann"])
def test_same_seed_same_log_and_px4s_tools_read_it(tmp_path: Path, model: str) -> None:
    log, again = (flown(model, tmp_path / name, 4.0) for name in ("a", "b"))
    assert log.read_bytes() == again.read_bytes()
    read = ULog(str(log))
    assert not read.file_corruption
    px4 = PX4ULog(read)
    px4.add_roll_pitch_yaw()
    assert px4.get_mav_type() == ("Ground Rover" if "rover" in model else "Hexarotor")
    assert abs(read.get_dataset("vehicle_attitude").data["roll"][-1]) < 0.1
    for topic, interval_us in (("vehicle_attitude", 4_000), ("vehicle_local_position", 8_000)):
        assert np.median(np.diff(read.get_dataset(topic).data["timestamp"])) == interval_us, "each that is told"
    for topic, hz in ESTIMATOR_HZ.items():
        times_us = read.get_dataset(topic).data["timestamp"]
        assert (len(times_us) - 1) / (times_us[-1] - times_us[0]) * 1e6 == pytest.approx(hz, rel=0.02), topic
    convert_ulog2csv(str(log), "vehicle_attitude,vehicle_local_position,battery_status", str(tmp_path), ",", None, None)
    assert len(list(tmp_path.glob("*.csv"))) == 3


def log_of(rover: RoverBody, folder: Path) -> ULog:
    """Of 2 s."""
    logger = Logger(rover.topics, rover.parameters, rover.texts, folder, lambda: BOOT_UNIX_US)
    storage.prepare(folder)
    logger.on()
    for _ in range(20):
        rover.drive(0.1)
        logger.update(rover.now_us)
    logger.shut_down()
    return ULog(str(folder / "log" / logger.files[0]))


def test_a_rovers_log_has_its_controllers_and_no_aircrafts(tmp_path: Path) -> None:
    rover = RoverBody("sihsim_rover_ackermann")
    rover.go((0.0, 0.0), (30.0, 0.0))
    log = log_of(rover, tmp_path)
    names = {data.name for data in log.data_list}
    assert {"pure_pursuit_status", "position_controller_status", "rover_position_setpoint"} < names
    assert {f"rover_{of}_{what}" for of in ("attitude", "rate", "speed") for what in ("setpoint", "status")} < names
    assert not {"vehicle_attitude_setpoint", "vehicle_rates_setpoint", "takeoff_status"} & names
    speed = log.get_dataset("rover_speed_status").data
    assert 15 <= len(speed["timestamp"]) <= 20 and np.isnan(speed["measured_speed_body_y"]).all()
    assert speed["measured_speed_body_x"][-1] == pytest.approx(rover.speed, abs=0.3)
    motors, servos = (log.get_dataset(f"actuator_{kind}").data for kind in ("motors", "servos"))
    assert motors["control[0]"][-1] > 0.1 and set(motors["control[1]"]) == set(servos["control[7]"]) == {0.0}
    assert set(motors["reversible_flags"]) == {1}


def test_a_rovers_log_has_what_an_aircraft_would_have_been_told_in_offboard(tmp_path: Path) -> None:
    """add_topic of logged_topics.cpp asks no kind of vehicle."""
    rover = RoverBody("sihsim_rover_ackermann", NavState.OFFBOARD)
    told = VehicleAttitudeSetpoint(rover.now_us, thrust_body=(0.4, 0.0, 0.0))
    rover.topics.offboard_setpoint = OffboardSetpoint(rover.now_us, attitude=told)
    log = log_of(rover, tmp_path)
    assert log.get_dataset("vehicle_attitude_setpoint").data["thrust_body[0]"][0] == pytest.approx(0.4)
    assert "actuator_outputs" not in {data.name for data in log.data_list}, "no throttle was asked for"


def test_a_log_explains_its_events(tmp_path: Path) -> None:
    """As pyulog and Flight Review look for it: the definitions, in pieces, and their hash."""
    metadata = files.event_definitions()
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.logger = Logger(rig.topics, rig.parameters, rig.texts, tmp_path, lambda: BOOT_UNIX_US, lambda: metadata)
    rig.run(0.1)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    (pieces,) = log.msg_info_multiple_dict["metadata_events"]
    assert b"".join(pieces) == metadata
    assert log.msg_info_dict["metadata_events_sha256"] == hashlib.sha256(metadata).hexdigest()
    assert "components" in json.loads(lzma.decompress(metadata))
