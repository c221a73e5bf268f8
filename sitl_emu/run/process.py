"""What the processes of a run have in common at their start and end."""

import contextlib
import errno
import signal
import sys
from collections.abc import Callable
from typing import NoReturn

from sitl_emu.core.simulator_api import ChannelClosed
from sitl_emu.run import configs
from sitl_emu.run.control import ControlChannel, ProcessLostError, inherited

EXIT_EXPLAINED = 3
"""The process had to end, and its last line of output says why, for people."""
CANNOT_WRITE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO}


def ending_signals() -> list[signal.Signals]:
    """SIGINT, SIGTERM, and SIGHUP of a terminal that is closed; without those that are ignored, as nohup has it."""
    asked = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    return [number for number in asked if signal.getsignal(number) is not signal.SIG_IGN]


def signal_name(number: int) -> str:
    """SIGKILL of 9; a real-time signal has but its number."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


class StartError(Exception):
    """A process can't be set up; the text is one line for people."""


def main(
    run: Callable[[configs.Config, ControlChannel], None], kind: type[configs.Config], other: str = "the world process"
) -> NoReturn:
    """Run a process of a run: `python -m … CONTROL_FD TITLE FOLDER`; its standard input is a record of `kind`, as JSON.

    Ctrl-C is the launcher's to hear. When the world process has gone the run is over, and this process ends in peace.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    control = inherited(int(sys.argv[1]), other)
    config = configs.read(kind, sys.stdin.read())
    try:
        run(config, control)
    except (ProcessLostError, ChannelClosed):
        sys.exit(0)
    except StartError as error:
        _explain(str(error))
    except OSError as error:
        if error.errno not in CANNOT_WRITE:
            raise
        _explain(f"can't write {error.filename or 'the logs'}: {error.strerror}")
    sys.exit(0)


def _explain(text: str) -> NoReturn:
    """End with a last line of output, where the disk that is full is not the output's as well."""
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr, flush=True)
    sys.exit(EXIT_EXPLAINED)
