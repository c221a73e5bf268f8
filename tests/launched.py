"""Start `sitl-emu launch` as a user would, with a state folder of its own, and end it whatever happens."""

import contextlib
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator

STOP_LIMIT_S = 10.0


def ignore_ctrl_c() -> None:
    """What a shell does in a process that a script starts with `&`, before the command is there."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextlib.contextmanager
def launched(*arguments: str, in_background: bool = False) -> Iterator[subprocess.Popen[str]]:
    """A running `sitl-emu launch ARGUMENTS`, ended by SIGTERM on leaving; its output is in the pipe.

    `in_background`: as a script's `&` starts it.
    """
    command = [sys.executable, "-P", "-m", "sitl_emu", "launch", *arguments]
    with tempfile.TemporaryDirectory(prefix="sitl_emu-") as state:
        if "--state" not in arguments:
            command += ["--state", state]
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            preexec_fn=ignore_ctrl_c if in_background else None,
        )
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(STOP_LIMIT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            assert process.stdout is not None
            process.stdout.close()
