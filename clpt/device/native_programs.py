"""OpenCL programs of a driver, without PyOpenCL's warnings, and with limits of registers.

PyOpenCL warns of every build with a log, and Intel's CPU runtime writes a remark for each kernel.
Python's filters of warnings apply to all threads of a process. So this module uses PyOpenCL's
native class, which does not warn, and logs the driver's log.

NVIDIA's compiler takes a limit of registers as an option and reports the number used. It uses up
a limit, so a limit is tried only below the number without a limit, and a program that spills is
dropped. The driver reports nothing for a program from its cache, so callers store the limit.
"""

from __future__ import annotations

import ctypes
import logging
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, TypeVar

import pyopencl as cl
from pyopencl import _cl

log = logging.getLogger(__name__)

REGISTERS_VERBOSE = "-cl-nv-verbose"
_USED = re.compile(r"Used (\d+) registers")
_SPILLED = re.compile(r"(\d+) bytes spill stores")
_REFUSED = (cl.status_code.INVALID_BUILD_OPTIONS, cl.status_code.INVALID_COMPILER_OPTIONS)
_P = TypeVar("_P")


def build(
    context: cl.Context, device: cl.Device, code: str | bytes, options: Sequence[str] = ()
) -> cl.Program:
    """Build a program for a device, from a text or a binary.

    Raises pyopencl.Error with the driver's log.
    """
    source = (code,) if isinstance(code, str) else ([device], [code])
    return _tried(_cl._Program._build, context, device, source, options)


def compile_part(
    context: cl.Context, device: cl.Device, text: str, options: Sequence[str] = ()
) -> cl.Program:
    """Compile a text for linking. Raises pyopencl.Error with the driver's log."""
    return _tried(_cl._Program.compile, context, device, (text,), options, [])


def binary(program: cl.Program) -> bytes:
    """Return a program's binary, for the device that it was built for.

    Some drivers finish compiling only for this query, and PyOpenCL holds Python's lock meanwhile:
    no other thread could run, and Ctrl-C would not end the process. So ctypes queries the size
    first, without the lock.
    """
    room = (ctypes.c_size_t * len(program.get_info(cl.program_info.DEVICES)))()
    size, handle = ctypes.c_size_t(ctypes.sizeof(room)), ctypes.c_void_p(program.int_ptr)
    with suppress(AttributeError):  # PyOpenCL's module may hide the loader's functions
        query = ctypes.CDLL(_cl.__file__).clGetProgramInfo
        query(handle, cl.program_info.BINARY_SIZES, size, room, None)
    return next(filter(None, program.get_info(cl.program_info.BINARIES)))


def log_of(program: cl.Program, device: cl.Device) -> str:
    """Return the build log of a program for a device."""
    return str(program.get_build_info(device, cl.program_build_info.LOG))


def _tried(
    action: Callable, context: cl.Context, device: cl.Device, source: tuple, flags: Sequence[str],
    *more: list,
) -> cl.Program:  # fmt: skip
    """Run an action on a new program and return it; add the build log to an error, or log it."""
    program: Any = _cl._Program(context, *source)
    try:
        action(program, " ".join(flags).encode(), [device], *more)
    except cl.Error as error:
        text = program.get_build_info(device, cl.program_build_info.LOG)
        others = [flag for flag in flags if not flag.startswith("-cl-std")]  # 1.x is the default
        if len(others) < len(flags) and (error.code in _REFUSED or "-cl-std" in text):
            return _tried(action, context, device, source, others, *more)
        record = _cl._ErrorRecord(msg=f"{error}\n\n{text}", code=error.code, routine=error.routine)
        raise type(error)(record) from None
    if text := program.get_build_info(device, cl.program_build_info.LOG).strip():
        log.debug("%s says of a program: %s", device.platform.name, text)
    return cl.Program(program)


def register_options(limit: int) -> list[str]:
    """Return NVIDIA's options for a limit of registers, 0 for none, and for its report."""
    return [REGISTERS_VERBOSE, *([f"-cl-nv-maxrregcount={limit}"] if limit else [])]


def registers_used(log: str) -> tuple[int, int]:
    """Return the most registers and spilled bytes of a log's kernels; 0 if it reports none."""
    registers, spills = (map(int, pattern.findall(log)) for pattern in (_USED, _SPILLED))
    return max(registers, default=0), max(spills, default=0)


def with_fewest_registers(
    limits: Sequence[int], build: Callable[[int], tuple[_P, tuple[int, int]]]
) -> tuple[_P, int | None]:
    """Return a program of the least limit without spills, and the limit.

    The limit is 0 if all limits spill, None if the compiler reported nothing. build: takes a
    limit; returns a program, and the result of `registers_used`.
    """
    program, (used, _) = build(0)
    for limit in sorted(limits):
        if limit < used:
            limited, (registers, spilled) = build(limit)
            if registers and not spilled:
                return limited, limit
    return program, 0 if used else None
