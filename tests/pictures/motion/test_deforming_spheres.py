"""Many spheres that move by themselves: against formulas, and what is refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.errors import SceneError
from clpt.render.edit.scene_edit import between
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, lights, materials, shapes
from clpt.scene.motion import Deformation, Keys, Shutter
from tests.pictures.motion.test_deforming import OPEN, scene

ASIDE = (3.0, 3.0, 0.0, 0.1)  # where the camera does not look
FAR = np.array([[3.0, -3.0, 0.0], [-3.0, -3.0, 0.0]], np.float32)


def dust(*keys: Any, times: Any = (0.0, 1.0), **given: Any) -> shapes.Spheres:
    """One sphere that moves (x, y, z, radius) behind one that does not."""
    points = np.array([[ASIDE, key] for key in keys], np.float32)
    moving = {"centers": points[0], "deformation": Deformation(times, points)}
    return shapes.Spheres(**{**moving, **given})


def covered(ball: shapes.Spheres, still: Any = ()) -> Scene:
    """The scene of a sphere that moves, with others that do not, of the same program."""
    return scene([shapes.Spheres(centers=FAR, radii=0.1), ball, *still])


def test_coverage_of_spheres_that_grow_and_move() -> None:
    """Parallel rays: of one that grows a pixel sees it for the share of the time at which its
    radius is larger than the distance; of one that passes, for the chord over its way."""
    x = (np.arange(32) + 0.5) / 16.0 - 1.0
    far = np.hypot(x[:, None], x)
    grown = dust((0, 0, 0, 0.25), (0, 0, 0, 0.75))
    passing = dust((-2, 0, 0, 0.4), (0, 0, 0, 0.4), (1, 0, 0, 0.4), times=(0.0, 0.5, 1.0))
    x, y = -x, x[::-1, None]  # to the right of the film x falls
    half = np.sqrt(np.maximum(0.4**2 - y**2, 0.0))  # of the chord
    ends = np.stack([x - half, x + half])  # where the centre is while the pixel is covered
    there = np.where(ends < 0, (np.clip(ends, -2, 0) + 2) / 4, 0.5 + np.clip(ends, 0, 1) / 2)
    passed = there[1] - there[0]
    shown = 1.0 - np.clip((far - 0.25) / 0.5, 0.0, 1.0)
    noise = 5.5 * 0.5 / np.sqrt(512)  # 5 sigma of a pixel and a bit
    with clpt.Renderer(covered(grown)) as renderer:  # one program for both
        for ball, expected in ((grown, shown), (passing, passed)):
            renderer.update(scene=covered(ball))
            renderer.run(512)
            found = np.asarray(renderer.image())[..., 3]
            # a pixel sees a mean over its width: the edge of the way is left out
            inside = np.abs(np.abs(y) - 0.4)[:, 0] > (0.06 if ball is passing else 0.0)
            assert np.abs(found - expected)[inside].max() < noise + 0.012
            assert abs((found - expected)[inside].mean()) < 0.006


def test_rows_and_boxes() -> None:
    """A sphere has a row for each key, side by side; its box is around them. Without a time for
    which the shutter is open there is no word of it."""
    keys = Deformation([0.0, 1.0], [[[0, 0, 0, 0.1], ASIDE], [[1, 2, 0, 0.4], ASIDE]])
    ball = shapes.Spheres(centers=np.asarray(keys.points[0]), deformation=keys)
    thick = transforms.scale(2.0)
    lowered = lower(scene([dataclasses.replace(ball, to_world=thick)], Shutter(0.0, 0.5)))
    rows = lowered.tables["spheres"].view(np.float32)[:16].reshape(2, 2, 4)
    assert np.allclose(rows[0], [[0, 0, 0, 0.2], [1, 2, 0, 0.5]], atol=1e-6)
    assert np.array_equal(rows[1, 0], rows[1, 1])
    assert np.allclose(lowered.boxes[0], [[-0.2, -0.2, -0.5], [1.5, 2.5, 0.5]], atol=1e-5)
    assert (lowered.boxes[0, 0] <= (rows[0, :, :3] - rows[0, :, 3:]).min(axis=0)).all()
    assert lowered.features.motion.parts == ("spheres",)
    still = dataclasses.replace(ball, centers=keys.at(0.25)[0], deformation=None)
    found, at_once = lower(scene([ball], Shutter(0.25, 0.25))), lower(scene([still], None))
    assert found.features == at_once.features and found.settings == at_once.settings
    for name, words in found.tables.items():
        assert np.array_equal(words, at_once.tables[name])
    # Keys without radii leave these as they are.
    places = Deformation([0.0, 1.0], [FAR, FAR + 1])
    lowered = lower(scene([shapes.Spheres(centers=FAR, radii=[0.1, 0.2], deformation=places)]))
    rows = lowered.tables["spheres"].view(np.float32)[:16].reshape(2, 2, 4)
    assert np.allclose(rows[:, :, 3], [[0.1, 0.1], [0.2, 0.2]])


def test_what_is_refused() -> None:
    ball = dust((0, 0, 0, 0.1), (1, 0, 0, 0.1))
    few = Deformation([0.0, 1.0], [[ASIDE], [ASIDE]])
    gone = dust((0, 0, 0, 0.1), (1, 0, 0, -0.1)).deformation
    normals = Deformation([0.0, 1.0], [FAR, FAR], [FAR, FAR])
    cases: list[tuple[Any, str]] = [
        (
            dataclasses.replace(ball, deformation=few),
            r"spheres.deformation: its keys have \(1, 4\)",
        ),
        (dataclasses.replace(ball, deformation=3), "must be a Deformation"),
        (dataclasses.replace(ball, centers=None), "needs centers too"),
        (dataclasses.replace(ball, emission=lights.Area()), "emit light cannot deform"),
        (dataclasses.replace(ball, deformation=gone), r"deformation: at 1 s: radii\[1\] must be"),
        (shapes.Spheres(centers=FAR, deformation=normals), "spheres take no normals"),
    ]
    for shape, message in cases:
        with pytest.raises(SceneError, match=message):
            lower(scene([shape]))


def test_motion_between_two_scenes() -> None:
    """Radii move with the centres, wherever they were given."""
    before = shapes.Spheres(centers=FAR, radii=0.1)
    after = [
        (shapes.Spheres(centers=FAR + 1, radii=[0.2, 0.3]), np.column_stack([FAR + 1, [0.2, 0.3]])),
        (shapes.Spheres(centers=FAR, radii=0.3), np.column_stack([FAR, [0.3, 0.3]])),
    ]
    for new, last in after:
        moving, warnings = between(scene([before]), scene([new]))
        keys = moving.shapes[0].deformation
        assert not warnings and keys.times == (0.0, 1.0)
        assert np.allclose(keys.points[0], np.column_stack([FAR, [0.1, 0.1]]))
        assert np.allclose(keys.points[1], last)
        assert lower(moving).features.motion.parts == ("spheres",)
    more = shapes.Spheres(centers=np.concatenate([FAR, FAR]))
    moving, warnings = between(scene([before]), scene([more]))
    assert "its centers do not move, as it had 2 of them" in warnings[0]


def test_scene_file(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    ball = dust((0, 0, 0, 0.25), (1, 0, 0, 0.75), radii=0.5)
    clpt.save(scene([ball]), file)
    again = clpt.load(file).shapes[0]
    assert np.array_equal(again.deformation.points, ball.deformation.points)
    assert np.array_equal(again.centers, ball.centers)


@pytest.mark.slow
def test_the_mean_of_stills() -> None:
    """Spheres of three keys in an instance that turns, beside some of two keys and others that
    stand, curves, a disk and triangles: as the mean of pictures at times."""
    random = np.random.default_rng(3)
    own = np.column_stack([random.uniform(-0.6, 0.6, (40, 3)), random.uniform(0.05, 0.15, 40)])
    points = np.stack([own, own + random.normal(0, 0.1, own.shape) * [1, 1, 1, 0.1], own[::-1]])
    points[..., 3] = np.abs(points[..., 3])
    keys = Deformation([0.0, 0.4, 1.0], points)
    grains = shapes.Spheres(
        centers=own, deformation=keys, material=materials.Conductor(eta=0.2, k=3.0)
    )
    strand = np.array([[-0.8, -0.8, -0.5, 0.05], [0.8, 0.8, -0.5, 0.05]])
    mesh = shapes.Mesh(
        vertices=FAR[[0, 1, 1]] + np.array([[0, 0, 0], [0, 0, 0], [0, 6, 0]], np.float32),
        faces=[[0, 1, 2]],
        to_world=transforms.translate([0, 0, 2]),
    )
    turns = Keys([0.0, 1.0], [np.eye(4), transforms.rotate([0, 0, 1], 20)])
    things = [
        shapes.Instance(group=shapes.Group((grains,)), motion=turns),
        dust((-0.5, 0.5, -0.5, 0.1), (0.5, 0.5, -0.5, 0.3)),
        shapes.Spheres(centers=FAR / 5, radii=0.1),
        shapes.Curves(points=strand, basis="linear"),
        shapes.Disk(to_world=transforms.translate([0, 0, 1.5]), material=materials.Diffuse()),
        mesh,
    ]
    moving = scene(things)

    def picture(shutter: Shutter, spp: int) -> np.ndarray:
        camera = dataclasses.replace(moving.camera, shutter=shutter)
        return np.array(clpt.render(dataclasses.replace(moving, camera=camera), spp))

    count = 64
    times = (np.arange(count) + 0.5) / count
    mean = np.mean([picture(Shutter(t, t), 64) for t in times], axis=0)
    found = picture(OPEN, 4096)
    assert abs(found.mean() - mean.mean()) < 0.003 * mean.mean()
    assert np.sqrt(np.mean((found - mean) ** 2)) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("carried", [False, True])
def test_the_layer_of_motion(carried: bool) -> None:
    """A moment after the shutter has opened all lies ahead: the way of the centre, and by the
    radius away from it."""
    moment = Shutter(shape=[1.0, *[0.0] * 255])
    ball = dust((0, 0, 0, 0.5), (0.25, 0.125, 0, 0.75))
    if carried:
        turn = [np.eye(4), transforms.translate([0, 0.5, 0]) @ transforms.rotate([0, 0, 1], 30)]
        ball = dataclasses.replace(ball, motion=Keys([0.0, 1.0], turn))
    given = scene([ball], moment)
    film = dataclasses.replace(given.film, layers=("motion",))
    with clpt.Renderer(dataclasses.replace(given, film=film)) as renderer:
        renderer.run(64)
        found = renderer.layers()["motion"]
    x = (np.arange(32) + 0.5) / 16.0 - 1.0
    p = np.stack([*np.meshgrid(-x, -x), np.zeros((32, 32)), np.ones((32, 32))], axis=2)
    last = p * [1.5, 1.5, 1.5, 1.0] + [0.25, 0.125, 0, 0]
    if carried:
        last = last @ turn[1].T
    way = (last - p)[..., :2] * [-16, 16]
    inside = np.hypot(x[:, None], x) < 0.4
    np.testing.assert_allclose(found[inside, 2:], way[inside], rtol=0.05, atol=0.25)
    np.testing.assert_allclose(found[inside, :2], 0.0, atol=0.05)
