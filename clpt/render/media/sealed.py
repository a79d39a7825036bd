"""Media from which no ray to a light comes out: those in bodies of glass, of milk or of skin.

Their boundaries stop shadow rays, so a point inside is never lit by next-event estimation. Paths in
them do without, and light that they meet by chance has its whole weight: that is right wherever the
lights are. The boxes below only tell where it pays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from clpt.geometry.winding import box
from clpt.render.geometry.surroundings import every
from clpt.render.scene_index import SceneIndex, leaves_of
from clpt.scene.media import Medium
from clpt.scene.shapes import Shape

MOST_LAMPS = 64  # whose boxes are compared


def sealed_media(index: SceneIndex, cached: Callable[..., Any] | None = None) -> frozenset[Medium]:
    """Return the media inside of boundaries that stop shadow rays, away from all lamps.

    There are none where a ray cannot meet all lights. cached: `LoweringCache`, which keeps the
    triangles of boundaries.
    """
    placed = index.listed
    if index.nested or any(light.reach != "infinite" for light in index.lights):
        return frozenset()
    inside: dict[Medium, list[Shape]] = {}
    for shape in every(placed):
        if shape.interior is not None:
            inside.setdefault(shape.interior, []).append(shape)
    around = {shape.exterior for shape in index.shapes} | {index.camera.medium}
    shapes = every(placed, lambda one: one.emission is not None)
    lamps = [box(shape, cached) for shape in shapes if shape.emission is not None]
    found = set()
    for medium, bodies in inside.items():
        leaves = {leaf for shape in bodies for leaf in leaves_of(shape.material)}
        stops = not any(leaf.is_null or (leaf.is_pane and index.free_panes) for leaf in leaves)
        alone = medium.scatters and medium not in around and medium not in index.emitting
        alone = alone and len(lamps) <= MOST_LAMPS
        if stops and alone and not any(_overlap(bodies, lamp, cached) for lamp in lamps):
            found.add(medium)
    return frozenset(found)


def _overlap(bodies: list[Shape], lamp: Any, cached: Callable[..., Any] | None) -> bool:
    boxes: Iterator[Any] = (box(shape, cached) for shape in bodies)
    return any(((np.minimum(b, lamp[1]) - np.maximum(a, lamp[0])) >= 0.0).all() for a, b in boxes)
