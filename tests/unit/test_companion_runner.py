"""The hardware runner: real sockets and clock, recorded frames, and what it says when it can't begin."""

import errno
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.camera import CameraError, open_camera
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, Status
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.links import LinkError, open_port, wait
from sitl_emu.missions.companion.live_frames import BootClock, LiveFrames
from sitl_emu.missions.companion.main import Runner, main
from sitl_emu.missions.companion.onboard import Onboard
from sitl_emu.missions.companion.wire import Wire
from tests.unit.companion_px4 import FakePx4

HEARD_LIMIT_S = 5.0


class Watcher:
    """A companion that wants every frame and finds as many things as its first pixel says."""

    def __init__(self) -> None:
        self.onboard = Onboard()
        self.seen: list[tuple[int, int]] = []

    @property
    def system_id(self) -> int:
        return self.onboard.system_id

    status = Status("watching", 0.0, False, "", "")

    def on_message(self, now_us: int, link: str, msg: Any) -> Any:
        return self.onboard.on_message(now_us, link, msg)[1]

    def on_time(self, now_us: int) -> Any:
        return self.onboard.on_time(now_us)

    def wants_frame(self, frame_time_us: int) -> float | None:
        return 0.05

    def detect(self, image: Any, gsd_m: float) -> list[Detection]:
        return [Detection("weed", gsd_m, 0, 0, 1, 1)] * int(image[0, 0, 0])

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Any:
        self.seen.append((frame_time_us, len(detections)))
        return []

    def events(self) -> Any:
        return self.onboard.events()


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_recorded_frames_reach_the_detector_at_their_own_time(tmp_path: Path) -> None:
    for i in range(4):
        cv2.imwrite(str(tmp_path / f"{200_000 * (i + 1)}.png"), np.full((48, 64, 3), i, np.uint8))
    px4, companion, wire = FakePx4(3, 13, 0.0, 0.0, 5.0), Watcher(), Wire(3, 1, skip=())
    ports = {AUTOPILOT_LINK: open_port(f"udpin:127.0.0.1:{free_port()}")}
    address = ports[AUTOPILOT_LINK]._socket.getsockname()  # type: ignore[attr-defined]
    runner = Runner(companion, ports, open_camera(str(tmp_path)), tmp_path, 0)
    began_ns = time.monotonic_ns()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.setblocking(False)
        while len(companion.seen) < 4 and time.monotonic_ns() - began_ns < 5e9:
            for msg in px4.on_time((time.monotonic_ns() - began_ns) // 1000):
                autopilot.sendto(wire.encode(msg), address)
            runner.step()
        runner.close()
        heard = Wire(skip=()).decode(autopilot.recv(512))
    assert companion.seen == [(200_000, 0), (400_000, 1), (600_000, 2), (800_000, 3)]
    assert [(msg.get_type(), msg.get_srcSystem(), msg.get_srcComponent()) for msg in heard] == [("HEARTBEAT", 3, 191)]
    assert (tmp_path / "autopilot.tlog").stat().st_size > 1000


class Lens:
    """A camera that gives nothing, and ends by itself or by an error."""

    def __init__(self, clock: Literal["vehicle", "host", "file"], error: Exception | None = None) -> None:
        self.clock, self.error, self.ended = clock, error, False

    def read(self) -> None:
        self.ended = True
        if self.error is not None:
            raise self.error

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    ("lens", "told"),
    [
        (Lens("host"), "camera: the stream has ended, and no frame comes any more; look after the camera, then begin"),
        (Lens("vehicle"), "camera: the stream has ended"),
        (Lens("host", CameraError("shm:x: gone")), "camera: shm:x: gone\n"),
        (Lens("host", ValueError("two\nlines")), "camera: ValueError: two lines\n"),
        (Lens("file"), ""),
    ],
    ids=["stream", "feed", "camera-error", "other-error", "file"],
)
def test_a_camera_that_ends_is_told_once_and_a_file_just_ends(
    lens: Lens, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    runner = Runner(Watcher(), {AUTOPILOT_LINK: open_port("udpin:127.0.0.1:0")}, lens, None, 0)
    assert runner._frames is not None
    runner._frames._thread.join(HEARD_LIMIT_S)
    runner.step()
    runner.step()
    runner.close()
    heard = capsys.readouterr().err
    assert heard.startswith(told)
    assert heard.count("\n") == (1 if told else 0)


def test_a_camera_that_is_let_go_has_not_ended() -> None:
    lens = Lens("host")
    lens.read = lambda: time.sleep(0.05)  # type: ignore[method-assign]
    frames = LiveFrames(lens, BootClock(), 0)
    frames.close()
    assert frames.error is None


def test_a_recorded_frame_that_cannot_be_read_is_told_and_the_next_ones_come(tmp_path: Path) -> None:
    (tmp_path / "100000.png").write_bytes(b"no picture")
    cv2.imwrite(str(tmp_path / "200000.png"), np.zeros((48, 64, 3), np.uint8))
    clock = BootClock()
    clock.heard(0, Wire(skip=()).decode(Wire(1, 1).encode(mavlink.MAVLink_system_time_message(0, 1000)))[0])
    frames = LiveFrames(open_camera(str(tmp_path)), clock, 0)
    assert frames.take(0) == []
    assert frames.error == f"{tmp_path / '100000.png'}: not a picture that can be read"
    assert [frame.time_usec for frame in frames.take(0)] == [200_000]
    frames.close()


def test_frames_of_a_stream_get_the_vehicles_time() -> None:
    clock = BootClock()
    assert clock.boot_us(0) is None
    for boot_ms, delay_us in ((1000, 30_000), (1020, 4_000), (1040, 50_000)):
        msg = Wire(skip=()).decode(Wire(1, 1).encode(mavlink.MAVLink_global_position_int_message(boot_ms, *[0] * 8)))[0]
        clock.heard(7_000_000 + boot_ms * 1000 + delay_us, msg)
    assert clock.boot_us(8_100_000) == 8_100_000 - 7_004_000


@pytest.mark.parametrize(
    "url",
    [
        "",
        "udpin:",
        "udpin:0.0.0.0:99999",
        "udpin:0.0.0.0:²",
        "udpin:0.0.0.0:١٢٣",
        "udpout:127.0.0.1:0",
        "udpout:127.0.0.1:" + "9" * 5000,
        "tcp:1.2.3.4:5",
        "/dev/ttyS0:fast",
        "/dev/ttyS0:²",
    ],
)
def test_a_wrong_link_is_told_with_what_is_allowed(url: str) -> None:
    with pytest.raises(LinkError, match="allowed: "):
        open_port(url)


@pytest.mark.parametrize("kind", ["udpin", "udpout"])
def test_a_host_that_is_no_name_or_that_nobody_knows_is_told(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LinkError, match=f"{kind}:a..b:15999: host 'a..b' can't be resolved .*give the host's address"):
        open_port(f"{kind}:a..b:15999")

    def unknown(*_: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(LinkError, match=f"{kind}:nosuch:14600: host 'nosuch' can't be resolved .Name or service not"):
        open_port(f"{kind}:nosuch:14600")


def test_a_name_is_looked_up_when_the_port_is_opened() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(HEARD_LIMIT_S)
        port = open_port(f"udpout:localhost:{vehicle.getsockname()[1]}")
        assert port._remote == vehicle.getsockname()  # type: ignore[attr-defined]
        port.send(b"hello")
        assert vehicle.recv(16) == b"hello"
        port.close()


class Sends:
    """A socket that fails."""

    def __init__(self, error: OSError) -> None:
        self.error = error

    def sendto(self, data: bytes, address: object) -> None:
        raise self.error


@pytest.mark.parametrize("number", [errno.ECONNREFUSED, errno.ENETUNREACH, errno.EHOSTUNREACH, errno.EAGAIN])
def test_what_may_pass_loses_a_frame(number: int) -> None:
    port = open_port("udpout:127.0.0.1:9")
    port.close()
    port._socket = Sends(OSError(number, "passes"))  # type: ignore[attr-defined]
    port.send(b"lost")
    port._socket = Sends(TimeoutError("timed out"))  # type: ignore[attr-defined]
    port.send(b"lost")


def test_a_serial_device_that_is_unplugged_is_told_once_and_is_not_waited_for(
    capsys: pytest.CaptureFixture[str],
) -> None:
    far, near = os.openpty()
    port = open_port(os.ttyname(near))
    os.close(near)
    runner = Runner(Watcher(), {AUTOPILOT_LINK: port}, None, None, 0)
    beat = Wire(3, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))
    os.write(far, beat)
    runner.step()
    assert runner.harness.companion.system_id == 3
    os.close(far)
    for _ in range(3):
        runner.step()
    assert wait(runner.harness.links, 0.0) == [AUTOPILOT_LINK], "it may come back"
    runner.close()
    told = capsys.readouterr().out
    assert told.count("can't be read") == 1 and f"text: autopilot link: {port._device}: can't be read" in told  # type: ignore[attr-defined]


def test_a_full_disk_ends_the_events_of_a_companion_and_not_its_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "events.jsonl").symlink_to("/dev/full")
    watcher = Watcher()
    runner = Runner(watcher, {AUTOPILOT_LINK: open_port("udpin:127.0.0.1:0")}, None, tmp_path, 0)
    for text in ("one", "two"):
        watcher.onboard.note("text", text)
        runner.step()
    runner.close()
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("text: ")]
    assert told == ["text: one", "text: events.jsonl ends: No space left on device", "text: two"]


def test_what_could_be_sent_once_ends_no_flight_later() -> None:
    port = open_port("udpout:127.0.0.1:9")
    port.send(b"sent")
    port.close()
    port._socket = Sends(OSError(errno.EACCES, "Permission denied"))  # type: ignore[attr-defined]
    port.send(b"lost")
    port._sent = False  # type: ignore[attr-defined]
    with pytest.raises(LinkError, match=r"nothing can be sent to UDP 127\.0\.0\.1:9: Permission denied"):
        port.send(b"never")


@pytest.mark.usefixtures("signals_as_before")
def test_an_address_to_which_nothing_can_be_sent_ends_it_with_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--mission", "agriculture-inspect", "--connect", "udpout:255.255.255.255:14600"]) == 1
    told = capsys.readouterr().err
    assert told.endswith(
        "main: nothing can be sent to UDP 255.255.255.255:14600: Permission denied; give another address\n"
    )
    assert told.count("\n") == 1


def test_a_port_in_use_is_told() -> None:
    first = open_port(f"udpin:127.0.0.1:{free_port()}")
    port = first._socket.getsockname()[1]  # type: ignore[attr-defined]
    with pytest.raises(LinkError, match=f"UDP port {port} can't be bound"):
        open_port(f"udpin:127.0.0.1:{port}")
    first.close()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--mission", "dance", "--connect", "udpin:127.0.0.1:0"], "there is no mission 'dance'"),
        (["--mission", "agriculture-scout", "--connect", "udpin:127.0.0.1:0"], "option plan: missing"),
        (["--mission", "agriculture-inspect", "--connect", "nowhere"], "'nowhere': no link"),
        (
            ["--mission", "agriculture-inspect", "--connect", "udpin:127.0.0.1:0", "--peer", "udpout:a..b:15999"],
            "udpout:a..b:15999: host 'a..b' can't be resolved (no name of a host); correct the name",
        ),
        (
            ["--mission", "agriculture-inspect", "--connect", "udpin:127.0.0.1:0", "--camera", "none"],
            "none: there is no",
        ),
        (["--mission", "agriculture-inspect", "--connect", "udpin:127.0.0.1:0", "--option", "x"], "NAME=VALUE"),
        *(
            (
                ["--mission", "agriculture-inspect", "--connect", "udpin:127.0.0.1:0", f"--camera-latency={seconds}"],
                f"--camera-latency {seconds}: allowed: seconds, 0 to 60",
            )
            for seconds in ("nan", "inf", "-inf", "1e+305", "-1")
        ),
        (
            ["--mission", "agriculture-inspect", "--connect", "udpin:127.0.0.1:0", "--log-dir", "/dev/null/logs"],
            "--log-dir /dev/null/logs: can't write there: Not a directory; name another folder",
        ),
    ],
)
def test_what_keeps_it_from_beginning_is_told_in_one_line(
    arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert text in told
    assert told.count("\n") == 1


@pytest.fixture
def signals_as_before() -> Iterator[None]:
    """`main` takes SIGINT and SIGTERM."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("signals_as_before")
def test_it_runs_until_somebody_stops_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ended = threading.Event()

    def stop() -> None:
        while not ended.wait(0.2):
            os.kill(os.getpid(), signal.SIGTERM)

    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    stopper = threading.Thread(target=stop)
    stopper.start()
    link = f"udpin:127.0.0.1:{free_port()}"
    try:
        assert main(["--mission", "agriculture-inspect", "--connect", link, "--log-dir", str(tmp_path)]) == 0
    finally:
        ended.set()
        stopper.join()
    assert capsys.readouterr().out.endswith("outcome: success\n")
    assert (tmp_path / "autopilot.tlog").exists()


def test_a_companion_on_udpout_knocks_until_its_vehicle_is_known() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(5.0)
        port = open_port(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}")
        runner = Runner(Watcher(), {AUTOPILOT_LINK: port}, None, None, 0)
        runner.step()
        data, companion = vehicle.recvfrom(2048)
        knock = Wire().decode(data)[0]
        assert (knock.get_type(), knock.get_srcSystem(), knock.get_srcComponent()) == ("HEARTBEAT", 255, 191)
        vehicle.sendto(Wire(3, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)), companion)
        runner.step()
        assert Wire().decode(vehicle.recv(2048))[0].get_srcSystem() == 3
        runner.close()


def test_udpout_speaks_first_and_udpin_answers_whoever_spoke() -> None:
    port = free_port()
    server, client = open_port(f"udpin:127.0.0.1:{port}"), open_port(f"udpout:127.0.0.1:{port}")
    server.send(b"to nobody")
    client.send(b"hello")
    select.select([server], [], [], HEARD_LIMIT_S)
    assert server.receive() == b"hello"
    server.send(b"you too")
    select.select([client], [], [], HEARD_LIMIT_S)
    assert client.receive() == b"you too"
    assert client.receive() is None
    server.close()
    client.close()
