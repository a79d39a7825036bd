"""Programs and kernels: arguments by name, and the commands that run a kernel."""

from __future__ import annotations

import json
import math
import re
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import pyopencl as cl

from . import forking
from .runtimes import refused

_R = TypeVar("_R")

_SCALARS = {
    "char": np.int8,
    "uchar": np.uint8,
    "short": np.int16,
    "ushort": np.uint16,
    "int": np.int32,
    "uint": np.uint32,
    "long": np.int64,
    "ulong": np.uint64,
    "float": np.float32,
    "double": np.float64,
}
_LIMITS = {  # of whole numbers
    name: (int(np.iinfo(np.dtype(kind).name).min), int(np.iinfo(np.dtype(kind).name).max))
    for name, kind in _SCALARS.items()
    if np.dtype(kind).kind in "iu"
}
# A null pointer as bytes: PyOpenCL accepts None only from 2026.1.3.
_NULL = np.uintp(0)
_VECTOR = re.compile(r"([a-z]+?)(2|3|4|8|16)$")
_LIMIT = 128  # programs, some megabytes of driver memory

_contexts_lock = forking.renewed(threading.Lock())


@dataclass(frozen=True)
class Argument:
    """A kernel's argument: name, OpenCL type and address space (global, private, ...)."""

    name: str
    type: str
    space: str

    @cached_property
    def by_value(self) -> bool:
        return self.space == "private" and not self.type.endswith("*")

    @cached_property
    def _scalar(self) -> tuple[str, int]:
        """The scalar type, and the length of a vector, 0 of a scalar."""
        vector = _VECTOR.match(self.type)
        return (vector[1], int(vector[2])) if vector else (self.type, 0)

    def value(self, value: Any) -> Any:
        """Return a value in the driver's form: scalars and vectors in the argument's type.

        Raises TypeError for a number in place of a pointer, OverflowError.
        """
        if not self.by_value:
            if isinstance(value, (int, float, np.number)):  # older versions of PyOpenCL accept it
                raise TypeError("a pointer takes a buffer, or None")
            return value
        if isinstance(value, (np.void, np.ndarray)):
            return value
        name, length = self._scalar
        base = _SCALARS.get(name)
        if base is None:  # a struct, an image or a sampler
            return value
        if name in _LIMITS:  # NumPy before 2 truncates silently
            least, most = _LIMITS[name]
            numbers = value if length else (value,)
            if not all(least <= number <= most for number in numbers):
                raise OverflowError(f"it goes from {least} to {most}")
        if not length:
            return base(value)
        packed = np.zeros(4 if length == 3 else length, base)
        packed[:length] = value
        return packed


Signatures = Mapping[str, tuple[Argument, ...]]


class Program:
    """A built program.

    signatures: the arguments of each kernel by name.
    """

    def __init__(self, name: str, cl_program: cl.Program, signatures: Signatures):
        self.name, self.cl_program, self.signatures = name, cl_program, signatures
        self._borrowed: dict[str, BoundKernel] = {}
        self._borrowing = forking.renewed(threading.Lock())

    def kernel(self, name: str) -> Kernel:
        """Return a kernel by name. Raises KeyError, which lists the kernels."""
        if name not in self.signatures:
            known = ", ".join(sorted(self.signatures)) or "no kernel"
            raise KeyError(f"program {self.name!r} has no kernel {name!r}; it has {known}")
        return Kernel(self, name)

    def lend_kernel(
        self, name: str, named: Mapping[str, Any], use: Callable[[BoundKernel], _R]
    ) -> _R:
        """Bind a kernel's arguments and call `use`, which enqueues it; return its result.

        The kernel object is created once: PyOpenCL takes half a millisecond for it. Other threads
        wait meanwhile. Raises like `kernel` and `Kernel.bind`.
        """
        # A suspended generator would hold the lock after an interrupt, until it is freed.
        with self._borrowing:
            bound = self._borrowed.get(name)
            if bound is None:
                # A copy: a reference cycle would keep the driver's memory until garbage collection.
                copy = Program(self.name, self.cl_program, self.signatures)
                bound = self._borrowed[name] = copy.kernel(name).bind(**named)
            else:
                bound.bind(**named)
            try:
                return use(bound)
            finally:
                bound.drop_buffers()


class Kernel:
    """A kernel and its signature; `bind` sets its arguments."""

    def __init__(self, program: Program, name: str):
        self.program, self.name = program, name
        self.arguments = program.signatures[name]

    def bind(self, **named: Any) -> BoundKernel:
        """Return the kernel with every argument set, by name.

        Pointers take buffers (None is a null pointer), local pointers `pyopencl.LocalMemory`,
        scalars numbers, vectors sequences. Bindings are independent of each other.

        Raises TypeError if a name is missing or unknown, or a value does not fit.
        """
        return BoundKernel(self, named)


class BoundKernel:
    """A kernel with its arguments: bind once, enqueue many times."""

    def __init__(self, kernel: Kernel, named: Mapping[str, Any]):
        self.kernel = kernel
        self._cl_kernel = cl.Kernel(kernel.program.cl_program, kernel.name)
        self._indices = {
            argument.name: (i, argument) for i, argument in enumerate(kernel.arguments)
        }
        self._values: dict[str, Any] = {}  # in the driver's form
        self._numbers: dict[str, Any] = {}  # in the caller's form
        self._most: int | None = None  # the largest group on the device
        self.bind(**named)

    def bind(self, **named: Any) -> None:
        """Set all arguments. Raises TypeError like `Kernel.bind`."""
        missing = [name for name in self._indices if name not in named]
        if missing:
            raise TypeError(f"kernel {self.kernel.name!r} also takes {', '.join(missing)}")
        self.set_args(**named)

    @property
    def values(self) -> Mapping[str, Any]:
        """The arguments by name, in the driver's form."""
        return self._values

    def drop_buffers(self) -> None:
        """Drop the references to buffers; the driver keeps them until its commands end."""
        self._values.clear()

    def forget(self) -> None:
        """Drop the references to buffers, and let the next `bind` set every argument."""
        self._values.clear()
        self._numbers.clear()

    def set_args(self, **named: Any) -> None:
        """Set arguments by name. Raises TypeError like `Kernel.bind`."""
        for name, new in named.items():
            if isinstance(new, cl.Buffer) and self._values.get(name) is new:
                continue
            number = isinstance(new, (int, float, tuple))
            if number and type(new) is type(old := self._numbers.get(name)) and new == old:
                continue  # setting a number takes longer than enqueueing a kernel
            if name not in self._indices:
                known = ", ".join(self._indices) or "nothing"
                raise TypeError(f"kernel {self.kernel.name!r} takes no {name!r}; it takes {known}")
            index, argument = self._indices[name]
            self._numbers.pop(name, None)  # first: an interrupt may occur at any line
            try:
                value = argument.value(new)
                null = value is None and argument.space in ("global", "constant")
                self._cl_kernel.set_arg(index, _NULL if null else value)
            except (TypeError, ValueError, OverflowError, cl.Error) as error:
                raise TypeError(
                    f"kernel {self.kernel.name!r}: {name} is {argument.type}, "
                    f"{type(new).__name__} {new!r} does not fit: {error}"
                ) from error
            self._values[name] = value  # the driver does not keep buffers alive
            if number:
                self._numbers[name] = new

    def enqueue(
        self,
        queue: cl.CommandQueue,
        global_size: Sequence[int],
        local_size: Sequence[int] | None = None,
        wait_for: Sequence[cl.Event] | None = None,
        offset: Sequence[int] | None = None,
    ) -> cl.Event:
        """Enqueue the kernel; sizes are (x,), (x, y) or (x, y, z); offset: of the first work-item.

        Raises DeviceError if the driver refuses it, MemoryBudgetError if memory has run out.
        """
        try:
            group = self._fitting(queue, local_size)
            return cl.enqueue_nd_range_kernel(
                queue, self._cl_kernel, global_size, group, offset, wait_for=wait_for
            )
        except cl.Error as error:
            where = f"kernel {self.kernel.name!r} at {global_size}, {local_size}"
            raise refused(where, error) from error

    def _fitting(
        self, queue: cl.CommandQueue, local_size: Sequence[int] | None
    ) -> Sequence[int] | None:
        """Halve a group's size until the device can run the kernel with it."""
        if local_size is None:
            return None
        if self._most is None:
            self._most = most_items(self._cl_kernel, queue.device)
        size = list(local_size)
        while math.prod(size) > max(self._most, 1):
            size[size.index(max(size))] //= 2
        return size


def most_items(kernel: cl.Kernel, device: cl.Device) -> int:
    """Return the largest number of work-items of a kernel's group on a device."""
    return int(kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, device))


def read_signatures(program: cl.Program) -> Signatures:
    """Return the arguments of a built program's kernels, from the driver.

    Raises pyopencl.Error if the driver does not report them.
    """
    kernels = [cl.Kernel(program, name) for name in program.kernel_names.split(";") if name]
    return {kernel.function_name: _signature(kernel) for kernel in kernels}


def _signature(kernel: cl.Kernel) -> tuple[Argument, ...]:
    info, address = cl.kernel_arg_info, cl.kernel_arg_address_qualifier
    spaces = {getattr(address, name): name.lower() for name in ("GLOBAL", "LOCAL", "CONSTANT")}
    return tuple(
        Argument(
            # PoCL's macros rename arguments that share a builtin's name: sign becomes _cl_sign
            name=kernel.get_arg_info(index, info.NAME).removeprefix("_cl_"),
            type=kernel.get_arg_info(index, info.TYPE_NAME).replace("unsigned ", "u"),
            space=spaces.get(kernel.get_arg_info(index, info.ADDRESS_QUALIFIER), "private"),
        )
        for index in range(kernel.num_args)
    )


def encode(signatures: Signatures) -> str:
    """Return signatures as a line of text."""
    return json.dumps({name: [astuple(a) for a in args] for name, args in signatures.items()})


def decode(text: str) -> Signatures:
    """Return the signatures of a text from `encode`. Raises TypeError, ValueError."""
    return {name: tuple(Argument(*a) for a in args) for name, args in json.loads(text).items()}


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
