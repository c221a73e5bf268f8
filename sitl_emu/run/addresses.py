"""Addresses as users write them: a host's name or number, and a port."""

import socket

from sitl_emu.run.trouble import Trouble


def is_port(text: str) -> bool:
    """Whether this is the number of a port."""
    return text.isascii() and text.isdigit() and len(text) <= len("65535") and 0 < int(text) < 65536


def address_of(text: str, default_port: int) -> tuple[str, int]:
    """The IPv4 address and the port of what --gcs says, HOST or HOST:PORT. Raises Trouble."""
    host, _, port = text.partition(":")
    if not host or (port and not is_port(port)):
        raise Trouble(f"--gcs {text}: give HOST or HOST:PORT, such as 192.168.1.20:14550")
    try:
        return socket.gethostbyname(host), int(port) if port else default_port
    except (OSError, UnicodeError):
        raise Trouble(f"--gcs {text}: there is no host {host!r}") from None


def check_host(host: str, given: str) -> None:
    """Raise Trouble for a host that nobody knows; `given`: what the user wrote, for people."""
    try:
        socket.getaddrinfo(host, None)
    except (OSError, UnicodeError):
        raise Trouble(f"{given}: there is no host {host!r}; give its name or its number, such as 127.0.0.1") from None
