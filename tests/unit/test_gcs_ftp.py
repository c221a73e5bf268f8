"""FTP's two ends against each other on simulated time, over links that lose datagrams each way."""

import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.gcs import ftp
from tests.unit.companion_px4 import on_the_wire
from tests.unit.ftp_server import Server

US = 1_000_000
TICK_US = 4_000
CONTENT = bytes(random.Random(5).randbytes(100_000))


def losing(share: float) -> Callable[[], bool]:
    chance = random.Random(3)
    return lambda: chance.random() < share


def talk(
    transfer: ftp.Transfer, server: Server, lost: Callable[[], bool] = lambda: False, limit_s: float = 600.0
) -> float:
    """Let both talk until it is done, a tick under way each way; the seconds that it took."""
    to_server: list[Any] = []
    to_client: list[Any] = []
    start_us = server.now_us
    for now_us in range(start_us, start_us + round(limit_s * US), TICK_US):
        server.now_us = now_us
        requests, answers = to_server, to_client
        to_client = server.on_time(now_us)
        for message in requests:
            if not lost():
                to_client += server.on_message(now_us, on_the_wire(message, 255, 190))
        to_server = transfer.on_time(now_us)
        for message in answers:
            if not lost():
                to_server += transfer.on_message(now_us, on_the_wire(message, 1, 1))
        if transfer.done:
            return (now_us - start_us) / US
    raise AssertionError("not done in time")


@pytest.fixture
def server(tmp_path: Path) -> Server:
    return Server(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.1, 0.3])
def test_a_file_goes_up_and_comes_down_whatever_is_lost(server: Server, tmp_path: Path, share: float) -> None:
    lost = losing(share)
    put = ftp.FtpPut(1, "file", CONTENT)
    talk(put, server, lost)
    assert (put.error, (tmp_path / "file").read_bytes() == CONTENT) == (None, True)
    get = ftp.FtpGet(1, "file")
    talk(get, server, lost)
    assert (get.error, get.content == CONTENT) == (None, True)
    crc = ftp.FtpCrc(1, "file")
    talk(crc, server, lost)
    assert crc.crc == ftp.crc_of(CONTENT)
    remove = ftp.FtpRemove(1, "file")
    talk(remove, server, lost)
    assert (remove.error, (tmp_path / "file").exists()) == (None, False)


def test_without_loss_a_file_comes_in_bursts(server: Server, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(CONTENT)
    assert talk(ftp.FtpGet(1, "file"), server) < 0.15


class Changing(Server):
    """Its file has another size by the time it has been opened."""

    def __init__(self, root: Path, size: int) -> None:
        super().__init__(root)
        self.path, self.size = root / "file", size

    def on_message(self, now_us: int, message: Any) -> list[Any]:
        answers = super().on_message(now_us, message)
        if bytes(message.payload)[3] == ftp.OPEN_RO:
            os.truncate(self.path, self.size)
        return answers


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("size", [100, 239, 1000, 10_000])
def test_a_file_that_grows_comes_as_it_was_when_it_was_opened(tmp_path: Path, size: int, share: float) -> None:
    (tmp_path / "file").write_bytes(CONTENT[:size])
    get = ftp.FtpGet(1, "file")
    talk(get, Changing(tmp_path, 50_000), losing(share))
    assert (get.error, get.content == CONTENT[:size]) == (None, True)


@pytest.mark.parametrize("size", [0, 50])
@pytest.mark.parametrize("opened", [100, 10_000])
def test_a_file_that_became_shorter_is_given_up(tmp_path: Path, opened: int, size: int) -> None:
    (tmp_path / "file").write_bytes(CONTENT[:opened])
    get = ftp.FtpGet(1, "file")
    assert talk(get, Changing(tmp_path, size)) < 10.0
    assert (get.error, get.content) == ("no more of it comes", b"")


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_long_folder_is_listed(server: Server, tmp_path: Path, share: float) -> None:
    names = [f"a_file_with_a_name_of_some_length_{number:03}" for number in range(60)]
    for name in names:
        (tmp_path / name).write_bytes(b"12345")
    (tmp_path / "log").mkdir()
    listing = ftp.FtpList(1, "/")
    talk(listing, server, losing(share))
    assert listing.error is None
    assert listing.entries == [*(ftp.Entry(name, False, 5) for name in names), ftp.Entry("log", True)]


def test_an_empty_file_and_one_of_whole_packets(server: Server, tmp_path: Path) -> None:
    for content in (b"", b"x" * 239, b"y" * 478):
        put = ftp.FtpPut(1, "file", content)
        talk(put, server)
        get = ftp.FtpGet(1, "file")
        talk(get, server)
        assert (put.error, get.error, get.content) == (None, None, content)


@pytest.mark.parametrize(
    ("transfer", "error"),
    [
        (ftp.FtpGet(1, "nothing"), "not found"),
        (ftp.FtpList(1, "nothing"), "not found"),
        (ftp.FtpRemove(1, "nothing"), "not found"),
        (ftp.FtpGet(1, "../secret"), "protected"),
        (ftp.FtpPut(1, "etc/extras/mine", b"x"), "protected"),
        (ftp.FtpPut(1, "log", b"x"), "failed (errno 21)"),
        (ftp.FtpPut(1, "no_such_folder/file", b"x"), "not found"),
    ],
)
def test_a_refusal_says_why(server: Server, tmp_path: Path, transfer: ftp.Transfer, error: str) -> None:
    (tmp_path / "log").mkdir()
    talk(transfer, server)
    assert transfer.error == error


def test_nobody_there_is_told_in_time(server: Server) -> None:
    get = ftp.FtpGet(1, "file")
    assert talk(get, server, lambda: True) == pytest.approx(6.0, abs=0.1)
    assert get.error == "no answer"


def test_a_link_that_dies_in_the_middle_is_told(server: Server, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(CONTENT)
    heard = iter(range(100))
    get = ftp.FtpGet(1, "file")
    talk(get, server, lambda: next(heard, None) is None)
    assert (get.error, get.content) == ("no answer", b"")


def test_answers_of_others_are_not_taken(server: Server, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(os.urandom(10))
    get = ftp.FtpGet(1, "file")
    (request,) = get.on_time(0)
    (answer,) = server.on_message(0, on_the_wire(request, 255, 190))
    assert get.on_message(0, on_the_wire(answer, 2, 1)) == []
    assert get.on_message(0, on_the_wire(answer, 1, 100)) == []
    assert len(get.on_message(0, on_the_wire(answer, 1, 1))) == 1
