"""Shapes on their way to the device: rows of `shapes`, and their parts of other tables.

The table `attributes` begins with a directory of zeros, which shapes without attributes use. A mesh
has its own directory: for each (name, role, channel) that textures read, the word where its values
would begin for vertex or face 0 of the scene, and the number of words of a value. A colour takes
four words, as a texel does, a number a single word.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Floats32
from clpt.files import budget
from clpt.geometry import analytic, shapes, strands, triangles
from clpt.geometry.triangles import per_face
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.geometry.find import Geometry, Owner, Stored, spheres_move
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.records import GeometryFeatures, MotionFeatures
from clpt.render.records.tables import LoweringCache, TableStore
from clpt.render.records.textures import TextureFeatures
from clpt.render.scene_index import SceneIndex
from clpt.render.textures.encode import TextureTable
from clpt.render.textures.texels import texels
from clpt.scene.roles import REAL, Role
from clpt.scene.shapes import Shape
from clpt.scene.textures import attributes_in

COLOUR_WORDS = 4
TANGENT_WORDS = 4
FEW_INSTANCES = 2  # with deforming instances rays visit at most so many without a tree


def encode_geometry(
    geometry: Geometry, encoder: Encoder, materials: MaterialWords, *, spheres_move: bool
) -> Geometry:
    """Put shapes into the tables; return them with rows that know materials and parameters.

    spheres_move: whether the spheres of a `spheres` shape move separately.
    """
    store, rows = encoder.store, []
    curves: list[tuple[NDArray[Any], Shape, Floats32]] = []
    for (unfinished, shape, _, _), stored in zip(
        budget.steps(geometry.owners), geometry.stored, strict=True
    ):
        row = unfinished.copy()
        front, back, two_sided = materials.sides(shape)
        row["front"], row["back"] = np.array([front, back], np.uint32).view(np.int32)
        row["flags"] |= SHAPE_BITS["two_sided"] if two_sided else 0
        if shape.kind not in shapes.ANALYTIC:
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
    """Append the normals and uvs of a shape's vertices; zeros if it has none."""
    zeros = np.zeros((stored.vertices, 3), np.float32)
    store.append_floats("normals", zeros if stored.normals is None else stored.normals)
    store.append_floats("uvs", zeros[:, :2] if stored.uvs is None else stored.uvs)


def _store_balls(
    row: NDArray[Any], balls: NDArray[np.float32], store: TableStore, *, move: bool
) -> None:
    """Append spheres (n, 4), or (n, k, 4) for k keys.

    move: whether the word behind the row of `geometry` holds their first word.
    """
    first = store.append_floats("spheres", balls)
    if move:
        first -= balls[0].size * int(row["prim"])  # the first word that primitive 0 would have
        store.append("geometry", np.array([first], np.int32).view(np.uint32))


def _store_pieces(
    curves: Sequence[tuple[NDArray[Any], Shape, Floats32]], store: TableStore
) -> None:
    """Append the pieces of all curves to `spheres`, and their first words to `geometry`."""
    member = analytic.member("curve", "first")
    for row, shape, pieces in curves:
        words, first = analytic.row(shape), store.append_floats("spheres", pieces)
        words[member] = np.int32(first - strands.WORDS * int(row["prim"])).view(np.uint32)
        row["params"] = store.append("geometry", words)


def shape_words(rows: Sequence[NDArray[Any]]) -> NDArray[np.uint32]:
    """Return rows of `shapes` as words."""
    table = np.zeros(len(rows), SHAPE.dtype)
    for i, row in enumerate(budget.steps(rows)):
        table[i] = row
    return table.view(np.uint32)


def encode_attributes(
    owners: Iterable[Owner],
    textures: TextureTable,
    cache: LoweringCache,
    single_count: int = 0,
    keys: Mapping[int, int] | None = None,
) -> None:
    """Put the attributes that textures read into the tables, and their directories into the rows.

    single_count: see clpt.records.SETTINGS; keys: number of rows of each vertex of a shape, by the
    shape's first vertex; 1 where it is absent.
    """
    if not textures.attributes:
        return
    store, count = textures.store, len(textures.attributes)
    if store.append("attributes", np.zeros(2 * count, np.uint32)) != 0:
        raise ValueError("`attributes` must be empty before those of the meshes are put in")
    for row, shape, first_vertex, first_face in owners:
        names = attributes_in(shape.material) | attributes_in(shape.emission)
        if not names:
            continue
        directory = np.zeros((count, 2), np.int32)
        for (name, role, channel), number in textures.attributes.items():
            if name in names:
                words = 1 if role is REAL else COLOUR_WORDS
                first = first_face if per_face(name) else first_vertex
                if shape.kind in shapes.ONE_OF:
                    first = int(row["prim"]) - single_count
                how = (name, role, channel, textures.spectra.spectral)
                by = (*shapes.geometry(shape), shape.attributes[name], *how)
                values = cache(_attribute_words, shape, *how, by=by)
                if keys and first_vertex in keys and not per_face(name):
                    repeats = keys[first_vertex]
                    values = np.repeat(values.reshape(-1, words), repeats, axis=0).ravel()
                directory[number] = store.append("attributes", values) - words * first, words
        row["attributes"] = store.append("attributes", directory.view(np.uint32))


def _attribute_words(
    shape: Shape, name: str, role: Role, channel: str, spectral: bool
) -> NDArray[np.uint32]:
    values: NDArray[Any] = triangles.attribute(shape, name)
    if role is REAL and values.shape[1] == 3:
        values = (
            values[:, "rgb".index(channel), None] if channel else spectra.luminance(values)[:, None]
        )
    return texels(values[:, None].astype(np.float32), role, spectral).view(np.uint32)


def motion_features(index: SceneIndex, geometry: Geometry, row: int) -> MotionFeatures:
    """Return the features of motion while the shutter is open.

    row: the first number of the table of motions in `distributions`.
    """
    motions = index.motions
    analytic = {p.number for p in index.placed if p.shape.kind in shapes.ANALYTIC}
    placed = {int(number) for prototype in index.prototypes for number in prototype.numbers}
    lit = {int(geometry.rows[emitter.shape_row]["number"]) for emitter in geometry.emitters}
    numbers = motions.shapes.keys()
    features = MotionFeatures(
        camera=motions.camera is not None,
        instances=bool(placed & numbers),
        shapes=bool(analytic & numbers),
        lights=bool(motions.lamps) or bool(lit & numbers),
        vertices=geometry.keyed,
        spheres=spheres_move(index),
        emitters=any(emitter.keys > 1 for emitter in geometry.emitters),
        scales=motions.scales,
    )
    rolling = motions.shutter.readout > 0.0
    return replace(features, row=row, rolling=rolling) if features.present else features


def geometry_features(
    index: SceneIndex,
    geometry: Geometry,
    materials: MaterialWords,
    textures: TextureFeatures,
    store: TableStore,
) -> GeometryFeatures:
    """Return the features of a scene's shapes; append their own tangents if materials use them."""
    tangents = materials.tangents or index.normal_mapped or textures.mips
    instances = bool(index.prototypes)
    count = len(geometry.instances.rows)
    return GeometryFeatures(
        analytic=tuple(kind for kind in shapes.ANALYTIC if kind in geometry.analytic),
        instances=instances,
        only_instances=instances and not geometry.world_vertices,
        few_instances=count if geometry.keyed and count <= FEW_INSTANCES else 0,
        normals=geometry.normals,
        uvs=materials.uvs or geometry.uvs or tangents or "uv" in index.layers,
        tangents=tangents,
        vertex_tangents=_store_tangents(geometry, store) if tangents and geometry.tangents else 0,
    )


def _store_tangents(geometry: Geometry, store: TableStore) -> int:
    """Append four words for each vertex; return the index of the first in `distributions`.

    The words are tangents of meshes, else zeros. A row of zeros comes first, so that the index is
    never 0.
    """
    words = np.zeros((1 + len(geometry.vertices), TANGENT_WORDS), np.float32)
    for first, tangents in geometry.tangents:
        words[1 + first : 1 + first + len(tangents)] = tangents
    return store.append_floats("distributions", words) + TANGENT_WORDS
