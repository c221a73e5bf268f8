"""What flames light in the dark."""

from typing import Any

import numpy as np

from sitl_emu.world.render import firelight
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.scene import MeshScene
from tests.unit.test_render import DOWN, NOWHERE, world_of

FRONT = {"name": "front", "polygon_m": [[-2, -8], [-2, 8], [2, 8], [2, -8]], "flame_height_m": 1.5}
ABOVE = Pinhole(np.array((0.0, 0.0, -30.0)), DOWN, 160.0, 320, 240)


def scene_of(elevation_deg: float, burns_s: float = 0.0) -> MeshScene:
    light: dict[str, Any] = {"azimuth_deg": 0.0, "elevation_deg": elevation_deg, "gain": 0.6}
    return MeshScene(world_of(fires=[FRONT | {"burns_s": burns_s}], light=light), NOWHERE)


def test_by_day_there_are_no_lamps() -> None:
    assert len(scene_of(firelight.DARK_DEG).lamps(ABOVE, 5.0)) == 0


def test_lamps_are_where_it_burns_and_go_out_with_it() -> None:
    scene = scene_of(1.0, burns_s=20.0)
    lamps = scene.lamps(ABOVE, 5.0)
    assert 0 < len(lamps) <= firelight.MOST
    assert (abs(lamps[:, 0]) <= 2.0).all() and (abs(lamps[:, 1]) <= 8.0).all() and (lamps[:, 2] < 0.0).all()
    assert len(scene.lamps(ABOVE, 25.0)) == 0


def test_the_ground_beside_a_fire_is_lit_at_night_and_less_so_further_off() -> None:
    """The same picture with the lamps taken away tells what they do: 5 px a metre, 120 px from the middle is 22 m."""
    scene = scene_of(0.0)
    renderer = scene.renderer(ABOVE.width, ABOVE.height, ABOVE.focal_px)
    lit = renderer.draw(ABOVE.position, DOWN, 5.0).astype(int)
    scene.lamps = lambda camera, time_s: firelight.NONE  # type: ignore[method-assign]
    dark = renderer.draw(ABOVE.position, DOWN, 5.0).astype(int)
    more = (lit - dark)[:, 150:170]
    red, blue = more[:, :, 2].mean(axis=1), more[:, :, 0].mean(axis=1)
    near, far = red[85:100].mean(), red[0:15].mean()
    assert near > far + 5.0 and far >= 0.0 and near > 2.0 * blue[85:100].mean()
