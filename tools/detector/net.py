"""The network: a one-stage detector of YOLOv8's class, written from papers' figures and equations.

Backbone of cross-stage-partial stages (Wang et al., CSPNet, 2020) with a pyramid of pools (He et al., 2015), a path
aggregation neck (Liu et al., PANet, 2018), and at three scales a head whose branches for boxes and classes are apart
(Ge et al., YOLOX, 2021). A box is its sides' distances from an anchor, each a distribution over BINS (Li et al.,
Generalized Focal Loss, 2020). At `width` 1 it has about 3 million parameters, as YOLOv8n (3.2).

Where classes are areas, a box says little: a last head says of each part of the picture how much of it shows a class.
"""

import math

import torch
from torch import Tensor, nn

STRIDES = (8, 16, 32)
BINS = 16
"""Of a side's distance, in strides."""
PRIOR = 0.01
"""What a class's score begins at."""


class Unit(nn.Module):
    """Convolution, normalisation, SiLU."""

    def __init__(self, into: int, out: int, size: int = 3, stride: int = 1) -> None:
        super().__init__()
        self.convolution = nn.Conv2d(into, out, size, stride, size // 2, bias=False)
        self.norm = nn.BatchNorm2d(out, eps=1e-3, momentum=0.03)

    def forward(self, x: Tensor) -> Tensor:
        """(n, into, h, w) to (n, out, h / stride, w / stride)."""
        return nn.functional.silu(self.norm(self.convolution(x)))


class Pair(nn.Module):
    """Two units, to whose result the input may be added."""

    def __init__(self, channels: int, adds: bool) -> None:
        super().__init__()
        self.first, self.second, self.adds = Unit(channels, channels), Unit(channels, channels), adds

    def forward(self, x: Tensor) -> Tensor:
        """Same shape."""
        y = self.second(self.first(x))
        return x + y if self.adds else y


class Stage(nn.Module):
    """Cross-stage partial: one half goes through pairs in turn, and all that came of it is joined with the other."""

    def __init__(self, into: int, out: int, pairs: int, adds: bool) -> None:
        super().__init__()
        half = out // 2
        self.split = Unit(into, 2 * half, 1)
        self.pairs = nn.ModuleList(Pair(half, adds) for _ in range(pairs))
        self.join = Unit((2 + pairs) * half, out, 1)

    def forward(self, x: Tensor) -> Tensor:
        """(n, into, h, w) to (n, out, h, w)."""
        parts = list(self.split(x).chunk(2, 1))
        for pair in self.pairs:
            parts.append(pair(parts[-1]))
        return self.join(torch.cat(parts, 1))


class Pools(nn.Module):
    """What is around, near and far: three pools in turn, joined."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        half = channels // 2
        self.first, self.join = Unit(channels, half, 1), Unit(4 * half, channels, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Same shape."""
        parts = [self.first(x)]
        for _ in range(3):
            parts.append(nn.functional.max_pool2d(parts[-1], 5, 1, 2))
        return self.join(torch.cat(parts, 1))


class Head(nn.Module):
    """Boxes and classes at one scale."""

    def __init__(self, into: int, narrow: int, classes: int, stride: int) -> None:
        super().__init__()
        self.box = nn.Sequential(Unit(into, narrow), Unit(narrow, narrow), nn.Conv2d(narrow, 4 * BINS, 1))
        self.label = nn.Sequential(Unit(into, narrow), Unit(narrow, narrow), nn.Conv2d(narrow, classes, 1))
        nn.init.constant_(self.box[-1].bias, 1.0)
        nn.init.constant_(self.label[-1].bias, math.log(PRIOR / (1.0 - PRIOR)))
        self.stride = stride

    def forward(self, x: Tensor) -> Tensor:
        """(n, h * w, 4 * BINS + classes), row by row."""
        return torch.cat((self.box(x), self.label(x)), 1).flatten(2).transpose(1, 2)


class Network(nn.Module):
    """Pictures (n, 3, h, w), RGB from 0 to 1, sides multiples of 32, to raw figures of all anchors."""

    def __init__(self, classes: int, width: float = 1.0, has_areas: bool = False) -> None:
        super().__init__()
        a, b, c, d, e = (max(round(channels * width / 8), 1) * 8 for channels in (16, 32, 64, 128, 256))
        self.classes, self.width = classes, width
        self.small = nn.Sequential(Unit(3, a, 3, 2), Unit(a, b, 3, 2), Stage(b, b, 1, True),
                                   Unit(b, c, 3, 2), Stage(c, c, 2, True))  # fmt: skip
        self.middle = nn.Sequential(Unit(c, d, 3, 2), Stage(d, d, 2, True))
        self.large = nn.Sequential(Unit(d, e, 3, 2), Stage(e, e, 1, True), Pools(e))
        self.up_middle, self.up_small = Stage(e + d, d, 1, False), Stage(d + c, c, 1, False)
        self.down_middle, self.down_large = Unit(c, c, 3, 2), Unit(d, d, 3, 2)
        self.out_middle, self.out_large = Stage(c + d, d, 1, False), Stage(d + e, e, 1, False)
        narrow = max(c, 16)
        self.heads = nn.ModuleList(
            Head(k, narrow, classes, stride) for k, stride in zip((c, d, e), STRIDES, strict=True)
        )
        self.areas = nn.Sequential(Unit(c, c), Unit(c, c), nn.Conv2d(c, classes, 1)) if has_areas else None
        """(n, c, h / 8, w / 8), the first of `features`, to logits of each class's share (n, classes, h / 8, w / 8)."""

    def forward(self, x: Tensor) -> Tensor:
        """(n, anchors, 4 * BINS + classes): logits, scale by scale from the finest, row by row."""
        return self.anchored(self.features(x))

    def features(self, x: Tensor) -> tuple[Tensor, ...]:
        """What the heads see, from the finest scale on."""
        small = self.small(x)
        middle = self.middle(small)
        large = self.large(middle)
        middle = self.up_middle(torch.cat((_doubled(large), middle), 1))
        small = self.up_small(torch.cat((_doubled(middle), small), 1))
        middle = self.out_middle(torch.cat((self.down_middle(small), middle), 1))
        large = self.out_large(torch.cat((self.down_large(middle), large), 1))
        return small, middle, large

    def anchored(self, features: tuple[Tensor, ...]) -> Tensor:
        """As `forward`, of features."""
        return torch.cat([head(y) for head, y in zip(self.heads, features, strict=True)], 1)


def _doubled(x: Tensor) -> Tensor:
    return nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")


class Deployed(nn.Module):
    """The network as it is exported: sides' distances in pixels and scores, (n, anchors, 4 + classes).

    And of one that has areas, each part's shares, (n, classes, h / 8, w / 8).
    """

    def __init__(self, network: Network, height: int, width: int) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("stride", anchors(height, width)[1])

    def forward(self, x: Tensor) -> tuple[Tensor, ...]:
        """Left, top, right, bottom from the anchor, in pixels of the input; then each class's score."""
        features = self.network.features(x)
        raw = self.network.anchored(features)
        found = torch.cat((distances(raw) * self.stride[:, None], raw[..., 4 * BINS :].sigmoid()), -1)
        return (found,) if self.network.areas is None else (found, self.network.areas(features[0]).sigmoid())


def anchors(height: int, width: int, device: torch.device | str = "cpu") -> tuple[Tensor, Tensor]:
    """Middles (anchors, 2), x and y in pixels, and strides (anchors,) of a picture's anchors, in the heads' order."""
    middles, strides = [], []
    for stride in STRIDES:
        y, x = torch.meshgrid(
            torch.arange(height // stride, device=device) + 0.5,
            torch.arange(width // stride, device=device) + 0.5,
            indexing="ij",
        )
        middles.append(torch.stack((x, y), -1).reshape(-1, 2) * stride)
        strides.append(torch.full((x.numel(),), float(stride), device=device))
    return torch.cat(middles), torch.cat(strides)


def distances(raw: Tensor) -> Tensor:
    """(n, anchors, 4): means of the sides' distributions, in strides."""
    shares = raw[..., : 4 * BINS].unflatten(-1, (4, BINS)).softmax(-1)
    return shares @ torch.arange(BINS, dtype=shares.dtype, device=shares.device)
