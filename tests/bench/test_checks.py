"""What cannot be true is refused: each way of lying that a layout or a clock may have."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.bench import rays
from clpt.bench.figures import Figure, Taken, clock_complaint
from clpt.bench.rays import POISON, Rays

FACES = np.arange(3 * 60, dtype=np.uint32).reshape(-1, 3)


@pytest.fixture(scope="module")
def truth() -> rays.Truth:
    """Sixty triangles and 500 rays from among them."""
    rng = np.random.default_rng(3)
    vertices = rng.uniform(-1, 1, (3 * len(FACES), 3)).astype(np.float32)
    o = rng.uniform(-0.5, 0.5, (500, 3)).astype(np.float32)
    d = rng.normal(size=(500, 3))
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
    return rays.Truth(vertices, FACES, Rays(o, d, np.full(500, np.inf, np.float32)))


def answers(truth: rays.Truth) -> dict[str, np.ndarray]:
    """The nearest hits in float64, by another formula than the check's: planes, then areas."""
    v0, v1, v2 = truth.corners.transpose(1, 0, 2)
    n = np.cross(v1 - v0, v2 - v0)
    o, d = (a.astype(np.float64)[:, None] for a in (truth.rays.origins, truth.rays.directions))
    with np.errstate(invalid="ignore"):  # triangles that are points
        t = ((v0 - o) * n).sum(-1) / (d * n).sum(-1)
        p = o + t[..., None] * d
        whole = (n * n).sum(-1)
        u = (np.cross(v2 - p, v0 - p) * n).sum(-1) / whole
        v = (np.cross(v0 - p, v1 - p) * n).sum(-1) / whole
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    prim = t.argmin(1)
    rows = np.arange(len(prim))
    met = np.isfinite(t[rows, prim])
    return {
        "t": t[rows, prim].astype(np.float32),
        "primitive": np.where(met, prim, rays.MISS).astype(np.int32),
        "barycentrics": np.stack([u[rows, prim], v[rows, prim]], -1).astype(np.float32),
    }


def test_right_hits_pass(truth: rays.Truth) -> None:
    hits = answers(truth)
    assert 100 < (hits["primitive"] >= 0).sum() < 500
    assert truth.closest(hits) == ""
    assert rays.differ(hits, hits) == ""
    assert rays.any_hit((hits["primitive"] >= 0).astype(np.uint8), hits) == ""


def test_rays_that_were_not_traced(truth: rays.Truth) -> None:
    hits = answers(truth)
    hits["primitive"][7] = POISON
    assert "1 of 500 rays were not traced" in truth.closest(hits)
    assert "not traced" in rays.any_hit(np.full(500, 0xEE, np.uint8), hits)


def test_hits_beside_their_triangles(truth: rays.Truth) -> None:
    hits = answers(truth)
    which = np.flatnonzero(hits["primitive"] >= 0)[:5]
    hits["primitive"][which] = (hits["primitive"][which] + 1) % len(FACES)
    assert "not on the triangles" in truth.closest(hits)


def test_hits_that_are_missing_or_behind_others(truth: rays.Truth) -> None:
    """A layout that loses triangles tells hits that are there, but not the nearest."""
    hits = answers(truth)
    lost = dict(hits, t=hits["t"].copy(), primitive=hits["primitive"].copy())
    which = np.flatnonzero(hits["primitive"] >= 0)[:3]
    lost["t"][which], lost["primitive"][which] = np.inf, rays.MISS
    assert "3 of 500 rays tried with every triangle" in truth.closest(lost)
    assert "of another layout" in rays.differ(lost, hits)
    assert "closest hits" in rays.any_hit((lost["primitive"] >= 0).astype(np.uint8), hits)

    some = rays.Truth(truth.corners.reshape(-1, 3), FACES, truth.rays)
    some.corners[hits["primitive"][which]] = 99.0
    some = rays.Truth(some.corners.reshape(-1, 3), FACES, truth.rays)
    assert "tried with every triangle" in truth.closest(answers(some))


def test_clocks_that_lie() -> None:
    assert clock_complaint([Taken(0.1, 0.11)]) == ""
    assert "no time" in clock_complaint([Taken(0.1, 0.2), Taken(0.0, 0.2)])
    assert "by the host's" in clock_complaint([Taken(0.5, 0.2)])


def test_a_refused_figure_tells_why_once() -> None:
    figure = Figure("rays", "x", "Mrays/s", (1.0,)).refuse("", "late").refuse("late", "wrong")
    assert figure.refused == "late; wrong"
