"""Start `sitl-emu launch` as a user would, with a state folder of its own, and end it whatever happens."""

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator

STOP_LIMIT_S = 10.0


@contextlib.contextmanager
def launched(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A running `sitl-emu launch ARGUMENTS`, ended by SIGTERM on leaving; its output is in the pipe."""
    command = [sys.executable, "-P", "-m", "sitl_emu", "launch", *arguments]
    with tempfile.TemporaryDirectory(prefix="sitl_emu-") as state:
        if "--state" not in arguments:
            command += ["--state", state]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
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
