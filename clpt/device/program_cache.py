"""Programs that were built in a context, so that a second renderer there builds nothing."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Hashable
from typing import Any

import pyopencl as cl

_LIMIT = 128  # programs, some megabytes of a driver's memory

_finding = threading.Lock()


class ProgramCache:
    """The programs of one context that were used last.

    They live as long as one of the context's queues does, as Python sees it: each queue that asked
    refers to the same `Kept`, and nothing else does.
    """

    def __init__(self, context: cl.Context):
        self.context = context
        self._programs: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, key: Hashable) -> Any:
        """A program, None if there is none."""
        with self._lock:
            if key in self._programs:
                self._programs.move_to_end(key)
            return self._programs.get(key)

    def keep(self, key: Hashable, program: Any) -> None:
        """Keep a program, and let the one that was used longest ago go if there are too many."""
        with self._lock:
            self._programs[key] = program
            while len(self._programs) > _LIMIT:
                self._programs.popitem(last=False)


_of_contexts: weakref.WeakValueDictionary[int, ProgramCache] = weakref.WeakValueDictionary()


def of(queue: cl.CommandQueue) -> ProgramCache:
    """What was built in the queue's context."""
    context = queue.context
    with _finding:
        kept = _of_contexts.get(context.int_ptr)  # no other has it while a `Kept` refers to it
        if kept is None:
            kept = _of_contexts[context.int_ptr] = ProgramCache(context)
        queue.clpt_programs = kept  # PyOpenCL's objects take no weak references
    return kept
