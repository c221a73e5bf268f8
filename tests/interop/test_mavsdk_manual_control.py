"""MAVSDK manual_control: a joystick arms, climbs and flies in Position and Altitude mode."""

import contextlib
import threading
from collections.abc import Iterator

import pytest
from mavsdk.plugins.manual_control import ManualControl, ManualControlError, ManualControlResult
from mavsdk.plugins.telemetry import FlightMode

from tests.interop.mavsdk_vehicle import Vehicle, until

PERIOD_S = 0.02
PATIENT_S = 10.0
"""COM_RC_LOSS_T meanwhile: the vehicle's time runs faster than that of a busy machine's MAVSDK."""


class Sticks:
    """Held where they are put, by a thread that keeps on saying it, as a joystick does."""

    def __init__(self, plugin: ManualControl) -> None:
        self._plugin = plugin
        self._position = (0.0, 0.0, 0.5, 0.0)
        self._released = threading.Event()
        self._thread = threading.Thread(target=self._hold)

    def put(self, forward: float = 0.0, right: float = 0.0, up: float = 0.5, turn: float = 0.0) -> None:
        """-1 to 1; `up` 0 to 1."""
        self._position = (forward, right, up, turn)

    @contextlib.contextmanager
    def held(self) -> Iterator["Sticks"]:
        """For the time of a block."""
        self._plugin.set_manual_control_input(*self._position)  # MAVSDK starts no mode before the first
        self._thread.start()
        try:
            yield self
        finally:
            self._released.set()
            self._thread.join()

    def _hold(self) -> None:
        while not self._released.wait(PERIOD_S):
            self._plugin.set_manual_control_input(*self._position)


def test_without_sticks_it_cannot_be_started(vehicle: Vehicle) -> None:
    with pytest.raises(ManualControlError) as told:
        ManualControl(vehicle.system).start_position_control()
    assert told.value.result == ManualControlResult.INPUT_NOT_SET


def test_a_stick_out_of_range_is_refused(vehicle: Vehicle) -> None:
    with pytest.raises(ManualControlError) as told:
        ManualControl(vehicle.system).set_manual_control_input(2.0, 0.0, 0.5, 0.0)
    assert told.value.result == ManualControlResult.INPUT_OUT_OF_RANGE


def test_sticks_fly_the_vehicle(vehicle: Vehicle) -> None:
    plugin, telemetry = ManualControl(vehicle.system), vehicle.telemetry
    vehicle.until_ready()
    with vehicle.with_param("COM_RC_LOSS_T", PATIENT_S), Sticks(plugin).held() as sticks:
        until(telemetry, "rc_status", lambda _: True)
        plugin.start_position_control()
        vehicle.until_mode(FlightMode.POSCTL)
        vehicle.action.arm()
        sticks.put(up=1.0)
        until(telemetry, "position", lambda position: position.relative_altitude_m > 8.0)
        sticks.put(forward=1.0)
        until(telemetry, "velocity_ned", lambda velocity: velocity.north_m_s > 3.0)
        sticks.put()
        until(telemetry, "velocity_ned", lambda velocity: abs(velocity.north_m_s) < 0.3)
        sticks.put(turn=0.5)
        until(telemetry, "attitude_angular_velocity_body", lambda rates: rates.yaw_rad_s > 0.3)
        sticks.put()
        plugin.start_altitude_control()
        vehicle.until_mode(FlightMode.ALTCTL)
        sticks.put(right=0.5)
        until(telemetry, "attitude_euler", lambda attitude: attitude.roll_deg > 10.0)
        sticks.put()
        # A stick that still moves would take over from landing (COM_RC_OVERRIDE).
        until(telemetry, "attitude_euler", lambda attitude: abs(attitude.roll_deg) < 2.0)
    vehicle.land()
