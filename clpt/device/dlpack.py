"""DLPack capsules of OpenCL memory; no library offers them for a buffer.

The structures follow dlpack.h 0.8. For OpenCL the data pointer is the cl_mem handle.
"""

from __future__ import annotations

import ctypes as c
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

CPU, OPENCL = 1, 4  # DLDeviceType
_NAME = b"dltensor"  # until a consumer renames it
_CODES = {"i": 0, "u": 1, "f": 2}  # DLDataTypeCode
_Deleter = c.CFUNCTYPE(None, c.c_void_p)


class _Tensor(c.Structure):
    _fields_ = (
        ("data", c.c_void_p), ("device_type", c.c_int32), ("device_id", c.c_int32),
        ("ndim", c.c_int32), ("code", c.c_uint8), ("bits", c.c_uint8), ("lanes", c.c_uint16),
        ("shape", c.POINTER(c.c_int64)), ("strides", c.POINTER(c.c_int64)),
        ("byte_offset", c.c_uint64),
    )  # fmt: skip


class _Managed(c.Structure):
    _fields_ = (("tensor", _Tensor), ("manager", c.c_void_p), ("deleter", _Deleter))


_owned: dict[int, tuple[Any, ...]] = {}  # referenced objects by a structure's address

_new = c.pythonapi.PyCapsule_New
_new.restype, _new.argtypes = c.py_object, (c.c_void_p, c.c_char_p, c.c_void_p)
_valid = c.pythonapi.PyCapsule_IsValid
_valid.restype, _valid.argtypes = c.c_int, (c.py_object, c.c_char_p)


@_Deleter
def _delete(managed: int) -> None:
    _owned.pop(managed, None)


def _sweep() -> None:
    """Free capsules without a consumer: they have their first name, and no other reference.

    Python may run a capsule's destructor while a consumer's exception is raised, when a Python
    callback must not run. So clpt sets no destructor.
    """
    # The number of references that this call itself adds differs between Python versions.
    alone = _references({0: (object(),)}, 0)
    for address in list(_owned):
        with suppress(KeyError):  # a consumer's thread freed it meanwhile
            if _references(_owned, address) <= alone and _valid(_owned[address][-1], _NAME):
                _owned.pop(address, None)


def _references(owned: Mapping[int, tuple[Any, ...]], address: int) -> int:
    """Count the references to the last object of an entry, including this call's."""
    return sys.getrefcount(owned[address][-1])


def opencl_capsule(array: Any, device: int) -> Any:
    """Return a capsule that keeps a `pyopencl.array.Array` until the consumer frees it."""
    _sweep()
    dtype, ndim = np.dtype(array.dtype), array.ndim
    if dtype.kind not in _CODES:
        raise BufferError(f"clpt exports no arrays of {dtype} by DLPack")
    sizes = (c.c_int64 * ndim)(*array.shape)
    steps = (c.c_int64 * ndim)(*(stride // dtype.itemsize for stride in array.strides))
    managed = _Managed(
        _Tensor(
            array.base_data.int_ptr, OPENCL, device, ndim,
            _CODES[dtype.kind], 8 * dtype.itemsize, 1, sizes, steps, array.offset,
        ),
        None,
        _delete,
    )  # fmt: skip
    address = c.addressof(managed)
    capsule = _new(address, _NAME, None)
    _owned[address] = managed, sizes, steps, array.base_data, capsule
    return capsule
