"""Independent exposures of a scene, and how likely it is that two sets of them agree."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy import stats

import clpt
from clpt.device import Device
from clpt.scene import Scene, integrators
from clpt.spectra import cie

SIGNIFICANCE = 1e-4  # of every statistical test here: how often a right program would fail it
ROUNDING = 1e-5  # relative error of a picture in float32

Values = NDArray[np.float64]


def with_film(scene: Scene, **changes: Any) -> Scene:
    """The scene with another film: mode, width, height, filter, lambda_min, lambda_max."""
    return dataclasses.replace(scene, film=dataclasses.replace(scene.film, **changes))


def with_path(scene: Scene, **changes: Any) -> Scene:
    """The scene under the path integrator, with these parameters and else its own."""
    own = scene.integrator if isinstance(scene.integrator, integrators.Path) else integrators.Path()
    return dataclasses.replace(scene, integrator=dataclasses.replace(own, **changes))


def quick(names: Any, *chosen: Any) -> list[Any]:
    """Return all names as parameters of a test; those that are not `chosen` are slow."""
    return [pytest.param(n, marks=() if n in chosen else pytest.mark.slow) for n in names]


def exposures(scene: Scene, count: int, spp: int, first_seed: int = 1, **wavefront: Any) -> Values:
    """Render `count` times with different seeds: (count, h, w, 3) float64."""
    renderer = clpt.Renderer(scene, **wavefront)
    images = []
    for seed in range(first_seed, first_seed + count):
        renderer.reset(seed=seed)
        assert renderer.run(spp)
        assert renderer._wavefront.counts.rejected == 0, "samples were not finite"
        images.append(renderer.image().astype(np.float64))
    return np.array(images)


def mitsubas(path: Path, count: int, spp: int) -> Values:
    """Mitsuba's pictures of a file in RGB, (count, height, width, 3); skips without Mitsuba."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("scalar_rgb")
    loaded = mi.load_file(str(path))
    images = [np.array(mi.render(loaded, spp=spp, seed=i))[:, :, :3] for i in range(count)]
    return np.array(images, np.float64)


def layers_of(scene: Scene, spp: int, **options: Any) -> dict[str, NDArray[np.float32]]:
    """Return the layers of a film by name."""
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(spp)
        return renderer.layers()


def pictures_of_parts(scene: Scene) -> list[Values]:
    """Pictures of twelve samples: rendered in one go, and in parts."""
    images = []
    for parts in ((12,), (1, 4, 7)):
        with clpt.Renderer(scene) as renderer:
            for part in parts:
                renderer.run(part)
            images.append(renderer.image())
    return images


def blocks(images: ArrayLike, size: int = 4) -> Values:
    """Means over blocks of size x size pixels: (..., h, w, c) to (..., h // size, w // size, c)."""
    a = np.asarray(images, np.float64)
    h, w, c = a.shape[-3] // size, a.shape[-2] // size, a.shape[-1]
    a = a[..., : h * size, : w * size, :].reshape(*a.shape[:-3], h, size, w, size, c)
    return a.mean(axis=(-4, -2))


def agreement(ours: ArrayLike, reference: ArrayLike, allowed: float = 0.0) -> float:
    """How likely such a difference is where both have the same expectation.

    ours: (k, ...), k independent estimates of each value; reference: (m, ...) likewise, or (1, ...)
    for values that are exact. allowed: a relative difference that is none. Welch's t-test of every
    value; the smallest probability is corrected for their number (Sidak 1967). What float32 rounds
    counts as spread.
    """
    a, b = np.asarray(ours, np.float64), np.asarray(reference, np.float64)
    size = np.abs(b).mean(axis=0)
    va = a.var(axis=0, ddof=1) / len(a) + (ROUNDING * size) ** 2 + 1e-16
    vb = b.var(axis=0, ddof=1) / len(b) if len(b) > 1 else np.zeros(b.shape[1:])
    off = np.abs(a.mean(axis=0) - b.mean(axis=0))
    t = np.maximum(off - allowed * size, 0.0) / np.sqrt(va + vb)
    freedom = va**2 / (len(a) - 1) + (vb**2 / (len(b) - 1) if len(b) > 1 else 0.0)
    p = 2.0 * stats.t.sf(t, (va + vb) ** 2 / freedom)
    return float(-np.expm1(p.size * np.log1p(-min(p.min(), 1.0 - 1e-12))))


def assert_agree(
    ours: ArrayLike, reference: ArrayLike, what: str = "", allowed: float = 0.0
) -> None:
    """Fail where `agreement` is below SIGNIFICANCE; the message tells the means."""
    p = agreement(ours, reference, allowed)
    a, b = np.mean(ours, axis=(0, -3, -2)), np.mean(reference, axis=(0, -3, -2))
    assert p > SIGNIFICANCE, f"{what}: p = {p:.1e}; mean {a}, reference {b}, ratio {a / b}"


def assert_mean(ours: ArrayLike, expected: ArrayLike, within: float, allowed: float = 2e-4) -> None:
    """Fail where the mean picture is off by more than chance, or by more than a share `within`.

    ours: (k, h, w, 3) exposures; expected: (3,) or broadcast to it, the exact mean; allowed: what
    the offset of rays from their surface may change.
    """
    means = np.asarray(ours, np.float64).mean(axis=(1, 2))
    exact = np.broadcast_to(np.asarray(expected, np.float64), means.shape[1:])
    p = agreement(means, exact[None], allowed)
    mean = means.mean(axis=0)
    assert p > SIGNIFICANCE, f"p = {p:.1e}; mean {mean}, expected {exact}, ratio {mean / exact}"
    assert np.allclose(mean, exact, rtol=within, atol=1e-9), f"mean {mean}, expected {exact}"


def assert_bands_are_the_colour(scene: Scene, device: Device) -> None:
    """Bands of 2 nm from 360 nm on, weighted by the observer, are the picture beside them, in each
    pixel."""
    renderer = clpt.Renderer(scene, device)
    renderer.run(64)
    middles = np.arange(361.0, 830.0, 2.0)
    summed = renderer.image() @ cie.cie_xyz(middles) * 2.0 / cie.CIE_Y_INTEGRAL
    np.testing.assert_allclose(summed, renderer.colours(), rtol=0.03, atol=1e-4)


def assert_bands_keep_their_bits(scene: Scene, device: Device) -> None:
    """However samples are split: runs, steps, films that are merged; halves are the whole but for
    rounding."""
    one = clpt.Renderer(scene, device)
    one.run(7)
    whole = one.image()
    assert whole.shape[-1] == 3 and whole.all(axis=2).any()
    one.reset()
    one.run(3)
    state = one.film_state()
    one.step(4).wait()
    assert np.array_equal(one.image(), whole)
    later = clpt.Renderer(scene, device, first_sample=3)
    later.run(4)
    later.merge(state)
    assert np.array_equal(later.image(), whole)
    halves = clpt.Renderer(scene, device, halves=True)
    halves.run(7)
    np.testing.assert_allclose(halves.image(), whole, rtol=1e-5)
