"""The key that the aircraft of one swarm share, and the session that a companion seals in.

Options, to be taken by a program with `key_of`:

- `swarm_key`: a file with 64 hexadecimal digits, the same on all aircraft, which have no other.
- `swarm_seed`: a simulated run's seed (a program's `prepare` adds it, `for_a_run`). The key is then made of the seed,
  and of the file's where one is given: what was sealed in a simulation never opens aboard an aircraft.

One key for all: who takes it from a lost aircraft can speak as any of them. Make another for the next flight then.
"""

import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion.options import Options

KEY_BYTES = 32
"""NaCl's secret box (crypto_secretbox_KEYBYTES)."""
ALLOWED = "a file with 64 hexadecimal digits, the same on all aircraft (openssl rand -hex 32 > swarm.key)"
MOST_SEED = 2**53
"""Options carry whole numbers exactly up to here."""


@dataclass(frozen=True, slots=True)
class SwarmKey:
    """A secret, and the session that keeps what two boots of one aircraft seal apart."""

    secret: bytes = field(repr=False)
    session: int
    """32 bits; at random on an aircraft, of the seed in a simulated run."""
    simulated: bool = False

    @property
    def mark(self) -> int:
        """16 bits that tell strangers' packets from spoilt ones; they give nothing of the key away."""
        return int.from_bytes(_hash(self.secret, b"mark", 2))

    @property
    def said(self) -> str:
        """A line for people."""
        made = "made of the run's seed, for simulation alone" if self.simulated else "from its file"
        return f"swarm key {self.mark:04x}, {made}"


def key_of(given: Options) -> SwarmKey:
    """From options. Raises ValueError."""
    path, seed = given.file("swarm_key"), given.whole("swarm_seed", -1, -1, MOST_SEED)
    if path is None and seed < 0:
        raise ValueError(f"option swarm_key: missing; allowed: {ALLOWED}")
    secret = read(path) if path is not None else bytes(KEY_BYTES)
    if seed < 0:
        return SwarmKey(secret, secrets.randbits(32))
    made = _hash(secret, f"simulation {seed}".encode(), KEY_BYTES)
    return SwarmKey(made, int.from_bytes(_hash(made, b"session", 4)), simulated=True)


def for_a_run(options: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """The options of a program that talks in a swarm, as a simulated run starts it."""
    return {**options, "swarm_seed": seed}


def read(path: Path) -> bytes:
    """The key in a file. Raises ValueError."""
    try:
        secret = bytes.fromhex(path.read_text().strip())
    except OSError as error:
        raise ValueError(f"option swarm_key: {str(path)!r}: {error.strerror}; allowed: {ALLOWED}") from None
    except ValueError:
        secret = b""
    if len(secret) != KEY_BYTES:
        raise ValueError(f"option swarm_key: {str(path)!r}: holds no key; allowed: {ALLOWED}")
    return secret


def _hash(secret: bytes, what: bytes, size: int) -> bytes:
    return hashlib.blake2b(what, digest_size=size, key=secret, person=b"sitl_emu swarm").digest()
