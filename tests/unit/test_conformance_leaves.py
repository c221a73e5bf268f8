"""Conformance tests that change a vehicle for good if a message is lost: they ask again, and say what they left."""

import importlib
import struct
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from tests.conformance.conftest import MARKERS


@pytest.fixture
def marked(request: pytest.FixtureRequest) -> None:
    """The marks of conformance tests are known where these are run."""
    for marker in MARKERS:
        request.config.addinivalue_line("markers", marker)


@pytest.fixture
def signing(marked: None) -> ModuleType:
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


class Gyro:
    """A station, and a vehicle whose first parameter that is set is lost."""

    def __init__(self) -> None:
        self.system, self.mav, self._lost = 1, self, False
        self.values = {"CAL_GYRO0_XOFF": struct.pack("<f", 0.5), "CAL_GYRO0_PRIO": struct.pack("<i", -1)}

    def parameter_bytes(self, name: str) -> bytes | None:
        return self.values.get(name)

    def param_set_send(self, _system: int, _component: int, name: bytes, value: float, _kind: int) -> None:
        if self._lost:
            self.values[name.decode()] = struct.pack("<f", value)
        self._lost = True


@pytest.mark.usefixtures("marked")
def test_the_gyro_gets_its_calibration_back_an_integer_too() -> None:
    calibration = importlib.import_module("tests.conformance.test_calibration")
    vehicle = Gyro()
    before, kept = dict(vehicle.values), calibration.gyro_parameters(vehicle)
    vehicle.values |= {"CAL_GYRO0_XOFF": bytes(4), "CAL_GYRO0_PRIO": struct.pack("<i", 50)}
    calibration.give_back(vehicle, kept)
    assert vehicle.values == before
