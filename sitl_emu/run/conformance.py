"""`sitl-emu conformance`: tests/conformance, which the wheel carries, measures the autopilot on a MAVLink URL.

The tests know nothing of the emulator, and what they cover and why they say themselves (their README.md). Here pytest
runs them without its own output; a plugin keeps what came out and says it as it comes.
"""

import contextlib
import importlib.util
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import pytest

from sitl_emu.run.addresses import check_host, is_port
from sitl_emu.run.process import ending_signals
from sitl_emu.run.trouble import Trouble

CARRIED = Path(__file__).parents[1] / "conformance"
"""Where a wheel has the tests (setup.py); in a checkout they are in `tests/`."""
FOLDER = CARRIED if CARRIED.is_dir() else Path(__file__).parents[2] / "tests/conformance"
PREFIX = "test_"
URL_VARIABLE, FORCE_VARIABLE = "SITL_EMU_CONFORMANCE_URL", "SITL_EMU_CONFORMANCE_FORCE"
PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"
MARKS = {PASSED: ".", FAILED: "F", SKIPPED: "-"}
NAME_WIDTH = 24
MESSAGE_LINES = 3
ENDED_EARLY, INTERRUPTED = 2, 130
"""Exit status."""
NETWORK_LINKS = ("udpout", "udpin", "udp", "udpbcast", "tcp", "tcpin")
"""Kinds of link in pymavlink's URLs."""


class Covers(NamedTuple):
    """One mark of a test: messages and commands, and where the expectation comes from."""

    names: tuple[str, ...]
    source: str


class Result(NamedTuple):
    """What came out of one test."""

    service: str
    title: str
    """What the file is about: its first line."""
    test: str
    """Its name as a sentence, with its case in brackets."""
    covers: tuple[Covers, ...]
    outcome: str
    reason: str
    """Why it failed or was skipped."""
    duration_s: float

    @property
    def names(self) -> set[str]:
        """Messages and commands it is about."""
        return {name for mark in self.covers for name in mark.names}

    @property
    def sources(self) -> list[str]:
        """Where its expectation comes from, each once."""
        return list(dict.fromkeys(mark.source for mark in self.covers if mark.source))


class Conformance(NamedTuple):
    """A whole run of tests."""

    url: str
    vehicle: str
    """What was measured, in words of its own: version, kind, system id."""
    results: tuple[Result, ...]
    interrupted: bool = False
    """By Ctrl-C: these are the results until then."""
    left_changed: bool = False
    """What was put aside could not be given back, as was told when it happened."""
    trouble: str = ""
    """What ended it early: these are the results until then."""

    @property
    def status(self) -> int:
        """Exit status."""
        if self.trouble:
            return ENDED_EARLY
        return INTERRUPTED if self.interrupted else int(self.count(FAILED) > 0 or self.left_changed)

    def count(self, outcome: str) -> int:
        """How many tests ended so."""
        return sum(result.outcome == outcome for result in self.results)


def services() -> dict[str, Path]:
    """Those that there are tests for, sorted, each with its file of tests or its folder of such files."""
    files = {path.stem.removeprefix(PREFIX): path for path in FOLDER.glob(f"{PREFIX}*.py")}
    folders = {path.parent.name: path.parent for path in FOLDER.glob(f"*/{PREFIX}*.py")}
    return dict(sorted((files | folders).items()))


def measure(url: str, wanted: Iterable[str], say: Callable[[str], None], force: bool = False) -> Conformance:
    """Run the tests of these services (of all, if none is named) and say how it goes.

    `force`: also where what is heard is no PX4 v1.18, and may fly or move.
    `say` gets pieces of text without line ends of its own. Raises Trouble where there is nothing to measure.
    """
    known = services()
    chosen = list(dict.fromkeys(wanted)) or list(known)
    for service in chosen:
        if service not in known:
            raise Trouble(f"--service {service}: there is no such service; there are {', '.join(known)}")
    url = checked_url(url)
    keeper = Keeper(say)
    with keeper.interruptible(), _environment({URL_VARIABLE: url, FORCE_VARIABLE: "1" if force else ""}):
        status = pytest.main([*options(), *(str(known[service]) for service in chosen)], [keeper])
    keeper.end_line()
    if keeper.trouble and not keeper.results:
        raise Trouble(keeper.trouble)
    known_ends = (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)
    if status not in known_ends and not keeper.trouble:
        raise Trouble(f"the tests could not be run (pytest's exit status {int(status)})")
    failed = any(result.outcome == FAILED for result in keeper.results)
    return Conformance(
        url,
        keeper.vehicle,
        tuple(keeper.results),
        interrupted=status == pytest.ExitCode.INTERRUPTED and not keeper.trouble,
        left_changed=status == pytest.ExitCode.TESTS_FAILED and not failed,
        trouble=keeper.trouble,
    )


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """With these variables; then as it was."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def checked_url(url: str) -> str:
    """The URL as pymavlink writes it (MAVSDK puts slashes into it); raises Trouble for what is none."""
    address = url.replace("://", ":")
    kind, _, place = address.partition(":")
    host, _, port = place.rpartition(":")
    if kind in NETWORK_LINKS and host and is_port(port):
        check_host(host, url)
        return address
    device = address
    if address.startswith("/") and ":" in address and not Path(address).exists():  # it may have colons in its own name
        device, _, baud = address.rpartition(":")
        if not (baud.isascii() and baud.isdecimal() and int(baud)):
            raise Trouble(f"{address}: {baud!r}; allowed: a baud rate, as in /dev/ttyUSB0:57600")
    if device.startswith("/") and not Path(device).exists():
        raise Trouble(f"{device}: there is no such device; is it plugged in? `ls /dev/tty*` lists those there are")
    if not Path(device).is_char_device():
        raise Trouble(
            f"{url or 'an empty URL'}: not where an autopilot is; give udpout:127.0.0.1:18570, udpin:0.0.0.0:14550, "
            "tcp:HOST:PORT or a serial device, such as /dev/ttyACM0 or, with its baud rate, /dev/ttyUSB0:57600"
        )
    if importlib.util.find_spec("serial") is None:
        raise Trouble(f"{address}: a serial link needs pyserial: pip install pyserial")
    return address


def options() -> list[str]:
    """Nothing of the user's pytest takes part: no configuration, no plugins, no cache, no output.

    Modules are named from the root on: it is the folder above, as those of a package may import each other.
    """
    quiet = ["-p", "no:terminal", "-p", "no:cacheprovider", "--disable-plugin-autoload"]
    return [*quiet, "-c", os.devnull, f"--rootdir={FOLDER.parent}", f"--confcutdir={FOLDER}", "--import-mode=importlib"]


class Keeper:
    """A pytest plugin: keeps results, and says one line a service, a mark a test."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self.results: list[Result] = []
        self.vehicle = ""
        self.trouble = ""
        self._say = say
        self._items: dict[str, pytest.Item] = {}
        self._phases: list[pytest.TestReport] = []
        self._service = ""
        self._interrupted = False

    @contextlib.contextmanager
    def interruptible(self) -> Iterator[None]:
        """Let Ctrl-C, and whatever else ends a process, end the tests: the one that goes on cleans up."""

        def interrupt(_number: int, _frame: FrameType | None) -> None:
            self._interrupted = True
            raise KeyboardInterrupt

        before = {number: signal.signal(number, interrupt) for number in ending_signals()}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _stop_if_interrupted(self) -> None:
        """Again, as while a module is imported KeyboardInterrupt may be lost (in a callback, or a bare `except`)."""
        if self._interrupted:
            raise KeyboardInterrupt

    # What pytest calls

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """All tests are known."""
        self._stop_if_interrupted()
        self._items = {item.nodeid: item for item in session.items}

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A file can't be read: no conformance can be told."""
        if report.failed:
            self.trouble = f"{report.nodeid}: {report.longreprtext.splitlines()[-1]}"

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """The tests' own end: there is no autopilot. Ctrl-C comes here as well, and is no trouble."""
        if isinstance(excinfo.value, pytest.exit.Exception):
            self.trouble = str(excinfo.value)

    def pytest_internalerror(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """A mistake of a test's file, not of the autopilot."""
        self.trouble = f"{excinfo.typename}: {excinfo.value}"

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """A test begins."""
        self._stop_if_interrupted()
        if _service(self._items[nodeid]) != self._service:
            self.end_line()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Set-up, test or clean-up has ended; the last completes the result.

        Lines begin after the set-up: what the first one has to say of the vehicle stands above them.
        """
        self._phases.append(report)
        if report.when == "setup" and not self._service:
            self._service = _service(self._items[report.nodeid])
            self._say(f"{self._service:<{NAME_WIDTH}} ")
        if report.when != "teardown":
            return
        item, phases, self._phases = self._items[report.nodeid], self._phases, []
        bad = next((phase for phase in phases if phase.failed), None)
        skipped = next((phase for phase in phases if phase.skipped), None)
        outcome = FAILED if bad else SKIPPED if skipped else PASSED
        told = bad or skipped
        reason = _reason(told) if told else ""
        duration_s = sum(phase.duration for phase in phases)
        result = Result(
            _service(item), _title(item), _sentence(item), tuple(_covers(item)), outcome, reason, duration_s
        )
        self.results.append(result)
        self._say(MARKS[outcome])

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_teardown(self, item: Any) -> None:
        """The station knows by now whom it measures."""
        self.vehicle = self.vehicle or getattr(item.funcargs.get("station"), "vehicle", "")

    # What is said

    def end_line(self) -> None:
        """Ends a service's line with how many passed."""
        if not self._service:
            return
        of_service = [result for result in self.results if result.service == self._service]
        passed = sum(result.outcome == PASSED for result in of_service)
        self._say(f"  {passed} of {len(of_service)} passed\n" if of_service else "\n")
        self._service = ""


def summary(run: Conformance) -> Iterator[str]:
    """Lines for people: what failed and why, what was skipped, and the count."""
    if run.interrupted and not run.vehicle:
        yield f"interrupted before an autopilot was heard on {run.url}"
        return
    for result in run.results:
        if result.outcome == FAILED:
            yield f"failed: {result.service}: {result.test}"
            yield from (f"    {line}" for line in result.reason.splitlines()[:MESSAGE_LINES])
            yield from (f"    expected by {source}" for source in result.sources)
    for reason in sorted({result.reason for result in run.results if result.outcome == SKIPPED}):
        skipped = sum(result.outcome == SKIPPED and result.reason == reason for result in run.results)
        yield f"skipped: {skipped}: {reason}"
    if run.interrupted:
        yield f"interrupted after {len(run.results)} tests"
    seconds = sum(result.duration_s for result in run.results)
    yield f"{run.vehicle} on {run.url}: {run.count(PASSED)} of {len(run.results)} passed, " + (
        f"{run.count(FAILED)} failed, {run.count(SKIPPED)} skipped, in {seconds:.0f} s"
    )


def _service(item: pytest.Item) -> str:
    folder = item.path.parent.name
    return item.path.stem.removeprefix(PREFIX) if folder == FOLDER.name else folder


def _title(item: pytest.Item) -> str:
    told = getattr(getattr(item, "module", None), "__doc__", None) or ""
    return told.partition("\n")[0]


def _sentence(item: pytest.Item) -> str:
    name, bracket, case = item.name.removeprefix(PREFIX).partition("[")
    return name.replace("_", " ") + (f" [{case}" if bracket else "")


def _covers(item: pytest.Item) -> Iterator[Covers]:
    """From the test's own marks to the file's."""
    for marker in item.iter_markers("covers"):
        yield Covers(marker.args, marker.kwargs.get("source", ""))


def _reason(report: pytest.TestReport) -> str:
    """The exception's text, or why it was skipped."""
    told: Any = report.longrepr
    if isinstance(told, tuple):
        return str(told[2]).removeprefix("Skipped: ")
    crash = getattr(told, "reprcrash", None)
    return str(crash.message if crash else told)
