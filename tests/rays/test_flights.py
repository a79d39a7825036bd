"""Several rays of a work-item in flight: the same answers, to the bit, as one after another."""

from __future__ import annotations

import numpy as np
import pytest

import clpt


@pytest.fixture(scope="module")
def flying(queue, soup):
    """The triangles of `accel` as if they outgrew the caches."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clpt.bvh.outgrows_caches", lambda *of: True)
        return clpt.Accel(queue, *soup, layout="wide8")


@pytest.fixture(scope="module")
def single(queue, soup):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clpt.bvh.outgrows_caches", lambda *of: False)
        return clpt.Accel(queue, *soup, layout="wide8")


@pytest.mark.parametrize("count", [1, 5, 64, 65, 1000])
def test_all_directions(flying, single, rays, count):
    o, d = (part[:count].copy() for part in rays)
    o[3::50] = np.nan
    d[4::50] = 0
    t_max = np.where(np.arange(count) % 3, np.inf, 0.9).astype(np.float32)
    _same(flying, single, o, d, 0.01, t_max)


def test_like_a_camera(flying, single):
    """Neighbours look the same way; a batch of them is traced one by one."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 33), np.linspace(-0.3, 0.3, 33))
    d = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], -1).astype(np.float32)
    o = np.broadcast_to(np.float32([0.5, 0.5, -2]), d.shape).copy()
    hits = _same(flying, single, o, d, 0.0, np.inf)
    assert (hits.primitive >= 0).sum() > 100


def _same(flying, single, *rays):
    ours, theirs = flying.intersect(*rays), single.intersect(*rays)
    for name in ("t", "primitive", "barycentrics"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    np.testing.assert_array_equal(flying.occluded(*rays), single.occluded(*rays))
    return theirs
