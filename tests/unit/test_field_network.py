"""The network that comes with the package: it sees patches from the rover's mast, and bare corn as nothing."""

import math

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.agriculture.detectors import FROM_THE_MAST
from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.kinds.corn_field import field as corn
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.lens import MAST

AHEAD_M, CAMERA_UP_M = 1.2, 0.2


def test_every_network_has_a_card_and_is_small() -> None:
    assert networks.names()
    for name in networks.names():
        assert (networks.FOLDER / f"{name}.md").exists()
        assert networks.path_of(name).stat().st_size < 15e6


def test_patches_are_seen_from_the_mast_and_bare_corn_is_not() -> None:
    field = corn.build(20_001, targets=12, distractors=0)
    camera, detector = Camera(FieldScene(field), MAST), FROM_THE_MAST["network"].make()

    def look(north: float, east: float) -> list[Detection]:
        down = -field.terrain.height_m(north, east) - CAMERA_UP_M
        return detector.detect(camera.render(Pose(north, east, down, quaternion(0.0, 0.0, 0.0)), 0))

    seen = [thing.kind in {one.label for one in look(thing.north_m - AHEAD_M, thing.east_m)} for thing in field.targets]
    assert sum(seen) >= 10
    places = [(n, e) for n in range(12, 70, 6) for e in range(12, 70, 6)]
    bare = [
        place for place in places
        if min(math.dist(place, (thing.north_m - AHEAD_M, thing.east_m)) for thing in field.targets) > 6.0
    ]  # fmt: skip
    assert len(bare) >= 20
    confirming = FROM_THE_MAST["network"].confirming.report_score
    assert sum(any(one.score >= confirming for one in look(*place)) for place in bare[:20]) <= 2
