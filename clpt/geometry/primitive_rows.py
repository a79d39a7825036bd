"""Which face of a mesh or strand of curves a primitive is of, as the caller counts them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from clpt.geometry import strands, triangles, tubes
from clpt.geometry.shapes import where
from clpt.scene.shapes import Curves, Mesh, Shape


def primitive_rows(shape: Shape, times: Sequence[float] = ()) -> NDArray[np.int64] | None:
    """Return the caller's row for each primitive of a shape, (n,); None: kernels know it.

    times: at which a shape that deforms has vertices [s]. It is the row in `faces` of a mesh, also
    where triangles without an area are left out, or where a face is subdivided; of curves the
    number of the strand. What a transform makes triangles of has one primitive, 0.
    """
    rows = _ROWS.get(shape.kind, _of_triangles)(shape, times)
    same = (
        shape.kind != "curves" and rows is not None and np.array_equal(rows, np.arange(len(rows)))
    )
    return None if same else rows


def _of_triangles(shape: Shape, times: Sequence[float]) -> NDArray[np.int64]:
    return np.flatnonzero(triangles.kept(shape, times))


def _of_mesh(shape: Mesh, times: Sequence[float]) -> NDArray[np.int64]:
    kept = triangles.kept(shape, times)
    return np.asarray(triangles.sources(shape, len(kept))[kept])


def _of_tubes(shape: Curves, times: Sequence[float]) -> NDArray[np.int64]:
    keyed = times if shape.deformation is not None else ()
    alike = [triangles.at_time(shape, time) for time in keyed]
    vertices, faces, _, _ = triangles.local(alike[0] if alike else shape, alike)
    strand = tubes.strands(alike[0] if alike else shape, where(shape), alike, len(vertices))
    return np.asarray(strand[faces[:, 0]][triangles.kept(shape, times)])


def _of_curves(shape: Curves, times: Sequence[float]) -> NDArray[np.int64]:
    return strands.strands(shape)


def _of_one(shape: Shape, times: Sequence[float]) -> NDArray[np.int64]:
    return np.zeros(int(triangles.kept(shape, times).sum()), np.int64)


def _as_they_lie(shape: Shape, times: Sequence[float]) -> None:
    """Each is one by itself."""


_ROWS: dict[str, Callable[..., NDArray[np.int64] | None]] = {
    "mesh": _of_mesh,
    "tubes": _of_tubes,
    "curves": _of_curves,
    "tessellated": _of_one,
    **dict.fromkeys(("sphere", "spheres", "disk", "cylinder"), _as_they_lie),
}
