"""Two detectors as one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.companion.agreeing import Agreeing
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection

PICTURE = np.zeros((8, 8, 3), np.uint8)
FINDS = st.lists(
    st.builds(
        Detection, st.sampled_from(["weed", "disease"]), st.floats(0, 1), st.floats(0, 640), st.floats(0, 480),
        st.floats(1, 90), st.floats(1, 90),
    ),
    max_size=6,
)  # fmt: skip


class Sees:
    """A detector that sees the same in every picture."""

    labels = ("weed", "disease")

    def __init__(self, *finds: Detection) -> None:
        self.finds = list(finds)

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        return self.finds


WEED = Detection("weed", 0.8, 100.0, 100.0, 20.0, 20.0)


def test_what_both_see_has_the_mean_of_their_scores() -> None:
    other = WEED._replace(score=0.4, x=112.0, w=10.0)
    (found,) = Agreeing(Sees(WEED), Sees(other)).detect(PICTURE)
    assert found == WEED._replace(score=0.6)


def test_what_one_alone_sees_counts_half() -> None:
    for other in (WEED._replace(label="disease"), WEED._replace(x=130.0), WEED._replace(y=121.0)):
        (found,) = Agreeing(Sees(WEED), Sees(other)).detect(PICTURE)
        assert found.score == 0.4
    assert Agreeing(Sees(), Sees(WEED)).detect(PICTURE) == []


@given(FINDS, FINDS)
def test_nothing_moves_and_no_score_is_raised_beyond_the_better(
    first: list[Detection], second: list[Detection]
) -> None:
    found = Agreeing(Sees(*first), Sees(*second)).detect(PICTURE)
    assert [one._replace(score=0.0) for one in found] == [one._replace(score=0.0) for one in first]
    best = max((other.score for other in second), default=0.0)
    for one, own in zip(found, first, strict=True):
        assert 0.5 * own.score - 1e-3 <= one.score <= max(own.score, best) + 1e-3
