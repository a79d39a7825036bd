"""Calibrated cameras: points that are projected are found in the picture."""

from __future__ import annotations

import dataclasses
import logging

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.lenses.projections import Projection
from clpt.scene import Film, Scene, cameras, lights, shapes
from clpt.scene.integrators import Box, Path
from clpt.scene.motion import Keys, Shutter

SIZE = 96, 72
MODELS = {
    "pinhole": ("opencv", [80.0, 84.0, 45.0, 37.5], ()),
    "brown_conrady": ("opencv", [80.0, 80.0, 47.5, 35.5], (-0.25, 0.08, 0.002, -0.003, -0.01)),
    "rational": (
        "opencv", [70.0, 72.0, 47.5, 35.5], (0.4, -0.1, 0.001, 0.002, 0.02, 0.5, -0.05, 0.01)
    ),
    "thin_prism": (
        "opencv", [80.0, 80.0, 47.5, 35.5],
        (0.1, 0.02, 1e-3, 2e-3, 0.0, 0.0, 0.0, 0.0, 3e-3, -1e-3, 2e-3, 4e-3),
    ),
    "equidistant": ("kannala_brandt", [35.0, 35.0, 47.5, 35.5], ()),
    "kannala_brandt": ("kannala_brandt", [36.0, 35.0, 46.0, 36.0], (-0.02, 0.01, -0.003, 1e-3)),
    "fov": ("fov", [50.0, 50.0, 47.5, 35.5], (0.9,)),
    "ucm": ("ucm", [60.0, 60.0, 47.5, 35.5], (0.6,)),
    "eucm": ("eucm", [60.0, 60.0, 47.5, 35.5], (0.6, 1.2)),
    "double_sphere": ("double_sphere", [40.0, 40.0, 47.5, 35.5], (-0.2, 0.6)),
}  # fmt: skip


def random_pose(rng) -> np.ndarray:
    axis = rng.normal(size=3)
    return tf.translate(rng.uniform(-0.5, 0.5, 3)) @ tf.rotate(axis, rng.uniform(0.0, 360.0))


def camera(name: str, rng) -> cameras.Calibrated:
    model, intrinsics, distortion = MODELS[name]
    return cameras.Calibrated(
        model=model, intrinsics=intrinsics, distortion=distortion, to_world=random_pose(rng)
    )


def room(view: cameras.Camera, size=SIZE) -> Scene:
    """A cube around the camera, and layers of rays through the middles of pixels."""
    film = Film(size=size, layers=("position",), filter=Box(radius=0.01), filtering="importance")
    return Scene(
        camera=view, shapes=[shapes.Cube(to_world=tf.scale([2.0, 2.0, 2.0]))], film=film,
        lights=[lights.Constant()], integrator=Path(max_depth=1),
    )  # fmt: skip


def positions(scene: Scene) -> np.ndarray:
    with clpt.Renderer(scene) as renderer:
        renderer.run(16)
        return np.asarray(renderer.layers()["position"], np.float64)


@pytest.mark.parametrize("name", MODELS)
def test_points_of_the_picture_project_to_their_pixels(name):
    """What pixel (x, y) sees lies at x, y by the formula, to a hundredth of a pixel."""
    for seed in range(2):
        view = camera(name, np.random.default_rng(seed))
        seen = positions(room(view))
        pixels = view.project(seen, *SIZE)
        x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
        away = np.linalg.norm(pixels - np.stack([x, y], -1), axis=-1)
        lit = np.abs(seen).max(axis=-1) > 1.0
        assert lit.mean() > 0.9 and away[lit].max() < 0.01, np.nanmax(away)


@pytest.mark.parametrize("name", MODELS)
def test_a_small_lamp_is_where_it_is_projected(name):
    """The pixel of a ball of 1/50 px is lit, and no other."""
    rng = np.random.default_rng(7)
    view = camera(name, rng)
    at = rng.uniform(8.0, 60.0, 2).round()
    point = tf.transform_points(view.to_world, np.zeros(3)) + 1.5 * view.unproject(at, *SIZE)
    np.testing.assert_allclose(view.project(point, *SIZE), at, atol=1e-9)
    ball = shapes.Sphere(center=tuple(point), radius=4e-4, emission=lights.Area())
    scene = room(view)
    scene = dataclasses.replace(scene, shapes=[ball], lights=[])
    image = clpt.render(scene, spp=4)[..., 1]
    assert np.argwhere(image > 0.0)[:, ::-1].tolist() == [at.astype(int).tolist()]


def test_pixels_that_cannot_be_inverted_are_black_and_counted(caplog):
    view = cameras.Calibrated(intrinsics=[60, 60, 47.5, 35.5], distortion=(-0.4, 0.0, 0.0, 0.0))
    scene = dataclasses.replace(room(view), shapes=[])  # under an even sky
    with caplog.at_level(logging.WARNING, "clpt"):
        image = clpt.render(scene, spp=2)[..., 1]
    seen = ~np.isnan(view.unproject(np.stack(np.meshgrid(range(96), range(72)), -1), *SIZE)[..., 0])
    assert 0.3 < seen.mean() < 0.95 and (image[~seen] == 0.0).all()
    assert (image[seen] > 0.0).mean() > 0.96  # pixels on the rim have corners beyond it
    (record,) = [r for r in caplog.records if "cannot be inverted" in r.getMessage()]
    assert f"{(image == 0.0).sum()} of {96 * 72} pixels" in record.getMessage()
    assert np.isnan(view.project([0.0, 0.0, -1.0], *SIZE)).all()  # behind it


def test_a_smaller_film_scales_the_calibration():
    _, intrinsics, distortion = MODELS["brown_conrady"]
    view = cameras.Calibrated(intrinsics=intrinsics, distortion=distortion, size=SIZE)
    seen = positions(room(view, (48, 24)))
    x, y = np.meshgrid(np.arange(48), np.arange(24))
    whole = np.stack([(x + 0.5) * 2.0 - 0.5, (y + 0.5) * 3.0 - 0.5], -1)
    np.testing.assert_allclose(view.project(seen, *SIZE), whole, atol=0.02)


def test_a_file_keeps_it(tmp_path):
    scene = room(camera("double_sphere", np.random.default_rng(1)))
    clpt.save(scene, tmp_path / "scene.json")
    again = clpt.load(tmp_path / "scene.json")
    np.testing.assert_array_equal(positions(again), positions(scene))


POINTS = np.array([[0.3, -0.2, 1.5], [-0.6, 0.5, 1.1], [0.05, 0.9, 2.0]])


BROWN = (-0.3, 0.1, 0.001, 0.002, -0.02)
RATIONAL = (0.4, -0.1, 0.001, 0.002, 0.02, 0.5, -0.05, 0.01)
OPENCV = {  # of cv2.projectPoints and cv2.fisheye.projectPoints, OpenCV 5.0.0
    ("opencv", (0.1, -0.05, 0.001, -0.002)): (
        (420.396641975, 171.720461235), (35.642231343, 481.5326984), (332.534993896, 473.975456689)
    ),
    ("opencv", BROWN): (
        (418.410774738, 173.149428734), (83.138667639, 442.017752341), (332.003385735, 456.75638084)
    ),
    ("opencv", RATIONAL): (
        (419.533428163, 172.386024405), (61.718001607, 460.225318469), (332.46221447, 465.180476415)
    ),
    ("opencv", (*RATIONAL, 0.003, -0.001, 0.002, 0.004)): (
        (419.618425694, 172.451767812), (62.347125301, 461.257997931), (332.746272087, 465.47183384)
    ),
    ("kannala_brandt", (-0.02, 0.01, -0.003, 0.001)): (
        (418.031970687, 173.338259933), (84.339932315, 440.311057532), (331.70533057, 454.909869266)
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", OPENCV, ids=lambda case: f"{case[0]}_{len(case[1])}")
def test_opencv_agrees(case):
    pixels = Projection(*case).project(POINTS) * [500, 510] + [320, 240]
    np.testing.assert_allclose(pixels, OPENCV[case], atol=1e-8)


def test_other_models_agree_with_their_formulas():
    """As their papers write them, a point at a time."""
    x, y, z = 0.3, -0.2, 1.5
    r, omega = np.hypot(x, y), 0.9
    scale = np.arctan(2.0 * r / z * np.tan(omega / 2.0)) / omega / r
    np.testing.assert_allclose(
        Projection("fov", (omega,)).project([x, y, z]), [x * scale, y * scale]
    )
    alpha, beta, xi = 0.6, 1.2, -0.2
    square = x * x + y * y
    for model, k, d in (
        ("ucm", (alpha,), np.sqrt(square + z * z)),
        ("eucm", (alpha, beta), np.sqrt(beta * square + z * z)),
    ):
        below = alpha * d + (1.0 - alpha) * z
        np.testing.assert_allclose(Projection(model, k).project([x, y, z]), [x / below, y / below])
    d1 = np.sqrt(r * r + z * z)
    below = alpha * np.sqrt(r * r + (xi * d1 + z) ** 2) + (1.0 - alpha) * (xi * d1 + z)
    projected = Projection("double_sphere", (xi, alpha)).project([x, y, z])
    np.testing.assert_allclose(projected, [x / below, y / below])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"distortion": (1.0, 2.0)}, "opencv has 0, 4, 5, 8, 12 coefficients, not 2"),
        ({"distortion": (1.0, 2.0, np.nan, 0.0)}, "must be finite"),
        ({"model": "fov", "distortion": (4.0,)}, "omega must lie between 0 and pi"),
        ({"model": "ucm", "distortion": (1.5,)}, "alpha must lie between 0 and 1"),
        ({"model": "double_sphere", "distortion": (-2.0, 0.5)}, "xi must lie"),
        ({"intrinsics": (0.0, 1.0, 2.0, 3.0)}, "calibrated.intrinsics"),
        ({"intrinsics": (1.0, 1.0)}, "calibrated.intrinsics"),
        ({"size": (0, 5)}, "calibrated.size"),
        ({"model": "lens"}, "lens"),
    ],
)
def test_bad_calibrations(arguments, words):
    with pytest.raises(SceneError, match=words):
        clpt.render(room(cameras.Calibrated(**arguments)), spp=1)


def test_z_is_along_the_axis():
    view = room(camera("kannala_brandt", np.random.default_rng(4)))
    view.film = dataclasses.replace(view.film, layers=("position", "z"))
    with clpt.Renderer(view) as renderer:
        renderer.run(1)
        layers = renderer.layers()
    pose = np.asarray(view.camera.to_world)
    along = (layers["position"] - pose[:3, 3]) @ pose[:3, 2]
    np.testing.assert_allclose(layers["z"][..., 0], along, atol=1e-5)
    assert along.max() > 1.0 and np.ptp(along) > 0.1


def test_a_stereo_rig_shares_a_scene():
    """A point lies f b / z farther left for the right camera, whose picture is a new renderer's."""
    left = camera("pinhole", np.random.default_rng(6))
    place = np.asarray(left.to_world) @ tf.translate([-0.1, 0.0, 0.0])
    right = dataclasses.replace(left, to_world=place)
    with clpt.Renderer(room(left)) as renderer:
        renderer.run(4)
        seen = np.asarray(renderer.layers()["position"], np.float64)
        renderer.update(camera=right)
        renderer.run(4)
        np.testing.assert_array_equal(renderer.image(), clpt.render(room(right), spp=4))
    away = (seen - place[:3, 3]) @ place[:3, 2]
    disparity = left.project(seen, *SIZE) - right.project(seen, *SIZE)
    np.testing.assert_allclose(disparity[..., 0], 80.0 * 0.1 / away, atol=1e-6)
    np.testing.assert_allclose(disparity[..., 1], 0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["brown_conrady", "kannala_brandt", "double_sphere"])
def test_motion_is_by_the_model(name):
    """Where a still room is seen as the camera has moved on, after what `project` says."""
    ways = Keys([0.0, 1.0], [np.eye(4), tf.translate([0.1, -0.05, 0.0])])
    still = camera(name, np.random.default_rng(4))
    view = dataclasses.replace(
        still, motion=ways, shutter=Shutter(0.0, 1.0, shape=[1.0] + [0.0] * 255)
    )
    scene = room(view)
    scene.film = dataclasses.replace(scene.film, layers=("position", "motion"))
    with clpt.Renderer(scene) as renderer:
        renderer.run(16)
        layers = renderer.layers()
    later = dataclasses.replace(still, to_world=ways.transforms[1] @ np.asarray(still.to_world))
    there = later.project(layers["position"], *SIZE)
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    expected = np.stack([there[..., 0] - x, y - there[..., 1]], -1)
    seen = np.isfinite(expected).all(axis=-1) & (np.abs(layers["position"]).max(axis=-1) > 1.0)
    assert seen.mean() > 0.9
    np.testing.assert_allclose(layers["motion"][..., 2:][seen], expected[seen], atol=0.05)
