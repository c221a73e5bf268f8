"""Kinds of vehicle: each is one row of traits, and what the row names is there."""

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot import parameters
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.control.control import CONTROLS
from sitl_emu.autopilot.land_detector.land_detector import DETECTORS
from sitl_emu.autopilot.shell.commands import COMMANDS
from sitl_emu.autopilot.vehicle_kind import VehicleKind


@pytest.mark.parametrize(
    ("mav_type", "kind"),
    [
        (2, VehicleKind.MULTICOPTER),
        (13, VehicleKind.MULTICOPTER),
        (13.0, VehicleKind.MULTICOPTER),
        (10, VehicleKind.ROVER_ACKERMANN),
        (0, VehicleKind.MULTICOPTER),
        (1, VehicleKind.MULTICOPTER),
    ],
)
def test_mav_type_says_the_kind(mav_type: float, kind: VehicleKind) -> None:
    assert VehicleKind.of_mav_type(mav_type) is kind


def test_no_mav_type_means_two_kinds() -> None:
    named = [number for kind in VehicleKind for number in kind.traits.mav_types]
    assert len(named) == len(set(named))


@pytest.mark.parametrize("kind", VehicleKind)
def test_what_a_row_names_is_there(kind: VehicleKind) -> None:
    traits = kind.traits
    assert kind in CONTROLS
    assert traits.land_detector in DETECTORS
    assert traits.modules <= set(COMMANDS)
    assert any(traits.announces in row["announced"] for row in parameters.table().values())


@pytest.mark.parametrize("model", vehicles.models())
def test_every_vehicle_boots_as_its_kind(model: str) -> None:
    airframe = vehicles.load(model).airframe
    autopilot = Autopilot(airframe, 0)
    assert autopilot.topics.vehicle_status.vehicle_kind is VehicleKind.of_mav_type(airframe["MAV_TYPE"])
