"""Renew autopilot/logger/formats.json, the fields of what is logged, from PX4's message definitions.

    python tools/make_log_formats.py PX4/msg [TOPIC ...]

`PX4/msg` is that folder of a checkout of PX4 v1.18; every TOPIC is added to those that are in the file already. Names
and types alone are taken, in the order in which PX4 logs them: by the size of the type, largest first, else as they
stand, messages within messages last (Tools/msg/px_generate_uorb_topic_helper.py). Where one message makes several
topics, its last comment names them ("# TOPICS").
"""

import json
import re
import sys
from pathlib import Path

FORMATS = Path(__file__).parent.parent / "autopilot" / "logger" / "formats.json"
C_TYPES = {
    **{f"{kind}{bits}": f"{kind}{bits}_t" for kind in ("int", "uint") for bits in (8, 16, 32, 64)},
    "float32": "float",
    "float64": "double",
    "bool": "bool",
    "char": "char",
}
SIZES = {"64": 8, "32": 4, "16": 2}
"""By the end of a built-in type's name; all others have one byte."""
FIELD = re.compile(r"(?P<kind>\w+)(?P<length>\[\d+\])?\s+(?P<name>\w+)")


def snake_case(name: str) -> str:
    """`EscReport` as topics are written: `esc_report`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def fields(definition: str) -> str:
    """The fields of a .msg file as ULog writes them."""
    found: list[tuple[int, str]] = []
    for line in definition.splitlines():
        text = line.partition("#")[0].strip()
        if not text or "=" in text:
            continue
        match = FIELD.fullmatch(text)
        if match is None:
            raise ValueError(f"not a field: {text}")
        kind, length, name = match["kind"], match["length"] or "", match["name"]
        size = (SIZES.get(kind[-2:], 1)) if kind in C_TYPES else 0
        found.append((size, f"{C_TYPES.get(kind) or snake_case(kind)}{length} {name}"))
    return "; ".join(text for _, text in sorted(found, key=lambda pair: -pair[0]))


def topics(name: str, definition: str) -> list[str]:
    """The topics of a message: its own name, unless it says others."""
    told = re.findall(r"^# TOPICS (.+)$", definition, re.MULTILINE)
    return [topic for line in told for topic in line.split()] or [snake_case(name)]


def formats(folder: Path) -> dict[str, str]:
    """All topics and all messages of PX4's `msg` folder, with their fields."""
    found: dict[str, str] = {}
    for path in sorted((*folder.glob("*.msg"), *(folder / "versioned").glob("*.msg"))):
        definition = path.read_text()
        told = fields(definition)
        found[snake_case(path.stem)] = told
        found.update(dict.fromkeys(topics(path.stem, definition), told))
    return found


def chosen(known: dict[str, str], names: set[str]) -> dict[str, str]:
    """Those of the names, and the messages that their fields are made of. Raises KeyError on an unknown one."""
    todo, taken = sorted(names), {}
    while todo:
        name = todo.pop()
        taken[name] = known[name]
        kinds = (field.split()[0].partition("[")[0] for field in known[name].split(";"))
        todo += [kind for kind in kinds if kind in known and kind not in taken]
    return dict(sorted(taken.items()))


if __name__ == "__main__":
    wanted = set(json.loads(FORMATS.read_text())) | set(sys.argv[2:])
    FORMATS.write_text(json.dumps(chosen(formats(Path(sys.argv[1])), wanted), indent=1) + "\n")
