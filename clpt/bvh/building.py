"""The state of a build: device, memory, kernels."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from ..device import Buffers, Device, Program, Source, Stream, assemble, host_buffer
from ..device import build as build_program

Array: TypeAlias = NDArray | cl.Buffer

_ZERO_COPY = 1 << 16  # [bytes] arrays from this size on are read in place
_SCAN = "bvh/scan.cl#sums"
_ADVICE = "use fewer triangles, or a device with more memory"


@dataclass(frozen=True)
class Grain:
    """The division of a build among work-items.

    each: work-items of a group, with a triangle or node each; group: work-items that share a tile;
    tile: clusters or nodes of a tile; keys: keys of a tile that is sorted, 0 for a few tiles a
    compute unit; digit, passes: bits of a digit, and digits; stretch: items that a work-item
    bounds, or cuts into leaves; extents: that a work-item unites; upward: whether trees are built
    from the leaves up.
    """

    each: int
    group: int
    tile: int
    keys: int
    digit: int
    passes: int
    stretch: int
    extents: int
    upward: bool


FEW = Grain(8, 1, 2048, 0, 11, 3, 2048, 1 << 20, upward=False)  # work-items at a time, as on CPUs
MANY = Grain(64, 128, 512, 2048, 4, 8, 128, 32, upward=True)


@functools.cache
def _source(root: str) -> Source:
    return assemble(root)


class Building:
    """A build on a device. Programs and kernels are created once a context.

    stream: for all commands, by default a new stream of the device's queue. limit: of its buffers
    [bytes], by default the device's free memory.
    """

    def __init__(self, device: Device, stream: Stream | None = None, limit: int | None = None):
        self.device = device
        self.buffers = Buffers(device, limit)
        self.stream: Stream = stream or Stream(device.queue)
        self.grain = FEW if device.info.is_cpu else MANY
        self._programs: dict[str, Program] = {}

    def run(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue n work-items of a kernel of the program at `root`, in groups of 1."""
        self._enqueue(root, kernel, n, 1, arguments)

    def run_each(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue like `run`, in larger groups, for kernels with an argument `count`, set to n."""
        self._enqueue(root, kernel, n, self.grain.each, {"count": n, **arguments})

    def run_stretches(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue n work-items like `run`, for kernels that end early beyond an array."""
        group = 1 if self.grain.group == 1 else self.grain.each
        self._enqueue(root, kernel, n, group, arguments)

    def run_tiles(self, root: str, kernel: str, groups: int, **arguments: object) -> None:
        """Enqueue groups of `grain.group` work-items, each with a tile; more groups may start."""
        group = self.grain.group
        self._enqueue(root, kernel, groups * group, group, arguments)

    def local(self, words: int) -> cl.LocalMemory:
        """Return local memory for `run_tiles`; words: of a work-item."""
        return cl.LocalMemory(4 * words * self.grain.group)

    def sums_before(self, numbers: cl.Buffer, count: int) -> None:
        """Enqueue the replacement of uint32 numbers by the sums before them; the last follows."""
        source = {"numbers": numbers, "count": count, "sums": self.local(2)}
        self.run_tiles(_SCAN, "scan_sums", 1, **source)

    def few_extents(self, extents: cl.Buffer) -> cl.Buffer:
        """Return few extents, in place of many, with the same bounds."""
        run = self.grain.extents
        while (count := extents.size // 64) > run:
            size = -(-count // run)
            fewer = self.allocate(64 * size)
            source = {"parts": extents, "count": count, "run": run, "extents": fewer}
            self.run_stretches(_SCAN, "scan_extents", size, **source)
            extents = fewer
        return extents

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
