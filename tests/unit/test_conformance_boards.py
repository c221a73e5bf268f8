"""Conformance tests hold a real board to what PX4 v1.18 is, not to what its simulation alone has."""

import importlib
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conformance.conftest import MARKERS


@pytest.fixture(autouse=True)
def marked(request: pytest.FixtureRequest) -> None:
    """The marks of conformance tests are known where these are run."""
    for marker in MARKERS:
        request.config.addinivalue_line("markers", marker)


def version(patch: int, board: int, vendor: int) -> Any:
    told = 1 << 24 | 18 << 16 | patch << 8 | 255
    return SimpleNamespace(
        get_type=lambda: "AUTOPILOT_VERSION",
        capabilities=59647,
        flight_sw_version=told,
        middleware_sw_version=told,
        board_version=board,
        vendor_id=vendor,
        product_id=vendor,
        uid=7,
        uid2=[1],
    )


def test_every_patch_on_every_board_is_v1_18_but_the_simulation_has_no_board() -> None:
    identity = importlib.import_module("tests.conformance.test_identity")
    for told in (version(0, 1, 0), version(2, 1, 0), version(1, 56, 0x26AC)):
        identity.test_version(SimpleNamespace(system=1, request=lambda *_, told=told: (0, told)))
    with pytest.raises(AssertionError):
        identity.test_version(SimpleNamespace(system=1, request=lambda *_: (0, version(0, 56, 0))))


class Shell:
    """A station, and a vehicle whose shell prints one text for whatever is typed."""

    def __init__(self, text: str) -> None:
        self.mav, self.text = self, text
        self._typed = ""

    def serial_control_send(self, _device: int, _flags: int, _timeout: int, _baud: int, count: int, data: Any) -> None:
        self._typed = bytes(data[:count]).decode()

    def collect(self, *_: Any, **__: Any) -> list[Any]:
        data = (self._typed + self.text).encode()
        return [SimpleNamespace(count=len(data), data=data)]


def test_the_shell_of_a_board_is_skipped_with_a_reason() -> None:
    shell = importlib.import_module("tests.conformance.test_shell")
    with pytest.raises(pytest.skip.Exception, match=r"holds for the shell of PX4's simulation"):
        shell.skip_on_a_board(Shell("\n\x1b[Knsh> \x1b[K"))
    shell.skip_on_a_board(Shell("pxh> "))
