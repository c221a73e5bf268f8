"""What a mission of one's own is made of, beside its companions (`sitl_emu.companion`): what a package brings.

A package is a mission by an entry point of the group `sitl_emu.missions`, whose value is a `Mission`:

    [project.entry-points."sitl_emu.missions"]
    lookout = "lookout.mission:MISSION"

Once it is installed, `sitl-emu run` finds its scenarios by name, and scenario files and
`sitl_emu.missions.companion.main` its programs. `examples/own_mission` is a whole one. The rooms behind these names are
free to change; these names stay.
"""

from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Figures, Mission, Program, Row, Setting
from sitl_emu.missions.reporting import Line, Mark, Page, Plot, Section, Table
from sitl_emu.missions.scoring import EventLine, MissionScore, RunRecord, Track, TrueArea, TrueObject

__all__ = [
    "EventLine",
    "Figures",
    "Line",
    "Mark",
    "Mission",
    "MissionScore",
    "Options",
    "Page",
    "Plot",
    "Program",
    "Row",
    "RunRecord",
    "Section",
    "Setting",
    "Table",
    "Track",
    "TrueArea",
    "TrueObject",
]
