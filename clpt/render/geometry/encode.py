"""Shapes on their way to the device: rows of `shapes`, and what lies in other tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.geometry import analytic, shape_records, strands
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.geometry.find import Geometry, Stored
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.records.tables import TableStore
from clpt.scene.shapes import Shape


def lower_geometry(
    geometry: Geometry, encoder: Encoder, materials: MaterialWords, *, spheres_move: bool
) -> Geometry:
    """Put shapes into the tables; return them with rows that know materials and parameters.

    spheres_move: whether many spheres in one shape move by themselves.
    """
    store, rows = encoder.store, []
    curves: list[tuple[np.ndarray, Shape, Floats32]] = []
    for (given, shape, _, _), stored in zip(geometry.owners, geometry.stored, strict=True):
        row = given.copy()
        front, back, two_sided = materials.sides(shape)
        row["front"], row["back"] = np.array([front, back], np.uint32).view(np.int32)
        row["flags"] |= SHAPE_BITS["two_sided"] if two_sided else 0
        if shape.kind not in shape_records.ANALYTIC:
            _store_corners(stored, store)
        elif shape.kind == "curves" and stored.many is not None:
            curves.append((row, shape, stored.many))
        else:
            row["params"] = store.append("geometry", analytic.row(shape))
            if stored.many is not None:
                _store_balls(row, stored.many, store, move=spheres_move)
        rows.append(row)
    _store_pieces(curves, store)
    store.append("instances", geometry.instances.rows.view(np.uint32))
    owners = [(row, *owner[1:]) for row, owner in zip(rows, geometry.owners, strict=True)]
    return replace(geometry, rows=tuple(rows), owners=tuple(owners))


def _store_corners(stored: Stored, store: TableStore) -> None:
    """Append the normals and uvs of a shape's vertices, zeros where it has none."""
    zeros = np.zeros((stored.vertices, 3), np.float32)
    store.append_floats("normals", zeros if stored.normals is None else stored.normals)
    store.append_floats("uvs", zeros[:, :2] if stored.uvs is None else stored.uvs)


def _store_balls(
    row: np.ndarray, balls: NDArray[np.float32], store: TableStore, *, move: bool
) -> None:
    """Append many spheres (n, 4), or (n, k, 4) with one for each of k keys.

    move: whether a word behind the row of `geometry` says where they are.
    """
    at = store.append_floats("spheres", balls)
    if move:
        first = at - balls[0].size * int(row["prim"])  # where primitive 0 would be
        store.append("geometry", np.array([first], np.int32).view(np.uint32))


def _store_pieces(curves: Sequence[tuple[np.ndarray, Shape, Floats32]], store: TableStore) -> None:
    """Append the pieces of all curves to `spheres`, and where they are to `geometry`."""
    member = analytic.member("curve", "first")
    for row, shape, found in curves:
        words, at = analytic.row(shape), store.append_floats("spheres", found)
        words[member] = np.int32(at - strands.WORDS * int(row["prim"])).view(np.uint32)
        row["params"] = store.append("geometry", words)


def shape_words(rows: Sequence[np.ndarray]) -> NDArray[np.uint32]:
    """Return rows of `shapes` as words."""
    return np.concatenate([np.zeros(0, SHAPE.dtype), *map(np.atleast_1d, rows)]).view(np.uint32)
