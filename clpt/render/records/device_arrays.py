"""Arrays of a scene that lie on a device: `pyopencl.array.Array` and `pyopencl.Buffer`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array

from clpt.arrays import on_device
from clpt.errors import SceneError
from clpt.scene.params import fields_of

# Arrays of shapes by name: numbers in a row (0: the array is flat), and their type.
COLUMNS: dict[str, tuple[int, type]] = {
    "vertices": (3, np.float32),
    "normals": (3, np.float32),
    "uvs": (2, np.float32),
    "tangents": (4, np.float32),
    "faces": (3, np.uint32),
    "centers": (3, np.float32),
    "radii": (0, np.float32),
}


def is_table(values: object, kind: str) -> bool:
    """Return whether values are a device array that can be a table; kind: numpy kinds of words."""
    return (
        isinstance(values, cl_array.Array)
        and values.dtype.itemsize == 4
        and values.dtype.kind in kind
        and values.flags.c_contiguous
        and values.offset == 0
    )


def fresh_view(values: Any) -> Any:
    """Return another object for the same memory on a device, whose contents may have changed."""
    if isinstance(values, cl_array.Array):
        return values.view()
    return cl.Buffer.from_int_ptr(values.int_ptr)


def as_array(values: Any, name: str, queue: cl.CommandQueue, where: str) -> Any:
    """Return an array that `on_host` can read: of a buffer an array of COLUMNS, on the queue.

    Host arrays come back as they are. Raises SceneError for memory of another context, and for a
    buffer of no whole number of rows.
    """
    if not on_device(values):
        return values
    buffer = values.base_data if isinstance(values, cl_array.Array) else values
    if buffer is None or buffer.context != queue.context:
        raise SceneError(
            f"{name} lie in another OpenCL context than the renderer's; make both of one context, "
            "or give them as numpy arrays",
            where=where,
        )
    if isinstance(values, cl_array.Array):
        return values if values.queue is not None else values.with_queue(queue)
    if name not in COLUMNS:
        message = f"a buffer does not tell the width of {name!r}: give a pyopencl.array.Array"
        raise SceneError(message, where=where)
    columns, dtype = COLUMNS[name]
    row = 4 * max(columns, 1)
    if values.size == 0 or values.size % row:
        message = f"{name} must be rows of {row} bytes, found a buffer of {values.size}"
        raise SceneError(message, where=where)
    shape = (values.size // row, columns) if columns else (values.size // row,)
    return cl_array.Array(queue, shape, dtype, data=values)


def readable(shape: Any, queue: cl.CommandQueue, where: str) -> dict[str, Any]:
    """Return the fields of a shape that `as_array` replaces, by name."""
    fields = {name: value for name, value in fields_of(shape).items() if name in COLUMNS}
    arrays = {name: as_array(values, name, queue, where) for name, values in fields.items()}
    changed = {name: values for name, values in arrays.items() if values is not fields[name]}
    former = shape.attributes
    attributes = {name: as_array(values, name, queue, where) for name, values in former.items()}
    if any(attributes[name] is not former[name] for name in former):
        changed["attributes"] = attributes
    return changed
