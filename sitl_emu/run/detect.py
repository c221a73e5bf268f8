"""`sitl-emu detect`: what a network sees in a video, a folder of pictures or a camera, as a user tries it first."""

import json
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2

from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.camera import CameraError, Image, open_camera
from sitl_emu.missions.companion.detector import Detection, Detector
from sitl_emu.missions.companion.inference import be_repeatable
from sitl_emu.missions.companion.yolo import ModelError, OnnxDetector
from sitl_emu.run import folders
from sitl_emu.run.picture_files import jpeg
from sitl_emu.run.trouble import Trouble

COLOURS = ((255, 120, 0), (0, 230, 255), (255, 0, 255), (0, 255, 0), (0, 90, 255), (255, 255, 255))
"""Of the labels in turn, BGR."""
WAIT_S = 0.002
JPEG_QUALITY = 95
"""OpenCV's own."""
TABLE = "detections.jsonl"


def detect(source: str, model: str, least: float, out: Path, most: int | None, say: Callable[[str], None]) -> None:
    """Look at a source's frames until it ends, or at `most` of them, and write each with its boxes, and a table.

    `model`: a file, or the name of a network that comes with the package.

    Raises Trouble, OSError.
    """
    try:
        detector = OnnxDetector(networks.path_of(model), least)
        camera = open_camera(source)
    except (ModelError, CameraError) as error:
        raise Trouble(str(error)) from None
    be_repeatable()
    count, took_s, seen = 0, 0.0, Counter[str]()
    try:
        folders.make(out)
        with (out / TABLE).open("w") as table:
            while not camera.ended and count != most:
                frame = camera.read()
                if frame is None:
                    time.sleep(WAIT_S)
                    continue
                began = time.perf_counter()
                found = detector.detect(frame.image)
                took_s += time.perf_counter() - began
                row = {"frame": frame.index, "time_us": frame.time_usec, "found": [each._asdict() for each in found]}
                table.write(json.dumps(row) + "\n")
                picture = marked(frame.image, found, detector)
                (out / f"{frame.index:06d}.jpg").write_bytes(jpeg(picture, JPEG_QUALITY))
                count += 1
                seen.update(each.label for each in found)
    except CameraError as error:
        raise Trouble(str(error)) from None
    finally:
        camera.close()
    told = ", ".join(f"{seen[label]} {label}" for label in detector.labels if seen[label]) or "nothing"
    say(f"{count} frames, {took_s / max(count, 1) * 1000:.0f} ms each: {told}; pictures and {TABLE} are in {out}")


def marked(image: Image, found: Sequence[Detection], detector: Detector) -> Image:
    """A copy with boxes, labels and scores."""
    image = image.copy()
    for each in found:
        colour = COLOURS[detector.labels.index(each.label) % len(COLOURS)]
        left, top = round(each.x - each.w / 2), round(each.y - each.h / 2)
        cv2.rectangle(image, (left, top), (round(each.x + each.w / 2) - 1, round(each.y + each.h / 2) - 1), colour, 2)
        at = (left + 4, max(top, 0) + 16)
        cv2.putText(image, f"{each.label} {each.score:.2f}", at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)
    return image
