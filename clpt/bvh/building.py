"""The state of a build: device, memory, kernels."""

from __future__ import annotations

import functools
from typing import TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from ..device import Buffers, Device, Program, Source, Stream, assemble, host_buffer
from ..device import build as build_program

Array: TypeAlias = NDArray | cl.Buffer

_ZERO_COPY = 1 << 16  # [bytes] arrays from this size on are read in place
_GROUP = 8  # work-items of a group, each with a triangle or node
_ADVICE = "use fewer triangles, or a device with more memory"


@functools.cache
def _source(root: str) -> Source:
    return assemble(root)


class Building:
    """A build on a device. Programs and kernels are created once a context.

    stream: for all commands, by default a new stream of the device's queue.
    """

    def __init__(self, device: Device, stream: Stream | None = None):
        self.device = device
        self.buffers = Buffers(device)
        self.stream: Stream = stream or Stream(device.queue)
        self._programs: dict[str, Program] = {}

    def run(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue n work-items of a kernel of the program at `root`, in groups of 1."""
        self._enqueue(root, kernel, n, 1, arguments)

    def run_each(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue like `run`, in larger groups, for kernels with an argument `count`, set to n."""
        self._enqueue(root, kernel, n, _GROUP, {"count": n, **arguments})

    def allocate(self, nbytes: int) -> cl.Buffer:
        """Return a buffer. Raises MemoryBudgetError."""
        return self.buffers.allocate("building the scene's tree", nbytes, _ADVICE)

    def upload(self, array: Array, dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer with an array; a buffer is returned unchanged. Raises like `allocate`."""
        if isinstance(array, cl.Buffer):
            return array
        return self.buffers.upload("the scene's triangles", array, dtype, _ADVICE)

    def wrap_host(self, array: Array, dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer like `upload` for the time of the build; CPUs read arrays in place.

        The caller keeps the array until the stream has ended.
        """
        if isinstance(array, cl.Buffer):
            return array
        host = np.ascontiguousarray(array, dtype)
        if not (self.device.info.is_cpu and host.nbytes >= _ZERO_COPY):
            return self.upload(host, dtype)
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.USE_HOST_PTR
        return host_buffer(self.device.context, flags, host)

    def read(self, buffer: cl.Buffer, n: int, dtype: DTypeLike) -> NDArray:
        """Wait and return the first n values of a buffer."""
        return self.stream.read(buffer, np.empty(n, dtype))

    def _enqueue(self, root: str, kernel: str, n: int, group: int, arguments: dict) -> None:
        program = self._programs.get(root)
        if program is None:
            program = self._programs[root] = build_program(self.device, _source(root))
        size = (-(-n // group) * group,)
        program.lend_kernel(kernel, arguments, lambda bound: self.stream.run(bound, size, (group,)))
