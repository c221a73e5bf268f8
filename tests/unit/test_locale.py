"""Our files, and the user's YAML, are UTF-8 in a locale of another encoding too."""

import os
import subprocess
import sys
from pathlib import Path

SCENARIO = """
name: feld
description: über dem Feld
world: {kind: flat}
vehicles: [{name: uas, model: iris}]
"""
IN_THAT_LOCALE = """
import locale, sys
from pathlib import Path
from sitl_emu.missions.reporting import Page, Section, Table
from sitl_emu.run import report, score, worlds
from sitl_emu.run.launcher import Ending
from sitl_emu.run.scenario import load
assert locale.getpreferredencoding(False) == "ANSI_X3.4-1968"
folder = Path(sys.argv[1])
scenario = load(folder / "feld.yaml")
assert scenario.description[0] == chr(0xFC) and scenario.vehicles[0].model_data
summary = score.summary(folder, scenario.name, 1, Ending("success"))
report.write(folder, summary, {}, [Page([Section("what is not known", [Table(("a",), [(None,)])])])])
"""


def test_a_scenario_is_read_and_a_report_written_where_the_locale_is_ascii(tmp_path: Path) -> None:
    (tmp_path / "feld.yaml").write_text(SCENARIO, "utf-8")
    env = {**os.environ, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    subprocess.run([sys.executable, "-c", IN_THAT_LOCALE, str(tmp_path)], env=env, check=True, capture_output=True)
    assert "<td>–</td>" in (tmp_path / "report.html").read_text("utf-8")
