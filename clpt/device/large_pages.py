"""Large pages for the buffers of processors.

A processor finds the page of an address in a small table. Scattered reads of a large buffer miss
this table, and a miss in a virtual machine costs twice as much. Linux gives pages of 2 MiB in place
of 4 KiB if a process asks for them before it touches the memory (madvise(2), MADV_HUGEPAGE).
"""

from __future__ import annotations

import ctypes
import sys

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

_PAGE = 2 << 20  # [bytes] of x86-64 and of most ARM systems
_LEAST = 2 * _PAGE  # [bytes] of a buffer that is sure to contain a whole page
_ADVICE = 14  # MADV_HUGEPAGE


def pay(on_processor: bool, nbytes: int) -> bool:
    """Whether to ask for large pages for a buffer of so many bytes."""
    return on_processor and nbytes >= _LEAST and sys.platform == "linux"


def ask(queue: cl.CommandQueue, buffer: cl.Buffer, content: NDArray | None) -> None:
    """Ask for large pages for a new buffer of a processor, and then write its content.

    queue: without commands, as this waits for it; content: C-contiguous, of the buffer's size, or
    None. Raises pyopencl.Error.
    """
    flags = cl.map_flags.WRITE_INVALIDATE_REGION
    view, _ = cl.enqueue_map_buffer(queue, buffer, flags, 0, buffer.size, np.uint8)
    begin = -(-view.ctypes.data // _PAGE) * _PAGE
    end = (view.ctypes.data + buffer.size) // _PAGE * _PAGE
    # A system without large pages refuses, and the buffer has small ones.
    ctypes.CDLL(None).madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _ADVICE)
    if content is not None:
        view[:] = content.reshape(-1).view(np.uint8)
    view.base.release(queue)
    queue.finish()
