"""The tolerance for an expression that two programs may round differently."""

from __future__ import annotations

from functools import cache

import numpy as np

from clpt import device
from clpt.testing.probe import run

CONTRACTED = {"rtol": 1e-3, "atol": 5e-5}  # for values about 1; twice NVIDIA's difference

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
    """Return whether the device's compiler joins a product and a later sum to an fma.

    Whether it joins them depends on the remaining program. So two programs may round the same
    expression differently: lanes of two widths agree to CONTRACTED. On other devices they agree to
    the bit.
    """
    streams = np.array([[1 + 2.0**-12], [1 + 2.0**-11]])  # a number, and its square as rounded
    return bool(run(on, {"probe.cl": _TEXT}, 1, streams, 1)[0, 0] != 0.0)
