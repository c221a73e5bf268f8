"""Transfers by MAVSDK and pymavlink over a link that loses 5, 10 and 30 % each way.

They succeed, or end with the client's own time-out, after which the vehicle is as ready as before.
"""

import math
import os
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw, MissionRawError, MissionRawResult
from pymavlink import mavftp, mavparm, mavutil

from tests.interop.lossy_link import LossyLink
from tests.interop.mavsdk_vehicle import IRIS_PARAMETERS
from tests.launched import launched

INSTANCE = 3
LOSSES = (0.05, 0.1, 0.3)
ITEMS = 25
TRANSFER_LIMIT_S = 60.0
QUIET_S = 0.2
"""After this long without an answer a client asks again."""
VEHICLE_GIVES_UP_S = 6.0
RELATIVE_INT, WAYPOINT = 6, 16
X, Y = 473977418, 85455939
METADATA = "etc/extras/parameters.json.xz"
XZ_MAGIC = bytes.fromhex("fd377a585a00")


class Clients(NamedTuple):
    """Two links of one vehicle, each through a lossy one."""

    links: tuple[LossyLink, LossyLink]
    pymavlink: Any
    mission: MissionRaw

    def lose(self, loss: float) -> None:
        """On both, each way."""
        for link in self.links:
            link.loss = loss


@pytest.fixture(scope="module")
def connected() -> Iterator[Clients]:
    os.environ["MAVLINK20"] = "1"
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with (
        launched("iris", "--instance", str(INSTANCE)),
        LossyLink(18570 + INSTANCE) as gcs,
        LossyLink(14580 + INSTANCE) as onboard,
        Mavsdk(station) as mavsdk,
    ):
        mavsdk.add_any_connection(f"udpout://127.0.0.1:{onboard.port}")
        link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{gcs.port}", source_system=255, dialect="common")
        while link.target_system == 0:
            link.mav.heartbeat_send(6, 8, 0, 0, 0)
            link.recv_match(type="HEARTBEAT", blocking=True, timeout=QUIET_S)
        link.target_component = 1
        system = mavsdk.first_autopilot(timeout_s=30.0)
        assert system is not None
        yield Clients((gcs, onboard), link, MissionRaw(system))
        link.close()


@pytest.fixture(params=LOSSES)
def clients(connected: Clients, request: pytest.FixtureRequest) -> Iterator[Clients]:
    """What the vehicle streams is lost before a test begins: one whose transfer is refused at once loses no more."""
    lost = sum(link.lost for link in connected.links)
    connected.lose(request.param)
    end_s = time.monotonic() + TRANSFER_LIMIT_S
    while sum(link.lost for link in connected.links) == lost:
        assert time.monotonic() < end_s
        time.sleep(QUIET_S)
    yield connected
    connected.lose(0.0)


def is_ack_or_beyond(seq: int, message: Any) -> bool:
    """The mission's end, or a question for a later item."""
    return bool(message.get_type() == "MISSION_ACK" or message.seq > seq)


def is_item(seq: int, message: Any) -> bool:
    """The item of this number."""
    return bool(message.seq == seq)


def ask_until(link: Any, ask: Callable[[], None], accept: Callable[[Any], bool], *names: str) -> Any:
    """Ask, and ask again after a silence, until an answer is accepted."""
    end_s = time.monotonic() + TRANSFER_LIMIT_S
    while time.monotonic() < end_s:
        ask()
        while (message := link.recv_match(type=list(names), blocking=True, timeout=QUIET_S)) is not None:
            if accept(message):
                return message
    raise TimeoutError(f"no {names} within {TRANSFER_LIMIT_S} s")


def test_pymavlink_gets_every_parameter_and_sets_one(clients: Clients) -> None:
    link = clients.pymavlink
    found: dict[int, str] = {}
    link.param_fetch_all()
    end_s = time.monotonic() + TRANSFER_LIMIT_S
    while len(found) < IRIS_PARAMETERS and time.monotonic() < end_s:
        value = link.recv_match(type="PARAM_VALUE", blocking=True, timeout=QUIET_S)
        if value is not None and value.param_index < IRIS_PARAMETERS:
            found[value.param_index] = value.param_id
        elif value is None:
            for index in list(set(range(IRIS_PARAMETERS)) - set(found))[:200]:
                link.mav.param_request_read_send(link.target_system, 1, b"", index)
    assert len(set(found.values())) == IRIS_PARAMETERS
    for cruise_m_s in (6.5, 5.0):
        assert mavparm.MAVParmDict().mavset(link, "MPC_XY_CRUISE", cruise_m_s, retries=20)


def test_pymavlink_uploads_and_downloads_a_mission(clients: Clients) -> None:
    link = clients.pymavlink
    me = (link.target_system, 1)

    def item(seq: int) -> tuple[Any, ...]:
        return (*me, seq, RELATIVE_INT, WAYPOINT, int(seq == 0), 1, 0, 0, 0, math.nan, X + seq, Y, 10.0, 0)

    replies = ("MISSION_REQUEST_INT", "MISSION_ACK")
    # Refused as long as the download before waits for its MISSION_ACK, where that was lost: five seconds.
    asked = ask_until(
        link,
        lambda: link.mav.mission_count_send(*me, ITEMS, 0),
        lambda message: message.get_type() == "MISSION_REQUEST_INT",
        *replies,
    )
    while asked.get_type() != "MISSION_ACK":
        # Said again after a silence: the vehicle asks four times a second, so it is its last word that was lost.
        asked = ask_until(
            link,
            partial(link.mav.mission_item_int_send, *item(asked.seq)),
            partial(is_ack_or_beyond, asked.seq),
            *replies,
        )
    assert asked.type == 0
    count = ask_until(link, lambda: link.mav.mission_request_list_send(*me, 0), lambda _: True, "MISSION_COUNT")
    assert count.count == ITEMS
    for seq in range(ITEMS):
        got = ask_until(
            link,
            partial(link.mav.mission_request_int_send, *me, seq, 0),
            partial(is_item, seq),
            "MISSION_ITEM_INT",
        )
        assert (got.x, got.y) == (X + seq, Y)
    link.mav.mission_ack_send(*me, 0, 0)


def test_mavsdk_uploads_and_downloads_a_mission(clients: Clients) -> None:
    up = [
        MissionItem(seq, RELATIVE_INT, WAYPOINT, int(seq == 0), 1, 0.0, 0.0, 0.0, math.nan, X + seq, Y, 10.0, 0)
        for seq in range(ITEMS)
    ]
    end_s = time.monotonic() + TRANSFER_LIMIT_S
    while True:
        try:
            clients.mission.upload_mission(up)
            down = clients.mission.download_mission()
            break
        except MissionRawError as error:
            # MAVSDK gives up before the vehicle does, which is busy with the transfer before for five seconds.
            assert error.result in (MissionRawResult.TIMEOUT, MissionRawResult.PROTOCOL_ERROR)
            assert time.monotonic() < end_s
            clients.lose(0.0)
            time.sleep(VEHICLE_GIVES_UP_S)
    assert [(one.seq, one.x) for one in down] == [(one.seq, one.x) for one in up]


def test_mavftp_reads_a_file(clients: Clients, tmp_path: Path) -> None:
    link = clients.pymavlink
    copy = tmp_path / "parameters.json.xz"
    for _ in range(5):
        client = mavftp.MAVFTP(link, link.target_system, 1)
        client.cmd_get([METADATA, str(copy)])
        result = client.process_ftp_reply("OpenFileRO", timeout=TRANSFER_LIMIT_S)
        if result.error_code == mavftp.FtpError.Success:
            break
    assert result.error_code == mavftp.FtpError.Success
    assert copy.read_bytes()[:6] == XZ_MAGIC
