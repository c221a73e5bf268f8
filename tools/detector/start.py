"""What a training may begin with instead of chance: a checkpoint, or a network that was exported.

An exported network's norms are folded into its convolutions. They are made anew so that what every layer gives is as
before: a norm's mean and deviation are those of the convolution's outputs on pictures of the training split, and its
scale and shift undo them. Before a norm the length of a filter changes nothing but how fast it turns, by the rate over
the length's square (van Laarhoven, L2 regularization versus batch and weight normalization, 2017); folding has changed
it, mostly to less, so all are made as long as LENGTH. Weights of class scores are taken where the classes are the same,
and begin anew otherwise.

A network of half the width begins one too, in which every filter is there twice (Chen et al., Net2Net, 2016): whoever
hears both takes a share of each, at random, so that together they say what one did, and each learns something else.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from tools.detector.net import Network, Unit

CALIBRATES = 64
"""Pictures that norms are made from."""
SHARES = 0.2, 0.8
"""Of a filter that is there twice: what the first of the two has. Ours."""
LENGTH = 2.0
"""Of filters before a norm; ours. Not shown to help: at its highest rate a training of `field` lost precision with it
(0.38 to 0.29 from the first to the third epoch, at 0.006) as without (0.35 to 0.22, at 0.007)."""
EXPORTED = "network."
"""What weights' names begin with in an exported network (`net.Deployed`)."""
OF_CLASSES = ".label.2.", "areas.2."
"""In the names of weights that classes have of their own."""

Weights = dict[str, Tensor]


def begin(path: Path, network: Network, labels: Sequence[str], images: Sequence[npt.NDArray[np.uint8]]) -> None:
    """Give a network the weights of a checkpoint's average (.pt) or of an exported network (.onnx), as wide or half.

    `images`: of the training split, BGR. Raises OSError, ValueError.
    """
    weights, its_labels, width = _exported(path) if path.suffix == ".onnx" else _checkpoint(path)
    if width not in (network.width, network.width / 2):
        raise ValueError(f"{path} has width {width}: it can't begin a network of width {network.width}")
    if its_labels != list(labels):
        weights = {name: each for name, each in weights.items() if not any(part in name for part in OF_CLASSES)}
    if network.areas is None:
        weights = {name: each for name, each in weights.items() if not name.startswith("areas.")}
    unknown = weights.keys() - network.state_dict().keys()
    if unknown:
        raise ValueError(f"{path} is another network: it has {min(unknown)}")
    if width < network.width:
        weights = _widened(weights, network.state_dict())
    network.load_state_dict(weights, strict=False)
    if path.suffix == ".onnx":
        _make_norms(network, {name: each for name, each in weights.items() if name.endswith("norm.bias")}, images)


def _checkpoint(path: Path) -> tuple[Weights, list[str], float]:
    kept = torch.load(path, map_location="cpu", weights_only=True)
    return kept["average"], kept["labels"], kept["settings"]["width"]


def _exported(path: Path) -> tuple[Weights, list[str], float]:
    """A folded convolution's bias comes as its norm's."""
    import onnx

    model = onnx.load(str(path))
    told: dict[str, Any] = {each.key: each.value for each in model.metadata_props}
    if not {"labels", "settings"} <= told.keys():
        raise ValueError(f"{path} does not say what it was trained for: only networks exported here can begin one")
    weights = Weights()
    for each in model.graph.initializer:
        if each.name.startswith(EXPORTED):
            name = each.name.removeprefix(EXPORTED).replace("convolution.weight_bias", "norm.bias")
            weights[name] = torch.from_numpy(np.array(onnx.numpy_helper.to_array(each)))
    return weights, json.loads(told["labels"]), json.loads(told["settings"])["width"]


def _widened(weights: Weights, like: Weights) -> Weights:
    """Each filter beside itself, so that halves and joins of them (`Stage`) stay in their order."""
    generator = torch.Generator().manual_seed(0)
    wider = Weights()
    for name, each in weights.items():
        want = like[name].shape
        if each.ndim and want[0] == 2 * each.shape[0]:
            each = each.repeat_interleave(2, 0)
        if each.ndim > 1 and want[1] == 2 * each.shape[1]:
            low, high = SHARES
            first = low + (high - low) * torch.rand(each.shape, generator=generator)
            each = torch.stack((first * each, (1.0 - first) * each), 2).flatten(1, 2)
        wider[name] = each
    return wider


@torch.no_grad()
def _make_norms(network: Network, biases: Weights, images: Sequence[npt.NDArray[np.uint8]]) -> None:
    """One pass: each norm is made when its convolution's outputs come by, and gives them on with the bias added."""
    handles = []
    for name, unit in network.named_modules():
        if isinstance(unit, Unit) and f"{name}.norm.bias" in biases:
            filters = unit.convolution.weight
            longer = LENGTH / filters.flatten(1).norm(dim=1).clamp(min=1e-6)
            filters.mul_(longer[:, None, None, None])
            handles.append(unit.norm.register_forward_pre_hook(_maker(biases[f"{name}.norm.bias"], longer)))
    picked = np.stack([images[k] for k in range(0, len(images), max(len(images) // CALIBRATES, 1))][:CALIBRATES])
    x = torch.from_numpy(np.ascontiguousarray(picked[..., ::-1].transpose(0, 3, 1, 2)))
    was_training = network.training
    features = network.eval().features(x.to(next(network.parameters()).device).float() / 255.0)
    network.anchored(features)
    if network.areas is not None:
        network.areas(features[0])
    network.train(was_training)
    for handle in handles:
        handle.remove()


def _maker(bias: Tensor, longer: Tensor) -> Any:
    def make(norm: nn.Module, given: tuple[Tensor]) -> None:
        assert isinstance(norm, nn.BatchNorm2d) and norm.running_mean is not None and norm.running_var is not None
        variance, mean = torch.var_mean(given[0], (0, 2, 3))
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        norm.weight.copy_((variance + norm.eps).sqrt() / longer)
        norm.bias.copy_(bias.to(mean.device) + mean / longer)

    return make
