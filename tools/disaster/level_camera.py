"""The disaster mission's aircraft with its camera under a gimbal: a scenario of its own, written into a folder.

The paper's equations 1 to 3 are those of a camera that looks straight down, and it does not say what holds it so. Ours
is fixed to the body and leans with it. Under a gimbal what is left of their errors are those of height and receiver,
which is what the paper's Table 5 is about.
"""

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from sitl_emu import vehicles
from sitl_emu.missions import registry

AIRCRAFT, GIMBAL_OF = "responder", "m600"
"""The gimbal is that of the hexacopter; its mass is left out."""


def written(folder: Path, scenario: str) -> Path:
    """A scenario that a mission brings, flown with a level camera: its file in `folder`, the aircraft beside it.

    Raises OSError where the folder cannot be written.
    """
    given = yaml.safe_load(registry.scenarios()[scenario].read_text())
    for vehicle in given["vehicles"]:
        vehicle["model"] = _aircraft(folder).name
        vehicle["camera"]["mount"] = "gimbal"
    path = folder / f"{scenario}.yaml"
    path.write_text(yaml.safe_dump(given, sort_keys=False))
    return path


def _aircraft(folder: Path) -> Path:
    """The aircraft's folder, with the gimbal's table and its PX4 parameters (MNT_*)."""
    own, other = (vehicles.FOLDER / name for name in (AIRCRAFT, GIMBAL_OF))
    made = folder / f"{AIRCRAFT}-level"
    made.mkdir(parents=True, exist_ok=True)
    gimbal = tomllib.loads((other / vehicles.TOML).read_text())["gimbal"]
    (made / vehicles.TOML).write_text(f"{(own / vehicles.TOML).read_text()}\n[gimbal]\n{_toml(gimbal)}")
    airframe, mount = (json.loads((one / vehicles.AIRFRAME).read_text()) for one in (own, other))
    airframe |= {name: value for name, value in mount.items() if name.startswith("MNT_")}
    (made / vehicles.AIRFRAME).write_text(json.dumps(airframe, indent=1))
    return made


def _toml(table: Mapping[str, Any]) -> str:
    """Of texts and numbers, which TOML writes as JSON does."""
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in table.items())
