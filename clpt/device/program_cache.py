"""A cache of a context's programs, so that a second renderer builds nothing."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Hashable
from typing import Any

import pyopencl as cl

from clpt.device import forking

_LIMIT = 128  # programs, some megabytes of driver memory

_contexts_lock = forking.renewed(threading.Lock())


class ProgramCache:
    """The most recently used programs of a context.

    The cache lives as long as a Python object of the context's queues: only queues of `Device`
    objects refer to it.
    """

    def __init__(self, context: cl.Context):
        self.context = context
        self._programs: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = forking.renewed(threading.Lock())

    def __len__(self) -> int:
        return len(self._programs)

    def find(self, key: Hashable) -> Any:
        """Return a program, None if it is missing."""
        with self._lock:
            if key in self._programs:
                self._programs.move_to_end(key)
            return self._programs.get(key)

    def keep(self, key: Hashable, program: object) -> None:
        """Keep a program; drop the least recently used program beyond the limit."""
        with self._lock:
            self._programs[key] = program
            while len(self._programs) > _LIMIT:
                self._programs.popitem(last=False)


_caches: weakref.WeakValueDictionary[int, ProgramCache] = weakref.WeakValueDictionary()


def cache_of(queue: cl.CommandQueue) -> ProgramCache:
    """Return the cache of the queue's context."""
    context = queue.context
    with _contexts_lock:
        # The handle is unique while a cache refers to its context.
        cache = _caches.get(context.int_ptr)
        if cache is None:
            cache = _caches[context.int_ptr] = ProgramCache(context)
        queue.clpt_programs = cache  # PyOpenCL's objects have no weak references
    return cache
