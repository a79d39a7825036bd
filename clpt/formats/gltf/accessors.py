"""Accessors as arrays: all component types, strides, sparse values, normalised integers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.files import budget
from clpt.formats.gltf import meshopt
from clpt.formats.gltf.document import Document, Element

COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"), 5121: np.dtype("<u1"), 5122: np.dtype("<i2"), 5123: np.dtype("<u2"),
    5125: np.dtype("<u4"), 5126: np.dtype("<f4"),
}  # fmt: skip
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
INDEX_TYPES = (5121, 5123, 5125)
PER_NUMBER = 16  # bytes that a number takes while it is read


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

    Raises SceneError for a type other than `types`, missing data, and numbers that are
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
    shares: NDArray[np.float32] = values.astype(np.float32) / largest
    return np.maximum(shares, np.float32(-1.0))


def width(accessor: Element, types: tuple[str, ...]) -> int:
    """Return the numbers in an element of an accessor, whose type must be among `types`."""
    return WIDTHS[accessor.text("type", choices=types)]


def stored(accessor: Element, types: tuple[str, ...]) -> NDArray[Any]:
    """Return an accessor's values (n, width) as they are stored, with sparse substitutions."""
    width(accessor, types)
    form = _form(accessor)
    described = f"{accessor.path} of {form.count} elements"
    budget.check(PER_NUMBER * form.count * form.columns, described, accessor.document.file)
    sparse = accessor.child("sparse")
    if form.stride:
        data, _ = view(accessor)
        values = form.read(data)
    else:
        values = np.zeros((form.count, form.columns), form.dtype)
    return values if sparse is None else _with_sparse(accessor, sparse, values)


def check(accessor: Element) -> None:
    """Raise SceneError for an accessor that is invalid or exceeds its buffer view."""
    form = _form(accessor)
    sparse = accessor.child("sparse")
    if sparse is not None:
        count = sparse.integer("count", low=1, high=form.count)
        for key, size in (("indices", 1), ("values", form.size)):
            part = sparse.needed(key)
            length = _length(part.index("bufferView", "bufferViews"), part)
            if part.integer("byteOffset", 0) + count * size > length:
                raise part.error(f"{count} elements lie outside of {length} bytes")


def view(element: Element, key: str = "bufferView") -> tuple[Any, Element]:
    """Return the bytes of the buffer view under a key, and its element."""
    buffer_view = element.entry(key, "bufferViews")
    if buffer_view is None:
        raise element.error(f"{key!r} is missing")
    return element.document.once(
        ("view", buffer_view.path), lambda: _view(buffer_view)
    ), buffer_view


def _floats(accessor: Element, types: tuple[str, ...]) -> NDArray[np.float32]:
    values = normalised(stored(accessor, types), accessor)
    budget.take(values.nbytes, accessor.path, accessor.document.file)
    finite = np.isfinite(values)
    if not finite.all():
        bad = int(np.argmin(finite.reshape(-1))) // values.shape[1]
        raise accessor.error(f"element {bad} is not a finite number")
    values.setflags(write=False)
    return values


def _view(buffer_view: Element) -> memoryview:
    compressed = meshopt.extension(buffer_view)
    if compressed is not None:
        return memoryview(
            meshopt.decode(compressed, _slice(compressed), buffer_view.integer("byteLength"))
        )
    return _slice(buffer_view)


def _slice(buffer_view: Element) -> memoryview:
    """The bytes that byteOffset and byteLength cut out of a buffer."""
    document: Document = buffer_view.document
    buffer = document.buffer(buffer_view.index("buffer", "buffers"))
    offset, length = buffer_view.integer("byteOffset", 0), buffer_view.integer("byteLength", low=1)
    if offset + length > len(buffer):
        message = f"bytes {offset} to {offset + length} lie outside of the buffer's {len(buffer)}"
        raise buffer_view.error(message)
    return memoryview(buffer)[offset : offset + length]


def _length(view: int, owner: Element) -> int:
    """The declared length of a buffer view."""
    buffer_view = owner.document.entry("bufferViews", view)
    return buffer_view.integer("byteLength", low=1)


@dataclass(frozen=True)
class _Form:
    """Layout of an accessor's elements in its view; `gap` follows the columns of small matrices."""

    dtype: np.dtype[Any]
    count: int
    columns: int
    rows: int
    gap: int
    offset: int
    stride: int  # 0: it has no view

    @property
    def size(self) -> int:
        """Bytes of an element."""
        return (self.columns * self.dtype.itemsize // self.rows + self.gap) * self.rows

    def read(self, data: memoryview) -> NDArray[Any]:
        """Return the elements (count, columns) that lie in a view's bytes."""
        inner, size = self.columns // self.rows, self.dtype.itemsize
        strides = (self.stride, inner * size + self.gap, size)
        values: NDArray[Any] = np.ndarray(
            (self.count, self.rows, inner), self.dtype, data, self.offset, strides
        )
        return values.reshape(self.count, self.columns)


def _form(accessor: Element) -> _Form:
    type_ = accessor.text("type", choices=WIDTHS)
    number = accessor.integer("componentType")
    if number not in COMPONENTS:
        raise accessor.error(f"{number} is no component type", "componentType")
    dtype, columns = COMPONENTS[number], WIDTHS[type_]
    count, offset = accessor.integer("count", low=1), accessor.integer("byteOffset", 0)
    rows = int(type_[3:]) if type_.startswith("MAT") else 1
    gap = -(rows * dtype.itemsize) % 4 if rows > 1 else 0
    form = _Form(dtype, count, columns, rows, gap, offset, 0)
    buffer_view = accessor.entry("bufferView", "bufferViews")
    if buffer_view is None:
        return form
    compressed = meshopt.extension(buffer_view)
    stride = (compressed or buffer_view).integer("byteStride", form.size)
    if stride < form.size:
        raise buffer_view.error(f"{stride} bytes hold no element of {form.size}", "byteStride")
    length = buffer_view.integer("byteLength", low=1)
    if offset + (count - 1) * stride + form.size - gap > length:
        message = f"{count} elements of {stride} bytes from {offset} lie outside of {length}"
        raise accessor.error(message, "count")
    return replace(form, stride=stride)


def _with_sparse(accessor: Element, sparse: Element, values: NDArray[Any]) -> NDArray[Any]:
    count = sparse.integer("count", low=1, high=len(values))
    where, entries = sparse.needed("indices"), sparse.needed("values")
    number = where.integer("componentType")
    if number not in INDEX_TYPES:
        raise where.error("indices must be unsigned integers", "componentType")
    at = _part(where, COMPONENTS[number], count, 1)[:, 0].astype(np.int64)
    new = _part(entries, values.dtype, count, values.shape[1])
    if at.max() >= len(values):
        raise where.error(f"index {at.max()} lies outside of {len(values)} elements")
    filled = values.copy()
    filled[at] = new
    return filled


def _part(element: Element, dtype: np.dtype[Any], count: int, columns: int) -> NDArray[Any]:
    """The packed indices or values of a sparse accessor."""
    data, _ = view(element)
    offset, size = element.integer("byteOffset", 0), columns * dtype.itemsize
    if offset + count * size > len(data):
        raise element.error(f"{count} elements from {offset} lie outside of {len(data)} bytes")
    return _Form(dtype, count, columns, 1, 0, offset, size).read(data)
