"""Thin films against the characteristic matrix in float64, and what a stack must obey.

The kernels sum reflections (Rouard); the reference multiplies matrices of fields (Abeles 1950; Born
and Wolf 1999, 1.6.2), with the admittances n cos and n / cos of s- and p-polarised light.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from clpt import spectra
from clpt.scene import materials as m
from clpt.testing.probe import root_text
from clpt.testing.settings import directions, settings
from tests.kernels.harness import (
    MODES,
    Probe,
    assert_lanes_agree,
    other_mode,
    quick_mode,
    run,
)
from tests.rotation import rotating

ANGLES = np.arange(0.0, 89.5)
LAMBDAS = np.arange(360.0, 830.5, 5.0)
DEGREES, WAVES = (a.ravel() for a in np.meshgrid(ANGLES, LAMBDAS, indexing="ij"))
COSINES = np.cos(np.radians(DEGREES))


def _tio2(lambdas):
    """Rutile's ordinary index (Devore 1951)."""
    return np.sqrt(5.913 + 0.2441 / ((lambdas * 1e-3) ** 2 - 0.0803))


def _glass(name):
    return lambda lambdas: spectra.glass(name).sample(lambdas)


def _metal(name):
    eta, k = spectra.metal(name)
    return lambda lambdas: eta.sample(lambdas) + 1j * k.sample(lambdas)


def _same(index):
    return lambda lambdas: np.full(np.shape(lambdas), index)


AIR, SILICA, WATER = _same(1.000277), _glass("fused silica"), _glass("water")
# outside, films (index, thickness [nm]), inside
FILMS = {
    "bare glass": (AIR, [], _glass("bk7")),
    "MgF2 on glass": (AIR, [(_same(1.38), 99.6)], _glass("bk7")),
    "TiO2 on glass": (AIR, [(_tio2, 55.0)], _glass("bk7")),
    "soap": (AIR, [(WATER, 600.0)], AIR),
    "black soap": (AIR, [(WATER, 8.0)], AIR),
    "oil on water": (AIR, [(_same(1.47), 350.0)], WATER),
    "tinted film on glass": (AIR, [(_same(1.6 + 0.05j), 800.0)], _glass("sf11")),
    "tinted film on gold": (_same(1.0), [(_same(1.6 + 0.05j), 300.0)], _metal("Au")),
    "silver on aluminium": (_same(1.0), [(_metal("Ag"), 20.0)], _metal("Al")),
    "SiO2 on silicon": (_same(1.0), [(SILICA, 300.0)], _same(4.08 + 0.028j)),
    "SiO2 on aluminium": (_same(1.0), [(SILICA, 1200.0)], _metal("Al")),
    "Bragg mirror": (AIR, 4 * [(_tio2, 55.0), (SILICA, 94.0)] + [(_tio2, 55.0)], _glass("bk7")),
    "gap between prisms": (_glass("bk7"), [(AIR, 150.0)], _glass("bk7")),
}
films = pytest.mark.parametrize("name", FILMS)


def matrices(outside, stack, inside, cosines, lambdas):
    """R and T (n,) of unpolarised light, by Abeles' matrices."""
    n0, nb = outside(lambdas), inside(lambdas) + 0j
    sine2 = (n0 * n0) * (1.0 - cosines**2)

    def cosine(n):
        c = np.sqrt(1.0 - sine2 / (n * n) + 0j)
        return np.where((n * c).imag < 0.0, -c, c)

    r_all, t_all = [], []
    for tilt in (1, -1):
        b, c = np.ones(len(lambdas), complex), nb * cosine(nb) ** tilt
        y0, yb = n0 * cosines**tilt, c
        for index, thickness in reversed(stack):
            n = index(lambdas) + 0j
            phase = 2.0 * np.pi * n * cosine(n) * thickness / lambdas
            y = n * cosine(n) ** tilt
            b, c = (
                np.cos(phase) * b - 1j * np.sin(phase) / y * c,
                np.cos(phase) * c - 1j * y * np.sin(phase) * b,
            )
        r_all.append(np.abs((y0 * b - c) / (y0 * b + c)) ** 2)
        t_all.append(4.0 * y0 * yb.real / np.abs(y0 * b + c) ** 2)
    return np.mean(r_all, axis=0), np.mean(t_all, axis=0)


def _text(count):
    """A kernel of (cos, lambda, outside, inside, k, eta k thickness per film) -> metal r, r, t."""
    choose = "".join(
        f"    at = i == {j};\n    r.eta = spectrum_sel(at, l.of[{j}].eta, r.eta);\n"
        f"    r.k = spectrum_sel(at, l.of[{j}].k, r.k);\n"
        f"    r.thickness = sel(at, l.of[{j}].thickness, r.thickness);\n"
        for j in range(count)
    )
    reads = "".join(
        f"    layers.of[{j}].eta = spectrum_of(X({5 + 3 * j}));\n"
        f"    layers.of[{j}].k = spectrum_of(X({6 + 3 * j}));\n"
        f"    layers.of[{j}].thickness = X({7 + 3 * j});\n"
        f"    layers.of[{j}].profile = 1.0f;\n"
        for j in range(count)
    )
    return f"""{root_text("spectral")}
typedef struct {{ Spectrum eta, k; real thickness, profile; }} Layer;
typedef struct {{ Layer of[{max(count, 1)}]; integer count; Spectrum lambdas; }} Layers;
inline Layer layer_at(Layers l, integer i)
{{
    Layer r = l.of[0];
    mask at;
{choose}    return r;
}}
#include "materials/boundary.cl#film"
#define X(i) block_load(in + (i) * n + at)
kernel void probe(global const float *in, global float *out, uint n)
{{
    uint at = get_global_id(0) * LANES;
    Layers layers;
    layers.count = {count};
    layers.lambdas = spectrum_of(X(1));
{reads}
    Spectrum outside = spectrum_of(X(2)), inside = spectrum_of(X(3));
    Boundary b = dielectric_boundary(layers, X(0), spectrum_div(inside, outside), outside);
    block_store(out + at, conductor_boundary(layers, X(0), inside, spectrum_of(X(4))).x);
    block_store(out + n + at, b.r.x);
    block_store(out + 2 * n + at, b.t.x);
}}
"""


@cache
def _measured(name, side=1.0, lanes=16, options=()):
    """R and T (n,) of the kernels, from outside (side 1) or inside (-1); T of metals is None."""
    outside, stack, inside = FILMS[name]
    base = inside(WAVES) + 0j
    rows = [side * COSINES, WAVES, outside(WAVES), base.real, base.imag]
    for index, thickness in stack:
        film = index(WAVES) + 0j
        rows += [film.real, film.imag, np.full(len(WAVES), thickness)]
    given = np.array(rows, np.float32)
    r_metal, r, t = run(_text(len(stack)), lanes, given, 3, options=options)
    return (r_metal, None) if base.imag.any() else (r, t)


def _absorbs(name):
    return any(np.iscomplexobj(i(WAVES)) for i in (*(f for f, _ in FILMS[name][1]), FILMS[name][2]))


@films
def test_against_matrices(name):
    r, t = _measured(name)
    expected_r, expected_t = matrices(*FILMS[name], COSINES, WAVES)
    assert np.abs(r - expected_r).max() < 1e-4
    assert t is None or np.abs(t - expected_t).max() < 1e-4


@films
def test_against_matrices_from_inside(name):
    outside, stack, inside = FILMS[name]
    if np.iscomplexobj(inside(WAVES)):
        return
    r, t = _measured(name, -1.0)
    expected_r, expected_t = matrices(inside, stack[::-1], outside, COSINES, WAVES)
    critical = np.degrees(np.arcsin(np.minimum(outside(WAVES) / inside(WAVES), 1.0)))
    # as a root starts there, single precision knows the cosine behind to no more than 1e-3
    clear = np.abs(DEGREES - critical) > 0.1
    assert clear.mean() > 0.99 or (critical == 90.0).all()
    assert np.abs(r - expected_r)[clear].max() < 1e-4
    assert np.abs(t - expected_t)[clear].max() < 1e-4


@films
def test_energy(name):
    for side in (1.0, -1.0):
        r, t = _measured(name, side)
        if t is not None and not _absorbs(name):
            assert np.abs(r + t - 1.0).max() < 5e-5
        elif t is not None:
            assert (r + t).max() <= 1.0 and (r + t).max() < 0.99
        assert r.min() >= 0.0 and r.max() <= 1.0


def test_light_that_films_guide_is_kept_however_it_is_rounded():
    """Between 74 and 76 degrees the mirror's films are a waveguide; compilers of GPUs contract."""
    r, t = _measured("Bragg mirror", -1.0, options=("-cl-unsafe-math-optimizations",))
    outside, stack, inside = FILMS["Bragg mirror"]
    expected, _ = matrices(inside, stack[::-1], outside, COSINES, WAVES)
    guided = DEGREES > 60.0
    assert np.abs(r + t - 1.0).max() < 5e-5
    assert np.abs(r - expected)[guided].max() < 1e-5


@films
def test_lanes_agree(name):
    for lanes in (1, 8):
        for ours, theirs in zip(_measured(name), _measured(name, 1.0, lanes), strict=True):
            if ours is not None:
                assert_lanes_agree(ours, theirs)


def test_quarter_wave():
    """((n0 ns - n1^2) / (n0 ns + n1^2))^2 at normal incidence (Born and Wolf 1999, 1.6.4)."""
    ns = float(spectra.glass("bk7").sample(550.0))
    expected = ((1.000277 * ns - 1.38**2) / (1.000277 * ns + 1.38**2)) ** 2
    here = (DEGREES == 0.0) & (WAVES == 550.0)
    assert _measured("MgF2 on glass")[0][here] == pytest.approx(expected, abs=2e-5)


def test_against_tmm():
    tmm = pytest.importorskip("tmm", reason="a transfer-matrix package, for developers only")
    for name, (outside, stack, inside) in FILMS.items():
        measured = _measured(name)[0]
        for i in range(7, len(WAVES), 397):
            lam = WAVES[i : i + 1]
            n = [complex(f(lam)[0]) for f in (outside, *(f for f, _ in stack), inside)]
            thick = [np.inf, *(d for _, d in stack), np.inf]
            expected = tmm.unpolarized_RT(n, thick, np.radians(DEGREES[i]), WAVES[i])["R"]
            assert measured[i] == pytest.approx(expected, abs=1e-4), name


COATED = (m.Dielectric, m.RoughDielectric, m.Conductor, m.RoughConductor)
LAYERS = (
    (m.Layer(eta=1.333, thickness=0.0),),
    (m.Layer(eta=1.0, thickness=1e5),),
    (m.Layer(eta=0.05, k=4.0, thickness=1e4), m.Layer(eta=2.5, thickness=80.0, profile=0.0)),
    (m.Layer(eta=1.5, k=0.1, thickness=500.0),),
)


@rotating("cls, mode", COATED, MODES, turn=quick_mode)
def test_extreme_layers_are_finite_and_make_no_light(cls, mode):
    rng, probe = np.random.default_rng(31), Probe(cls, mode)
    wo = np.concatenate(
        [directions(rng, 500), [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, -0.0]]]
    )
    u = rng.random((len(wo), 3))
    for layers in LAYERS:
        (params,) = settings(cls, mode, rng, 1)
        r = probe(params | {"layers": layers}, wo, wo[::-1].copy(), u)
        made = r["sampled_pdf"] > 0.0
        for name in ("eval", "pdf", "albedo"):
            assert np.all(np.isfinite(r[name]) & (r[name] >= 0.0)), name
        assert np.all(np.isfinite(r["weight"][made]) & (r["weight"][made] >= 0.0))
        delta = made & (r["lobe"] & 4 != 0)
        energy = r["weight"] * (r["eta"] ** 2 * r["sampled_pdf"])[:, None]
        assert np.all(energy[delta] <= 1.0 + 1e-5)


@rotating("cls, mode", COATED, MODES, turn=other_mode)
def test_coated_lanes_agree(cls, mode):
    rng = np.random.default_rng(32)
    params = settings(cls, mode, rng, 2)[1]
    wo, u = directions(rng, 500), rng.random((500, 3))
    wide, narrow = (Probe(cls, mode, lanes)(params, wo, wo[::-1], u) for lanes in (16, 1))
    for name, value in wide.items():
        np.testing.assert_allclose(narrow[name], value, rtol=2e-5, atol=2e-6, err_msg=name)
