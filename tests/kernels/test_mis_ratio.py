"""The weights of all ways to find a path sum to one: the kernels' recursions beside float64.

Paths x_1 .. x_k of random densities and cosines, x_1 seen by the camera, x_k on a light. The
density of every way is written out as a product over the path, in the areas of its vertices; its
weight is its square over the sum of all squares (Veach 1997, 9.2.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.kernels.mis_probe import LAMPS, LIGHT_PATHS, vertex_probe

PATHS = 1 << 15  # of each length
SHARP = 8.0  # SHARP_PDF of transport/mis_ratio.cl [1/sr]
DULL, DIFFUSE_SHARE = 1.0, 0.125  # of transport/roulette.cl, DIFFUSE_PDF and DIFFUSE_SHARE
SHARED = (
    50  # paths that every way that there is must share with others, so that the test can see it
)
ROUNDING = 1e-5  # of weights and of their sums, in float32

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Paths:
    """Paths of k vertices, n of them.

    (k - 1, n), of x_1 first: cosines to the camera's side and to the light's, below 0 behind the
    surface; densities of going on to the light's side, and back [1/sr]; masks: the lobe is delta,
    light paths end there, photons are gathered; squares of the distance to the next [m^2].
    (n,): the cosine at the light; densities there, and importance; what aiming gains; x_1 is in
    view; the row of LAMPS; the area of merging [m^2].
    """

    camera: Array
    light: Array
    p: Array
    p_back: Array
    delta: Array
    ends: Array
    gathers: Array
    square: Array
    cosine: Array
    emission: Array
    found: Array
    importance: Array
    gain: Array
    seen: Array
    lamp: Array
    area: Array

    @property
    def k(self) -> int:
        """Vertices, the light counted."""
        return len(self.p) + 1


def paths_of(k: int, n: int = PATHS) -> Paths:
    """Random paths, in float32 as kernels get them: both must find the same vertices sharp."""
    rng = np.random.default_rng(k)

    def spread(least: float, most: float, shape: tuple[int, ...]) -> Array:
        return (10 ** rng.uniform(least, most, shape)).astype(np.float32)

    def cosines() -> Array:
        side = rng.choice([-1, 1], every)
        return (side * rng.uniform(0.05, 1, every)).astype(np.float32)

    every = (k - 1, n)
    return Paths(
        camera=cosines(),
        light=cosines(),
        p=spread(-1.5, 2, every),
        p_back=spread(-1.5, 2, every),
        delta=rng.random(every) < 0.2,
        ends=rng.random(every) < 0.05,
        gathers=rng.random(every) < 0.8,
        square=spread(-2, 2, every),
        cosine=rng.uniform(0.05, 1, n),
        emission=spread(-1.5, 1, (n,)),
        found=spread(-1.5, 1, (n,)),
        importance=spread(-1, 1.5, (n,)),
        gain=spread(0, 1, (n,)),
        seen=rng.random(n) < 0.9,
        lamp=rng.integers(0, len(LAMPS), n),
        area=spread(-1.5, 1, (n,)),
    )


def ways(k: int) -> list[str]:
    """The ways to find a path, in the order of rows of weights; x_i at which photons are merged."""
    return ["met", "chosen", "joined", *(f"merged {i}" for i in range(1, k - 1))]


def exact_weights(paths: Paths, joined: bool, merged: bool, dull: bool) -> Array:
    """Weights of `ways` (k + 1, n) by products in float64; 0 where no way is possible."""
    a, k = paths, paths.k
    n = len(a.cosine)
    # A delta lobe has the same factor in all ways that go through it.
    p, p_back = (np.where(a.delta, 1, q).astype(float) for q in (a.p, a.p_back))
    to_camera, to_light = abs(a.camera.astype(float)), abs(a.light.astype(float))
    sharp = a.delta | (np.maximum(a.p, a.p_back) > SHARP)
    passes = np.cumprod(~a.ends[::-1], axis=0)[::-1].astype(bool)  # light paths, x_i and before

    # Densities of vertices, by a path from the camera and by one from the light, in areas.
    arrives = np.concatenate([to_camera[1:], a.cosine[None]]) / a.square  # at x_i+1, from x_i
    camera = [a.importance * to_camera[0]]
    for i in range(k - 1):
        camera.append(camera[-1] * p[i] * arrives[i])
    light = [a.emission.astype(float) * a.gain * a.cosine * to_light[-1] / a.square[-1]]
    for i in range(k - 2, 0, -1):
        light.insert(0, light[0] * p_back[i] * to_light[i - 1] / a.square[i - 1])
    if dull:
        few = np.where(~a.delta[-1] & (a.p[-1] <= DULL), DIFFUSE_SHARE, 1)
        light[:-1] = [one * few for one in light[:-1]]

    density = np.zeros((k + 1, n))
    density[0] = np.where(a.lamp < 2, camera[k - 1], 0)
    density[1] = np.where(a.delta[-1], 0, camera[k - 2] * a.found * arrives[-1])
    if joined and k > 2:
        density[2] = np.where(a.seen & ~a.delta[0] & passes[0], LIGHT_PATHS * light[0], 0)
    for i in range(joined, k - 2) if merged else ():
        here = sharp[:i].all(axis=0) & ~sharp[i] & sharp[i + 1 :].any(axis=0)
        here &= a.gathers[i] & passes[i + 1]
        density[3 + i] = np.where(here, camera[i] * light[i] * a.area, 0)
    square = density**2
    return square / np.maximum(square.sum(axis=0), 1e-300)


def kernel_weights(paths: Paths, joined: bool, merged: bool, dull: bool) -> Array:
    """The same by the kernels' recursions, from each end."""
    a, k = paths, paths.k
    n = len(a.cosine)
    weights = np.zeros((k + 1, n))
    common = {name: getattr(a, name) for name in ("importance", "seen", "found", "lamp", "area")}

    def start(mis_ratio: Array | float, sharp: float) -> dict[str, Array]:
        return {
            "mis_ratio": np.zeros(n) + mis_ratio,
            "merge_ratio": np.zeros(n),
            "sharp": np.full(n, sharp),
        }

    def vertex(i: int) -> dict[str, Array]:
        return {name: getattr(a, name)[i] for name in ("delta", "ends", "gathers")}

    def carried(made: dict[str, Array]) -> dict[str, Array]:
        return {name: made[name] for name in ("mis_ratio", "merge_ratio", "sharp")}

    photons = np.full((k - 1, n), -1.0)
    state, alive = start(1 / (LIGHT_PATHS * a.gain), 0.0), np.ones(n, bool)
    step = vertex_probe(True, joined, merged, dull)
    for i in range(k - 2, -1, -1):
        made = step(
            **common, **state, **vertex(i),
            depth=np.full(n, k - 1 - i), emission=a.emission, photon=photons[i],
            arrives=a.light[i], leaves=a.camera[i], p=a.p_back[i], p_back=a.p[i],
        )  # fmt: skip
        if merged:
            photons[i] = np.where(alive & a.gathers[i], made["photon"], -1)
        alive = alive & ~a.ends[i]
        state = carried(made)
    weights[2] = np.where(alive & ~a.delta[0], made["joined"], 0)

    state = start(LIGHT_PATHS, 1.0)
    step = vertex_probe(False, joined, merged, dull)
    for i in range(k - 1):
        made = step(
            **common, **state, **vertex(i),
            depth=np.full(n, i), emission=a.emission * a.gain, photon=photons[i],
            arrives=a.camera[i], leaves=a.light[i], p=a.p[i], p_back=a.p_back[i],
        )  # fmt: skip
        if i < k - 2:
            weights[3 + i] = np.where((photons[i] >= 0) & ~a.delta[i], made["merged"], 0)
        state = carried(made)
    weights[0], weights[1] = made["met"], np.where(a.delta[-1], 0, made["chosen"])
    return weights


@pytest.mark.parametrize(
    ("joined", "merged", "dull"),
    [(True, False, False), (False, True, False), (True, True, False), (True, True, True)],
    ids=["joined", "merged", "both", "dull"],
)
def test_weights_sum_to_one(joined: bool, merged: bool, dull: bool) -> None:
    for k in range(2, 7):
        paths = paths_of(k)
        exact, found = (of(paths, joined, merged, dull) for of in (exact_weights, kernel_weights))
        whole = exact.sum(axis=0)
        there = {"met", "chosen", *["joined"] * (joined and k > 2)}
        there |= {f"merged {i}" for i in range(1 + joined, k - 1)} if merged else set()
        for way, ours, right in zip(ways(k), found, exact, strict=True):
            np.testing.assert_allclose(ours, right, rtol=0, atol=ROUNDING, err_msg=f"{way} of {k}")
            shared = ((right > 0.05) & (right < 0.95)).sum()
            assert shared > SHARED if way in there else not right.any(), (way, k, shared)
        np.testing.assert_allclose(
            found.sum(axis=0), whole, rtol=0, atol=ROUNDING, err_msg=f"sum of {k}"
        )
        assert ((whole == 0) | (abs(whole - 1) < 1e-12)).all()
        assert (whole > 0).mean() > 0.8, "paths that no way finds show nothing"
