"""The page's socket: on this machine alone."""

import socket

HOST = "127.0.0.1"


def listen(port: int = 0) -> socket.socket:
    """A listening socket; port 0: a free one. Raises OSError."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((HOST, port))
        listening.listen()
    except OSError:
        listening.close()
        raise
    return listening


def url_of(listening: socket.socket) -> str:
    """Where a browser finds the page."""
    return f"http://{HOST}:{listening.getsockname()[1]}/"
