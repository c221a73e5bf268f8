"""How many pictures a second a network takes, by its input's size, by cores, and in 8 bits: as ratios of one run."""

import tempfile
import time
from pathlib import Path

import numpy as np

from sitl_emu.missions.companion.yolo import OnnxDetector
from tools.detector.export import export, quantise

SIZES = ((320, 256), (416, 320), (640, 480))
CORES = (1, 2)
PICTURES = 40
ROUNDS = 3
LEAST = 0.25


def measure(checkpoint: Path, folder: Path) -> None:
    """Print a table; `folder`: the data set that calibrates 8 bits. Raises OSError, ValueError."""
    print("| input | 32 bits, 1 core | 2 cores | 8 bits, 1 core | 2 cores |")
    print("| --- | --- | --- | --- | --- |")
    for width, height in SIZES:
        with tempfile.TemporaryDirectory() as made:
            plain, small = Path(made) / "plain.onnx", Path(made) / "small.onnx"
            export(checkpoint, plain, (width, height))
            quantise(plain, small, folder)
            rates = [pictures_s(OnnxDetector(model, threads=cores)) for model in (plain, small) for cores in CORES]
        print(f"| {width} x {height} | " + " | ".join(f"{rate:.0f}/s" for rate in rates) + " |", flush=True)


def pictures_s(detector: OnnxDetector) -> float:
    """By the clock, the best of some rounds: of pictures of 640 x 480, boxes and all."""
    images = np.random.default_rng(1).integers(0, 255, (4, 480, 640, 3), np.uint8)
    best = 0.0
    for _ in range(ROUNDS):
        began = time.perf_counter()
        for k in range(PICTURES):
            detector.found(images[k % len(images)], LEAST)
        best = max(best, PICTURES / (time.perf_counter() - began))
    return best
