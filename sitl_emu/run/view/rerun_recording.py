"""`sitl-emu rerun`: a run's folder as a recording for the Rerun viewer (rerun.io), on the time line `simulated`.

=========================================== ==========================================================================
world/ground, world/truth                   the terrain with its picture; what truly stands there
world/VEHICLE                               pose, by its true track (10 Hz), in the world's north, east, down
world/VEHICLE/camera, …/camera/found        frames as the run has kept them, behind a pinhole; boxes of detections
world/VEHICLE/depth, world/VEHICLE/lidar    depth images and point clouds
world/tracks/VEHICLE, world/routes/VEHICLE  where it went; its mission, from when the autopilot had accepted it
world/finds                                 events that name a place and have a picture
plots/QUANTITY/VEHICLE                      altitude, speed and climb by the true track, battery by telemetry
events/VEHICLE                              events, modes, STATUSTEXT and PX4's events
=========================================== ==========================================================================

A camera on a gimbal stands apart (`cameras/VEHICLE`), as the folder does not tell where it looked; lens distortion is
left out, as Rerun knows none. rerun-sdk (MIT or Apache-2) is an optional extra: it takes 600 MB with what it needs.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.missions.companion.camera_model import Mount, camera_pose
from sitl_emu.run import ground_picture, kept_frames, worlds
from sitl_emu.run.configs import CameraDescription
from sitl_emu.run.scenario_parts.vehicle import VehiclePart
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.view.reading import KeptFrame, Looked, OfVehicle, RunReader, camera_of
from sitl_emu.run.view.telemetry import Route, State, Text
from sitl_emu.world.lens import Intrinsics
from sitl_emu.world.world import World

TIME = "simulated"
FILE = "run.rrd"
COLOURS = ((21, 101, 192), (142, 36, 170), (0, 121, 107), (194, 24, 91), (184, 92, 0))
"""Of vehicles, as on the page."""
QUANTITIES = ("altitude_m", "speed_m_s", "climb_m_s", "battery_percent", "battery_v")
GROUND_CELLS = 64
"""Across the terrain's mesh."""
LEVELS = {"emergency": "CRITICAL", "alert": "CRITICAL", "critical": "CRITICAL", "error": "ERROR", "warning": "WARN"}


def record(folder: Path, out: Path | None) -> Path:
    """Write the recording of a run; its file. Raises Trouble."""
    reader = RunReader(folder)
    try:
        import rerun as rr
    except ImportError:
        raise Trouble("rerun: it needs the Rerun SDK: pip install rerun-sdk (or this package with [rerun])") from None
    path = folder / FILE if out is None else out
    try:
        path.open("wb").close()
    except OSError as error:
        raise Trouble(f"{path}: {error.strerror}; name another file with --out") from None
    given, reading = reader.scenario, reader.read()
    stream = rr.RecordingStream("sitl-emu", recording_id=f"{given.name}-seed-{given.seed}")
    stream.save(path, default_blueprint=_blueprint(rr, given.vehicles))
    recorder = Recorder(rr, stream, reader)
    recorder.world()
    for place, vehicle in enumerate(given.vehicles):
        recorder.vehicle(vehicle, reading.vehicles[vehicle.name], COLOURS[place % len(COLOURS)])
    recorder.events(reading.events)
    stream.flush()
    stream.disconnect()
    return path


class Recorder:
    """Logs the parts of a run into a stream. `rr` is the rerun module, which only this command loads."""

    def __init__(self, rr: Any, stream: Any, reader: RunReader) -> None:
        self._rr, self._stream, self._folder = rr, stream, reader.folder
        origin = reader.world.origin
        self._origin_alt_m = origin.alt_amsl_m
        self._project = MapProjection(origin.lat_deg, origin.lon_deg).project
        try:
            self._world: World | None = worlds.kept(str(reader.folder / worlds.KEPT_AS))
        except worlds.WorldError:
            self._world = None
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)

    def world(self) -> None:
        """What stands: axes, ground, truth at the start."""
        rr, world = self._rr, self._world
        self._stream.log("world", rr.ViewCoordinates.FRD, static=True)
        if world is None:
            return
        if len(world.description.area_m):
            self._stream.log("world/ground", self._ground(world), static=True)
        things = world.truth(0.0).get("objects", [])
        if things:
            places = [self._on_ground(thing["north_m"], thing["east_m"]) for thing in things]
            radii = [max(0.2, thing["radius_m"]) for thing in things]
            labels = [thing["kind"] for thing in things]
            points = rr.Points3D(places, radii=radii, labels=labels, show_labels=False)
            self._stream.log("world/truth", points, static=True)

    def vehicle(self, part: VehiclePart, told: OfVehicle, colour: tuple[int, int, int]) -> None:
        """Everything of one vehicle."""
        rr, name = self._rr, rr_path(part.name)
        if told.truth:
            times = [row.time_s for row in told.truth]
            places = np.array([row.position_m for row in told.truth])
            turned = np.array([(*row.q[1:], row.q[0]) for row in told.truth])
            self._columns(f"world/{name}", times, rr.Transform3D.columns(translation=places, quaternion=turned))
            body = rr.Arrows3D(vectors=[[1.5, 0.0, 0.0]], radii=0.12, colors=[colour], labels=[part.name])
            self._stream.log(f"world/{name}/body", body, static=True)
            self._stream.log(f"world/tracks/{name}", rr.LineStrips3D([places], colors=[colour]), static=True)
            velocity = np.array([row.velocity_m_s for row in told.truth])
            self._plot(name, "altitude_m", times, -places[:, 2])
            self._plot(name, "speed_m_s", times, np.hypot(velocity[:, 0], velocity[:, 1]))
            self._plot(name, "climb_m_s", times, -velocity[:, 2])
        self._telemetry(part.name, told, colour)
        self._frames(part, told)

    def events(self, events: Sequence[Mapping[str, Any]]) -> None:
        """As events.jsonl has them: texts, and places of those that name one."""
        rr, finds = self._rr, list[tuple[float, tuple[float, float, float], str]]()
        for event in events:
            text = f"{event['event']}: {event['text']}" if event.get("text") else event["event"]
            self._text(event["vehicle"], event["time_s"], text, "INFO")
            if "picture" in event and "lat_deg" in event and "lon_deg" in event:
                place = self._on_ground(*self._project(event["lat_deg"], event["lon_deg"]))
                finds.append((event["time_s"], place, str(event.get("label", event["event"]))))
        for count, (time_s, _, _) in enumerate(finds, 1):
            self._stream.set_time(TIME, duration=time_s)
            places, labels = [find[1] for find in finds[:count]], [find[2] for find in finds[:count]]
            self._stream.log("world/finds", rr.Points3D(places, labels=labels, radii=0.5, colors=[[213, 0, 0]]))

    def _telemetry(self, vehicle: str, told: OfVehicle, colour: tuple[int, int, int]) -> None:
        rr, name = self._rr, rr_path(vehicle)
        states = [one for one in told.told if isinstance(one, State)]
        for field in ("battery_percent", "battery_v"):
            rows = [(one.time_s, one.fields[field]) for one in states if one.fields.get(field) is not None]
            if rows:
                self._plot(name, field, [time_s for time_s, _ in rows], np.array([value for _, value in rows]))
        for one in told.told:
            if isinstance(one, Text):
                self._text(vehicle, one.time_s, one.text, LEVELS.get(one.severity, "INFO"))
            elif isinstance(one, Route):
                home_m = -told.truth[0].position_m[2] if told.truth else 0.0
                strip = [self._waypoint(point, home_m) for point in one.waypoints]
                self._stream.set_time(TIME, duration=one.time_s)
                self._stream.log(f"world/routes/{name}", rr.LineStrips3D([strip] if strip else [], colors=[colour]))
            elif isinstance(one, State) and "mode" in one.fields:
                self._text(vehicle, one.time_s, f"mode {one.fields['mode']}", "INFO")

    def _waypoint(self, point: Any, home_m: float) -> tuple[float, float, float]:
        north_m, east_m = self._project(point.lat_deg, point.lon_deg)
        up_m = home_m + point.alt_m if point.is_relative else point.alt_m - self._origin_alt_m
        return north_m, east_m, -up_m

    def _frames(self, part: VehiclePart, told: OfVehicle) -> None:
        by_feed: dict[str, list[KeptFrame]] = {"camera": [], "depth": [], "lidar": []}
        for frame in told.frames:
            by_feed[frame.feed].append(frame)
        rr, name = self._rr, rr_path(part.name)
        if (camera := camera_of(part)) is not None and by_feed["camera"]:
            at = camera_path(part)
            shown = self._stand(at, camera, kept_frames.WIDTH_PX)
            for frame in by_feed["camera"]:
                self._at(frame, at, rr.EncodedImage(contents=frame.path.read_bytes(), media_type="image/jpeg"))
            self._boxes(f"{at}/found", by_feed["camera"], told.looked, shown)
        if (depth := part.depth_description) is not None and by_feed["depth"]:
            at = f"world/{name}/depth"
            self._stand(at, depth.camera, depth.camera.width_px)
            for frame in by_feed["depth"]:
                picture = frame.path.read_bytes()
                self._at(frame, at, rr.EncodedDepthImage(picture, media_type="image/png", meter=1000.0))
        for frame in by_feed["lidar"]:
            self._at(frame, f"world/{name}/lidar", rr.Points3D(np.load(frame.path, allow_pickle=False), radii=0.05))

    def _stand(self, at: str, camera: CameraDescription, widest_px: int) -> float:
        """Where a camera is aboard, and its pinhole; kept pixels per pixel of the whole picture."""
        rr, scale = self._rr, min(1.0, widest_px / camera.width_px)
        focal_px = Intrinsics(camera.width_px, camera.height_px, camera.hfov_deg).focal_px * scale
        size = round(camera.width_px * scale), round(camera.height_px * scale)
        pinhole = rr.Pinhole(focal_length=focal_px, width=size[0], height=size[1], camera_xyz=rr.ViewCoordinates.RDF)
        self._stream.log(at, pinhole, static=True)
        if not camera.on_gimbal:
            aboard = camera_pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), Mount(*camera.place_m, camera.depression_deg))
            stands = rr.Transform3D(translation=aboard.position_m, mat3x3=aboard.to_ned)
            self._stream.log(at, stands, static=True)
        return scale

    def _boxes(self, at: str, frames: Iterable[KeptFrame], looked: Sequence[Looked], scale: float) -> None:
        found = {round(one.time_s, 3): one.found for one in looked}
        for frame in frames:
            boxes = found.get(round(frame.time_s, 3), [])
            numbers = np.array([[float(each) for each in box[2:6]] for box in boxes]).reshape(-1, 4) * scale
            labels = [f"{label} {score:.2f}" for label, score, *_ in boxes]
            drawn = self._rr.Boxes2D(centers=numbers[:, :2], sizes=numbers[:, 2:], labels=labels)
            self._at(frame, at, drawn)

    def _ground(self, world: World) -> Any:
        """The terrain over the area as a mesh, with its picture where there is one."""
        north, east = (np.array(side) for side in zip(*world.description.area_m, strict=True))
        cells = np.linspace(0.0, 1.0, GROUND_CELLS + 1)
        n, e = (low + cells * (high - low) for low, high in ((north.min(), north.max()), (east.min(), east.max())))
        places = [(a, b, -world.ground(float(a), float(b))) for a in n for b in e]
        texture = [(b, 1.0 - a) for a in cells for b in cells]
        row = GROUND_CELLS + 1
        corner = (np.arange(GROUND_CELLS)[:, None] * row + np.arange(GROUND_CELLS)).ravel()
        triangles = np.concatenate(
            [np.stack((corner, corner + 1, corner + row), 1), np.stack((corner + 1, corner + row + 1, corner + row), 1)]
        )
        kept = self._folder / ground_picture.FILE
        picture = cv2.imread(str(kept)) if kept.is_file() else None
        albedo = cv2.cvtColor(picture, cv2.COLOR_BGR2RGB) if picture is not None else None
        colour = None if albedo is not None else [150, 150, 130]
        return self._rr.Mesh3D(
            vertex_positions=places,
            triangle_indices=triangles,
            vertex_texcoords=texture,
            albedo_texture=albedo,
            albedo_factor=colour,
        )

    def _on_ground(self, north_m: float, east_m: float) -> tuple[float, float, float]:
        return north_m, east_m, -self._world.ground(north_m, east_m) if self._world is not None else 0.0

    def _columns(self, at: str, times: Sequence[float], columns: Any) -> None:
        self._stream.send_columns(at, indexes=[self._rr.TimeColumn(TIME, duration=times)], columns=columns)

    def _plot(self, vehicle: str, name: str, times: Sequence[float], values: Any) -> None:
        self._columns(f"plots/{name}/{vehicle}", times, self._rr.Scalars.columns(scalars=values))

    def _at(self, frame: KeptFrame, at: str, what: Any) -> None:
        self._stream.set_time(TIME, duration=frame.time_s)
        self._stream.log(at, what)

    def _text(self, vehicle: str, time_s: float, text: str, level: str) -> None:
        self._stream.set_time(TIME, duration=time_s)
        self._stream.log(f"events/{rr_path(vehicle)}", self._rr.TextLog(text, level=level))


def camera_path(part: VehiclePart) -> str:
    """Where a vehicle's camera stands among the entities: aboard, or apart if a gimbal carries it."""
    camera, name = camera_of(part), rr_path(part.name)
    return f"cameras/{name}" if camera is not None and camera.on_gimbal else f"world/{name}/camera"


def rr_path(name: str) -> str:
    """A vehicle's name as a part of an entity's path: what has a meaning there is escaped."""
    return "".join(letter if letter.isalnum() or letter in "_-" else f"\\{letter}" for letter in name)


def _blueprint(rr: Any, vehicles: Sequence[VehiclePart]) -> Any:
    """How the viewer lays it out at first."""
    import rerun.blueprint as rrb

    cameras = [
        rrb.Spatial2DView(origin=camera_path(each), name=each.name) for each in vehicles if camera_of(each) is not None
    ]
    plots = [rrb.TimeSeriesView(origin=f"plots/{quantity}", name=quantity) for quantity in QUANTITIES]
    below = [rrb.Tabs(*plots), rrb.TextLogView(origin="events", name="events")]
    above = [rrb.Spatial3DView(origin="world", name="world"), *([rrb.Vertical(*cameras)] if cameras else [])]
    return rrb.Blueprint(rrb.Vertical(rrb.Horizontal(*above), rrb.Horizontal(*below), row_shares=[2, 1]))
