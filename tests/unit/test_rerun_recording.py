"""`sitl-emu rerun`: what the recording of a run's folder holds, read back by Rerun itself."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.run.kept_frames import depth_file, image_file, points_file
from sitl_emu.run.recorder import TRUTH_HEADER
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.view import rerun_recording

START_US = 1_781_514_000_000_000
"""2026-06-15T09:00:00Z, the default of a scenario."""
SCENARIO = """
name: look
seed: 7
world: world.yaml
vehicles:
- name: a
  model: iris
  camera: {mount: nadir}
  depth: {}
  lidar: {}
"""
WORLD = """
name: plain
origin: {lat_deg: 47.0, lon_deg: 8.0, alt_amsl_m: 400}
places: {home: {north_m: 0, east_m: 0}}
area_m: [[0, 0], [0, 20], [20, 20], [20, 0]]
terrain: {height_m: 3}
things: [{label: person, north_m: 5, east_m: 6, radius_m: 0.3}]
"""
POINTS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], np.float32)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """What a run leaves."""
    (tmp_path / "scenario.yaml").write_text(SCENARIO)
    (tmp_path / "world.yaml").write_text(WORLD)
    rows = [f"{k / 10:.2f},{k},2,-5,3,4,-1,1.00000,0.00000,0.00000,0.00000\n" for k in range(11)]
    (tmp_path / "truth-a.csv").write_text(TRUTH_HEADER + "".join(rows))
    with TlogWriter(tmp_path / "a-gcs.tlog") as log:
        codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 157, 4 << 16 | 4 << 24, 4, 3)
        status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16_000, 100, 73, 0, 0, 0, 0, 0, 0)
        log.write(START_US + 100_000, bytes(heartbeat.pack(codec)))
        log.write(START_US + 500_000, bytes(status.pack(codec)))
    event = {"time_s": 0.8, "vehicle": "a", "event": "found", "text": "a person", "label": "person"}
    event |= {"lat_deg": 47.0001, "lon_deg": 8.0, "picture": "frames/a.jpg"}
    (tmp_path / "events.jsonl").write_text(json.dumps(event) + "\n")
    looked = {"time_s": 0.5, "found": [["person", 0.9, 320.0, 240.0, 64.0, 32.0]]}
    (tmp_path / "a-detections.jsonl").write_text(json.dumps(looked) + "\n")
    frames = {
        "camera": image_file(np.full((480, 640, 3), 90, np.uint8)),
        "depth": depth_file(np.full((48, 64), 2.5, np.float32)),
        "lidar": points_file(POINTS),
    }
    for feed, (suffix, data) in frames.items():
        (tmp_path / f"feeds/a-{feed}").mkdir(parents=True)
        (tmp_path / f"feeds/a-{feed}/500000{suffix}").write_bytes(data)
    return tmp_path


def columns(path: Path) -> dict[str, dict[str, list[Any]]]:
    """All cells of a recording, by entity and by component."""
    chunk = pytest.importorskip("rerun.chunk", reason="needs rerun-sdk (the extra `rerun`)")
    found = dict[str, dict[str, list[Any]]]()
    for one in chunk.RrdReader(path).stream():
        batch = one.to_record_batch()
        for name in batch.schema.names:
            cells = batch.column(name).to_pylist()
            found.setdefault(one.entity_path, {}).setdefault(name.split(":")[-1], []).extend(cells)
    return found


def test_a_recording_holds_poses_pictures_clouds_plots_and_events_on_simulated_time(folder: Path) -> None:
    pytest.importorskip("rerun", reason="needs rerun-sdk (the extra `rerun`)")
    path = rerun_recording.record(folder, None)
    assert path == folder / "run.rrd"
    found = columns(path)
    pose = found["/world/a"]
    assert [cell for (cell,) in pose["translation"]] == [[k, 2.0, -5.0] for k in range(11)]
    assert [time.total_seconds() for time in pose["simulated"]] == pytest.approx([k / 10 for k in range(11)])
    assert pose["quaternion"][0] == [[0.0, 0.0, 0.0, 1.0]], "x, y, z, w"
    right, down, ahead = np.reshape([cell for cell in found["/world/a/camera"]["mat3x3"] if cell], (3, 3))
    assert np.allclose([right, down, ahead], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), "nadir, the picture's top forward"
    assert [cell for (cell,) in found["/plots/altitude_m/a"]["scalars"]] == [5.0] * 11
    assert [cell for (cell,) in found["/plots/speed_m_s/a"]["scalars"]] == [5.0] * 11
    assert found["/plots/battery_percent/a"]["scalars"] == [[73.0]]
    assert found["/world/a/lidar"]["positions"] == [POINTS.tolist()]
    assert bytes(found["/world/a/camera"]["blob"][-1][0]).startswith(b"\xff\xd8"), "a JPEG"
    assert bytes(found["/world/a/depth"]["blob"][-1][0]).startswith(b"\x89PNG")
    assert found["/world/a/camera/found"]["half_sizes"] == [[[24.0, 12.0]]], "of a picture at three quarters"
    assert found["/world/a/camera/found"]["centers"] == [[[240.0, 180.0]]]
    ((find,),) = found["/world/finds"]["positions"]
    assert find == pytest.approx([11.1, 0.0, -3.0], abs=0.1), "on the ground"
    assert found["/world/truth"]["labels"] == [["person"]]
    texts = [text for (text,) in found["/events/a"]["text"]]
    assert texts == ["mode mission", "found: a person"]
    assert len(found["/world/ground"]["vertex_positions"][0]) == 65 * 65
    timelines = {name for entity in found.values() for name in entity if name in ("log_time", "log_tick")}
    assert not timelines, "nothing of the machine's clock"


def test_without_the_sdk_one_is_told_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(Trouble, match="pip install rerun-sdk"):
        rerun_recording.record(folder, None)


def test_a_file_that_cannot_be_written_is_named(folder: Path) -> None:
    pytest.importorskip("rerun", reason="needs rerun-sdk (the extra `rerun`)")
    with pytest.raises(Trouble, match="name another file with --out"):
        rerun_recording.record(folder, folder / "nowhere/run.rrd")
