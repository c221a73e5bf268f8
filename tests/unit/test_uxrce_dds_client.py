"""What goes to ROS 2: what is new, no oftener than PX4's list says, with times of the other side's clock."""

import importlib.util
import math
import socket
from collections import Counter
from typing import Any

import pytest

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import (
    AuxGlobalPosition,
    DistanceSensorSample,
    OdometryVariances,
    PositionSetpoint,
    PositionSetpointTriplet,
    SensorCombined,
    Topics,
    VehicleAttitude,
    VehicleCommand,
    VehicleLocalPosition,
    VehicleStatus,
)
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import PUBLICATIONS, REPLY, REQUEST, Sample
from sitl_emu.autopilot.uxrce_dds_client.subscriptions import Subscriptions
from sitl_emu.autopilot.uxrce_dds_client.uxrce_dds_client import UxrceDdsClient
from sitl_emu.core import attitude
from sitl_emu.run import dds_socket
from sitl_emu.run.dds_socket import DdsSocket, packet, samples
from sitl_emu.run.trouble import Trouble
from sitl_emu.vehicles import load

TICK_US = 4000
BOOT_UNIX_US = 1_700_000_000_000_000


class Heard:
    """A client whose samples are read."""

    def __init__(self) -> None:
        self.autopilot = Autopilot(load("iris").airframe, 2)
        self.autopilot.mavlink.context.boot_unix_us = BOOT_UNIX_US
        self.client: UxrceDdsClient = self.autopilot.start_uxrce_dds_client()
        self.topics = self.autopilot.topics
        self.now_us = 1_000_000

    def update(self, ticks: int = 1, each: Any = None) -> list[tuple[str, dict[str, Any]]]:
        """Samples of so many ticks, by topic; `each` is called before a tick."""
        heard = []
        for _ in range(ticks):
            self.now_us += TICK_US
            if each is not None:
                each(self.now_us)
            self.client.update(self.now_us)
            for number, data in self.client.outbox:
                assert number != REPLY
                topic = PUBLICATIONS[number]
                assert len(data) == cdr.size(topic.type)
                heard.append((topic.name, cdr.Reader(topic.type).read(data)))
            self.client.outbox.clear()
        return heard


def test_what_nobody_has_written_is_not_told() -> None:
    told = {name for name, _ in Heard().update(10)}
    assert told == {"failsafe_flags"}  # of whose record nobody can see whether it was written


def test_no_topic_comes_oftener_than_the_list_says() -> None:
    heard = Heard()

    def write(now_us: int) -> None:
        heard.topics.sensor_combined = SensorCombined(now_us)
        heard.topics.vehicle_attitude = VehicleAttitude(now_us)
        heard.topics.vehicle_local_position = VehicleLocalPosition(now_us)

    counts = Counter(name for name, _ in heard.update(1000, write))  # 4 s
    assert counts["sensor_combined"] == 1000
    assert counts["vehicle_odometry"] in (400, 401)
    assert counts["vehicle_attitude"] == counts["vehicle_local_position"] in (200, 201)


def test_a_state_comes_when_it_changes_and_twice_a_second() -> None:
    heard = Heard()
    heard.update(50)
    heard.topics.vehicle_status = VehicleStatus(heard.now_us)

    def repeat(now_us: int) -> None:
        heard.topics.vehicle_status = heard.topics.vehicle_status._replace(timestamp=now_us)

    assert Counter(name for name, _ in heard.update(500, repeat))["vehicle_status"] == 4
    heard.update(60, repeat)
    heard.topics.vehicle_status = heard.topics.vehicle_status._replace(nav_state=NavState.OFFBOARD)
    ((_, fields),) = [each for each in heard.update() if each[0] == "vehicle_status"]
    assert (fields["nav_state"], fields["system_id"], fields["arming_state"]) == (14, 3, 1)


def test_times_are_those_of_the_other_side() -> None:
    heard = Heard()
    heard.topics.vehicle_local_position = VehicleLocalPosition(1_000_000, 996_000, ref_timestamp=7)
    told = dict(heard.update())
    assert told["vehicle_local_position"]["timestamp"] == BOOT_UNIX_US + 1_000_000
    assert told["vehicle_local_position"]["timestamp_sample"] == BOOT_UNIX_US + 996_000
    assert told["vehicle_local_position"]["ref_timestamp"] == 7
    assert told["failsafe_flags"]["timestamp"] == BOOT_UNIX_US + heard.now_us


def test_times_of_messages_within_are_left_alone() -> None:
    """As in PX4's ucdr_serialize: it moves the message's own."""
    heard = Heard()
    heard.topics.position_setpoint_triplet = PositionSetpointTriplet(
        5, current=PositionSetpoint(timestamp=4, valid=True)
    )
    told = dict(heard.update())["position_setpoint_triplet"]
    assert told["timestamp"] == BOOT_UNIX_US + 5
    assert (told["current.timestamp"], told["current.valid"], told["next.valid"]) == (4, True, False)


def test_the_clock_of_the_other_side_is_followed() -> None:
    client = Heard().client
    client.synchronize(1_000_000, BOOT_UNIX_US + 1_000_000 + 30_000_000)
    assert client.time_offset_us == BOOT_UNIX_US + 30_000_000
    client.synchronize(1_004_000, BOOT_UNIX_US + 1_004_000 + 30_050_000)  # a late look is no new clock
    assert 0 < client.time_offset_us - BOOT_UNIX_US - 30_000_000 < 1000
    client.synchronize(1_008_000, BOOT_UNIX_US)
    assert client.time_offset_us == BOOT_UNIX_US - 1_008_000


def test_the_offset_is_told_once_a_second() -> None:
    heard = Heard()
    heard.update()

    def look(now_us: int) -> None:
        heard.client.synchronize(now_us, BOOT_UNIX_US + now_us)

    told = [fields for name, fields in heard.update(500, look) if name == "timesync_status"]
    assert [fields["estimated_offset"] for fields in told] == [-BOOT_UNIX_US] * 2
    assert told[1]["timestamp"] - told[0]["timestamp"] == 1_000_000
    assert all(fields["remote_timestamp"] == fields["timestamp"] for fields in told)


def test_every_answer_to_a_command_is_told() -> None:
    heard = Heard()
    heard.update()
    for number, result in ((22, 0), (400, 1)):
        command = VehicleCommand(number, source_system=255, source_component=190)
        tell(heard.topics, heard.now_us, command)
        tell(heard.topics, heard.now_us, command, CommandResult(result))
    acks = [fields for name, fields in heard.update() if name == "vehicle_command_ack"]
    assert [(ack["command"], ack["result"]) for ack in acks] == [(22, 0), (400, 1)]
    assert {(ack["target_system"], ack["target_component"]) for ack in acks} == {(255, 190)}


def test_an_attitude_s_variances_are_told_about_the_body_s_axes() -> None:
    """Turned to the right, forward is east; on its right side, what is down is to its right."""
    heard = Heard()
    variances = (1e-4, 2e-4, 4e-4)
    heard.topics.odometry_variances = OdometryVariances(1, variances)
    told = []
    for angles in ((0.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2), (math.pi / 2, 0.0, 0.0)):
        heard.topics.vehicle_attitude = VehicleAttitude(heard.now_us, attitude.quaternion(*angles))
        heard.topics.vehicle_local_position = VehicleLocalPosition(heard.now_us)
        told += [fields["orientation_variance"] for name, fields in heard.update(3) if name == "vehicle_odometry"]
    assert told == [pytest.approx(each) for each in (variances, (2e-4, 1e-4, 4e-4), (1e-4, 4e-4, 2e-4))]


class Service:
    """The vehicle_command service of a client; who asks is told from who else by 16 bytes."""

    def __init__(self, heard: Heard) -> None:
        self.heard = heard

    def ask(self, asked: bytes, command: int, target_system: int = 3) -> None:
        """A request."""
        data = cdr.Writer("VehicleCommand").write(command=command, target_system=target_system)
        self.heard.client.on_sample(self.heard.now_us, Sample(REQUEST, asked.ljust(16) + data))

    def replies(self) -> list[tuple[bytes, int, int]]:
        """Who was answered, which command, with which result."""
        self.heard.client.update(self.heard.now_us)
        told = [data for number, data in self.heard.client.outbox if number == REPLY]
        self.heard.client.outbox.clear()
        acks = [(data[:16].strip(), cdr.Reader("VehicleCommandAck").read(data[16:])) for data in told]
        assert all(ack["timestamp"] == BOOT_UNIX_US + self.heard.now_us for _, ack in acks)
        return [(asked, ack["command"], ack["result"]) for asked, ack in acks]


def test_a_distance_is_that_of_the_first_sensor_whoever_that_is() -> None:
    """DDS has no instance of its own (dds_topics.h.em: uORB::Publication)."""
    topics = Topics()
    handlers = Subscriptions(topics, 1, lambda _now, _command: None, lambda _now, _reply: None).handlers
    fields: dict[str, Any] = {
        "min_distance": 0.2,
        "max_distance": 12.0,
        "orientation": 25,
        "signal_quality": -1,
        "h_fov": 0.0,
    }
    fields |= {"type": 0, "variance": 0.0, "v_fov": 0.0, "q": (0.0,) * 4, "timestamp": 1, "device_id": 1}
    of_links = tuple(DistanceSensorSample(1, 1.0, publisher=name) for name in ("gcs", "onboard"))
    topics.distance_sensors_outside = of_links
    handlers["distance_sensor"](1, fields | {"current_distance": 2.0})
    assert [(each.publisher, each.current_distance) for each in topics.distance_sensors_outside] == [
        ("gcs", 2.0),
        ("onboard", 1.0),
    ]
    topics.distance_sensor = DistanceSensorSample(1, 1.0)
    handlers["distance_sensor"](1, fields | {"current_distance": 3.0})
    assert topics.distance_sensor.current_distance == 3.0


def test_four_ids_of_positions_are_heard_beside_those_of_links() -> None:
    """dds_topics.yaml: route_field and max_instances of aux_global_position."""
    topics = Topics()
    handlers = Subscriptions(topics, 1, lambda _now, _command: None, lambda _now, _reply: None).handlers
    topics.aux_global_position = (AuxGlobalPosition(1, 1, 7, 47.0, 8.0, publisher="gcs"),)
    fields = dict.fromkeys(("lat", "lon", "alt", "eph", "epv"), 1.0) | {"lat_lon_reset_counter": 0, "source": 0}
    for number in (1, 2, 3, 4, 5, 1):
        handlers["aux_global_position"](1, fields | {"id": number, "timestamp": 1, "timestamp_sample": 1})
    assert [each.id for each in topics.aux_global_position] == [7, 1, 2, 3, 4]


def test_a_request_of_the_service_is_a_command_and_its_answer_the_reply() -> None:
    heard = Heard()
    service = Service(heard)
    service.ask(b"one", 31000)
    assert service.replies() == [(b"one", 31000, 3)]
    assert service.replies() == []


def test_the_newest_request_alone_is_answered_and_by_an_answer_of_its_own_time() -> None:
    heard = Heard()
    service = Service(heard)
    tell(heard.topics, heard.now_us, VehicleCommand(31001), CommandResult(2))
    service.ask(b"one", 31000)
    service.ask(b"two", 31001)
    assert service.replies() == [(b"two", 31001, 3)]
    service.ask(b"three", 31001, target_system=9)
    assert service.replies() == []
    tell(heard.topics, heard.now_us, VehicleCommand(31001), CommandResult(4))  # of somebody else: PX4 can't tell either
    assert service.replies() == [(b"three", 31001, 4)]


def test_a_request_that_is_too_short_is_none() -> None:
    heard = Heard()
    heard.client.on_sample(heard.now_us, Sample(REQUEST, b"x" * (16 + cdr.size("VehicleCommand") - 1)))
    heard.client.on_sample(heard.now_us, Sample(REQUEST, b""))
    assert Service(heard).replies() == []


def test_samples_pass_a_socket() -> None:
    told = [Sample(3, b"abc"), Sample(20, b"")]
    assert list(samples(packet(told))) == told
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours, outbox = DdsSocket(left), list(told)
    with right:
        ours.send(outbox)
        assert outbox == []
        assert list(samples(right.recv(100))) == told
        right.send(packet(told))
        right.send(packet(told[:1]))
        assert ours.receive() == [*told, told[0]]
        assert ours.receive() == []
    ours.close()


def test_an_agent_that_has_gone_is_told_of_once(capsys: Any) -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours = DdsSocket(left)
    right.close()
    for _ in range(2):
        ours.send([Sample(0, b"x")])
        assert ours.receive() == []
    assert ours.lost
    assert capsys.readouterr().err.count("DDS agent has ended") == 1
    ours.close()


def test_what_an_agent_does_not_take_in_time_is_lost() -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours = DdsSocket(left)
    with right:
        for _ in range(1000):
            ours.send([Sample(0, bytes(1000))])
        assert not ours.lost
    ours.close()


def test_a_domain_that_there_is_not_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for told, domain in ((None, 0), ("", 0), ("42", 42)):
        if told is None:
            monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
        else:
            monkeypatch.setenv("ROS_DOMAIN_ID", told)
        assert dds_socket.domain() == domain
    for told in ("233", "-1", "five"):
        monkeypatch.setenv("ROS_DOMAIN_ID", told)
        with pytest.raises(Trouble, match=f"ROS_DOMAIN_ID={told}: give 0 to 232"):
            dds_socket.domain()


def test_without_cyclone_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(Trouble, match=r"pip install 'sitl-emu\[ros2\]'"):
        dds_socket.check(1)


def test_a_namespace_is_one_s_own_or_of_the_instance_s_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: True)
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    monkeypatch.delenv("PX4_UXRCE_DDS_NS", raising=False)
    assert [dds_socket.namespace(instance) for instance in (0, 3)] == ["", "px4_3"]
    dds_socket.check(2)
    for told in ("scout", ""):
        monkeypatch.setenv("PX4_UXRCE_DDS_NS", told)
        assert dds_socket.namespace(3) == told
        dds_socket.check(1)
        with pytest.raises(Trouble, match="PX4_UXRCE_DDS_NS is one vehicle's namespace, and there are 2 vehicles"):
            dds_socket.check(2)
