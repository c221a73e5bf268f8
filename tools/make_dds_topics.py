"""Renew autopilot/uxrce_dds_client/dds_topics.json, what PX4's uXRCE-DDS client publishes and takes, from PX4's source.

    python tools/make_dds_topics.py PX4_REPOSITORY COMMIT

Names, types, numbers alone are taken: topics and their rates (src/modules/uxrce_dds_client/dds_topics.yaml), of each
message its fields in the order of its definition, which is that of px4_msgs, its MESSAGE_VERSION, its queue's length,
and the hash by which ROS 2 libraries ask whether they know the same message (MessageFormatRequest).
"""

import json
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

TABLE = Path(__file__).parent.parent / "autopilot" / "uxrce_dds_client" / "dds_topics.json"
TOPICS = "src/modules/uxrce_dds_client/dds_topics.yaml"
FOLDERS = ("msg/versioned", "msg")
BUILT_IN = {f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)} | {
    "float32",
    "float64",
    "bool",
    "char",
}
FIELD = re.compile(r"(?P<kind>\w+)(?P<length>\[\d+\])?\s+(?P<name>\w+)")
CONSTANT = re.compile(r"\w+\s+(?P<name>MESSAGE_VERSION|ORB_QUEUE_LENGTH)\s*=\s*(?P<value>\d+)")
POLL_INTERVAL_MS = 4
"""Of topics without a rate_limit (UXRCE_DEFAULT_POLL_INTERVAL_MS, dds_topics.h.em)."""
FNV_BASIS, FNV_PRIME = 0x811C9DC5, 0x1000193
Message = Mapping[str, Any]


def message(definition: str) -> Message:
    """Version, queue's length and fields ("float32[4] q") of a .msg file. Raises ValueError on what is no field."""
    found, fields = {"MESSAGE_VERSION": 0, "ORB_QUEUE_LENGTH": 1}, []
    for line in definition.splitlines():
        text = line.partition("#")[0].strip()
        constant = CONSTANT.fullmatch(text)
        if constant is not None:
            found[constant["name"]] = int(constant["value"])
        elif text and "=" not in text:
            field = FIELD.fullmatch(text)
            if field is None:
                raise ValueError(f"not a field: {text}")
            fields.append(f"{field['kind']}{field['length'] or ''} {field['name']}")
    return {"version": found["MESSAGE_VERSION"], "queue": found["ORB_QUEUE_LENGTH"], "fields": "; ".join(fields)}


def kinds(fields: str) -> list[str]:
    """The types of fields, without lengths."""
    return [field.split()[0].partition("[")[0] for field in fields.split("; ")]


def format_hash(fields: str, messages: Mapping[str, Message]) -> int:
    """PX4's hash of a message's fields, those of messages within it included (px_generate_uorb_topic_helper.py)."""

    def spelt(fields: str) -> str:
        text = ""
        for field, kind in zip(fields.split("; "), kinds(fields), strict=True):
            text += f"{field}\n" + ("" if kind in BUILT_IN else spelt(messages[kind]["fields"]))
        return text

    value = FNV_BASIS
    for letter in spelt(fields).encode():
        value = (value ^ letter) * FNV_PRIME & 0xFFFFFFFF
    return value


def topic(row: Mapping[str, Any]) -> dict[str, str | int]:
    """Name, type and interval of a row of dds_topics.yaml, and how many sources of it are told apart."""
    name, rate_hz = row["topic"].rpartition("/")[2], row.get("rate_limit")
    interval_ms = POLL_INTERVAL_MS if rate_hz is None else round(1000 / rate_hz)
    told = {"topic": name, "type": row["type"].rpartition("::")[2], "interval_ms": interval_ms}
    return told | ({"instances": row["max_instances"]} if "max_instances" in row else {})


def table(source: str, topics: str, definition: Callable[[str], str]) -> dict[str, Any]:
    """The whole table; `definition` returns the .msg file of a message."""
    rows = yaml.safe_load(topics)
    published = [topic(row) for row in rows["publications"]]
    taken = [topic(row) for row in (*rows["subscriptions"], *rows["subscriptions_multi"])]
    for row in taken:
        del row["interval_ms"]
    todo, messages = sorted({str(row["type"]) for row in (*published, *taken)}), dict[str, dict[str, Any]]()
    while todo:
        name = todo.pop()
        if name not in messages:
            messages[name] = dict(message(definition(name)))
            todo += [kind for kind in kinds(messages[name]["fields"]) if kind not in BUILT_IN]
    for each in messages.values():
        each["hash"] = format_hash(each["fields"], messages)
    return {
        "source": source,
        "publications": published,
        "subscriptions": taken,
        "messages": dict(sorted(messages.items())),
    }


def main(repository: str, commit: str) -> None:
    """Write the table of a commit."""

    def show(path: str) -> str:
        command = ["git", "-C", repository, "show", f"{commit}:{path}"]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def definition(name: str) -> str:
        for folder in FOLDERS:
            try:
                return show(f"{folder}/{name}.msg")
            except subprocess.CalledProcessError:
                continue
        raise FileNotFoundError(f"{name}.msg")

    found = table(f"PX4-Autopilot {commit}", show(TOPICS), definition)
    TABLE.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
