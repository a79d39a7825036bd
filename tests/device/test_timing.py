"""Timings: counted by name, and nothing without profiling."""

from __future__ import annotations

import numpy as np

from clpt.device import Buffers, Device, Timings, assemble, build

TEXT = """
__kernel void work(__global float *x, uint n) { for (uint i = 0; i < n; i++) x[0] += i; }
"""


def run(device: Device) -> Timings:
    buffer = Buffers(device).upload("x", np.zeros(1, np.float32))
    work = build(device, assemble("t", {"t": TEXT})).kernel("work")
    timings = Timings(device.queue)
    for name, n in (("short", 1), ("long", 100_000), ("long", 100_000)):
        event = work.bind(x=buffer, n=n).enqueue(device.queue, (1,), (1,))
        assert timings.add(name, event) is event
    return timings


def test_sums_by_name(device):
    timings = run(Device.open(device.info, profiling=True)).collect()
    assert {name: timing.calls for name, timing in timings.items()} == {"short": 1, "long": 2}
    seconds = [timing.seconds for timing in timings.values()]
    assert seconds == sorted(seconds, reverse=True) and seconds[-1] > 0.0


def test_nothing_without_profiling(device):
    assert run(device).collect() == {}
