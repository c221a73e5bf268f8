"""Gimbal protocol v2: the autopilot's manager and the device on its wire, on simulated time."""

import itertools
import math
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_ACCEPTED, MAV_RESULT_DENIED, CommandResult
from sitl_emu.autopilot.mavlink.mavlink import Mavlink, Modules
from sitl_emu.autopilot.payload.gimbal import Gimbal as GimbalManager
from sitl_emu.autopilot.topics import (
    GimbalDeviceInformation,
    VehicleAttitude,
    VehicleCommand,
    VehicleGlobalPosition,
    VehicleRoi,
)
from sitl_emu.components.gimbal import Gimbal
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import euler, quaternion
from tests.typed import present

from .mavlink_peer import GIMBAL, Peer, command_long, only

CONFIGURE, PITCHYAW, MOUNT_CONTROL, REQUEST_MESSAGE, SET_INTERVAL = 1001, 1000, 205, 512, 511
DATA = present(vehicles.load("m600").gimbal)
assert DATA is not None
RATE_DEG_S = DATA.rate_max_deg_s


class Rig(Peer):
    """An autopilot whose gimbal manager runs, a gimbal on its wire, and a ground station."""

    def __init__(self, mode: int = 4, *, with_gimbal: bool = True) -> None:
        """`with_gimbal`: whether it is there from power-on; else `plug_in_gimbal` does it."""
        super().__init__(self.decide)
        self.parameters.set("MNT_MODE_IN", mode)
        self.parameters.set("MNT_MODE_OUT", 2)
        outgoing = OutgoingCommands()
        self.manager = GimbalManager(self.topics, self.parameters, outgoing)
        self.mavlink = Mavlink(
            self.topics, self.parameters, self.dataman, self.texts, Modules(self.decide), 0, outgoing=outgoing
        )
        if with_gimbal:
            self.plug_in_gimbal()
        self.fly()
        self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        self.run(1.5)

    def plug_in_gimbal(self) -> None:
        self.mavlink.plug_in("gimbal device", "gimbal", Gimbal(DATA, system_id=1))

    def decide(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        if command.command in self.manager.COMMANDS:
            return self.manager.handle_command(now_us, command)
        return CommandResult(MAV_RESULT_ACCEPTED)

    def run(self, seconds: float, link: int = 0) -> list[Any]:
        messages = []
        for _ in range(round(seconds / 0.02)):
            self.manager.update(self.now_us)
            messages += super().run(0.02, link)
        return messages

    def ask(self, number: int, *params: float) -> int | None:
        padded = params + (0.0,) * (7 - len(params))
        said = self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *padded))
        acks = only(said, "COMMAND_ACK")
        return acks[0].result if acks else None

    def take_control(self) -> None:
        assert self.ask(CONFIGURE, 255, 190, -1, -1) == MAV_RESULT_ACCEPTED

    def looks(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw in degrees, as the device tells."""
        status = only(self.run(0.3), "GIMBAL_DEVICE_ATTITUDE_STATUS")[-1]
        roll, pitch, yaw = euler(tuple(status.q))
        return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)


def test_the_manager_finds_the_device_and_tells_its_stops() -> None:
    rig = Rig()
    assert rig.topics.gimbal_device_information.gimbal_device_id == 154
    said = rig.send(mavlink.MAVLink_command_long_message(1, 1, REQUEST_MESSAGE, 0, 280, 0, 0, 0, 0, 0, 0))
    information = only(said, "GIMBAL_MANAGER_INFORMATION")[0]
    assert information.gimbal_device_id == 154
    assert math.degrees(information.pitch_min) == pytest.approx(DATA.pitch_min_deg)
    assert information.cap_flags == rig.topics.gimbal_device_information.cap_flags != 0
    assert (information.roll_min, information.roll_max) == (0.0, 0.0), "PX4 does not take them from the device"


def test_a_gimbal_looks_down_until_it_is_told_otherwise() -> None:
    assert Rig().looks()[1] == pytest.approx(-90.0, abs=0.1)


def test_only_who_is_in_primary_control_points_it() -> None:
    rig = Rig()
    assert rig.ask(PITCHYAW, -30, 20, math.nan, math.nan) == MAV_RESULT_DENIED
    rig.take_control()
    status = only(rig.run(2.5), "GIMBAL_MANAGER_STATUS")[-1]
    assert (status.primary_control_sysid, status.primary_control_compid) == (255, 190)
    assert rig.ask(PITCHYAW, -30, 20, math.nan, math.nan) == MAV_RESULT_ACCEPTED
    rig.run(2.0)
    assert rig.looks() == pytest.approx((0.0, -30.0, 20.0), abs=0.1)
    assert rig.ask(CONFIGURE, -3, -3, -1, -1) == MAV_RESULT_ACCEPTED
    assert rig.ask(PITCHYAW, 0, 0, math.nan, math.nan) == MAV_RESULT_DENIED


def test_it_moves_no_faster_than_its_motors() -> None:
    rig = Rig()
    rig.take_control()
    rig.ask(PITCHYAW, 0, 0, math.nan, math.nan)
    pitches = [
        (m.time_boot_ms, math.degrees(euler(tuple(m.q))[1]))
        for m in only(rig.run(1.5), "GIMBAL_DEVICE_ATTITUDE_STATUS")
    ]
    for (t0, p0), (t1, p1) in itertools.pairwise(pitches):
        assert abs(p1 - p0) <= RATE_DEG_S * (t1 - t0) / 1e3 + 0.01
    assert pitches[3][1] < -30.0
    assert pitches[-1][1] == pytest.approx(0.0, abs=0.1)


def test_where_it_looks_at_a_moment_is_what_it_tells_then_and_asking_moves_nothing() -> None:
    gimbal = Gimbal(DATA, system_id=1)
    told: Any = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    point = mavlink.MAVLink_gimbal_device_set_attitude_message(1, 154, 0, quaternion(0.0, -0.5, 0.3), 0, 0, 0)
    gimbal.on_time(0)
    gimbal.on_datagram(0, bytes(point.pack(told)))
    looks = [gimbal.looks(time_us) for time_us in range(0, 1_000_001, 4000)]
    assert looks[0] == quaternion(0.0, math.radians(-90.0), 0.0)
    assert math.degrees(euler(looks[25])[1]) == pytest.approx(-90.0 + RATE_DEG_S * 0.1, abs=0.01), "a step every 4 ms"
    assert looks[-1] == pytest.approx(quaternion(0.0, -0.5, 0.3))
    gimbal.outbox.clear()
    gimbal.on_time(100_000)
    status = next(
        message
        for data in gimbal.outbox
        for message in told.parse_buffer(bytearray(data))
        if message.get_msgId() == 285
    )
    assert tuple(status.q) == pytest.approx(looks[25])


def test_a_locked_gimbals_yaw_is_told_against_the_heading() -> None:
    gimbal = Gimbal(DATA, system_id=1)
    told: Any = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)

    def hear(message: Any) -> None:
        gimbal.on_datagram(0, bytes(message.pack(told)))

    def heads(yaw: float) -> Any:
        zeros = (0.0,) * 3
        return mavlink.MAVLink_autopilot_state_for_gimbal_device_message(
            1, 154, 0, quaternion(0.0, 0.0, yaw), 0, *zeros, 0, 0.0, 0, 2
        )

    hear(heads(0.5))
    hear(mavlink.MAVLink_gimbal_device_set_attitude_message(1, 154, 16, quaternion(0.0, -0.5, 0.3), 0, 0, 0))
    assert euler(gimbal.looks(2_000_000))[2] == pytest.approx(0.3 - 0.5)
    hear(heads(0.9))
    assert euler(gimbal.looks(2_000_000))[2] == pytest.approx(0.3 - 0.9), "the vehicle turns, the gimbal does not"


def test_what_is_for_another_component_it_leaves_unanswered() -> None:
    """InputMavlinkGimbalV2::_process_command; the autopilot's own modes ask by the system's number (Gimbal.cpp)."""
    rig = Rig()
    for component, result in (
        (2, None),
        (1, CommandResult(MAV_RESULT_ACCEPTED)),
        (0, CommandResult(MAV_RESULT_ACCEPTED)),
    ):
        asked = VehicleCommand(
            CONFIGURE, 2.0, 1.0, -1.0, -1.0, source_system=2, source_component=1, target_component=component
        )
        assert rig.decide(rig.now_us, asked) == result


def turn(pitch_rate: float, yaw_rate: float) -> Any:
    """Rates without an attitude."""
    q = (math.nan,) * 4
    return mavlink.MAVLink_gimbal_manager_set_attitude_message(1, 1, 0, 0, q, 0.0, pitch_rate, yaw_rate)


def test_what_the_device_is_told() -> None:
    """OutputMavlinkV2::_publish_gimbal_device_set_attitude, from what InputMavlinkGimbalV2 makes of commands."""
    rig, nan = Rig(), math.nan
    rig.take_control()

    def told() -> tuple[Any, Any, Any]:
        rig.manager.update(rig.now_us)
        wanted = rig.topics.gimbal_device_set_attitude
        return wanted.flags, tuple(round(math.degrees(angle)) for angle in euler(wanted.q)), wanted.angular_velocity

    wanted = rig.topics.gimbal_device_set_attitude
    assert (wanted.target_component, wanted.flags) == (154, 4 | 8 | 32), "roll and pitch locked, yaw with the vehicle"
    assert all(math.isnan(value) for value in (*wanted.q, *wanted.angular_velocity))
    rig.ask(PITCHYAW, -30, 20, nan, nan, 0)
    assert told()[:2] == (32, (0, -30, 20))
    rig.ask(PITCHYAW, -30, 20, nan, nan, 16)
    assert told()[:2] == (16 | 64, (0, -30, 20)), "against north"
    rig.ask(PITCHYAW, nan, 45, 0, nan, 12)
    flags, angles, rates = told()
    assert (flags, angles) == (4 | 8 | 32, (0, 0, 45)), "no pitch is one of 0"
    assert math.isnan(rates[0]) and rates[1] == 0.0 and math.isnan(rates[2])
    rig.ask(MOUNT_CONTROL, -10.0, 0, 200.0, 0, 0, 0, 2)
    assert told()[:2] == (4 | 8 | 32, (0, -10, -160))
    assert rig.topics.gimbal_device_set_attitude.q == pytest.approx(
        quaternion(0.0, math.radians(-10), math.radians(-160))
    )
    rig.ask(204, 2, 0, 0, 0, 0, 1, 2)
    assert told()[:2] == (8 | 16 | 64, (0, -10, -160)), "body, as it was, and north"
    rig.ask(MOUNT_CONTROL, 0, 0, 0, 0, 0, 0, mavlink.MAV_MOUNT_MODE_NEUTRAL)
    assert told()[:2] == (32, (0, 0, 0))


def test_rates_that_nobody_renews_end_after_two_seconds() -> None:
    """OutputBase::check_and_handle_setpoint_timeout."""
    rig = Rig()
    rig.take_control()
    rig.send(turn(0.1, 0.2))
    rig.run(1.9)
    assert rig.topics.gimbal_device_set_attitude.angular_velocity == pytest.approx((0.0, 0.1, 0.2))
    rig.run(0.2)
    assert rig.topics.gimbal_device_set_attitude.angular_velocity == (0.0, 0.0, 0.0)


def test_of_manual_control_both_rates_are_wanted_or_neither_whatever_the_target() -> None:
    rig, nan = Rig(), math.nan
    rig.take_control()
    for rates, turns in (((0.5, 0.5), True), ((0.5, nan), False)):
        rig.send(mavlink.MAVLink_gimbal_manager_set_manual_control_message(7, 9, 0, 0, nan, nan, *rates))
        rig.run(0.1)
        told = rig.topics.gimbal_device_set_attitude.angular_velocity
        assert [math.isfinite(rate) for rate in told] == [turns] * 3


def test_before_a_gimbal_is_found_nobody_is_told_where_to_look() -> None:
    rig = Rig()
    rig.topics.gimbal_device_information = GimbalDeviceInformation()
    for _ in range(3):
        rig.manager.update(rig.now_us)
    assert rig.topics.gimbal_device_set_attitude.target_component == 0


def test_a_fixed_gimbal_looks_where_its_parameter_says_and_obeys_nobody() -> None:
    """MNT_MODE_IN 5: against north and the horizon (input_fixed.cpp)."""
    rig = Rig(5)
    assert rig.ask(CONFIGURE, 255, 190, -1, -1) is None
    for pitch_deg in (0.0, -35.0):
        rig.parameters.set("MNT_FIXED_PITCH", pitch_deg)
        rig.run(0.1)
        wanted = rig.topics.gimbal_device_set_attitude
        assert wanted.q == pytest.approx(quaternion(0.0, math.radians(pitch_deg), 0.0))
        assert wanted.flags == 4 | 8 | 16 | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
        assert all(math.isnan(rate) for rate in wanted.angular_velocity)


def test_the_manager_tells_when_it_found_the_device() -> None:
    rig = Rig()
    for _ in range(2):
        rig.run(1.0)
        (told,) = only(rig.send(command_long(REQUEST_MESSAGE, 280)), "GIMBAL_MANAGER_INFORMATION")
        assert told.time_boot_ms == 40


def test_what_any_component_says_of_its_gimbal_is_told_again() -> None:
    """Without a gimbal manager as well (handle_message_gimbal_device_information)."""
    peer = Peer(system=7, component=171)
    peer.now_us = 5_000_000
    peer.send(
        mavlink.MAVLink_gimbal_device_information_message(
            1, b"ACME", b"MODEL", b"CUSTOM", 3, 4, 5, 127, 9, -0.1, 0.1, -1.5, 0.5, -3.0, 3.0
        ),
        GIMBAL,
    )
    heard = only(peer.send(command_long(REQUEST_MESSAGE, 283)), "GIMBAL_DEVICE_INFORMATION")[0]
    assert (heard.vendor_name, heard.model_name, heard.custom_name) == ("ACME", "MODEL", "CUSTOM")
    assert (heard.time_boot_ms, heard.firmware_version, heard.hardware_version, heard.uid) == (5000, 3, 4, 5)
    assert (heard.cap_flags, heard.custom_cap_flags, heard.gimbal_device_id) == (127, 0, 171)
    assert (heard.roll_min, heard.roll_max, heard.pitch_min, heard.yaw_max) == (0.0, 0.0, -1.5, 3.0)
    assert not only(peer.send(command_long(REQUEST_MESSAGE, 280)), "GIMBAL_MANAGER_INFORMATION")


def test_the_message_of_pitch_and_yaw_moves_nothing() -> None:
    """PX4 v1.18 takes the command alone (mavlink_receiver.cpp)."""
    rig = Rig()
    rig.take_control()
    rig.run(1.0)
    before = rig.looks()
    rig.send(mavlink.MAVLink_gimbal_manager_set_pitchyaw_message(1, 1, 0, 0, -0.1, 0.5, math.nan, math.nan))
    rig.run(1.0)
    assert rig.looks() == pytest.approx(before, abs=0.01)


def test_how_often_it_tells_its_attitude_can_be_chosen_and_stopped() -> None:
    rig = Rig()
    for interval_us, count in ((-1, 0), (0, 10), (200_000, 5), (-1, 0)):
        acks = only(rig.send(command_long(SET_INTERVAL, 285, interval_us, target=(1, 154))), "COMMAND_ACK")
        assert [ack.result for ack in acks] == [MAV_RESULT_ACCEPTED]
        rig.run(0.1)
        told = rig.run(1.0)
        assert len(only(told, "GIMBAL_DEVICE_ATTITUDE_STATUS")) == count
        assert [beat.get_srcComponent() for beat in only(told, "HEARTBEAT")].count(154) == 1


def test_it_stops_at_its_stops() -> None:
    rig = Rig()
    rig.take_control()
    for _ in range(3):  # one that is not renewed ends after two seconds
        rig.send(turn(1.0, 0.0))
        rig.run(1.7)
    assert rig.looks()[1] == pytest.approx(DATA.pitch_max_deg, abs=0.1)


def test_rates_turn_it_and_zero_rates_hold_it() -> None:
    rig = Rig()
    rig.take_control()
    rig.ask(PITCHYAW, 0, 0, math.nan, math.nan)
    rig.run(2.0)
    rig.send(turn(0.0, math.radians(10)))
    rig.run(2.0)
    rig.send(turn(0.0, 0.0))
    yaw = rig.looks()[2]
    assert yaw == pytest.approx(20.0, abs=2.0)
    rig.run(1.0)
    assert rig.looks()[2] == pytest.approx(yaw, abs=1.1)


def test_manual_control_is_scaled_by_the_rate_parameters() -> None:
    rig = Rig()
    rig.take_control()
    rig.ask(PITCHYAW, 0, 0, math.nan, math.nan)
    rig.run(2.0)
    rig.parameters.set("MNT_RATE_YAW", 20.0)
    rig.send(mavlink.MAVLink_gimbal_manager_set_manual_control_message(1, 1, 0, 0, math.nan, math.nan, 0.0, 0.5))
    rig.run(2.0)
    assert rig.looks()[2] == pytest.approx(22.0, abs=2.5)


def test_with_yaw_lock_it_keeps_north_while_the_vehicle_turns() -> None:
    rig = Rig()
    rig.take_control()
    rig.topics.vehicle_attitude = VehicleAttitude(0, quaternion(0.0, 0.0, 1.0))
    flags = mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
    level = (1.0, 0.0, 0.0, 0.0)
    rig.send(mavlink.MAVLink_gimbal_manager_set_attitude_message(1, 1, flags, 0, level, *(math.nan,) * 3))
    rig.run(3.0)
    assert rig.looks()[2] == pytest.approx(0.0, abs=0.2)
    rig.topics.vehicle_attitude = VehicleAttitude(0, quaternion(0.0, 0.0, 2.0))
    rig.run(1.0)
    assert rig.looks()[2] == pytest.approx(0.0, abs=0.2)


def test_a_region_of_interest_needs_no_control() -> None:
    rig = Rig()
    here = VehicleGlobalPosition(0, 0, 47.0, 8.0, 520.0, 520.0, True, True)
    rig.topics.vehicle_global_position = here
    # 20 m east, 20 m below
    rig.topics.vehicle_roi = VehicleRoi(3, 47.0, 8.0 + 20.0 / (111_195.0 * math.cos(math.radians(47.0))), 500.0)
    rig.run(3.0)
    assert rig.looks() == pytest.approx((0.0, -45.0, 90.0), abs=0.2)
    rig.topics.vehicle_global_position = here._replace(alt=560.0)
    rig.run(1.0)
    assert rig.looks()[1] == pytest.approx(-45.0, abs=0.2), "PX4 aims when it is told to, not as the vehicle moves"
    rig.topics.vehicle_roi = VehicleRoi(2)  # a waypoint's index: PX4 knows nothing about it
    rig.run(1.0)
    assert rig.looks()[1] == pytest.approx(-45.0, abs=0.2)
    rig.topics.vehicle_roi = VehicleRoi()
    rig.run(3.0)
    assert rig.looks()[1] == pytest.approx(0.0, abs=0.2)


def test_the_old_mount_command_still_points_it() -> None:
    rig = Rig()
    assert rig.ask(MOUNT_CONTROL, -40.0, 0, 15.0, 0, 0, 0, 2) == MAV_RESULT_ACCEPTED
    rig.run(2.0)
    assert rig.looks() == pytest.approx((0.0, -40.0, 15.0), abs=0.2)


def test_nonsense_makes_no_nonsense() -> None:
    rig = Rig()
    rig.take_control()
    for value in (math.nan, math.inf, -1e30, 1e30):
        rig.ask(PITCHYAW, *(value,) * 7)
        rig.ask(MOUNT_CONTROL, *(value,) * 7)
        rig.ask(1001, *(value,) * 7)
        q = (value,) * 4
        rig.send(mavlink.MAVLink_gimbal_manager_set_attitude_message(1, 1, 0, 0, q, value, value, value))
        rig.run(0.1)
    rig.topics.vehicle_roi = VehicleRoi(3, math.nan, math.inf, math.nan)
    assert all(math.isfinite(angle) for angle in rig.looks())
