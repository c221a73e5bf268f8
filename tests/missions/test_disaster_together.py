"""Two aircraft share a disaster in a run: all is scanned, no slab gets two parcels, and they keep apart."""

from pathlib import Path
from typing import Any

import pytest

from sitl_emu.missions.companion.swarm.airspace import KEEP_M
from tests.missions.test_disaster_run import UAS, WORLD, run

SLAB: dict[str, Any] = {"label": "debris slab", "box": {"size_m": [6, 5, 0.4]}, "colour": [0.02, 0.05, 0.9]}
SLABS = ((22.0, -12.0), (18.0, 16.0))
TOWN: dict[str, Any] = WORLD | {
    "places": {"home": {"north_m": 0, "east_m": -7}, "home2": {"north_m": 0, "east_m": 7}},
    "area_m": [[4, -24], [4, 28], [36, 28], [36, -24]],
    "solids": [
        SLAB | {"name": f"slab {number}", "north_m": north, "east_m": east}
        for number, (north, east) in enumerate(SLABS)
    ],
}
RADIO = {"shared": True, "loss": 0.1, "bandwidth_bit_s": 57600}


PAIR: dict[str, Any] = {**UAS, "count": 2, "camera": {"mount": "nadir", "rate_hz": 2, "resolution": [320, 240]}}
LIMIT_S = 580.0


@pytest.mark.slow
def test_two_share_the_lines_and_the_slabs(tmp_path: Path) -> None:
    got = run(
        tmp_path, 0, world=TOWN, vehicle=PAIR, limit_s=LIMIT_S, where=("--isolated",), peer_radio=RADIO,
        time_limit_s=240,
    )  # fmt: skip
    assert (got["delivered"], got["served_twice"], got["scan_share"]) == (2, 0, 1.0)
    assert got["separation_m"] >= KEEP_M
    assert {one["vehicle"] for one in got["deliveries"]} == {"uas", "uas2"}
    by = {event["line"]: event["vehicle"] for event in got["events"] if event["event"] == "line_scanned"}
    assert set(by.values()) == {"uas", "uas2"}
    assert all(status["counts"]["sealed taken"] > 100 for status in got["companions"].values())
