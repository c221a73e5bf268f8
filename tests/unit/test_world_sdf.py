"""Gazebo worlds: what stands is where Gazebo has it, all else is listed, and hostile XML is refused."""

import math
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sitl_emu.run import worlds
from sitl_emu.world import description
from sitl_emu.world.description import WorldDescription, WorldError
from sitl_emu.world.world import World
from tests.unit.test_cli import call

PLANE = """<model name="ground"><static>true</static><link name="link">
  <collision name="c"><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></collision>
  <visual name="v"><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
    <material><diffuse>0.2 0.3 0.1 1</diffuse></material></visual>
</link></model>"""


def sdf(folder: Path, body: str, name: str = "w.sdf") -> Path:
    path = folder / name
    path.write_text(f'<?xml version="1.0"?><sdf version="1.9"><world name="test">{body}</world></sdf>')
    return path


def model(geometry: str, pose: str = "0 0 0 0 0 0", name: str = "m", more: str = "") -> str:
    return (
        f'<model name="{name}"><static>true</static><pose>{pose}</pose><link name="link">{more}'
        f'<visual name="v"><geometry>{geometry}</geometry></visual></link></model>'
    )


def loaded(folder: Path, body: str) -> WorldDescription:
    return description.load(sdf(folder, PLANE + body))


def box(x: float, y: float, z: float) -> str:
    return f"<box><size>{x} {y} {z}</size></box>"


# --- where it stands --------------------------------------------------------------------------------------------------


def test_a_box_lies_with_its_x_to_the_east_and_stands_on_what_its_middle_says(tmp_path: Path) -> None:
    world = loaded(tmp_path, model(box(4, 2, 3), "10 20 1.5 0 0 0", "house_1"))
    (solid,) = world.solids
    assert (solid.north_m, solid.east_m, solid.above_ground_m, solid.heading_deg) == (20.0, 10.0, 0.0, 90.0)
    assert solid.box is not None and solid.box.size_m == (4.0, 2.0, 3.0)
    assert (solid.name, solid.label) == ("house_1::link::v", "house")
    assert world.ground.colour == (0.2, 0.3, 0.1) and world.not_read == ()


ANGLES = st.floats(-3.0, 3.0)
PLACES = st.floats(-50.0, 50.0)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(PLACES, PLACES, PLACES, ANGLES, ANGLES, ANGLES), st.tuples(PLACES, PLACES, PLACES, ANGLES, ANGLES, ANGLES)
)
def test_poses_are_those_of_nested_frames(tmp_path_factory: Any, outer: Any, inner: Any) -> None:
    """Against rotation matrices of trimesh: a corner of the box is where Gazebo's nesting puts it."""
    folder = tmp_path_factory.mktemp("sdf")
    told = [" ".join(f"{each:.9g}" for each in pose) for pose in (outer, inner)]
    link = (
        f'<link name="l"><pose>{told[1]}</pose><visual name="v"><geometry>{box(2, 1, 0.5)}</geometry></visual></link>'
    )
    body = f'<model name="m"><static>1</static><pose>{told[0]}</pose>{link}</model>'
    world = World(loaded(folder, body), folder)
    (solid,) = world.description.solids
    matrix = np.eye(4)
    for *place, roll, pitch, yaw in (outer, inner):
        matrix = matrix @ trimesh.transformations.compose_matrix(translate=place, angles=(roll, pitch, yaw))
    from sitl_emu.core.attitude import quaternion, rotated, rotation

    q = quaternion(*(math.radians(angle) for angle in (solid.roll_deg, solid.pitch_deg, solid.heading_deg)))
    for corner in ((1.0, 0.5, 0.25), (-1.0, 0.5, -0.25)):
        x, y, z, _ = matrix @ (*corner, 1.0)
        n, e, d = rotated(rotation(q), (corner[0], -corner[1], -corner[2]))
        up = solid.above_ground_m + 0.25
        assert (solid.north_m + n, solid.east_m + e, up - d) == pytest.approx((y, x, z), abs=1e-4)


def test_poses_relative_to_frames_and_to_one_another(tmp_path: Path) -> None:
    frames = '<frame name="f"><pose>0 0 5 0 0 0</pose></frame>'
    frames += '<frame name="g" attached_to="f"><pose>1 0 0 0 0 0</pose></frame>'
    body = frames + model(box(1, 1, 1)).replace("<pose>0 0 0", '<pose relative_to="g">0 2 0')
    (solid,) = loaded(tmp_path, body).solids
    assert (solid.north_m, solid.east_m, solid.above_ground_m) == (2.0, 1.0, 4.5)
    circle = '<frame name="a" attached_to="b"/><frame name="b" attached_to="a"/>'
    with pytest.raises(WorldError, match="hang on one another in a circle"):
        loaded(tmp_path, circle + model(box(1, 1, 1)).replace("<pose>", '<pose relative_to="a">'))
    lost = loaded(tmp_path, model(box(1, 1, 1)).replace("<pose>", '<pose relative_to="nobody">'))
    assert lost.not_read == ("model 'm': its pose is relative to 'nobody', which is not found",)


def test_shapes_that_are_hulls_reach_as_far_as_they_should(tmp_path: Path) -> None:
    for shape, low, high, aside in (
        ("<sphere><radius>1</radius></sphere>", -1.0, 1.0, 1.0),
        ("<capsule><radius>0.5</radius><length>2</length></capsule>", -1.5, 1.5, 0.5),
        ("<cone><radius>1</radius><length>3</length></cone>", -1.5, 1.5, 1.0),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", -3.0, 3.0, 2.0),
    ):
        (solid,) = loaded(tmp_path, model(shape, "0 0 4 0 0 0")).solids
        assert solid.hull is not None and solid.above_ground_m == 4.0
        points = np.array(solid.hull.points_m)
        assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((low, high))
        assert np.abs(points[:, :2]).max() == pytest.approx(aside)
    (post,) = loaded(
        tmp_path, model("<cylinder><radius>0.2</radius><length>3</length></cylinder>", "0 0 1.5 0 0 0")
    ).solids
    assert post.cylinder is not None and post.above_ground_m == 0.0


def test_rays_meet_what_was_read(tmp_path: Path) -> None:
    body = model(box(4, 2, 3), "10 0 1.5 0 0 0", "a") + model(
        "<sphere><radius>1</radius></sphere>", "0 10 1 0 0 0", "b"
    )
    world = worlds.build(str(sdf(tmp_path, PLANE + body)), 1, {})
    origins, down = np.array([(0.0, 10.0, -20.0), (10.0, 0.0, -20.0)]), np.array([(0.0, 0.0, 1.0)] * 2)
    hits = world.raycast(origins, down, 0.0, 50.0)
    assert hits.name == ["a::link::v", "b::link::v"]
    assert hits.range_m.tolist() == pytest.approx([17.0, 18.0], abs=0.02)


# --- files ------------------------------------------------------------------------------------------------------------


def test_meshes_and_included_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    house = tmp_path / "elsewhere" / "hut"
    (house / "meshes").mkdir(parents=True)
    wedge = trimesh.Trimesh([(0, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 3)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    wedge.export(house / "meshes" / "hut.stl")
    (house / "model.config").write_text(
        '<model><name>hut</name><sdf version="1.6">old.sdf</sdf><sdf version="1.9">new.sdf</sdf></model>'
    )
    mesh = "<mesh><uri>model://hut/meshes/hut.stl</uri><scale>2 2 2</scale></mesh>"
    (house / "new.sdf").write_text(f"<sdf version='1.9'>{model(mesh, '9 9 9 0 0 0', 'hut')}</sdf>")
    monkeypatch.setenv("GZ_SIM_RESOURCE_PATH", str(tmp_path / "elsewhere"))
    body = "<include><uri>model://hut</uri><name>first</name><pose>5 6 0 0 0 1.5707963268</pose></include>"
    (tmp_path / "worlds").mkdir()
    world = worlds.build(str(sdf(tmp_path / "worlds", PLANE + body)), 1, {})
    (solid,) = world.description.solids
    assert solid.mesh is not None and solid.mesh.scale == 2.0 and solid.name == "first::link::v"
    assert (solid.north_m, solid.east_m, solid.heading_deg) == (6.0, 5.0, 0.0)
    # Its x points north: the wedge is 4 m long to the north, 2 m wide to the west, 6 m high
    hits = world.raycast(np.array([(6.4, 4.9, -20.0)]), np.array([(0.0, 0.0, 1.0)]), 0.0, 50.0)
    assert hits.range_m[0] == pytest.approx(20.0 - 6.0 * (1.0 - 0.4 / 4.0 - 0.1 / 2.0), abs=0.01)
    kept = worlds.keep(world, tmp_path / "run")
    shutil.rmtree(house)
    (again,) = worlds.kept(str(kept)).description.solids
    assert again.mesh is not None and again.mesh.file.startswith("outside/") and again.name == solid.name


def test_gltf_stands_upright_and_looks_as_in_gazebo(tmp_path: Path) -> None:
    """The y of the file is up, and its x stays x."""
    trimesh.creation.box(extents=(4.0, 6.0, 2.0)).export(tmp_path / "block.glb")
    world = worlds.build(str(sdf(tmp_path, PLANE + model("<mesh><uri>block.glb</uri></mesh>", "0 0 3 0 0 0"))), 1, {})
    down = np.array([(0.0, 0.0, 1.0)] * 3)
    hits = world.raycast(np.array([(0.0, 1.9, -20.0), (0.9, 0.0, -20.0), (1.9, 0.0, -20.0)]), down, 0.0, 50.0)
    assert hits.range_m.tolist() == pytest.approx([14.0, 14.0, 20.0], abs=0.01)
    assert world.description.solids[0].mesh == description.Mesh("block.glb")


def test_a_heightmap_is_the_terrain(tmp_path: Path) -> None:
    heights = np.zeros((33, 33), np.uint16)
    heights[:16] = 65535  # the picture's upper half, which lies in the north
    cv2.imwrite(str(tmp_path / "hill.png"), heights)
    hill = "<heightmap><uri>hill.png</uri><size>64 64 8</size><pos>0 0 -1</pos></heightmap>"
    body = model(hill, name="land") + model(box(1, 1, 1), "0 20 7.5 0 0 0")
    world = worlds.build(str(sdf(tmp_path, body)), 1, {})
    assert world.ground(20.0, 0.0) == pytest.approx(7.0) and world.ground(-20.0, 0.0) == pytest.approx(-1.0)
    assert world.description.solids[0].above_ground_m == pytest.approx(0.0, abs=1e-6)
    assert world.description.not_read == ()


def test_what_a_visual_lacks_its_collision_gives(tmp_path: Path) -> None:
    collision = f'<collision name="c"><pose>0 0 1 0 0 0</pose><geometry>{box(2, 2, 2)}</geometry></collision>'
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    world = loaded(tmp_path, model("<mesh><uri>a.dae</uri></mesh>", more=collision))
    (solid,) = world.solids
    assert solid.name == "m::link::c (collision)" and solid.above_ground_m == 0.0
    assert world.not_read == (
        "visual m::link::v: mesh: a.dae: .dae is not read; make it .obj, .stl or .glb; "
        "its collision shape stands for it",
    )


# --- around it --------------------------------------------------------------------------------------------------------


def test_origin_sun_and_wind(tmp_path: Path) -> None:
    around = """<spherical_coordinates><latitude_deg>47.4</latitude_deg><longitude_deg>8.5</longitude_deg>
      <elevation>488</elevation><heading_deg>90</heading_deg></spherical_coordinates>
      <light type="directional" name="sun"><direction>-1 0 -1</direction></light>
      <light type="point" name="lamp"/><wind><linear_velocity>3 0 0</linear_velocity></wind>"""
    world = loaded(tmp_path, around + model(box(1, 1, 1), "10 0 0.5 0 0 0"))
    assert (world.origin.lat_deg, world.origin.lon_deg, world.origin.alt_amsl_m) == (47.4, 8.5, 488.0)
    # Turned by 90 degrees from north over east, x points south
    assert (world.solids[0].north_m, world.solids[0].east_m) == pytest.approx((-10.0, 0.0), abs=1e-6)
    assert (world.light.azimuth_deg % 360, world.light.elevation_deg) == pytest.approx((180.0, 45.0))
    assert (world.wind.north_m_s, world.wind.east_m_s) == pytest.approx((-3.0, 0.0), abs=1e-9)
    assert world.not_read == ("light 'lamp'",)


def test_all_else_is_listed(tmp_path: Path) -> None:
    body = """<physics type="ode"/><plugin name="p" filename="x"/><plugin name="p" filename="y"/><actor name="ann"/>
      <model name="car"><link name="l"/></model><include><uri>https://fuel.gazebosim.org/1.0/x</uri></include>
      <include><uri>model://nowhere</uri></include>
      <model name="box"><static>true</static><link name="l"><sensor name="eye"/></link></model>"""
    told = loaded(tmp_path, body).not_read
    assert {"physics", "plugin p (2 times)", "actor ann", "model 'car': moves (it is not static)"} <= set(told)
    assert "model 'box': sensor eye" in told
    assert any(text.startswith("https://fuel.gazebosim.org/1.0/x: nothing is fetched") for text in told)
    assert any(text.startswith("model://nowhere: not found in ") for text in told)
    bare = description.load(sdf(tmp_path, model(box(1, 1, 1))))
    assert bare.not_read == ("(there is no ground plane: the ground is level at height 0)",)


def test_one_line_of_a_world_file_loads_it_beside_things_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "gazebo").mkdir()
    trimesh.creation.box(extents=(1, 1, 1)).export(tmp_path / "gazebo" / "b.stl")
    sdf(tmp_path / "gazebo", PLANE + model("<mesh><uri>b.stl</uri></mesh>", "3 4 0.5 0 0 0"))
    own = "things: [{label: person, north_m: 1, east_m: 2, radius_m: 0.3, height_m: 1.8}]"
    (tmp_path / "own.yaml").write_text(f"name: own\nsdf: gazebo/w.sdf\n{own}\n")
    world = worlds.build(str(tmp_path / "own.yaml"), 1, {})
    (solid,) = world.description.solids
    assert world.description.name == "own" and len(world.description.things) == 1
    assert solid.mesh is not None and solid.mesh.file == "gazebo/b.stl"
    (tmp_path / "run").mkdir()
    kept = worlds.keep(world, tmp_path / "run")
    assert worlds.kept(str(kept)).description == world.description, "a run's folder keeps it without the SDF"
    (tmp_path / "own.yaml").write_text("name: own\nsdf: 7\n")
    with pytest.raises(WorldError, match="sdf = 7 must be the name of a file"):
        description.load(tmp_path / "own.yaml")


def test_preview_says_what_was_not_read(tmp_path: Path) -> None:
    path = sdf(tmp_path, PLANE + "<plugin name='p' filename='x'/>")
    status, said = call("world", "export", str(path), "--format", "geojson", "--out", str(tmp_path / "o"))
    assert status == 0 and "test: not read of the Gazebo world: plugin p" in said


# --- what is no SDF ---------------------------------------------------------------------------------------------------

BOMB = """<?xml version="1.0"?><!DOCTYPE sdf [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<sdf version="1.9"><world name="&b;"/></sdf>"""
THIEF = """<!DOCTYPE sdf [<!ENTITY f SYSTEM "file:///etc/passwd">]><sdf version="1.9"><world name="&f;"/></sdf>"""


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (BOMB, "declares a DTD, which may hold entities"),
        (THIEF, "declares a DTD, which may hold entities"),
        ("<sdf><world>", "not XML: "),
        ("\x00", "not XML: "),
        ("<robot name='x'/>", "not SDF: its root is <robot>, not <sdf>"),
        ("<sdf version='1.9'/>", "there is neither a <world> nor a <model> in it"),
        (f"<sdf><world name='w'>{model(box(1, 1, 1), '1 2')}</world></sdf>", "pose: '1 2' must be 6 numbers"),
        (f"<sdf><world name='w'>{model(box(1, 1, 1), '1 2 nan 0 0 0')}</world></sdf>", "must be 6 numbers"),
        (f"<sdf><world name='w'>{model(box(0, 1, 1))}</world></sdf>", "is out of range"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path: Path, text: str, wanted: str) -> None:
    path = tmp_path / "bad.sdf"
    path.write_text(text)
    with pytest.raises(WorldError) as error:
        description.load(path)
    assert wanted in str(error.value) and "\n" not in str(error.value) and "bad.sdf" in str(error.value)


def test_models_that_include_themselves_end(tmp_path: Path) -> None:
    (tmp_path / "loop").mkdir()
    inner = "<include><uri>model://loop</uri></include>"
    (tmp_path / "loop" / "model.sdf").write_text(f"<sdf><model name='loop'><static>1</static>{inner}</model></sdf>")
    assert any("within one another" in text for text in loaded(tmp_path, inner).not_read)


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=80), st.integers(0, 900))
@example(b" ", 167)  # a number less in a plane's normal
def test_bytes_changed_at_will_are_read_or_refused(tmp_path_factory: Any, junk: bytes, place: int) -> None:
    path = sdf(tmp_path_factory.mktemp("fuzz"), PLANE + model(box(1, 2, 3), "1 2 3 0 0 1"))
    data = path.read_bytes()
    path.write_bytes(data[:place] + junk + data[place + len(junk) :])
    try:
        description.load(path)
    except WorldError as error:
        assert "w.sdf" in str(error)
