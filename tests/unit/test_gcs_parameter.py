"""What the ground side's parameter questions hear of who refuses them, and of others."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.parameter import ParameterRead, ParameterSet
from tests.unit.companion_px4 import on_the_wire
from tests.unit.gcs_link import STEP_S, converse
from tests.unit.mavlink_peer import Peer


@pytest.mark.parametrize(
    ("question", "refusal"),
    [
        (lambda: ParameterRead(1, "NO_SUCH_PARAM"), "does not exist"),
        (lambda: ParameterSet(1, "NO_SUCH_PARAM", 1.0), "does not exist"),
        (lambda: ParameterSet(1, "MPC_XY_CRUISE", 6), "type mismatch"),
        (lambda: ParameterSet(1, "_HASH_CHECK", 1), "read only"),
    ],
)
def test_what_the_autopilot_refuses_ends_at_once_and_says_why(question: Any, refusal: str) -> None:
    peer, asked = Peer(), question()
    converse(peer, asked, 10.0, lambda: asked.done)
    assert peer.now_us <= STEP_S * 1e6
    assert asked.refusal == refusal


def test_nobody_s_answer_says_so() -> None:
    read = ParameterRead(2, "MPC_XY_CRUISE")
    converse(Peer(), read, 10.0, lambda: read.done)
    assert (read.parameter, read.refusal) == (None, "no answer to 10 tries")


def told(component: int, name: str) -> Any:
    return on_the_wire(mavlink.MAVLink_param_value_message(name.encode(), 6.5, 9, 900, 1), 1, component)


def refused(component: int, name: str) -> Any:
    return on_the_wire(mavlink.MAVLink_param_error_message(255, 190, name.encode(), -1, 1), 1, component)


@pytest.mark.parametrize("say", [told, refused])
def test_another_component_and_another_parameter_are_not_heard(say: Any) -> None:
    read, of_any = ParameterRead(1, "A_GAIN"), ParameterRead(1, "A_GAIN", 0)
    read.on_message(0, say(1, "A_GAIN"))
    assert not read.done, "not asked yet"
    read.on_time(0)
    of_any.on_time(0)
    for question, component, name, done in (
        (read, 100, "A_GAIN", False),
        (read, 1, "B_GAIN", False),
        (read, 1, "A_GAIN", True),
        (of_any, 100, "A_GAIN", True),
    ):
        question.on_message(0, say(component, name))
        assert question.done is done
