"""One scene, one device, one seed: one picture, however the work is cut up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import bvh
from tests.pictures.support import with_film

SPP = 16


def cornell(scenes: Path, **film: object) -> clpt.Scene:
    """The Cornell box of the tests."""
    return with_film(clpt.load(scenes / "cornell.xml"), **{"mode": "rgb", **film})


@pytest.fixture(scope="module")
def once(scenes: Path) -> np.ndarray:
    """The Cornell box in one step."""
    return clpt.render(cornell(scenes), SPP)


def test_repeat(scenes: Path, once: np.ndarray) -> None:
    assert np.array_equal(clpt.render(cornell(scenes), SPP), once)


@pytest.mark.parametrize("steps", [(1, 7, 8), (5, 11), (1,) * 16])
def test_split_into_steps(scenes: Path, once: np.ndarray, steps: tuple[int, ...]) -> None:
    renderer = clpt.Renderer(cornell(scenes))
    for step in steps:
        assert renderer.run(step)
    assert np.array_equal(renderer.image(), once)


def test_several_planes(scenes: Path, once: np.ndarray) -> None:
    """Few slots give a pixel one plane, many several."""
    for slots in (512, 2304, 1 << 15):
        assert np.array_equal(clpt.render(cornell(scenes), SPP, slots=slots), once)


def test_fewer_cores(scenes: Path, once: np.ndarray) -> None:
    """One core takes fewer slots."""
    if not clpt.device.choose().info.is_cpu:
        pytest.skip("needs a CPU")
    assert np.array_equal(clpt.render(cornell(scenes), SPP, threads=1), once)


def test_who_runs_the_loop_changes_no_bit(scenes: Path) -> None:
    """Slots own their pixels: in which order they are shaded, and beside whom, does not matter."""
    scene = with_film(clpt.load(scenes / "glass_metal.xml"), mode="rgb")
    images = [clpt.render(scene, 2, looped=looped) for looped in (True, False)]
    images.append(clpt.render(scene, 2, slots=64))  # of which most are masked out
    assert images[0].max() > 0.0
    for image in images[1:]:
        np.testing.assert_array_equal(image, images[0])


@pytest.mark.parametrize("layout", bvh.LAYOUTS)
def test_layouts_agree(scenes: Path, once: np.ndarray, layout: str) -> None:
    """Every layout finds the same hits, but for rays that meet an edge or two surfaces at once."""
    image = clpt.render(cornell(scenes), SPP, layout=layout)
    off = np.abs(image - once).max(axis=2) > 1e-3 * (1e-2 + np.abs(once).max(axis=2))
    assert off.mean() < 0.01
    np.testing.assert_allclose(image.mean(), once.mean(), rtol=2e-3)


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (17, 9), (300, 1), (1, 300)])
def test_odd_sizes(size: tuple[int, int]) -> None:
    """Sizes that are no multiple of a tile: every pixel is there and lit by the same sky."""
    width, height = size
    sky = clpt.scene.lights.Constant(radiance=(0.25, 0.5, 1.0))
    film = clpt.scene.Film(width=width, height=height, mode="rgb")
    scene = clpt.Scene(camera=clpt.scene.cameras.Perspective(), lights=[sky], film=film)
    renderer = clpt.Renderer(scene)
    renderer.run(3)
    image = renderer.image()
    assert image.shape == (height, width, 3)
    np.testing.assert_allclose(image, np.broadcast_to([0.25, 0.5, 1.0], image.shape), rtol=1e-6)
    assert renderer._wavefront.counts.samples == 3 * width * height


def test_seeds_differ(scenes: Path, once: np.ndarray) -> None:
    scene = cornell(scenes)
    scene.seed = 1
    other = clpt.render(scene, SPP)
    assert not np.array_equal(other, once)
    np.testing.assert_allclose(other.mean(), once.mean(), rtol=0.05)
    renderer = clpt.Renderer(cornell(scenes))
    renderer.reset(seed=1)
    renderer.run(SPP)
    assert renderer.scene.seed == 1
    np.testing.assert_array_equal(renderer.image(), other)


def test_a_stopped_step_leaves_a_valid_picture(scenes: Path) -> None:
    """Pixels then differ in their number of samples, but each is an average."""
    renderer = clpt.Renderer(cornell(scenes, width=20, height=20), slots=64)
    assert not renderer.run(4096, lambda progress: progress.samples < 8)
    image = renderer.image()
    assert np.isfinite(image).all() and image.min() >= 0.0 and image.mean() > 0.01
    assert renderer._wavefront.counts.samples < 4096 * 400
