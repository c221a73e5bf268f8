"""What stands around the conformance tests: whom they measure, and in which mode."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conformance import station as stations
from tests.conformance.conftest import FORCE_VARIABLE, UNREACHABLE, in_any_case, mode_kept, say_whom
from tests.conformance.station import DO_SET_MODE, HOLD, STANDBY, Station

POSITION, UNINIT = 3 << 16, 0
PX4, HEXAROTOR, CUSTOM = 12, 13, 1


class Vehicle(Station):
    """A station, and an autopilot without sticks: it is in standby in Hold alone."""

    def __init__(self, custom_mode: int, takes_modes: bool = True, armed: bool = False) -> None:
        self.link = SimpleNamespace(recv_match=lambda **_: None)
        self.mav: Any = self
        self.custom_mode = None
        self.mode, self._takes_modes, self._armed = custom_mode, takes_modes, armed
        self.system, self.is_lost = 0, False

    def receive(self, name: str | list[str], limit_s: float = 0.0) -> Any:
        if name != "HEARTBEAT":
            return None
        return SimpleNamespace(
            get_srcComponent=lambda: 1,
            get_srcSystem=lambda: 1,
            type=HEXAROTOR,
            autopilot=PX4,
            custom_mode=self.mode,
            base_mode=128 * self._armed,
            system_status=STANDBY if self.mode == HOLD else UNINIT,
        )

    def command_long_send(self, _system: int, _component: int, command: int, _: int, *params: float) -> None:
        if command == DO_SET_MODE and self._takes_modes:
            assert params[0] == CUSTOM
            self.mode = int(params[1]) << 16 | int(params[2]) << 24

    def param_request_read_send(self, *_: Any) -> None:
        """Nothing is answered."""


@pytest.fixture(autouse=True)
def short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stations, "READY_LIMIT_S", 0.05)
    monkeypatch.setattr(stations, "SETTLE_LIMIT_S", 0.05)
    monkeypatch.setattr(stations, "OTHERS_S", 0.05)


def nothing_is_told(text: str) -> None:
    raise AssertionError(text)


def measured(vehicle: Vehicle, say: Callable[[str], None] = nothing_is_told) -> None:
    with mode_kept(vehicle, say):
        vehicle.wait_until_ready(0.05)
        assert vehicle.mode == HOLD
        vehicle._takes_modes = say == nothing_is_told


def test_tests_are_run_in_hold_and_the_vehicle_then_goes_back_to_its_mode() -> None:
    vehicle = Vehicle(POSITION)
    measured(vehicle)
    assert vehicle.mode == POSITION


def test_a_vehicle_that_does_not_go_back_to_its_mode_is_told() -> None:
    told = list[str]()
    measured(Vehicle(POSITION), told.append)
    assert told == ["the vehicle does not go back to the mode that it was found in (custom_mode 196608)"]


@pytest.mark.parametrize(("takes_modes", "armed"), [(False, False), (True, True)])
def test_one_that_does_not_take_hold_or_is_armed_is_left_alone(takes_modes: bool, armed: bool) -> None:
    vehicle = Vehicle(POSITION, takes_modes, armed)
    with pytest.raises(TimeoutError, match="not in standby, in Hold"):
        measured(vehicle)
    assert vehicle.mode == POSITION


def test_a_stranger_is_measured_by_force_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    stranger: Any = SimpleNamespace(others=[], stranger="PX4 1.15.4")
    warning = "udp: this is PX4 1.15.4: verdicts are those of PX4 v1.18's behaviour, and what that denies may make "
    with pytest.raises(pytest.exit.Exception, match=warning) as ended:
        say_whom(stranger, "udp", nothing_is_told)
    assert ended.value.returncode == UNREACHABLE
    told = list[str]()
    monkeypatch.setenv(FORCE_VARIABLE, "1")
    say_whom(stranger, "udp", told.append)
    assert told[0].startswith(warning)


def test_what_is_given_back_when_ctrl_c_comes_is_given_back_all_the_same() -> None:
    tries = list[int]()

    def give_back() -> None:
        tries.append(len(tries))
        if len(tries) == 1:
            raise KeyboardInterrupt

    in_any_case(give_back)
    assert tries == [0, 1]
