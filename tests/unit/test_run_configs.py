"""What crosses the border to a process of a run is a typed record there again."""

import json

import pytest

from sitl_emu.core.radio import Outage, RadioSettings
from sitl_emu.run import configs
from sitl_emu.vehicles import VehicleError

PLACE = configs.StartPlace(north_m=1.0, east_m=2.0, heading_deg=90.0)
IRIS = configs.ModelData(model="iris")
CAMERA = configs.FeedData(feed="camera", fd=7, rate_hz=15.0, latency_s=0.1)
UAS = configs.VehicleData(
    name="uas", model=IRIS, instance=0, lockstep=True, start="home", autopilot_fd=5, companion_fd=6, feeds=(CAMERA,)
)
UGV = configs.VehicleData(
    name="ugv",
    model=configs.ModelData(model="rover", sensors={"gps": {"rate_hz": 5}}),
    instance=1,
    lockstep=False,
    start=PLACE,
    autopilot_fd=8,
)
WORLD = configs.WorldConfig(
    folder="/tmp/run",
    start_us=1,
    seed=2,
    world="/tmp/run/world.yaml",
    vehicles=(UAS, UGV),
    radio=RadioSettings(loss=0.1, outages=(Outage(1.0, 2.0),), shared=True, obstructed_range_m=40.0),
    speed=None,
    time_limit_s=60.0,
    commands=("ugv",),
)


def test_a_record_comes_out_as_it_went_in() -> None:
    assert configs.read(configs.WorldConfig, configs.written(WORLD)) == WORLD
    ours = configs.AutopilotConfig(
        folder="f", start_us=1, seed=2, name="uas", model=IRIS, instance=0, lockstep=True, gcs=("10.0.0.1", 14551)
    )
    assert configs.read(configs.AutopilotConfig, configs.written(ours)) == ours


def test_a_vehicle_names_the_sockets_that_the_world_inherits() -> None:
    assert UAS.fds == [5, 6, 7] and UGV.fds == [8]


def test_what_is_no_such_record_is_refused() -> None:
    table = json.loads(configs.written(WORLD))
    with pytest.raises(VehicleError, match="WorldConfig: unknown field 'sped'"):
        configs.read(configs.WorldConfig, json.dumps(table | {"sped": 1}))
    with pytest.raises(VehicleError, match="WorldConfig: seed = 'two' must be a whole number"):
        configs.read(configs.WorldConfig, json.dumps(table | {"seed": "two"}))
