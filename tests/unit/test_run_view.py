"""The page of a run: what it is told of a folder, in which order, while the folder grows, and whom it tells nothing."""

import http.client
import json
import math
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.autopilot.events.events import layout, pack
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.statustext import messages_of
from sitl_emu.gcs.tlog import TlogReader, TlogWriter
from sitl_emu.run.recorder import LOOSE_COLUMNS, TRUTH_HEADER
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.view.listening import listen
from sitl_emu.run.view.reading import RunReader
from sitl_emu.run.view.rerun_recording import camera_path
from sitl_emu.run.view.rows import Rows, facts
from sitl_emu.run.view.server import PAGE, PageServer
from sitl_emu.run.view.telemetry import HomeAt, Route, State, TelemetryReader, Text, Told

START_US = 1_781_514_000_000_000
"""2026-06-15T09:00:00Z, the default of a scenario."""
SCENARIO = "name: look\nseed: 7\nworld: world.yaml\nvehicles:\n- {name: a, model: iris, camera: {mount: nadir}}\n"
WORLD = "name: plain\norigin: {lat_deg: 47.0, lon_deg: 8.0, alt_amsl_m: 400}\nplaces: {home: {north_m: 0, east_m: 0}}\n"
SUMMARY = {"outcome": "success", "lines": ["all seen"], "faults": [], "faults_left": [], "simulated_s": 3.0}


class Vehicle:
    """Frames as a vehicle and its ground station send them."""

    def __init__(self, system: int = 1, component: int = 1) -> None:
        self._codec = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)

    def frame(self, msg: mavlink.MAVLink_message) -> bytes:
        return bytes(msg.pack(self._codec))


VEHICLE, STATION = Vehicle(), Vehicle(255, 190)


def heartbeat(custom_mode: int = 4 << 16 | 4 << 24, base_mode: int = 157) -> bytes:
    return VEHICLE.frame(mavlink.MAVLink_heartbeat_message(2, 12, base_mode, custom_mode, 4, 3))


def item(seq: int, lat: float, lon: float, kind: int = 0) -> bytes:
    at = (round(lat * 1e7), round(lon * 1e7), 15.0)
    return STATION.frame(mavlink.MAVLink_mission_item_int_message(1, 1, seq, 6, 16, 0, 1, 0, 0, 0, 0, *at, kind))


def upload(*items: bytes, kind: int = 0) -> list[bytes]:
    counted = STATION.frame(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
    return [counted, *items, VEHICLE.frame(mavlink.MAVLink_mission_ack_message(255, 190, 0, kind))]


def told(frames: list[bytes], step_s: float = 1.0, **how: bool) -> list[Told]:
    reader = TelemetryReader(**how)
    answers = [reader.read(step_s * place, frame) for place, frame in enumerate(frames)]
    return [one for one in answers if one is not None]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run under way: a vehicle with its telemetry, track, events, a frame and its detections."""
    made = tmp_path / "run"
    (made / "frames").mkdir(parents=True)
    (made / "feeds/a-camera").mkdir(parents=True)
    (made / "scenario.yaml").write_text(SCENARIO)
    (made / "world.yaml").write_text(WORLD)
    (made / "truth-a.csv").write_text(TRUTH_HEADER + row(0.1, 0.0) + row(0.2, 1.0) + row(0.3, 2.0) + row(0.4, 3.0))
    with TlogWriter(made / "a-gcs.tlog") as log:
        log.write(START_US + 500_000, heartbeat())
        log.write(START_US + 600_000, VEHICLE.frame(messages_of("Armed by ground", 4, 1)[0]))
    events = [
        {"time_s": 0.4, "vehicle": "a", "event": "armed"},
        {"time_s": 0.9, "vehicle": "a", "event": "found", "label": "x", "lat_deg": 47.001, "lon_deg": 8.0},
    ]
    (made / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    (made / "feeds/a-camera/200000.jpg").write_bytes(b"a picture")
    looked = {
        "time_s": 0.2,
        "found": [["x", 0.9, 20.0, 20.0, 4.0, 4.0]],
        "candidates": [["x", 0.5, 47.0, 8.001, 2.0, 3]],
    }
    (made / "a-detections.jsonl").write_text(
        json.dumps(looked) + "\n" + json.dumps({"time_s": 0.3, "found": []}) + "\n"
    )
    return made


def row(time_s: float, north_m: float) -> str:
    return f"{time_s:.2f},{north_m:.3f},0.000,-5.000,3.000,4.000,0.000,0.70711,0.00000,0.00000,0.70711\n"


def test_rows_are_in_the_worlds_metres_and_in_simulated_time(folder: Path) -> None:
    reader = RunReader(folder)
    rows = Rows(reader).of(reader.read())
    assert rows["track"]["a"] == [[0.2, 1.0, 0.0, 5.0, 90.0, 5.0], [0.4, 3.0, 0.0, 5.0, 90.0, 5.0]], "5 Hz of 10"
    assert rows["state"]["a"] == [[0.5, {"mode": "mission", "armed": True, "heard_s": 0.5}]]
    assert [(event["time_s"], event["event"]) for event in rows["events"]] == [
        (0.4, "armed"),
        (0.6, "statustext"),
        (0.9, "found"),
    ]
    assert rows["events"][1]["severity"] == "warning" and rows["events"][1]["text"] == "Armed by ground"
    assert rows["events"][2]["north_m"] == pytest.approx(111.2, abs=0.2) and rows["events"][2]["east_m"] == 0.0
    assert rows["frames"]["a"] == [[0.2, "feeds/a-camera/200000.jpg"]]
    assert rows["looked"]["a"] == [[0.2, [["x", 0.9, 20.0, 20.0, 4.0, 4.0]]]], "not where nothing was found"
    ((_, ((label, score, north_m, east_m, *rest),)),) = rows["candidates"]["a"]
    assert (label, score, north_m, rest) == ("x", 0.5, 0.0, [2.0, 3]) and east_m == pytest.approx(76.0, abs=0.3)


def test_a_folder_that_grows_gives_what_is_new_and_no_half_lines(folder: Path) -> None:
    reader = RunReader(folder)
    rows = Rows(reader)
    rows.of(reader.read())
    assert rows.of(reader.read()) == {}
    with (folder / "truth-a.csv").open("a") as truth, (folder / "events.jsonl").open("a") as events:
        truth.write(row(0.5, 4.0) + row(0.6, 5.0)[:20])
        events.write('{"time_s": 1.0, "vehicle": "a", "ev')
        truth.flush(), events.flush()  # type: ignore[func-returns-value]
        assert rows.of(reader.read()) == {}
        truth.write(row(0.6, 5.0)[20:])
        events.write('ent": "disarmed"}\n')
    new = rows.of(reader.read())
    assert new["track"]["a"] == [[0.6, 5.0, 0.0, 5.0, 90.0, 5.0]]
    assert new["events"] == [{"time_s": 1.0, "vehicle": "a", "event": "disarmed"}]


def test_rows_of_the_truth_that_are_no_numbers_are_left_out(folder: Path) -> None:
    reader = RunReader(folder)
    reader.read()
    with (folder / "truth-a.csv").open("a") as truth:
        truth.write(row(0.5, 4.0).replace("4.000", "4.0.0") + row(0.6, math.nan) + row(0.7, 6.0))
    assert [each.time_s for each in reader.read().vehicles["a"].truth] == [0.7]


def test_a_vehicle_whose_own_folder_has_gone_is_shown_without_its_camera(tmp_path: Path, folder: Path) -> None:
    assert facts(RunReader(folder))["vehicles"] == [{"name": "a", "model": "iris", "camera": [640, 480]}]
    (folder / "scenario.yaml").write_text(SCENARIO.replace("iris", str(tmp_path / "gone/my_quad")))
    assert facts(RunReader(folder))["vehicles"] == [{"name": "a", "model": "my_quad", "camera": None}]
    assert camera_path(RunReader(folder).scenario.vehicles[0]) == "world/a/camera", "of a recording for Rerun, too"


def test_what_is_no_folder_of_a_run_is_named(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(Trouble, match="there is no such folder"):
        RunReader(tmp_path / "nowhere")
    with pytest.raises(Trouble, match=r"no folder of a run: it has no scenario\.yaml"):
        RunReader(tmp_path)
    (folder / "world.yaml").unlink()
    with pytest.raises(Trouble, match=r"no folder of a run: it has no world\.yaml"):
        RunReader(folder)
    (folder / "world.yaml").write_text("name: [")
    with pytest.raises(Trouble, match=r"world\.yaml"):
        RunReader(folder)


def test_state_tells_what_changed_and_that_the_vehicle_was_heard() -> None:
    states = told([heartbeat(), heartbeat(), heartbeat(4 << 16 | 3 << 24, 29)])
    assert states == [
        State(0.0, {"mode": "mission", "armed": True, "heard_s": 0.0}),
        State(1.0, {"heard_s": 1.0}),
        State(2.0, {"mode": "hold", "armed": False, "heard_s": 2.0}),
    ]


def test_what_comes_often_is_looked_at_twice_a_second() -> None:
    assert [one.time_s for one in told([heartbeat()] * 11, 0.1)] == [0.0, 0.5, 1.0]


def test_other_components_and_systems_say_nothing_of_the_vehicle() -> None:
    gimbal = Vehicle(1, 154).frame(mavlink.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3))
    other = Vehicle(2, 1).frame(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
    assert told([gimbal, heartbeat(), other]) == [State(1.0, {"mode": "mission", "armed": True, "heard_s": 1.0})]


def test_a_mission_is_a_route_once_the_vehicle_has_accepted_it() -> None:
    frames = [heartbeat(), *upload(item(0, 47.0, 8.0), item(1, 47.1, 8.1))]
    assert [type(one) for one in told(frames[:-1], route_alone=True)] == []
    (route,) = told(frames, route_alone=True)
    assert isinstance(route, Route)
    assert [(point.lat_deg, point.lon_deg, point.item) for point in route.waypoints] == [(47.0, 8.0, 0), (47.1, 8.1, 1)]
    assert told([heartbeat(), *upload(item(0, 47.0, 8.0, 1), kind=1)], route_alone=True) == [], "a geofence is no route"


def test_home_and_texts_are_told() -> None:
    place = (470000000, 80000000, 400000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
    home = VEHICLE.frame(mavlink.MAVLink_home_position_message(*place))
    chunks = [VEHICLE.frame(one) for one in messages_of("x" * 60, 2, 5)]
    assert told([heartbeat(), home, *chunks])[1:] == [HomeAt(1.0, 47.0, 8.0), Text(3.0, "critical", "x" * 60)]


def px4_event(name: str, level: int, *arguments: float) -> bytes:
    number, formats = layout(name)
    packed = list(pack(formats, arguments).ljust(40, b"\0"))
    return VEHICLE.frame(mavlink.MAVLink_event_message(number, 5, 0, 0, 0, level << 4 | level, packed))


def test_px4s_events_are_told_in_words_but_for_reports_of_checks() -> None:
    frames = [
        px4_event("commander_armed_by", 6, 4),
        px4_event("commander_failsafe_enter_generic", 2, 5 << 16, 1),
        px4_event("check_modes_mission", 6, 0, 0),
        px4_event("commander_arming_check_summary", 8, 0, 0, 0, 0, 0),
        px4_event("mission_climb_before_start", 6, 15.5),
    ]
    texts = [one for one in told([heartbeat(), *frames]) if isinstance(one, Text)]
    assert [(one.time_s, one.severity, one.kind) for one in texts] == [
        (1.0, "info", "px4"),
        (2.0, "critical", "px4"),
        (5.0, "info", "px4"),
    ]
    assert re.fullmatch(r"commander armed by: [a-z ]+", texts[0].text)
    assert texts[2].text == "mission climb before start: 15.5"


def test_a_damaged_frame_tells_nothing() -> None:
    frame = bytearray(heartbeat())
    frame[-1] ^= 0xFF
    assert told([bytes(frame)]) == []


@given(st.lists(st.integers(1, 400), max_size=12))
def test_a_telemetry_log_is_read_in_any_pieces(sizes: list[int]) -> None:
    frames = [heartbeat(), *upload(item(0, 47.0, 8.0))] * 3
    data = b"".join(place.to_bytes(8, "big") + frame for place, frame in enumerate(frames))
    reader, read, at = TlogReader(), list[tuple[int, bytes]](), 0
    for size in [*sizes, len(data)]:
        read += reader.feed(data[at : at + size])
        at += size
    assert read == list(enumerate(frames))


@pytest.fixture
def server(folder: Path) -> Iterator[PageServer]:
    made = PageServer(folder, listen())
    thread = threading.Thread(target=made.serve_forever)
    thread.start()
    yield made
    (folder / "summary.json").write_text(json.dumps(SUMMARY))
    made.finish()
    thread.join()
    made.server_close()


def get(server: PageServer, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    answer = connection.getresponse()
    made = (answer.status, answer.read(), dict(answer.getheaders()))
    connection.close()
    return made


def batches(stream: bytes) -> list[Any]:
    return [json.loads(line) for line in re.findall(rb"^data: (.*)$", stream, re.MULTILINE)]


def test_the_stream_tells_the_run_so_far_then_what_comes_and_then_ends(server: PageServer, folder: Path) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    connection.request("GET", "/stream")
    answer = connection.getresponse()
    assert answer.getheader("Content-Type") == "text/event-stream"
    first = json.loads([answer.readline(), answer.readline(), answer.readline()][1].removeprefix(b"data: "))
    assert first["track"]["a"] and first["state"]["a"]
    with (folder / "truth-a.csv").open("a") as truth:
        truth.write(row(0.5, 4.0) + row(0.6, 5.0))
    (folder / "summary.json").write_text(json.dumps(SUMMARY))
    rest = answer.read()
    connection.close()
    told = batches(rest)
    assert [time_s for batch in told for time_s, *_ in batch.get("track", {}).get("a", [])] == [0.6]
    (over,) = [batch["over"] for batch in told if "over" in batch]
    assert over["outcome"] == "success" and over["success"] is True and over["lines"] == ["all seen"]
    assert rest.endswith(b"event: end\ndata: {}\n\n")
    _, again, _ = get(server, "/stream", Last_Event_ID="1")
    assert batches(again) == told, "a page that comes back is told what it has missed, and nothing twice"


def test_a_run_that_can_not_be_read_on_ends_the_stream_and_is_told_in_a_line(
    server: PageServer, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails() -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(server._reader, "read", fails)
    assert get(server, "/stream")[1].endswith(b"event: end\ndata: {}\n\n")
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"sitl-emu: {folder}: can't be read on, the page ends here: PermissionError: ")


def test_the_page_is_whole_and_asks_nobody_else(server: PageServer) -> None:
    status, page, headers = get(server, "/")
    assert status == 200 and headers["Content-Security-Policy"].startswith("default-src 'self'")
    assert re.findall(rb'(?:src|href)="(https?:)?//', page) == []
    for file in PAGE.iterdir():
        status, data, _ = get(server, f"/{file.name}")
        assert status == 200 and data == file.read_bytes()
        assert not re.search(rb"https?://(?!www\.w3\.org/2000/svg)", data), file.name
    status, data, _ = get(server, "/run.json")
    facts = json.loads(data)
    assert status == 200 and (facts["scenario"], facts["seed"]) == ("look", 7)
    assert facts["vehicles"] == [{"name": "a", "model": "iris", "camera": [640, 480]}]
    assert json.loads(get(server, "/world.json?t=1e999")[1])["objects"] == []
    assert get(server, "/map.jpg")[0] == 404, "a world without an outline has no picture"


def test_what_is_loose_is_shown_where_it_was_then(server: PageServer, folder: Path) -> None:
    barrel = "{name: barrel, north_m: 0, east_m: 10, mass_kg: 20, cylinder: {radius_m: 0.3, height_m: 1}}"
    (folder / "world.yaml").write_text(f"{WORLD}loose: [{barrel}]\n")

    def shown(time_s: float) -> dict[str, list[float]]:
        loose = json.loads(get(server, f"/world.json?t={time_s}")[1]).get("loose", [])
        return {each["name"]: [round(metres, 3) for metres in each["place_m"]] for each in loose}

    assert shown(9.0) == {"barrel": [0.0, 10.0, 0.5]}, "it has not moved yet"
    moves = (folder / "loose.csv").open("w", buffering=1)
    moves.write(",".join(LOOSE_COLUMNS) + "\n5.00,barrel,-3.000,10.000,-0.500,1,0,0,0\n8.00,barrel,-5.0")
    moves.flush()
    assert shown(4.0) == {"barrel": [0.0, 10.0, 0.5]}
    assert shown(9.0) == {"barrel": [-3.0, 10.0, 0.5]}, "a line is being written"
    moves.write("00,10.000,-0.500,1,0,0,0\n")
    moves.close()
    assert shown(9.0) == {"barrel": [-5.0, 10.0, 0.5]}
    assert shown(6.0) == {"barrel": [-3.0, 10.0, 0.5]}, "a page may go back in time"
    for nothing in (b"what is this?\n1\n", b"\xff\xfe\n"):
        (folder / "loose.csv").write_bytes(nothing)
        assert shown(9.0) == {"barrel": [0.0, 10.0, 0.5]}, "that is none"


def test_pictures_of_the_run_are_served_and_nothing_else(server: PageServer, folder: Path) -> None:
    assert get(server, "/feeds/a-camera/200000.jpg")[:2] == (200, b"a picture")
    (folder.parent / "secret.jpg").write_bytes(b"secret")
    (folder / "frames/away.jpg").symlink_to(folder.parent / "secret.jpg")
    for path in (
        "/../secret.jpg",
        "/frames/../../secret.jpg",
        "/frames/..%2f..%2fsecret.jpg",
        "/frames/away.jpg",
        "/feeds/../secret.jpg",
        "/frames//etc/passwd",
        "/scenario.yaml",
        "/a-gcs.tlog",
        "/frames/none.jpg",
        "/page/index.html",
        "/%00",
    ):
        status, data, _ = get(server, path)
        assert status == 404 and b"secret" not in data, path


def test_pages_of_other_hosts_are_told_nothing(server: PageServer) -> None:
    """A name that an attacker's DNS points here is still the attacker's."""
    assert get(server, "/run.json", Host="evil.example:80")[0] == 403
    assert get(server, "/run.json", Host=f"localhost:{server.server_port}")[0] == 200


def test_the_command_says_where_the_page_is_and_ends_when_told_to(folder: Path) -> None:
    command = [sys.executable, "-P", "-m", "sitl_emu", "view"]
    with subprocess.Popen([*command, str(folder)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = process.stdout.readline()
        port = int(re.findall(r"http://127\.0\.0\.1:(\d+)/", said)[0])
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.request("GET", "/run.json")
        assert json.loads(connection.getresponse().read())["scenario"] == "look"
        connection.close()
        process.terminate()
        assert process.wait(30) == 0
    done = subprocess.run([*command, str(folder / "frames")], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "no folder of a run" in done.stderr
