"""Primvars of every interpolation, as values and the row that each corner of a face takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from clpt.arrays import Integers
from clpt.formats.usd.document import Document, rows

AT_VERTICES = ("vertex", "varying")


@dataclass(frozen=True)
class Topology:
    """Faces: how many corners each has (f,), and the vertex of each corner (c,); n vertices."""

    counts: Integers
    corners: Integers
    vertices: int

    @property
    def faces(self) -> Integers:
        """The face of each corner, (c,)."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def elements(self, interpolation: str) -> Integers:
        """Return the element that each corner takes a value of, (c,), before a primvar's indices.

        interpolation: one of USD's; elements are vertices, faces, corners, or the whole mesh.
        """
        if interpolation in AT_VERTICES:
            return self.corners
        if interpolation == "uniform":
            return self.faces
        if interpolation == "faceVarying":
            return np.arange(len(self.corners))
        return np.zeros(len(self.corners), np.int64)

    def count(self, interpolation: str) -> int:
        """Return how many elements there are."""
        sizes = {"uniform": len(self.counts), "faceVarying": len(self.corners), "constant": 1}
        return sizes.get(interpolation, self.vertices)


@dataclass(frozen=True)
class Primvar:
    """Values (v, width) and the row of them that each element has, (e,)."""

    values: NDArray[np.float32]
    indices: Integers
    interpolation: str

    def at_corners(self, topology: Topology) -> Integers:
        """Return the row of the values for each corner, (c,)."""
        return self.indices[topology.elements(self.interpolation)]


def read(
    document: Document, prim: Usd.Prim, name: str, topology: Topology, width: int = 0
) -> Primvar | None:
    """Return a primvar, inherited from above if need be; None where there is none of use.

    width: of a value, 0 for that of the file. A primvar with too few values is left out.
    """
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    value = primvar.Get(document.time) if primvar else None
    if value is None or isinstance(value, str):
        return None
    indices = primvar.GetIndices(document.time) if primvar.IsIndexed() else None
    form = primvar.GetInterpolation(), width
    return checked(document, prim, name, topology, form, (value, indices))


def checked(
    document: Document,
    prim: Usd.Prim,
    name: str,
    topology: Topology,
    form: tuple[str, int],
    stored: tuple[object, object],
) -> Primvar | None:
    """Return values as a primvar; None, with a warning, where they do not fit the faces.

    form: its interpolation, and the width of a value, 0 for that of the file. stored: the values,
    and the row of each element or None.
    """
    interpolation, width = form
    value, indices = stored
    try:
        table = np.asarray(value, np.float32)
        table = table.reshape(-1, width or (table.shape[1] if table.ndim > 1 else 1))
    except (TypeError, ValueError):
        document.warn(f"primvar {name!r} is of a type that is not read", prim.GetPath())
        return None
    count = topology.count(interpolation)
    order = np.arange(count) if indices is None else rows(indices, 0, np.int64)[:count]
    fits = len(order) == count and (not count or (order.min() >= 0 and order.max() < len(table)))
    if not fits:
        message = f"primvar {name!r} is left out, as it has too few values to be {interpolation}"
        document.warn(message, prim.GetPath())
        return None
    return Primvar(table, order, interpolation)


def joined(columns: list[Integers]) -> tuple[Integers, Integers]:
    """Return corners (k,) that differ in some column, and of each corner the number of its like.

    columns: of each corner, numbers from 0.
    """
    key = columns[0]
    for column in columns[1:]:
        key = np.unique(key * (int(column.max(initial=0)) + 1) + column, return_inverse=True)[1]
    _, first, like = np.unique(key, return_index=True, return_inverse=True)
    return first, like.reshape(-1)
