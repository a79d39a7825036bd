"""One scene, one device, one seed: one picture, however the work is cut up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import bvh
from tests.renders.support import with_film

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


@pytest.mark.parametrize(
    ("name", "mode"),
    [pytest.param("plastic", "spectral", marks=pytest.mark.slow), ("glass_metal", "rgb")],
)
def test_queued_shading_changes_nothing(scenes: Path, name: str, mode: str) -> None:
    """Sorted queues and masked blocks shade the same paths with the same numbers.

    What differs is the compiler's choice of instructions; where a path then turns another way, a
    pixel differs as a whole, so few of them may.
    """
    scene = with_film(clpt.load(scenes / f"{name}.xml"), mode=mode)
    sorted_, masked = (clpt.render(scene, 4, queued=queued) for queued in (True, False))
    off = np.abs(sorted_ - masked).max(axis=2) > 1e-3 * (1e-2 + np.abs(masked).max(axis=2))
    assert off.mean() < 0.005
    np.testing.assert_allclose(sorted_.mean(), masked.mean(), rtol=2e-3)


def test_how_queues_are_made_changes_no_bit(scenes: Path) -> None:
    """Slots own their pixels: in which order they are shaded does not matter."""
    scene = with_film(clpt.load(scenes / "glass_metal.xml"), mode="rgb")
    sorted_, appended = (clpt.render(scene, 2, queued=True, looped=way) for way in (True, False))
    assert sorted_.max() > 0.0
    np.testing.assert_array_equal(appended, sorted_)


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
    assert renderer.wavefronts[0].counts.samples == 3 * width * height


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
    assert renderer.wavefronts[0].counts.samples < 4096 * 400
