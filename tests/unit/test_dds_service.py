"""The vehicle_command service as a node on rmw_cyclonedds finds it: its requests and replies by types told by hand.

Client and service are two participants on a domain that nobody outside this machine hears of.
"""

import functools
import os
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, VEHICLE_COMMAND, service_names
from tests import dds

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from sitl_emu.run import dds_types
from sitl_emu.run.dds_service import OfferedService

DOMAIN = 120 + os.getpid() % 80
LIMIT_S = 10.0
until = functools.partial(dds.until, limit_s=LIMIT_S)
MARK = "clientid=1.2.{};typehash=RIHS01_00;"
"""Of a client, in the user data of its writer and of its reader."""
ASKED = {"guid": types.uint64, "seq": types.int64}
REQUEST_TYPE = make_idl_struct(
    "Request",
    "px4_msgs.srv.dds_.VehicleCommand_Request_",
    {**ASKED, "request": dds_types.described("VehicleCommand")},
)
REPLY_TYPE = make_idl_struct(
    "Response",
    "px4_msgs.srv.dds_.VehicleCommand_Response_",
    {**ASKED, "reply": dds_types.described("VehicleCommandAck")},
)


def qos(told: str) -> Qos:
    mark = Policy.Userdata(told.encode())
    services_default = (Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    return Qos(*services_default, mark, Policy.DataRepresentation(use_cdrv0_representation=True))


class Client:
    """A node's client, as rmw_cyclonedds makes it; several may share a process."""

    def __init__(self, participant: DomainParticipant, number: int, mark: str = MARK, within: str = "px4_3") -> None:
        self.guid, quality = 1000 + number, qos(mark.format(number))
        request, reply = service_names(VEHICLE_COMMAND, within)
        self.writer = DataWriter(participant, Topic(participant, request, REQUEST_TYPE), qos=quality)
        self.reader = DataReader(participant, Topic(participant, reply, REPLY_TYPE), qos=quality)

    def wait_for_service(self) -> None:
        """As rclpy's."""
        until(lambda: bool(self.writer.get_matched_subscriptions() and self.reader.get_matched_publications()))

    def ask(self, sequence: int, **fields: Any) -> None:
        """Send a request."""
        self.writer.write(REQUEST_TYPE(self.guid, sequence, command(**fields)))

    def replies(self) -> list[Any]:
        """What came for this client."""
        return [each for each in self.reader.take(10) if each.guid == self.guid]


def command(**fields: Any) -> Any:
    zeros = {name: 0.0 if kind.startswith("float") else 0 for kind, name in FIELDS}
    return dds_types.described("VehicleCommand")(**(zeros | {"from_external": False} | fields))


FIELDS = [(kind, name) for kind, _, name in MESSAGES["VehicleCommand"].fields if name != "from_external"]


def taken(service: OfferedService) -> bytes:
    """The next request."""
    found = list[bytes]()

    def take() -> bool:
        found.extend(service.take())
        return bool(found)

    until(take)
    return found[0]


@pytest.fixture
def participants(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[DomainParticipant, DomainParticipant]]:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    yield DomainParticipant(DOMAIN), DomainParticipant(DOMAIN)


def ack(**fields: Any) -> bytes:
    return cdr.Writer("VehicleCommandAck").write(**fields)


def test_a_request_is_read_and_answered(participants: tuple[DomainParticipant, DomainParticipant]) -> None:
    service = OfferedService(participants[0], VEHICLE_COMMAND, "px4_3")
    client, other = Client(participants[1], 1), Client(participants[1], 2)
    client.wait_for_service()
    client.ask(7, command=400, param1=1.0, target_system=4)
    request = taken(service)
    assert request[:16] == (1001).to_bytes(8, "little") + (7).to_bytes(8, "little")
    fields = cdr.Reader("VehicleCommand").read(request[16:])
    assert (fields["command"], fields["param1"], fields["target_system"]) == (400, 1.0, 4)
    service.reply(request[:16] + ack(command=400, result=2))
    replies = list[Any]()

    def answered() -> bool:
        replies.extend(client.replies())
        return bool(replies)

    until(answered)
    assert [(each.seq, each.reply.command, each.reply.result) for each in replies] == [(7, 400, 2)]
    assert other.replies() == []


def test_a_reply_waits_until_its_reader_is_known(participants: tuple[DomainParticipant, DomainParticipant]) -> None:
    """The writer that asks may be heard before the reader that waits: here by as long as the test wants."""
    service = OfferedService(participants[0], VEHICLE_COMMAND, "px4_3")
    request_name, reply_name = service_names(VEHICLE_COMMAND, "px4_3")
    asking = participants[1]
    writer = DataWriter(asking, Topic(asking, request_name, REQUEST_TYPE), qos=qos(MARK))
    until(writer.get_matched_subscriptions)
    writer.write(REQUEST_TYPE(5, 6, command(command=22)))
    request = taken(service)
    answering = threading.Thread(target=service.reply, args=(request[:16] + ack(command=22),))
    answering.start()
    reader = DataReader(asking, Topic(asking, reply_name, REPLY_TYPE), qos=qos(MARK))
    answering.join()
    until(lambda: [each.guid for each in reader.take(1)] == [5])


def test_a_client_of_another_rmw_is_named_once(
    participants: tuple[DomainParticipant, DomainParticipant], capfd: pytest.CaptureFixture[str]
) -> None:
    """It bears no mark of rmw_cyclonedds."""
    service = OfferedService(participants[0], VEHICLE_COMMAND, "px4_3")
    marked = Client(participants[1], 1)
    marked.wait_for_service()
    until(service.requests.get_matched_publications)
    assert list(service.take()) == []
    assert capfd.readouterr().err == ""
    strangers = [Client(participants[1], number, mark="") for number in (2, 3)]
    told = list[str]()

    def complained() -> bool:
        assert list(service.take()) == []
        told.append(capfd.readouterr().err)
        return len(service.requests.get_matched_publications()) == 1 + len(strangers) and any(told)

    until(complained)
    assert "".join(told).count("RMW_IMPLEMENTATION=rmw_cyclonedds_cpp") == 1
