"""Trains the network: the second paper's settings by default, on a GPU if there is one, over any number of sittings.

Each epoch ends in `last.pt`, from which the next sitting goes on; `best.pt` is the one with the highest mAP@0.5 on the
validation split. What is validated and kept is a moving average of the weights. An epoch's order and changes come from
the seed and its number alone.

A data set that knows which pixels show what trains areas, too; `areas_only` these alone, on a network that stays as it
is: the best is then that with the highest mean IoU.
"""

import json
import math
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from torch.optim.swa_utils import get_ema_multi_avg_fn

from sitl_emu.missions.companion.yolo import APART_IOU, Found, decoded, middles
from tools.detector import augment, data, start
from tools.detector.areas import AreaScore, scored, shares_of
from tools.detector.loss import area_loss, loss
from tools.detector.net import Deployed, Network, anchors
from tools.detector.scores import Score, score

MOMENTUM, WARM_MOMENTUM = 0.937, 0.8
LAST_RATE = 0.01
"""Of the first, at the end."""
AVERAGES_STEPS = 2000.0
MOST_GRADIENT = 10.0


class Settings(NamedTuple):
    """Of a training. The figures are the second paper's; batch, width and input size are ours."""

    data: Path
    out: Path
    epochs: int = 100
    batch: int = 16
    width: float = 1.0
    input_width: int = 416
    input_height: int = 320
    rate: float = 0.01
    decay: float = 5e-4
    warm_epochs: float = 3.0
    seed: int = 1
    workers: int = 0
    start: Path | None = None
    """To begin with instead of chance: a checkpoint or exported network, as wide or half as wide, of any input size."""
    areas_only: bool = False
    validate_every: int = 1
    """Epochs; and after the last."""
    minutes: float = math.inf
    """A sitting ends after the epoch in which they are over."""
    within_minutes: float = math.inf
    """All of it is over by then, in one sitting: the rate falls by the clock where that is ahead of the epochs. For a
    machine that is lent; what comes of it depends on how fast it is."""


Batch = tuple[Tensor, Tensor, Tensor]
"""Pictures (n, h, w, 3) uint8 BGR, targets (n, m, 6), and shares (n, classes + 1, h / 8, w / 8) as `areas` has them."""


class Pictures(torch.utils.data.Dataset[Batch]):
    """A training split, changed anew each epoch."""

    def __init__(self, split: data.Split, how: augment.Strength, seed: int) -> None:
        self.split, self.how, self.seed = split, how, seed

    def __len__(self) -> int:
        return len(self.split.images)

    def __getitem__(self, key: tuple[int, int]) -> Batch:
        """By epoch and number."""
        cv2.setNumThreads(1)
        rng = np.random.default_rng((self.seed, *key))
        image, rows, shown = augment.sample(self._pick, key[1], len(self), self.how, rng)
        shares = shares_of(shown, len(self.split.labels), image.shape[:2])
        return torch.from_numpy(image), torch.from_numpy(rows), torch.from_numpy(shares)

    def _pick(self, number: int) -> augment.Sample:
        return self.split.sample(number)


def joined(samples: list[Batch]) -> Batch:
    """Of single pictures; targets are filled up with rows of 0."""
    images, all_rows, shares = zip(*samples, strict=True)
    targets = torch.zeros(len(samples), max(max(len(rows) for rows in all_rows), 1), 6)
    for own, rows in zip(targets, all_rows, strict=True):
        own[: len(rows)] = rows
    return torch.stack(images), targets, torch.stack(shares)


def rgb(images: Tensor) -> Tensor:
    """Pictures (n, h, w, 3) as cameras have them, BGR, as the network reads them: (n, 3, h, w), RGB from 0 to 1."""
    return images.flip(-1).permute(0, 3, 1, 2).float() / 255.0


class Sitting:
    """A training at work."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        torch.manual_seed(settings.seed)
        cv2.setNumThreads(1)  # or the workers, which are forked, wait for threads that they don't have
        torch.backends.cudnn.benchmark = True
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.has_bf16 = self.device.type == "cuda" or bool(torch.cpu.get_capabilities().get("avx512_bf16"))
        size = settings.input_width, settings.input_height
        self.train, self.val = (data.load(settings.data, name, *size) for name in ("train", "val"))
        for name, split in (("train", self.train), ("val", self.val)):
            if not split.images:
                raise ValueError(f"{settings.data / name}.json has no pictures: draw more worlds (dataset --images)")
        classes, layout = len(self.train.labels), torch.channels_last  # a sixth faster on a CPU than the usual one
        has_areas = any(regions is not None for regions in self.train.regions)
        if settings.areas_only and not (has_areas and settings.start):
            raise ValueError(f"areas alone: {settings.data} has no regions, or there is no network to start with")
        self.network = Network(classes, settings.width, has_areas).to(self.device, memory_format=layout)
        if settings.start is not None:
            start.begin(settings.start, self.network, self.train.labels, self.train.images)
        self.average = Network(classes, settings.width, has_areas).to(self.device, memory_format=layout).eval()
        self.average.load_state_dict(self.network.state_dict())
        if settings.areas_only:
            self.network.requires_grad_(False)
            assert self.network.areas is not None
            self.network.areas.requires_grad_(True)
        self.optimiser = torch.optim.SGD(_groups(self.network, settings.decay), settings.rate, MOMENTUM, nesterov=True)
        self.epoch, self.step, self.best, self.seconds = 0, 0, -1.0, 0.0
        self.history: list[dict[str, Any]] = []
        self.began, self.is_over = time.monotonic(), False
        self.steps = max(len(self.train.images) // settings.batch, 1)
        """Of an epoch; pictures that are left over come in another."""
        self.anchors = anchors(settings.input_height, settings.input_width, self.device)

    # --- an epoch -----------------------------------------------------------------------------------------------------

    def batches(self) -> Iterator[Batch]:
        """Those of all epochs that are left: workers go on while an epoch is validated."""
        settings = self.settings
        return iter(torch.utils.data.DataLoader(
            Pictures(self.train, augment.Strength(), settings.seed), batch_sampler=self._order(),
            num_workers=settings.workers, collate_fn=joined, pin_memory=self.device.type == "cuda",
        ))  # fmt: skip

    def _order(self) -> Iterator[list[tuple[int, int]]]:
        batch, count = self.settings.batch, len(self.train.images)
        for epoch in range(self.epoch, self.settings.epochs):
            order = np.random.default_rng((self.settings.seed, epoch)).permutation(count)
            for step in range(self.steps):
                yield [(epoch, int(k)) for k in order[step * batch : (step + 1) * batch]]

    def run_epoch(self, batches: Iterator[Batch]) -> dict[str, Any]:
        """Learn from every picture once, and say how good it is then, where it is asked."""
        began = time.monotonic()
        self.network.train()
        if self.settings.areas_only:
            self.network.eval()
            assert self.network.areas is not None
            self.network.areas.train()
        parts = torch.zeros(4, device=self.device)
        for count, batch in enumerate(islice(batches, self.steps), start=1):
            self._set_rate()
            parts += self._learn(*(each.to(self.device, non_blocking=True) for each in batch))
            if count % 20 == 0:
                print(f"\repoch {self.epoch + 1}: {count} of {self.steps}", end="", flush=True)
        row = {"epoch": self.epoch + 1, "loss": [round(float(part) / self.steps, 4) for part in parts],
               "images_s": round(self.steps * self.settings.batch / (time.monotonic() - began), 1)}  # fmt: skip
        self.epoch += 1
        self.is_over = self.done() == 1.0
        if self.epoch % self.settings.validate_every == 0 or self.is_over:
            found, areas = validated(self.average, self.val, self.device)
            row |= {"map50": round(found.map50, 4), "map50_95": round(found.map50_95, 4),
                    "classes": [round(one.ap50, 3) for one in found.classes],
                    "area_iou": [round(one.iou, 3) for one in areas]}  # fmt: skip
        row["seconds"] = round(time.monotonic() - began, 1)
        self.seconds += time.monotonic() - began
        self.history.append(row)
        return row

    def _learn(self, images: Tensor, targets: Tensor, shares: Tensor) -> Tensor:
        x = rgb(images)
        network, areas_only = self.network, self.settings.areas_only
        total, parts = torch.zeros((), device=self.device), torch.zeros(4, device=self.device)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.has_bf16):
            with torch.set_grad_enabled(not areas_only):
                features = network.features(x)
            raw = None if areas_only else network.anchored(features)
            logits = None if network.areas is None else network.areas(features[0])
        if raw is not None:
            total, parts[:3] = loss(raw, targets, *self.anchors)
        if logits is not None:
            area = area_loss(logits, shares)
            total, parts[3] = total + area, area.detach() / len(images)
        self.optimiser.zero_grad(set_to_none=True)
        total.backward()
        nn.utils.clip_grad_norm_(network.parameters(), MOST_GRADIENT)
        self.optimiser.step()
        self.step += 1
        self._follow()
        return parts

    def done(self) -> float:
        """How much of the training is over, from 0 to 1."""
        by_clock = (time.monotonic() - self.began) / (60 * self.settings.within_minutes)
        return min(max(self.step / (self.steps * self.settings.epochs), by_clock), 1.0)

    def _set_rate(self) -> None:
        settings, done = self.settings, self.done()
        warm = min(done * settings.epochs / settings.warm_epochs, 1.0) if settings.warm_epochs else 1.0
        cosine = LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + math.cos(math.pi * done))
        for group in self.optimiser.param_groups:
            group["lr"] = settings.rate * cosine * warm
            group["momentum"] = WARM_MOMENTUM + (MOMENTUM - WARM_MOMENTUM) * warm

    @torch.no_grad()
    def _follow(self) -> None:
        """The average follows the weights, the more slowly the longer it has."""
        kept = 0.9999 * (1 - math.exp(-self.step / AVERAGES_STEPS))
        pairs = list(zip(self.average.state_dict().values(), self.network.state_dict().values(), strict=True))
        olds, news = zip(*(pair for pair in pairs if pair[0].is_floating_point()), strict=True)
        get_ema_multi_avg_fn(kept)(list(olds), list(news), None)
        for old, new in pairs:
            if not old.is_floating_point():
                old.copy_(new)

    # --- sittings -----------------------------------------------------------------------------------------------------

    def go_on(self) -> None:
        """Take up where the last sitting ended, if there was one. Raises ValueError."""
        path = self.settings.out / "last.pt"
        if not path.exists():
            return
        kept = torch.load(path, map_location=self.device, weights_only=True)
        if kept["settings"] != self._told():
            raise ValueError(f"{path} was trained with other settings: {kept['settings']}; name another folder")
        self.network.load_state_dict(kept["network"])
        self.average.load_state_dict(kept["average"])
        self.optimiser.load_state_dict(kept["optimiser"])
        self.epoch, self.step, self.best, self.seconds, self.history = (
            kept[name] for name in ("epoch", "step", "best", "seconds", "history")
        )
        self.is_over = self.done() == 1.0

    def keep(self) -> None:
        """Write what the next sitting needs, and the best so far."""
        row = self.history[-1]
        good = self.best
        if "map50" in row:
            good = float(np.mean(row["area_iou"])) if self.settings.areas_only else row["map50"]
        is_best, self.best = good > self.best, max(self.best, good)
        kept = {"settings": self._told(), "network": self.network.state_dict(), "average": self.average.state_dict(),
                "optimiser": self.optimiser.state_dict(), "epoch": self.epoch, "step": self.step, "best": self.best,
                "seconds": self.seconds, "history": self.history, "labels": list(self.train.labels)}  # fmt: skip
        torch.save(kept, self.settings.out / "new.pt")
        (self.settings.out / "new.pt").replace(self.settings.out / "last.pt")
        if is_best:
            del kept["optimiser"], kept["network"]
            torch.save(kept, self.settings.out / "best.pt")
        (self.settings.out / "history.json").write_text(json.dumps(self.history, indent=1) + "\n")

    def _told(self) -> dict[str, Any]:
        apart = ("data", "out", "workers", "start", "validate_every", "minutes", "within_minutes")
        return {name: value for name, value in self.settings._asdict().items() if name not in apart}


def _groups(network: nn.Module, decay: float) -> list[dict[str, Any]]:
    """Weights of convolutions decay, biases and norms don't."""
    learning = [each for each in network.parameters() if each.requires_grad]
    plain, others = [each for each in learning if each.ndim == 1], [each for each in learning if each.ndim > 1]
    return [{"params": others, "weight_decay": decay}, {"params": plain, "weight_decay": 0.0}]


@torch.no_grad()
def validated(
    network: Network, split: data.Split, device: torch.device, batch: int = 32
) -> tuple[Score, list[AreaScore]]:
    """What a network finds in a split, scored; and its areas, if it has any."""
    height, width = split.images[0].shape[:2]
    deployed, at = Deployed(network, height, width).to(device).eval(), middles(height, width)
    found, areas = list[Found](), list[np.ndarray]()
    for first in range(0, len(split.images), batch):
        images = torch.from_numpy(np.stack(split.images[first : first + batch])).to(device)
        out, *rest = deployed(rgb(images))
        found += [decoded(each, at, 0.01, APART_IOU) for each in out.float().cpu().numpy()]
        areas += [each for shares in rest for each in shares.float().cpu().numpy()]
    truths = [split.truth(k) for k in range(len(split.images))]
    return score(found, truths, len(split.labels)), scored(areas, split)


def train(settings: Settings) -> None:
    """One sitting. Raises OSError, ValueError."""
    settings.out.mkdir(parents=True, exist_ok=True)
    sitting = Sitting(settings)
    sitting.go_on()
    print(f"{sum(each.numel() for each in sitting.network.parameters()):,} parameters, "
          f"{len(sitting.train.images)} pictures, on {sitting.device}, from epoch {sitting.epoch + 1}")  # fmt: skip
    batches = sitting.batches()
    while not sitting.is_over:
        print("\r" + json.dumps(sitting.run_epoch(batches)), flush=True)
        sitting.keep()
        if time.monotonic() - sitting.began > 60 * settings.minutes:
            break
