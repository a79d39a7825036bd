"""Pictures for a screen from a film on the device: exposure, tone curve, sRGB transfer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike
from pyopencl.array import Array

from clpt import device
from clpt.device import DeviceArray
from clpt.errors import DeviceError
from clpt.images import srgb8_steps
from clpt.images.colour import TONES, View, check_tone
from clpt.spectra.spaces import between

TONE_NUMBERS = {name: number for number, name in enumerate(TONES)}  # kernels/film/tone.cl
NO_TABLE = np.zeros(4, np.float32)
BYTES, FLOATS = np.dtype(np.uint8), np.dtype(np.float32)
_ORDERS = (cl.channel_order.RGBA, cl.channel_order.BGRA)
_IMAGE_TYPES: dict[Any, np.dtype] = {
    cl.channel_type.UNORM_INT8: BYTES,
    cl.channel_type.HALF_FLOAT: FLOATS,
    cl.channel_type.FLOAT: FLOATS,
}


@dataclass(frozen=True)
class Screen:
    """Exposure and transfer for a screen, see `Renderer.resolve`; space: of the film.

    Raises DeviceError for a view beside a tone curve or a transfer, UnknownKindError for names.
    """

    exposure: float = 0.0
    tone: str = "none"
    srgb: bool | None = None
    view: View | None = None
    space: str = "rec709"

    def __post_init__(self) -> None:
        check_tone(self.tone)
        if self.view is not None and (self.tone != "none" or self.srgb is not None):
            raise DeviceError("a view has its own tone curve and transfer; leave out tone and srgb")

    def encodes(self, dtype: np.dtype) -> bool:
        """Return whether a picture of this type gets the sRGB transfer."""
        return self.view is None and (dtype == BYTES if self.srgb is None else self.srgb)


@dataclass(frozen=True)
class _Target:
    """The memory for a picture.

    memory: the Array or Image for the caller; data: its OpenCL memory; offset: of the picture's
    first element [elements].
    """

    memory: Any
    dtype: np.dtype
    data: cl.MemoryObject
    offset: int = 0

    @property
    def is_image(self) -> bool:
        return self.data.type == cl.mem_object_type.IMAGE2D

    @property
    def kernel(self) -> str:
        name = "byte" if self.dtype == BYTES else "float"
        return f"resolve_{name}_image" if self.is_image else f"resolve_{name}s"


class Resolve:
    """Resolves films on a device into pictures; stream: takes the commands.

    Raises KernelBuildError.
    """

    def __init__(self, on: device.Device, stream: device.Stream):
        self.device, self.stream = on, stream
        self.program = device.build(on, device.assemble("stage/resolve.cl"))
        self.steps = device.Buffers(on).upload("the sRGB transfer", srgb8_steps())
        self._bound: dict[str, device.BoundKernel] = {}
        self._view: View | None = None  # which `_table` belongs to
        self._no_table = device.Buffers(on).upload("no table", NO_TABLE)
        self._table: dict[str, Any] = {}

    def __call__(
        self,
        film: Array,
        into: Array | cl.MemoryObject | None = None,
        screen: Screen = Screen(),
        *,
        dtype: DTypeLike | None = None,
        flip: bool = False,
        wait_for: device.Events = None,
    ) -> Array | cl.Event:
        """Enqueue the conversion of a film (h, w, 4) float32; see `Renderer.resolve`."""
        target = self._target(film, into, dtype)
        named = {
            **_to_rec709(screen.space),
            "film": film.base_data,
            "steps": self.steps,
            "scale": 2.0**screen.exposure,
            **self._table_arguments(screen.view),
            "tone": TONE_NUMBERS[screen.tone],
            "encoded": int(screen.encodes(target.dtype)),
            "flip": int(flip),
            "width": film.shape[1],
            "height": film.shape[0],
            "into": target.data,
        }
        if not target.is_image:
            named["at"] = target.offset
        bound = self._bind(target.kernel, named)
        self.stream.after(wait_for)
        if isinstance(target.memory, Array):
            self.stream.after(target.memory.events)
        event = self.stream.run(bound, *device.tiles(film.shape[1], film.shape[0]))
        if not isinstance(target.memory, Array):
            return event
        device.supersede(target.memory, event)
        return target.memory

    def _table_arguments(self, view: View | None) -> dict[str, Any]:
        """Return the arguments for a view's table; upload it at its first use."""
        if view is None:
            return {"table": self._no_table, "size": 0, "bounds": (0.0, 1.0, 1.0, 0.0)}
        if view is not self._view:
            table = view.table()
            values = device.Buffers(self.device).upload("a view's table", table.values)
            self._table = {"table": values, "size": len(table.values), "bounds": table.bounds}
            self._view = view
        return self._table

    def _bind(self, kernel: str, named: dict[str, Any]) -> device.BoundKernel:
        """Return a bound kernel; later calls only set its arguments, which is faster."""
        if kernel in self._bound:
            self._bound[kernel].set_args(**named)
        else:
            self._bound[kernel] = self.program.kernel(kernel).bind(**named)
        return self._bound[kernel]

    def _target(self, film: Array, into: object, dtype: DTypeLike | None) -> _Target:
        """Return the memory for a picture. Raises DeviceError, which says what is needed."""
        wanted = None if dtype is None else np.dtype(dtype)
        if wanted is not None and wanted not in (BYTES, FLOATS):
            raise DeviceError(f"a picture is of uint8 or float32, not {wanted}")
        context = self.device.context
        if into is None:
            array = DeviceArray(context, film.shape, wanted or BYTES)
            into = array.with_queue(self.stream.queue)
        if isinstance(into, Array):
            target = _Target(into, into.dtype, into.base_data, into.offset // into.dtype.itemsize)
            _check_array(into, film.shape)
        elif isinstance(into, cl.MemoryObject) and into.type == cl.mem_object_type.BUFFER:
            target = _buffer_target(self.stream.queue, into, film.shape, wanted or BYTES)
        elif isinstance(into, cl.MemoryObject) and into.type == cl.mem_object_type.IMAGE2D:
            target = _Target(into, _image_dtype(into, film.shape), into)
            if target.kernel not in self.program.signatures:
                raise DeviceError(f"{self.device.info.label} has no images; give a buffer")
        else:
            kinds = "an Array, a Buffer or a 2D Image of PyOpenCL"
            raise DeviceError(f"a picture goes into {kinds}, not {type(into).__name__}")
        if target.data.context != context:
            raise DeviceError(
                "the target of the picture is in another OpenCL context than the renderer; create "
                "it in the context of the renderer's queue, or give the renderer your queue"
            )
        if wanted is not None and wanted != target.dtype:
            raise DeviceError(f"a picture of {wanted} does not go into one of {target.dtype}")
        return target


@cache
def _to_rec709(space: str) -> dict[str, Any]:
    """Return the arguments of kernels that convert colours of a space to Rec. 709."""
    rows = zip(("red", "green", "blue"), between(space, "rec709"), strict=True)
    return {"converted": int(space != "rec709")} | {name: (*row, 0.0) for name, row in rows}


def _check_array(into: Array, shape: tuple[int, ...]) -> None:
    if into.shape != shape or into.dtype not in (BYTES, FLOATS) or not into.flags.c_contiguous:
        order = "" if into.flags.c_contiguous else ", not contiguous"
        raise DeviceError(
            f"the picture needs an array of shape {shape}, uint8 or float32, rows in a row; "
            f"this one has {into.shape} {into.dtype}{order}"
        )


def _buffer_target(
    queue: cl.CommandQueue, into: cl.MemoryObject, shape: tuple[int, ...], dtype: np.dtype
) -> _Target:
    needed = int(np.prod(shape)) * dtype.itemsize
    if into.size < needed:
        raise DeviceError(
            f"a picture of {shape} {dtype} needs {needed} bytes, the buffer has {into.size}"
        )
    return _Target(DeviceArray(queue, shape, dtype, data=into), dtype, into)


def _image_dtype(into: Any, shape: tuple[int, ...]) -> np.dtype:
    """Return the type that kernels write to an image. Raises DeviceError if it does not fit."""
    size, form = (into.height, into.width), into.format
    dtype = _IMAGE_TYPES.get(form.channel_data_type)
    if size != shape[:2] or dtype is None or form.channel_order not in _ORDERS:
        raise DeviceError(
            f"the picture needs an image {shape[1]} wide and {shape[0]} high, RGBA or BGRA, of "
            f"UNORM_INT8, HALF_FLOAT or FLOAT; this one is {size[1]} by {size[0]}, {form}"
        )
    return dtype
