"""A trained network as a `Detector`: any ONNX file that `tools/detector` has exported, run by onnxruntime.

The picture is shrunk to fit the network's input and padded with grey; what comes back are distances of boxes' sides
from anchors, and scores; and how much of each part of the picture shows a class, if it was trained for areas. Scores
are rounded before they are compared, so that another processor's last bits choose nothing.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Areas, Detection, Detections

Floats = npt.NDArray[np.float32]
STRIDES = (8, 16, 32)
PAD = 114
"""Grey around the picture."""
DECIMALS = 3
"""Of scores."""
MOST = 100
"""Detections a picture."""
APART_IOU = 0.5
"""From which a box hides a worse one of its class. The best for `networks/disaster.onnx` on its validation split:
mAP@0.5 0.914 at 0.4, 0.919 at 0.5, 0.918 at 0.6, 0.913 at 0.7."""


class ModelError(ValueError):
    """A model that can't be used; the text is one line for people."""


class Fitted(NamedTuple):
    """A picture as the network sees it."""

    image: Image
    """(height, width, 3), as it came: BGR."""
    scale: float
    """Pixels of it by pixels of the original."""
    left: int
    top: int


class Found(NamedTuple):
    """Boxes of one picture, the best first."""

    boxes: Floats
    """(n, 4): left, top, right, bottom in pixels."""
    scores: Floats
    labels: npt.NDArray[np.int64]


class OnnxDetector:
    """See the module. Raises ModelError."""

    def __init__(
        self, path: Path | str, score: float = 0.25, iou: float = APART_IOU, threads: int = 1, one_label: bool = False
    ) -> None:
        """`score`: from which detections are given; `iou`: from which one hides another of its class.

        `one_label`: it hides others of any class as well: what is there is one thing.
        """
        try:
            import onnxruntime
        except ImportError:
            raise ModelError("a trained network needs onnxruntime: pip install onnxruntime") from None
        if not Path(path).is_file():
            raise ModelError(
                f"{path}: no such file; networks that come with the package: {', '.join(networks.names())}"
            )
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = threads
        try:
            self._session: Any = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
            self.told: dict[str, str] = self._session.get_modelmeta().custom_metadata_map
            """What the file says of itself: labels, settings of its training, and how that went."""
            self._labels = tuple(json.loads(self.told["labels"]))
            self._input = self._session.get_inputs()[0]
            _, _, self.height, self.width = (int(side) for side in self._input.shape)
        except (KeyError, ValueError, TypeError) as error:
            raise ModelError(f"{path}: no model of tools/detector: {error}") from None
        except Exception as error:  # onnxruntime's own, which share no base but this
            raise ModelError(f"{path}: can't be read as a model: {' '.join(str(error).split())}") from None
        self._score, self._iou, self._one_label = score, iou, one_label
        self._middles = middles(self.height, self.width)

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels of its detections."""
        return self._labels

    @property
    def has_areas(self) -> bool:
        """Whether its detections come with areas."""
        return len(self._session.get_outputs()) > 1

    def detect(self, image: Image, gsd_m: float | None = None) -> Detections:
        """See Detector."""
        found, areas = self._looked(image, self._score)
        each = (
            Detection(self._labels[label], float(score), float(left + right) / 2, float(top + bottom) / 2,
                      float(right - left), float(bottom - top))
            for (left, top, right, bottom), score, label in zip(
                found.boxes.tolist(), found.scores.tolist(), found.labels.tolist(), strict=True
            )
        )  # fmt: skip
        return Detections(each, areas)

    def found(self, image: Image, least: float) -> Found:
        """All boxes from a score on, in pixels of the picture."""
        return self._looked(image, least)[0]

    def _looked(self, image: Image, least: float) -> tuple[Found, Areas | None]:
        fit = fitted(image, self.width, self.height)
        planes = np.ascontiguousarray(fit.image[None, :, :, ::-1].transpose(0, 3, 1, 2), np.float32) / np.float32(255.0)
        (out, *_), *rest = self._session.run(None, {self._input.name: planes})
        chosen = decoded(out, self._middles, least, self._iou, self._one_label)
        boxes = (chosen.boxes - np.array((fit.left, fit.top) * 2, np.float32)) / np.float32(fit.scale)
        height, width = image.shape[:2]
        chosen = chosen._replace(boxes=np.clip(boxes, 0, np.array((width, height) * 2, np.float32)).round(2))
        if not rest:
            return chosen, None
        part, left, top = STRIDES[0] / fit.scale, -fit.left / fit.scale, -fit.top / fit.scale
        return chosen, Areas(self._labels, rest[0][0].round(DECIMALS), part, left, top)


def fitted(image: Image, width: int, height: int) -> Fitted:
    """A picture shrunk or grown to fit, in the middle of grey."""
    rows, columns = image.shape[:2]
    scale = min(width / columns, height / rows)
    size = min(round(columns * scale), width), min(round(rows * scale), height)
    if size != (columns, rows):
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR))
    if size == (width, height):
        return Fitted(image, scale, 0, 0)
    left, top = (width - size[0]) // 2, (height - size[1]) // 2
    whole = np.full((height, width, 3), PAD, np.uint8)
    whole[top : top + size[1], left : left + size[0]] = image
    return Fitted(whole, scale, left, top)


def middles(height: int, width: int) -> Floats:
    """(anchors, 2): x and y of each anchor in pixels, scale by scale from the finest, row by row."""
    parts = []
    for stride in STRIDES:
        y, x = np.mgrid[0 : height // stride, 0 : width // stride]
        parts.append((np.stack((x, y), axis=-1).reshape(-1, 2) + 0.5) * stride)
    return np.concatenate(parts).astype(np.float32)


def decoded(out: Floats, at: Floats, least: float, iou: float, one_label: bool = False) -> Found:
    """Boxes of a network's figures (anchors, 4 + classes): left, top, right, bottom from the middles, then scores."""
    scores = out[:, 4:].round(DECIMALS)
    labels = scores.argmax(axis=1)
    best = scores[np.arange(len(scores)), labels]
    chosen = np.flatnonzero(best >= least)
    chosen = chosen[np.argsort(-best[chosen], kind="stable")]
    boxes = np.concatenate((at[chosen] - out[chosen, :2], at[chosen] + out[chosen, 2:4]), axis=1)
    kept = distinct(boxes, labels[chosen] * (not one_label), iou)[:MOST]
    return Found(boxes[kept], best[chosen][kept], labels[chosen][kept])


def distinct(boxes: Floats, labels: npt.NDArray[np.int64], iou: float) -> npt.NDArray[np.int64]:
    """Numbers of the boxes (n, 4; best first) that no better one of their label overlaps more than `iou`."""
    left = np.arange(len(boxes))
    kept = list[int]()
    while len(left) and len(kept) < MOST:
        first, others = left[0], left[1:]
        kept.append(int(first))
        hidden = (labels[others] == labels[first]) & (overlaps(boxes[first : first + 1], boxes[others])[0] > iou)
        left = others[~hidden]
    return np.array(kept, np.int64)


def overlaps(a: Floats, b: Floats) -> Floats:
    """(n, m): intersection over union of boxes (n, 4) and (m, 4)."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    both = np.clip(high - low, 0, None).prod(axis=2)
    area_a, area_b = ((each[:, 2:] - each[:, :2]).prod(axis=1) for each in (a, b))
    return np.asarray(both / np.maximum(area_a[:, None] + area_b[None] - both, 1e-9), np.float32)
