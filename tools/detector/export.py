"""The way out: a checkpoint's average as ONNX, in single precision and with weights and activations of 8 bits."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch

from tools.detector import data
from tools.detector.net import Deployed, Network

AREAS = "areas"
"""Of the second output, and of its layers."""
CALIBRATES = 96
"""Pictures of the training split by which ranges of activations are found."""


def export(checkpoint: Path, path: Path, size: tuple[int, int] | None = None) -> None:
    """Write a checkpoint's average, with its labels; `size`: of its input, if not as in training. Raises OSError."""
    import onnx

    kept = torch.load(checkpoint, map_location="cpu", weights_only=True)
    width, height = size or (kept["settings"]["input_width"], kept["settings"]["input_height"])
    has_areas = any(name.startswith(AREAS) for name in kept["average"])
    network = Network(len(kept["labels"]), kept["settings"]["width"], has_areas)
    network.load_state_dict(kept["average"])
    deployed = Deployed(network, height, width).eval()
    outputs = ["found", AREAS] if has_areas else ["found"]
    torch.onnx.export(
        deployed, (torch.zeros(1, 3, height, width),), str(path), input_names=["image"], output_names=outputs,
        external_data=False, dynamo=True,
    )  # fmt: skip
    model = onnx.load(str(path))
    told = {"labels": json.dumps(kept["labels"]), "epochs": str(kept["epoch"]), "seconds": f"{kept['seconds']:.0f}",
            "settings": json.dumps(kept["settings"]), "history": json.dumps(kept["history"])}  # fmt: skip
    onnx.helper.set_model_props(model, told)
    onnx.save(model, str(path))


def quantise(model: Path, path: Path, folder: Path) -> None:
    """Write an exported model's convolutions in 8 bits; what comes after them, boxes and scores, stays as it is.

    `folder`: the data set whose training pictures calibrate it. Raises OSError, ValueError.
    """
    import onnx
    from onnxruntime import quantization

    plain = onnx.load(str(model))
    told = {each.key: each.value for each in plain.metadata_props}
    _, _, height, width = (each.dim_value for each in plain.graph.input[0].type.tensor_type.shape.dim)
    prepared = path.with_suffix(".prepared.onnx")
    quantization.quant_pre_process(str(model), str(prepared), skip_symbolic_shape=True)
    split = data.load(folder, "train", width, height, CALIBRATES)
    try:
        quantization.quantize_static(
            str(prepared), str(path), _Pictures(plain.graph.input[0].name, split), per_channel=True,
            op_types_to_quantize=["Conv"], activation_type=quantization.QuantType.QUInt8,
            weight_type=quantization.QuantType.QInt8,
        )  # fmt: skip
    finally:
        prepared.unlink(missing_ok=True)
    done = onnx.load(str(path))
    onnx.helper.set_model_props(done, {**told, "int8": "convolutions"})
    onnx.save(done, str(path))


class _Pictures:
    """What onnxruntime asks for one after the other (quantization.CalibrationDataReader)."""

    def __init__(self, name: str, split: data.Split) -> None:
        self._left: Iterator[dict[str, Any]] = (
            {name: np.ascontiguousarray(image[None, :, :, ::-1].transpose(0, 3, 1, 2), np.float32) / np.float32(255.0)}
            for image in split.images
        )

    def get_next(self) -> dict[str, Any] | None:
        """The next picture as the network's input; None: no more."""
        return next(self._left, None)
