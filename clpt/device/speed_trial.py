"""Which of several runtimes that serve one processor is the fastest: a short trial, remembered."""

from __future__ import annotations

import hashlib
import json
import logging
import time
from collections.abc import Callable, Sequence

import numpy as np
import pyopencl as cl

from clpt.device import disk_cache, native_programs

from .source import Source, assemble

log = logging.getLogger(__name__)

_NODES, _ITEMS, _ROUNDS = 512, 64, 25


def measure(queue: cl.CommandQueue, lanes: int) -> float:
    """Return what the trial's kernel takes on one core of a queue's device [s].

    It is the least of many short rounds, of which neighbours on the machine disturb only some.
    Raises what a driver raises.
    """
    source, context = _source(lanes), queue.context
    options = ("-cl-std=CL1.2", "-w")
    program = native_programs.build(context, queue.device, source.text, options)
    table = np.random.default_rng(1).random((_NODES, 64), np.float32)
    flags = cl.mem_flags
    given = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=table)
    out = cl.Buffer(context, flags.WRITE_ONLY, 4 * lanes * _ITEMS)
    kernel, taken = cl.Kernel(program, "trial"), []
    for _ in range(1 + _ROUNDS):  # the first one compiles
        start = time.perf_counter()
        kernel(queue, (_ITEMS,), (_ITEMS,), given, out).wait()
        taken.append(time.perf_counter() - start)
    return min(taken[1:])


def remembered(runtimes: Sequence[str], measured: Callable[[int], float]) -> list[float] | None:
    """Return each runtime's seconds, of the cache folder or as measured; None where that failed.

    runtimes: all that tells drivers and processors apart; measured: called with their numbers.

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
            stored = json.dumps([measured(number) for number in range(len(runtimes))]), b""
        except Exception as error:  # whatever a broken driver raises
            log.debug("no trial tells which runtime is faster: %s", error)
            return None
        disk_cache.store(key, *stored)
    seconds: list[float] | None = json.loads(stored[0])
    return seconds


def _source(lanes: int) -> Source:
    return assemble("stage/trial.cl", defines={"LANES": lanes, "TRIAL_NODES": _NODES})
