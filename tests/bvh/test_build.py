"""Every layout against a float64 reference, and input that trees break on."""

import numpy as np
import pytest

from clpt import bvh
from clpt.errors import SceneError

MISS = 0xFFFFFFFF
LAYOUTS = [("brute", 1), ("brute", 8), ("brute", 16), ("binary", 1), ("wide8", 1)]


def rays_into(rng, n, centre=0.5, size=1.0):
    """Rays (n, 8) from around a cube of that size, toward points in it."""
    o = centre + size * rng.normal(0, 1.0, (n, 3))
    d = centre + size * (rng.random((n, 3)) - 0.5) - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    ends = np.stack([np.full(n, 1e-4 * size), np.full(n, np.inf)], 1)
    return np.concatenate([o, ends[:, :1], d, ends[:, 1:]], 1).astype(np.float32)


def soup(rng, n, size=0.2):
    centres = 0.5 + (rng.random((n, 1, 3)) - 0.5) * (n > 3)
    return (centres + size * rng.normal(0, 1, (n, 3, 3))).astype(np.float32)


def mesh(triangles):
    n = len(triangles)
    return triangles.reshape(-1, 3), np.arange(3 * n, dtype=np.uint32).reshape(n, 3)


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
@pytest.mark.parametrize("count", [1, 2, 3, 8, 9, 50, 1000])
def test_agrees_with_reference(device, trace, reference, layout, lanes, count):
    rng = np.random.default_rng(count)
    triangles, rays = soup(rng, count, 0.4 / count ** (1 / 3)), rays_into(rng, 1003)
    tags = rng.integers(0, 2**32, count, dtype=np.uint32)
    hits, occluded = trace(bvh.build(device, *mesh(triangles), tags, layout), rays, lanes)
    t, margin = reference(triangles, rays)
    nearest, best = t.min(1), t.argmin(1)
    sure = np.abs(margin).min(1) > 1e-5  # no triangle's edge is near the ray
    assert sure.mean() > 0.9
    met = np.isfinite(nearest)
    assert met.mean() > 0.05
    assert ((hits["prim"] != MISS) == met)[sure].all()
    assert (occluded == met)[sure].all()
    both = sure & met
    np.testing.assert_allclose(hits["t"][both], nearest[both], rtol=1e-4)
    same = both & (hits["prim"] == best)
    assert same.sum() > 0.999 * both.sum()
    np.testing.assert_array_equal(hits["tag"][same], tags[best[same]])
    corners = triangles.astype(np.float64)[best[same]]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = np.cross(e1, e2)
    np.testing.assert_allclose(hits["n"][same], n, atol=1e-5 * np.abs(n).max())
    u, v = hits["u"][same, None], hits["v"][same, None]
    points = rays[same, :3] + nearest[same, None] * rays[same, 4:7]
    np.testing.assert_allclose(corners[:, 0] + u * e1 + v * e2, points, atol=2e-4)
