"""The process that serves the page of a run that goes on: `python -m … FOLDER FD`, FD a listening socket.

It gives way to the processes of the run, and ends when its standard input does: with the launcher, however that ends.
"""

import os
import signal
import socket
import sys
import threading
from pathlib import Path

from sitl_emu.run.view.server import PageServer

YIELDING = 10
"""Niceness, more than a camera's."""


def main() -> None:
    """Serve until the launcher has no more to show."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(YIELDING)
    server = PageServer(Path(sys.argv[1]), socket.socket(fileno=int(sys.argv[2])))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    sys.stdin.buffer.read()
    server.finish()


if __name__ == "__main__":
    main()
