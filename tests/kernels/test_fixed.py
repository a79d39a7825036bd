"""Sums of pixels, whole numbers of 96 bits: exact in any order, against Python's integers."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.render.film.state import add_sums
from tests.kernels.harness import map_text, run

UNIT = 2**48  # of 1
RNG = np.random.default_rng(96)
ADD_FLOAT = """Fixed sum = {as_natural(x[0]), as_natural(x[1]), as_natural(x[2])};
sum = fixed_add(sum, fixed_of(x[3]));
r[0] = as_real(sum.low); r[1] = as_real(sum.middle); r[2] = as_real(sum.high);
r[3] = sel(fixed_is_full(sum.high), (real)(1.0f), (real)(0.0f));"""


def floats(count: int) -> np.ndarray:
    """Numbers of both signs and of every size that the film takes, and some special ones."""
    sizes = np.exp2(RNG.uniform(-60.0, 43.9, count)) * RNG.choice([-1.0, 1.0], count)
    special = [0.0, -0.0, 2.0**-48, -(2.0**-48), 1.0, -1.0, 2.0**-16, -(2.0**-16), 65535.996, 1e-40]
    return np.concatenate([special, sizes]).astype(np.float32)


def integers(count: int) -> np.ndarray:
    """(count, 3) words of sums: of every size, and next to a carry."""
    words = RNG.integers(0, 2**32, (count, 3), dtype=np.uint32)
    words[:, 2] = RNG.choice([0, 0xFFFFFFFF, 5, 0xFFFFFFF0], count)
    words[::3, 0], words[::5, 1] = 0xFFFFFFFF, 0xFFFFFFFF
    words[::7] = 0
    return words


def value(words: np.ndarray) -> list[int]:
    """The whole numbers that (n, 3) words stand for, in two's complement."""
    unsigned = [int(a) | int(b) << 32 | int(c) << 64 for a, b, c in words]
    return [v - (1 << 96) if v >> 95 else v for v in unsigned]


def units(number: float) -> int:
    """A float in units of 2^-48, what is below one cut off."""
    numerator, denominator = float(number).as_integer_ratio()
    size = abs(numerator) * UNIT // denominator
    return -size if number < 0 else size


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_adding_floats(lanes):
    terms = floats(16_374)
    sums = integers(len(terms))
    given = np.concatenate([sums.T.view(np.float32), terms[None]])
    got = run(map_text(ADD_FLOAT, 4, 4, files=("core/fixed.cl",)), lanes, given, 4)
    result = np.ascontiguousarray(got[:3]).view(np.uint32).T
    expected = [a + units(b) for a, b in zip(value(sums), terms, strict=True)]
    assert value(result) == expected
    full = [not -(2**94) <= v < 2**94 for v in expected]
    assert got[3].astype(bool).tolist() == full


def test_sums_as_floats():
    """The nearest float, ties to even, as Python rounds a fraction."""
    sums = integers(20_000)
    sums[1::2, 2] = np.where(sums[1::2, 2] > 0x80000000, 0xFFFFFFFF, 0)
    body = "r[0] = sums_float(as_uint(x[0]), as_uint(x[1]), as_uint(x[2]));"
    got = run(
        map_text(body, 3, 1, files=("core/fixed.cl",)),
        1,
        np.ascontiguousarray(sums.T).view(np.float32),
        1,
    )[0]
    expected = [_nearest(v) for v in value(sums)]
    np.testing.assert_array_equal(got.astype(float), np.array(expected))


def _nearest(units: int) -> float:
    """The nearest number of 24 bits, in float64, of a whole number of units."""
    size = abs(units)
    shift = max(size.bit_length() - 24, 0)
    top, rest = size >> shift, size & ((1 << shift) - 1)
    half = 1 << shift >> 1
    top += shift > 0 and (rest > half or (rest == half and top & 1))
    return (-1.0 if units < 0 else 1.0) * (top << shift) / UNIT


def test_the_host_adds_as_python_does():
    a, b = integers(5_000), integers(5_000)
    mod = 1 << 96
    got = add_sums(a.T[:, None, :].copy(), b[::-1].T[:, None, :].copy())[:, 0].T
    expected = [(x + y) % mod for x, y in zip(value(a), value(b[::-1]), strict=True)]
    assert [v % mod for v in value(got)] == expected


@pytest.mark.parametrize("lanes", [1, 16])
def test_what_has_no_highest_word(lanes):
    """Colours of which every channel is from 0 to 2^16; never one that is not finite."""
    cases = [0.0, 1.0, 3e4, 65536.0, 1e30, -1.0, np.inf, -np.inf, np.nan]
    given = np.array([(a, b, c) for a in cases for b in cases for c in cases], np.float32)
    given = np.concatenate([given, given[: -len(given) % 16]])
    body = "r[0] = sel(fixed_takes_small(v3(x[0], x[1], x[2])), (real)(1.0f), (real)(0.0f));"
    text = map_text(body, 3, 1, files=("core/fixed.cl",))
    small = run(text, lanes, np.ascontiguousarray(given.T), 1)[0].astype(bool)
    ordinary = (np.isfinite(given) & (given >= 0) & (given < 65536.0)).all(axis=1)
    assert not (small & ~ordinary).any()
    assert small[(ordinary & (given.sum(axis=1) < 65536.0))].all()
