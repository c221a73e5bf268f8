"""Which classes are looked for, chosen before flight: the second paper's selection file.

    {"fire_region": 1.0, "debris_field": {"weight": 0.8, "threshold": 0.4}}

Scores are multiplied by the weight, then those below the threshold are dropped. A class that is not named is not looked
for. The file may lie on the companion, or on the autopilot's card (`mftp:///PATH`), where a ground station puts it by
MAVLink FTP and the companion gets it before take-off (`steps.select`).
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Areas, Detections, Detector

MFTP = "mftp://"
"""MAVLink FTP's scheme (https://mavlink.io/en/services/ftp.html#mavlink-ftp-url-scheme)."""
MOST_WEIGHT = 10.0


class Wanted(NamedTuple):
    """One class that is looked for."""

    weight: float = 1.0
    threshold: float = 0.0
    """Of the weighed score."""


Selection = Mapping[str, Wanted]


class Selected:
    """A detector that looks for some classes only, and believes in each as much as it is told."""

    def __init__(self, detector: Detector, selection: Selection) -> None:
        self._detector, self.selection = detector, selection
        """May be replaced while nobody looks."""

    @property
    def known(self) -> tuple[str, ...]:
        """All labels that may be chosen."""
        return self._detector.labels

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels that are looked for."""
        return tuple(label for label in self.known if label in self.selection)

    def detect(self, image: Image, gsd_m: float | None = None) -> Detections:
        """As `Detector`; best score first. Areas are weighed as scores are."""
        found, every = Detections(), self._detector.detect(image, gsd_m)
        for one in every:
            wanted = self.selection.get(one.label)
            if wanted is not None and (score := min(1.0, one.score * wanted.weight)) >= wanted.threshold:
                found.append(one._replace(score=score))
        found.sort(key=lambda one: -one.score)
        if isinstance(every, Detections) and every.areas is not None:
            found.areas = self._weighed(every.areas)
        return found

    def _weighed(self, areas: Areas) -> Areas:
        labels = self.labels
        shares = areas.shares[[areas.labels.index(label) for label in labels]]
        weights = np.array([self.selection[label].weight for label in labels], np.float32)[:, None, None]
        least = np.array([self.selection[label].threshold for label in labels], np.float32)[:, None, None]
        shares = np.minimum(shares * weights, np.float32(1.0))
        return areas._replace(labels=labels, shares=np.where(shares < least, np.float32(0.0), shares))


def read(path: Path, labels: tuple[str, ...]) -> Selection:
    """From a file. Raises ValueError."""
    try:
        text = path.read_text()
    except (OSError, ValueError) as error:
        raise ValueError(f"{str(path)!r}: can't be read as a JSON file: {error}") from None
    return parsed(text, str(path), labels)


def parsed(text: str, name: str, labels: tuple[str, ...]) -> Selection:
    """From a file's text. Raises ValueError, which names the file."""
    try:
        chosen = json.loads(text)
    except ValueError as error:
        raise ValueError(f"{name!r}: can't be read as a JSON file: {error}") from None
    return selection_of(chosen, labels)


def selection_of(chosen: Any, labels: tuple[str, ...]) -> Selection:
    """From plain data, for a detector that knows `labels`; a class of weight 0 is left out. Raises ValueError."""
    if not isinstance(chosen, Mapping):
        raise ValueError(f"{chosen!r}; allowed: a mapping of classes to weights")
    made = {}
    for label, given in chosen.items():
        if label not in labels:
            raise ValueError(f"{label!r}: no class of this detector; it knows {', '.join(labels)}")
        wanted = _wanted(str(label), given)
        if wanted.weight > 0.0:
            made[str(label)] = wanted
    if not made:
        raise ValueError(f"{dict(chosen)!r}: looks for nothing; give a class a weight above 0")
    return made


def _wanted(label: str, given: Any) -> Wanted:
    fields = given if isinstance(given, Mapping) else {"weight": given}
    if unknown := [name for name in fields if name not in Wanted._fields]:
        raise ValueError(f"{label}: {unknown[0]!r}; allowed: {' and '.join(Wanted._fields)}")
    wanted = Wanted(**fields)
    for name, value, most in (("weight", wanted.weight, MOST_WEIGHT), ("threshold", wanted.threshold, 1.0)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= most:
            raise ValueError(f"{label}: {value!r}; allowed: a {name} from 0 to {most:g}")
    return wanted
