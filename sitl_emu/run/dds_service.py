"""PX4's service on DDS, as ROS 2's rmw_cyclonedds speaks it.

How a reply finds who asked, DDS leaves to those who use it. rmw_cyclonedds writes two words before each message, who
asks and the request's number (serdata.hpp, cdds_request_header; rmw_node.cpp, rmw_send_request); a reply bears those of
its request. rmw_fastrtps, and Micro XRCE-DDS's agent, which real PX4s speak through, write the same into RTPS's own
headers (related sample identity), which Cyclone DDS does not let its users do. So nodes on rmw_fastrtps are not
understood here, and no two implementations of rmw are by each other.
"""

import sys
from collections.abc import Iterator
from typing import Final

from cyclonedds.builtin import DcpsEndpoint
from cyclonedds.core import DDSStatus, Qos, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import Service, service_names
from sitl_emu.autopilot.uxrce_dds_client.vehicle_command_srv import ASKED_BYTES
from sitl_emu.run import dds_types

QOS: Final = Qos(
    Policy.Reliability.Reliable(duration(infinite=True)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(10),
    dds_types.PLAIN_CDR,
)
"""As ROS 2 has services (rmw_qos_profile_services_default); of what PX4's client asks for, XRCE tells nothing."""
MATCH_S: Final = 0.1
"""How long a reply waits for one more reader to be found (rmw_send_response)."""
OTHER_RMW = (
    "sitl-emu: ROS 2: a client of the service {name} is not on rmw_cyclonedds, and will not be understood: run its "
    "node with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or publish /fmu/in/{name}"
)


class OfferedService:
    """One vehicle's service."""

    def __init__(self, participant: DomainParticipant, service: Service, within: str) -> None:
        """`within`: the namespace."""
        self._name = service.name
        self._size = cdr.size(service.request)
        request, self._reply = dds_types.carried_service(service)
        request_name, reply_name = service_names(service, within)
        self.requests = DataReader(participant, Topic(participant, request_name, request), qos=QOS)
        self.requests.set_status_mask(DDSStatus.SubscriptionMatched)
        self._replies = DataWriter(participant, Topic(participant, reply_name, self._reply), qos=QOS)
        self._replies.set_status_mask(DDSStatus.PublicationMatched)
        self._matched = WaitSet(participant)
        self._matched.attach(self._replies)
        self._newest: tuple[bytes, int] = (b"", 0)
        """Who asked last, and the handle of the writer that did."""
        self._has_complained = False

    def take(self) -> Iterator[bytes]:
        """The requests that came, those of the right byte order alone: who asks, and the message."""
        if self.requests.take_status():
            self._look_at_clients()
        for each in self.requests.take(10):
            if isinstance(each, dds_types.Carried) and each.data[:2] == cdr.HEADER[:2]:
                data = each.data[len(cdr.HEADER) :][: ASKED_BYTES + self._size]
                self._newest = data[:ASKED_BYTES], each.sample_info.publication_handle
                yield data

    def _look_at_clients(self) -> None:
        """Say so, once, where one is there whose requests DDS will refuse as too short."""
        writers = map(self.requests.get_matched_publication_data, self.requests.get_matched_publications())
        if not self._has_complained and any(each is not None and not _client(each) for each in writers):
            self._has_complained = True
            print(OTHER_RMW.format(name=self._name), file=sys.stderr, flush=True)

    def reply(self, message: bytes) -> None:
        """Answer the newest request; one whose asker has gone meanwhile is not answered."""
        asked, handle = self._newest
        if message[:ASKED_BYTES] != asked:
            return
        asker = self.requests.get_matched_publication_data(handle)
        if asker is None:
            return
        while not self._is_heard_by(asker) and self._matched.wait(duration(seconds=MATCH_S)):
            self._replies.take_status()
        self._replies.write(dds_types.sample(self._reply, message))

    def _is_heard_by(self, asker: DcpsEndpoint) -> bool:
        """Whether the reader that belongs to who asked is known: one process may have several clients."""
        found = map(self._replies.get_matched_subscription_data, self._replies.get_matched_subscriptions())
        return any(each is not None and _client(each) == _client(asker) for each in found)


def _client(endpoint: DcpsEndpoint) -> bytes:
    """By what rmw_cyclonedds marks the reader and the writer of a client ("clientid=…" in their user data)."""
    data = endpoint.qos[Policy.Userdata]
    marks = bytes(data.data).split(b";") if data is not None else []
    return next((mark for mark in marks if mark.startswith(b"clientid=")), b"")
