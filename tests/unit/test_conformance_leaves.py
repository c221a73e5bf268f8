"""Conformance tests that change a vehicle for good if a message is lost: they ask again, and say what they left."""

import importlib
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from tests.conformance.conftest import MARKERS


@pytest.fixture
def signing(request: pytest.FixtureRequest) -> ModuleType:
    """The tests of signing, whose marks are known where they are run."""
    for marker in MARKERS:
        request.config.addinivalue_line("markers", marker)
    return importlib.import_module("tests.conformance.test_signing")


class Signing:
    """A station, and a vehicle with a key behind a radio that loses the first removals of it."""

    def __init__(self, loses: int) -> None:
        self.system, self.mav, self.signing = 1, self, SimpleNamespace()
        self.loses, self.has_key = loses, True
        self._text: str | None = None

    def setup_signing_send(self, _system: int, _component: int, key: list[int], _timestamp: int) -> None:
        assert self.signing.sign_outgoing and not any(key)
        self.loses -= 1
        if self.loses < 0:
            self.has_key = False

    def command_long_send(self, *_: Any) -> None:
        """The answer is what is received next."""

    def receive(self, name: str, _limit_s: float) -> Any:
        if name == "STATUSTEXT":  # is lost as well
            return None
        return SimpleNamespace(get_header=lambda: SimpleNamespace(incompat_flags=int(self.has_key)))


def test_a_key_is_removed_again_if_that_was_lost(signing: ModuleType) -> None:
    vehicle = Signing(loses=3)
    signing.remove_key(vehicle)
    assert (vehicle.has_key, vehicle.signing.sign_outgoing) == (False, False)


def test_a_key_that_stays_is_told_with_what_removes_it(signing: ModuleType) -> None:
    with pytest.raises(pytest.fail.Exception, match=f"signed with the key {bytes(range(32)).hex()}.*: remove it by"):
        signing.remove_key(Signing(loses=99))
