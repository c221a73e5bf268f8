"""Where the product or its pages say that something was measured on PX4, they name the measurement, or PX4's file.

(For the conformance tests: test_conformance_command.py.)
"""

import pathlib
import re

import pytest

from .measurements import is_known

ROOT = pathlib.Path(__file__).parents[2]
PLACES = ("autopilot", "sitl_emu", "vehicles", "gcs", "missions", "docs", "README.md", "CHANGELOG.md")
CLAIM = re.compile(
    r"\bas (it was |they were )?measured\b|\bmeasured (on PX4|at rest|in flight)|\b(was|were) seen (to|on)\b", re.I
)
REACH = 300
"""Characters behind the claim, within which its address stands."""
ADDRESS = re.compile(r"\b(?:[a-z_]+/[\w*./-]*[\w*]|[A-Za-z_/]+\.(?:cpp|hpp|h|c|py))")
PX4_FILE = re.compile(r"[\w/]+\.(cpp|hpp|h|c)")


def texts() -> list[pathlib.Path]:
    files = [path for place in PLACES for path in ([ROOT / place] if "." in place else (ROOT / place).rglob("*"))]
    return [path for path in files if path.suffix in {".py", ".md", ".toml"} and not path.name.startswith("dialect")]


def unaddressed(text: str) -> list[str]:
    """Claims of a text that name neither a known measurement nor a file of PX4's."""
    found = []
    for claim in CLAIM.finditer(text):
        addresses = ADDRESS.findall(text[claim.start() : claim.end() + REACH])
        if not any(is_known(name) or PX4_FILE.fullmatch(name) for name in addresses):
            found.append(text[max(0, claim.start() - 60) : claim.end() + 60])
    return found


@pytest.mark.parametrize("claim", ["as measured on PX4.", "was seen to do so (flights/no_such_flight)"])
def test_a_claim_without_an_address_is_found(claim: str) -> None:
    assert unaddressed(claim)


@pytest.mark.parametrize("claim", ["as measured (misc/ping/own)", "as measured (misc/*)", "was seen to (Ekf.cpp)"])
def test_a_claim_with_an_address_is_none(claim: str) -> None:
    assert not unaddressed(claim)


def test_what_is_said_to_be_measured_names_its_measurement() -> None:
    found = {str(path.relative_to(ROOT)): claims for path in texts() if (claims := unaddressed(path.read_text()))}
    assert not found
