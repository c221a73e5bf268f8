"""The coverage page of a conformance run: service × message × command, tested or not, passed or failed, and why.

What there is to test is what our autopilot receives, streams and answers: the same list whatever was measured.
"""

import html
import importlib
import pkgutil
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from sitl_emu.run.conformance import FAILED, PASSED, SKIPPED, Conformance, Result
from sitl_emu.run.trouble import Trouble

COMMAND_PREFIX = "MAV_CMD_"
NOT_TESTED = "not tested"
REFERENCE = "sihsim_hex"
"""The vehicle whose autopilot says which commands there are."""
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: .6rem 0 1.6rem; width: 100%; }
td, th { padding: .25rem .8rem; text-align: left; vertical-align: top; overflow-wrap: anywhere; }
tr { border-bottom: 1px solid #ddd; } th { background: #f3f3f3; } h2 { margin-top: 2.2rem; }
a { color: inherit; } td:nth-child(2), th:nth-child(2) { min-width: 6rem; }
.passed { color: #1b5e20; } .failed { color: #b71c1c; font-weight: 600; } .skipped, .untested { color: #777; }
"""


class Table(NamedTuple):
    """Rows of plain text; the second column is an outcome."""

    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


Part = str | Table
"""A paragraph (a heading if it begins with #), or a table."""


def check(path: Path) -> None:
    """Raises Trouble if a report can't be written there; before anything is measured."""
    if path.suffix not in WRITERS:
        raise Trouble(f"--report {path}: give a file that ends with {' or '.join(WRITERS)}")
    if not path.parent.is_dir():
        raise Trouble(f"--report {path}: there is no folder {path.parent}")
    if path.is_dir():
        raise Trouble(f"--report {path}: that is a folder; give a file")
    was_there = path.exists()
    try:
        path.open("a").close()
    except OSError as error:
        raise Trouble(f"--report {path}: can't be written ({error.strerror}); give another file") from error
    if not was_there:
        path.unlink()


def write(path: Path, run: Conformance) -> None:
    """Write the page, in the form that the file's suffix says; raises Trouble if it can't be written."""
    try:
        path.write_text(WRITERS[path.suffix](list(page(run))), "utf-8")
    except OSError as error:
        raise Trouble(f"--report {path}: {error.strerror}") from error


def page(run: Conformance) -> Iterator[Part]:
    """All of it, in order."""
    known = to_test()
    everything = set().union(*known.values())
    commands = {name for name in everything if name.startswith(COMMAND_PREFIX)}
    messages = everything - commands
    tested = {name for result in run.results for name in result.names}
    yield "# Conformance to PX4 v1.18"
    yield f"Measured: {run.vehicle}, on {run.url}."
    yield (
        f"{len(run.results)} tests: {run.count(PASSED)} passed, {run.count(FAILED)} failed, "
        f"{run.count(SKIPPED)} skipped. They are about {_count(tested & commands, commands)} commands and "
        f"{_count(tested & messages, messages)} messages that the emulator answers, takes or sends. A message or "
        "command has passed when all tests about it have; that does not say that each of its fields was looked at."
    )
    failed = [result for result in run.results if result.outcome == FAILED]
    if failed:
        yield "## What failed"
        yield Table(
            ("test", "result", "what came instead", "expected by"),
            [(f"{result.service}: {result.test}", FAILED, result.reason, _lines(result.sources)) for result in failed],
        )
    yield "## Services"
    yield Table(("service", "result", "tests", "messages and commands tested"), list(_overview(run, known)))
    for service in dict.fromkeys(result.service for result in run.results):
        yield from _of_service(service, run, known)
    yield "## Not tested"
    missing = sorted(everything - tested)
    for what, names in (
        ("Commands", [name for name in missing if name.startswith(COMMAND_PREFIX)]),
        ("Messages", [name for name in missing if not name.startswith(COMMAND_PREFIX)]),
    ):
        yield f"{what} ({len(names)}): {', '.join(names)}." if names else f"{what}: none."


def to_test() -> dict[str, frozenset[str]]:
    """By service: the messages that it receives, or commands that it answers; `streams` is what is streamed."""
    from sitl_emu.autopilot.mavlink import services, streams
    from sitl_emu.core import dialect

    found = {"streams": frozenset(streams.modules())}
    for info in pkgutil.iter_modules(services.__path__):
        module = importlib.import_module(f"{services.__name__}.{info.name}")
        numbers: set[int] = set()
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__:
                numbers |= getattr(value, "MESSAGES", frozenset())
        if numbers:
            found[info.name] = frozenset(dialect.mavlink_map[number].msgname for number in numbers)
    named = dialect.enums["MAV_CMD"]
    found["command"] |= {named[number].name for number in _commands() if number in named}
    return found


def _commands() -> set[int]:
    from sitl_emu import vehicles
    from sitl_emu.autopilot.autopilot import Autopilot
    from sitl_emu.autopilot.mavlink.services import message_interval, message_request

    autopilot = Autopilot(vehicles.load(REFERENCE).airframe, 0)
    of_links = message_interval.MessageInterval.COMMANDS | message_request.MessageRequest.COMMANDS
    return set(autopilot.commander.COMMANDS) | of_links


def _overview(run: Conformance, known: dict[str, frozenset[str]]) -> Iterator[tuple[str, ...]]:
    tested = {name for result in run.results for name in result.names}
    ran = {result.service for result in run.results}
    for service in sorted(ran | set(known)):
        results = [result for result in run.results if result.service == service]
        names = known.get(service, frozenset())
        tests = f"{sum(result.outcome == PASSED for result in results)} of {len(results)}" if results else ""
        yield service, _outcome(results), tests, _count(names & tested, names) if names else ""


def _of_service(service: str, run: Conformance, known: dict[str, frozenset[str]]) -> Iterator[Part]:
    results = [result for result in run.results if result.service == service]
    yield f"## {service}"
    yield from dict.fromkeys(result.title for result in results)
    named = set().union(*(result.names for result in results))
    received = {name for name in known.get(service, frozenset()) if not name.startswith(COMMAND_PREFIX)}
    rows = list[tuple[str, ...]]()
    for name in sorted(named | received, key=lambda name: (name.startswith(COMMAND_PREFIX), name)):
        about = [result for result in run.results if name in result.names]
        rows.append((name, _outcome(about), str(len(about) or "")))
    yield Table(("message or command", "result", "tests"), rows)
    by_test: dict[str, list[Result]] = {}
    for result in results:
        by_test.setdefault(result.test.partition(" [")[0], []).append(result)
    yield Table(("test", "result", "about", "expected by"), [_of_test(*one) for one in by_test.items()])


def _of_test(test: str, cases: list[Result]) -> tuple[str, ...]:
    outcome = _outcome(cases)
    skipped = "; ".join(sorted({case.reason for case in cases})) if outcome == SKIPPED else ""
    return (
        f"{test} ({len(cases)} cases)" if len(cases) > 1 else test,
        f"{outcome}: {skipped}" if skipped else outcome,
        ", ".join(sorted(set().union(*(case.names for case in cases)))),
        _lines(dict.fromkeys(source for case in cases for source in case.sources)),
    )


def _outcome(results: Iterable[Result]) -> str:
    outcomes = {result.outcome for result in results}
    return next((outcome for outcome in (FAILED, PASSED, SKIPPED) if outcome in outcomes), NOT_TESTED)


def _count(some: Iterable[str], of_all: Iterable[str]) -> str:
    return f"{len(set(some))} of {len(set(of_all))}"


def _lines(texts: Iterable[str]) -> str:
    return "\n".join(texts) or "no source stated"


# --- two forms of the page ---------------------------------------------------------------------------------


def _markdown(parts: Iterable[Part]) -> str:
    return "\n\n".join(_markdown_table(part) if isinstance(part, Table) else part for part in parts) + "\n"


def _markdown_table(table: Table) -> str:
    lines = [table.head, ("---",) * len(table.head), *table.rows]
    return "\n".join("| " + " | ".join(_markdown_cell(cell) for cell in line) + " |" for line in lines)


def _markdown_cell(text: str) -> str:
    return html.escape(text, quote=False).replace("|", "\\|").replace("\n", "<br>")


def _html(parts: Iterable[Part]) -> str:
    body = "\n".join(_html_table(part) if isinstance(part, Table) else _html_paragraph(part) for part in parts)
    head = "<!doctype html><html lang=en><meta charset=utf-8><title>Conformance to PX4 v1.18</title>"
    return f"{head}<style>{STYLE}</style><body>\n{body}\n</body></html>\n"


def _html_paragraph(text: str) -> str:
    words = text.lstrip("#")
    level = len(text) - len(words)
    return f"<h{level}>{html.escape(words.strip())}</h{level}>" if level else f"<p>{html.escape(text)}</p>"


def _html_table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(cell)}" for cell in table.head)
    rows = "".join("<tr>" + "".join(_html_cell(cell, at) for at, cell in enumerate(row)) + "\n" for row in table.rows)
    return f"<table><tr>{head}\n{rows}</table>"


def _html_cell(text: str, column: int) -> str:
    """The second column is an outcome, shown in its colour; addresses become links."""
    lines = [
        f'<a href="{html.escape(line)}">{html.escape(line)}</a>' if line.startswith("https://") else html.escape(line)
        for line in text.split("\n")
    ]
    outcome = text.partition(":")[0]
    kind = "untested" if outcome == NOT_TESTED else outcome if outcome in (PASSED, FAILED, SKIPPED) else ""
    return f"<td{f' class={kind}' if column == 1 and kind else ''}>" + "<br>".join(lines)


WRITERS: dict[str, Callable[[list[Part]], str]] = {".html": _html, ".md": _markdown}
"""By suffix."""
