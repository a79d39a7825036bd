"""Attributes of meshes per vertex or face: the table `attributes`.

It begins with a directory of zeros, for what has no attributes. A mesh has a directory of its own:
per (name, role, channel) that textures ask for, where its values would begin for vertex or face 0
of the scene, and how many words each takes. A colour takes four words, as a texel does, a number
one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from clpt import spectra
from clpt.geometry import shape_records, shapes, triangles
from clpt.geometry.triangles import per_face
from clpt.render.geometry.find import Owner
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.textures.encode import TextureTable
from clpt.render.textures.texels import texels
from clpt.scene.roles import REAL, Role
from clpt.scene.shapes import Shape
from clpt.scene.textures import attributes_in

COLOUR_WORDS = 4


def lower_attributes(
    owners: Iterable[Owner],
    textures: TextureTable,
    cache: LoweringCache,
    single_count: int = 0,
    keys: Mapping[int, int] | None = None,
) -> None:
    """Put what the textures of shapes ask of them into the tables, and its index into their rows.

    single_count: see clpt.records.SETTINGS; keys: rows of each vertex of a shape, by its first
    vertex, where that is not one.
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
                if shape.kind in shape_records.ONE_OF:
                    first = int(row["prim"]) - single_count
                given = (shape, name, role, channel, textures.spectra.spectral)
                value = shape.attributes[name]
                own = (*shapes.geometry(shape), value, *given[1:])
                made = cache(_words, *given, by=own)
                if keys and first_vertex in keys and not per_face(name):
                    made = np.repeat(made.reshape(-1, words), keys[first_vertex], axis=0).ravel()
                at = store.append("attributes", made)
                directory[number] = at - words * first, words
        row["attributes"] = store.append("attributes", directory.view(np.uint32))


def _words(shape: Shape, name: str, role: Role, channel: str, spectral: bool) -> np.ndarray:
    values: np.ndarray = triangles.attribute(shape, name)
    if role is REAL and values.shape[1] == 3:
        values = (
            values[:, "rgb".index(channel), None] if channel else spectra.luminance(values)[:, None]
        )
    return texels(values[:, None].astype(np.float32), role, spectral).view(np.uint32)
