"""`sitl-emu world export`: COCO, YOLO and GeoJSON as their readers take them, and what they say against the world."""

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.run import export, views
from sitl_emu.run.trouble import Trouble
from sitl_emu.world import polygons
from sitl_emu.world.description import read, save
from sitl_emu.world.labels import coco, geojson, outline, yolo
from sitl_emu.world.lens import Intrinsics
from sitl_emu.world.render.truth import Seen
from sitl_emu.world.world import World
from tests.unit.test_cli import call
from tests.unit.test_world_kinds import made

YARD: dict[str, Any] = {
    "name": "yard",
    "area_m": [[-20, -20], [-20, 20], [20, 20], [20, -20]],
    "solids": [
        {"name": "shed", "north_m": 4, "east_m": -4, "heading_deg": 30, "label": "shed", "box": {"size_m": [4, 6, 3]}},
        {"name": "silo", "north_m": -8, "east_m": 8, "label": "silo", "cylinder": {"radius_m": 2, "height_m": 5}},
    ],
    "things": [
        {"label": "person", "name": "ann", "north_m": 2, "east_m": 3, "radius_m": 0.3, "height_m": 1.8, "target": True},
        {"label": "car", "name": "car", "north_m": -3, "east_m": -5, "radius_m": 2.2, "height_m": 1.5},
        {"label": "weed", "name": "patch", "north_m": 10, "east_m": 10, "radius_m": 1.5, "harmonics": [[0.2, 1.0]]},
    ],
    "water": [{"name": "pond", "polygon_m": [[-14, -14], [-14, -8], [-8, -8], [-8, -14]], "level_m": 0.5}],
    "fires": [{"name": "bin", "polygon_m": [[12, -12], [12, -10], [14, -10]], "flame_height_m": 1.0}],
}


def yard(folder: Path) -> Path:
    path = folder / "yard.yaml"
    save(read(YARD, "yard"), path)
    return path


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    out = folder / "out"
    status, said = call("world", "export", str(yard(folder)), "--survey", "12", "--size", "320x240", "--out", str(out))
    assert status == 0 and "yard: 9 pictures, coco, geojson, yolo are in" in said
    return out


# --- masks ------------------------------------------------------------------------------------------------------------

MASKS = st.integers(1, 9).flatmap(
    lambda width: st.lists(st.lists(st.booleans(), min_size=width, max_size=width), min_size=1, max_size=9)
)


def within(polygon: list[float], x: np.ndarray[Any, Any], y: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return polygons.inside(list(zip(polygon[::2], polygon[1::2], strict=True)), x, y)


@settings(deadline=None)
@given(MASKS)
def test_polygons_hold_the_middles_of_a_masks_pixels_and_of_its_holes_alone(rows: list[list[bool]]) -> None:
    mask = np.array(rows)
    made = outline.polygons(mask)
    y, x = np.mgrid[0 : mask.shape[0], 0 : mask.shape[1]] + 0.5
    filled = np.zeros(mask.shape, np.uint8)
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(filled, contours, -1, 1, -1)
    covered = np.zeros(mask.shape, bool)
    for polygon in made:
        assert len(polygon) >= 8 and len(polygon) % 2 == 0
        covered |= within(polygon, x, y)
    assert np.array_equal(covered, filled > 0)


@given(MASKS)
def test_run_lengths_give_the_mask_back(rows: list[list[bool]]) -> None:
    mask = np.array(rows)
    told = outline.run_lengths(mask)
    counts = told["counts"]
    values = np.arange(len(counts)) % 2 == 1  # off first, as COCO counts
    again = np.repeat(values, counts).reshape(told["size"], order="F")
    assert sum(counts) == mask.size and np.array_equal(again, mask)


# --- COCO and YOLO ----------------------------------------------------------------------------------------------------


def seen(label: str, ignored: bool = False) -> Seen:
    return Seen(label, label, (16.0, 12.0, 48.0, 24.0), None, 300, 0.0, False, ignored)


def test_yolo_lines_are_shares_of_the_picture_without_what_is_ignored() -> None:
    text = yolo.text([seen("fire"), seen("water", ignored=True)], ("water", "rubble", "fire"), 64, 48)
    assert text == "2 0.500000 0.375000 0.500000 0.250000\n"


def test_coco_has_polygons_for_what_counts_and_run_lengths_for_what_does_not() -> None:
    table = coco.table(("a", "b"))
    image = coco.add_image(table, "x.jpg", 64, 48)
    mask = np.zeros((48, 64), bool)
    mask[12:24, 16:48] = True
    coco.add(table, image, seen("b"), mask)
    coco.add(table, image, seen("a", ignored=True), mask)
    counts, ignored = table["annotations"]
    assert (counts["bbox"], counts["category_id"], counts["iscrowd"]) == ([16.0, 12.0, 32.0, 12.0], 2, 0)
    assert sorted(zip(*[iter(counts["segmentation"][0])] * 2, strict=True)) == [(16, 12), (16, 24), (48, 12), (48, 24)]
    assert ignored["iscrowd"] == 1 and ignored["segmentation"]["size"] == [48, 64]


def picture_of(path: Path) -> np.ndarray[Any, Any]:
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert read is not None
    return np.asarray(read)


def test_the_table_is_cocos_and_agrees_with_the_masks(exported: Path) -> None:
    table = json.loads((exported / "annotations.json").read_text())
    names = {each["id"]: each["name"] for each in table["categories"]}
    assert sorted(names.values()) == ["car", "fire", "person", "shed", "silo", "water", "weed"]
    images = {each["id"]: each for each in table["images"]}
    assert len(images) == 9 and len({each["id"] for each in table["annotations"]}) == len(table["annotations"])
    masks = {}
    for number, image in images.items():
        picture = picture_of(exported / "images" / image["file_name"])
        assert picture.shape == (image["height"], image["width"], 3) == (240, 320, 3)
        masks[number] = picture_of(exported / "masks" / f"{Path(image['file_name']).stem}.png")
    for each in table["annotations"]:
        own = masks[each["image_id"]] == each["instance"]
        assert own.sum() == each["area"] > 0 and 0.0 <= each["hidden"] <= 1.0
        x, y, width, height = each["bbox"]
        assert own[int(y) : int(y + height), int(x) : int(x + width)].sum() == each["area"]
        assert (own.any(axis=0).sum() <= width) and own.any(axis=1).sum() <= height
    assert {names[each["category_id"]] for each in table["annotations"]} == set(names.values())


def test_yolo_says_the_same_as_coco(exported: Path) -> None:
    table = json.loads((exported / "annotations.json").read_text())
    data = yaml.safe_load((exported / "data.yaml").read_text())
    assert data["train"] == "images" and list(data["names"].values()) == [each["name"] for each in table["categories"]]
    for image in table["images"]:
        lines = (exported / "labels" / f"{Path(image['file_name']).stem}.txt").read_text().splitlines()
        wanted = [each for each in table["annotations"] if each["image_id"] == image["id"] and not each["iscrowd"]]
        assert len(lines) == len(wanted)
        for line, each in zip(lines, wanted, strict=True):
            label, *shares = (float(word) for word in line.split())
            x, y, width, height = each["bbox"]
            assert label == each["category_id"] - 1
            assert np.allclose(
                shares, [(x + width / 2) / 320, (y + height / 2) / 240, width / 320, height / 240], atol=1e-6
            )


def test_depth_is_metres_times_256(exported: Path) -> None:
    nearest = []
    table = json.loads((exported / "annotations.json").read_text())
    for silo in (each for each in table["annotations"] if each["name"] == "silo"):
        name = f"{silo['image_id'] - 1:06d}.png"
        depth, mask = picture_of(exported / "depth" / name), picture_of(exported / "masks" / name)
        assert depth.dtype == np.uint16
        nearest.append(depth[mask == silo["instance"]].min() / 256)
    assert min(nearest) == pytest.approx(12.0 - 5.0, abs=0.01), "its top, from 12 m"


def test_of_the_labels_those_that_are_asked_for_in_that_order() -> None:
    described = read(YARD, "yard")
    assert export.labels_of(described, ("water", "car")) == ("water", "car")
    with pytest.raises(Trouble, match="--label boat: yard has no such label; it has person, car, weed, shed"):
        export.labels_of(described, ("boat",))


# --- GeoJSON ----------------------------------------------------------------------------------------------------------


def signed_area(ring: list[list[float]]) -> float:
    """Of longitude and latitude: positive against the clock."""
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise(ring)) / 2.0


@pytest.mark.parametrize("kind", ["urban_flood", "debris_field", "wildfire_perimeter", "corn_field"])
def test_geojson_is_what_the_rfc_asks_for(kind: str) -> None:
    world = made(kind)
    told = json.loads(json.dumps(geojson.collection(world, 20.0)))
    assert told["type"] == "FeatureCollection"
    lat0, lon0 = world.description.origin.lat_deg, world.description.origin.lon_deg
    for feature in told["features"]:
        assert feature["type"] == "Feature" and isinstance(feature["properties"]["what"], str)
        geometry = feature["geometry"]
        rings = [[geometry["coordinates"]]] if geometry["type"] == "Point" else geometry["coordinates"]
        for number, ring in enumerate(rings):
            for lon, lat in ring:
                assert abs(lon - lon0) < 0.02 and abs(lat - lat0) < 0.02
            if geometry["type"] == "Polygon":
                assert len(ring) >= 4 and ring[0] == ring[-1]
                assert (signed_area(ring) > 0.0) == (number == 0), "outer rings against the clock, holes with it"
    counts = {what: sum(each["properties"]["what"] == what for each in told["features"]) for what in ("solid", "thing")}
    assert counts == {"solid": len(world.description.solids), "thing": len(world.description.things)}


def test_what_is_told_lies_where_it_stands() -> None:
    world = World(read(YARD, "yard"), Path())
    told = {each["properties"].get("name"): each for each in geojson.collection(world, 0.0)["features"]}
    maps = MapProjection(world.description.origin.lat_deg, world.description.origin.lon_deg)

    def corners(name: str) -> list[tuple[float, float]]:
        return [maps.project(lat, lon) for lon, lat in told[name]["geometry"]["coordinates"][0]]

    silo = corners("silo")
    assert all(math.hypot(n + 8.0, e - 8.0) == pytest.approx(2.0, abs=0.003) for n, e in silo)
    amsl = world.description.origin.alt_amsl_m
    assert told["silo"]["properties"]["high_amsl_m"] == pytest.approx(amsl + 5.0)
    assert told["silo"]["properties"]["low_amsl_m"] == pytest.approx(amsl)
    shed = corners("shed")
    s, c = math.sin(math.radians(30)), math.cos(math.radians(30))
    assert any(math.hypot(n - (4 + 2 * c - 3 * s), e - (-4 + 2 * s + 3 * c)) < 0.003 for n, e in shed)
    assert told["ann"]["properties"]["target"] is True


# --- views ------------------------------------------------------------------------------------------------------------


def test_a_survey_covers_the_area_and_overlaps(tmp_path: Path) -> None:
    world = World(read(YARD, "yard"), Path())
    lens = Intrinsics(320, 240, 90.0)
    looks = views.survey(world, 10.0, 0.3, lens)
    wide, high = 20.0, 15.0
    for n in np.linspace(-19.9, 19.9, 23):
        for e in np.linspace(-19.9, 19.9, 23):
            assert any(abs(look.north_m - n) <= high / 2 and abs(look.east_m - e) <= wide / 2 for look in looks)
    lines = sorted({look.east_m for look in looks})
    assert all(b - a <= 0.7 * wide + 1e-9 for a, b in pairwise(lines))
    with pytest.raises(Trouble, match=r"--survey 1: .* 20000 are allowed: go higher"):
        views.survey(world, 1.0, 0.94, Intrinsics(64, 48, 20.0))


def test_a_table_of_views_and_what_is_wrong_with_one(tmp_path: Path) -> None:
    world, path = World(read(YARD, "yard"), Path()), tmp_path / "views.csv"
    path.write_text("north_m,east_m,above_m,heading_deg,depression_deg\n1,2,3,90,0\n")
    (view,) = views.read(path, world, 7.0)
    assert view.place_ned_m.tolist() == [1.0, 2.0, -3.0] and view.time_s == 7.0
    assert np.allclose(view.camera_to_ned[:, 2], (0.0, 1.0, 0.0)), "it looks east"
    for text, wanted in (
        ("north_m,east_m\n1,2\n", "has no column 'above_m'"),
        ("north_m,east_m,above_m,heading_deg,depression_deg\n1,2,x,0,0\n", "line 2: must be numbers"),
        ("north_m,east_m,above_m,heading_deg,depression_deg\n1,2,nan,0,0\n", "line 2: must be numbers"),
        ("north_m,east_m,above_m,heading_deg,depression_deg\n1,2,-3,0,0\n", "above_m must be above 0"),
        ("north_m,east_m,above_m,heading_deg,depression_deg\n", "there are no views in it"),
    ):
        path.write_text(text)
        with pytest.raises(Trouble, match=wanted):
            views.read(path, world, 0.0)


def test_of_a_run_what_its_camera_saw(tmp_path: Path) -> None:
    from sitl_emu.missions.companion import calibration
    from sitl_emu.missions.companion.camera_model import CameraModel, Distortion, Mount

    yard(tmp_path).rename(tmp_path / "world.yaml")
    camera = CameraModel(320, 240, 160.0, 160.0, 159.5, 119.5, Distortion(0.0, 0.0, 0.0, 0.0, 0.0))
    calibration.write(tmp_path / "uas-camera.yaml", camera, Mount(0.0, 0.0, 0.15, 90.0, False))
    rows = [f"{0.02 * k:.2f},{k},0,-12,0,0,0,1,0,0,0" for k in range(110)]
    (tmp_path / "truth-uas.csv").write_text("\n".join(
        ["time_s,north_m,east_m,down_m,vn_m_s,ve_m_s,vd_m_s,qw,qx,qy,qz", *rows, ""]))  # fmt: skip
    flown = views.of_run(tmp_path, None, 1.0)
    assert [view.time_s for view in flown.views] == [0.0, 1.0, 2.0] and flown.lens.focal_px == pytest.approx(160.0)
    assert flown.views[1].place_ned_m.tolist() == pytest.approx([50.0, 0.0, -11.85])
    status, said = call(
        "world", "export", str(tmp_path), "--every", "2", "--label", "person", "--out", str(tmp_path / "o")
    )
    assert status == 0 and "yard: 2 pictures" in said and "uas's camera" in said
    table = json.loads((tmp_path / "o" / "annotations.json").read_text())
    assert [each["name"] for each in table["annotations"]] == ["ann"]
    with pytest.raises(Trouble, match=r"--vehicle ugv: .* has no camera of it; it has those of uas"):
        views.of_run(tmp_path, "ugv", 1.0)


BARREL = {
    "name": "barrel",
    "label": "barrel",
    "north_m": 0,
    "east_m": 10,
    "mass_kg": 20,
    "cylinder": {"radius_m": 0.3, "height_m": 0.9},
}
LOOSE = """time_s,name,north_m,east_m,down_m,qw,qx,qy,qz
0.10,barrel,0.000,10.000,-0.450,1.00000,0.00000,0.00000,0.00000
5.00,barrel,-15.000,15.000,-0.450,1.00000,0.00000,0.00000,0.00000
6.00,parcel of uas,15.000,15.000,-0.150,1.00000,0.00000,0.00000,0.00000
7.00,crate,0.000,0.000,-0.150,1.00000,0.00000,0.00000,0.00000
"""


def run_with_loose_bodies(folder: Path) -> Path:
    """A barrel has drifted, and a responder has let its parcel go."""
    save(read({**YARD, "loose": [BARREL]}, "yard"), folder / "world.yaml")
    uas = {"name": "uas", "model": "responder", "parcel": {}}
    (folder / "scenario.yaml").write_text(yaml.safe_dump({"name": "x", "world": "world.yaml", "vehicles": [uas]}))
    (folder / "loose.csv").write_text(LOOSE)
    (folder / "views.csv").write_text(
        "north_m,east_m,above_m,heading_deg,depression_deg,time_s\n"
        + "".join(
            f"{n},{e},10,0,90,{t}\n" for n, e, t in ((-15, 15, 9), (15, 15, 9), (0, 10, 0), (-15, 15, 0), (15, 15, 0))
        )
    )
    return folder


def test_of_a_run_what_is_loose_is_where_it_was_then(tmp_path: Path) -> None:
    """Whatever the order of the views."""
    folder, out = run_with_loose_bodies(tmp_path), tmp_path / "o"
    views_of_it = ("--views", str(folder / "views.csv"), "--label", "barrel", "--label", "parcel")
    status, said = call("world", "export", str(folder), *views_of_it, "--size", "160x120", "--out", str(out))
    assert status == 0 and "left out, as neither world.yaml nor scenario.yaml says what it is: crate" in said
    table = json.loads((out / "annotations.json").read_text())
    files = {each["id"]: each["file_name"] for each in table["images"]}
    found = {(files[each["image_id"]], each["name"]): each["bbox"] for each in table["annotations"]}
    assert sorted(found) == [("000000.jpg", "barrel"), ("000001.jpg", "parcel of uas"), ("000002.jpg", "barrel")]
    for x, y, width, height in found.values():
        assert (x + width / 2, y + height / 2) == pytest.approx((80, 60), abs=1.0), "straight below the camera"


@pytest.mark.parametrize(
    ("at_s", "there"), [(0, {"barrel": (0, 10)}), (9, {"barrel": (-15, 15), "parcel of uas": (15, 15)})]
)
def test_the_geojson_of_a_run_has_what_was_loose_then(tmp_path: Path, at_s: int, there: dict[str, Any]) -> None:
    folder, out = run_with_loose_bodies(tmp_path), tmp_path / "o"
    status, _ = call(
        "world", "export", str(folder), "--survey", "20", "--format", "geojson", "--at", str(at_s), "--out", str(out)
    )
    told = [each for each in json.loads((out / "truth.geojson").read_text())["features"]
            if each["properties"]["what"] == "loose"]  # fmt: skip
    origin = read(YARD, "yard").origin
    maps = MapProjection(origin.lat_deg, origin.lon_deg)
    assert status == 0 and {each["properties"]["name"] for each in told} == set(there)
    for each in told:
        lon, lat = each["geometry"]["coordinates"]
        assert maps.project(lat, lon) == pytest.approx(there[each["properties"]["name"]], abs=0.01)


def test_a_broken_table_of_loose_bodies_is_one_line(tmp_path: Path) -> None:
    folder = run_with_loose_bodies(tmp_path)
    (folder / "loose.csv").write_text(LOOSE + "8.00,barrel,1\n")
    status, said = call("world", "export", str(folder), "--out", str(tmp_path / "o"))
    assert status == 2 and "loose.csv: line 6: must be time_s,name,north_m" in said


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (("moon",), "there is no world 'moon'"),
        (("flat", "--format", "voc"), "--format voc: give one of coco, yolo, geojson"),
        (("flat", "--survey", "10", "--views", "a.csv"), "--survey and --views: give one of them"),
        (("flat", "--views", "nowhere.csv"), "nowhere.csv: can't be read: No such file or directory"),
        (("flat", "--size", "640"), "--size 640: give WIDTHxHEIGHT"),
        (("flat", "--survey", "nan"), "--survey nan: give a finite number"),
        (("flat", "--survey", "10", "--overlap", "nan"), "--overlap nan: give a finite number"),
        (("flat", "--hfov", "nan"), "--hfov nan: give a finite number"),
        (("flat", "--every", "inf"), "--every inf: give a finite number"),
        (("flat", "--at", "inf"), "--at inf: give a finite number"),
        (("flat", "--option", "size_m"), "--option size_m: write NAME=VALUE"),
        (("flat", "--option", "on=2026-13-45"), "--option on=2026-13-45: write NAME=VALUE"),
        (("tests",), "tests: no folder of a run: there is no world.yaml in it"),
    ],
)
def test_wrong_input_is_one_line(arguments: tuple[str, ...], wanted: str) -> None:
    status, said = call("world", "export", *arguments)
    assert status == 2 and wanted in said


def test_geojson_alone_draws_nothing(tmp_path: Path) -> None:
    status, _ = call("world", "export", str(yard(tmp_path)), "--format", "geojson", "--out", str(tmp_path / "o"))
    assert status == 0
    assert {path.name for path in (tmp_path / "o").iterdir()} == {"truth.geojson", "world.yaml"}
