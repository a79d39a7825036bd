"""Arrays that numpy and other libraries take: copies, DLPack, and what they keep alive."""

from __future__ import annotations

import ctypes
import gc
import sys

import numpy as np
import pyopencl as cl
import pytest

from clpt import device
from clpt.device import DeviceArray
from clpt.device import array as arrays

VALUES = np.arange(24, dtype=np.float32).reshape(2, 3, 4)


@pytest.fixture(scope="module")
def opened():
    return device.choose()


@pytest.fixture
def array(opened):
    made = DeviceArray(opened.queue, VALUES.shape, np.float32)
    made.set(VALUES)
    return made


def taken(capsule):
    """The structure in a capsule, which is renamed as its consumer has to."""
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
    address = pointer(capsule, b"dltensor")
    rename = ctypes.pythonapi.PyCapsule_SetName
    rename.argtypes = (ctypes.py_object, ctypes.c_char_p)
    rename(capsule, b"used_dltensor")
    return arrays._Managed.from_address(address)


def test_numpy_gets_a_copy(array):
    host = np.asarray(array)
    np.testing.assert_array_equal(host, VALUES)
    assert np.asarray(array, np.float64).dtype == np.float64
    host[:] = 0.0
    np.testing.assert_array_equal(array.get(), VALUES)
    with pytest.raises(ValueError, match="by a copy"):
        array.__array__(copy=False)


def test_arithmetic_stays_on_the_device(array):
    for made in (array * 2, 2 * array, np.float32(2) * array):
        assert isinstance(made, DeviceArray)
        np.testing.assert_array_equal(made.get(), 2 * VALUES)


def test_dlpack_of_a_cpu_is_numpys(array, opened):
    if not opened.info.is_cpu:
        pytest.skip("the device is no CPU")
    assert array.__dlpack_device__() == (1, 0)
    snapshot = np.from_dlpack(array)
    np.testing.assert_array_equal(snapshot, VALUES)
    np.testing.assert_array_equal(np.from_dlpack(array, device="cpu"), VALUES)
    mapped = np.from_dlpack(array, copy=False)
    mapped[0, 0, 0] = 7.0
    del mapped
    gc.collect()  # what was mapped is given back
    assert array.get()[0, 0, 0] == 7.0
    assert snapshot[0, 0, 0] == 0.0


def test_dlpack_of_another_device_is_opencls(array, monkeypatch):
    """As a GPU has it: its memory for who knows OpenCL, a copy for who asks for the CPU."""
    monkeypatch.setattr(DeviceArray, "_in_host_memory", False)
    assert array.__dlpack_device__()[0] == arrays.OPENCL
    assert taken(array.__dlpack__()).tensor.device_type == arrays.OPENCL
    with pytest.raises((BufferError, RuntimeError)):
        np.from_dlpack(array)
    np.testing.assert_array_equal(np.from_dlpack(array, device="cpu"), VALUES)
    with pytest.raises(BufferError, match="only by a copy"):
        array.__dlpack__(dl_device=(arrays.CPU, 0), copy=False)


def test_dlpack_of_opencl_memory(array, opened):
    """The capsule tells the cl_mem, and keeps it alive until its consumer calls the deleter."""
    on = (arrays.OPENCL, opened.context.devices.index(opened.queue.device))
    capsule = array.__dlpack__(dl_device=on)
    managed = taken(capsule)
    tensor, address = managed.tensor, ctypes.addressof(managed)
    assert (tensor.device_type, tensor.device_id) == on
    assert (tensor.code, tensor.bits, tensor.lanes, tensor.byte_offset) == (2, 32, 1, 0)
    assert tensor.shape[: tensor.ndim] == [2, 3, 4]
    assert tensor.strides[: tensor.ndim] == [12, 4, 1]
    del array, capsule
    gc.collect()
    assert address in arrays._owned
    buffer = cl.Buffer.from_int_ptr(tensor.data, True)
    host = np.empty_like(VALUES)
    cl.enqueue_copy(opened.queue, host, buffer)
    np.testing.assert_array_equal(host, VALUES)
    managed.deleter(address)
    assert address not in arrays._owned


def test_capsules_that_nobody_takes_keep_nothing(array):
    """One may wait for the next that is made, however many there were."""
    before = len(arrays._owned)
    for _ in range(5):
        array.__dlpack__(dl_device=array._opencl_device, copy=True)
    assert len(arrays._owned) <= before + 1
    held = [array.__dlpack__(dl_device=array._opencl_device) for _ in range(5)]
    assert len(arrays._owned) >= len(held)


def test_dlpack_refuses_other_devices(array):
    with pytest.raises(BufferError, match=r"DLPack's device.*\(2, 0\)"):
        array.__dlpack__(dl_device=(2, 0))


@pytest.mark.parametrize("fewer", [0, 1, 2])
def test_a_capsule_that_is_held_stays_however_python_counts(array, monkeypatch, fewer):
    """Some versions of Python borrow references where others count one more."""
    real = sys.getrefcount
    monkeypatch.setattr(arrays.sys, "getrefcount", lambda one: real(one) - 1 - fewer)
    monkeypatch.setattr(arrays, "_owned", {})
    on = (arrays.OPENCL, 0)
    held = array.__dlpack__(dl_device=on)
    array.__dlpack__(dl_device=on)  # nobody takes it
    assert len(arrays._owned) == 2
    arrays._sweep()
    assert [entry[-1] for entry in arrays._owned.values()] == [held]
    del held
    arrays._sweep()
    assert not arrays._owned
