"""`sitl-emu conformance`: what it refuses, what its pages say, what its tests tell, what the wheel carries."""

import contextlib
import importlib.util
import os
import re
import runpy
import signal
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest
import setuptools
from typer.testing import CliRunner

from sitl_emu.cli import app
from sitl_emu.core import dialect
from sitl_emu.run import conformance, conformance_report
from sitl_emu.run.conformance import Conformance, Covers, Keeper, Result

from .measurements import is_known

ROOT = Path(__file__).parents[2]
SOURCE = re.compile(
    r"https://(mavlink\.io|docs\.px4\.io)/\S+|PX4 parameter [A-Z0-9_]+\b.*|PX4 src/\S+\.(cpp|hpp|py|yaml)(: .+)?|"
    r"measured (?P<ids>[^:]+): .+"
)
NAMES = {codec.msgname for codec in dialect.mavlink_map.values()} | {
    entry.name for entry in dialect.enums["MAV_CMD"].values()
}


def refused(*arguments: str) -> str:
    """What the command says as it refuses."""
    result = CliRunner().invoke(app, ["conformance", *arguments])
    assert result.exit_code == 2
    assert result.stderr.startswith("sitl-emu: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


def test_an_unknown_service_is_told_with_the_known_ones() -> None:
    text = refused("udpout:127.0.0.1:9", "--service", "parameters")
    assert "parameters" in text
    assert "parameter, ping" in text


@pytest.mark.parametrize(("file", "word"), [("page.pdf", ".html or .md"), ("nowhere/page.md", "no folder nowhere")])
def test_a_report_that_cannot_be_written_is_told_before_anything_is_measured(file: str, word: str) -> None:
    assert word in refused("udpout:127.0.0.1:9", "--report", file)


def test_a_report_in_a_file_that_cannot_be_written_is_told_too(tmp_path: Path) -> None:
    (tmp_path / "page.md").symlink_to(tmp_path / "nowhere" / "page.md")
    assert "can't be written (No such file or directory)" in refused(
        "udpout:127.0.0.1:9", "--report", str(tmp_path / "page.md")
    )


def test_a_report_that_can_be_written_is_not_begun_before_its_time(tmp_path: Path) -> None:
    conformance_report.check(tmp_path / "page.md")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "page.md").write_text("an earlier one")
    conformance_report.check(tmp_path / "page.md")
    assert (tmp_path / "page.md").read_text() == "an earlier one"


@pytest.mark.parametrize(
    "url",
    [
        "nonsense",
        "",
        "udp",
        "udpout:127.0.0.1:many",
        "udpout:127.0.0.1:²",
        "udpout:127.0.0.1:99999",
        "udpin::14550",
        "/etc/hosts",
    ],
)
def test_what_is_no_url_is_told_with_what_is(url: str) -> None:
    text = refused(url, "--service", "ping")
    assert f"{url or 'an empty URL'}: not where an autopilot is; give udpout:127.0.0.1:18570" in text


def test_a_url_as_mavsdk_writes_it_is_taken_too() -> None:
    assert conformance.checked_url("udpin://0.0.0.0:14550") == "udpin:0.0.0.0:14550"
    assert conformance.checked_url("/dev/null") == "/dev/null"


def test_a_serial_device_is_taken_with_its_baud_rate() -> None:
    assert conformance.checked_url("/dev/null:57600") == "/dev/null:57600"
    assert "/dev/null:fast: 'fast'; allowed: a baud rate" in refused("/dev/null:fast", "--service", "ping")
    assert "/dev/ttyNONE: there is no such device" in refused("/dev/ttyNONE:57600", "--service", "ping")


def test_a_serial_device_needs_pyserial(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "serial" else found(name))
    assert "/dev/null: a serial link needs pyserial: pip install pyserial" in refused("/dev/null", "--service", "ping")


def test_a_host_or_a_device_that_is_not_there_is_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    assert "/dev/ttyNONE: there is no such device" in refused("/dev/ttyNONE", "--service", "ping")
    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    text = refused("udpout:nosuch.invalid:14550", "--service", "ping")
    assert "udpout:nosuch.invalid:14550: there is no host 'nosuch.invalid'" in text


@pytest.mark.parametrize(("port", "station"), [(18570, 28570), (55535, 65535), (55536, 45536), (65535, 55535)])
def test_the_station_of_a_high_port_speaks_from_a_port_that_there_is(port: int, station: int) -> None:
    spec = importlib.util.spec_from_file_location("station", conformance.FOLDER / "station.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.station_port(port) == station


def test_who_stops_before_an_autopilot_was_heard_reads_just_that() -> None:
    run = Conformance("udpout:127.0.0.1:9", "", (), interrupted=True)
    assert list(conformance.summary(run)) == ["interrupted before an autopilot was heard on udpout:127.0.0.1:9"]


@pytest.mark.usefixtures("hears_hang_up")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_is_lost_while_a_module_is_imported_ends_the_tests_at_the_next(number: signal.Signals) -> None:
    keeper, before = Keeper(lambda _: None), signal.getsignal(number)
    with keeper.interruptible():
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)
        with pytest.raises(KeyboardInterrupt):
            keeper.pytest_runtest_logstart("the next")
    assert signal.getsignal(number) == before


def test_a_url_that_pymavlink_does_not_take_is_told_in_a_line() -> None:
    assert "udpout:nowhere" in refused("udpout:nowhere", "--service", "ping")


def test_the_tests_are_told_url_and_force_and_the_environment_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(conformance.URL_VARIABLE, "udp:mine")
    monkeypatch.delenv(conformance.FORCE_VARIABLE, raising=False)
    seen = list[dict[str, str]]()

    def main(*_: object) -> pytest.ExitCode:
        seen.append(dict(os.environ))
        return pytest.ExitCode.OK

    monkeypatch.setattr(pytest, "main", main)
    conformance.measure("udpout:127.0.0.1:9", ["ping"], lambda _: None, force=True)
    assert [seen[0][name] for name in (conformance.URL_VARIABLE, conformance.FORCE_VARIABLE)] == [
        "udpout:127.0.0.1:9",
        "1",
    ]
    assert os.environ[conformance.URL_VARIABLE] == "udp:mine"
    assert conformance.FORCE_VARIABLE not in os.environ


def run_of(*results: Result) -> Conformance:
    return Conformance("udpout:127.0.0.1:18570", "PX4 1.18.0, MAV_TYPE_HEXAROTOR, system 1", results)


def result(test: str, outcome: str, reason: str = "") -> Result:
    covers = (
        Covers(("PARAM_SET", "MAV_CMD_DO_SET_HOME"), "https://mavlink.io/en/"),
        Covers((), "measured a/b: a|b <2>"),
    )
    return Result("parameter", "Parameter protocol", test, covers, outcome, reason, 0.5)


@pytest.mark.parametrize("suffix", [".md", ".html"])
def test_the_page_tells_what_is_tested_what_failed_why_it_is_expected_and_what_is_not_tested(
    suffix: str, tmp_path: Path
) -> None:
    page = tmp_path / f"page{suffix}"
    run = run_of(result("set", "passed"), result("get", "failed", "assert 1 == 2\nand more"))
    conformance_report.check(page)
    conformance_report.write(page, run)
    text = page.read_text()
    for piece in ("PX4 1.18.0", "2 tests: 1 passed, 1 failed, 0 skipped", "assert 1 == 2", "https://mavlink.io/en/"):
        assert piece in text
    missing = text[text.index("Not tested") :]
    assert "PARAM_REQUEST_LIST" in missing and "PARAM_SET" not in missing and "MAV_CMD_DO_SET_MODE" in missing
    cell = r"measured a/b: a\|b &lt;2&gt;" if suffix == ".md" else "measured a/b: a|b &lt;2&gt;"
    assert cell in text


def test_the_summary_names_the_failed_test_its_reason_and_its_sources() -> None:
    run = run_of(
        result("set", "passed"), result("get", "failed", "assert 1 == 2"), result("up", "skipped", "for rovers")
    )
    lines = "\n".join(conformance.summary(run))
    assert "failed: parameter: get\n    assert 1 == 2\n    expected by https://mavlink.io/en/" in lines
    assert "skipped: 1: for rovers" in lines
    assert "1 of 3 passed, 1 failed, 1 skipped" in lines


def test_the_exit_status_tells_passed_failed_and_interrupted() -> None:
    passed = run_of(result("set", "passed"), result("up", "skipped"))
    failed = run_of(result("set", "passed"), result("get", "failed"))
    interrupted = passed._replace(interrupted=True)
    assert (passed.status, failed.status, interrupted.status) == (0, 1, 130)
    assert "interrupted after 2 tests" in "\n".join(conformance.summary(interrupted))
    assert (passed._replace(left_changed=True).status, failed._replace(trouble="lost").status) == (1, 2)


def test_what_there_is_to_test_comes_from_the_services_and_the_streams() -> None:
    known = conformance_report.to_test()
    assert known["ping"] == {"PING"}
    assert "ATTITUDE" in known["streams"]
    assert {"COMMAND_LONG", "MAV_CMD_DO_SET_MODE", "MAV_CMD_REQUEST_MESSAGE"} <= known["command"]
    assert set().union(*known.values()) <= NAMES


class Collected:
    """A pytest plugin that keeps what was found."""

    def __init__(self) -> None:
        self.items: list[pytest.Item] = []

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.items = session.items


@pytest.fixture(scope="module")
def items() -> list[pytest.Item]:
    """The conformance tests, not run."""
    found = Collected()
    pytest.main([*conformance.options(), "--collect-only", str(conformance.FOLDER)], [found])
    assert len(found.items) > 40
    return found.items


def test_every_conformance_test_tells_what_it_covers_by_names_that_there_are(items: list[pytest.Item]) -> None:
    for item in items:
        names = [name for marker in item.iter_markers("covers") for name in marker.args]
        assert names, f"{item.nodeid}: no covers(...)"
        assert set(names) <= NAMES, f"{item.nodeid}: unknown {sorted(set(names) - NAMES)}"


def test_every_conformance_test_tells_where_its_expectation_comes_from(items: list[pytest.Item]) -> None:
    for item in items:
        sources = [marker.kwargs.get("source", "") for marker in item.iter_markers("covers")]
        assert any(sources), f"{item.nodeid}: no source"
        for source in filter(None, sources):
            told = SOURCE.fullmatch(source)
            assert told, f"{item.nodeid}: {source}: see tests/conformance/README.md"
            unknown = [name for name in (told["ids"] or "").split(", ") if name and not is_known(name)]
            assert not unknown, f"{item.nodeid}: no such measurement: {unknown}"


def test_the_wheel_carries_the_conformance_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    told = dict[str, Any]()
    monkeypatch.setattr(setuptools, "setup", told.update)
    monkeypatch.chdir(ROOT)
    runpy.run_path("setup.py")
    assert told["package_dir"]["sitl_emu.conformance"] == "tests/conformance"
    assert {"sitl_emu.run", "sitl_emu.autopilot.modes", "sitl_emu.gcs"} <= {*told["packages"]}
    assert {"sitl_emu.conformance", "sitl_emu.conformance.mission"} <= {*told["packages"]}
    files = [path for path in conformance.FOLDER.rglob("*.*") if path.parent.name != "__pycache__"]
    others = [path.name for path in files if path.suffix not in (".py", ".md")]
    assert not others, "add it to package-data"


def test_a_checkout_needs_no_links() -> None:
    listed = subprocess.run(["git", "ls-files", "--stage"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("NOT TESTED: this is no git checkout")
    assert [line for line in listed.stdout.splitlines() if line.startswith("120000")] == []
