"""Video as a viewer gets it: real RTP packets, decoded by FFmpeg from wherever the viewer joins."""

import itertools
import socket
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from sitl_emu.run import video_sender
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.video_sender import Target, VideoSender
from tests.rtp import IDR, LIMIT_S, PPS, SPS, Ear, Image, decoded, psnr_db, units

WIDTH, HEIGHT, RATE_HZ, BIT_RATE = 320, 240, 15.0, 2_000_000
FRAME_S = 1.0 / RATE_HZ


@pytest.fixture
def ear() -> Iterator[Ear]:
    made = Ear()
    yield made
    made.close()


def scene(number: int) -> Image:
    """Soft colours with a sharp bar that wanders: no two are alike."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    blue, green = 90 + 60 * np.sin((x + 5 * number) / 40), 110 + 70 * np.cos((y - 3 * number) / 35)
    image = np.stack([blue, green, np.full_like(blue, 60.0 + number % 60)], axis=2)
    image[:, (7 * number) % WIDTH :][:, :12] = (220.0, 225.0, 230.0)
    return np.asarray(np.clip(image, 0, 255), np.uint8)


def shown(ear: Ear, sender: VideoSender, numbers: Sequence[int]) -> list[list[bytes]]:
    """The packets of scenes, one after another, at the rate."""
    pictures = []
    for number in numbers:
        sender.show(scene(number), 100.0 + number * FRAME_S)
        pictures.append(ear.picture())
    return pictures


@pytest.fixture
def sender(ear: Ear) -> Iterator[VideoSender]:
    made = VideoSender(Target("127.0.0.1", ear.port, BIT_RATE, RATE_HZ))
    yield made
    made.close()


@pytest.mark.parametrize("joins_at", [0, 1, 7, 22])
def test_who_joins_anywhere_sees_each_frame_from_the_next_key_frame_on(
    ear: Ear, sender: VideoSender, joins_at: int
) -> None:
    pictures = shown(ear, sender, range(48))
    heard = pictures[joins_at:]
    first = next(at for at, packets in enumerate(heard) if IDR in units(packets))
    assert first <= RATE_HZ, "within a second"
    seen = decoded(heard[first:])
    assert len(seen) == len(heard) - first
    for number, image in enumerate(seen, joins_at + first):
        assert psnr_db(image, scene(number)) > 32.0
        assert psnr_db(image, scene(number)) > psnr_db(image, scene(number + 1)) + 3.0, "and no other frame"


def test_each_second_one_picture_stands_by_itself_and_brings_the_parameters(ear: Ear, sender: VideoSender) -> None:
    kinds = [units(packets) for packets in shown(ear, sender, range(46))]
    keys = [number for number, each in enumerate(kinds) if IDR in each]
    assert keys == [0, 15, 30, 45]
    for number in keys:
        assert kinds[number].index(SPS) < kinds[number].index(PPS) < kinds[number].index(IDR)


def test_time_stamps_are_the_clock_s_and_packets_fit_a_frame(ear: Ear, sender: VideoSender) -> None:
    pictures = shown(ear, sender, range(20))
    stamps = [int.from_bytes(packets[0][4:8], "big") for packets in pictures]
    assert {(after - before) % 2**32 for before, after in itertools.pairwise(stamps)} == {6000}
    everything = [packet for packets in pictures for packet in packets]
    assert max(map(len, everything)) <= 1400
    assert {packet[1] & 0x7F for packet in everything} == {96}, "the payload type of the SDP file"
    numbers = [int.from_bytes(packet[2:4], "big") for packet in everything]
    assert all((after - before) % 2**16 == 1 for before, after in itertools.pairwise(numbers))


def test_no_rtcp_goes_to_the_port_of_the_next_vehicle() -> None:
    ear = Ear()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as neighbour:
        neighbour.bind(("127.0.0.1", ear.port + 1))
        neighbour.setblocking(False)
        sender = VideoSender(Target("127.0.0.1", ear.port, BIT_RATE, RATE_HZ))
        shown(ear, sender, range(0, 150, 5))
        sender.close()
        with pytest.raises(BlockingIOError):
            neighbour.recv(65535)
    ear.close()


def test_the_rate_is_kept_whatever_is_shown(ear: Ear, sender: VideoSender) -> None:
    """Noise takes all that there is: two Mbit/s."""
    rng = np.random.default_rng(1)
    size = 0
    for number in range(60):
        sender.show(rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8), number * FRAME_S)
        size += sum(map(len, ear.picture()))
    assert 0.6 * BIT_RATE < size * 8 / (60 * FRAME_S) < 1.3 * BIT_RATE


def test_what_comes_faster_than_the_rate_is_left_out(ear: Ear, sender: VideoSender) -> None:
    for number in range(90):
        sender.show(scene(number), 50.0 + number * FRAME_S / 3)
        if number % 3 == 0:
            ear.picture()
    sender.close()
    assert sender.sent == pytest.approx(30, abs=2) and sender.dropped == 0


def test_who_shows_never_waits_for_the_encoder(ear: Ear, sender: VideoSender, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is held up at the first picture: of those meanwhile the last is sent after it, and the others are counted."""
    shown(ear, sender, [0])
    stream: Any = sender._stream
    free, busy = threading.Event(), threading.Event()
    send = stream.send

    def held_up(image: Image, now_s: float) -> None:
        busy.set()
        assert free.wait(LIMIT_S)
        send(image, now_s)

    monkeypatch.setattr(stream, "send", held_up)
    sender.show(scene(1), 100.0 + 1 * FRAME_S)
    assert busy.wait(LIMIT_S)
    for number in range(2, 9):
        sender.show(scene(number), 100.0 + number * FRAME_S)
    free.set()
    pictures = [ear.picture(), ear.picture()]
    sender.close()
    assert ear.silent() and (sender.sent, sender.dropped) == (3, 6)
    stamps = [int.from_bytes(packets[0][4:8], "big") for packets in pictures]
    assert (stamps[1] - stamps[0]) % 2**32 == 7 * 6000


def test_of_odd_sides_the_last_row_and_column_are_not_sent(ear: Ear, sender: VideoSender) -> None:
    sender.show(scene(0)[:-1, :-1], 100.0)
    (image,) = decoded([ear.picture()])
    assert image.shape == (HEIGHT - 2, WIDTH - 2, 3) and psnr_db(image, scene(0)[:-2, :-2]) > 32.0


def test_a_fault_of_the_encoder_is_said_and_the_next_picture_tried(
    ear: Ear, sender: VideoSender, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown(ear, sender, range(3))
    failed = threading.Event()

    def fails(_image: Image, _now_s: float) -> None:
        failed.set()
        raise av.error.ExternalError(542398533, "Generic error in an external library")

    stream: Any = sender._stream
    monkeypatch.setattr(stream, "send", fails)
    sender.show(scene(3), 100.0 + 3 * FRAME_S)
    assert failed.wait(LIMIT_S)
    assert IDR in units(shown(ear, sender, [30])[0])
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"no video to 127.0.0.1:{ear.port}: Generic error in an external library; trying on"


def test_nobody_there_is_of_no_account() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    sender = VideoSender(Target("127.0.0.1", port, BIT_RATE, RATE_HZ))
    for number in range(20):
        sender.show(scene(number), number * FRAME_S)
    sender.close()
    assert sender.sent + sender.dropped == 20


def test_a_network_that_is_down_is_said_once_and_tried_again(ear: Ear, capsys: pytest.CaptureFixture[str]) -> None:
    """A broadcast address without leave to use it stands for what can't be reached: each packet is an error."""
    sender = VideoSender(Target("255.255.255.255", ear.port, BIT_RATE, RATE_HZ))
    for number in range(4):
        sender.show(scene(number), 10.0 * number)
    sender.close()
    assert sender.sent == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("no video to 255.255.255.255:") and line.endswith("; trying on")


def test_after_an_outage_it_begins_with_a_key_frame(
    ear: Ear, sender: VideoSender, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown(ear, sender, range(3))
    stream: Any = sender._stream
    failed = threading.Event()

    def fails(_image: Image, _now_s: float) -> None:
        failed.set()
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(stream, "send", fails)
    sender.show(scene(3), 100.0 + 3 * FRAME_S)
    assert failed.wait(LIMIT_S)
    late = range(30, 33)
    pictures = shown(ear, sender, late)
    assert IDR in units(pictures[0])
    assert [psnr_db(image, scene(number)) > 32.0 for number, image in zip(late, decoded(pictures), strict=True)] == [
        True
    ] * 3


def test_ffmpeg_plays_it_by_the_sdp_file_of_the_docs(ear: Ear, sender: VideoSender, tmp_path: Path) -> None:
    """Its own RTP receiver, as ffplay and OpenCV have it, joins while it is sent."""
    text = (Path(__file__).parents[2] / "docs/video.sdp").read_text()
    port = ear.port
    ear.close()
    sdp = tmp_path / "video.sdp"
    sdp.write_text(text.replace("m=video 5600 ", f"m=video {port} "))
    ended = threading.Event()

    def film() -> None:
        number = 0
        while not ended.wait(0.02):
            number += 1
            sender.show(scene(number), number * FRAME_S)

    filming = threading.Thread(target=film)
    filming.start()
    try:
        options = {"protocol_whitelist": "file,udp,rtp", "fflags": "nobuffer"}
        with av.open(str(sdp), options=options, timeout=LIMIT_S) as viewer:
            frames = [
                frame.to_ndarray(format="bgr24") for frame, _ in zip(viewer.decode(video=0), range(5), strict=False)
            ]
    finally:
        ended.set()
        filming.join()
    assert len(frames) == 5
    for image in frames:
        assert max(psnr_db(image, scene(number)) for number in range(400)) > 32.0


def test_without_pyav_one_line_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(Trouble, match=r"video needs PyAV, which is not installed: pip install 'sitl-emu\[video\]'"):
        video_sender.check()


def test_a_pyav_without_the_encoder_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video_sender, "ENCODER", "libx999")
    with pytest.raises(Trouble, match="PyAV with libx999, which the installed one lacks"):
        video_sender.check()
