"""Parameters of a multicopter's control that others limit, or set (`control/mc_parameters.py`)."""

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.control.mc_parameters import constrain, of_responsiveness
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.vehicle_kind import VehicleKind


def test_speeds_are_lowered_to_the_speeds_that_limit_them() -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER, {})
    said: list[tuple[Severity, str]] = []
    constrain(parameters, lambda severity, text, *event: said.append((severity, text)))
    assert said == []
    parameters.set("MPC_XY_VEL_MAX", 4.0)
    constrain(parameters, lambda severity, text, *event: said.append((severity, text)))
    assert (parameters["MPC_XY_CRUISE"], parameters["MPC_VEL_MANUAL"]) == (4.0, 4.0)
    assert said == [
        (Severity.CRITICAL, "Cruise speed has been constrained by max speed\t"),
        (Severity.CRITICAL, "Manual speed has been constrained by max speed\t"),
    ]


def said_of(parameters: Parameters) -> list[str]:
    said: list[str] = []
    constrain(parameters, lambda severity, text, *event: said.append(text.rstrip("\t")))
    return said


def test_tilt_and_hover_thrust_are_brought_back_to_their_limits() -> None:
    parameters = Parameters(
        VehicleKind.MULTICOPTER, {"MPC_TILTMAX_AIR": 120.0, "MPC_TILTMAX_LND": 100.0, "MPC_THR_HOVER": 1.5}
    )
    assert said_of(parameters) == [
        "Tilt constrained to safe value",
        "Land tilt has been constrained by max tilt",
        "Hover thrust has been constrained by min/max",
    ]
    assert [parameters[name] for name in ("MPC_TILTMAX_AIR", "MPC_TILTMAX_LND", "MPC_THR_HOVER")] == [89.0, 89.0, 1.0]


def test_one_parameter_sets_all_speeds() -> None:
    """MPC_XY_VEL_ALL, MPC_Z_VEL_ALL; told at once, and only where there is a change."""
    parameters = Parameters(VehicleKind.MULTICOPTER, {"MPC_XY_VEL_ALL": 4.0, "MPC_Z_VEL_ALL": 2.0})
    before = parameters.notifications
    assert said_of(parameters) == []
    assert parameters.notifications == before + 1
    assert [parameters[name] for name in ("MPC_VEL_MANUAL", "MPC_XY_CRUISE", "MPC_XY_VEL_MAX")] == [4.0, 4.0, 4.0]
    assert [parameters[name] for name in ("MPC_Z_V_AUTO_UP", "MPC_Z_VEL_MAX_DN")] == [2.0, 1.5]
    assert parameters["MPC_TKO_SPEED"] == pytest.approx(1.2)
    assert parameters["MPC_LAND_SPEED"] == 1.0
    said_of(parameters)
    assert parameters.notifications == before + 1


def test_responsiveness_sets_accelerations_and_jerks() -> None:
    """0.5, as a real PX4 v1.18 told MPC_ACC_HOR 4.5, MPC_JERK_AUTO 7, MPC_MAN_Y_MAX 172.5, MPC_TILTMAX_AIR 45."""
    parameters = Parameters(VehicleKind.MULTICOPTER, {"SYS_VEHICLE_RESP": 0.5})
    said_of(parameters)
    names = ("MPC_ACC_HOR", "MPC_JERK_AUTO", "MPC_MAN_Y_MAX", "MPC_TILTMAX_AIR")
    assert [parameters[name] for name in names] == [4.5, 7.0, 172.5, 45.0]
    assert of_responsiveness(1.0)["MPC_TILTMAX_AIR"] == 70.0
    assert of_responsiveness(1.0)["MPC_MAN_Y_TAU"] == 0.0
