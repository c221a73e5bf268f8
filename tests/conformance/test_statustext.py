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
        assert station.command(ARM_DISARM, 1) == 1
        first, second = station.receive("STATUSTEXT"), station.receive("STATUSTEXT")
        assert (first.severity, first.chunk_seq, len(first.text)) == (2, 0, 50)
        assert (second.severity, second.id, second.chunk_seq) == (2, first.id, 1)
        ids.append(first.id)
    station.set_mode(*HOLD)
    assert ids[1] == (ids[0] + 1) % 65536
    assert first.text + second.text == "Arming denied: Resolve system health failures first\t"
