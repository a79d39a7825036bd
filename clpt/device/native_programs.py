"""OpenCL programs as the driver builds them, without PyOpenCL's warnings.

PyOpenCL warns of every build whose log is not empty, and Intel's CPU runtime writes a remark for
each kernel. A filter of Python's warnings belongs to the whole process, and cannot be set for one
thread. So this module uses PyOpenCL's native class, which does not warn, and logs what the driver
says.
"""

from __future__ import annotations

import ctypes
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import pyopencl as cl
from pyopencl import _cl

log = logging.getLogger(__name__)


def build(
    context: cl.Context, device: cl.Device, code: str | bytes, options: Sequence[str] = ()
) -> cl.Program:
    """Build a program for one device, of a text or a binary.

    Raises pyopencl.Error with the driver's log.
    """
    if isinstance(code, str):
        program = _cl._Program(context, code)
    else:
        program = _cl._Program(context, [device], [code])
    return _tried(program, device, lambda: program._build(_joined(options), [device]))


def compile_part(
    context: cl.Context, device: cl.Device, text: str, options: Sequence[str] = ()
) -> cl.Program:
    """Compile a text, to be linked. Raises pyopencl.Error with the driver's log."""
    program = _cl._Program(context, text)
    return _tried(program, device, lambda: program.compile(_joined(options), [device], []))


def binary(program: cl.Program) -> bytes:
    """Return a program's binary, for the one device of its context that it was built for.

    Some drivers compile to the end only for that, and PyOpenCL holds Python's lock meanwhile: no
    other thread could run, nor Ctrl-C end the process. So its size is asked for without that lock.
    """
    room = (ctypes.c_size_t * len(program.get_info(cl.program_info.DEVICES)))()
    size, handle = ctypes.c_size_t(ctypes.sizeof(room)), ctypes.c_void_p(program.int_ptr)
    with suppress(AttributeError):  # the loader's functions are not seen through PyOpenCL's module
        ask = ctypes.CDLL(_cl.__file__).clGetProgramInfo
        ask(handle, cl.program_info.BINARY_SIZES, size, room, None)
    return next(filter(None, program.get_info(cl.program_info.BINARIES)))


def said(program: cl.Program, device: cl.Device) -> str:
    """Return what the driver's compiler said of a program that was built for a device."""
    return str(program.get_build_info(device, cl.program_build_info.LOG))


def _tried(program: Any, device: cl.Device, action: Callable[[], Any]) -> cl.Program:
    """Return a program after the action; what the driver says is in the error, or is logged."""
    try:
        action()
    except cl.Error as error:
        said = program.get_build_info(device, cl.program_build_info.LOG)
        record = _cl._ErrorRecord(msg=f"{error}\n\n{said}", code=error.code, routine=error.routine)
        raise type(error)(record) from None
    if said := program.get_build_info(device, cl.program_build_info.LOG).strip():
        log.debug("%s says of a program: %s", device.platform.name, said)
    return cl.Program(program)


def _joined(options: Sequence[str]) -> bytes:
    return " ".join(options).encode()
