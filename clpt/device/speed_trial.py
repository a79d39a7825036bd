"""A short trial of the runtimes of a processor, with cached results."""

from __future__ import annotations

import hashlib
import json
import logging
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pyopencl as cl

from clpt.device import disk_cache, native_programs

from .source import Source, assemble

log = logging.getLogger(__name__)

_NODES, _ITEMS, _ROUNDS = 512, 64, 50


def measure(runtimes: Sequence[tuple[cl.CommandQueue, int]]) -> list[float]:
    """Return the trial kernel's time on a core by each runtime [s].

    runtimes: a queue and its number of lanes for each. They run in turn, and the least of many
    short rounds counts, since other processes disturb only some rounds. Raises errors of drivers.
    """
    timers = [_rounds(queue, lanes) for queue, lanes in runtimes]
    rounds = [[next(timer) for timer in timers] for _ in range(1 + _ROUNDS)]  # the first compiles
    return [min(times) for times in zip(*rounds[1:], strict=True)]


def _rounds(queue: cl.CommandQueue, lanes: int) -> Iterator[float]:
    """Run the trial kernel repeatedly; yield the time of each round [s]."""
    source, context = _source(lanes), queue.context
    options = ("-cl-std=CL1.2", "-w")
    program = native_programs.build(context, queue.device, source.text, options)
    table = np.random.default_rng(1).random((_NODES, 64), np.float32)
    flags = cl.mem_flags
    nodes = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=table)
    out = cl.Buffer(context, flags.WRITE_ONLY, 4 * lanes * _ITEMS)
    kernel = cl.Kernel(program, "trial")
    while True:
        start = time.perf_counter()
        kernel(queue, (_ITEMS,), (_ITEMS,), nodes, out).wait()
        yield time.perf_counter() - start


def remembered(runtimes: Sequence[str], measured: Callable[[], list[float]]) -> list[float] | None:
    """Return each runtime's seconds, cached or measured; None after a failure.

    runtimes: texts that identify drivers and processors; measured: runs the trial.

    A trial that started and did not end counts as failed: a driver that crashes the process does so
    once. Without a writable cache no trial runs. Another driver has another entry.
    """
    texts = [_source(lanes).text for lanes in (8, 16)]
    key = hashlib.sha256(repr((runtimes, texts)).encode()).hexdigest()
    stored = disk_cache.load(key)
    if stored is None:
        disk_cache.store(key, "null", b"")
        stored = disk_cache.load(key)
        if stored is None:
            return None
        try:
            stored = json.dumps(measured()), b""
        except Exception as error:  # any exception of a broken driver
            log.debug("the trial of runtimes failed: %s", error)
            return None
        disk_cache.store(key, *stored)
    seconds: list[float] | None = json.loads(stored[0])
    return seconds


def _source(lanes: int) -> Source:
    return assemble("stage/trial.cl", defines={"LANES": lanes, "TRIAL_NODES": _NODES})
