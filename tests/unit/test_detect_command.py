"""`sitl-emu detect`: each frame with its boxes, all finds as lines of JSON, and one line for what can't be used."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from sitl_emu.cli import app
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.run import detect


class Bright:
    """Finds the brightest pixel's quarter."""

    labels = ("dark", "bright")

    def __init__(self, _: Path, least: float) -> None:
        self._least = least

    def detect(self, image: Any, gsd_m: float | None = None) -> list[Detection]:
        y, x = np.unravel_index(int(image[:, :, 0].argmax()), image.shape[:2])
        score = float(image.max()) / 255.0
        return [Detection("bright", score, float(x), float(y), 20.0, 10.0)] if score >= self._least else []


def recorded(folder: Path) -> Path:
    """Two pictures, the second with a bright pixel at (40, 30)."""
    folder.mkdir()
    for time_us in (1000, 2000):
        image = np.full((60, 80, 3), 20, np.uint8)
        if time_us == 2000:
            image[30, 40] = 255
        cv2.imwrite(str(folder / f"{time_us}.png"), image)
    return folder


def test_each_frame_is_written_with_its_boxes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(detect, "OnnxDetector", Bright)
    said: list[str] = []
    out = tmp_path / "out"
    detect.detect(str(recorded(tmp_path / "in")), "x.onnx", 0.5, out, None, said.append)
    rows = [json.loads(line) for line in (out / "detections.jsonl").read_text().splitlines()]
    assert [(row["time_us"], len(row["found"])) for row in rows] == [(1000, 0), (2000, 1)]
    assert rows[1]["found"][0] == {"label": "bright", "score": 1.0, "x": 40.0, "y": 30.0, "w": 20.0, "h": 10.0}
    plain, shown = (np.asarray(cv2.imread(str(out / f"{k:06d}.jpg"))) for k in range(2))
    assert plain.max() < 40 and shown[25, 32:48].min(axis=1).mean() < shown[25, 32:48].max(axis=1).mean() - 60
    assert said[0].startswith("2 frames, ") and "1 bright; pictures and detections.jsonl are in" in said[0]


def test_it_stops_after_as_many_as_wanted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(detect, "OnnxDetector", Bright)
    said: list[str] = []
    detect.detect(str(recorded(tmp_path / "in")), "x.onnx", 0.5, tmp_path / "out", 1, said.append)
    assert said[0].startswith("1 frames, ") and ": nothing; " in said[0]


@pytest.mark.parametrize("what", ["model", "source"])
def test_what_cannot_be_used_is_told_in_a_line(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if what == "model":
        pytest.importorskip("onnxruntime")
    else:
        monkeypatch.setattr(detect, "OnnxDetector", Bright)
    missing = tmp_path / "none"
    arguments = ["detect", str(missing), "--model", str(missing.with_suffix(".onnx")), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2 and "none" in result.output and "Traceback" not in result.output
    assert not (tmp_path / "out").exists()
