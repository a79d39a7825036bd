"""Datasets: ground truth against ray queries, forms that others read, runs that are killed."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import subprocess
import sys
import tarfile
import textwrap

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import dataset
from clpt import transforms as tf
from clpt.dataset import truth as truths
from clpt.dataset import writers
from clpt.errors import SceneError, UnknownKindError
from clpt.files import output_files
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path

SIZE = WIDTH, HEIGHT = 40, 30


def scene(index: int, rng: np.random.Generator) -> Scene:
    """Two cups and a ball over a floor, at random."""
    parts: list[shapes.Shape] = [
        shapes.Rectangle(to_world=tf.scale([5.0, 5.0, 1.0]), name=""),
    ]
    for name in ("cup.001", "cup.002"):
        place = tf.translate([*rng.uniform(-1, 1, 2), 0.5]) @ tf.rotate(
            [0, 0, 1], rng.uniform(0, 90)
        )
        red = materials.Diffuse(reflectance=(0.6, 0.1, 0.1))
        parts.append(
            shapes.Cube(to_world=place @ tf.scale([0.3, 0.4, 0.5]), name=name, material=red)
        )
    parts.append(shapes.Sphere(center=(*rng.uniform(-1, 1, 2), 0.4), radius=0.4, name="ball"))
    eye = [4.0 * np.cos(index), 4.0 * np.sin(index), 2.5]
    return Scene(
        camera=cameras.Perspective(to_world=tf.look_at(eye, [0, 0, 0.4], [0, 0, 1])), shapes=parts,
        lights=[lights.Constant()], film=Film(size=SIZE, mode="rgb"), integrator=Path(max_depth=2),
    )  # fmt: skip


def rays(view: Scene):
    """Origins and directions through the middles of pixels (h, w, 3)."""
    camera = truths.calibrated(view.camera, *SIZE)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1)
    return np.asarray(view.camera.to_world)[:3, 3], camera.unproject(pixels, *SIZE)


def hits(shape: shapes.Shape, origin, directions) -> np.ndarray:
    """Distances (h, w) to a cube or a ball by formula; inf where it is not met."""
    if isinstance(shape, shapes.Sphere):
        away = origin - np.asarray(shape.center)
        b, c = directions @ away, away @ away - shape.radius**2
        root = b * b - c
        return np.where(root > 0.0, -b - np.sqrt(np.maximum(root, 0.0)), np.inf)
    back = np.linalg.inv(shape.to_world)
    o, d = tf.transform_points(back, origin), directions @ back[:3, :3].T
    half = [1.0, 1.0, 1.0] if isinstance(shape, shapes.Cube) else [1.0, 1.0, 0.0]
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.sort(np.stack([(-np.array(half) - o) / d, (np.array(half) - o) / d]), axis=0)
    near, far = sides[0].max(-1), sides[1].min(-1)
    return np.where((near <= far) & (near > 0.0), near, np.inf)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_truth_is_that_of_rays_by_formula(index):
    """Masks, silhouettes, boxes and depth of each pixel; at an edge a ray may differ."""
    view = scene(index, np.random.default_rng(index))
    origin, directions = rays(view)
    truth = dataset.ground_truth(view, silhouettes=True)
    distances = np.stack([hits(shape, origin, directions) for shape in view.shapes])
    nearest = np.where(np.isfinite(distances.min(0)), distances.argmin(0), 0)
    assert truth.names == ("cup.001", "cup.002", "ball") and truth.categories == (
        "cup",
        "cup",
        "ball",
    )
    assert (truth.instances != nearest).sum() <= 1
    assert (truth.silhouettes != np.isfinite(distances[1:])).sum() <= 1
    hit = np.isfinite(distances.min(0))
    forward = np.asarray(view.camera.to_world)[:3, 2]
    depth = np.where(hit, distances.min(0), 0.0) * (directions @ forward)
    agree = truth.instances == nearest
    away = np.abs(truth.depth - depth)[agree]  # a ray lies within .01 px of the pixel's middle
    assert (away > 5e-3 * depth[agree]).sum() <= 2 and np.median(away) < 1e-3
    for i in range(3):
        y, x = np.nonzero(truth.instances == i + 1)
        if len(x):
            box = [x.min(), y.min(), np.ptp(x) + 1, np.ptp(y) + 1]
            assert truth.boxes[i].tolist() == box
        whole = truth.silhouettes[i].sum()
        assert truth.visibility[i] == pytest.approx((truth.instances == i + 1).sum() / whole)


def shiny(index: int, rng: np.random.Generator) -> Scene:
    """The scene of an index; of every other one the ball is of polished metal."""
    made = scene(index, rng)
    metal = materials.Conductor(metal="gold")
    kept = [*made.shapes[:-1], dataclasses.replace(made.shapes[-1], material=metal)]
    lamps = [*made.lights, lights.Directional(direction=(1.0, 0.5, -1.0))]
    made = dataclasses.replace(made, lights=lamps, integrator=Path(max_depth=4))
    return dataclasses.replace(made, shapes=kept) if index % 2 else made


def test_pictures_are_those_of_new_renderers():
    """To the bit, where light paths come and go, and where both scenes share their trees."""
    for picture in dataset.pictures(shiny, [0, 1, 2, 3, 3, 0], spp=2):
        with clpt.Renderer(picture.scene) as renderer:
            renderer.run(2)
            np.testing.assert_array_equal(picture.image, renderer.image()[..., :3])
        alone = dataset.ground_truth(picture.scene)
        for name in ("instances", "depth", "position", "normal", "visible"):
            np.testing.assert_array_equal(vars(picture.truth)[name], vars(alone)[name])


def test_poses_and_3d_boxes():
    """Poses are rigid; corners of the boxes are those of the cube, and enclose the ball."""
    view = scene(0, np.random.default_rng(3))
    truth = dataset.ground_truth(view)
    for i, shape in enumerate(view.shapes[1:3]):
        np.testing.assert_allclose(
            truth.poses[i][:3, :3] @ truth.poses[i][:3, :3].T, np.eye(3), atol=1e-12
        )
        np.testing.assert_allclose(
            truth.sizes[i][1] - truth.sizes[i][0], [0.6, 0.8, 1.0], rtol=1e-9
        )
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), -1).reshape(-1, 3)
        expected = tf.transform_points(shape.to_world, signs)
        away = np.linalg.norm(truth.corners[i][:, None] - expected, axis=-1)
        np.testing.assert_allclose(away.min(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(truth.corners[2].mean(0), view.shapes[3].center, atol=1e-9)


def test_what_lets_rays_through_is_no_object():
    """A ball is seen behind a mask of opacity 0 and a hidden lamp, not behind glass or a lamp."""
    view = scene(0, np.random.default_rng(3))
    cube, ball = view.shapes[1], view.shapes[3]
    around = tf.translate(ball.center) @ tf.scale(0.6)
    lamp, mask, glass = lights.Area(), materials.Mask(opacity=0.0), materials.Dielectric()
    for cover, hide, seen in (
        ({"material": mask}, False, "ball"), ({"emission": lamp}, True, "ball"),
        ({"emission": lamp}, False, "cover"), ({"material": glass}, False, "cover"),
    ):  # fmt: skip
        box = dataclasses.replace(cube, to_world=around, name="cover", **cover)
        hidden = Path(max_depth=2, hide_lights=hide)
        truth = dataset.ground_truth(
            dataclasses.replace(view, shapes=[box, ball], integrator=hidden)
        )
        counts = dict(zip(truth.names, truth.visible, strict=True))
        assert counts[seen] > 10 and sum(counts.values()) == counts[seen], (cover, counts)


def moved(view: Scene) -> Scene:
    """The scene a moment later: a cup and the camera have moved, the ball is gone."""
    push = tf.translate([0.1, -0.05, 0.1]) @ tf.rotate([0, 0, 1], 7.0)
    parts = [view.shapes[0], view.shapes[1].__class__(**{
        **{f.name: getattr(view.shapes[1], f.name) for f in dataclasses.fields(view.shapes[1])},
        "to_world": push @ view.shapes[1].to_world,
    }), view.shapes[2]]  # fmt: skip
    camera = dataclasses.replace(
        view.camera, to_world=tf.translate([0.05, 0.1, 0.0]) @ view.camera.to_world
    )
    return dataclasses.replace(view, shapes=parts, camera=camera)


def test_flow():
    """What a pixel sees is where flow says in the later picture: there lies the same point."""
    first_scene = scene(1, np.random.default_rng(5))
    second_scene = moved(first_scene)
    first, second = (dataset.ground_truth(s) for s in (first_scene, second_scene))
    flow = dataset.optical_flow(first, second, second_scene)
    points = first.position + dataset.scene_flow(first, second)
    push = np.asarray(second_scene.shapes[1].to_world) @ np.linalg.inv(
        first_scene.shapes[1].to_world
    )
    cup = first.instances == 1
    np.testing.assert_allclose(
        points[cup], tf.transform_points(push, first.position[cup]), atol=1e-9
    )
    ball = first.instances == 3
    assert np.isnan(flow[ball]).all() and np.isfinite(flow[cup]).all()
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    there = np.rint(np.stack([x, y], -1) + flow)
    inside = np.isfinite(flow).all(-1) & (there >= 0).all(-1) & (there < SIZE).all(-1)
    column, row = there[inside].astype(int).T
    same = second.instances[row, column] == first.instances[inside]
    assert same.mean() > 0.9  # the others are covered, or lie at edges
    near = np.linalg.norm(second.position[row, column] - points[inside], axis=-1)[same]
    assert (near < 0.3).mean() > 0.95  # half a pixel, of a floor that is seen slantwise
    away = (points @ second.camera[:3, :3].T + second.camera[:3, 3]) @ second.matrix.T
    expected = away[..., :2] / away[..., 2:] - np.stack([x, y], -1)
    np.testing.assert_allclose(flow[inside], expected[inside], atol=1e-9)


def run(folder, make=scene, count=4, **options):
    return dataset.generate(make, count, folder, spp=2, **options)


def test_folders_and_a_failing_picture(tmp_path):
    def sometimes(index, rng):
        if index == 2 and not os.environ.get("CLPT_TEST_MENDED"):
            raise ValueError("no place for the cup")
        return scene(index, rng)

    report = run(tmp_path / "a", sometimes)
    assert (report.written, report.present) == (3, 0)
    assert report.failures == {2: "ValueError: no place for the cup"}
    assert "no place" in (tmp_path / "a/failures/000002.txt").read_text()
    before = (tmp_path / "a/rgb/000001.png").stat().st_mtime_ns
    os.environ["CLPT_TEST_MENDED"] = "1"
    try:
        report = run(tmp_path / "a", sometimes)
    finally:
        del os.environ["CLPT_TEST_MENDED"]
    assert (report.written, report.present, report.failures) == (1, 3, {})
    assert (tmp_path / "a/rgb/000001.png").stat().st_mtime_ns == before
    assert not (tmp_path / "a/failures/000002.txt").exists()
    depth = np.load(tmp_path / "a/depth/000002.npy")
    assert depth.shape == (HEIGHT, WIDTH) and depth.dtype == np.float32 and depth.max() > 2.0
    labels = json.loads((tmp_path / "a/truth/000002.json").read_text())
    assert [row["category"] for row in labels["objects"]] == ["cup", "cup", "ball"]


def test_parts_make_the_same_pictures(tmp_path):
    run(tmp_path / "whole", count=3)
    for i in range(2):
        run(tmp_path / "parts", count=3, part=(i, 2))
    for name in ("rgb/000002.png", "depth/000001.npy", "instances/000000.png"):
        whole, part = ((tmp_path / a / name).read_bytes() for a in ("whole", "parts"))
        assert whole == part, name


def test_parts_at_the_same_time_end_with_a_summary(tmp_path):
    """A process renders its part while another renders the rest; the last to end sums up."""

    def meanwhile(index, rng):
        if index == 2:
            run(tmp_path, count=3, part=(1, 2), form="coco")
            assert not (tmp_path / "annotations.json").exists()
        return scene(index, rng)

    run(tmp_path, meanwhile, count=3, part=(0, 2), form="coco")
    document = json.loads((tmp_path / "annotations.json").read_text())
    assert [picture["id"] for picture in document["images"]] == [1, 2, 3]


def test_a_killed_run_goes_on(tmp_path):
    """A process that dies within a picture leaves the finished ones; the next call adds others."""
    code = textwrap.dedent(f"""
        import os, sys
        sys.path.insert(0, {os.path.dirname(__file__)!r})
        from test_dataset import dataset, scene
        def dies(index, rng):
            if index == 2:
                os._exit(9)
            return scene(index, rng)
        dataset.generate(dies, 4, {str(tmp_path / "a")!r}, spp=2)
    """)
    assert subprocess.run([sys.executable, "-c", code], cwd=os.getcwd()).returncode == 9
    report = run(tmp_path / "a")
    assert (report.written, report.present) == (2, 2)


def test_a_full_disk_ends_the_run_and_loses_nothing(tmp_path, monkeypatch):
    write, calls = output_files.write, []

    def fills(path, content):
        calls.append(path)
        if len(calls) > 7:  # within picture 1
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        write(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(output_files, "write", fills)
        with pytest.raises(OSError, match="No space left"):
            run(tmp_path, count=3)
    assert [path.stem for path in (tmp_path / "records").glob("*.json")] == ["000000"]
    report = run(tmp_path, count=3)
    assert (report.written, report.present, report.failures) == (2, 1, {})


def test_coco(tmp_path):
    run(tmp_path, form="coco", count=2)
    document = json.loads((tmp_path / "annotations.json").read_text())
    assert [c["name"] for c in document["categories"]] == ["ball", "cup"]
    assert [image["id"] for image in document["images"]] == [1, 2]
    for annotation in document["annotations"]:
        name = document["images"][annotation["image_id"] - 1]["file_name"].replace(
            "images", "instances"
        )
        runs = annotation["segmentation"]
        values = np.repeat(np.arange(len(runs["counts"])) % 2, runs["counts"])
        mask = values.reshape(runs["size"], order="F").astype(bool)
        (number,) = np.unique(np.asarray(Image.open(tmp_path / name))[mask])
        assert number > 0 and mask.sum() == annotation["area"]
        x, y, width, height = annotation["bbox"]
        assert mask[y : y + height, x : x + width].sum() == annotation["area"]


def test_bop(tmp_path):
    """A pose moves the corners of the object's box to where K projects them: around the mask."""
    run(tmp_path, form="bop", count=2, truth="silhouettes")
    folder = tmp_path / "000000"
    camera = json.loads((folder / "scene_camera.json").read_text())["1"]
    poses = json.loads((folder / "scene_gt.json").read_text())["1"]
    facts = json.loads((folder / "scene_gt_info.json").read_text())["1"]
    assert json.loads((tmp_path / "objects.json").read_text()) == {"1": "ball", "2": "cup"}
    depth = np.asarray(Image.open(folder / "depth/000001.png"), float) * camera["depth_scale"]
    assert 2000.0 < depth.max() < 9000.0  # mm
    half = np.array([[x, y, z] for x in (-300, 300) for y in (-400, 400) for z in (-500, 500)])
    for i in range(2):
        turn = np.reshape(poses[i]["cam_R_m2c"], (3, 3))
        away = half @ turn.T + poses[i]["cam_t_m2c"]
        pixels = away @ np.reshape(camera["cam_K"], (3, 3)).T
        pixels = pixels[:, :2] / pixels[:, 2:]
        mask = np.asarray(Image.open(folder / f"mask/000001_{i:06d}.png")) > 0
        rows, columns = np.nonzero(mask)
        low, high = pixels.min(0), pixels.max(0)
        low, high = np.clip(low, 0, np.array(SIZE) - 1), np.clip(high, 0, np.array(SIZE) - 1)
        assert np.abs(low - [columns.min(), rows.min()]).max() <= 1.0
        assert np.abs(high - [columns.max(), rows.max()]).max() <= 1.0
        assert facts[i]["px_count_all"] == mask.sum() and facts[i]["px_count_visib"] <= mask.sum()


def test_bop_has_no_depth_beyond_its_16_bits(tmp_path):
    """A wall at 20 m is at no depth, neither at 6.55 m nor at the remainder."""

    def far(index, rng):
        view = scene(index, rng)
        back = tf.translate([0, 0, -20.0]) @ tf.scale(50.0)
        view.shapes[:] = [shapes.Rectangle(to_world=back, name="wall"), *view.shapes[1:]]
        eye = tf.look_at([0, 0, 1.5], [0, 0, -5.0], [0, 1, 0])
        return dataclasses.replace(view, camera=cameras.Perspective(to_world=eye))

    run(tmp_path, far, form="bop", count=1)
    depth = np.asarray(Image.open(tmp_path / "000000/depth/000000.png"))
    wall = np.asarray(Image.open(tmp_path / "000000/mask_visib/000000_000000.png")) > 0
    assert wall.any() and (depth[wall] == 0).all()


def test_more_objects_than_numbers_are_refused(tmp_path, monkeypatch):
    """Their numbers would collide in files of 16 bits; the picture fails, and is told."""
    monkeypatch.setattr(writers, "MOST_OBJECTS", 2)
    for form in ("folders", "coco"):
        report = run(tmp_path / form, form=form, count=1)
        assert report.failures == {0: "shapes: 3 objects; files with 16 bits hold 2"}


def test_shapes_of_one_name_are_one_object():
    view = scene(0, np.random.default_rng(0))
    alike = [dataclasses.replace(shape, name="pair") for shape in view.shapes[1:3]]
    truth = dataset.ground_truth(
        dataclasses.replace(view, shapes=[view.shapes[0], *alike, view.shapes[3]])
    )
    assert truth.names == ("pair", "ball") and truth.instances.max() == 2


def test_webdataset(tmp_path):
    run(tmp_path, form="webdataset", count=3)
    with tarfile.open(tmp_path / "shard-000000.tar") as shard:
        names = shard.getnames()
        labels = json.load(shard.extractfile("000001.json"))
    assert names[:5] == [
        "000000.rgb.png", "000000.depth.npy", "000000.normal.npy", "000000.instances.png",
        "000000.json",
    ]  # fmt: skip
    assert (
        len(names) == 15 and len(labels["objects"]) == 3 and not any((tmp_path / "parts").iterdir())
    )


def test_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py", reason="clpt[dataset]")
    run(tmp_path, form="hdf5", count=1)
    with h5py.File(tmp_path / "000000.hdf5") as file:
        assert set(file) == {
            "colors",
            "depth",
            "normals",
            "instance_segmaps",
            "instance_attribute_maps",
        }
        assert file["colors"].shape == (HEIGHT, WIDTH, 3) and file["depth"][:].max() > 2.0


def test_another_dataset_is_not_mixed_in(tmp_path):
    run(tmp_path, count=1)
    with pytest.raises(SceneError, match="dataset of seed 0, not 1"):
        run(tmp_path, count=1, seed=1)
    with pytest.raises(SceneError, match="its first scene differs"):
        run(tmp_path, lambda index, rng: scene(index + 5, rng), count=1)
    with pytest.raises(SceneError, match="dataset of form 'folders', not 'coco'"):
        run(tmp_path, count=1, form="coco")


def test_other_bad_input(tmp_path):
    with pytest.raises(UnknownKindError, match="coco"):
        run(tmp_path, form="cocoa")
    with pytest.raises(SceneError, match="part"):
        run(tmp_path, part=(2, 2))
    report = run(tmp_path, lambda index, rng: None, count=2)
    assert "returned NoneType for picture 1, not a Scene" in report.failures[1]
    panorama = dataclasses.replace(scene(0, np.random.default_rng(0)), camera=cameras.Spherical())
    report = run(tmp_path / "b", lambda index, rng: panorama, count=1, form="bop")
    assert "spherical" in report.failures[0]
    with pytest.raises(clpt.SceneError, match="no place"):
        next(dataset.pictures(_fails, range(1)))


def _fails(index, rng):
    raise SceneError("no place")


def test_warm_pictures_wait_for_no_compiler(caplog):
    """A second warming finds all programs, and a picture that fails is passed over."""

    def sometimes(index: int, rng: np.random.Generator) -> Scene:
        if index == 1:
            raise ValueError("no scene")
        return scene(index, rng)

    dataset.warm(sometimes, range(3), seed=2)
    assert dataset.warm(sometimes, range(3), seed=2) == 0
    assert "picture 1 would fail: no scene" in caplog.text
