"""Serves a run's page on this machine: Python's own http.server, a thread for each that asks.

Few look on, and what they are told comes from files: more than the standard library is not needed for it. What is new
goes to the pages as server-sent events, which browsers take up again by themselves (`Last-Event-ID`). One thread reads
the run's folder; what it has made of it is kept as bytes, for every page that is opened later.

Hostile guests: only what is listed here is served, files only as `FRAME` has them and only if they lie in the run's
folder; only pages of this machine may ask (Host), and none may load anything from elsewhere (Content-Security-Policy).
"""

import json
import logging
import mimetypes
import re
import socket
import sys
import threading
import urllib.parse
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from sitl_emu.run.view.outcome import over
from sitl_emu.run.view.reading import RunReader
from sitl_emu.run.view.rows import Rows, facts
from sitl_emu.run.view.world import WorldShown

PAGE = Path(__file__).parent / "page"
PAGE_FILES = {"/": PAGE / "index.html"} | {f"/{file.name}": file for file in PAGE.iterdir()}
FRAME = re.compile(r"/(frames|feeds/[A-Za-z0-9_.-]+-camera)/[A-Za-z0-9_.-]+\.jpg")
PERIOD_S = 0.25
"""How often a run that goes on is looked at."""
KEEP_ALIVE_S = 10.0
HOSTS = ("127.0.0.1", "localhost")
OF_THE_PAGE = "default-src 'self'; img-src 'self' data:"
OF_THE_REPORT = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


class Batches:
    """What pages are told, in its order: written by one thread, read by one for each page."""

    def __init__(self) -> None:
        self._batches: list[bytes] = []
        self._changed = threading.Condition()
        self.over = False

    def add(self, rows: dict[str, Any], over: bool) -> None:
        """Tell all pages."""
        with self._changed:
            if rows:
                self._batches.append(_json(rows))
            self.over = over
            self._changed.notify_all()

    def after(self, count: int) -> list[bytes] | None:
        """Those after the first `count`; waits for one, but not for ever. None: no more will come."""
        with self._changed:
            if count >= len(self._batches) and not self.over:
                self._changed.wait(KEEP_ALIVE_S)
            return None if self.over and count >= len(self._batches) else self._batches[count:]


class PageServer(ThreadingHTTPServer):
    """The page of one run."""

    daemon_threads = True

    def __init__(self, folder: Path, listening: socket.socket) -> None:
        """`listening`: bound to this machine, and listening. Raises Trouble where it is no run's folder."""
        super().__init__(listening.getsockname(), PageHandler, bind_and_activate=False)
        self.socket.close()
        self.socket = listening
        self.server_name, self.server_port = listening.getsockname()[:2]
        self.folder = folder
        self._reader = RunReader(folder)
        self._rows = Rows(self._reader)
        self.facts = facts(self._reader)
        self.world = WorldShown(folder)
        self.batches = Batches()
        self._closing = threading.Event()
        self._feeder = threading.Thread(target=self._feed, daemon=True)
        self._feeder.start()

    def finish(self) -> None:
        """Read what is left, and make an end; pages that are open are still told."""
        self._closing.set()
        self._feeder.join()
        self.shutdown()

    def _feed(self) -> None:
        try:
            self._tell()
        except Exception as error:  # a page would wait for ever
            what = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"sitl-emu: {self.folder}: can't be read on, the page ends here: {what}", file=sys.stderr, flush=True)
            self.batches.add({}, True)

    def _tell(self) -> None:
        while True:
            last = self._closing.is_set()
            reading = self._reader.read()
            rows = self._rows.of(reading)
            if reading.summary is not None:
                rows["over"] = over(self._reader.scenario, reading.summary)
            self.batches.add(rows, last or reading.summary is not None)
            if self.batches.over:
                return
            self._closing.wait(PERIOD_S)


class PageHandler(BaseHTTPRequestHandler):
    """One request."""

    server: PageServer
    server_version = "sitl-emu"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer it."""
        if self.headers.get("Host", "").rsplit(":", 1)[0] not in HOSTS:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        url = urllib.parse.urlsplit(self.path)
        answers: dict[str, Callable[[], None]] = {
            "/run.json": lambda: self._send_json(self.server.facts),
            "/stream": self._stream,
            "/world.json": lambda: self._send_json(self.server.world.truth(_time_s(url.query))),
            "/map.jpg": self._map,
            "/report.html": lambda: self._file(self.server.folder / "report.html", OF_THE_REPORT),
        }
        try:
            if url.path in PAGE_FILES:
                self._file(PAGE_FILES[url.path])
            elif url.path in answers:
                answers[url.path]()
            elif FRAME.fullmatch(url.path):
                self._frame(url.path)
            else:
                self.send_error(HTTPStatus.NOT_FOUND)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True

    def log_message(self, format: str, *arguments: Any) -> None:
        """Nothing of this is worth a line on somebody's terminal."""
        logging.getLogger(__name__).debug(format, *arguments)

    def _frame(self, path: str) -> None:
        found = (self.server.folder / path[1:]).resolve()
        if found.is_relative_to(self.server.folder.resolve()):
            self._file(found)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _file(self, path: Path, policy: str = OF_THE_PAGE) -> None:
        try:
            data = path.read_bytes()
        except OSError:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
        self._send(data, f"{kind}; charset=utf-8" if kind.startswith("text/") else kind, policy)

    def _map(self) -> None:
        picture = self.server.world.picture()
        if picture is None:
            self.send_error(HTTPStatus.NOT_FOUND)
        else:
            self._send(picture, "image/jpeg")

    def _send_json(self, value: object) -> None:
        self._send(_json(value), "application/json")

    def _send(self, data: bytes, kind: str, policy: str = OF_THE_PAGE) -> None:
        self._head(kind, policy)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def _head(self, kind: str, policy: str = OF_THE_PAGE) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Security-Policy", policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cache-Control", "no-cache")

    def _stream(self) -> None:
        """Server-sent events, each with its number, after the one that the page had last."""
        told = self.headers.get("Last-Event-ID", "")
        count = int(told) if told.isdecimal() and len(told) < 10 else 0
        self._head("text/event-stream")
        self.end_headers()
        while (batches := self.server.batches.after(count)) is not None:
            for batch in batches:
                count += 1
                self.wfile.write(b"id: %d\ndata: %s\n\n" % (count, batch))
            if not batches:
                self.wfile.write(b": still there\n\n")
            self.wfile.flush()
        self.wfile.write(b"event: end\ndata: {}\n\n")


def _time_s(query: str) -> float:
    """The time asked for; 0 where it is none."""
    try:
        time_s = float(urllib.parse.parse_qs(query).get("t", ["0"])[0])
    except ValueError:
        return 0.0
    return time_s if 0.0 <= time_s < 1e9 else 0.0


def _json(value: object) -> bytes:
    """Without what JSON has no word for: a number that is none is null."""
    return json.dumps(_finite(value), allow_nan=False, separators=(",", ":")).encode()


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return value
