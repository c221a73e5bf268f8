"""What the network learns from: which anchor stands for which box, and how far it is from it.

Assignment by task alignment (Feng et al., TOOD, 2021), boxes by complete IoU (Zheng et al., Distance-IoU Loss, 2020)
and by their sides' distributions (Li et al., Generalized Focal Loss, 2020), classes by cross-entropy against how well
an anchor is aligned. Areas, where there are any, learn by cross-entropy in each part of a picture.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from tools.detector.net import BINS, distances

NEAREST = 10
"""Anchors that stand for a box, at most."""
SCORE_POWER, IOU_POWER = 0.5, 6.0
"""Of an anchor's score and of its box's overlap in the alignment. The paper has 1 and 6."""
BOX, LABEL, SIDE, AREA = 7.5, 0.5, 1.5, 2.0
"""Weights of complete IoU, classes, sides' distributions and areas."""
EDGE, EDGE_PARTS = 3.0, 5
"""How much more a part costs at an area's edge, and how many parts across that is; Ronneberger et al. (U-Net, 2015)
weigh borders so. A parcel is to lie beside a shore, and shallow water was taken for shade. The figures are ours."""
EPSILON = 1e-7
REAL, IGNORED = 1.0, 2.0
"""Kinds of rows in targets; 0 fills up."""


class Assigned(NamedTuple):
    """For each anchor of each picture."""

    is_positive: Tensor
    """(n, anchors) bool."""
    box: Tensor
    """(n, anchors, 4): left, top, right, bottom in pixels."""
    score: Tensor
    """(n, anchors, classes): what the score should be."""
    counts: Tensor
    """(n, anchors) bool: false where a box that is ignored lies, and no other."""


def boxes_of(raw: Tensor, middles: Tensor, strides: Tensor) -> Tensor:
    """(n, anchors, 4), left, top, right, bottom in pixels."""
    sides = distances(raw) * strides[:, None]
    return torch.cat((middles - sides[..., :2], middles + sides[..., 2:]), -1)


def overlap(a: Tensor, b: Tensor) -> Tensor:
    """IoU of boxes (..., 4), broadcast."""
    low, high = torch.maximum(a[..., :2], b[..., :2]), torch.minimum(a[..., 2:], b[..., 2:])
    both = (high - low).clamp(0).prod(-1)
    area_a, area_b = (a[..., 2:] - a[..., :2]).clamp(0).prod(-1), (b[..., 2:] - b[..., :2]).clamp(0).prod(-1)
    return both / (area_a + area_b - both + EPSILON)


def complete_overlap(a: Tensor, b: Tensor) -> Tensor:
    """IoU less the middles' distance and the sides' other ratio."""
    iou = overlap(a, b)
    hull = torch.maximum(a[..., 2:], b[..., 2:]) - torch.minimum(a[..., :2], b[..., :2])
    away = ((a[..., :2] + a[..., 2:] - b[..., :2] - b[..., 2:]) ** 2).sum(-1) / 4
    size_a, size_b = (a[..., 2:] - a[..., :2]).clamp(EPSILON), (b[..., 2:] - b[..., :2]).clamp(EPSILON)
    turn = torch.atan(size_a[..., 0] / size_a[..., 1]) - torch.atan(size_b[..., 0] / size_b[..., 1])
    v = 4 / math.pi**2 * turn**2
    with torch.no_grad():
        weight = v / (1 - iou + v + EPSILON)
    return iou - away / ((hull**2).sum(-1) + EPSILON) - weight * v


@torch.no_grad()
def assign(scores: Tensor, boxes: Tensor, middles: Tensor, targets: Tensor) -> Assigned:
    """Anchors for boxes. Scores (n, a, c), boxes (n, a, 4), targets (n, m, 6): class, the box's four sides, kind."""
    n, a, classes = scores.shape
    kind = targets[..., 5]
    is_ignored = (_inside(targets, middles) & (kind == IGNORED)[..., None]).any(1)
    # What is to be found comes first: of what is ignored there may be ten times as much
    is_real = kind == REAL
    m = max(int(is_real.sum(1).max()), 1)
    first = is_real.int().argsort(dim=1, descending=True, stable=True)[:, :m]
    targets = targets.gather(1, first[..., None].expand(n, m, 6))
    label, box, kind = targets[..., 0].long(), targets[..., 1:5], targets[..., 5]
    iou = overlap(box[:, :, None], boxes[:, None])
    own = scores.gather(2, label.clamp(0)[:, None].expand(n, a, m)).transpose(1, 2)
    is_candidate = _inside(targets, middles) & (kind == REAL)[..., None]
    aligned = own**SCORE_POWER * iou**IOU_POWER * is_candidate
    best = aligned.topk(min(NEAREST, a), -1)
    chosen = torch.zeros_like(is_candidate).scatter(2, best.indices, True) & is_candidate
    # An anchor that several boxes want goes to the one that it overlaps most
    winner = (iou.masked_fill(~chosen, -1.0)).argmax(1)
    chosen &= functional.one_hot(winner, m).transpose(1, 2).bool()
    is_positive = chosen.any(1)
    which = chosen.float().argmax(1)
    aligned = aligned * chosen
    best_iou = (iou * chosen).amax(-1, keepdim=True)
    share = (aligned / (aligned.amax(-1, keepdim=True) + EPSILON) * best_iou).amax(1)
    wanted = functional.one_hot(label.gather(1, which).clamp(0), classes) * (share * is_positive)[..., None]
    counts = is_positive | ~is_ignored
    return Assigned(is_positive, box.gather(1, which[..., None].expand(n, a, 4)), wanted.to(scores.dtype), counts)


def _inside(targets: Tensor, middles: Tensor) -> Tensor:
    """(n, m, anchors) bool: which anchors' middles lie in which boxes."""
    x, y = middles[:, 0], middles[:, 1]
    left, top, right, bottom = targets[..., 1:5, None].unbind(2)
    return (x > left) & (x < right) & (y > top) & (y < bottom)


def loss(raw: Tensor, targets: Tensor, middles: Tensor, strides: Tensor) -> tuple[Tensor, Tensor]:
    """Of a batch: the sum to go down, a scalar, and its parts (3,): boxes, classes, sides."""
    raw = raw.float()
    boxes, logits = boxes_of(raw, middles, strides), raw[..., 4 * BINS :]
    found = assign(logits.sigmoid(), boxes, middles, targets)
    total = found.score.sum().clamp(min=1.0)
    crossed = functional.binary_cross_entropy_with_logits(logits, found.score, reduction="none")
    label = (crossed * found.counts[..., None]).sum() / total
    at = found.is_positive
    weight = found.score.sum(-1)[at]
    box = ((1 - complete_overlap(boxes[at], found.box[at])) * weight).sum() / total
    places = middles.expand(len(raw), -1, -1)[at]
    sides = torch.cat((places - found.box[at][:, :2], found.box[at][:, 2:] - places), -1)
    sides = (sides / strides.expand(len(raw), -1)[at][:, None]).clamp(0, BINS - 1.01)
    side = (_side_loss(raw[..., : 4 * BINS][at], sides) * weight).sum() / total
    parts = torch.stack((BOX * box, LABEL * label, SIDE * side))
    return parts.sum() * len(raw), parts.detach()


def area_loss(logits: Tensor, shares: Tensor) -> Tensor:
    """Of a batch: cross-entropy of areas' logits (n, c, h, w) to `shares` (n, c + 1, h, w), as `areas.shares_of` has
    them; a scalar, in the measure of `loss`."""
    crossed = functional.binary_cross_entropy_with_logits(logits.float(), shares[:, :-1], reduction="none")
    weight = shares[:, -1:] * (1.0 + EDGE * _spread(shares[:, :-1]))
    return AREA * len(logits) * (crossed * weight).sum() / weight.sum().clamp(min=1.0)


def _spread(shares: Tensor) -> Tensor:
    """(n, c, h, w), 0 to 1: how much of a class's shares changes about each part."""
    most, least = (functional.max_pool2d(side * shares, EDGE_PARTS, 1, EDGE_PARTS // 2) for side in (1.0, -1.0))
    return most + least


def _side_loss(raw: Tensor, sides: Tensor) -> Tensor:
    """(k,): cross-entropy to the two bins next to each side's distance, by how near they are; mean of four sides."""
    low = sides.floor()
    up = sides - low
    logs = raw.unflatten(-1, (4, BINS)).log_softmax(-1)
    first = logs.gather(-1, low.long()[..., None])[..., 0]
    second = logs.gather(-1, low.long()[..., None] + 1)[..., 0]
    return -(first * (1 - up) + second * up).mean(-1)
