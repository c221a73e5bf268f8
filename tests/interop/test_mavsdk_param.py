"""MAVSDK param: read, set, all of them, and what PX4 does not have."""

from typing import Any

import pytest
from mavsdk.plugins.param import ParamError, ParamResult

from tests.interop.mavsdk_vehicle import IRIS_PARAMETERS, Vehicle


def test_integers_and_floats_are_set_and_read_back(vehicle: Vehicle) -> None:
    param = vehicle.param
    assert param.get_param_int("COM_FLTMODE1") == -1
    param.set_param_int("COM_FLTMODE1", 3)
    assert param.get_param_int("COM_FLTMODE1") == 3
    param.set_param_int("COM_FLTMODE1", -1)
    with vehicle.with_param("MPC_XY_CRUISE", 6.5):
        assert param.get_param_float("MPC_XY_CRUISE") == 6.5
    assert param.get_param_float("MPC_XY_CRUISE") == 5.0


def test_all_parameters_come_as_integers_and_floats(vehicle: Vehicle) -> None:
    everything = vehicle.param.get_all_params()
    floats = {one.name: one.value for one in everything.float_params}
    assert len(everything.int_params) + len(floats) == IRIS_PARAMETERS
    assert floats["MPC_XY_CRUISE"] == 5.0
    assert everything.custom_params == []


@pytest.mark.parametrize(
    ("name", "result"),
    [
        ("NO_SUCH_PARAM", ParamResult.DOES_NOT_EXIST),  # PARAM_ERROR
        ("A_NAME_OF_17_CHAR", ParamResult.PARAM_NAME_TOO_LONG),
        ("MPC_XY_CRUISE", ParamResult.WRONG_TYPE),
    ],
)
def test_what_cannot_be_read_is_told(vehicle: Vehicle, name: str, result: ParamResult) -> None:
    vehicle.param.get_param_float("MPC_XY_CRUISE")
    with pytest.raises(ParamError) as told:
        vehicle.param.get_param_int(name)
    assert told.value.result == result


def test_a_value_of_the_wrong_type_changes_nothing(vehicle: Vehicle) -> None:
    with pytest.raises(ParamError):
        vehicle.param.set_param_int("MPC_XY_CRUISE", 3)
    kept: Any = vehicle.param.get_param_float("MPC_XY_CRUISE")
    assert kept == 5.0
