"""A medium whose albedo is a grid of colours, against a random walk of numpy in float64.

Between the points of a grid spectra are interpolated, not their coefficients: the picture at a
wavelength is that of a grid of numbers, each the reflectance of a point's colour there.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.arrays import Floats
from clpt.scene import Film, Scene, lights, materials, media, shapes
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path
from clpt.spectra import Tabulated, uplift
from clpt.spectra.upsampling import evaluate

SIZE, SIGMA_T, DEPTH = 6, 6.0, 6  # points along a side, [1/m], most vertices of a path and its end
WALKS = 150_000
RNG = np.random.default_rng(47)
DENSITY = RNG.uniform(0.1, 1.0, (SIZE,) * 3)
COLOURS = RNG.random((SIZE, SIZE, SIZE, 3)) ** 2  # deep colours and dark ones
COLOURS[::2, ::2, ::2] = [0.98, 0.05, 0.02]


def trilinear(grid: Floats, p: Floats) -> Floats:
    """Values of a grid (n, n, n, ...) at points (k, 3) of the unit cube; points are at centres."""
    at = np.clip(p * SIZE - 0.5, 0.0, SIZE - 1.0)
    first = np.minimum(at.astype(int), SIZE - 2)
    part = at - first
    total = np.zeros(len(p))
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.where(corner, part, 1.0 - part).prod(axis=1)
        total = total + weight * grid[tuple((first + corner).T)]
    return total


def walk(albedo: Floats, seed: int) -> tuple[float, float]:
    """The mean radiance of rays along -z into the cube under light of 1, and its standard error.

    Delta tracking (Woodcock 1965), scattering to all sides.
    """
    rng = np.random.default_rng(seed)
    p = np.column_stack([rng.random((WALKS, 2)), np.full(WALKS, 1.0)])
    d = np.tile([0.0, 0.0, -1.0], (WALKS, 1))
    radiance, beta, left = np.zeros(WALKS), np.ones(WALKS), np.full(WALKS, DEPTH - 1)
    rows = np.arange(WALKS)
    while len(rows):
        p = p - np.log1p(-rng.random(len(rows)))[:, None] / SIGMA_T * d
        within = ((p > 0.0) & (p < 1.0)).all(axis=1)
        radiance[rows[~within]] = beta[rows[~within]]
        rows, p, d = rows[within], p[within], d[within]
        met = rng.random(len(rows)) < trilinear(DENSITY, p)
        beta[rows[met]] *= trilinear(albedo, p[met])
        z, angle = rng.uniform(-1, 1, met.sum()), rng.uniform(0, 2 * np.pi, met.sum())
        across = np.sqrt(1.0 - z**2)
        d[met] = np.column_stack([across * np.cos(angle), across * np.sin(angle), z])
        goes_on = ~met | (left[rows] > 0)
        left[rows[met]] -= 1
        rows, p, d = rows[goes_on], p[goes_on], d[goes_on]
    return radiance.mean(), radiance.std(ddof=1) / np.sqrt(WALKS)


@pytest.fixture(scope="module")
def bands() -> tuple[Floats, Floats, Floats]:
    """Wavelengths of the bands, and the mean and its standard error that clpt has in each."""
    medium = media.Grid(
        density=DENSITY.astype(np.float32), sigma_t=SIGMA_T, albedo=1.0,
        albedo_grid=COLOURS.astype(np.float32),
    )  # fmt: skip
    place = tf.translate([0.5, 0.5, 0.5]) @ tf.scale(0.5)
    view = tf.look_at([0.5, 0.5, 3], [0.5, 0.5, 0], [0, 1, 0])
    film = Film(width=8, height=8, mode="spectral", bands=12, lambda_min=400, lambda_max=700)
    scene = Scene(
        camera=Orthographic(to_world=view @ tf.scale([0.5, 0.5, 1])),
        shapes=[shapes.Cube(material=materials.Null(), interior=medium, to_world=place)],
        lights=[lights.Constant(radiance=Tabulated([300, 900], [1, 1], "hold"))], film=film,
        integrator=Path(max_depth=DEPTH, rr_depth=100, light_paths=0),
    )  # fmt: skip
    means = []
    with clpt.Renderer(scene) as renderer:
        for seed in range(8):
            renderer.reset(seed=seed)
            renderer.run(512)
            means.append(np.asarray(renderer.image(), np.float64).mean(axis=(0, 1)))
    return film.band_centres, np.mean(means, axis=0), np.std(means, axis=0, ddof=1) / np.sqrt(8)


@pytest.mark.parametrize("band", [0, 2, 4, 6, 8, 11])
def test_spectra_are_interpolated(band: int, bands: tuple[Floats, Floats, Floats]) -> None:
    """Within 5 standard errors of both; .3 % more for the curvature of spectra in a band."""
    lambdas, means, errors = bands
    albedo = evaluate(uplift(COLOURS), lambdas[band])
    expected, error = walk(albedo, band)
    spread = np.hypot(error, errors[band])
    assert spread < 0.01 * expected
    assert abs(means[band] - expected) < 5.0 * spread + 0.003 * expected, means[band] / expected


def test_coefficients_interpolated_would_differ(bands: tuple[Floats, Floats, Floats]) -> None:
    """The comparison can fail: the mean albedo of cells by mean coefficients is another."""
    lambdas = bands[0]
    corners = np.stack(
        [uplift(COLOURS)[x:, y:, z:][:5, :5, :5] for x, y, z in itertools.product((0, 1), repeat=3)]
    )
    apart = evaluate(corners.mean(axis=0), lambdas)
    linear = evaluate(corners, lambdas).mean(axis=0)
    assert np.abs(apart.mean(axis=(0, 1, 2)) / linear.mean(axis=(0, 1, 2)) - 1.0).max() > 0.05
