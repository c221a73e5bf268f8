"""Opens a run's page: beside one that goes on, in a process of its own (`page_process.py`), or of one that is over.

The launcher's process serves nothing itself, and waits for nothing while a run goes on.
"""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import IO

from rich.console import Console

from sitl_emu.run.trouble import Trouble
from sitl_emu.run.view.listening import listen, url_of

LAST_WORDS_S = 5.0
"""How long the page's process has to tell open pages how the run ended."""


@contextlib.contextmanager
def page_of(folder: Path, console: Console) -> Iterator[None]:
    """Show a run's folder while the body makes the run; on a terminal, until Ctrl-C. Raises Trouble."""
    try:
        listening = listen()
    except OSError as error:
        raise Trouble(f"--view: can't serve a page on this machine: {error.strerror}") from None
    with listening, tempfile.TemporaryFile() as complaints:
        url = url_of(listening)
        process = _started(folder, listening, complaints)
        listening.close()
        console.print(f"page: {url}", markup=False, highlight=False, soft_wrap=True)
        if console.is_terminal:
            _open(url)
        try:
            yield
            if console.is_terminal and process.poll() is None:
                text = f"the page stays until Ctrl-C; later: sitl-emu view {folder}"
                console.print(text, markup=False, highlight=False, soft_wrap=True)
                with contextlib.suppress(KeyboardInterrupt):
                    process.wait()
        finally:
            _end(process)
        complaints.seek(0)
        if last := complaints.read().decode(errors="replace").strip().splitlines()[-1:]:
            console.print(f"sitl-emu: --view: the page failed: {last[0]}", markup=False, soft_wrap=True)


def show(folder: Path, port: int, say: Callable[[str], None]) -> None:
    """Serve the page of a run's folder until Ctrl-C or SIGTERM. Raises Trouble."""
    from sitl_emu.run.view.server import PageServer

    try:
        listening = listen(port)
    except OSError as error:
        raise Trouble(f"--port {port}: {error.strerror}; leave it out for a free one") from None
    server = PageServer(folder, listening)
    say(f"{folder}: {url_of(listening)} (until Ctrl-C)")
    if sys.stdout.isatty():
        _open(url_of(listening))

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
    finally:
        signal.signal(signal.SIGTERM, before)
        server.server_close()


def _started(folder: Path, listening: socket.socket, complaints: IO[bytes]) -> subprocess.Popen[bytes]:
    """The page's process; it ends when its standard input does, however this process ends."""
    fd = listening.fileno()
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "sitl_emu.run.view.page_process", str(folder), str(fd)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=complaints,
        pass_fds=[fd],
    )


def _end(process: subprocess.Popen[bytes]) -> None:
    """Let it tell open pages how the run ended."""
    assert process.stdin is not None
    process.stdin.close()
    try:
        process.wait(LAST_WORDS_S)
    except (subprocess.TimeoutExpired, KeyboardInterrupt):
        process.kill()
        process.wait()


def _open(url: str) -> None:
    """In the browser, where there is a desktop; else whoever runs this has the address."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(url)
