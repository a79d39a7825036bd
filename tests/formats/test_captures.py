"""Poses in the conventions of other tools: points that they project are found in the picture."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError, UnknownKindError
from clpt.formats import captures
from clpt.scene import Film, Scene, cameras, conventions, lights, shapes
from clpt.scene.integrators import Box, Path

SIZE = WIDTH, HEIGHT = 64, 48
FOCAL = 50.0
# From a point in each convention's camera space to its pixel, as the tools' manuals have it.
PIXEL = {
    "opencv": lambda x, y, z: (x / z, y / z), "colmap": lambda x, y, z: (x / z, y / z),
    "opengl": lambda x, y, z: (x / -z, -y / -z), "blender": lambda x, y, z: (x / -z, -y / -z),
    "nerf": lambda x, y, z: (x / -z, -y / -z), "ros_optical": lambda x, y, z: (x / z, y / z),
    "ros": lambda x, y, z: (-y / x, -z / x),
}  # fmt: skip
TO_CAMERA = ("opencv", "colmap", "opengl")


def random_pose(rng) -> np.ndarray:
    matrix = np.eye(4)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix[:3, :3], matrix[:3, 3] = q * np.linalg.det(q), rng.uniform(-0.5, 0.5, 3)
    return matrix


def positions(camera: cameras.Camera) -> np.ndarray:
    """What the pixels' middles see of a cube around the camera (h, w, 3)."""
    film = Film(size=SIZE, layers=("position",), filter=Box(radius=0.01), filtering="importance")
    scene = Scene(
        camera=camera, shapes=[shapes.Cube(to_world=tf.scale([2.0, 2.0, 2.0]))], film=film,
        lights=[lights.Constant()], integrator=Path(max_depth=1),
    )  # fmt: skip
    with clpt.Renderer(scene) as renderer:
        renderer.run(16)
        return np.asarray(renderer.layers()["position"], np.float64)


@pytest.mark.parametrize("convention", PIXEL)
@pytest.mark.parametrize("seed", [1, 2])
def test_points_are_found_in_the_picture(convention, seed):
    """The tool's own matrix and formula lead from what a pixel sees to the pixel, to .01 px."""
    pose = random_pose(np.random.default_rng(seed))
    view = cameras.Calibrated(
        intrinsics=(FOCAL, FOCAL, 31.5, 23.5), to_world=conventions.to_world(pose, convention)
    )
    seen = positions(view)
    matrix = pose if convention in TO_CAMERA else np.linalg.inv(pose)
    away = tf.transform_points(matrix, seen)
    x, y = PIXEL[convention](*np.moveaxis(away, -1, 0))
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    assert np.hypot(FOCAL * x + 31.5 - columns, FOCAL * y + 23.5 - rows).max() < 0.01
    np.testing.assert_allclose(conventions.pose(view.to_world, convention), pose, atol=1e-12)


def colmap_place(model: str, k: list[float], p: np.ndarray) -> np.ndarray:
    """Places (2, ...) on the image plane of points (..., 3) by COLMAP's sensor/models.h."""
    u, v = p[..., 0] / p[..., 2], p[..., 1] / p[..., 2]
    r = np.hypot(u, v)
    if model == "FOV":
        return np.arctan(2.0 * r * np.tan(k[0] / 2.0)) / (k[0] * r) * np.stack([u, v])
    if model.endswith("FISHEYE"):
        theta = np.arctan2(np.hypot(p[..., 0], p[..., 1]), p[..., 2])
        powers = sum(factor * theta ** (2 * i + 2) for i, factor in enumerate(k))
        return (
            theta * (1.0 + powers) / np.hypot(p[..., 0], p[..., 1]) * np.moveaxis(p[..., :2], -1, 0)
        )
    k = [*k, *[0.0] * 8] if model in ("OPENCV", "FULL_OPENCV") else [*k, 0.0, 0.0][:2] + [0.0] * 8
    k1, k2, p1, p2, k3, k4, k5, k6 = k[:8]
    radial = (1.0 + k1 * r**2 + k2 * r**4 + k3 * r**6) / (1.0 + k4 * r**2 + k5 * r**4 + k6 * r**6)
    return np.stack([
        u * radial + 2.0 * p1 * u * v + p2 * (r**2 + 2.0 * u**2),
        v * radial + 2.0 * p2 * u * v + p1 * (r**2 + 2.0 * v**2),
    ])  # fmt: skip


COLMAP_MODELS = {
    "SIMPLE_PINHOLE": [], "PINHOLE": [], "SIMPLE_RADIAL": [-0.2], "RADIAL": [-0.2, 0.05],
    "OPENCV": [-0.2, 0.05, 0.01, -0.02],
    "FULL_OPENCV": [0.3, -0.1, 0.01, 0.02, 0.02, 0.4, -0.05, 0.01],
    "SIMPLE_RADIAL_FISHEYE": [0.03], "RADIAL_FISHEYE": [0.03, -0.02],
    "OPENCV_FISHEYE": [0.03, -0.02, 0.004, 0.001], "FOV": [0.9],
}  # fmt: skip


def assert_found(view: captures.Capture, place, focal) -> None:
    """What each pixel sees lies within .01 px of its middle, which is (x + .5, y + .5) in files.

    place: leads from points in the world to the image plane (2, h, w); the middle is (30, 25).
    """
    x, y = np.array(focal)[:, None, None] * place(positions(view.camera))
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    assert np.hypot(x + 30.0 - (columns + 0.5), y + 25.0 - (rows + 0.5)).max() < 0.01


@pytest.mark.parametrize("model", COLMAP_MODELS)
def test_points_are_found_in_the_picture_of_a_colmap_file(tmp_path, model):
    """By the file's quaternion, translation and model, in random poses."""
    k = COLMAP_MODELS[model]
    focal = (50.0, 50.0) if model.startswith(("SIMPLE", "RADIAL")) else (50.0, 54.0)
    ways = [random_pose(np.random.default_rng(seed)) for seed in (11, 12)]
    numbers = [*focal[: 2 if focal[1] != focal[0] or model == "PINHOLE" else 1], 30.0, 25.0, *k]
    (tmp_path / "cameras.txt").write_text(f"3 {model} 64 48 {' '.join(map(str, numbers))}\n")
    rows = []
    for i, way in enumerate(ways):
        q = Rotation.from_matrix(way[:3, :3]).as_quat().tolist()
        turn = [q[3], *q[:3], *way[:3, 3].tolist()]
        rows.append(f"{i + 1} {' '.join(map(repr, turn))} 3 {i}.png\n\n")
    (tmp_path / "images.txt").write_text("".join(rows))
    for way, view in zip(ways, captures.read_colmap(tmp_path), strict=True):
        assert_found(
            view, lambda p, m=way: colmap_place(model, k, tf.transform_points(m, p)), focal
        )


@pytest.mark.parametrize("model", ["OPENCV", "OPENCV_FISHEYE"])
def test_points_are_found_in_the_picture_of_a_transforms_json(tmp_path, model):
    """By the file's matrix, camera to world, x right, y up, z back, in random poses."""
    k = COLMAP_MODELS[model]
    names = ("k1", "k2", "k3", "k4") if "FISHEYE" in model else ("k1", "k2", "p1", "p2")
    ways = [random_pose(np.random.default_rng(seed)) for seed in (13, 14)]
    document = {
        "camera_model": model, "w": 64, "h": 48, "fl_x": 50.0, "fl_y": 54.0, "cx": 30.0,
        "cy": 25.0, **dict(zip(names, k, strict=True)),
        "frames": [{"file_path": "a", "transform_matrix": way.tolist()} for way in ways],
    }  # fmt: skip
    (tmp_path / "t.json").write_text(json.dumps(document))
    for way, view in zip(ways, captures.read_transforms(tmp_path / "t.json"), strict=True):
        back = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(way)
        assert_found(
            view, lambda p, m=back: colmap_place(model, k, tf.transform_points(m, p)), (50.0, 54.0)
        )


def test_a_pinhole_has_intrinsics():
    pinhole = cameras.Perspective(
        fov=50.0, offset_x=0.1, offset_y=-0.05, to_world=random_pose(np.random.default_rng(3))
    )
    same = conventions.calibrated(pinhole, *SIZE)
    np.testing.assert_allclose(positions(same), positions(pinhole), atol=2e-3)
    assert conventions.calibrated(same, *SIZE) is same
    with pytest.raises(SceneError, match="spherical"):
        conventions.calibrated(cameras.Spherical(), *SIZE)


def views() -> list[captures.Capture]:
    rng = np.random.default_rng(5)
    models = (
        ("opencv", ()), ("opencv", (-0.2, 0.05, 0.001, -0.002)),
        ("opencv", (-0.2, 0.05, 0.001, -0.002, 0.01, 0.1, 0.0, 0.02)),
        ("kannala_brandt", (0.01, -0.02, 0.003, 0.001)),
    )  # fmt: skip
    return [
        captures.Capture(
            f"a view {i}.png",
            cameras.Calibrated(
                model=model, intrinsics=(50.0 + i, 51.0, 30.5, 24.0), distortion=distortion,
                size=SIZE, to_world=random_pose(rng),
            ),
            *SIZE,
        )
        for i, (model, distortion) in enumerate(models)
    ]  # fmt: skip


def alike(one: captures.Capture, other: captures.Capture) -> None:
    assert (one.name, one.width, one.height) == (other.name, other.width, other.height)
    points = one.camera.unproject(np.random.default_rng(0).uniform(5, 40, (20, 2)), *SIZE)
    points = 3.0 * points + np.asarray(one.camera.to_world)[:3, 3]
    expected = one.camera.project(points, *SIZE)
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(other.camera.project(points, *SIZE), expected, atol=1e-9)


def test_colmap_there_and_back(tmp_path):
    captures.write_colmap(tmp_path / "sparse", views())
    for one, other in zip(views(), captures.read_colmap(tmp_path / "sparse"), strict=True):
        alike(one, other)


def test_transforms_there_and_back(tmp_path):
    captures.write_transforms(tmp_path / "transforms.json", views())
    again = captures.read_transforms(tmp_path / "transforms.json")
    for one, other in zip(views(), again, strict=True):
        alike(one, other)


def test_colmap_by_its_documentation(tmp_path):
    """A half turn about y, 2 m back: R is diag(-1, 1, -1), and C = -R' t."""
    (tmp_path / "cameras.txt").write_text("# cameras\n7 SIMPLE_RADIAL 64 48 50 32 24 0.1\n")
    (tmp_path / "images.txt").write_text("# images\n1 0 0 1 0 0.5 0 2 7 a b.jpg\n1 2 3\n")
    (view,) = captures.read_colmap(tmp_path)
    assert view.name == "a b.jpg" and view.camera.intrinsics == (50.0, 50.0, 31.5, 23.5)
    assert view.camera.distortion == (0.1, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(np.asarray(view.camera.to_world)[:3, 3], [0.5, 0.0, 2.0])
    pixel = view.camera.project([0.5, 0.0, 1.0], *SIZE)  # a metre ahead along the world's -z
    np.testing.assert_allclose(pixel, [31.5, 23.5], atol=1e-9)


def test_transforms_of_blender_have_an_angle(tmp_path):
    frame = {"file_path": "./r_0", "transform_matrix": np.eye(4).tolist()}
    text = json.dumps({"camera_angle_x": 2.0 * np.arctan(0.5), "frames": [frame]})
    (tmp_path / "t.json").write_text(text)
    (view,) = captures.read_transforms(tmp_path / "t.json", (64, 48))
    np.testing.assert_allclose(view.camera.intrinsics, (64.0, 64.0, 31.5, 23.5))
    np.testing.assert_allclose(view.camera.project([0.1, 0.2, -1.0], *SIZE), [37.9, 10.7])
    with pytest.raises(SceneError, match="give size"):
        captures.read_transforms(tmp_path / "t.json")


@pytest.mark.parametrize(
    ("cameras_text", "images", "words"),
    [
        ("1 SPHERE 64 48 50 32 24\n", "", "SPHERE is not read"),
        ("1 PINHOLE 64 48 50 32\n", "", "PINHOLE has 4 parameters, not 2"),
        ("1 PINHOLE\n", "", "2 words, not 5"),
        ("1 PINHOLE 64 48 50 50 32 24\n", "1 1 0 0 0 0 0 0 2 a\n\n", "no image of a camera"),
        ("1 PINHOLE 64 48 50 50 32 24\n", "1 1 0 0 0 0 0 x 1 a\n\n", ":1: is no image"),
    ],
)
def test_models_that_cannot_be_read(tmp_path, cameras_text, images, words):
    (tmp_path / "cameras.txt").write_text(cameras_text)
    (tmp_path / "images.txt").write_text(images)
    with pytest.raises(SceneError, match=words):
        captures.read_colmap(tmp_path)


def test_other_bad_input(tmp_path):
    with pytest.raises(UnknownKindError, match="opencv"):
        conventions.to_world(np.eye(4), "open_cv")
    for bad in (np.zeros((4, 4)), np.eye(3)):
        with pytest.raises(SceneError, match="pose"):
            conventions.to_world(bad, "opencv")
    (tmp_path / "t.json").write_text('{"frames": [{"w": 1, "h": 1}]}')
    with pytest.raises(SceneError, match="is no transforms"):
        captures.read_transforms(tmp_path / "t.json")
    sphere = cameras.Calibrated(model="double_sphere", distortion=(0.1, 0.5))
    for write in (captures.write_colmap, captures.write_transforms):
        with pytest.raises(SceneError, match="has no double_sphere"):
            write(tmp_path / "x", [captures.Capture("a", sphere, 64, 48)])
