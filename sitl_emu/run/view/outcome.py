"""How a run ended, for its page: outcome, figures, and what its missions say of colours and marks on the map."""

from typing import Any

from sitl_emu.missions import registry
from sitl_emu.run import score
from sitl_emu.run.scenario import Scenario


def over(scenario: Scenario, summary: dict[str, Any]) -> dict[str, Any]:
    """From summary.json; a mission that is no longer installed says nothing."""
    programs = [each.companion.mission for each in scenario.vehicles if each.companion is not None]
    try:
        missions = registry.missions_of([name for name in programs if name is not None])
    except registry.MissionError:
        missions = []
    pages = score.pages(missions, summary)
    return {
        "outcome": str(summary.get("outcome", "unknown")),
        "success": score.exit_status(summary) == score.EXIT_SUCCESS,
        "lines": [str(line) for line in summary.get("lines", [])],
        "simulated_s": summary.get("simulated_s"),
        "colours": {kind: colour for page in pages for kind, colour in page.colours.items()},
        "ways": [[list(line.places_m), line.label, line.colour] for page in pages for line in page.lines],
        "marks": [[mark.north_m, mark.east_m, mark.label, mark.colour] for page in pages for mark in page.marks],
    }
