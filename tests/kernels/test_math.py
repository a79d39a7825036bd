"""The polynomials of kernels/core/math.cl keep the errors that they state."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special

from tests.kernels.harness import map_text, run

ACROSS = np.linspace(-1.0, 1.0, 40_001)
POSITIVE = np.exp(np.linspace(np.log(1e-30), np.log(1e30), 40_001))

# name, OpenCL body, exact function, arguments, relative to the result?, stated error
FUNCTIONS = [
    ("log2", "r[0] = log2_r(x[0]);", np.log2, POSITIVE, True, 2e-7),
    ("log", "r[0] = log_r(x[0]);", np.log, POSITIVE, True, 3e-7),
    ("exp2", "r[0] = exp2_r(x[0]);", np.exp2, ACROSS * 120.0, True, 3e-7),
    ("exp", "r[0] = exp_r(x[0]);", np.exp, ACROSS * 5.0, True, 1e-6),
    ("acos", "r[0] = acos_r(x[0]);", np.arccos, ACROSS, False, 7e-7),
    ("erf", "r[0] = erf_r(x[0]);", special.erf, ACROSS * 5.0, False, 7e-7),
    ("erfinv", "r[0] = erfinv_r(x[0]);", special.erfinv, ACROSS * 0.9999, True, 4e-6),
]


@pytest.mark.parametrize("lanes", [1, 16])
@pytest.mark.parametrize(("name", "body", "exact", "x", "relative", "error"), FUNCTIONS)
def test_stated_error(name, body, exact, x, relative, error, lanes):
    x = x.astype(np.float32)
    (got,) = run(map_text(body, 1, 1), lanes, x[None], 1)
    truth = exact(x.astype(float))
    off = np.abs(got - truth) / (np.maximum(np.abs(truth), 1e-30) if relative else 1.0)
    if relative:  # near a zero of the function the absolute error counts
        off = np.where(np.abs(truth) < 1e-3, np.abs(got - truth), off)
    assert off.max() < error, f"{off.max():.2e} at {x[off.argmax()]}"


def test_sincos():
    u = np.linspace(0.0, 1.0, 40_001).astype(np.float32)
    s, c = run(map_text("sincos_2pi(x[0], &r[0], &r[1]);", 1, 2), 16, u[None], 2)
    turn = 2.0 * np.pi * u.astype(float)
    assert np.abs(s - np.sin(turn)).max() < 3.5e-7
    assert np.abs(c - np.cos(turn)).max() < 3.5e-7


def test_atan2():
    turn = np.linspace(-np.pi, np.pi, 40_001)[1:]
    radius = np.exp(np.linspace(-20.0, 20.0, turn.size))
    given = np.stack([np.sin(turn) * radius, np.cos(turn) * radius]).astype(np.float32)
    (got,) = run(map_text("r[0] = atan2_r(x[0], x[1]);", 2, 1), 16, given, 1)
    truth = np.arctan2(*given.astype(float))
    assert np.abs(got - truth).max() < 1e-6
    zero = run(map_text("r[0] = atan2_r(x[0], x[1]);", 2, 1), 16, given[:, :1] * 0.0, 1)
    assert zero == 0.0


def test_pow():
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(1e-3, 1.0, 300), np.linspace(0.0, 30.0, 60)))
    given = np.stack([x, y]).astype(np.float32)
    (got,) = run(map_text("r[0] = pow_r(x[0], x[1]);", 2, 1), 16, given, 1)
    truth = given[0].astype(float) ** given[1].astype(float)
    assert np.abs(got - truth).max() < 2e-6
    normal = truth > 1e-30
    assert np.abs(got / np.maximum(truth, 1e-38) - 1.0)[normal].max() < 2e-5


def test_divide_is_exact_for_integers():
    """Numbers up to 2^28 by those that leave 2^20 of them: multiples, neighbours, and others."""
    rng = np.random.default_rng(1)
    divisors = (256, 257, 300, 641, 65_535, 65_537, 4_194_304, 100_000_007)
    body = "".join(
        f"r[{k}] = as_real(divide(as_integer(x[0]), {b}));" for k, b in enumerate(divisors)
    )
    edges = [b * rng.integers(0, 2**28 // b + 1, 2000) + d for b in divisors for d in (-1, 0, 1)]
    given = np.concatenate([*edges, rng.integers(0, 2**28, 4000), np.arange(4000)])
    given = given[(given >= 0) & (given < 2**28)][: given.size // 64 * 32].astype(np.int32)
    for lanes in (1, 16):
        text = map_text(body, 1, len(divisors))
        got = run(text, lanes, given.view(np.float32)[None], len(divisors)).view(np.int32)
        for row, b in zip(got, divisors, strict=True):
            assert np.array_equal(row, given // b), b
