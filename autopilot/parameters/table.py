"""PX4's table of parameters: `parameters.json` beside this file, which tools/make_parameters.py makes."""

import functools
import json
import pathlib
from typing import Any

TABLE = pathlib.Path(__file__).with_name("parameters.json")


@functools.cache
def table() -> dict[str, dict[str, Any]]:
    """Every parameter of PX4 v1.18 with its type, default, bounds and who announces it."""
    loaded: dict[str, dict[str, Any]] = json.loads(TABLE.read_text())
    return loaded
