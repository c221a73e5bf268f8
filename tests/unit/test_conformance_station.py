"""The conformance tests' ground station: whom it hears."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

from tests.conformance import station as stations
from tests.conformance.station import Station, device_and_baud

PX4, ARDUPILOT, INVALID, STANDBY = 12, 3, 8, 3
HOLD = 4 << 16 | 3 << 24


class Air:
    """Where systems speak, to a station that listens."""

    def __init__(self, port: int) -> None:
        self._to = ("127.0.0.1", port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def say(self, system: int, message: Any) -> None:
        self._socket.sendto(message.pack(common.MAVLink(None, srcSystem=system, srcComponent=1)), self._to)

    def beat(self, system: int, autopilot: int = PX4) -> None:
        self.say(system, common.MAVLink_heartbeat_message(2, autopilot, 29, HOLD, STANDBY, 3))

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Station, Air]]:
    monkeypatch.setenv("MAVLINK20", "1")
    monkeypatch.setattr(stations, "OTHERS_S", 0.2)
    for question in ("_introduced", "parameter_bytes"):  # nobody answers here
        monkeypatch.setattr(Station, question, lambda *_: None)
    station = Station("udpin:127.0.0.1:0")
    air = Air(station.link.port.getsockname()[1])
    yield station, air
    air.close()
    station.link.close()


def test_of_several_autopilots_the_first_is_taken_and_the_others_are_named(heard: tuple[Station, Air]) -> None:
    station, air = heard
    air.beat(255, INVALID)
    for system in (2, 3, 1):
        air.beat(system)
    station.wait_until_ready(1.0)
    assert (station.system, station.others) == (2, [1, 3])


@pytest.mark.parametrize(
    ("answer", "modes", "complaint"),
    [
        (0, [HOLD], None),
        (0, [0, HOLD], None),
        (0, [0, 0, HOLD], "DO_SET_MODE 4, 3 is accepted, but custom_mode is told to be 0, not 50593792"),
        (0, [0, None], "DO_SET_MODE 4, 3 is accepted, but custom_mode is told to be None, not 50593792"),
        (2, [HOLD], "DO_SET_MODE 4, 3 is answered 2"),
    ],
)
def test_a_mode_is_seen_in_one_of_two_heartbeats(
    heard: tuple[Station, Air],
    monkeypatch: pytest.MonkeyPatch,
    answer: int,
    modes: list[int | None],
    complaint: str | None,
) -> None:
    station, _ = heard
    beats = iter([None if mode is None else SimpleNamespace(custom_mode=mode) for mode in modes])
    monkeypatch.setattr(station, "command", lambda *_: answer)
    monkeypatch.setattr(station, "heartbeat", lambda: next(beats))
    if complaint is None:
        station.set_mode(4, 3)
    else:
        with pytest.raises(AssertionError, match=f"^{complaint}$"):
            station.set_mode(4, 3)


def test_messages_of_other_systems_are_dropped_once_the_autopilot_is_known(heard: tuple[Station, Air]) -> None:
    station, air = heard
    station.system = 1
    for system in (2, 1):
        air.say(system, common.MAVLink_attitude_message(system, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert station.receive("ATTITUDE", 0.5).time_boot_ms == 1
    assert station.receive("ATTITUDE", 0.1) is None


def test_a_serial_link_is_opened_at_its_baud_rate_which_is_named_where_nothing_is_heard(tmp_path: Path) -> None:
    near, far = os.openpty()
    device = os.ttyname(far)
    try:
        station = Station(f"{device}:57600")
        assert (station.link.device, station.link.port.baudrate) == (device, 57600)
        with pytest.raises(TimeoutError, match=r"no autopilot is heard within 0 s at 57600 baud: is it running"):
            station.wait_until_ready(0.1)
        station.link.close()
    finally:
        for each in (near, far):
            os.close(each)
    of_colons = tmp_path / "usb-0:1:1.0"
    of_colons.touch()
    assert device_and_baud(str(of_colons)) == (str(of_colons), 115200)
    assert device_and_baud("udpin:0.0.0.0:14550") == ("udpin:0.0.0.0:14550", 0)


@pytest.mark.parametrize(
    ("autopilot", "version", "stranger"),
    [
        (PX4, (1, 18, 0), ""),
        (PX4, (1, 19, 0), ""),
        (PX4, (1, 17, 3), "PX4 1.17.3"),
        (ARDUPILOT, (4, 6, 0), "ARDUPILOTMEGA 4.6.0"),
        (PX4, None, "PX4 of a version that it does not tell"),
    ],
)
def test_who_is_no_px4_of_this_release_is_a_stranger(
    autopilot: int, version: tuple[int, int, int] | None, stranger: str
) -> None:
    answer = None if version is None else SimpleNamespace(flight_sw_version=int.from_bytes(bytes((*version, 255))))
    mav = SimpleNamespace(command_long_send=lambda *_: None)
    station: Any = SimpleNamespace(system=1, mav=mav, receive=lambda *_: answer, stranger="")
    Station._introduced(station, SimpleNamespace(autopilot=autopilot, type=2))
    assert station.stranger == stranger


def test_a_connection_that_is_closed_is_told_and_its_autopilot_lost() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        station = Station(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        server.accept()[0].close()
        with pytest.raises(ConnectionError, match="the autopilot has closed the connection"):
            station.receive("HEARTBEAT", 5.0)
        assert station.loses()
        with pytest.raises(ConnectionError, match="the autopilot was lost"):
            station.receive("HEARTBEAT")
        station.link.close()


class Missions(Station):
    """A station whose autopilot knows missions alone."""

    def __init__(self) -> None:
        self.asked = list[int]()
        self.answered = {0: 3}
        self.set_first, self._kinds = {}, None

    def heartbeat(self) -> Any:
        return SimpleNamespace(base_mode=0, custom_mode=HOLD)

    def _announced(self, kind: int) -> int | None:
        self.asked.append(kind)
        return self.answered.get(kind)


def test_plans_that_an_autopilot_does_not_know_are_not_compared() -> None:
    vehicle = Missions()
    assert [vehicle.state().items for _ in range(2)] == [(3,), (3,)]
    assert vehicle.asked == [0, 1, 2, 0]
    vehicle.answered = {}
    with pytest.raises(TimeoutError, match="does not tell its mode and mission counts"):
        vehicle.state()


@pytest.mark.parametrize(("autopilot", "params"), [(PX4, (1, 4, 3)), (ARDUPILOT, (1, HOLD))])
def test_a_mode_is_asked_for_as_its_autopilot_numbers_it(autopilot: int, params: tuple[int, ...]) -> None:
    asked = list[tuple[int, ...]]()

    class Moded(Station):
        def __init__(self) -> None:
            """Without a link."""

        def heartbeat(self) -> Any:
            return SimpleNamespace(autopilot=autopilot, base_mode=0, custom_mode=HOLD if asked else 0)

        def command(self, _number: int, *params: Any, limit_s: float = 0.0) -> int:
            asked.append(params)
            return 0

    assert Moded().chooses(HOLD)
    assert asked == [params]


class Unknown(common.MAVLink_message):  # type: ignore[misc]
    """EVENT, which pymavlink does not know."""

    def __init__(self) -> None:
        super().__init__(410, "EVENT")

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        return bytes(self._pack(mav, 160, bytes(range(1, 20)), force_mavlink1))


def test_a_message_that_pymavlink_does_not_know_is_told_from_one_of_another_system(heard: tuple[Station, Air]) -> None:
    station, air = heard
    station.system = 1
    air.say(2, Unknown())
    assert station.receive("UNKNOWN_410", 0.1) is None
    air.say(1, Unknown())
    assert station.receive("UNKNOWN_410", 0.5) is not None
