"""The arms of a campaign: a scenario with other values at dotted keys, each checked as a scenario file is.

`--vary vehicles.uas.sensors.gps.noise_horizontal_m=0.5,2.5` gives two arms; several of these give every combination. A
key leads through the scenario file's fields, and through a list by an entry's place, by its name (vehicles) or by `*`
for all of them. Values are YAML, as in the file. What is not there yet is added where the scenario allows it.
"""

import copy
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.run import scenario as scenarios
from sitl_emu.run import worlds
from sitl_emu.run.scenario import Scenario, ScenarioError
from sitl_emu.world.description import yaml_text

KEY = re.compile(r"[A-Za-z0-9_*-]+(\.[A-Za-z0-9_*-]+)*")
ALL = "*"
A_KEY = "a dotted key of the scenario file, such as wind.north_m_s"
SEVERAL, ONE = f"give KEY=A,B with {A_KEY}=0,4,8", f"give KEY=VALUE with {A_KEY}=4"
"""What `--vary` is told to be where it is not: of a campaign, and of one run."""
MOST_ARMS = 1000
"""Ours: more is a mistyped list rather than a campaign."""
SHOWN = 24
"""The longest value that stands in an arm's name as it is."""
LONGEST = 80
"""Characters of a folder's name."""


class Variation(NamedTuple):
    """A key and the values that it takes, one after the other."""

    key: str
    values: tuple[Any, ...]


class Arm(NamedTuple):
    """One condition of a campaign."""

    name: str
    """"altitude=fixed, loss=0.3"; the scenario's own name where nothing varies."""
    values: Mapping[str, Any]
    """What varies, by the short name of its key; scalars, or the number of a value that is none ("#2")."""
    keys: Mapping[str, str]
    """The whole keys of these, by their short names."""
    scenario: Scenario
    slug: str
    """The name as a folder's."""

    @property
    def data(self) -> dict[str, Any]:
        """The scenario as a file has it, which needs no other file beside it."""
        dumped: dict[str, Any] = self.scenario.model_dump(mode="json")
        return dumped


def variation(text: str, wanted: str = SEVERAL) -> Variation:
    """What `--vary TEXT` says; `wanted` is told where it says nothing. Raises ScenarioError."""
    key, equals, values = text.partition("=")
    if not equals or not KEY.fullmatch(key):
        raise ScenarioError(f"--vary {text}: {wanted}")
    try:
        read = yaml_text.load(f"[{values}]")
    except yaml_text.YamlError:
        raise ScenarioError(f"--vary {text}: the values are no YAML; quote what holds , [ ] {{ }} or :") from None
    if not read or None in read:
        raise ScenarioError(f"--vary {text}: a value is missing; {wanted}")
    if any(one in read[:place] for place, one in enumerate(read)):
        raise ScenarioError(f"--vary {text}: a value stands there twice")
    if key == "seed":
        raise ScenarioError(f"--vary {text}: every run of an arm has a seed of its own: --runs and --seed say which")
    return Variation(key, tuple(read))


def single(text: str) -> tuple[str, Any]:
    """The key and the one value of `--vary TEXT` for one run. Raises ScenarioError."""
    read = variation(text, ONE)
    if len(read.values) > 1:
        raise ScenarioError(f"--vary {text}: one value, for one run; `sitl-emu campaign` flies several")
    return read.key, read.values[0]


def arms_of(path: Path, variations: Sequence[Variation]) -> list[Arm]:
    """Every combination of the variations' values, in their order. Raises ScenarioError."""
    twice = [one.key for place, one in enumerate(variations) if one.key in [other.key for other in variations[:place]]]
    if twice:
        raise ScenarioError(f"--vary {twice[0]}: this key is given twice; give all its values at once")
    combinations = list(itertools.product(*(range(len(each.values)) for each in variations)))
    if len(combinations) > MOST_ARMS:
        raise ScenarioError(f"--vary: {len(combinations)} arms; at most {MOST_ARMS}")
    data, short = scenarios.read(path), short_names([each.key for each in variations])
    labels = [_labels(each.values) for each in variations]
    arms = list[Arm]()
    for number, places in enumerate(combinations, 1):
        chosen = [(each.key, each.values[place]) for each, place in zip(variations, places, strict=True)]
        shown = {short[each.key]: label[place] for each, label, place in zip(variations, labels, places, strict=True)}
        scenario = changed(data, chosen, path)
        name = ", ".join(f"{key}={_text(value)}" for key, value in shown.items()) or scenario.name
        arms.append(Arm(name, shown, {name: key for key, name in short.items()}, scenario, _slug(name, number, arms)))
    return arms


def changed(data: Mapping[str, Any], values: Sequence[tuple[str, Any]], path: Path) -> Scenario:
    """The scenario of a file with other values at dotted keys. Raises ScenarioError, which names what is wrong."""
    other = copy.deepcopy(dict(data))
    if isinstance(other.get("world"), str):
        other["world"] = {"kind": other["world"]}
    for key, value in values:
        for holder, last in _places(other, key):
            holder[last] = copy.deepcopy(value)
    try:
        scenario = scenarios.checked(other, path.resolve())
    except ScenarioError as error:
        what = ", ".join(f"{key}={_text(value)}" for key, value in values)
        raise ScenarioError(f"--vary {what}: {error}" if values else str(error)) from None
    if worlds.is_file(scenario.world.kind):
        whole = str(Path(scenario.world.kind).resolve())
        scenario = scenario.model_copy(update={"world": scenario.world.model_copy(update={"kind": whole})})
    return scenario


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """For each dotted key as many of its last fields as tell it from the others."""
    names = dict[str, str]()
    for key in keys:
        fields = key.split(".")
        ends = [".".join(fields[-count:]) for count in range(1, len(fields) + 1)]
        names[key] = next(
            (end for end in ends if sum(other == end or other.endswith(f".{end}") for other in keys) == 1), key
        )
    return names


def _places(data: dict[str, Any], key: str) -> Iterator[tuple[Any, Any]]:
    """Where a dotted key's value is: a mapping or a list, and the name or the place in it."""
    holders, way = [data], list[str]()
    *fields, last = key.split(".")
    for field in fields:
        way.append(field)
        holders = [entry for holder in holders for entry in _entered(holder, field, key, way)]
    for holder in holders:
        for name in _names(holder, last, key, [*way, last]):
            yield holder, name


def _entered(holder: Any, field: str, key: str, way: Sequence[str]) -> Iterator[Any]:
    for name in _names(holder, field, key, way):
        if isinstance(holder, dict) and holder.get(name) is None:
            holder[name] = {}
        if not isinstance(holder[name], dict | list):
            raise ScenarioError(f"--vary {key}: {'.'.join(way)} is {holder[name]!r} there, which holds no fields")
        yield holder[name]


def _names(holder: Any, field: str, key: str, way: Sequence[str]) -> list[Any]:
    """Under which names a field of a key is in a mapping or a list."""
    if isinstance(holder, dict):
        return list(holder) if field == ALL else [field]
    if field == ALL:
        return list(range(len(holder)))
    named = [place for place, one in enumerate(holder) if isinstance(one, dict) and one.get("name") == field]
    if named or (field.isdigit() and int(field) < len(holder)):
        return named or [int(field)]
    there = [str(one.get("name", place)) if isinstance(one, dict) else str(place) for place, one in enumerate(holder)]
    known = ", ".join([*there, ALL]) if there else "the list is empty"
    raise ScenarioError(f"--vary {key}: {'.'.join(way)}: no such entry; there are: {known}")


def _labels(values: Sequence[Any]) -> list[Any]:
    """Values in names and tables: themselves where they are short, else by their number."""
    return [
        value if isinstance(value, bool | int | float | str) and len(str(value)) <= SHOWN else f"#{number}"
        for number, value in enumerate(values, 1)
    ]


def _slug(name: str, number: int, others: Sequence[Arm]) -> str:
    """A name as a folder's; with its number where it would be another's too, or is long."""
    slug = re.sub(r"[^A-Za-z0-9_.=-]+", "_", name).strip("_.")
    return slug if len(slug) <= LONGEST and slug not in {arm.slug for arm in others} else f"{slug[:LONGEST]}-{number}"


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
