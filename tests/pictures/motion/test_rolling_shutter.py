"""A rolling shutter: each row of the film sees what moves at a time of its own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene, cameras
from clpt.scene.integrators import ParticleTracer, Path, Vcm
from clpt.scene.lights import Area
from clpt.scene.motion import Keys, Shutter
from clpt.scene.shapes import Rectangle

WIDTH, HEIGHT = 64, 24


def bar(shutter: Shutter, **changes) -> Scene:
    """A bar across all rows, .2 m wide, 4 m away, goes from x = -1 m at 0 s to 1 m at 1 s."""
    ways = Keys([0.0, 1.0], [tf.translate([-1.0, 0.0, 0.0]), tf.translate([1.0, 0.0, 0.0])])
    shape = Rectangle(
        to_world=tf.translate([0, 0, -4]) @ tf.scale([0.1, 5.0, 1.0]),
        emission=Area(radiance=1.0),
        motion=ways,
    )
    camera = cameras.Calibrated(
        intrinsics=(60.0, 60.0, 31.5, 11.5),
        to_world=tf.look_at([0, 0, 0], [0, 0, -1], [0, 1, 0]),
        shutter=shutter,
    )
    scene = Scene(
        camera=camera,
        shapes=[shape],
        film=Film(size=(WIDTH, HEIGHT), mode="rgb"),
        integrator=Path(light_paths=0, max_depth=1),
    )
    return dataclasses.replace(scene, **changes)


def middles(picture) -> np.ndarray:
    """The x [m] of the bar's middle in each row, from the light of its columns."""
    light = picture[..., 0].astype(np.float64)
    column = (light * np.arange(WIDTH)).sum(axis=1) / light.sum(axis=1)
    return (column - 31.5) / 60.0 * 4.0


@pytest.mark.parametrize(("opens", "closes", "readout"), [(0.0, 1.0, 1.0), (0.2, 0.8, 0.4)])
def test_rows_see_their_own_time(opens, closes, readout):
    """The bar's middle in a row is where it is in the middle of the row's exposure, to .01 m."""
    picture = clpt.render(bar(Shutter(opens, closes, readout=readout)), spp=256)
    exposure = closes - opens - readout
    times = opens + readout * np.arange(HEIGHT) / (HEIGHT - 1) + exposure / 2.0
    np.testing.assert_allclose(middles(picture), 2.0 * times - 1.0, atol=0.01)
    lit = (picture[..., 0] > 0.02).sum(axis=1)  # .2 m are 3 pixels, and the way of the exposure
    assert abs(lit.mean() - 60.0 / 4.0 * (0.2 + 2.0 * exposure)) < 1.5


def test_a_crop_has_the_times_of_its_rows():
    scene = bar(Shutter(0.0, 1.0, readout=1.0))
    whole = clpt.render(scene, spp=64)
    film = dataclasses.replace(scene.film, crop=(0, 10, WIDTH, 8))
    part = clpt.render(dataclasses.replace(scene, film=film), spp=64)
    np.testing.assert_allclose(middles(part), middles(whole[10:18]), atol=0.02)


def test_without_motion_it_costs_nothing(tmp_path):
    scene = bar(Shutter(0.0, 1.0, readout=0.5))
    still = [dataclasses.replace(shape, motion=None) for shape in scene.shapes]
    plain = dataclasses.replace(scene.camera, shutter=None)
    first = clpt.render(dataclasses.replace(scene, shapes=still), spp=4)
    second = clpt.render(dataclasses.replace(scene, shapes=still, camera=plain), spp=4)
    np.testing.assert_array_equal(first, second)


def test_a_file_keeps_it(tmp_path):
    scene = bar(Shutter(0.1, 0.6, readout=0.2))
    clpt.save(scene, tmp_path / "scene.json")
    assert clpt.load(tmp_path / "scene.json").camera.shutter == scene.camera.shutter


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"camera": cameras.Lens(shutter=Shutter(0, 1, readout=0.5))}, "time of a row"),
        ({"integrator": Vcm()}, "photons of a pass"),
        ({"integrator": ParticleTracer()}, "a shutter without readout"),
    ],
)
def test_light_paths_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        clpt.Renderer(bar(Shutter(0.0, 1.0, readout=0.5), **changes))


@pytest.mark.parametrize("readout", [-0.1, 0.6, float("nan")])
def test_a_readout_lies_within_the_open_time(readout):
    with pytest.raises(SceneError, match="readout"):
        Shutter(0.5, 1.0, readout=readout)
