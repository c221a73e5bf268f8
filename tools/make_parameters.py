"""Write autopilot/parameters/parameters.json and the reference airframes from PX4's measured parameter set.

    python tools/make_parameters.py FOLDER

FOLDER holds `tables/parameters.json` (every parameter of the PX4 v1.18 build: type, default, bounds, unit, group)
and `facts/MODEL/params.json` (which of them each reference vehicle announces, and with which value). Our own files
keep numbers only; what a parameter means is for us to say.
"""

import json
import pathlib
import sys
from typing import Any

ROOT = pathlib.Path(__file__).parents[1]
REFERENCES = {"multicopter": "sihsim_hex", "rover": "sihsim_rover_ackermann"}
KEPT = (
    "default",
    "min",
    "max",
    "decimalPlaces",
    "increment",
    "units",
    "group",
    "category",
    "rebootRequired",
    "volatile",
    "values",
    "bits",
)


def announced(folder: pathlib.Path, model: str) -> dict[str, float | int]:
    """{name: value} that a reference vehicle sends in its parameter list."""
    facts = json.loads((folder / "facts" / model / "params.json").read_text())["facts"]
    values = {
        key[6:]: fact["expected"]["value"]
        for key, fact in facts.items()
        if key.startswith("param/") and isinstance(fact["expected"], dict)
    }
    values["MAV_SYS_ID"] = 1
    values["CAL_BARO0_OFF"] = 0.0  # announced, but not among the facts: PX4 calibrates it in flight
    return values


def told(default: float | str) -> float | str:
    """A default as the facts would tell it: floats have seven significant digits there (px4probe/wire.py)."""
    return float(f"{default:.7g}") if isinstance(default, float) else default


def main() -> None:
    """Write the files."""
    folder = pathlib.Path(sys.argv[1])
    known = json.loads((folder / "tables" / "parameters.json").read_text())
    lists = {kind: announced(folder, model) for kind, model in REFERENCES.items()}
    table = {}
    for name, entry in sorted(known.items()):
        row: dict[str, Any] = {"type": "INT32" if entry["type"] == "Int32" else "REAL32"}
        row |= {key: entry[key] for key in KEPT if key in entry}
        row["announced"] = [kind for kind, values in lists.items() if name in values]
        table[name] = row
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(row)}" for name, row in table.items())
    (ROOT / "autopilot" / "parameters" / "parameters.json").write_text("{\n" + lines + "\n}\n")
    for kind, model in REFERENCES.items():
        changed = {
            name: value
            for name, value in sorted(lists[kind].items())
            if name in table and isinstance(value, int | float) and value != told(table[name]["default"])
        }
        target = ROOT / "vehicles" / model / "airframe.json"
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(json.dumps(changed, indent=1) + "\n")
    unknown = {name for values in lists.values() for name in values} - set(table)
    print(f"{len(table)} parameters; not in the table: {sorted(unknown)}")


if __name__ == "__main__":
    main()
