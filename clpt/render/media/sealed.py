"""Sealed media: no shadow ray leaves them, as in bodies of glass, of milk or of skin.

Their boundaries stop shadow rays, so next-event estimation never lights a point inside. Paths there
do without it, and light that they meet by chance has its full weight; this is right wherever the
lights are. The boxes below only tell where it pays.

Escape rays leave them toward lamps instead, through smooth boundaries that refract all wavelengths
alike, see kernels/media/escape.cl. They need no medium outside and plain paths; scenes with other
needs do without.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry.winding import box
from clpt.render.geometry.surroundings import bounds_media, every
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.scene_index import SceneIndex, any_of, leaves_of
from clpt.scene import materials as mt
from clpt.scene.media import Medium
from clpt.scene.shapes import Shape
from clpt.spectra import Constant

MOST_COMPARED = 64  # lamps: beyond this number no boxes are compared
MOST_AIMS = 16  # the largest lamps; others are met by chance

Box = tuple[NDArray[Any], NDArray[Any]]


def sealed_media(index: SceneIndex, cache: LoweringCache | None = None) -> frozenset[Medium]:
    """Return the media inside of boundaries that stop shadow rays, away from all lamps.

    Where a ray cannot meet every light, no medium is sealed. cache: it keeps the triangles of
    boundaries.
    """
    if index.nested or any(light.reach != "infinite" for light in index.lights):
        return frozenset()
    bodies: dict[Medium, list[Shape]] = {}
    for shape in every(index.listed):
        if shape.interior is not None:
            bodies.setdefault(shape.interior, []).append(shape)
    exteriors = {shape.exterior for shape in index.shapes} | {index.camera.medium}
    shapes = every(index.listed, lambda shape: shape.emission is not None)
    lamps = [box(shape, cache) for shape in shapes if shape.emission is not None]
    if len(lamps) > MOST_COMPARED:
        return frozenset()
    return frozenset(
        medium
        for medium, boundaries in bodies.items()
        if all(_stops_shadow_rays(shape, index) for shape in boundaries)
        and medium.scatters
        and medium not in exteriors
        and medium not in index.emitting
        and not any(_overlaps(boundaries, lamp, cache) for lamp in lamps)
    )


def _stops_shadow_rays(shape: Shape, index: SceneIndex) -> bool:
    leaves = leaves_of(shape.material)
    return not any(leaf.is_null or (leaf.is_pane and index.free_panes) for leaf in leaves)


def _overlaps(bodies: list[Shape], lamp: Box, cache: LoweringCache | None) -> bool:
    boxes = (box(shape, cache) for shape in bodies)
    return any(
        bool((np.minimum(high, lamp[1]) - np.maximum(low, lamp[0]) >= 0.0).all())
        for low, high in boxes
    )


def escape_lamps(
    index: SceneIndex, sealed: frozenset[Medium], cache: LoweringCache | None = None
) -> NDArray[np.float32]:
    """Return the targets of escape rays (k, 5): balls around lamps, each centre, radius [m] and 0.

    k is 0 to MOST_AIMS, and 0 where no escape ray is sent. cache: it keeps the triangles of lamps.
    """
    shapes = list(
        every(index.listed, lambda shape: shape.emission is not None or bounds_media(shape))
    )
    lamps = [shape for shape in shapes if shape.emission is not None]
    if not lamps or not _can_escape(index, sealed) or not _refract_alike(shapes, sealed):
        return np.zeros((0, 5), np.float32)
    boxes = [box(shape, cache) for shape in lamps]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    radius = np.linalg.norm(high - low, axis=1) / 2.0
    rows = np.column_stack([(low + high) / 2.0, radius, np.zeros(len(radius))])
    return rows[np.argsort(-radius, kind="stable")[:MOST_AIMS]].astype(np.float32)


def _can_escape(index: SceneIndex, sealed: frozenset[Medium]) -> bool:
    """Return whether the integrator and the media of a scene allow escape rays."""
    plain = index.integrator.has_escape_rays and not index.weighed and not index.guided
    all_sealed = bool(sealed) and all(medium in sealed for medium in index.media)
    homogeneous = all(medium.lattice is None for medium in index.media)
    simple = not index.motions and not index.dyed and not index.shifts
    return plain and all_sealed and homogeneous and simple and not index.light_layers


def _refract_alike(shapes: list[Shape], sealed: frozenset[Medium]) -> bool:
    """Return whether smooth boundaries are unmixed, with the same index at all wavelengths.

    Some such boundary must surround a sealed medium.
    """
    surrounds = False
    for shape in shapes:
        material = shape.material
        if any(part.perturbs_normals for part in mt.parts(material)):
            return False
        if not any_of(material, mt.Dielectric):
            continue
        if not isinstance(material, mt.Dielectric):
            return False
        indices = material.int_ior, material.ext_ior
        if not all(isinstance(value, int | float | Constant) for value in indices):
            return False
        surrounds = surrounds or shape.interior in sealed
    return surrounds
