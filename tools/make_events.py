"""Write autopilot/events/events.json from PX4's table of events.

    python tools/make_events.py FOLDER

FOLDER holds `tables/events.json`: id, group and argument types of every event of the PX4 v1.18 build, the numbers of
their enums, and which modes belong to which group. Numbers only: what an event says is for us to say.
"""

import json
import pathlib
import sys
from typing import Any

TARGET = pathlib.Path(__file__).parents[1] / "autopilot" / "events" / "events.json"


def main() -> None:
    """Write the file."""
    table = json.loads((pathlib.Path(sys.argv[1]) / "tables" / "events.json").read_text())
    enums, events = dict[str, Any](), dict[str, Any]()
    for key, row in table.items():
        namespace, _, rest = key.partition("/")
        if rest.startswith("enum/"):
            enums[f"{namespace}::{rest[5:]}"] = row
        elif rest != "navigation_mode_groups":
            group, _, name = rest.partition("/")
            events[name] = {"id": row["id"], "group": group, "arguments": row["arguments"]}
    lines = [f'"groups": {json.dumps(table["px4/navigation_mode_groups"]["groups"])}']
    for title, rows in (("enums", enums), ("events", events)):
        body = ",\n".join(f" {json.dumps(name)}: {json.dumps(row)}" for name, row in sorted(rows.items()))
        lines.append(f'"{title}": {{\n{body}\n}}')
    TARGET.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    print(f"{len(events)} events, {len(enums)} enums")


if __name__ == "__main__":
    main()
