"""Which of several runtimes that serve one processor is the fastest: a short trial, remembered."""

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
    """Return what the trial's kernel takes on one core by each runtime [s].

    runtimes: a queue of each, and how many lanes it has. They run in turn, and the least of many
    short rounds counts, as neighbours on the machine disturb only some. Raises what a driver
    raises.
    """
    rounds = [_rounds(queue, lanes) for queue, lanes in runtimes]
    taken = [[next(one) for one in rounds] for _ in range(1 + _ROUNDS)]  # the first one compiles
    return [min(times) for times in zip(*taken[1:], strict=True)]


def _rounds(queue: cl.CommandQueue, lanes: int) -> Iterator[float]:
    """Run the trial's kernel again and again; yield what each round takes [s]."""
    source, context = _source(lanes), queue.context
    options = ("-cl-std=CL1.2", "-w")
    program = native_programs.build(context, queue.device, source.text, options)
    table = np.random.default_rng(1).random((_NODES, 64), np.float32)
    flags = cl.mem_flags
    given = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=table)
    out = cl.Buffer(context, flags.WRITE_ONLY, 4 * lanes * _ITEMS)
    kernel = cl.Kernel(program, "trial")
    while True:
        start = time.perf_counter()
        kernel(queue, (_ITEMS,), (_ITEMS,), given, out).wait()
        yield time.perf_counter() - start


def remembered(runtimes: Sequence[str], measured: Callable[[], list[float]]) -> list[float] | None:
    """Return each runtime's seconds, of the cache folder or as measured; None where that failed.

    runtimes: all that tells drivers and processors apart; measured: makes the trial.

    A trial that has begun and not ended is one that failed: a driver that ends the process does so
    once. One that cannot be remembered is not made. Both are forgotten with another driver.
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
        except Exception as error:  # whatever a broken driver raises
            log.debug("no trial tells which runtime is faster: %s", error)
            return None
        disk_cache.store(key, *stored)
    seconds: list[float] | None = json.loads(stored[0])
    return seconds


def _source(lanes: int) -> Source:
    return assemble("stage/trial.cl", defines={"LANES": lanes, "TRIAL_NODES": _NODES})
