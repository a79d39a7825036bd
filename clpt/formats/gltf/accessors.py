"""Accessors as arrays: every component type, strides, sparse values, normalised integers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.formats.gltf import meshopt
from clpt.formats.gltf.document import Document, Element

COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"), 5121: np.dtype("<u1"), 5122: np.dtype("<i2"), 5123: np.dtype("<u2"),
    5125: np.dtype("<u4"), 5126: np.dtype("<f4"),
}  # fmt: skip
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
INDEX_TYPES = (5121, 5123, 5125)
LARGEST = 1 << 31  # bytes of an array that has no data of its own and is all zero


def integers(element: Element, key: str) -> NDArray[np.uint32]:
    """Return the indices (n,) of the accessor under a key."""
    accessor = element.entry(key, "accessors")
    if accessor is None:
        raise element.error(f"{key!r} is missing")
    if accessor.integer("componentType") not in INDEX_TYPES:
        raise accessor.error("indices must be unsigned integers", "componentType")
    return stored(accessor, ("SCALAR",))[:, 0].astype(np.uint32)


def floats(accessor: Element, types: tuple[str, ...]) -> NDArray[np.float32]:
    """Return an accessor's values (n, width) float32; normalised integers in [0, 1] or [-1, 1].

    Raises SceneError for a type other than `types`, data that are not there, and numbers that are
    not finite.
    """
    key = ("floats", accessor.path)
    return accessor.document.once(key, lambda: _floats(accessor, types))


def normalised(values: NDArray[Any], accessor: Element) -> NDArray[np.float32]:
    """Return stored numbers as float32, divided by their type's largest where the file says so."""
    if values.dtype.kind == "f":
        return np.ascontiguousarray(values, np.float32)
    if not accessor.flag("normalized"):
        return values.astype(np.float32)
    largest = np.float32(np.iinfo(values.dtype).max)
    made: NDArray[np.float32] = values.astype(np.float32) / largest
    return np.maximum(made, np.float32(-1.0))


def width(accessor: Element, types: tuple[str, ...]) -> int:
    """Return the numbers in an element of an accessor, whose type must be among `types`."""
    return WIDTHS[accessor.text("type", choices=types)]


def stored(accessor: Element, types: tuple[str, ...]) -> NDArray[Any]:
    """Return an accessor's values (n, width) as they are stored, sparse ones put in."""
    columns = width(accessor, types)
    number = accessor.integer("componentType")
    if number not in COMPONENTS:
        raise accessor.error(f"{number} is no component type", "componentType")
    dtype = COMPONENTS[number]
    count = accessor.integer("count", low=1)
    sparse = accessor.child("sparse")
    if "bufferView" in accessor:
        values = _viewed(accessor, dtype, count, columns)
    elif count * columns * dtype.itemsize > LARGEST:
        raise accessor.error(f"{count} elements without data are too many", "count")
    else:
        values = np.zeros((count, columns), dtype)  # type: ignore[call-overload]
    return values if sparse is None else _with_sparse(accessor, sparse, values)


def view(element: Element, key: str = "bufferView") -> tuple[Any, Element]:
    """Return the bytes of the buffer view that is named under a key, and its element."""
    place = element.entry(key, "bufferViews")
    if place is None:
        raise element.error(f"{key!r} is missing")
    return element.document.once(("view", place.path), lambda: _view(place)), place


def _floats(accessor: Element, types: tuple[str, ...]) -> NDArray[np.float32]:
    values = normalised(stored(accessor, types), accessor)
    finite = np.isfinite(values)
    if not finite.all():
        bad = int(np.argmin(finite.reshape(-1))) // values.shape[1]
        raise accessor.error(f"element {bad} is not a finite number")
    values.setflags(write=False)
    return values


def _view(place: Element) -> memoryview:
    compressed = meshopt.extension(place)
    if compressed is not None:
        return memoryview(meshopt.decode(compressed, _slice(compressed)))
    return _slice(place)


def _slice(place: Element) -> memoryview:
    """The bytes that byteOffset and byteLength cut out of a buffer."""
    document: Document = place.document
    buffer = document.buffer(place.index("buffer", "buffers"))
    offset, length = place.integer("byteOffset", 0), place.integer("byteLength", low=1)
    if offset + length > len(buffer):
        message = f"bytes {offset} to {offset + length} lie outside of the buffer's {len(buffer)}"
        raise place.error(message)
    return memoryview(buffer)[offset : offset + length]


def _viewed(accessor: Element, dtype: np.dtype[Any], count: int, columns: int) -> NDArray[Any]:
    data, place = view(accessor)
    offset = accessor.integer("byteOffset", 0)
    rows, gap = _layout(accessor.text("type"), dtype)
    size = dtype.itemsize * columns if not gap else rows * (rows * dtype.itemsize + gap)
    compressed = meshopt.extension(place)
    stride = (compressed or place).integer("byteStride", size)
    if stride < size:
        raise place.error(f"{stride} bytes hold no element of {size}", "byteStride")
    last = size - gap  # what the last element needs
    if offset + (count - 1) * stride + last > len(data):
        message = f"{count} elements of {stride} bytes from {offset} lie outside of {len(data)}"
        raise accessor.error(message, "count")
    if gap:
        strides = (stride, rows * dtype.itemsize + gap, dtype.itemsize)
        shape = (count, rows, rows)
        return _strided(data, dtype, offset, shape, strides).reshape(count, columns)
    return _strided(data, dtype, offset, (count, columns), (stride, dtype.itemsize))


def _strided(
    data: memoryview,
    dtype: np.dtype[Any],
    offset: int,
    shape: tuple[int, ...],
    strides: tuple[int, ...],
) -> NDArray[Any]:
    return np.ndarray(shape, dtype, data, offset, strides)


def _layout(type_: str, dtype: np.dtype[Any]) -> tuple[int, int]:
    """Rows of a matrix, and the bytes by which its columns are padded to multiples of four."""
    if not type_.startswith("MAT"):
        return 1, 0
    rows = int(type_[3:])
    return rows, -(rows * dtype.itemsize) % 4


def _with_sparse(accessor: Element, sparse: Element, values: NDArray[Any]) -> NDArray[Any]:
    count = sparse.integer("count", low=1, high=len(values))
    where, what = sparse.needed("indices"), sparse.needed("values")
    number = where.integer("componentType")
    if number not in INDEX_TYPES:
        raise where.error("indices must be unsigned integers", "componentType")
    at = _part(where, COMPONENTS[number], count, 1)[:, 0].astype(np.int64)
    new = _part(what, values.dtype, count, values.shape[1])
    if at.max() >= len(values):
        raise where.error(f"index {at.max()} lies outside of {len(values)} elements")
    made = values.copy()
    made[at] = new
    return made


def _part(element: Element, dtype: np.dtype[Any], count: int, columns: int) -> NDArray[Any]:
    """The packed indices or values of a sparse accessor."""
    data, _ = view(element)
    offset = element.integer("byteOffset", 0)
    if offset + count * columns * dtype.itemsize > len(data):
        raise element.error(f"{count} elements from {offset} lie outside of {len(data)} bytes")
    size = dtype.itemsize
    return _strided(data, dtype, offset, (count, columns), (columns * size, size))
