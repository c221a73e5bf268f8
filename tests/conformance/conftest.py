"""An autopilot to measure: any on a MAVLink URL, or an emulator of our own, started for these tests.

    SITL_EMU_CONFORMANCE_URL=udpout:127.0.0.1:18570 pytest tests/conformance

measures what listens there (a real PX4 SITL, too), as `sitl-emu conformance URL` does. Nothing of the product is
imported: numbers are PX4's, as literals. README.md says how a test tells what it covers.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from functools import partial
from pathlib import Path

import pytest
from pymavlink import mavutil

from . import put_aside
from .station import (
    HEARD_LIMIT_S,
    LOST,
    MISSION,
    READY_LIMIT_S,
    SETTLE_LIMIT_S,
    Station,
)

URL_VARIABLE, FORCE_VARIABLE = "SITL_EMU_CONFORMANCE_URL", "SITL_EMU_CONFORMANCE_FORCE"
"""What `sitl-emu conformance` is given, its --force as 1."""
INSTANCE = 60
"""Other tests run beside these: every folder has its own instances."""
UNREACHABLE = 2
"""Exit status of a run that found no autopilot to measure."""
STATION = pytest.StashKey[Station]()
MARKERS = (
    'covers(*names, source): messages ("PARAM_SET") and commands ("MAV_CMD_DO_SET_HOME") that a test is about, '
    "and where its expectation comes from",
    'vehicle(*types): the expectation holds for these only, as in "MAV_TYPE_HEXAROTOR"; elsewhere the test is skipped',
    "airframe(*numbers): numbers of PX4's airframes with these SYS_AUTOSTART alone; elsewhere the test is skipped",
)


def pytest_configure(config: pytest.Config) -> None:
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)


def tell(config: pytest.Config, text: str) -> None:
    """Say a line to whoever runs the tests, past what pytest keeps of their output."""
    with config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        sys.stderr.write(f"sitl-emu: {text}\n")
        sys.stderr.flush()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Where a test has failed and no heartbeat is heard any more, the others would fail as well: the run ends."""
    failed = item.session.testsfailed
    done = yield
    station = item.config.stash.get(STATION, None)
    if station is not None and item.session.testsfailed > failed and station.loses():
        pytest.exit(f"{LOST} after test {item.path.stem}::{item.name}", returncode=UNREACHABLE)
    return done


@pytest.hookimpl(wrapper=True)
def pytest_sessionfinish(session: pytest.Session) -> Generator[None, object, object]:
    """What can't be cleaned up where a run ends early is told in a line."""
    try:
        return (yield)
    except Exception as error:
        station = session.config.stash.get(STATION, None)
        if isinstance(error, pytest.exit.Exception) or station is None:
            raise
        if not station.is_lost:
            tell(session.config, f"the vehicle may not be as it was found: {error}")
        return None


@pytest.fixture(scope="session")
def url() -> Iterator[str]:
    """Where to find the autopilot; without a URL, one of ours is started for the tests."""
    given = os.environ.get(URL_VARIABLE)
    if given:
        yield given
        return
    command = [sys.executable, "-P", "-m", "sitl_emu", "launch", "sihsim_hex", "--instance", str(INSTANCE)]
    with tempfile.TemporaryDirectory(prefix="sitl_emu-") as state:
        process = subprocess.Popen([*command, "--state", state], stdout=subprocess.DEVNULL)
        try:
            yield f"udpout:127.0.0.1:{18570 + INSTANCE}"
        finally:
            process.terminate()
            process.wait(10.0)


@pytest.fixture(scope="session")
def station(request: pytest.FixtureRequest, url: str) -> Iterator[Station]:
    """A station whose autopilot is ready, in Hold. Without one the run ends, with exit status 2."""
    try:
        found = Station(url)
    except Exception as error:  # pymavlink raises whatever its kinds of link raise
        pytest.exit(f"{url}: {error}", returncode=UNREACHABLE)
    request.config.stash[STATION] = found
    with contextlib.closing(found.link), mode_kept(found, partial(tell, request.config)):
        try:
            found.wait_until_ready(HEARD_LIMIT_S if os.environ.get(URL_VARIABLE) else READY_LIMIT_S)
        except Exception as error:
            pytest.exit(f"{url}: {error}", returncode=UNREACHABLE)
        say_whom(found, url, partial(tell, request.config))
        yield found


def say_whom(station: Station, url: str, say: Callable[[str], None]) -> None:
    """Name what else is heard, and a stranger, with whom the run ends unless it is forced."""
    if station.others:
        say(
            f"{url}: of several autopilots system {station.system} is measured, as it was heard first; also heard: "
            f"{', '.join(map(str, station.others))}; to measure another, give the URL of that vehicle alone, "
            "such as udpout:127.0.0.1:18570"
        )
    if station.stranger:
        warning = (
            f"{url}: this is {station.stranger}: verdicts are those of PX4 v1.18's behaviour, and what that denies may "
            "make this one fly or move"
        )
        if not os.environ.get(FORCE_VARIABLE):
            pytest.exit(f"{warning}; secure it and give --force to go on", returncode=UNREACHABLE)
        say(warning)


@contextlib.contextmanager
def mode_kept(station: Station, say: Callable[[str], None]) -> Iterator[None]:
    """Tests are run in Hold: at the end the vehicle goes back to the mode that it was found in."""
    try:
        yield
    finally:
        in_any_case(partial(_choose_again, station, say))


def _choose_again(station: Station, say: Callable[[str], None]) -> None:
    mode = None if station.is_lost else station.custom_mode
    if mode is not None and not station.chooses(mode):
        say(f"the vehicle does not go back to the mode that it was found in (custom_mode {mode})")


def in_any_case(give_back: Callable[[], None]) -> None:
    """Give back what a vehicle had, as the last thing of a run: Ctrl-C makes it begin once more, a second one ends it.

    pytest would forget what else the session has to clean up if the first one went on from here.
    """
    try:
        give_back()
    except KeyboardInterrupt:
        give_back()


@pytest.fixture(scope="session", autouse=True)
def plans_put_aside(request: pytest.FixtureRequest, station: Station) -> Iterator[None]:
    """Mission, fence and rally points of a vehicle that is not ours are away while tests of them are run, then back.

    Also after Ctrl-C or a failure. What can't be given back is in files, and so it is if this process is killed.
    """
    of_plans = any(item.path.parent.name == put_aside.KINDS[MISSION] for item in request.session.items)
    try:
        plans = put_aside.held(station) if of_plans and os.environ.get(URL_VARIABLE) else None
    except TimeoutError as error:
        pytest.exit(f"the vehicle's plans can't be put aside, and nothing was tested: {error}", returncode=UNREACHABLE)
    if not plans:
        yield
        return
    folder = plans.write()
    try:
        try:
            put_aside.take_away(station, plans)
        except TimeoutError as error:
            pytest.exit(f"the vehicle's plans can't be put aside: {error}", returncode=UNREACHABLE)
        yield
    finally:
        _give_back(request, station, plans, folder)


def _give_back(request: pytest.FixtureRequest, station: Station, plans: put_aside.Plans, folder: Path) -> None:
    def give() -> None:
        put_aside.give_back(station, plans)
        shutil.rmtree(folder, ignore_errors=True)

    try:
        in_any_case(give)
    except BaseException as error:  # a second Ctrl-C, too
        if folder.exists():
            why = str(error) or type(error).__name__
            tell(request.config, f"the vehicle's plans could not all be given back ({why}): they are in {folder}")
            request.session.testsfailed += 1
        if not isinstance(error, Exception):
            raise


@pytest.fixture(scope="module", autouse=True)
def left_as_found(request: pytest.FixtureRequest, station: Station) -> Iterator[None]:
    """A file of tests leaves mode, plans and the parameters that it sets as they were: it can be run alone, and again.

    Tests that fail may leave more behind: what can be put right here is, and the next file is none the worse for it.
    """
    station.set_first.clear()
    before, failed = station.state(), request.session.testsfailed
    yield
    before = before._replace(parameters=dict(station.set_first))
    end_s = time.monotonic() + SETTLE_LIMIT_S
    while (left := station.state()) != before and time.monotonic() < end_s:
        pass  # PX4 announces the old count for a moment after a plan was changed
    if left != before:
        station.disarm()
        station.chooses(before.custom_mode)
        if request.session.testsfailed > failed:
            left = station.state()
    assert left == before


@pytest.fixture(autouse=True)
def vehicle_fits(request: pytest.FixtureRequest, station: Station) -> None:
    """Skips what was measured on another kind of vehicle."""
    for marker in request.node.iter_markers("vehicle"):
        types = [getattr(mavutil.mavlink, name) for name in marker.args]
        if station.vehicle_type not in types:
            pytest.skip(f"holds for {', '.join(marker.args)}")
    for marker in request.node.iter_markers("airframe"):
        if station.airframe not in marker.args:
            pytest.skip(f"holds for PX4's airframe {', '.join(map(str, marker.args))}")
