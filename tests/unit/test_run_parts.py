"""Small parts of a run: frames in datagrams, control channels, speeds shown, scenario files."""

import io
import socket
from pathlib import Path

import pytest
from rich.console import Console

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions import registry
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.live_view import LiveView, PlainView
from sitl_emu.run.scenario import find, load

STATUS = {"phase": "scanning", "progress": 0.5, "done": False, "outcome": "", "text": "flying the survey"}


def heartbeat(version: int) -> bytes:
    codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    return bytes(codec.heartbeat_encode(2, 12, 0, 0, 3).pack(codec, force_mavlink1=version == 1))


def channels() -> tuple[ControlChannel, ControlChannel]:
    one, other = socket.socketpair()
    return ControlChannel(one, "the camera"), ControlChannel(other, "the world")


def test_messages_cross_a_control_channel_whole_and_in_order() -> None:
    here, there = channels()
    for number in range(3):
        here.send({"step": number, "text": "ü" * 20_000 if number == 1 else ""})
        assert there.receive()["step"] == number
    assert there.poll() is None
    here.send({"done": 1})
    assert there.poll() == {"done": 1}
    here.close()
    there.close()


def test_a_channel_names_the_process_that_has_gone() -> None:
    here, there = channels()
    there.close()
    for call in (here.receive, here.poll, lambda: here.send({"x": 1})):
        with pytest.raises(ProcessLostError, match="the camera has gone"):
            call()
    here.close()


def status(time_s: float, wall_s: float) -> dict[str, object]:
    vehicle = {"armed": True, "status": STATUS, "position": [1.0, 2.0, 3.0], "frames": 7}
    return {"time_s": time_s, "wall_s": wall_s, "vehicles": {"uas": vehicle}}


def test_the_live_view_shows_speed_phase_and_what_happened() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=140)
    view = LiveView("agriculture, seed 1", console)
    view.event({"time_s": 3.0, "vehicle": "uas", "event": "target_confirmed", "text": "weed"})
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
    view.event({"time_s": 61.0, "vehicle": "uas", "event": "armed"})
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
