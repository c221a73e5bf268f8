"""Other vehicles in a scene, with turning propellers: where they are, the simulation says."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.camera import OtherVehicle, body_to_ned
from sitl_emu.world.render import vehicle_mesh
from sitl_emu.world.render.model import turned
from sitl_emu.world.render.raster import HIDDEN, Instances
from sitl_emu.world.render.stage import Stage

F64 = npt.NDArray[np.float64]
SPEED_RAD_S = 430.0
"""Of propellers: that of a small multicopter in hover; pictures see a blade somewhere (ours)."""


class Guest(NamedTuple):
    """The instances of one vehicle."""

    body: int
    propellers: tuple[tuple[int, vehicle_mesh.Propeller], ...] = ()


class Guests:
    """All of them, by name; `stage` must be packed again after `meet` has said so."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._known: dict[str, Guest] = {}
        self.others: Sequence[OtherVehicle] = ()

    @property
    def rows(self) -> list[int]:
        """Their instances."""
        return [row for guest in self._known.values() for row in (guest.body, *(p[0] for p in guest.propellers))]

    def meet(self) -> bool:
        """Add meshes of those who are new; whether there were any."""
        known = len(self._known)
        for other in self.others:
            if other.name not in self._known:
                self._known[other.name] = self._add_vehicle(other)
        return len(self._known) > known

    def _add_vehicle(self, other: OtherVehicle) -> Guest:
        look = vehicle_mesh.look_of(other.vehicle)
        number = self._stage.add_object(other.name, "vehicle")
        body = self._stage.place(self._stage.add_model(look.body), number, (0.0, 0.0, 0.0))
        propellers = [
            (self._stage.place(self._stage.add_model(each.model), number, (0.0, 0.0, 0.0)), each)
            for each in look.propellers
        ]
        return Guest(body, tuple(propellers))

    def put(self, things: Instances, time_s: float) -> None:
        """Where they all are at a time."""
        rows = self.rows
        things.flags[rows] |= HIDDEN
        for other in self.others:
            guest = self._known[other.name]
            turn = body_to_ned(other.pose.q)
            place = np.array(other.pose[:3])
            _put(things, guest.body, place, turn)
            for row, propeller in guest.propellers:
                angle = propeller.turns * (SPEED_RAD_S * time_s if other.turning else 0.4) % (2.0 * math.pi)
                _put(things, row, place + turn @ np.array(propeller.at), turn @ turned(angle))


def _put(things: Instances, row: int, place: F64, turn: F64) -> None:
    things.place[row], things.rotation[row] = place, turn
    things.flags[row] &= ~HIDDEN
