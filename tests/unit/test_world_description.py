"""World files: what they hold comes back, what is wrong in them is told, and all that a world is asked follows."""

import json
import math
import shutil
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.run import worlds
from sitl_emu.vehicles.description import Body, Sphere
from sitl_emu.world import kinds
from sitl_emu.world.description import WorldError, load, plain, read, save
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.kinds.corn_field import field as corn_field
from sitl_emu.world.kinds.corn_field.kind import description_of, field_of
from sitl_emu.world.moving import place_at
from sitl_emu.world.rays import GROUND
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.terrain import HeightMap
from sitl_emu.world.world import World

YARD = """
name: yard
origin: {lat_deg: 40.0, lon_deg: -87.0, alt_amsl_m: 200}
places: {home: {north_m: 0, east_m: 0}, gate: {north_m: -5, east_m: 3, heading_deg: 90}}
area_m: [[-10, -10], [-10, 40], [40, 40], [40, -10]]
solids:
  - {name: house, north_m: 20, east_m: 10, heading_deg: 30, box: {size_m: [8, 12, 5]}}
  - {name: silo, north_m: 5, east_m: 25, cylinder: {radius_m: 2, height_m: 9}}
  - name: ramp
    north_m: 30
    east_m: 30
    hull: {points_m: [[0, 0, 0], [6, 0, 0], [6, 4, 0], [0, 4, 0], [6, 0, 2], [6, 4, 2]]}
things:
  - {label: weed, north_m: 3, east_m: 4, radius_m: 0.8, target: true}
  - {label: person, north_m: 0, east_m: 8, radius_m: 0.3, height_m: 1.8, repeats: true,
     path: [{at_s: 0, north_m: 0, east_m: 8}, {at_s: 4, north_m: 4, east_m: 8}, {at_s: 8, north_m: 0, east_m: 8}]}
loose:
  - {name: barrel, north_m: 8, east_m: 0, mass_kg: 18, cylinder: {radius_m: 0.3, height_m: 0.9}}
water:
  - {name: pond, polygon_m: [[-9, -9], [-9, -4], [-4, -6]], level_m: 0.4, current_north_m_s: 0.5}
fires:
  - {name: blaze, polygon_m: [[30, -8], [34, -8], [34, -2], [30, -2]], spread_m_s: 0.5, burns_s: 20, smoke: {}}
cover:
  - {name: wood, kind: canopy, polygon_m: [[0, 30], [12, 30], [12, 38], [0, 38]], height_m: 9, base_m: 3}
ground: {use: grass, land: [{use: asphalt, polygon_m: [[-10, 12], [40, 12], [40, 16], [-10, 16]]}]}
wind: {north_m_s: 4, east_m_s: -3, profile_exponent: 0.143, changes: [{at_s: 10, north_m_s: 0, east_m_s: 0}]}
"""
DOWN = np.array([(0.0, 0.0, 1.0)])


@pytest.fixture
def yard(tmp_path: Path) -> World:
    (tmp_path / "yard.yaml").write_text(YARD)
    return World(load(tmp_path / "yard.yaml"), tmp_path)


def top_at(world: World, north_m: float, east_m: float, time_s: float = 0.0) -> tuple[str, float]:
    """What a ray from above meets first, and how high that is, to a millimetre."""
    hits = world.raycast(np.array([(north_m, east_m, -50.0)]), DOWN, time_s, 100.0)
    return hits.name[0], round(50.0 - float(hits.range_m[0]), 3)


def test_what_is_kept_is_what_was_read(tmp_path: Path, yard: World) -> None:
    save(yard.description, tmp_path / "again.yaml")
    assert load(tmp_path / "again.yaml") == yard.description


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (("name: yard", "nam: yard"), "unknown field 'nam' = 'yard'; allowed are: format, name, kind"),
        (("name: yard\n", ""), "the field 'name' is missing"),
        (("lat_deg: 40.0", "lat_deg: 95"), "origin: lat_deg = 95 is out of range; allowed is -89 to 89"),
        (("size_m: [8, 12, 5]", "size_m: [8, 12]"), "solids[0]: box: size_m = [8, 12] must have 3 elements"),
        ((", cylinder: {radius_m: 2, height_m: 9}", ""), "solids[1] 'silo': give one of box, cylinder, hull, mesh"),
        (("at_s: 8,", "at_s: 3,"), "things[1].path: at_s must grow from waypoint to waypoint"),
        (("{north_m: 0, east_m: 0}, gate", "zero, gate"), "places.home = 'zero' must be a table"),
        (("name: silo", "name: house"), "solids[1]: name = 'house': another has this name"),
        (("name: silo", "name: ground"), "solids[1]: name = 'ground': another has this name"),
        (("name: yard", "name: ["), "not YAML"),
        (("name: yard", "name: 2026-13-45"), "not YAML: month must be in 1..12"),
        (("mass_kg: 18, ", ""), "loose[0]: the field 'mass_kg' is missing"),
        (
            (", cylinder: {radius_m: 0.3, height_m: 0.9}", ""),
            "loose[0] 'barrel': give one of box, cylinder, hull, mesh",
        ),
        (("name: pond", "name: barrel"), "water[0]: name = 'barrel': another has this name"),
        (("[-9, -4], [-4, -6]]", "[-9, -4]]"), "water[0].polygon_m: give three corners or more, whose sides do not"),
        (
            ("[34, -8], [34, -2]", "[34, -2], [34, -8]"),
            "fires[0].polygon_m: give three corners or more, whose sides do",
        ),
        (("[34, -8], [34, -2]", "[34, -8], [31, -4]"), "fires[0].polygon_m: must be convex where a fire spreads"),
        (("smoke: {}", "smoke: {density: 1}"), "fires[0]: smoke: unknown field 'density' = 1; allowed are: height_m"),
        (("kind: canopy", "kind: wood"), "cover[0]: kind = 'wood'; allowed are: grass, crop, canopy"),
        (("base_m: 3", "base_m: 10"), "cover[0]: base_m = 10 must be below height_m"),
        ((", [6, 0, 2], [6, 4, 2]]", "]"), "solids[2] 'ramp': hull.points_m: give four points or more, not all in one"),
        (
            (", [6, 4, 0], [0, 4, 0], [6, 0, 2], [6, 4, 2]]", "]"),
            "solids[2] 'ramp': hull.points_m: give four points or",
        ),
        (
            ("[[0, 0, 0], [6, 0, 0], [6, 4, 0], [0, 4, 0], [6, 0, 2], [6, 4, 2]]", "[]"),
            "hull.points_m: give four points",
        ),
        (("[-10, 40], [40, 40], [40, -10]]", "[-10, .inf], [4, 4]]"), "area_m[1][1] = inf is out of range; allowed is"),
        (("[-10, 40], [40, 40], [40, -10]]", "[-10, 40]]"), "area_m: give three corners or more, which are not all in"),
        (("[[-10, -10], [-10, 40], [40, 40], [40, -10]]", "[[1, 1]]"), "area_m: give three corners or more, which are"),
        (("[-10, 40], [40, 40], [40, -10]]", "[0, 0], [9, 9]]"), "area_m: give three corners or more, which are not"),
        (("name: yard", "name: yard\nterrain: {file: ../hills.npy}"), "terrain.file = '../hills.npy': must lie in the"),
        (("name: yard", "name: yard\nterrain: {file: /tmp/h.npy}"), "terrain.file = '/tmp/h.npy': must lie in the"),
        (
            ("use: grass", "orthophoto: a/../../a.png"),
            "ground.orthophoto = 'a/../../a.png': must lie in the world file",
        ),
        (("box: {size_m: [8, 12, 5]}", "mesh: {file: ../a.obj}"), "solids[0].mesh.file = '../a.obj': must lie in the"),
        (("use: asphalt", "use: tar"), "ground: land[0]: use = 'tar'; allowed are: grass, soil, asphalt"),
        (("{use: grass", "{use: lava"), "ground: use = 'lava'; allowed are: grass, soil, asphalt"),
        (("[-10, 40], [40, 40], [40, -10]]", "[40, 40], [-10, 40], [40, -10]]"), "area_m: its sides cross; give its"),
        (("[-10, 40], [40, 40], [40, -10]]", "[40, 40], [-10, 40], [42, -12]]"), "area_m: its sides cross; give its"),
        (("name: yard", "name: yard\nname: garden"), "line 3: 'name' stands in line 2 already; give it once"),
        (("name: yard", "name: " + 50_000 * "{a: "), "line 2: nested too deeply; at most 100 mappings"),
        (("mass_kg: 18", "mass_kg: 1e6"), "mass_kg = '1e6' must be a number; to YAML this is a text: write it as 1.0e"),
    ],
)
def test_what_is_wrong_names_file_field_value_and_what_is_allowed(
    tmp_path: Path, change: tuple[str, str], text: str
) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(YARD.replace(*change))
    with pytest.raises(WorldError) as told:
        load(path)
    assert str(told.value).startswith(str(path)) and text in str(told.value) and "\n" not in str(told.value)


def test_rays_meet_ground_solids_and_who_walks(yard: World) -> None:
    assert top_at(yard, -5.0, -5.0) == (GROUND, 0.0)
    assert top_at(yard, 20.0, 10.0) == ("house", 5.0)
    assert top_at(yard, 5.0, 26.9) == ("silo", 9.0)
    assert top_at(yard, 33.0, 32.0) == ("ramp", 1.001), "Bullet gives a hull a skin of a millimetre"
    assert top_at(yard, 2.0, 8.0, 2.0) == ("person", 1.8)
    assert top_at(yard, 2.0, 8.0, 4.0)[0] == GROUND
    assert top_at(yard, 2.0, 8.0, 14.0)[0] == "person", "it walks on and on"
    level = yard.raycast(np.array([(20.0, -30.0, -2.0)]), np.array([(0.0, 1.0, 0.0)]), 0.0, 100.0)
    assert level.name == ["house"] and level.normal[0] @ (0.0, 1.0, 0.0) < -0.8
    nothing = yard.raycast(np.array([(0.0, 0.0, -2.0)]), np.array([(0.0, 0.0, -1.0)]), 0.0, 100.0)
    assert math.isinf(nothing.range_m[0]) and nothing.name == [""]


def test_the_truth_follows_the_time(yard: World) -> None:
    assert [thing["kind"] for thing in yard.truth(0.0)["objects"]] == ["weed", "person"]
    assert yard.truth(2.0)["objects"][1] == {
        "kind": "person", "north_m": 2.0, "east_m": 8.0, "radius_m": 0.3, "target": False,
    }  # fmt: skip
    assert yard.truth(0.0)["outline"][2] == [40, 40]


def test_wind_grows_with_height_and_changes(yard: World) -> None:
    assert yard.wind.at(0, 10.0) == pytest.approx((4.0, -3.0, 0.0))
    assert yard.wind.at(0, 80.0)[0] == pytest.approx(4.0 * 8.0**0.143)
    assert yard.wind.at(5_000_000, 10.0) == pytest.approx((2.0, -1.5, 0.0), abs=0.02)
    assert yard.wind.at(20_000_000, 10.0) == (0.0, 0.0, 0.0)


@given(st.floats(0.0, 40.0))
def test_who_repeats_a_path_is_where_it_was_a_round_before(time_s: float) -> None:
    thing = read({"name": "x", "things": [{
        "label": "a", "north_m": 0, "east_m": 0, "radius_m": 1, "repeats": True,
        "path": [{"at_s": 0, "north_m": 0, "east_m": 0}, {"at_s": 5, "north_m": 7, "east_m": -3}],
    }]}, "x").things[0]  # fmt: skip
    assert place_at(thing, time_s) == pytest.approx(place_at(thing, time_s + 5.0), abs=1e-6)


@given(st.integers(0, 2**31), st.sampled_from([(60.0, 60.0), (80.0, 100.0)]))
def test_a_corn_field_comes_back_whole_from_its_description(seed: int, size_m: tuple[float, float]) -> None:
    built = corn_field.build(seed, size_m, targets=2, distractors=3)
    described = read(plain(description_of(built)), "x")
    assert field_of(World(described, Path(), built.terrain)) == built


def test_a_kept_world_has_what_its_meshes_read(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "run").mkdir()
    for name, data in trimesh.creation.box((2.0, 3.0, 4.0)).export(file_type="gltf").items():
        (tmp_path / "parts" / name).write_bytes(data)
    (tmp_path / "w.yaml").write_text(
        "name: w\nplaces: {home: {north_m: 0, east_m: 0}}\n"
        "solids: [{name: box, north_m: 5, east_m: 0, mesh: {file: parts/model.gltf}}]\n"
    )
    kept = worlds.keep(worlds.build(str(tmp_path / "w.yaml"), 1, {}), tmp_path / "run")
    shutil.rmtree(tmp_path / "parts")
    again = worlds.kept(str(kept))
    assert again.solids is not None and list(again.solids.names.values()) == ["box"]


@pytest.mark.parametrize("terrain", ["", "terrain: {file: h.npy}\n"])
def test_a_photo_that_is_none_is_told_before_a_run(tmp_path: Path, terrain: str) -> None:
    np.save(tmp_path / "h.npy", np.zeros((9, 9)))
    (tmp_path / "w.yaml").write_text(f"name: w\n{terrain}ground: {{orthophoto: photo.png}}\n")
    with pytest.raises(worlds.WorldError, match=r"ground.orthophoto: .*photo.png: there is no such file"):
        worlds.build(str(tmp_path / "w.yaml"), 1, {})
    (tmp_path / "photo.png").write_bytes(b"no picture")
    with pytest.raises(worlds.WorldError, match=r"ground.orthophoto: .*photo.png: can't be read as a picture"):
        worlds.build(str(tmp_path / "w.yaml"), 1, {})
    cv2.imwrite(str(tmp_path / "photo.png"), np.zeros((4, 4, 3), np.uint8))
    worlds.keep(worlds.build(str(tmp_path / "w.yaml"), 1, {}), tmp_path / "run")
    assert (tmp_path / "run" / "photo.png").read_bytes() == (tmp_path / "photo.png").read_bytes()


def test_a_mesh_whose_picture_lies_elsewhere_is_refused(tmp_path: Path) -> None:
    """The buffers trimesh itself refuses."""
    folder = tmp_path / "worlds"
    (folder / "parts").mkdir(parents=True)
    files = trimesh.creation.box((2.0, 3.0, 4.0)).export(file_type="gltf")
    for name, data in files.items():
        (folder / "parts" / name).write_bytes(data)
    for place in (folder, tmp_path):
        (place / "brick.png").write_bytes(b"")
    mesh = {"name": "box", "north_m": 5, "east_m": 0, "mesh": {"file": "parts/model.gltf"}}
    (folder / "w.yaml").write_text(json.dumps({"name": "w", "solids": [mesh]}))
    gltf = json.loads(files["model.gltf"])
    (folder / "parts" / "model.gltf").write_text(json.dumps(gltf | {"images": [{"uri": "../brick.png"}]}))
    worlds.keep(worlds.build(str(folder / "w.yaml"), 1, {}), tmp_path / "run")
    assert (tmp_path / "run" / "brick.png").is_file(), "below the world file's folder, if not beside the mesh"
    (folder / "parts" / "model.gltf").write_text(json.dumps(gltf | {"images": [{"uri": "../../brick.png"}]}))
    with pytest.raises(
        worlds.WorldError, match=r"model.gltf: uri = '../brick.png': must lie in the world file's folder"
    ):
        worlds.build(str(folder / "w.yaml"), 1, {})


def test_what_a_folder_has_of_another_world_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "terrain.npy").write_bytes(b"another's")
    world = worlds.build("debris_field", 2, {"rubble": 1, "ruins": 1, "persons": 0})
    assert worlds.kept(str(worlds.keep(world, tmp_path))).ground(31.7, 12.3) == world.ground(31.7, 12.3)


def test_a_generated_world_is_kept_with_its_terrain(tmp_path: Path) -> None:
    world = worlds.build("corn_field", 5, {"size_m": [60, 70]})
    again = worlds.kept(str(worlds.keep(world, tmp_path)))
    assert again.description == world.description
    for place in ((0.0, 0.0), (31.7, 12.3), (-20.0, 90.0)):
        assert again.ground(*place) == world.ground(*place)
    photos = again.photo(), world.photo()
    assert photos[0] is not None and photos[1] is not None and np.array_equal(photos[0], photos[1])


def test_kinds_are_the_packages_that_there_are() -> None:
    assert kinds.names() == ["corn_field", "debris_field", "flat", "urban_flood", "wildfire_perimeter"]
    assert isinstance(worlds.build("flat", 1, {}).terrain, FlatGround)


# --- files --------------------------------------------------------------------------------------------------------


def with_terrain(folder: Path, **terrain: object) -> World:
    return World(
        read({"name": "x", "origin": {"lat_deg": 46.5, "lon_deg": 8.0, "alt_amsl_m": 1000}, "terrain": terrain}, "x"),
        folder,
    )


def test_heights_from_a_picture_lie_as_on_a_map(tmp_path: Path) -> None:
    picture = np.zeros((3, 4), np.uint16)
    picture[0, 3] = 65535  # the north-east corner
    cv2.imwrite(str(tmp_path / "h.png"), picture)
    world = with_terrain(tmp_path, file="h.png", north0_m=-10, east0_m=-20, spacing_m=10, low_m=2, high_m=12)
    assert world.ground(10.0, 10.0) == pytest.approx(12.0) and world.ground(-10.0, -20.0) == pytest.approx(2.0)
    assert world.ground(10.0, 5.0) == pytest.approx(7.0)
    hit = world.raycast(np.array([(10.0, 5.0, -100.0)]), DOWN, 0.0, 200.0)
    assert 100.0 - hit.range_m[0] == pytest.approx(7.0, abs=1e-3)
    assert hit.normal[0, 1] < -0.4, "it rises to the east"


def geotiff(path: Path, heights: np.ndarray, lat_deg: float, lon_deg: float, step_deg: float, model: int = 2) -> None:
    """North up, its corner at a place; 42113 is GDAL's no-data value."""
    keys = (1, 1, 0, 2, 1024, 0, 1, model, 1025, 0, 1, 1)
    tifffile.imwrite(
        path, heights.astype(np.float32),
        extratags=[
            (33550, "d", 3, (step_deg, step_deg, 0.0)), (33922, "d", 6, (0.0, 0.0, 0.0, lon_deg, lat_deg, 0.0)),
            (34735, "H", len(keys), keys), (42113, "s", 0, "-9999"),
        ],
    )  # fmt: skip


def test_heights_from_a_geotiff_keep_their_place_datum_and_gaps(tmp_path: Path) -> None:
    step, rows, columns = 1e-4, 40, 50
    lat = 46.502 - (np.arange(rows) + 0.5) * step
    lon = 7.998 + (np.arange(columns) + 0.5) * step
    heights = 1000.0 + 2e3 * (lat[:, None] - 46.5) + 1e3 * (lon[None] - 8.0)
    heights[:3, :3] = -9999.0
    geotiff(tmp_path / "h.tif", heights, 46.502, 7.998, step)
    world = with_terrain(tmp_path, file="h.tif", spacing_m=5.0, no_data_m=-7.0)
    projection = MapProjection(46.5, 8.0)
    for where in ((46.5, 8.0), (46.5005, 8.0011), (46.4995, 7.9993)):
        expected = 2e3 * (where[0] - 46.5) + 1e3 * (where[1] - 8.0)
        assert world.ground(*projection.project(*where)) == pytest.approx(expected, abs=0.02)
    assert world.ground(*projection.project(46.50193, 7.99807)) == pytest.approx(-7.0)
    other = with_terrain(tmp_path, file="h.tif", spacing_m=5.0, datum="ellipsoid", geoid_m=50.0)
    assert other.ground(0.0, 0.0) == pytest.approx(-50.0, abs=0.02)


def test_a_steep_geotiff_is_no_staircase_whatever_opencv(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenCV 4's remap takes a place to the nearest 32nd of a pixel: here half a metre up or down; 5's is exact."""
    remap = cv2.remap

    def to_32nds(picture: np.ndarray, x: np.ndarray, y: np.ndarray, *how: int, **more: int) -> np.ndarray:
        x, y = (np.round(each * 32.0).astype(np.float32) / np.float32(32.0) for each in (x, y))
        return np.asarray(remap(picture, x, y, *how, **more))

    monkeypatch.setattr(cv2, "remap", to_32nds)
    step, rows, columns = 3e-4, 12, 14
    heights = 1000.0 - 30.0 * np.arange(rows)[:, None] + 20.0 * np.arange(columns)[None]
    geotiff(tmp_path / "h.tif", heights, 46.502, 7.998, step)
    terrain = with_terrain(tmp_path, file="h.tif", spacing_m=5.0).terrain
    assert isinstance(terrain, HeightMap)
    projection = MapProjection(46.5, 8.0)
    for row, column in np.ndindex(terrain.grid_m.shape):
        lat, lon = projection.reproject(terrain.north0_m + 5.0 * row, terrain.east0_m + 5.0 * column)
        expected = -30.0 * ((46.502 - lat) / step - 0.5) + 20.0 * ((lon - 7.998) / step - 0.5)
        assert terrain.grid_m[row, column] == pytest.approx(expected, abs=1e-4)


def test_a_geotiff_in_metres_says_what_to_do(tmp_path: Path) -> None:
    geotiff(tmp_path / "utm.tif", np.zeros((5, 5)), 46.5, 8.0, 1e-4, model=1)
    with pytest.raises(WorldError, match="gdalwarp -t_srs EPSG:4326"):
        with_terrain(tmp_path, file="utm.tif")


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [("h.xyz", b"", "must be one of .npy, .png"), ("h.png", b"no picture", "must be a grey picture"),
     ("h.tif", struct.pack("<4s", b"II*\0"), "can't be read"),
     ("h.npy", b"no heights", "h.npy: can't be read: broken, or no .npy file of heights")],
)  # fmt: skip
def test_a_broken_file_is_told(tmp_path: Path, name: str, content: bytes, text: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(WorldError) as told:
        with_terrain(tmp_path, file=name)
    assert text in str(told.value) and "\n" not in str(told.value)


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply", ".glb"])
def test_a_mesh_stands_where_it_should(tmp_path: Path, suffix: str) -> None:
    """A tower 10 m high whose top is 2 m to the front and 1 m to the left of its foot."""
    tower = trimesh.creation.box((4.0, 4.0, 10.0))
    tower.apply_translation((0.0, 0.0, 5.0))
    cap = trimesh.creation.box((1.0, 1.0, 1.0))
    cap.apply_translation((2.0, 1.0, 10.5))
    both = trimesh.util.concatenate([tower, cap])
    if suffix == ".glb":  # x to the left, y up, z forward
        both.vertices = both.vertices[:, [1, 2, 0]]
    both.export(tmp_path / f"tower{suffix}")
    solid = {"name": "tower", "north_m": 100, "east_m": 50, "heading_deg": 90, "mesh": {"file": f"tower{suffix}"}}
    world = World(read({"name": "x", "solids": [solid]}, "x"), tmp_path)
    assert top_at(world, 100.0, 50.0) == ("tower", 10.0)
    assert top_at(world, 101.0, 52.0) == ("tower", 11.0), "front is east, left is north"
    assert top_at(world, 99.0, 52.3)[0] == GROUND


def test_a_scene_without_a_painter_shows_what_stands_there(yard: World) -> None:
    photo = yard.photo()
    assert photo is not None and photo.shape == (250, 250, 3)
    house, grass, weed = photo[100, 100], photo[245, 20], photo[184, 70]
    assert int(house[2]) > 110 and int(grass[1]) > int(grass[2]) and int(weed[0]) > int(weed[1]) + 40


def test_a_patch_that_moves_is_drawn_where_it_is_then() -> None:
    """A mat that is dragged along: it lies flat, and so only its outline on the ground tells."""
    mat = {
        "label": "mat", "north_m": 0, "east_m": 0, "radius_m": 1.0,
        "path": [{"at_s": 0, "north_m": 0, "east_m": 0}, {"at_s": 10, "north_m": 0, "east_m": 10}],
    }  # fmt: skip
    scene = MeshScene(World(read({"name": "x", "things": [mat]}, "x"), Path()), Path())
    renderer, looking_down = scene.renderer(64, 64, 32.0), np.array(((0.0, -1, 0), (1, 0, 0), (0, 0, 1)))
    for time_s, east_m in ((0.0, 0.0), (5.0, 5.0)):
        picture = renderer.draw(np.array((0.0, east_m, -8.0)), looking_down, time_s)
        assert int(picture[32, 32, 2]) > 2 * int(picture[32, 32, 1]), "red in the middle"
    assert int(renderer.draw(np.array((0.0, 0.0, -8.0)), looking_down, 5.0)[32, 32, 1]) > 60, "it has gone from here"


def test_a_world_tells_what_a_body_touches(yard: World) -> None:
    assert yard.solids is not None
    body = yard.solids.add_body(Body((Sphere((0.0, 0.0, 0.0), 0.5),), 1.0))
    (contact,) = yard.contacts(body, (5.0, 22.6, -3.0), (1.0, 0.0, 0.0, 0.0), 0.0)
    assert contact.other == "silo" and contact.normal[1] == pytest.approx(-1.0, abs=0.02)
    assert contact.depth_m == pytest.approx(0.1, abs=0.02)
    assert yard.contacts(body, (5.0, 22.4, -3.0), (1.0, 0.0, 0.0, 0.0), 0.0) == []
