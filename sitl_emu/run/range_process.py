"""The process of a depth camera or a scanning lidar in a run: told a time and a pose, it writes into shared memory.

What is measured is a pure function of world, seed, time and pose, so it does not matter when it is worked out.
"""

import os

from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingError, RingWriter
from sitl_emu.run import cameras, worlds
from sitl_emu.run.configs import DepthDescription, LidarDescription, RangeConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.kept_frames import KeptFrames, depth_file, points_file
from sitl_emu.run.memory import settle
from sitl_emu.run.messages import ObstaclesSeen, Ready, Render, Rendered
from sitl_emu.run.process import StartError, main
from sitl_emu.world.description import WorldError
from sitl_emu.world.lens import Mount
from sitl_emu.world.ranging import DepthCamera, Noise, Rays, Scan, ScanningLidar

YIELDING = 5
"""Niceness, as a camera's."""


def made(world: Rays, config: RangeConfig) -> tuple[DepthCamera | ScanningLidar, Format]:
    """The sensor that is described, and what its feed carries."""
    if config.depth is not None:
        return _depth_camera(world, config.depth, Noise(config.depth.noise_m, config.seed, f"{config.name} depth"))
    assert config.lidar is not None, "one of the two is described"
    return _scanning_lidar(world, config.lidar, Noise(config.lidar.noise_m, config.seed, f"{config.name} lidar"))


def _depth_camera(world: Rays, depth: DepthDescription, noise: Noise) -> tuple[DepthCamera, Format]:
    camera = DepthCamera(world, cameras.intrinsics(depth.camera), cameras.mount(depth.camera), depth.reach_m, noise)
    return camera, Format(Kind.DEPTH, Encoding.M32, depth.camera.height_px, depth.camera.width_px)


def _scanning_lidar(world: Rays, lidar: LidarDescription, noise: Noise) -> tuple[ScanningLidar, Format]:
    scan = Scan(lidar.columns, lidar.rows, *lidar.elevation_deg, *lidar.range_m)
    sensor = ScanningLidar(world, scan, Mount(*lidar.place_m, lidar.depression_deg), noise)
    return sensor, Format(Kind.POINTS, Encoding.XYZ32, lidar.columns * lidar.rows)


def _kept(config: RangeConfig) -> KeptFrames:
    if config.depth is not None:
        return KeptFrames(config, "depth", depth_file)
    return KeptFrames(config, "lidar", points_file)


def run(config: RangeConfig, control: ControlChannel) -> None:
    """Measure what is asked for until the run ends."""
    os.nice(YIELDING)
    try:
        world = worlds.kept(config.world)
        sensor, what = made(world, config)
        ring = RingWriter(config.ring.name, what, config.ring.slots)
        kept = _kept(config)
    except (worlds.WorldError, WorldError, RingError) as error:
        raise StartError(str(error)) from None
    try:
        settle()
        control.send(Ready())
        while isinstance(asked := control.receive(), Render):
            worlds.put_loose(world, asked.loose)
            world.put_vehicles(worlds.placed(asked.others))
            measured = sensor.measure(asked.pose, asked.time_us, asked.head)
            ring.write(asked.time_us, measured)
            seen = sensor.obstacles(measured, asked.pose, asked.head) if config.tells_obstacles else None
            control.send(Rendered(asked.index, ObstaclesSeen._make(seen) if seen is not None else None))
            if asked.keep:
                kept.keep(asked.time_us, measured)
    finally:
        ring.close()


if __name__ == "__main__":
    main(run, RangeConfig)
