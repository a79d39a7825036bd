"""Lamps to which rays of their own leave sealed media, see kernels/media/escape.cl.

The rays go through smooth boundaries that bend all wavelengths alike. Outside there must be no
medium, and what they find must be what paths find: so scenes with other needs do without.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry.winding import box
from clpt.render.geometry.surroundings import bounds_media, every
from clpt.render.scene_index import SceneIndex, any_of
from clpt.scene import materials as mt
from clpt.scene.integrators import Path
from clpt.scene.media import Lattice, Medium
from clpt.scene.shapes import Shape
from clpt.spectra import Constant

MOST = 16  # lamps, the largest ones; others are met by chance


def escape_lamps(
    index: SceneIndex, sealed: frozenset[Medium], cached: Callable[..., Any] | None = None
) -> NDArray[np.float32]:
    """Return centre, radius and 0 (k, 5) of balls around lamps, k from 0 to MOST [m].

    There are none where no ray of that kind is sent. cached: `LoweringCache`, which keeps the
    triangles of lamps.
    """
    shapes = list(every(index.listed, lambda one: one.emission is not None or bounds_media(one)))
    lamps = [shape for shape in shapes if shape.emission is not None]
    if not lamps or not _suits(index, sealed) or not _is_bent_alike(shapes, sealed):
        return np.zeros((0, 5), np.float32)
    low, high = (np.array(ends) for ends in zip(*(box(one, cached) for one in lamps), strict=True))
    radius = np.linalg.norm(high - low, axis=1) / 2.0
    rows = np.column_stack([(low + high) / 2.0, radius, np.zeros(len(radius))])
    return rows[np.argsort(-radius, kind="stable")[:MOST]].astype(np.float32)


def _suits(index: SceneIndex, sealed: frozenset[Medium]) -> bool:
    """Whether paths and media of a scene are such that rays of that kind are right."""
    simple = isinstance(index.integrator, Path) and not index.weighed and not index.guided
    alone = bool(sealed) and all(one in sealed for one in index.media)
    plain = not any(isinstance(one, Lattice) for one in index.media)
    still = not index.motions and not index.dyed and not index.shifts
    return simple and alone and plain and still and not index.light_layers


def _is_bent_alike(shapes: list[Shape], sealed: frozenset[Medium]) -> bool:
    """Whether smooth boundaries are materials of their own, with the same index at all wavelengths.

    One at least must be around a sealed medium.
    """
    for shape in shapes:
        whole = isinstance(shape.material, mt.Dielectric)
        if any_of(shape.material, mt.NormalMapped):
            return False
        if any_of(shape.material, mt.Dielectric) and not whole:
            return False
        if isinstance(shape.material, mt.Dielectric):
            indices = shape.material.int_ior, shape.material.ext_ior
            if not all(isinstance(one, int | float | Constant) for one in indices):
                return False
    return any(isinstance(one.material, mt.Dielectric) and one.interior in sealed for one in shapes)
