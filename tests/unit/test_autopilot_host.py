"""The autopilot host over the memory channel: reboot, shutdown, parameters about the simulator, logs."""

import errno
import math
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil

from sitl_emu import vehicles
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.attitude import euler, quaternion
from sitl_emu.core.simulator_api import (
    SIMULATOR_PARAMETERS,
    STATE_BOOT,
    STATE_POWEROFF,
    AutopilotState,
    BesideMessage,
    CameraZoom,
    GimbalState,
    HilActuatorControls,
    MemoryChannel,
    SimulatorParameter,
    VideoState,
)
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.run import autopilot_command
from sitl_emu.run.autopilot_host import AutopilotHost, Hosted, HostPoll
from sitl_emu.run.link_logs import LinkLogs
from sitl_emu.run.link_sockets import Poll, PortInUseError
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

INSTANCE = 211
HOME = Home(47.4, 8.5, 490.0, 0.0)
START_US = 1_700_000_000_000_000
GCS = 0
REBOOT, SHUT_DOWN = 1, 2
CAMERA = 100


class Bench:
    """A hosted vehicle in its simulator, commanded without the wire."""

    def __init__(
        self,
        folder: Path,
        model: str = "iris",
        *,
        tells_gimbal: bool = False,
        pictures: bool = False,
        video: bool = False,
    ) -> None:
        vehicle = vehicles.load(model)
        storage.prepare(folder / "root")
        self.poll: HostPoll = Poll()
        hosted = Hosted(
            instance=INSTANCE,
            airframe=vehicle.airframe,
            camera=vehicle.camera,
            gimbal=vehicle.gimbal,
            root=folder / "root",
            start_us=START_US,
            tlog=folder / "iris",
            tells_gimbal=tells_gimbal,
            pictures=pictures,
            video=video,
        )
        self.host = AutopilotHost(hosted, self.poll)
        self.simulator = VehicleSimulator(vehicle, HOME, 1, FlatGround())
        self.channel = MemoryChannel()
        self.controls: HilActuatorControls | None = None
        self.beside: list[BesideMessage] = []
        self._station = mavlink.MAVLink(None, 255, 190)

    def tick(self, count: int = 1) -> None:
        for _ in range(count):
            self.channel.simulator.send(self.simulator.tick(self.controls))
            self.host.tick(self.channel.autopilot)
            self.controls = self.channel.simulator.receive()
            self.beside += self.channel.simulator.beside()

    def power(self, what: int) -> None:
        self.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, what)

    def command(self, command: int, *params: float) -> None:
        self.command_to(1, command, *params)

    def command_to(self, component: int, command: int, *params: float) -> None:
        filled = [*params, *[math.nan] * (7 - len(params))]
        message = mavlink.MAVLink_command_long_message(INSTANCE + 1, component, command, 0, *filled)
        self.host.autopilot.on_datagram(GCS, message.pack(self._station))


def test_the_simulator_is_told_where_the_gimbal_looks_once_and_whenever_it_turns(tmp_path: Path) -> None:
    """Only where somebody draws what its camera sees; in the simulator's frame, by the heading."""
    for tells in (True, False):
        bench = Bench(tmp_path / str(tells), "m600", tells_gimbal=tells)
        bench.tick(500)
        looks = [message for message in bench.beside if isinstance(message, GimbalState)]
        assert len(looks) == tells, "it looks down all the while"
        if tells:
            assert euler(looks[0].q)[1] == pytest.approx(-math.pi / 2, abs=1e-3)
            bench.beside.clear()
            gimbal = bench.host._gimbal
            assert gimbal is not None
            gimbal._set_attitude(quaternion(0.0, -0.5, 0.0), (math.nan,) * 3, 0)
            bench.tick(400)
            looks = [message for message in bench.beside if isinstance(message, GimbalState)]
            assert 100 < len(looks) < 250, "at each tick on its way: 61 degrees at 90 a second"
            assert euler(looks[-1].q)[1] == pytest.approx(-0.5, abs=1e-3)
        bench.host.close()


@pytest.mark.parametrize(("model", "pictures"), [("m600", True), ("m600", False), ("iris", True)])
def test_the_simulator_is_told_how_far_a_camera_has_zoomed_that_can(tmp_path: Path, model: str, pictures: bool) -> None:
    """Only where somebody draws what it sees."""
    bench = Bench(tmp_path, model, pictures=pictures)

    def zooms() -> list[float]:
        return [message.percent for message in bench.beside if isinstance(message, CameraZoom)]

    tells = model == "m600" and pictures
    bench.tick(5)
    assert zooms() == [0.0] * tells
    bench.command_to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_ZOOM, mavlink.ZOOM_TYPE_RANGE, 40.0)
    bench.tick(50)
    assert zooms() == [0.0, 40.0] * tells
    bench.command_to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_ZOOM, mavlink.ZOOM_TYPE_CONTINUOUS, 1.0)
    bench.tick(250)
    if tells:
        assert len(zooms()) == pytest.approx(252, abs=3), "at each tick on its way"
        assert zooms()[-1] == pytest.approx(60.0, abs=0.3), "20 percent a second"
        assert zooms() == sorted(zooms())
    bench.power(REBOOT)
    bench.tick(10)
    assert zooms()[-1:] == [0.0] * tells, "it begins anew"
    bench.host.close()


@pytest.mark.parametrize("video", [True, False])
def test_the_simulator_is_told_when_video_is_to_be_sent_and_when_no_more(tmp_path: Path, video: bool) -> None:
    bench = Bench(tmp_path, video=video)
    bench.tick(5)
    assert said(bench) == [VideoState(True)] * video, "from power-on"
    bench.tick(200)
    bench.command_to(CAMERA, mavlink.MAV_CMD_VIDEO_STOP_STREAMING, 1)
    bench.tick(5)
    assert said(bench) == [VideoState(True), VideoState(False)] * video
    bench.power(REBOOT)
    bench.tick(10)
    assert said(bench) == [VideoState(True), VideoState(False), VideoState(True)] * video, "it begins anew"
    bench.host.close()


def said(bench: Bench) -> list[VideoState]:
    return [message for message in bench.beside if isinstance(message, VideoState)]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.host.close()


def gcs_port_is_free() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        try:
            tried.bind(("0.0.0.0", ports.gcs(INSTANCE).local))
        except OSError:
            return False
        return True


def test_after_a_reboot_time_since_boot_begins_anew_and_what_was_stored_is_there(bench: Bench) -> None:
    bench.tick(50)
    first = bench.host.autopilot
    first.parameters.set("MPC_XY_CRUISE", 3.5)
    bench.beside.clear()
    bench.power(REBOOT)
    bench.tick()
    assert bench.beside == [AutopilotState(STATE_BOOT)]
    bench.tick(10)
    second = bench.host.autopilot
    assert second is not first and bench.host.boots == 2
    assert second.now_us == 40_000 and bench.simulator.time_usec == 61 * 4000
    assert second.parameters["MPC_XY_CRUISE"] == 3.5
    assert second.mavlink.context.boot_unix_us == START_US + 51 * 4000
    assert bench.controls is not None and bench.controls.time_usec > 51 * 4000
    assert {message.name for message in bench.beside if isinstance(message, SimulatorParameter)} == set(
        SIMULATOR_PARAMETERS
    )


def test_after_a_shutdown_motors_stand_still_and_ports_are_free(bench: Bench) -> None:
    bench.tick(10)
    assert not gcs_port_is_free()
    bench.power(SHUT_DOWN)
    bench.tick()
    assert bench.host.off and gcs_port_is_free()
    assert bench.beside[-1] == AutopilotState(STATE_POWEROFF)
    assert bench.controls is not None and bench.controls.mode == 0 and set(bench.controls.controls) == {0.0}
    bench.host.close()


def test_a_command_that_comes_in_the_same_tick_does_not_hide_a_reboot(bench: Bench) -> None:
    bench.tick(10)
    bench.power(REBOOT)
    bench.command(mavlink.MAV_CMD_DO_SET_ROI_NONE)
    bench.tick()
    assert bench.host.boots == 2


def test_what_passes_on_the_links_is_logged_over_a_reboot(bench: Bench, tmp_path: Path) -> None:
    bench.tick(500)
    bench.power(REBOOT)
    bench.tick(500)
    bench.host.close()
    log = mavutil.mavlink_connection(str(tmp_path / "iris-gcs.tlog"))
    stamps, boots_ms = list[float](), list[int]()
    while (message := log.recv_match(type="ATTITUDE")) is not None:
        stamps.append(message._timestamp)
        boots_ms.append(message.time_boot_ms)
    log.close()
    assert stamps == sorted(stamps) and stamps[0] >= START_US / 1e6 and stamps[-1] > START_US / 1e6 + 3.5
    assert max(boots_ms) < 2100


def test_a_full_disk_ends_the_logs_and_not_the_flight(
    bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.tick(10)
    with monkeypatch.context() as full:
        full.setattr(TlogWriter, "write", no_space)
        bench.tick(500)
    said = capsys.readouterr().err
    assert said.startswith(f"sitl-emu: telemetry log {tmp_path / 'iris-'}") and said.count("\n") == 1
    assert said.endswith(".tlog: No space left on device; logging stops\n")
    bench.tick(500)
    bench.host.close()
    assert capsys.readouterr().err == ""


def test_a_run_whose_logs_are_its_result_ends_where_the_disk_is_full(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = LinkLogs(tmp_path / "uas", ["gcs", "onboard"], must_log=True)
    monkeypatch.setattr(TlogWriter, "write", no_space)
    with pytest.raises(OSError, match="No space left"):
        logs.write(START_US, GCS, bytes.fromhex("fd000000000000000000000000"))
    logs.close()
    assert capsys.readouterr().err == ""


def test_the_logs_of_an_earlier_launch_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "iris-0-onboard.tlog").write_bytes(b"precious")
    with pytest.raises(FileExistsError) as refused:
        LinkLogs(tmp_path / "iris-0", ["gcs", "onboard"])
    assert refused.value.filename == str(tmp_path / "iris-0-onboard.tlog")
    assert "name another folder with --tlog" in (refused.value.strerror or "")
    assert [path.name for path in tmp_path.iterdir()] == ["iris-0-onboard.tlog"]
    assert (tmp_path / "iris-0-onboard.tlog").read_bytes() == b"precious"


def test_a_log_that_cannot_be_begun_says_why(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"can't write telemetry log .*: No such file") as refused:
        LinkLogs(tmp_path / "no" / "iris-0", ["gcs"])
    assert refused.value.errno == errno.ENOENT and "choose another folder" in (refused.value.strerror or "")


def no_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_port_in_use_is_said_and_nothing_stays_open(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("0.0.0.0", ports.gimbal(INSTANCE).local))
        with pytest.raises(PortInUseError, match="gimbal"):
            Bench(tmp_path)
    assert gcs_port_is_free()


@pytest.mark.parametrize(
    ("gcs", "wanted"),
    [
        ("192.168.1..20", "there is no host '192.168.1..20'"),
        ("127.0.0.1:²", "give HOST or HOST:PORT, such as 192.168.1.20:14550"),
    ],
)
def test_a_mistyped_ground_station_is_told_before_a_simulator_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gcs: str, wanted: str
) -> None:
    monkeypatch.setattr(sys, "argv", ["autopilot", "--model", "iris", "--gcs", gcs])
    assert autopilot_command.main() == autopilot_command.BAD_INPUT
    assert capsys.readouterr().err == f"autopilot: --gcs {gcs}: {wanted}\n"


def test_a_simulator_s_host_that_nobody_knows_is_told_and_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def unknown(*_: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    monkeypatch.setattr(sys, "argv", ["autopilot", "--model", "iris", "--simulator", "nosuch.invalid"])
    assert autopilot_command.main() == autopilot_command.BAD_INPUT
    said = capsys.readouterr().err
    assert said.startswith("autopilot: --simulator nosuch.invalid: there is no host 'nosuch.invalid'; give its name")


def test_the_ground_station_may_have_a_port_as_for_a_launch(monkeypatch: pytest.MonkeyPatch) -> None:
    for gcs, port in (("127.0.0.1:14560", 14560), ("127.0.0.1", ports.GCS_REMOTE)):
        monkeypatch.setattr(sys, "argv", ["autopilot", "--model", "iris", "--gcs", gcs])
        assert autopilot_command._hosted(autopilot_command._options()).gcs == ("127.0.0.1", port)
