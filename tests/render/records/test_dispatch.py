"""Dispatch in lanes: each lane gets the value of its own case, and no lane reads beyond a table."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.render.records.dispatch import Case, Function, active, choose, masked
from tests.kernels.harness import map_text, run

PAIR = "typedef struct { real a, b; } OddPair;\n" + (
    "inline OddPair odd_pair_sel(mask m, OddPair a, OddPair b)\n"
    "{\n    OddPair r = {sel(m, a.a, b.a), sel(m, a.b, b.b)};\n    return r;\n}\n"
)


def results(functions: str, body: str, lanes: int, *given: np.ndarray) -> np.ndarray:
    """What `body` makes of x[0], x[1] with these functions before it: r[0]."""
    text = map_text(body, len(given), 1)
    text = text.replace("kernel void probe", f"{functions}kernel void probe")
    return run(text, lanes, np.stack(given).astype(np.float32), 1)[0]


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_each_lane_gets_the_value_of_its_case(lanes: int) -> None:
    """Kinds 1 and 2 have a case, of kind 3 two hold, kind 0 has none."""
    function = Function(
        "real picked(integer kind, real x)",
        "-1.0f",
        [
            Case("kind == 1", "y * x", ("real y = 2.0f;",)),
            Case("kind >= 2", "x * x"),
            Case("kind == 3", "x + offset"),
        ],
        ("real offset = 10.0f;",),
        "value + 0.5f",
    )
    rng = np.random.default_rng(1)
    kind, x = rng.integers(0, 4, 200), rng.random(200).astype(np.float32)
    found = results(function.text(), "r[0] = picked(to_integer(x[0]), x[1]);", lanes, kind, x)
    expected = np.choose(kind, [-np.ones_like(x), 2 * x, x * x, x + 10]) + 0.5
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("lanes", [1, 8])
def test_a_case_for_all_lanes(lanes: int) -> None:
    """It has a mask as well, which its value may use; a struct is chosen by its own function."""
    rows = choose("pair", "OddPair", Case("", "other", ("OddPair other = {x[0], 3.0f};",)))
    body = "OddPair pair = {7.0f, 7.0f}; " + " ".join(rows) + " r[0] = pair.a + pair.b;"
    x = np.arange(32.0)
    np.testing.assert_array_equal(results(PAIR, body, lanes, x), x + 3.0)


@pytest.mark.parametrize("lanes", [1, 16])
def test_lanes_without_the_mask_read_the_first_word(lanes: int) -> None:
    """Half of the indices would lie far outside of the memory that `in` has."""
    index = np.arange(32.0)
    outside = index % 2 == 1
    given = np.where(outside, 1e9, index)
    rows = masked(
        "x[0] < 1000.0f",
        f"integer at = {active('to_integer(x[0])')};",
        "r[0] = sel(m, gather(in, at), r[0]);",
    )
    found = results("", "r[0] = -5.0f; " + " ".join(rows), lanes, given)
    np.testing.assert_array_equal(found, np.where(outside, -5.0, index))
