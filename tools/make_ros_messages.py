"""Renew sitl_emu/run/ros/messages.json, the ROS 2 messages that a run's sensors speak, from their definitions.

    python tools/make_ros_messages.py REPOSITORY@COMMIT …

The repositories are ros2/common_interfaces, ros2/rcl_interfaces, ros2/geometry2 and ros-perception/vision_msgs, in any
order; names and types of fields alone are taken, in the order of the definition.
"""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parent.parent / "sitl_emu" / "run" / "ros" / "messages.json"
ROOTS = (
    "rosgraph_msgs/Clock",
    "sensor_msgs/CameraInfo",
    "sensor_msgs/CompressedImage",
    "sensor_msgs/Image",
    "sensor_msgs/LaserScan",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/Range",
    "tf2_msgs/TFMessage",
    "vision_msgs/Detection2DArray",
)
FIELD = re.compile(r"(?P<kind>[\w/]+)(?P<many>\[\d*\])?\s+(?P<name>\w+)(\s+[^=\s]+)?")
PRIMITIVE = {"bool", "string", "float32", "float64"} | {f"{k}int{b}" for k in ("", "u") for b in (8, 16, 32, 64)}


def fields(definition: str, package: str) -> list[str]:
    """The fields of a .msg file, "float64[9] k", without defaults; types of its own package bear it, too.

    Raises ValueError on what is no field: bounded types, which none of these messages has, included.
    """
    found = []
    for line in definition.splitlines():
        text = line.partition("#")[0].strip()
        if not text or re.fullmatch(r"\w+\s+\w+\s*=.*", text):
            continue
        field = FIELD.fullmatch(text)
        if field is None:
            raise ValueError(f"not a field: {text}")
        kind = field["kind"]
        if kind == "Header":
            kind = "std_msgs/Header"
        elif kind not in PRIMITIVE and "/" not in kind:
            kind = f"{package}/{kind}"
        found.append(f"{kind}{field['many'] or ''} {field['name']}")
    return found


class Definitions:
    """The .msg files of some commits."""

    def __init__(self, repositories: list[tuple[str, str]]) -> None:
        """Paths and commits."""
        self._places: dict[str, tuple[str, str, str]] = {}
        for path, commit in repositories:
            for name in self._git(path, "ls-tree", "-r", "--name-only", commit).splitlines():
                parts = Path(name).parts
                if name.endswith(".msg") and len(parts) > 2 and parts[-2] == "msg":
                    self._places[f"{parts[-3]}/{Path(name).stem}"] = path, commit, name

    @staticmethod
    def _git(path: str, *arguments: str) -> str:
        return subprocess.run(["git", "-C", path, *arguments], check=True, capture_output=True, text=True).stdout

    def read(self, message: str) -> str:
        """A file. Raises KeyError."""
        path, commit, name = self._places[message]
        return self._git(path, "show", f"{commit}:{name}")


def main(arguments: list[str]) -> None:
    """Write the table."""
    repositories = [(path, commit) for path, _, commit in (each.rpartition("@") for each in arguments)]
    definitions, messages, todo = Definitions(repositories), dict[str, str](), list(ROOTS)
    while todo:
        message = todo.pop()
        if message not in messages:
            found = fields(definitions.read(message), message.partition("/")[0])
            messages[message] = "; ".join(found)
            kinds = (field.split()[0].partition("[")[0] for field in found)
            todo += [kind for kind in kinds if kind not in PRIMITIVE]
    source = [f"{Path(path).parent.name.replace('+', '/')} {commit}" for path, commit in repositories]
    table: dict[str, Any] = {"source": sorted(source), "messages": dict(sorted(messages.items()))}
    TABLE.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
