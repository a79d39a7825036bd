"""Programs that were built in a context, so that a second renderer in it builds nothing."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Hashable
from typing import Any

import pyopencl as cl

from clpt.device import forking

_LIMIT = 128  # programs, some megabytes of a driver's memory

_contexts_lock = forking.renewed(threading.Lock())


class ProgramCache:
    """The programs of one context that were used last.

    They live as long as a Python object of one of the context's queues: each queue of a `Device`
    refers to the cache of its context, and nothing else does.
    """

    def __init__(self, context: cl.Context):
        self.context = context
        self._programs: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = forking.renewed(threading.Lock())

    def __len__(self) -> int:
        return len(self._programs)

    def find(self, key: Hashable) -> Any:
        """Return a program, None if there is none."""
        with self._lock:
            if key in self._programs:
                self._programs.move_to_end(key)
            return self._programs.get(key)

    def keep(self, key: Hashable, program: object) -> None:
        """Keep a program; drop the one that was used longest ago if there are too many."""
        with self._lock:
            self._programs[key] = program
            while len(self._programs) > _LIMIT:
                self._programs.popitem(last=False)


_of_contexts: weakref.WeakValueDictionary[int, ProgramCache] = weakref.WeakValueDictionary()


def of(queue: cl.CommandQueue) -> ProgramCache:
    """Return the cache of the queue's context."""
    context = queue.context
    with _contexts_lock:
        # No other context has the handle while a cache refers to this one.
        cache = _of_contexts.get(context.int_ptr)
        if cache is None:
            cache = _of_contexts[context.int_ptr] = ProgramCache(context)
        queue.clpt_programs = cache  # PyOpenCL's objects take no weak references
    return cache
