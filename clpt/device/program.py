"""Programs and kernels: building, errors in our own words, arguments by name."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pyopencl as cl

from ..errors import DeviceError, KernelBuildError
from . import cache
from .context import Device
from .source import Source

OPTIONS = ("-cl-std=CL1.2", "-cl-kernel-arg-info")

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
_VECTOR = re.compile(r"([a-z]+?)(2|3|4|8|16)$")


@dataclass(frozen=True)
class Argument:
    """One argument of a kernel: its name, OpenCL type and address space (global, private, ...)."""

    name: str
    type: str
    space: str

    @property
    def by_value(self) -> bool:
        return self.space == "private" and not self.type.endswith("*")

    def value(self, given: Any) -> Any:
        """What the driver is handed for `given`: scalars and vectors in the argument's type."""
        if not self.by_value or isinstance(given, (np.void, np.ndarray)):
            return given
        vector = _VECTOR.match(self.type)
        base = _SCALARS.get(vector[1] if vector else self.type)
        if base is None:  # a struct, an image or a sampler: as it was given
            return given
        if vector is None:
            return base(given)
        length = int(vector[2])
        packed = np.zeros(4 if length == 3 else length, base)
        packed[:length] = given
        return packed


class Program:
    """A built program; its kernels are kept, one object each."""

    def __init__(self, name: str, cl_program: cl.Program):
        self.name, self.cl_program = name, cl_program
        self._kernels: dict[str, Kernel] = {}

    @cached_property
    def kernel_names(self) -> tuple[str, ...]:
        return tuple(sorted(filter(None, self.cl_program.kernel_names.split(";"))))

    def kernel(self, name: str) -> Kernel:
        """The kernel of that name. Raises KeyError, telling which there are."""
        if name not in self._kernels:
            if name not in self.kernel_names:
                known = ", ".join(self.kernel_names) or "no kernel"
                raise KeyError(f"program {self.name!r} has no kernel {name!r}; it has {known}")
            self._kernels[name] = Kernel(self, name)
        return self._kernels[name]


class Kernel:
    """A kernel and what it takes; `bind` gives it arguments."""

    def __init__(self, program: Program, name: str):
        self.program, self.name = program, name
        self.arguments = _arguments(cl.Kernel(program.cl_program, name))

    def bind(self, **named: Any) -> Bound:
        """The kernel with every argument set, by name.

        Buffers for pointers (None is a null pointer), `pyopencl.LocalMemory` for local ones,
        numbers for scalars, sequences for vectors. Two bindings do not disturb each other.

        Raises TypeError if a name is missing or unknown, or a value does not fit.
        """
        return Bound(self, named)


class Bound:
    """A kernel with its arguments: bind once, enqueue many times."""

    def __init__(self, kernel: Kernel, named: Mapping[str, Any]):
        self.kernel = kernel
        self._cl_kernel = cl.Kernel(kernel.program.cl_program, kernel.name)
        self._places = {argument.name: (i, argument) for i, argument in enumerate(kernel.arguments)}
        self._values: dict[str, Any] = {}
        missing = [name for name in self._places if name not in named]
        if missing:
            raise TypeError(f"kernel {kernel.name!r} also takes {', '.join(missing)}")
        self.set(**named)

    def set(self, **named: Any) -> None:
        """Set arguments again by name. Raises TypeError as `Kernel.bind` does."""
        for name, given in named.items():
            if name not in self._places:
                known = ", ".join(self._places) or "nothing"
                raise TypeError(f"kernel {self.kernel.name!r} takes no {name!r}; it takes {known}")
            index, argument = self._places[name]
            try:
                value = argument.value(given)
                self._cl_kernel.set_arg(index, value)
            except (TypeError, ValueError, OverflowError, cl.Error) as error:
                raise TypeError(
                    f"kernel {self.kernel.name!r}: {name} is {argument.type}, "
                    f"{type(given).__name__} {given!r} does not fit: {error}"
                ) from error
            self._values[name] = value  # the driver does not keep buffers alive

    def enqueue(
        self,
        queue: cl.CommandQueue,
        global_size: Sequence[int],
        local_size: Sequence[int] | None = None,
        wait_for: Sequence[cl.Event] | None = None,
    ) -> cl.Event:
        """Run it; sizes are (x,), (x, y) or (x, y, z). Raises DeviceError if the driver refuses."""
        try:
            return cl.enqueue_nd_range_kernel(
                queue, self._cl_kernel, global_size, local_size, wait_for=wait_for
            )
        except cl.Error as error:
            raise DeviceError(
                f"kernel {self.kernel.name!r} cannot run at {global_size}, {local_size}: {error}"
            ) from error


def build(device: Device, source: Source, options: Sequence[str] = ()) -> Program:
    """Compile a program, or take it from the cache.

    Raises KernelBuildError with our file and line, the log, and where the text was kept.
    """
    flags = [*OPTIONS, *options]
    start = time.perf_counter()
    try:
        cl_program = cl.Program(device.context, source.text).build(flags)
    except cl.Error as error:
        raise _build_error(source, str(error)) from error
    device.builds.add(time.perf_counter() - start)
    return Program(source.name, cl_program)


def build_all(
    device: Device, sources: Mapping[str, Source], options: Sequence[str] = ()
) -> dict[str, Program]:
    """Build several programs at once, each in a thread of its own. Raises as `build` does."""
    with ThreadPoolExecutor(max_workers=max(1, min(len(sources), os.cpu_count() or 1))) as pool:
        futures = {name: pool.submit(build, device, s, options) for name, s in sources.items()}
        return {name: future.result() for name, future in futures.items()}


_PLACE = re.compile(r"""["']?([\w./ -]+\.\w+)["']?(?::|, line |\()(\d+)""")


def _build_error(source: Source, log: str) -> KernelBuildError:
    """The first error row of a compiler's log, as our file and line; the text is kept on disk."""
    rows = [row for row in log.splitlines() if re.search(r"\berror\b", row)]
    places = [match for match in map(_PLACE.search, rows) if match]
    file, line = (places[0][1].strip(), int(places[0][2])) if places else (None, None)
    return KernelBuildError(source.name, file, line, log, cache.keep_failed(source))


def _arguments(kernel: cl.Kernel) -> tuple[Argument, ...]:
    info, address = cl.kernel_arg_info, cl.kernel_arg_address_qualifier
    spaces = {getattr(address, name): name.lower() for name in ("GLOBAL", "LOCAL", "CONSTANT")}
    return tuple(
        Argument(
            name=kernel.get_arg_info(index, info.NAME),
            type=kernel.get_arg_info(index, info.TYPE_NAME).replace("unsigned ", "u"),
            space=spaces.get(kernel.get_arg_info(index, info.ADDRESS_QUALIFIER), "private"),
        )
        for index in range(kernel.num_args)
    )
