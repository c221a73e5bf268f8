"""MAVSDK follow_me: its settings are PX4's parameters."""

import pytest
from mavsdk.plugins.follow_me import Config, FollowMe

from tests.interop.mavsdk_vehicle import Vehicle

BEHIND = 180.0
CONFIG = Config(12.0, 6.0, 0.2, Config.FollowAltitudeMode.CONSTANT, 6.0, BEHIND)


def test_the_settings_are_px4s_parameters(vehicle: Vehicle) -> None:
    plugin = FollowMe(vehicle.system)
    before = plugin.get_config()
    plugin.set_config(CONFIG)
    for name, value in (("FLW_TGT_HT", 12.0), ("FLW_TGT_DST", 6.0), ("FLW_TGT_FA", BEHIND), ("FLW_TGT_RS", 0.2)):
        assert vehicle.param.get_param_float(name) == pytest.approx(value)
    plugin.set_config(before)
    assert not plugin.is_active()
