"""Poses in the conventions of other tools: points that they project are found in the picture."""

from __future__ import annotations

import json

import numpy as np
import pytest

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
