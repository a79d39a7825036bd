"""Pixel filters: what is sampled is the filter, and the filter is what it is called."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.render.film import filters
from clpt.scene import integrators as scene
from clpt.scene.params import params
from tests.kernels.scene_harness import SceneProbe

BODY = """
    vec2 u = {x[0], x[1]}, offset;
    filter_sample(scene, u, &offset, &r[2]);
    r[0] = offset.x; r[1] = offset.y;
"""
SETTINGS = [
    scene.Box(),
    scene.Box(radius=1.3),
    scene.Tent(),
    scene.Tent(radius=2.5),
    scene.Gaussian(),
    scene.Gaussian(stddev=0.8),
    scene.Gaussian(stddev=0.5, radius=1.5),
    scene.Mitchell(),
    scene.Mitchell(b=0.0, c=0.5),
    scene.Mitchell(b=0.2, c=0.9),
    scene.Mitchell(radius=1.5),
    scene.Lanczos(),
    scene.Lanczos(radius=4.0, lobes=3.0),
    scene.BlackmanHarris(),
    scene.BlackmanHarris(radius=2.0),
]
IDS = [f"{f.kind}-{i}" for i, f in enumerate(SETTINGS)]


def sampled(chosen, u, lanes=8, fast=True):
    """Offsets (n, 2) and weights (n,) of points u (n, 2) of the unit square."""
    defines = {"FILTER_BOX": 1} if fast and chosen.kind == "box" else {}
    probe = SceneProbe(
        BODY,
        2,
        3,
        files=("film/filter.cl",),
        lanes=lanes,
        defines=defines,
        tables={"distributions": filters.sampling_table(chosen)},
    )
    out = probe(*u.T)
    return out[:2].T, out[2]


@pytest.mark.parametrize("chosen", SETTINGS, ids=IDS)
def test_samples_follow_the_filter(chosen):
    """Along either axis, the weighted share of samples up to x is the filter's integral up to x."""
    n = 20 * filters.CELLS
    even, half = (np.arange(n) + 0.5) / n, np.full(n, 0.5)
    end = chosen.half_width
    edges = np.linspace(-end, end, 4001)
    integral = np.concatenate([[0], np.cumsum(chosen.value((edges[1:] + edges[:-1]) / 2))])
    for axis, u in enumerate((np.column_stack([even, half]), np.column_stack([half, even]))):
        offsets, weights = sampled(chosen, u)
        along = offsets[:, axis]
        assert (np.diff(along) >= 0).all(), "samples must keep the order of their numbers"
        across = (
            weights[0]
            if chosen.kind == "box"
            else filters.sampling_table(chosen)[2 + filters.CELLS]
        )
        cdf = np.concatenate([[0], np.cumsum(weights / across, dtype=np.float64)]) / n
        assert cdf[-1] == pytest.approx(1.0, abs=2e-6)
        wanted = np.interp(along, edges, integral / integral[-1])
        np.testing.assert_allclose((cdf[1:] + cdf[:-1]) / 2, wanted, atol=4e-4)


@pytest.mark.parametrize("chosen", SETTINGS, ids=IDS)
def test_samples_stay_inside(chosen):
    ends = np.float32([0.0, 0.25, 0.5, np.nextafter(np.float32(1), np.float32(0))])
    u = np.stack(np.meshgrid(ends, ends), axis=-1).reshape(-1, 2)
    offsets, weights = sampled(chosen, u)
    assert np.abs(offsets).max() <= np.float32(chosen.half_width)
    assert np.isfinite(weights).all()


def test_box_samples_stay_in_their_pixel():
    """Half-open: the pixel's left edge belongs to it, its right edge to the next one."""
    u = np.array([[0.0, np.nextafter(np.float32(1), np.float32(0))]], np.float32)
    for fast in (True, False):
        offsets, weights = sampled(scene.Box(), u, fast=fast)
        assert offsets[0, 0] == -0.5
        assert offsets[0, 1] < 0.5
        assert weights[0] == 1.0


def test_mean_weight_is_one():
    """Over both axes: a uniform image stays as bright as it is, within 5 standard errors."""
    u = np.random.default_rng(3).random((1 << 16, 2), np.float32)
    for chosen in SETTINGS:
        _, weights = sampled(chosen, u)
        error = weights.std(dtype=np.float64) / np.sqrt(len(weights))
        assert abs(weights.mean(dtype=np.float64) - 1.0) <= 5.0 * error + 1e-6
        assert (weights < 0).any() == (chosen.kind in ("mitchell", "lanczos"))


def test_all_lane_widths_agree():
    u = np.random.default_rng(4).random((256, 2), np.float32)
    for chosen in (scene.Box(), scene.Mitchell()):
        single = sampled(chosen, u, lanes=1)
        for lanes in (8, 16):
            for a, b in zip(sampled(chosen, u, lanes=lanes), single, strict=True):
                np.testing.assert_allclose(a, b, atol=1e-6)


@pytest.mark.peers
@pytest.mark.parametrize(
    "chosen",
    [
        scene.Tent(radius=2.5),
        scene.Gaussian(stddev=0.8),
        scene.Mitchell(b=0.2, c=0.9),
        scene.Lanczos(),
        scene.Lanczos(radius=4.0, lobes=4.0),
    ],
)
def test_same_functions_as_mitsuba(chosen):
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    names = {"b": "B", "c": "C"}
    given = {names.get(n, n): getattr(chosen, n) for n in params(type(chosen))}
    if chosen.kind == "lanczos":
        given["lobes"] = int(given["lobes"])
    if chosen.kind != "tent":
        given.pop("radius")
    theirs = mi.load_dict({"type": chosen.kind, **given})
    x = np.linspace(0.0, 0.999 * chosen.half_width, 57)
    values = np.array([theirs.eval(float(v)) for v in x])
    assert theirs.radius() == pytest.approx(chosen.half_width)
    ours = chosen.value(x)
    scale = values[0] / ours[0]  # only the shape matters
    within = 7e-4 if chosen.kind == "gaussian" else 2e-6  # theirs is a polynomial
    np.testing.assert_allclose(ours * scale, values, atol=within * abs(values[0]))


@pytest.mark.parametrize("chosen", [scene.Mitchell(b=1e9), scene.Mitchell(b=1e38)])
def test_filters_without_an_integral(chosen):
    with pytest.raises(SceneError, match="integral"):
        filters.sampling_table(chosen)


def test_filter_comes_first():
    class Full:
        def append_floats(self, name, values):
            return 7

    with pytest.raises(SceneError, match="first"):
        filters.encode_filter(scene.Box(), Full(), False)
