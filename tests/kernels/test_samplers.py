"""Samplers: uniform, stratified where they claim to be, and unrelated where they must be.

Significance: every statistical test below fails with a probability of about 1e-6 for a perfect
sampler; the seeds are fixed, so a run is either always or never unlucky.
"""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
from scipy import stats

from clpt.scene.integrators import SAMPLERS
from tests.kernels.scene_harness import SceneProbe
from tests.rotation import rotating

BODY = """
    Sampler sampler = sampler_start(SEED, to_natural(x[0]), to_natural(x[1]));
    vec2 u = sampler_pair(sampler, to_natural(x[2]));
    r[0] = u.x; r[1] = u.y;
"""
KINDS = [cls.kind for cls in SAMPLERS]
SIGNIFICANCE = 1e-6


@cache
def _probe(kind, seed, lanes):
    return SceneProbe(
        BODY, 3, 2, files=(f"samplers/kinds/{kind}.cl",), lanes=lanes, defines={"SEED": f"{seed}u"}
    )


def pairs(kind, pixel, sample, dimension, seed=0, lanes=8):
    """Points (n, 2) for whole numbers that broadcast against each other."""
    given = np.broadcast_arrays(pixel, sample, dimension)
    return _probe(kind, seed, lanes)(*(np.ravel(g) for g in given)).T


def _is_net(points, k):
    """Whether 2^k points have exactly one in every elementary interval of area 2^-k."""
    n = 1 << k
    for across in range(k + 1):
        columns = (points[:, 0] * (1 << across)).astype(int)
        rows = (points[:, 1] * (1 << (k - across))).astype(int)
        if len(np.unique(columns * (1 << (k - across)) + rows)) != n:
            return False
    return True


@pytest.mark.parametrize("seed", [0, 1, 0xDEADBEEF])
def test_sobol_pairs_are_nets(seed):
    """(0, k, 2)-nets in base 2 for every k, scrambled as they are, also in later blocks."""
    k = 10
    for pixel in (0, 1, 77, 1_000_003):
        for dimension in (0, 1, 2, 3, 12, 51):
            points = pairs("sobol", pixel, np.arange(1 << k), dimension, seed)
            for smaller in range(k + 1):
                assert _is_net(points[: 1 << smaller], smaller)
            assert _is_net(points[256:512], 8)


@pytest.mark.parametrize("seed", [0, 0xDEADBEEF])
def test_sobol_groups_of_four_are_nets(seed):
    """(0, k, 4)-nets in base 4: a point in every box of volume 4^-k, sides powers of 1/4."""
    k = 4
    for pixel in (0, 1_000_003):
        for dimension in (0, 4, 50, 0x50000):
            both = [pairs("sobol", pixel, np.arange(4**k), dimension + i, seed) for i in range(2)]
            points = np.concatenate(both, axis=1)
            for smaller in range(1, k + 1):
                for sides in itertools.product(range(smaller + 1), repeat=4):
                    if sum(sides) == smaller:
                        scale = 4.0 ** np.array(sides)
                        boxes = (points[: 4**smaller] * scale).astype(int)
                        assert len(np.unique(boxes, axis=0)) == 4**smaller


def test_sobol_scrambles_deeply():
    """Owen's scrambling moves every bit: within an elementary interval points are uniform."""
    count = 4096
    for sample in (0, 5):
        points = pairs("sobol", np.arange(count), sample, 3)
        for axis in range(2):
            for strata in (1, 256):
                inside = (points[:, axis] * strata) % 1.0
                assert stats.kstest(inside, "uniform").pvalue > SIGNIFICANCE


@pytest.mark.parametrize("kind", KINDS)
def test_uniform(kind):
    """Chi-square over 32 x 32 cells of points from many pixels and dimensions, one sample each."""
    pixel, dimension = np.meshgrid(np.arange(1024), np.arange(64))
    points = pairs(kind, pixel, 3, dimension)
    counts, _, _ = np.histogram2d(*points.T, bins=32, range=[[0, 1], [0, 1]])
    assert stats.chisquare(counts.ravel()).pvalue > SIGNIFICANCE
    assert points.min() >= 0.0
    assert points.max() < 1.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("other", ["pixel", "far pixel", "dimension", "far dimension", "axis"])
def test_unrelated(kind, other):
    """Joint chi-square of one number and another of a neighbour, a far one, or the same pair.

    Whole pixels are pooled: their own points are stratified, but their pairings are not.
    """
    step = {"pixel": (1, 0), "far pixel": (4096, 0), "dimension": (0, 1), "far dimension": (0, 8)}
    pixel, dimension = np.meshgrid(np.arange(2048), np.arange(8))
    move, turn = step.get(other, (0, 0))
    for sample in (0, 1, 6):
        a = pairs(kind, pixel, sample, dimension)
        b = pairs(kind, pixel + move, sample, dimension + turn)
        for first, second in ((0, 1),) if other == "axis" else ((0, 0), (1, 1), (0, 1)):
            counts, _, _ = np.histogram2d(
                a[:, first], b[:, second], bins=16, range=[[0, 1], [0, 1]]
            )
            assert stats.chisquare(counts.ravel()).pvalue > SIGNIFICANCE


@pytest.mark.parametrize("kind", KINDS)
def test_samples_of_a_pixel_pair_up_at_random(kind):
    """Across dimension pairs the samples of a pixel have no common order: correlation below 5 s."""
    n, close = 256, 0
    for pixel in range(64):
        a = pairs(kind, pixel, np.arange(n), 0)[:, 0]
        b = pairs(kind, pixel, np.arange(n), 1)[:, 0]
        close += abs(np.corrcoef(a, b)[0, 1]) > 5.0 / np.sqrt(n)
    assert close == 0


@pytest.mark.parametrize("kind", KINDS)
def test_seeds_differ(kind):
    a, b = (pairs(kind, np.arange(4096), 2, 0, seed)[:, 0] for seed in (1, 2))
    assert np.mean(a == b) < 0.01
    assert abs(np.corrcoef(a, b)[0, 1]) < 5.0 / np.sqrt(len(a))


@rotating("kind, lanes", KINDS, (8, 16))
def test_all_lane_widths_give_the_same_bits(kind, lanes):
    rng = np.random.default_rng(8)
    pixel, sample, dimension = (rng.integers(0, 1 << b, 512) for b in (20, 16, 7))
    single = pairs(kind, pixel, sample, dimension, lanes=1)
    np.testing.assert_array_equal(pairs(kind, pixel, sample, dimension, lanes=lanes), single)


ON_FILM = """
    natural key = pixel_key(scene.settings, to_integer(x[0]));
    Sampler sampler = pixel_sampler(scene.settings, key, to_integer(x[1]));
    vec2 u = sampler_pair(sampler, to_natural(x[2]));
    r[0] = u.x; r[1] = u.y;
"""
SIDE, BITS = 32, 2  # of the film [pixels], and how many samples a pixel takes, 4


@pytest.fixture(scope="module")
def along_the_curve():
    """Points (n, 2) of zsobol for pixels x, y of a film, samples and dimensions."""
    settings = {"tiles_x": SIDE // 4, "sample_bits": BITS, "seed": 3}
    files = ("samplers/kinds/zsobol.cl", "samplers/pixel_sampler.cl#z")
    probe = SceneProbe(ON_FILM, 3, 2, files=files, settings=settings)

    def points(x, y, sample, dimension):
        place = (y // 4 * (SIDE // 4) + x // 4) * 16 + y % 4 * 4 + x % 4
        given = np.broadcast_arrays(place, sample, dimension)
        return probe(*(np.ravel(g) for g in given)).T

    return points


def _square(side, left=0, top=0):
    """Pixels x and y of a square, each for all samples of the first part."""
    x, y, sample = np.meshgrid(
        np.arange(left, left + side), np.arange(top, top + side), np.arange(1 << BITS)
    )
    return x, y, sample


def test_zsobol_squares_share_a_net(along_the_curve):
    """All samples of a square of pixels are a net together, whatever the square and dimension."""
    for k, corners in ((0, ((0, 0), (5, 18))), (2, ((4, 8), (28, 12))), (4, ((0, 0), (16, 0)))):
        for left, top in corners:
            x, y, sample = _square(1 << k, left, top)
            for dimension in (0, 1, 9):
                for part in (0, 3):
                    points = along_the_curve(x, y, sample + (part << BITS), dimension)
                    assert _is_net(points, 2 * k + BITS)


def test_zsobol_is_uniform_over_parts(along_the_curve):
    """Chi-square of a pixel's numbers over parts of its sequence and dimensions, pooled."""
    part, dimension = np.meshgrid(np.arange(512), np.arange(32))
    for x, y in ((0, 0), (13, 30)):
        points = along_the_curve(x, y, part << BITS, dimension)
        counts, _, _ = np.histogram2d(*points.T, bins=16, range=[[0, 1], [0, 1]])
        assert stats.chisquare(counts.ravel()).pvalue > SIGNIFICANCE


def test_zsobol_errs_less_after_a_blur(along_the_curve):
    """Of a smooth integral a pixel errs alike, a square of 4 x 4 less than a third of sobol's.

    Over many dimensions: in one of them, pixels have a kind of net in common.
    """
    x, y, sample = _square(SIDE)
    place = (y * SIDE + x).ravel()
    exact = (1.0 - np.cos(3.0)) / 3.0 * (np.e - 1.0)
    made = {
        "zsobol": lambda dimension: along_the_curve(x, y, sample, dimension),
        "sobol": lambda dimension: pairs("sobol", place, sample.ravel(), dimension),
    }
    error = {}
    for kind, draw in made.items():
        squares = np.zeros(2)
        for dimension in range(32):
            points = draw(dimension).astype(float)
            values = np.sin(3.0 * points[:, 0]) * np.exp(points[:, 1]) - exact
            pixels = values.reshape(SIDE, SIDE, -1).mean(axis=2)
            blurred = pixels.reshape(SIDE // 4, 4, SIDE // 4, 4).mean(axis=(1, 3))
            squares += [np.mean(v**2) for v in (pixels, blurred)]
        error[kind] = np.sqrt(squares)
    assert error["zsobol"][0] == pytest.approx(error["sobol"][0], rel=0.15)
    assert error["zsobol"][1] < error["sobol"][1] / 3.0


def test_sobol_converges_faster_than_random():
    """Error of a smooth integral over 64 pixels at 256 samples: far below that of random points."""
    pixel, sample = np.meshgrid(np.arange(64), np.arange(256), indexing="ij")
    errors = {}
    for kind in KINDS:
        points = pairs(kind, pixel, sample, 1).reshape(64, 256, 2).astype(np.float64)
        values = np.sin(3.0 * points[..., 0]) * np.exp(points[..., 1])
        exact = (1.0 - np.cos(3.0)) / 3.0 * (np.e - 1.0)
        errors[kind] = np.sqrt(np.mean((values.mean(axis=1) - exact) ** 2))
    assert errors["sobol"] < errors["independent"] / 15.0
