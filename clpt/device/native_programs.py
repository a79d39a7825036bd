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
_STANDARD = "-cl-std"
_USED = re.compile(r"Used (\d+) registers")
_SPILLED = re.compile(r"(\d+) bytes spill stores")
_P = TypeVar("_P")


def build(
    context: cl.Context, device: cl.Device, code: str | bytes, options: Sequence[str] = ()
) -> cl.Program:
    """Build a program for a device, from a text or a binary.

    Raises pyopencl.Error with the driver's log.
    """
    source = (code,) if isinstance(code, str) else ([device], [code])

    def attempt(flags: bytes) -> cl.Program:
        program = _cl._Program(context, *source)
        return _tried(program, device, lambda: program._build(flags, [device]))

    return _with_or_without_standard(options, attempt)


def compile_part(
    context: cl.Context, device: cl.Device, text: str, options: Sequence[str] = ()
) -> cl.Program:
    """Compile a text for linking. Raises pyopencl.Error with the driver's log."""

    def attempt(flags: bytes) -> cl.Program:
        program = _cl._Program(context, text)
        return _tried(program, device, lambda: program.compile(flags, [device], []))

    return _with_or_without_standard(options, attempt)


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


def _tried(program: Any, device: cl.Device, action: Callable[[], Any]) -> cl.Program:
    """Run an action on a program and return it; add the build log to an error, or log it."""
    try:
        action()
    except cl.Error as error:
        text = program.get_build_info(device, cl.program_build_info.LOG)
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


def _with_or_without_standard(options: Sequence[str], attempt: Callable[[bytes], _P]) -> _P:
    """Return the result of `attempt`; if the driver refuses `-cl-std`, leave that option out.

    By OpenCL's specification a compiler then takes the latest version of 1.x that it has.
    """
    try:
        return attempt(" ".join(options).encode())
    except cl.Error as error:
        others = [option for option in options if not option.startswith(_STANDARD)]
        if len(others) == len(options) or not _refuses_standard(error):
            raise
        log.debug("the driver refuses %s: %s", _STANDARD, error)
    return attempt(" ".join(others).encode())


def _refuses_standard(error: cl.Error) -> bool:
    refused = (cl.status_code.INVALID_BUILD_OPTIONS, cl.status_code.INVALID_COMPILER_OPTIONS)
    return error.code in refused or _STANDARD in str(error)
