"""A campaign's folder, tables, flights, progress and report, without flying."""

import csv
import fcntl
import importlib.util
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from arro3.io import read_parquet
from matplotlib.figure import Figure
from typer.testing import CliRunner

from sitl_emu.cli import app
from sitl_emu.missions.mission import Mission, Row
from sitl_emu.missions.reporting import Plot, Table
from sitl_emu.run.campaign import dask_pool, flight, pools, report, store, tables
from sitl_emu.run.campaign.arms import Arm, arms_of, variation
from sitl_emu.run.campaign.flight import Job, Result
from sitl_emu.run.campaign.progress import Estimate, said_of
from sitl_emu.run.trouble import Trouble

SCENARIO = {"name": "two", "world": "flat", "vehicles": [{"name": "uas", "model": "iris"}]}


@pytest.fixture
def arms(tmp_path: Path) -> list[Arm]:
    path = tmp_path / "two.yaml"
    path.write_text(yaml.safe_dump(SCENARIO))
    return arms_of(path, [variation("wind.north_m_s=0,4,8")])


def result(arm: str, seed: int, outcome: str = "success", **figures: Any) -> Result:
    summary = {"scenario": "two", "seed": seed, "outcome": outcome, **figures, "wall_clock": {"run_s": 3.0}}
    return Result(arm, seed, summary, wall_s=4.0, host="here")


def test_a_campaigns_folder_is_found_again_by_what_it_flies(tmp_path: Path, arms: list[Arm]) -> None:
    identity = store.identity_of("two", 1, arms, {})
    assert identity.digest == store.identity_of("two", 1, arms, {}).digest
    assert identity.digest != store.identity_of("two", 2, arms, {}).digest
    assert identity.digest != store.identity_of("two", 1, arms[:2], {}).digest
    with store.opened(tmp_path / "c", identity, arms) as kept:
        kept.keep(result(arms[0].name, 1, rmse_m=0.5))
        assert kept.kept(arms[0].name, 1) == result(arms[0].name, 1, rmse_m=0.5)
        assert kept.kept(arms[0].name, 2) is None
        under_way = kept.run_folder(arms[0].name, 3).with_name(f"{flight.part_prefix('seed-3')}0a1b")
        under_way.mkdir(parents=True)
        whole = kept.run_folder(arms[0].name, 4)
        whole.mkdir()
    with store.opened(tmp_path / "c", identity, arms) as again:
        assert again.kept(arms[0].name, 1) is not None
        assert not under_way.exists() and whole.exists(), "what was under way is swept"
    assert [path.name for path in (tmp_path / "c/arms").iterdir()] != []


def test_another_campaigns_folder_a_strangers_and_one_in_use_are_refused(tmp_path: Path, arms: list[Arm]) -> None:
    identity, folder = store.identity_of("two", 1, arms, {}), tmp_path / "c"
    with store.opened(folder, identity, arms):
        pass
    with pytest.raises(Trouble, match=r"holds another campaign \(seed differ\); name a new one with --out"):
        store.opened(folder, identity._replace(seed=2), arms).__enter__()
    with (folder / store.LOCK).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(Trouble, match="another campaign is at work there"):
            store.opened(folder, identity, arms).__enter__()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("all of it")
    with pytest.raises(Trouble, match="is not empty and holds no campaign"):
        store.opened(tmp_path / "mine", identity, arms).__enter__()


def test_a_worker_that_can_not_make_the_campaigns_folder_flies_for_the_result_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = list[Job]()

    def fly(job: Job, stopping: flight.Stopping) -> Result:
        assert Path(job.folder).parent.is_dir()
        flown.append(job)
        return result(job.arm, job.seed)

    monkeypatch.setattr(flight, "fly", fly)
    there, nowhere = (Job("calm", 3, SCENARIO, f"{folder}/arms/seed-3") for folder in (tmp_path, "/dev/null"))
    for job in (there, nowhere):
        assert dask_pool.fly_where_it_can(job, lambda: False) == result("calm", 3)
    assert flown[0] == there
    assert flown[1].keep == "none" and not Path(flown[1].folder).parent.exists()


def test_a_result_that_can_not_be_written_is_told_and_leaves_no_half(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    store.write_whole(path, "whole")
    with pytest.raises(Trouble, match=r"can't write .*: .*the same command goes on"):
        store.write_whole(path / "below.json", "never")
    assert path.read_text() == "whole" and [one.name for one in tmp_path.iterdir()] == ["results.json"]


def test_tables_have_a_row_for_each_run_and_for_each_record_and_agree_as_csv_and_parquet(
    tmp_path: Path, arms: list[Arm]
) -> None:
    results = [
        result(
            arms[0].name, 1, rmse_m=0.5, radio={"a>b": {"lost": 3}}, targets=[{"kind": "é", "error_m": 1}], ways=[[1]]
        ),
        result(arms[1].name, 1, "lost, one", rmse_m=None, targets=[{"kind": "b", "error_m": 0.25}, {"kind": None}]),
    ]
    files = tables.write(tmp_path, results, {arm.name: arm for arm in arms})
    assert {path.name for path in files} == {"runs.csv", "runs.parquet", "targets.csv", "targets.parquet"}
    with (tmp_path / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["arm"], row["north_m_s"], row["seed"], row["outcome"], row["success"]) for row in rows] == [
        ("north_m_s=0", "0", "1", "success", "True"),
        ("north_m_s=4", "4", "1", "lost, one", "False"),
    ]
    assert [(row["rmse_m"], row["radio.a>b.lost"]) for row in rows] == [("0.5", "3"), ("", "")]
    assert not {"ways", "wall_clock", "lines"} & set(rows[0])
    for name in ("runs", "targets"):
        table = read_parquet(tmp_path / f"{name}.parquet").read_all()
        with (tmp_path / f"{name}.csv").open() as file:
            head, *lines = csv.reader(file)
        assert table.column_names == head
        columns = [["" if value is None else value for value in table[key].to_pylist()] for key in head]
        assert [
            [float(cell) if isinstance(cell, float) else str(cell) for cell in row]
            for row in zip(*columns, strict=True)
        ] == [
            [
                float(text) if isinstance(column[0], float) and text else text
                for text, column in zip(line, columns, strict=True)
            ]
            for line in lines
        ]
    assert (
        str(read_parquet(tmp_path / "targets.parquet").read_all().schema.field("error_m").type)
        .strip()
        .endswith("Float64>")
    )


def test_a_figure_of_the_same_name_leaves_what_varies_its_column(tmp_path: Path) -> None:
    """north_m_s is a figure too; time_limit_s as well, and is a whole key already; warmth is none."""
    path = tmp_path / "two.yaml"
    path.write_text(yaml.safe_dump(SCENARIO))
    varied = ("wind.north_m_s=0,4", "time_limit_s=60", "light.warmth=1.1")
    made = {arm.name: arm for arm in arms_of(path, [variation(each) for each in varied])}
    results = [result(name, seed, north_m_s=0.5 + seed, time_limit_s=7) for name in made for seed in (1, 2)]
    rows = tables.rows_of(results, made)
    assert [(row["wind.north_m_s"], row["north_m_s"]) for row in rows] == [(0, 1.5), (0, 2.5), (4, 1.5), (4, 2.5)]
    assert {(row["varied.time_limit_s"], row["time_limit_s"], row["warmth"]) for row in rows} == {(60, 7, 1.1)}
    sections = report.sections_of(report.Outcome("two", made, results, 4, [], []))
    (figures,) = (section for section in sections if section.title == "Figures")
    (table, *_) = figures.parts
    assert isinstance(table, Table) and {row[0] for row in table.rows} == {"north_m_s"}, "what varies is no figure"


def job_in(folder: Path, keep: flight.Keep = "all") -> Job:
    return Job("arm", 1, SCENARIO, str(folder / "seed-1"), keep=keep)


def processes(monkeypatch: pytest.MonkeyPatch, *scripts: str) -> None:
    """Lets runs be these programs, one after the other; FOLDER is where the run is to be."""
    left, started = list(scripts), subprocess.Popen
    head = "import json, os, pathlib, signal, sys\nFOLDER = pathlib.Path(json.loads(sys.stdin.readline())['folder'])\n"

    def start(_command: list[str], **options: Any) -> Any:
        return started([sys.executable, "-c", head + left.pop(0)], **options)

    monkeypatch.setattr(subprocess, "Popen", start)


FLOWN = "FOLDER.mkdir(); (FOLDER / 'summary.json').write_text('{\"outcome\": \"%s\"}'); sys.exit(%d)"


def test_a_killed_run_is_flown_again_and_counted_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    killed = "FOLDER.mkdir(); os.kill(os.getpid(), signal.SIGKILL)"
    processes(monkeypatch, killed, "print('camera was killed'); sys.exit(4)", FLOWN % ("success", 0))
    flown = flight.fly(job_in(tmp_path), lambda: False)
    assert flown.summary == {"outcome": "success"} and flown.tries == 3 and not flown.accident
    assert [path.name for path in tmp_path.iterdir()] == ["seed-1"]


def test_a_run_that_is_killed_again_and_again_is_an_accident_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes(monkeypatch, *["print('so far'); sys.stdout.flush(); os.kill(os.getpid(), signal.SIGKILL)"] * 3)
    flown = flight.fly(job_in(tmp_path), lambda: False)
    assert flown.summary is None and flown.accident == "the run's launcher: killed by SIGKILL: so far"
    assert list(tmp_path.iterdir()) == []


def test_a_mission_that_fails_is_a_result_and_what_a_user_can_put_right_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes(monkeypatch, FLOWN % ("one not found", 1), 'print("can\'t write x: No space left"); sys.exit(2)')
    assert flight.fly(job_in(tmp_path), lambda: False).summary == {"outcome": "one not found"}
    refused = flight.fly(job_in(tmp_path), lambda: False)
    assert refused.refused == "can't write x: No space left" and refused.tries == 1


@pytest.mark.parametrize(
    ("keep", "outcome", "status", "there"),
    [
        ("failed", "success", 0, False),
        ("failed", "lost", 1, True),
        ("none", "lost", 1, False),
        ("all", "success", 0, True),
    ],
)
def test_run_folders_are_kept_as_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keep: flight.Keep, outcome: str, status: int, there: bool
) -> None:
    processes(monkeypatch, FLOWN % (outcome, status))
    assert flight.fly(job_in(tmp_path, keep), lambda: False).summary == {"outcome": outcome}
    assert (tmp_path / "seed-1").exists() == there
    assert len(list(tmp_path.iterdir())) == there


def test_a_run_ends_when_it_is_to_stop_and_when_its_input_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes(monkeypatch, "FOLDER.mkdir(); sys.stdin.read(); sys.exit(0)")
    assert flight.fly(job_in(tmp_path), lambda: True).stopped
    assert list(tmp_path.iterdir()) == []


def test_how_long_the_rest_takes_follows_from_what_runs_took() -> None:
    estimate = Estimate(2)
    assert estimate.left_s(5) is None and said_of(None) == ""
    estimate.add(20.0)
    estimate.add(40.0)
    assert estimate.left_s(6) == 90.0 and estimate.left_s(1) == 30.0
    assert [said_of(seconds) for seconds in (40.0, 600.0, 7200.0)] == [
        "about 40 s left",
        "about 10 min left",
        "about 2.0 h left",
    ]


def test_the_report_has_shares_figures_pairs_what_is_wanted_and_every_run(tmp_path: Path, arms: list[Arm]) -> None:
    results = [
        result(arm.name, seed, "success" if seed + place < 8 else "one <not> found", rmse_m=0.1 * seed + place)
        for place, arm in enumerate(arms)
        for seed in range(1, 8)
    ]
    mission = Mission({}, evaluation=lambda summaries: [Row("rmse", f"{len(summaries)} runs", "≤ 1 m", False)])
    broken = Mission({}, evaluation=lambda summaries: [Row("x", str(summaries[0]["nothing"]), "", True)])
    outcome = report.Outcome("two", {arm.name: arm for arm in arms}, results, 24, ["x: killed"], [mission, broken])
    sections = {section.title: section for section in report.sections_of(outcome)}
    assert list(sections) == [
        "Success",
        "What is wanted, and reached",
        "Figures",
        "Beside “north_m_s=0”, seed by seed",
    ]
    success = sections["Success"].parts[0]
    assert isinstance(success, Table) and success.rows[0][:3] == ("north_m_s=0", "7 of 7", "100 %")
    assert success.rows[2][1] == "5 of 7"
    assert len(sections["Success"].parts) == 3, "a table, a plot of the arms, and one over the three winds"
    pairs = sections["Beside “north_m_s=0”, seed by seed"].parts[0]
    assert isinstance(pairs, Table) and ("rmse_m", "north_m_s=8", 7, "+2", None, "") in pairs.rows
    identity = store.identity_of("two", 1, arms, {})
    with store.opened(tmp_path / "c", identity, arms) as kept:
        page = report.write(kept, outcome, report.sections_of(outcome)).read_text()
    assert "7 runs ✗" in page and "its evaluation failed" in page and "KeyError" in page
    assert "21 of 24 runs" in page and "x: killed" in page and "one &lt;not&gt; found" in page
    assert page.count("data:image/png") == 2 + 1 and "seed 7" in page


def test_a_long_name_of_an_arm_leaves_room_for_its_plot(tmp_path: Path) -> None:
    vary = ["world=flat,urban_flood", "time_limit_s=600", "vehicles.uas.sensors.gps=m8n", "wind.north_m_s=12"]
    path = tmp_path / "two.yaml"
    path.write_text(yaml.safe_dump(SCENARIO))
    made = {arm.name: arm for arm in arms_of(path, [variation(text) for text in vary])}
    outcome = report.Outcome("two", made, [result(name, 1) for name in made], 2, [], [])
    (plot,) = (part for part in report.sections_of(outcome)[0].parts if isinstance(part, Plot))
    figure = Figure(figsize=(9.0, plot.height_in), layout="constrained")
    axes = figure.subplots()
    plot.draw(axes)
    written = [label.get_text() for label in axes.get_yticklabels()]
    assert [text.replace("\n", " ") for text in written] == list(made)
    assert max(len(line) for text in written for line in text.split("\n")) <= report.NAME_WIDTH
    figure.draw_without_rendering()
    assert axes.get_position().width > 0.6


def test_a_campaign_of_nothing_has_a_report_too(tmp_path: Path, arms: list[Arm]) -> None:
    outcome = report.Outcome("two", {arm.name: arm for arm in arms}, [], 3, ["all killed"], [])
    with store.opened(tmp_path / "c", store.identity_of("two", 1, arms, {}), arms) as kept:
        assert "0 of 3 runs" in report.write(kept, outcome, report.sections_of(outcome)).read_text()


def test_this_machine_flies_a_run_for_two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    for cores, wanted in ((1, 1), (2, 1), (8, 4)):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _pid, cores=cores: set(range(cores)))
        assert pools.default_workers() == wanted


def refused(*words: str) -> str:
    done = CliRunner().invoke(app, ["campaign", *words])
    assert done.exit_code == 2, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (("agricultur", "--runs", "2"), "there is no scenario 'agricultur'; missions bring: agriculture"),
        (("agriculture", "--runs", "0"), "--runs"),
        (
            ("agriculture", "--runs", "2", "--seed", "9007199254740992"),
            "--runs 2 from seed 9007199254740992 on: the largest is 9007199254740992; take a smaller --seed",
        ),
        (("agriculture",), "Missing option '--runs'"),
        (("agriculture", "--runs", "2", "--keep", "some"), "--keep some: give all, failed or none"),
        (("agriculture", "--runs", "2", "--dask", "tcp://x", "--workers", "2"), "give one of them"),
        (("agriculture", "--runs", "2", "--dask", "ftp://x:1"), "--dask ftp://x:1: give tcp://HOST:PORT or tls://"),
        (("agriculture", "--runs", "2", "--dask", "tcp://x:y"), "--dask tcp://x:y: give tcp://HOST:PORT or tls://"),
        (("agriculture", "--runs", "2", "--dask", "tcp://x:²"), "--dask tcp://x:²: give tcp://HOST:PORT or tls://"),
        (
            ("agriculture", "--runs", "2", "--vary", "vehicles.uas.modle=iris"),
            "modle: unknown field; allowed here: name",
        ),
        (
            ("agriculture", "--runs", "2", "--vary", "vehicles.uas.companion.options.speed=3,4"),
            "(speed=3): vehicles.0.companion: mission agriculture-scout: option speed: unknown",
        ),
        (
            ("agriculture", "--runs", "2", "--vary", "vehicles.uas.sensors.gps.noise_horizontal=3"),
            "(noise_horizontal=3): vehicles.0.sensors: gps: unknown field 'noise_horizontal'",
        ),
        (("agriculture", "--runs", "2", "--vary", "world.options.size_m=[80"), "the values are no YAML"),
    ],
)
def test_wrong_input_is_one_line_before_anything_is_flown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], wanted: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert wanted in refused(*words)
    assert list(tmp_path.iterdir()) == []


def test_what_makes_tables_is_asked_for_before_hours_of_flying(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "scipy" else found(name))
    wanted = "campaign: its intervals need scipy: pip install 'sitl-emu[campaign]'"
    assert wanted in refused("agriculture", "--runs", "2")


def test_runs_with_commands_take_px4s_ports_and_go_one_at_a_time(tmp_path: Path) -> None:
    vehicle = {"name": "uas", "model": "iris", "companion": {"command": ["true"]}}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(SCENARIO | {"vehicles": [vehicle]}))
    text = refused(str(tmp_path / "own.yaml"), "--runs", "2", "--workers", "2")
    assert "uas has a command as its autopilot or companion" in text and "leave out --dask and --workers" in text


def test_results_are_json_that_reads_back() -> None:
    one = result("a", 3, targets=[{"kind": "x"}])
    assert Result(**json.loads(json.dumps(one._asdict()))) == one
    assert signal.SIGKILL.name in flight._how(-9, "")
