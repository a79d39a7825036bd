"""Words that follow one another: every lane reads its own, and their bits stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.records.layout import Record
from tests.kernels import harness

ROW = Record("Row", "Words.", a=("natural", ""), b=("vec3", ""), c=("vec2", ""))
TEXT = f"""#include "core/lanes.cl"
#include "core/rows.cl"
#include "core/math.cl"
{ROW.row_text()}
kernel void probe(global const float *in, global float *out, uint n)
{{
    uint at = get_global_id(0) * LANES;
    integer from = as_integer(block_load(in + at));
    global const float *table = in + n;
    vec2 two = gather2(table, from);
    vec3 three = gather3(table, from);
    vec4 four = gather4(table, from);
    Row row = row_row((global const uint *)table, from);
    real all[15] = {{two.x, two.y, three.x, three.y, three.z, four.x, four.y, four.z, four.w,
                    as_real(row.a), row.b.x, row.b.y, row.b.z, row.c.x, row.c.y}};
    for (int i = 0; i < 15; i++) block_store(out + i * n + at, all[i]);
}}
"""


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_lanes_read_rows(lanes: int) -> None:
    """Words are random bits, among them signalling NaN; a row of six words is read in two parts.

    Some work-items read one row in all lanes, and one in all but the last.
    """
    rng = np.random.default_rng(1)
    n = 64
    first = rng.integers(0, n - 5, n, dtype=np.uint32)
    first[16:48], first[47] = 2, 3
    words = rng.integers(0, 2**32, n, dtype=np.uint32)
    words[:3] = 0x7F800001, 0xFFC12345, 0x80000000
    given = np.stack([first, words]).view(np.float32)
    got = harness.run(TEXT, lanes, given, 15).view(np.uint32)
    offsets = [0, 1, *range(3), *range(4), *range(6)]
    np.testing.assert_array_equal(got, [words[first + i] for i in offsets])
