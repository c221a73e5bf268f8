"""Log download: PX4's half as a transcript, and both halves over links that lose packets."""

import os
import random
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.log_transfer import LogDownload, LogEntry, LogList, erase
from tests.unit.mavlink_peer import PAYLOAD, TICK_US, Peer, only

ALL = 0xFFFF
EVERYTHING = 0xFFFFFFFF
DATE_S = 1_767_225_600
SIZES = {"2026-01-01/10_00_00.ulg": 1000, "2026-01-01/11_00_00.ulg": 90, "2026-01-02/09_00_00.ulg": 50_000}


def content(name: str) -> bytes:
    return random.Random(name).randbytes(SIZES[name])


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Three logs of two days, and things that are none."""
    for number, name in enumerate(SIZES):
        path = tmp_path / "log" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content(name))
        os.utime(path, (DATE_S + number,) * 2)
    (tmp_path / "log" / "stray.ulg").write_text("in no day's folder")
    return tmp_path


def request_list(peer: Peer, start: int = 0, end: int = ALL) -> list[Any]:
    message = mavlink.MAVLink_log_request_list_message(1, 1, start, end)
    return [(e.id, e.num_logs, e.last_log_num, e.size, e.time_utc) for e in only(peer.send(message), "LOG_ENTRY")]


def request_data(peer: Peer, number: int, offset: int, count: int, seconds: float = 0.1) -> list[Any]:
    message = mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count)
    return only(peer.send(message) + peer.run(seconds), "LOG_DATA")


def places(packets: list[Any]) -> list[tuple[int, int]]:
    return [(packet.ofs, packet.count) for packet in packets]


# --- PX4's half ----------------------------------------------------------------------------------------------


def test_list_names_logs_from_zero_and_its_last_is_their_number(root: Path) -> None:
    assert request_list(Peer(root=root)) == [
        (0, 3, 3, 1000, DATE_S),
        (1, 3, 3, 90, DATE_S + 1),
        (2, 3, 3, 50_000, DATE_S + 2),
    ]


def test_list_begins_where_asked_and_goes_to_the_last(root: Path) -> None:
    peer = Peer(root=root)
    assert [entry[:3] for entry in request_list(peer, 1, 1)] == [(1, 3, 1), (2, 3, 1)]
    assert request_list(peer, 5000, 5001) == []


@pytest.mark.parametrize("storage", [True, False])
def test_without_logs_nothing_is_said(tmp_path: Path, storage: bool) -> None:
    (tmp_path / "log").mkdir()
    assert request_list(Peer(root=tmp_path if storage else None)) == []


def test_data_comes_in_packets_of_90_bytes(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    assert places(request_data(peer, 0, 0, 90)) == [(0, 90)]
    assert places(request_data(peer, 0, 0, 270)) == [(0, 90), (90, 90), (180, 90)]
    assert places(request_data(peer, 0, 45, 100)) == [(45, 90), (135, 90)]
    assert places(request_data(peer, 0, 900, 270)) == [(900, 90), (990, 10)]
    assert places(request_data(peer, 0, 990, 10)) == [(990, 10)]
    assert places(request_data(peer, 1, 0, EVERYTHING)) == [(0, 90)]
    assert places(request_data(peer, 0, 90, EVERYTHING)) == [(90, 90)], "PX4's sum overflows"


def test_data_that_does_not_exist_is_not_answered(root: Path) -> None:
    peer = Peer(root=root)
    assert request_data(peer, 0, 0, 90) == [], "no list was asked for"
    request_list(peer)
    assert request_data(peer, 4999, 0, 90) == []
    assert request_data(peer, 0, 1000, 90) == []
    (root / "log" / "2026-01-01" / "11_00_00.ulg").unlink()
    assert request_data(peer, 1, 0, 90) == []


def test_a_whole_log_equals_its_file(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    packets = request_data(peer, 2, 0, EVERYTHING, seconds=1.0)
    assert [packet.ofs for packet in packets] == list(range(0, 50_000, 90))
    assert b"".join(bytes(packet.data[: packet.count]) for packet in packets) == content("2026-01-02/09_00_00.ulg")


def test_a_request_ends_the_one_before(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    assert len(request_data(peer, 2, 0, EVERYTHING, seconds=0.008)) < 555
    assert places(request_data(peer, 0, 0, 90)) == [(0, 90)]
    request_data(peer, 2, 0, EVERYTHING, seconds=0.008)
    assert not only(peer.send(mavlink.MAVLink_log_request_end_message(1, 1)) + peer.run(0.5), "LOG_DATA")


def test_links_are_served_by_themselves(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    other = peer.send(mavlink.MAVLink_log_request_data_message(1, 1, 0, 0, 90), PAYLOAD)
    assert not only(other, "LOG_DATA"), "no list was asked for on that link"
    assert len(request_data(peer, 0, 0, 90)) == 1


def test_a_log_that_is_cut_while_it_is_sent_ends_quietly(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    peer.send(mavlink.MAVLink_log_request_data_message(1, 1, 2, 0, EVERYTHING))
    (root / "log" / "2026-01-02" / "09_00_00.ulg").write_bytes(b"")
    assert not only(peer.run(1.0), "LOG_DATA")


def test_erase_removes_logs_and_their_folders_and_answers_nothing(root: Path) -> None:
    peer = Peer(root=root)
    request_list(peer)
    assert peer.send(erase(1)) == []
    assert list((root / "log").iterdir()) == []
    assert request_list(peer) == []
    assert request_data(peer, 0, 0, 90) == []


def test_links_out_of_the_folder_are_neither_listed_nor_erased(root: Path, tmp_path_factory: Any) -> None:
    outside = tmp_path_factory.mktemp("outside")
    (outside / "precious.ulg").write_text("not a log of this vehicle")
    (root / "log" / "2026-01-03").symlink_to(outside)
    (root / "log" / "2026-01-02" / "linked.ulg").symlink_to(outside / "precious.ulg")
    peer = Peer(root=root)
    assert len(request_list(peer)) == 3
    peer.send(erase(1))
    assert (outside / "precious.ulg").exists()
    assert request_list(peer) == []


def test_messages_to_others_are_obeyed_too(root: Path) -> None:
    """MavlinkLogHandler does not look at targets."""
    peer = Peer(root=root)
    assert only(peer.send(mavlink.MAVLink_log_request_list_message(2, 1, 0, ALL)), "LOG_ENTRY")
    peer.send(erase(2))
    assert all(entry.num_logs == 0 for entry in request_list(peer))


# --- both halves -----------------------------------------------------------------------------------------------


def talk(service: Any, peer: Peer, loss: float, limit_s: float = 120.0) -> float:
    """Let both ends talk until the service is done, losing that part each way; the simulated seconds it took."""
    chance, begin_us = random.Random(f"{loss}"), peer.now_us
    while not service.done:
        assert peer.now_us - begin_us < limit_s * 1e6, "not done in time"
        outgoing = service.on_time(peer.now_us)
        incoming = peer.run(TICK_US * 1e-6)
        while outgoing or incoming:
            for message in outgoing:
                if chance.random() >= loss:
                    incoming += peer.send(message)
            outgoing = []
            for message in incoming:
                if chance.random() >= loss:
                    outgoing += service.on_message(peer.now_us, message)
            incoming = []
    return (peer.now_us - begin_us) * 1e-6


@pytest.mark.parametrize(("loss", "limit_s"), [(0.0, 0.2), (0.05, 2.0), (0.1, 3.0), (0.3, 20.0)])
def test_logs_are_listed_and_fetched_whole_over_a_link_that_loses(root: Path, loss: float, limit_s: float) -> None:
    peer, listing = Peer(root=root), LogList(1)
    assert talk(listing, peer, loss) < limit_s
    assert listing.entries is not None
    assert [entry.size for entry in listing.entries] == list(SIZES.values())
    for entry, name in zip(listing.entries, SIZES, strict=True):
        download = LogDownload(1, entry)
        assert talk(download, peer, loss) < limit_s
        assert download.data == content(name)
        assert download.progress == 1.0


def test_an_empty_list_and_silence_end() -> None:
    listing, download = LogList(1), LogDownload(1, LogEntry(0, 1000, 0))
    peer = Peer()
    assert talk(listing, peer, 0.0) < 10.0
    assert listing.entries == []
    assert talk(download, peer, 0.0) < 10.0
    assert download.data is None


def test_an_empty_log_is_whole_at_once() -> None:
    download = LogDownload(1, LogEntry(0, 0, 0))
    assert talk(download, Peer(), 0.0) < 0.1
    assert download.data == b""
