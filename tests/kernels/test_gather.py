"""Memory lane by lane: what is read, what is written, and by which lane."""

from __future__ import annotations

import numpy as np
import pytest

from tests.kernels import harness

TEXT = """#include "core/lanes.cl"
kernel void probe(global const float *in, global float *out, uint n)
{
    uint at = get_global_id(0) * LANES;
    integer from = as_integer(block_load(in + at)), to = as_integer(block_load(in + n + at));
    global const float *table = in + 2 * n;
    block_store(out + at, gather(table, from));
    block_store(out + n + at, as_real(gather_i((global const uint *)table, from)));
    block_store(out + 2 * n + at, (real)(0.0f));
    scatter_if(out + 2 * n + at, to, (from & 1) != 0, block_load(table + at));
}
"""


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_lanes_read_any_word_and_the_last_writes(lanes: int) -> None:
    """Words are random bits, among them signalling NaN, which have to stay as they are."""
    rng = np.random.default_rng(1)
    n = 64
    read = rng.integers(0, n, n, dtype=np.uint32)
    write = rng.integers(0, lanes, n, dtype=np.uint32)  # many lanes write to one place
    words = rng.integers(0, 2**32, n, dtype=np.uint32)
    words[:3] = 0x7F800001, 0xFFC12345, 0x80000000
    given = np.stack([read, write, words]).view(np.float32)
    gathered, as_words, written = harness.run(TEXT, lanes, given, 3).view(np.uint32)
    np.testing.assert_array_equal(gathered, words[read])
    np.testing.assert_array_equal(as_words, words[read])
    expected = np.zeros(n, np.uint32)
    for i in range(n):
        if read[i] & 1:
            expected[i // lanes * lanes + write[i]] = words[i]
    np.testing.assert_array_equal(written, expected)
