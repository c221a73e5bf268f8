"""`make evaluate`: a mission's scenario over seeds 1 to 10: a table of what it reaches, and of what falls short.

    python tools/evaluate.py SCENARIO [--seeds FIRST-LAST] [--out DIR]

Some rows are of all missions; more of them a mission brings itself (`Mission.evaluation`).

Exit status 1 where a row falls short. Besides the ten seeds it flies the first with 30 % loss each way, with the link
cut in flight, and once more at another speed, whose logs must be identical. One run at a time: the speed factor
counts. Takes about half an hour on two cores.
"""

import argparse
import filecmp
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import yaml
from pymavlink import mavutil

from sitl_emu.missions import registry
from sitl_emu.missions.mission import Row
from sitl_emu.run.campaign.arms import changed
from sitl_emu.run.scenario import find, load, read
from sitl_emu.run.score import WALL_CLOCK_KEYS

CUT_AT_S = 100.0
LOSS = 0.3
TRANSFER = ["MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK"]

Summary = dict[str, Any]


def variant(folder: Path, source: Path, name: str, key: str, value: object) -> Path:
    """A scenario with another value at a dotted key, as a file."""
    scenario = changed(read(source), [(key, value)], source)
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(scenario.model_dump(mode="json"), sort_keys=False))
    return path


def fly(folder: Path, scenario: str, seed: int, speed: str = "max") -> tuple[int, Summary]:
    """Run once; exit status and summary."""
    command = [sys.executable, "-P", "-m", "sitl_emu", "run", scenario]
    command += ["--seed", str(seed), "--speed", speed, "--out", str(folder)]
    started = time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    path = folder / "summary.json"
    if not path.is_file():
        sys.exit(f"{' '.join(command)}\n{done.stdout}\nleft no summary")
    summary: Summary = json.loads(path.read_text())
    print(
        "  ".join(
            [
                f"{folder.name:<12} {summary['outcome']}",
                *summary["lines"],
                f"x{summary['speed_factor']}  {time.monotonic() - started:.0f} s",
            ]
        ),
        flush=True,
    )
    return done.returncode, summary


def transferred(folder: Path) -> bool:
    """Whether a peer log shows a mission's way from its announcement to its acknowledgement."""
    for path in sorted(folder.glob("*-peer.tlog")):
        wanted = list(TRANSFER)
        log = mavutil.mavlink_connection(str(path))
        while wanted and (message := log.recv_match(type=TRANSFER)) is not None:
            if message.get_type() == wanted[0]:
                wanted.pop(0)
        if not wanted:
            return True
    return False


def same(one: Path, other: Path) -> list[str]:
    """Names of what differs between two runs' tlogs and summaries, wall-clock figures aside."""
    names = sorted(path.name for path in one.glob("*.tlog"))
    different = [name for name in names if not filecmp.cmp(one / name, other / name, shallow=False)]
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (one, other)]
    for summary in summaries:
        for key in WALL_CLOCK_KEYS:
            summary.pop(key)
    return different + (["summary.json"] if summaries[0] != summaries[1] else []) + ([] if names else ["no tlogs"])


def rows_of(summaries: dict[int, Summary]) -> list[Row]:
    """The rows of any mission that follow from the seeds."""
    all_of = list(summaries.values())
    slowest = min((summary["speed_factor"] or 0.0) for summary in all_of)
    dropped = sum(summary["frames_dropped"] or 0 for summary in all_of)
    good = sum(summary["outcome"] == "success" for summary in all_of)
    return [
        Row("missions that succeed, by the truth", f"{good} of {len(all_of)}", "all", good == len(all_of)),
        Row("speed, slowest mission", f"{slowest:.1f} x real time", "≥ 2 x", slowest >= 2.0),
        Row("frames dropped", str(dropped), "0", dropped == 0),
    ]


def main() -> int:
    """Fly, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario that a mission brings, or a file")
    parser.add_argument("--seeds", default="1-10", help="FIRST-LAST; default 1-10")
    parser.add_argument("--out", type=Path, default=None, help="folder for the runs; default runs/evaluate-TIME")
    given = parser.parse_args()
    first, _, last = given.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    folder: Path = given.out or Path("runs") / f"evaluate-{time.strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    summaries = {seed: fly(folder / f"seed-{seed}", given.scenario, seed)[1] for seed in seeds}
    scenario = load(find(given.scenario))
    programs = [vehicle.companion.mission or "" for vehicle in scenario.vehicles if vehicle.companion is not None]
    rows = rows_of(summaries)
    for mission in registry.missions_of(programs):
        rows += mission.evaluation(list(summaries.values())) if mission.evaluation is not None else []
    if len(programs) > 1:
        shown = all(transferred(folder / f"seed-{seed}") for seed in seeds)
        rows.append(Row("peer tlog shows the transfer", "yes" if shown else "no", "yes", shown))
        rows += special(folder, given.scenario, seeds[0])
    width = max(len(row.what) for row in rows)
    print(f"\n{'':<{width}}  {'reached':<26}  wanted")
    for row in rows:
        print(f"{row.what:<{width}}  {row.reached:<26}  {row.wanted:<12}  {'ok' if row.good else 'FALLS SHORT'}")
    print(f"\nruns: {folder}")
    return 0 if all(row.good for row in rows) else 1


def special(folder: Path, scenario: str, seed: int) -> list[Row]:
    """Loss, a cut link, and the same seed again at another speed."""
    lossy = str(variant(folder, find(scenario), "loss", "peer_radio.loss", LOSS))
    _, with_loss = fly(folder / "loss", lossy, seed)
    cut = str(variant(folder, find(scenario), "cut", "peer_radio.outages_s", [[CUT_AT_S, 1e6]]))
    status, with_cut = fly(folder / "cut", cut, seed)
    fly(folder / "again", scenario, seed, "3")
    different = same(folder / f"seed-{seed}", folder / "again")
    arrived = with_loss["outcome"] == "success" and transferred(folder / "loss")
    home = all(one["done"] for one in with_cut["companions"].values()) and not with_cut["armed_at_end"]
    told = with_cut["outcome"] != "success" and status != 0 and home
    return [
        Row("with 30 % loss each way", with_loss["outcome"], "success", arrived),
        Row("with the link cut", f"{with_cut['outcome']}, exit {status}", "says so, comes home", told),
        Row("same seed, two speeds", ", ".join(different) or "identical", "identical", not different),
    ]


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("stopped; what was flown is kept")
