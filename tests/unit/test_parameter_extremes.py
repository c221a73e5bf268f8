"""Nothing that is set may raise: parameters at their extremes, in flight and on the wire.

tools/sweep_parameters.py tries every phase of a flight for longer.
"""

import math
import struct

import pytest

from sitl_emu.core import dialect as mavlink
from tests import extremes
from tests.unit.mavlink_peer import Peer, only

SCENES = ("hex in a mission", "rover in a mission")
TICKS = 2
INT32, REAL32 = mavlink.MAV_PARAM_TYPE_INT32, mavlink.MAV_PARAM_TYPE_REAL32


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_no_extreme_of_a_parameter_raises(name: str) -> None:
    (scene,) = (scene for scene in extremes.SCENES if scene.name == name)
    flight = extremes.Flight(scene)
    names = flight.read()
    assert len(names) > 240
    drawn = extremes.combinations(flight.parameters, names, seed=1)
    failures = [
        error for case in (*extremes.singles(flight.parameters, names), *drawn) if (error := flight.tried(case, TICKS))
    ]
    assert failures == []


def test_every_parameter_takes_and_tells_each_extreme() -> None:
    peer = Peer()
    for name in peer.parameters.announced:
        is_float = peer.parameters.is_float(name)
        for value in extremes.extremes(peer.parameters, name):
            raw = struct.pack("<f", value) if is_float else struct.pack("<i", int(value))
            (as_float,) = struct.unpack("<f", raw)
            kind = REAL32 if is_float else INT32
            peer.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), as_float, kind))
            (told,) = only(
                peer.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1)), "PARAM_VALUE"
            )
            bytes_told = struct.pack("<f", told.param_value)
            assert bytes_told == raw or (math.isnan(as_float) and math.isnan(told.param_value)), (name, value)


def test_a_failure_in_the_copy_is_told() -> None:
    def fail() -> None:
        raise ZeroDivisionError("on purpose")

    assert "on purpose" in extremes.in_fork(fail)
    assert extremes.in_fork(lambda: None) == ""
