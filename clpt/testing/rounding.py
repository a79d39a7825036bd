"""Rounding of one expression in two programs, and the tolerance that it asks for."""

from __future__ import annotations

from functools import cache

import numpy as np

from clpt import device
from clpt.testing.probe import run

CONTRACTED = {"rtol": 1e-3, "atol": 5e-5}  # of values about 1; twice what NVIDIA's needs

_TEXT = """
kernel void probe(global const float *in, global float *out, uint n)
{
    uint at = get_global_id(0);
    float product = in[at] * in[at];
    out[at] = product - in[n + at];
}
"""


@cache
def contracts(on: device.Device) -> bool:
    """Return whether the device's compiler makes an fma of a product and a sum that stand apart.

    Which of them it joins depends on the rest of the program. So one expression is rounded in two
    ways in two programs, and lanes of two widths agree to CONTRACTED; elsewhere they agree to the
    bit.
    """
    given = np.array([[1 + 2.0**-12], [1 + 2.0**-11]])  # a number, and its square as rounded
    return bool(run(on, {"probe.cl": _TEXT}, 1, given, 1)[0, 0] != 0.0)
