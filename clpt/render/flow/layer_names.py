"""Names that layers give to shapes, materials and groups of lights."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.geometry import instancing
from clpt.geometry.instancing import primitive_rows
from clpt.geometry.shapes import geometry as geometry_of
from clpt.records import SHAPE_BITS
from clpt.render.geometry.find import Geometry
from clpt.render.lights.encode import LightRows
from clpt.render.lights.find import row_order
from clpt.render.records import LayerFeatures
from clpt.render.records.film import LayerNames
from clpt.render.records.tables import LoweringCache, TableStore
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt
from clpt.scene.layers import MOST_NAMED
from clpt.scene.shapes import Instance, Shape

REST = "rest"  # the group of lights without a group


def lower_names(
    index: SceneIndex,
    geometry: Geometry,
    lights: LightRows,
    store: TableStore,
    cache: LoweringCache,
) -> tuple[LayerNames, LayerFeatures]:
    """Return the names that the layers of a film need, and the layers' features.

    The numbers of materials and groups go to `distributions`, for each row of `shapes` and of
    `lights`, and those of the caller's faces and strands for each primitive.

    Raises SceneError for more shapes than a matte can tell apart.
    """
    layers, listed = index.layers, index.listed
    names: dict[str, tuple[str, ...]] = {}
    features = LayerFeatures(layers, bool(layers) or index.timed, time_bins=index.film.time_bins)
    if "crypto_object" in layers:
        if len(listed) > MOST_NAMED:
            message = f"mattes are for {MOST_NAMED:,} shapes, not {len(listed):,}"
            raise SceneError(message, where="film.layers")
        names["objects"] = tuple(_object_name(shape, i) for i, shape in enumerate(listed))
    if "crypto_material" in layers or "material_id" in layers:
        numbers, materials = _materials(instancing.distinct(listed))
        of_rows = [numbers[id(shape.material)] for _, shape, _, _ in geometry.owners]
        row = store.append_floats("distributions", np.array([*of_rows, 0.0]))
        features = replace(features, material_numbers=row)
        names["materials"] = tuple(_material_name(m, i) for i, m in enumerate(materials))
    if "primitive_id" in layers:
        first = _primitive_rows(index, geometry, store, cache)
        features = replace(features, primitive_rows=first)
    if "light_groups" in layers:
        groups = _groups(index, geometry, lights)
        groups += [REST] * bool(index.emitting)  # of emission in media
        names["light_groups"] = tuple(sorted({*groups})) or (REST,)
        numbers_of = np.searchsorted(names["light_groups"], np.array(groups, str))
        row = store.append_floats("distributions", np.array([*numbers_of, 0.0]))
        count = len(names["light_groups"])
        features = replace(features, light_groups=count, light_group_row=row)
    return LayerNames(**names), features


def _primitive_rows(
    index: SceneIndex, geometry: Geometry, store: TableStore, cache: LoweringCache
) -> int:
    """Put the caller's rows of primitives into `distributions`; return where, see SETTINGS."""
    places, deforming = [], index.motions.deforming
    for row, shape, _, _ in geometry.owners:
        times = (
            deforming.get(int(row["number"]), ()) if row["flags"] & SHAPE_BITS["deforms"] else ()
        )
        rows = cache(primitive_rows, shape, times, by=(*geometry_of(shape), times))
        places.append(0 if rows is None else store.append_floats("distributions", _words(rows)))
    return store.append_floats("distributions", _words([*places, 0])) if any(places) else 0


def _words(numbers: ArrayLike) -> NDArray[np.float32]:
    """Whole numbers as the bits of floats."""
    return np.asarray(numbers, np.int32).view(np.float32)


def _materials(shapes: Iterable[Shape]) -> tuple[dict[int, int], list[mt.Material]]:
    """The number of each material by its identity, and all of them."""
    numbers: dict[int, int] = {}
    materials: list[mt.Material] = []
    for shape in shapes:
        if id(shape.material) not in numbers:
            numbers[id(shape.material)] = len(materials)
            materials.append(shape.material)
    return numbers, materials


def _groups(index: SceneIndex, geometry: Geometry, lights: LightRows) -> list[str]:
    """The group of each row of `lights`."""
    lamps, starts = index.lights, lights.sources.first
    groups = [lamps[i].group or REST for i in row_order(lamps)]
    groups += [REST] * (next(iter(starts), len(lights.rows)) - len(groups))  # of media
    ends = (*starts, len(lights.rows))[1:]
    for emitter, first, end in zip(geometry.emitters, starts, ends, strict=True):
        emission = emitter.shape.emission
        groups += [(emission.group if emission else "") or REST] * (end - first)
    return groups


def _object_name(shape: Shape, number: int) -> str:
    """The name of a shape; an instance without a name has the name of its group."""
    group = shape.group.name if isinstance(shape, Instance) else ""
    return shape.name or group or f"{shape.kind}{number}"


def _material_name(material: mt.Material, number: int) -> str:
    """The name of a material, or of its first part with a name."""
    names = (part.name for part in mt.parts(material) if part.name)
    return next(names, f"{material.kind}{number}")
