"""Pictures changed for training, the data set's tables and splits; with PyTorch also assignment, loss and learning."""

import dataclasses
import json
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pytest

from sitl_emu.missions.companion.camera_model import NADIR, CameraModel
from sitl_emu.missions.companion.yolo import decoded, middles
from sitl_emu.world.camera import Pose
from sitl_emu.world.kinds.corn_field import field as corn
from sitl_emu.world.render.truth import Seen
from tools.detector import areas, augment, data, dataset, disaster, field, variation
from tools.detector.data import Split
from tools.detector.plan import SPLITS, Plan

STILL = augment.Strength(0.0, 0.0, 0.0, (1.0, 1.0), 0.0, 0.0, 0.0, (1.0, 1.0), 0.0)
ROWS = np.array([[1, 20, 10, 60, 40, 1]], np.float32)


def marked() -> augment.Sample:
    """A white box on black."""
    image = np.zeros((96, 128, 3), np.uint8)
    image[10:40, 20:60] = 255
    return augment.Sample(image, ROWS.copy())


def test_without_strength_nothing_changes() -> None:
    image, rows, _ = augment.sample(lambda _: marked(), 0, 1, STILL, np.random.default_rng(1))
    assert np.array_equal(image, marked()[0]) and np.allclose(rows, ROWS, atol=1e-4)


@pytest.mark.parametrize("seed", range(12))
def test_boxes_go_with_the_pictures(seed: int) -> None:
    how = STILL._replace(flip=0.5, rotation_deg=15.0, scale=(0.8, 1.2), shift=0.02)
    rng = np.random.default_rng(seed)
    image, rows, _ = augment.sample(lambda _: marked(), 0, 1, how, rng)
    white = image[:, :, 0] > 200
    ys, xs = np.flatnonzero(white.any(axis=1)), np.flatnonzero(white.any(axis=0))
    # The ellipse's box lies within that of the turned corners, and not far
    assert np.allclose(rows[0, 1:5], (xs[0], ys[0], xs[-1] + 1, ys[-1] + 1), atol=9.0)


@pytest.mark.parametrize("mosaic", [0.0, 1.0])
def test_a_region_that_is_turned_or_cut_has_the_box_of_what_is_still_to_be_seen(mosaic: float) -> None:
    """A white line from corner to corner, whose own box says little about a part's."""
    image = cv2.line(np.zeros((96, 128, 3), np.uint8), (0, 0), (127, 95), (255, 255, 255), 5)
    line = augment.Sample(image, np.array([[0, 0, 0, 128, 96, 1]], np.float32), (image[:, :, 0] > 0).astype(np.uint8))
    how = STILL._replace(flip=0.5, rotation_deg=15.0, scale=(0.8, 1.2), shift=0.1, mosaic=mosaic)
    for seed in range(12):
        turned, rows, _ = augment.sample(lambda _: line, 0, 4, how, np.random.default_rng(seed))
        for _, left, top, right, bottom, kind in rows:
            if kind == augment.IGNORED:
                continue
            part = np.all(turned[int(top) : int(bottom), int(left) : int(right)] > 150, axis=2)
            for edge in (part[:4].any(), part[-4:].any(), part[:, :4].any(), part[:, -4:].any()):
                assert edge, "a box touches what it is about on every side"


@pytest.mark.parametrize("mosaic", [0.0, 1.0])
def test_what_pixels_show_goes_with_them(mosaic: float) -> None:
    one = marked()
    one = one._replace(regions=(one.image[:, :, 0] > 0).astype(np.uint8))
    how = STILL._replace(flip=0.5, rotation_deg=15.0, scale=(0.8, 1.2), shift=0.1, mosaic=mosaic)
    for seed in range(8):
        image, _, shown = augment.sample(lambda _: one, 0, 4, how, np.random.default_rng(seed))
        assert shown is not None
        grey = (image == augment.PAD[0]).all(axis=2)
        assert set(np.unique(shown)) <= {0, 2}  # class 1 and nothing
        assert ((shown == 2) == (image[:, :, 0] > 127))[~grey].mean() > 0.98  # edges are blurred


def test_shares_of_parts() -> None:
    shown = np.zeros((16, 24), np.uint8)
    shown[:8, :4], shown[8:, 8:16], shown[8:, 16:20] = 1, 2, augment.UNKNOWN
    shares = areas.shares_of(shown, 2, (16, 24))
    assert shares[0].tolist() == [[0.5, 0, 0], [0, 0, 0]] and shares[1].tolist() == [[0, 0, 0], [0, 1, 0]]
    assert shares[2].tolist() == [[1, 1, 1], [1, 1, 0.5]]
    assert not areas.shares_of(None, 2, (16, 24)).any()


def test_areas_are_scored_by_their_parts() -> None:
    regions = np.zeros((16, 32), np.uint8)
    regions[:, :16], regions[:, 24:] = 1, 2
    rows = np.array([[0, 0, 0, 16, 16, 1], [0, 24, 0, 32, 16, augment.IGNORED]], np.float32)
    split = Split(("a", "b"), ("x",), [np.zeros((16, 32, 3), np.uint8)], [rows], [regions], [{}])
    found = np.zeros((2, 2, 4), np.float32)
    found[0, 0, :] = 0.9  # the upper half, of what is and what is not; the last part is not known to be either
    first, second = areas.scored([found], split)
    assert first == pytest.approx((2 / 5, 2 / 3, 2 / 4, 1 / 2)) and second.iou == 0.0
    assert areas.scored([found], split._replace(regions=[None])) == []


def test_four_in_one_keeps_boxes_on_what_they_mark() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        image, rows, _ = augment.sample(lambda _: marked(), 0, 4, STILL._replace(mosaic=1.0), rng)
        for _, left, top, right, bottom, kind in rows:
            if kind == 1:
                assert image[int(top) : int(bottom), int(left) : int(right)].min() == 255


def test_of_what_is_cut_away_little_is_ignored_and_nothing_is_gone() -> None:
    rows = np.array([[0, 0, 0, 100, 100, 1], [0, 90, 0, 190, 100, 1], [0, 200, 0, 300, 100, 1]], np.float32)
    inner = augment.cut(rows, 0, 0, 100, 100)
    assert inner[:, 5].tolist() == [1.0, augment.IGNORED, augment.IGNORED]
    assert inner[1, 1:5].tolist() == [90, 0, 100, 100]


def test_the_same_seed_gives_the_same_picture() -> None:
    a, b = (augment.sample(lambda _: marked(), 0, 4, augment.Strength(), np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])


# --- the data set -----------------------------------------------------------------------------------------------------


def test_worlds_are_dealt_70_15_15_kind_by_kind() -> None:
    plan = Plan(Path(), images=60 * 24, held_out=48)
    jobs = disaster.jobs(plan)
    for kind in range(len(variation.KINDS)):
        usual = [job for job in jobs if job.family == "usual" and job.number % len(variation.KINDS) == kind]
        assert Counter(job.split for job in usual) == {"train": 14, "val": 3, "test": 3}
    assert Counter(job.split for job in jobs if job.family != "usual") == {"asset": 2, "light": 2}
    assert len({job.name for job in jobs}) == len(jobs)


def test_corn_and_things_are_dealt_each_by_itself() -> None:
    jobs = field.jobs(Plan(Path(), images=200 * 24, held_out=48, subject="field"))
    counts = {family: Counter(job.split for job in jobs if job.family == family) for family in field.FAMILIES}
    assert {family: sum(count.values()) for family, count in counts.items()} == {
        "corn": 110, "things": 50, "mast": 40, "light": 2
    }  # fmt: skip
    assert counts["light"] == {"light": 2}
    for family in ("corn", "things", "mast"):
        assert 0.6 < counts[family]["train"] / sum(counts[family].values()) < 0.8
        assert min(counts[family]["val"], counts[family]["test"]) >= 2
    seeds = [field.field_of(job).seed for job in jobs[::9] if job.family != "things"]
    assert len(set(seeds)) == len(seeds)


def over_a_patch(up_m: float, aside_m: float = 0.0) -> list[Seen]:
    """What is labelled in a picture straight down on a level field's only patch."""
    grown = corn.build(1, targets=1, distractors=0, relief_m=2.0)
    patch = grown.targets[0]._replace(radius_m=1.0, harmonics=())
    level = dataclasses.replace(grown, objects=(patch,))
    ground = level.terrain.height_m(patch.north_m, patch.east_m)
    pose = Pose(patch.north_m, patch.east_m + aside_m, -ground - up_m, (1.0, 0.0, 0.0, 0.0))
    return field.patches(level, CameraModel(), pose, NADIR)


def test_a_patch_is_boxed_by_its_outline() -> None:
    (one,) = over_a_patch(20.0)
    left, top, right, bottom = one.box
    assert (right - left, bottom - top) == pytest.approx((32.0, 32.0), abs=1.5)  # 320 px / 20 m
    assert (left + right) / 2 == pytest.approx(320, abs=1.5)
    assert not one.is_cut and not one.is_ignored


def test_a_patch_far_below_or_nearly_out_of_the_picture_is_ignored() -> None:
    assert over_a_patch(80.0)[0].is_ignored
    (cut,) = over_a_patch(20.0, aside_m=20.2)
    assert cut.is_cut and cut.is_ignored
    assert over_a_patch(20.0, aside_m=30.0) == []


def seen(label: str, ignored: bool = False) -> Seen:
    return Seen(label, label, (16.0, 12.0, 48.0, 24.0), None, 300, 0.0, False, ignored)


def test_tables_are_read_back_at_the_networks_size(tmp_path: Path) -> None:
    import cv2

    plan = Plan(tmp_path, images=1, held_out=0, per_world=1, width=64, height=48)
    (job,) = disaster.jobs(plan)
    for folder in ("parts", "labels/train", "images/train"):
        (tmp_path / folder).mkdir(parents=True)
    shot = variation.Shot(0, 0, 12.0, 0, 0, 0, 1.0)
    frames = [{"file": "a.jpg", "seen": [seen("debris_field")._asdict()], "shot": shot._asdict()}]
    part = {"kind": "debris_field", "haze_1_m": 0.001, "sun_deg": 40.0, "frames": frames}
    (tmp_path / "parts" / f"{job.name}.json").write_text(json.dumps(part))
    cv2.imwrite(str(tmp_path / "images/train/a.jpg"), np.zeros((48, 64, 3), np.uint8))
    assert dataset.tables(plan, [job])["train"] == 1
    split = data.load(tmp_path, "train", 128, 128)
    assert split.labels == disaster.SUBJECT.classes
    assert split.rows[0].tolist() == [[1, 32, 16 + 24, 96, 16 + 48, data.REAL]]
    assert split.truth(0).labels.tolist() == [1] and split.about[0]["above_m"] == 12.0


def test_a_folder_holds_worlds_of_one_plan(tmp_path: Path) -> None:
    nothing = Plan(tmp_path / "data", images=0, held_out=0, seed=2)
    assert dataset.draw(nothing, 1) == dataset.draw(nothing, 1) == dict.fromkeys(SPLITS, 0)
    with pytest.raises(ValueError, match=r"data holds other worlds \(seed 2, not 3\): name another folder by --out"):
        dataset.draw(nothing._replace(seed=3), 1)
    (tmp_path / "data/plan.json").unlink()
    (tmp_path / "data/parts/usual_0000.json").write_text("{}")
    with pytest.raises(ValueError, match="of an unknown plan"):
        dataset.draw(nothing, 1)


def test_worlds_of_chosen_splits_alone_are_drawn(tmp_path: Path) -> None:
    plan = Plan(tmp_path, images=24 * 3 * 20, held_out=24, splits=("test", "light"))
    of = Counter(job.split for job in dataset.wanted(plan))
    assert of == {"test": 3 * 3, "light": 1}
    assert len(dataset.wanted(plan._replace(splits=SPLITS))) == 3 * 20 + 2


def test_water_to_learn_from_is_mostly_shallow_and_mostly_over_open_ground() -> None:
    drawn = variation.world(6, "usual", 5)
    (flood,) = drawn.description.water
    for shores, shallow, open_ground in ((0.0, 0, 0), (0.7, 70, 42)):
        places = np.array(disaster.targets_of(drawn, np.random.default_rng(1), shores))
        deep_m = flood.level_m - np.array([drawn.terrain.height_m(north, east) for north, east in places])
        is_shallow = (deep_m > 0.0) & (deep_m <= disaster.SHORE_M)
        paved = disaster.is_paved(drawn.description.ground, *places.T)
        assert (is_shallow.sum(), (is_shallow & ~paved).sum()) == (shallow, open_ground)
    (street,) = [land for land in drawn.description.ground.land if land.use == "asphalt"][:1]
    middle = np.array(street.polygon_m).mean(axis=0)
    assert disaster.is_paved(drawn.description.ground, middle[:1], middle[1:]).all()


def test_a_world_is_the_same_each_time_and_families_differ() -> None:
    one, two = (variation.world(1, "usual", 7) for _ in range(2))
    assert one.description == two.description
    usual, other = variation.world(1, "usual", 7).description, variation.world(1, "asset", 7).description
    assert any(each.hull for each in usual.solids)
    assert not any(each.hull for each in other.solids if each.label.startswith("debris"))
    assert variation.world(1, "light", 7).description.light.elevation_deg < 16 < usual.light.elevation_deg


# --- learning ---------------------------------------------------------------------------------------------------------


def test_the_network_is_as_large_as_yolov8n() -> None:
    pytest.importorskip("torch")
    from tools.detector.net import Network

    assert 2.8e6 < sum(each.numel() for each in Network(3).parameters()) < 3.3e6


def test_anchors_are_where_the_detector_expects_them() -> None:
    pytest.importorskip("torch")
    from tools.detector.net import anchors

    assert np.array_equal(anchors(64, 96)[0].numpy(), middles(64, 96))


def test_an_anchor_stands_for_the_box_it_fits_and_none_in_what_is_ignored_counts() -> None:
    torch = pytest.importorskip("torch")
    from tools.detector.loss import assign
    from tools.detector.net import anchors

    at, strides = anchors(64, 64)
    boxes = torch.cat((at - strides[:, None], at + strides[:, None]), -1)[None]
    scores = torch.full((1, len(at), 2), 0.5)
    targets = torch.tensor([[[1, 0, 0, 16, 16, 1.0], [0, 32, 32, 64, 64, 2.0], [0, 0, 0, 0, 0, 0]]])
    found = assign(scores, boxes, at, targets)
    chosen = at[found.is_positive[0]]
    assert len(chosen) and (chosen < 16).all()
    best = int(found.score[0, :, 1].argmax())
    assert at[best].tolist() in ([4, 4], [12, 4], [4, 12], [12, 12], [8, 8])
    assert float(found.score[0, :, 0].max()) == 0.0
    inner = ((at > 32) & (at < 64)).all(1)
    assert not found.counts[0][inner].any() and found.counts[0][~inner].all()


def test_complete_overlap_is_one_for_the_same_box_and_below_overlap_otherwise() -> None:
    torch = pytest.importorskip("torch")
    from tools.detector.loss import complete_overlap, overlap

    a, b = torch.tensor([[0.0, 0, 10, 10]]), torch.tensor([[5.0, 0, 25, 10]])
    assert float(complete_overlap(a, a)) == pytest.approx(1.0, abs=1e-5)
    assert float(complete_overlap(a, b)) < float(overlap(a, b)) == pytest.approx(0.2, abs=1e-5)


def test_areas_cost_what_they_miss_where_it_is_known() -> None:
    torch = pytest.importorskip("torch")
    from tools.detector.loss import area_loss

    shares = torch.zeros(1, 3, 2, 2)
    shares[0, 0, 0, 0] = shares[0, 2, 0] = 1.0  # of the first class, and known in the upper half
    right = torch.where(shares[:, :2] > 0.5, 20.0, -20.0)
    assert float(area_loss(right, shares)) < 1e-6
    beyond, within = right.clone(), right.clone()
    beyond[0, :, 1], within[0, :, 0] = 20.0, -20.0
    assert float(area_loss(beyond, shares)) < 1e-6 < float(area_loss(within, shares))


def test_areas_cost_more_at_their_edges() -> None:
    torch = pytest.importorskip("torch")
    from tools.detector.loss import area_loss

    shares = torch.zeros(1, 2, 1, 20)
    shares[0, 0, 0, :10] = shares[0, 1] = 1.0  # of the class to the left, and all is known
    right = torch.where(shares[:, :1] > 0.5, 20.0, -20.0)
    far, near = right.clone(), right.clone()
    far[..., 15], near[..., 11] = 20.0, 20.0
    assert float(area_loss(near, shares)) > 2.0 * float(area_loss(far, shares)) > 0.0


@pytest.mark.slow
def test_it_learns_two_pictures_by_heart() -> None:
    torch = pytest.importorskip("torch")
    torch.set_num_threads(1)  # threads that wait for each other on a busy machine take ten times as long
    from tools.detector.loss import loss
    from tools.detector.net import Deployed, Network, anchors

    torch.manual_seed(0)
    network = Network(3, 0.25)
    images = torch.zeros(2, 3, 64, 96)
    images[0, 0, 10:50, 20:70] = images[1, 2, 20:60, 5:40] = 1
    targets = torch.tensor([[[0, 20, 10, 70, 50, 1.0]], [[1, 5, 20, 40, 60, 1]]])
    optimiser = torch.optim.SGD(network.parameters(), 0.02, 0.9, nesterov=True)
    for _ in range(250):
        total, _ = loss(network(images), targets, *anchors(64, 96))
        optimiser.zero_grad()
        total.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
        optimiser.step()
    with torch.no_grad():
        out = Deployed(network.eval(), 64, 96)(images)[0].numpy()
    for figures, target in zip(out, targets, strict=True):
        found = decoded(figures, middles(64, 96), 0.3, 0.6)
        assert found.labels.tolist() == [int(target[0, 0])]
        assert np.allclose(found.boxes[0], target[0, 1:5].numpy(), atol=3.0)


def test_a_training_begins_with_what_an_exported_network_gives(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("onnxscript")
    from tools.detector import export, start
    from tools.detector.net import Deployed, Network

    torch.manual_seed(1)
    old, images = (
        Network(3, 0.25, True),
        [np.random.default_rng(k).integers(0, 256, (64, 64, 3), np.uint8) for k in range(8)],
    )
    x = torch.from_numpy(np.stack(images)[..., ::-1].transpose(0, 3, 1, 2).copy()).float() / 255.0
    assert old.areas is not None
    old.areas(old.features(x)[0])  # so that its norms are not those it was made with
    old(x)
    settings = {"width": 0.25, "input_width": 64, "input_height": 64}
    labels = ["a", "b", "c"]
    kept = {"labels": labels, "settings": settings, "average": old.state_dict(), "epoch": 1, "seconds": 1.0}
    torch.save(kept | {"history": []}, tmp_path / "last.pt")
    export.export(tmp_path / "last.pt", tmp_path / "network.onnx")
    for path in (tmp_path / "last.pt", tmp_path / "network.onnx"):
        for width in (0.25, 0.5):
            new = Network(3, width, True)
            start.begin(path, new, labels, images)
            with torch.no_grad():
                for before, now in zip(Deployed(old.eval(), 64, 64)(x), Deployed(new.eval(), 64, 64)(x), strict=True):
                    assert torch.allclose(before, now, atol=1e-3)
    for has_areas in (True, False):  # the layers below the classes' scores
        start.begin(tmp_path / "network.onnx", Network(2, 0.25, has_areas), ["d", "e"], images)
    with pytest.raises(ValueError, match="it can't begin a network of width"):
        start.begin(tmp_path / "network.onnx", Network(3, 1.0), labels, images)


def test_a_training_goes_on_in_another_sitting_and_ends_in_time(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    from tools.detector.train import Settings, train

    torch.set_num_threads(1)
    for name in ("train", "val"):
        (tmp_path / "images" / name).mkdir(parents=True)
        images = [{"id": k, "file_name": f"{k}.png"} for k in range(4)]
        boxes = [{"image_id": k, "category_id": 1, "bbox": [20, 10, 40, 30]} for k in range(4)]
        table = {"images": images, "annotations": boxes, "categories": [{"id": 1, "name": "box"}]}
        (tmp_path / f"{name}.json").write_text(json.dumps(table))
        for k in range(4):
            cv2.imwrite(str(tmp_path / "images" / name / f"{k}.png"), marked().image)
    whole = Settings(tmp_path, tmp_path / "whole", 3, 2, 0.25, 128, 96, validate_every=2)
    train(whole)
    history = json.loads((tmp_path / "whole/history.json").read_text())
    assert [("map50" in row) for row in history] == [False, True, True]
    best = torch.load(tmp_path / "whole/best.pt", weights_only=True)
    assert "average" in best and "network" not in best
    for _ in range(3):
        train(whole._replace(out=tmp_path / "two", minutes=1e-9))
    kept, again = (torch.load(tmp_path / name / "last.pt", weights_only=True) for name in ("whole", "two"))
    assert again["epoch"] == 3
    assert all(torch.equal(kept["average"][name], again["average"][name]) for name in kept["average"])
    train(whole._replace(out=tmp_path / "short", epochs=1000, within_minutes=1e-6))
    assert json.loads((tmp_path / "short/history.json").read_text())[-1]["epoch"] == 1
    with pytest.raises(ValueError, match=r"other settings"):
        train(whole._replace(epochs=4))
