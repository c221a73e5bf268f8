"""STATUSTEXT: what arming says, in chunks of 50 characters where it is longer."""

from typing import Any

import pytest

ARM_DISARM = 400
STABILIZED, HOLD = (7, 0), (4, 3)


@pytest.mark.covers("STATUSTEXT", source="https://mavlink.io/en/messages/common.html#STATUSTEXT")
@pytest.mark.covers(
    "STATUSTEXT",
    source="measured mode/arm_in/*/texts, misc/text/chunking: text and severity; each has the next id",
)
def test_a_long_text_comes_in_chunks(station: Any) -> None:
    station.set_mode(*STABILIZED)
    ids = []
    for _ in range(2):
        # Which of text and answer PX4 sends first, differs from run to run.
        station.mav.command_long_send(station.system, 1, ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
        heard = station.collect(["STATUSTEXT", "COMMAND_ACK"], 0.5, at_least=3)
        first, second = (message for message in heard if message.get_type() == "STATUSTEXT")
        assert [ack.result for ack in heard if ack.get_type() == "COMMAND_ACK"] == [1]
        assert (first.severity, first.chunk_seq, len(first.text)) == (2, 0, 50)
        assert (second.severity, second.id, second.chunk_seq) == (2, first.id, 1)
        ids.append(first.id)
    station.set_mode(*HOLD)
    assert ids[1] == (ids[0] + 1) % 65536
    assert first.text + second.text == "Arming denied: Resolve system health failures first\t"
