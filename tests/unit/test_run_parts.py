"""Small parts of a run: frames in datagrams, control channels, speeds shown, scenario files."""

import io
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions import registry
from sitl_emu.missions.companion.companion import Event, Status
from sitl_emu.run import configs
from sitl_emu.run.children import Child, obituary, start_process
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.live_view import LiveView, PlainView
from sitl_emu.run.messages import (
    BodyMotion,
    BodyPose,
    End,
    EventTold,
    Figures,
    FrameTaken,
    Listening,
    LooseAt,
    Message,
    Over,
    Progress,
    RadioCounts,
    Ready,
    Render,
    Rendered,
    SendVideo,
    Step,
    Stepped,
    Stop,
    VehicleAt,
    VehicleProgress,
    Waiting,
    decoded,
    encoded,
)
from sitl_emu.run.process import EXIT_EXPLAINED
from sitl_emu.run.scenario import find, load

STATUS = Status("scanning", 0.5, False, "", "flying the survey", {"dropped": 2})


def heartbeat(version: int) -> bytes:
    codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    return bytes(codec.heartbeat_encode(2, 12, 0, 0, 3).pack(codec, force_mavlink1=version == 1))


def channels() -> tuple[ControlChannel, ControlChannel]:
    one, other = socket.socketpair()
    return ControlChannel(one, "the camera"), ControlChannel(other, "the world")


def test_messages_cross_a_control_channel_whole_and_in_order() -> None:
    here, there = channels()
    for number in range(3):
        text = "ü" * 20_000 if number == 1 else ""
        here.send(Stop(f"{number}{text}"))
        assert there.expect(Stop) == Stop(f"{number}{text}")
    assert there.poll() is None
    here.send(Rendered(1))
    assert there.poll() == Rendered(1)
    here.send(Rendered(2))
    with pytest.raises(TypeError, match=r"the world said Rendered\(index=2, .*\), where Ready was due"):
        there.expect(Ready)
    here.close()
    there.close()


SILENT = """
import socket, sys, time
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import Ready, Rendered
there = ControlChannel(socket.socket(fileno=int(sys.argv[1])), "the world")
there.send(Ready())
while sys.argv[2] == "works" and time.process_time() < 2.0:
    pass
time.sleep(0.0 if sys.argv[2] == "works" else 600.0)
there.send(Rendered(1))
"""


@pytest.mark.parametrize("does", ["works", "sleeps"])
def test_a_silent_process_is_waited_for_as_long_as_it_works(does: str) -> None:
    one, other = socket.socketpair()
    camera = ControlChannel(one, "the camera", hung_after_s=0.5)  # far less than its work takes
    fd = other.fileno()
    process = subprocess.Popen([sys.executable, "-P", "-c", SILENT, str(fd), does], pass_fds=[fd])
    other.close()
    assert camera.receive() == Ready()
    if does == "works":
        assert camera.receive() == Rendered(1)
    else:
        with pytest.raises(ProcessLostError, match="the camera has not answered for"):
            camera.receive()
        process.kill()
    process.wait()
    camera.close()


TOLD = """#!/bin/sh
exec {python} -P -c '
from sitl_emu.run import configs, process
process.main(lambda config, control: print(len(config.options["area"])), configs.CompanionConfig)
' "$4"
"""


def test_a_process_is_told_more_than_an_argument_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "logs").mkdir()
    (tmp_path / "python").write_text(TOLD.format(python=sys.executable))
    (tmp_path / "python").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    config = configs.CompanionConfig(
        folder=str(tmp_path), start_us=0, seed=1, name="uas", instance=0, lockstep=True, mission="m",
        options={"area": [[47.397742, 8.545594]] * 9000}, radio_port=None, rings={}, inference_latency_us=0,
    )  # fmt: skip
    one, other = socket.socketpair()
    with one, other:
        child = start_process("companion uas", "companion_process", config, other, tmp_path)
        assert child.process.wait() == 0, child.log.read_text()
    assert child.log.read_text() == "9000\n"


FIGURES = Figures(60.0, 20.5, None, 900, 2, {"uas>ugv": RadioCounts(7, 1)}, ("uas",), {"uas": STATUS, "ugv": None})
FOUND = Event(100, "target_confirmed", "a weed", {"score": 0.75, "track": 3, "label": "weed"})
MESSAGES: list[Message] = [
    Waiting(),
    Ready(),
    Ready(14_600),
    Step(20_000, None, 3, (FrameTaken("camera", 4, 16_000), FrameTaken("depth", 5, 20_000))),
    Stepped(1, 2, STATUS, (FOUND, FOUND._replace(data={})), 2, False),
    Render(4, 16_000, BodyPose(0.1 + 0.2, -2.0, 1e-300, (1.0, 0.0, 0.0, 0.0))),
    Render(
        5,
        20_000,
        BodyPose(0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0)),
        (0.5, -0.5, 0.5, 0.5),
        (LooseAt({"name": "a", "mass_kg": 0.1}, (1.0, 2.0, -0.3), (0.5, 0.5, 0.5, 0.5)),),
        (VehicleAt("ugv", "rover", BodyPose(1.0, 2.0, -0.2, (1.0, 0.0, 0.0, 0.0)), True),),
        BodyMotion((1.0, 0.0, -0.1), (0.0, 0.0, 0.5)),
        keep=True,
    ),
    SendVideo(True),
    Listening({"outline": [[0.0, 1.0]], "objects": []}, (47.397742, 8.545594, 489.4, 0.0)),
    Progress(1.0, 0.5, {"uas": VehicleProgress(True, None, (1.0, 2.0, 3.0), None)}),
    EventTold(1.0, "uas", FOUND),
    Over("success", faults=("uas: gps off at 1.0 s",), figures=FIGURES),
    Over("", lost="camera uas has gone"),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_message_and_all_its_parts_come_out_as_they_went_in(message: Message) -> None:
    out = decoded(encoded(message))
    assert type(out) is type(message)
    assert repr(out) == repr(message), "parts are records again, and numbers to the last bit"


def test_a_channel_names_the_process_that_has_gone() -> None:
    here, there = channels()
    there.close()
    for call in (here.receive, here.poll, lambda: here.send(End())):
        with pytest.raises(ProcessLostError, match="the camera has gone"):
            call()
    here.close()


def status(time_s: float, wall_s: float) -> Progress:
    return Progress(time_s, wall_s, {"uas": VehicleProgress(True, STATUS, (1.0, 2.0, 3.0), 7)})


def test_the_live_view_shows_speed_phase_and_what_happened() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=140)
    view = LiveView("agriculture, seed 1", console)
    view.event(EventTold(3.0, "uas", Event(3_000_000, "target_confirmed", "weed", {})))
    view.status(status(0.0, 0.0))
    view.status(status(30.0, 10.0))
    view.close()
    text = console.file.getvalue()  # type: ignore[attr-defined]
    for shown in ("agriculture, seed 1", "3.0 x real time", "scanning", "flying the survey", "target_confirmed: weed"):
        assert shown in text


def test_without_a_terminal_there_are_plain_lines() -> None:
    console = Console(file=io.StringIO(), force_terminal=False, width=80)
    view = PlainView("agriculture, seed 1", console)
    view.status(status(0.0, 0.0))
    view.status(status(60.0, 20.0))
    view.event(EventTold(61.0, "uas", Event(61_000_000, "armed", "", {})))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert "\x1b" not in text
    assert "60.0 s  3.0 x real time; uas scanning 50%" in text and "uas      armed" in text


def test_every_scenario_that_a_mission_brings_can_be_read() -> None:
    assert "agriculture" in registry.scenarios()
    for name in registry.scenarios():
        assert load(find(name)).name == name


def test_files_beside_a_scenario_are_found_from_anywhere(tmp_path: Path) -> None:
    (tmp_path / "my.plan").write_text("{}")
    companion = "{mission: agriculture-scout, options: {plan: my.plan, approach_m: 1}}"
    vehicles = f"[{{name: uas, model: iris, companion: {companion}}}]"
    (tmp_path / "s.yaml").write_text(f"name: s\nworld: {{kind: flat}}\nvehicles: {vehicles}\n")
    uas = load(tmp_path / "s.yaml").vehicles[0]
    assert uas.companion is not None and uas.companion.options == {"plan": str(tmp_path / "my.plan"), "approach_m": 1}


@pytest.mark.parametrize(
    ("status", "log", "wanted"),
    [
        (EXIT_EXPLAINED, "t/run/uas.ulg: No space left on device\n", "autopilot uas: t/run/uas.ulg: No space left"),
        (EXIT_EXPLAINED, "", "autopilot uas: {log} has no room for why it ended"),
        (1, "", "autopilot uas (pid {pid}) ended with exit status 1 without a word"),
        (1, "Traceback\nKeyError: 7\n", "exit status 1; its log {log} ends:\n  Traceback\n  KeyError: 7"),
    ],
)
def test_an_obituary_has_the_last_words_or_why_there_are_none(
    tmp_path: Path, status: int, log: str, wanted: str
) -> None:
    process = subprocess.Popen([sys.executable, "-c", f"raise SystemExit({status})"])
    process.wait()
    path = tmp_path / "uas.log"
    path.write_text(log)
    assert wanted.format(log=path, pid=process.pid) in obituary(Child("autopilot uas", process, path))


def test_of_a_log_larger_than_memory_the_end_is_read(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", "raise SystemExit(1)"])
    process.wait()
    with (tmp_path / "uas.log").open("wb") as log:
        log.truncate(1 << 37)
        log.seek(0, io.SEEK_END)
        log.write(b"\nKeyError: 7\n")
    assert obituary(Child("companion uas", process, tmp_path / "uas.log", command=True)).endswith("\n  KeyError: 7")


def test_an_exit_status_of_the_users_autopilot_says_nothing_of_its_log(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", f"raise SystemExit({EXIT_EXPLAINED})"])
    process.wait()
    (tmp_path / "uas.log").write_text("KeyError: 7\nBye\n")
    told = obituary(Child("autopilot uas", process, tmp_path / "uas.log", outside=True))
    assert "ended with exit status 3" in told and "KeyError: 7" in told


def test_a_real_time_signal_is_named_by_its_number(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", "import os; os.kill(os.getpid(), 40)"])
    process.wait()
    told = obituary(Child("companion uas", process, tmp_path / "uas.log", command=True))
    assert told == f"companion uas (pid {process.pid}) was killed by signal 40; its log is {tmp_path / 'uas.log'}"
