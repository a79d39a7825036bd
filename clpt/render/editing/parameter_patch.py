"""Edits of values, the camera's and those of materials: a few words are written, nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clpt.render.editing.rebuild import ranges
from clpt.render.lowering.camera.cameras import dispersive_glass, lower_camera
from clpt.render.lowering.geometry.instancing import distinct
from clpt.render.lowering.materials.material_words import CLEAR
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.materials import COMPOSITES, Material
from clpt.scene.params import params


def rewrite(fronts: Sequence[Wavefront], former: Scene, scene: Scene) -> bool:
    """Bring a scene to the device that differs from the one there in values only: a few words.

    It may differ in its camera, which must be of the same kind, and in values of materials. Returns
    False, with nothing changed, where more than that differs. Raises SceneError as `lower` does.
    """
    front = fronts[0]
    lowered, encoder = front.lowered, front.lowered.encoder
    pairs = [] if scene.shapes is former.shapes else _pairs(former, scene)
    if pairs is None or (pairs and encoder is None):
        return False
    if scene.camera is not former.camera:
        if dispersive_glass(scene.camera) != dispersive_glass(former.camera):
            return False
        film, row = scene.film, lowered.glass_row
        kind, words = lower_camera(scene.camera, film.width, film.height, row)
        if kind != lowered.features.camera:
            return False
    rows: list[tuple[int, Any]] = []
    for old, new in pairs:
        found = encoder.replaced(old, new, "materials") if encoder else None
        if found is None:
            for one in fronts:
                one.lowered.encoder = None  # it has been written to; the next lowering has another
            return False
        rows += found
    if scene.camera is not former.camera:
        front.stream.write(front.named["camera"], words)
        lowered.tables["camera"] = words
    table = lowered.tables["materials"]
    for first, new in rows:
        own = table[first : first + len(new)]
        for begin, end in ranges(own, new):
            front.stream.write(front.named["materials"], new[begin:end], 4 * (first + begin))
        own[:] = new
    return True


def _pairs(former: Scene, scene: Scene) -> list[tuple[Any, Any]] | None:
    """The leaf materials that took the places of others, None where more than values differs."""
    found: dict[int, tuple[Any, Any]] = {}
    for old, new in zip(distinct(former.shapes), distinct(scene.shapes), strict=True):
        if not _pair(old.material, new.material, found):
            return None
    changed = [(old, new) for old, new in found.values() if old is not new]
    return [(old, new) for old, new in changed if not isinstance(old, COMPOSITES)]


def _pair(old: Any, new: Any, found: dict[int, tuple[Any, Any]]) -> bool:
    """Note what took the place of what; whether the two may differ in values only."""
    if id(old) in found:
        return found[id(old)][1] is new
    found[id(old)] = old, new
    if old is new and not isinstance(old, COMPOSITES):
        return True
    if type(old) is not type(new):
        return False
    if not isinstance(old, COMPOSITES):
        absorb = [getattr(one, "absorption", CLEAR) != CLEAR for one in (old, new)]
        traits = [(one.transmits, one.uses_tangents) for one in (old, new)]
        return absorb[0] == absorb[1] and traits[0] == traits[1]
    for name in params(type(old)):
        a, b = getattr(old, name), getattr(new, name)
        if isinstance(a, Material) and isinstance(b, Material):
            if not _pair(a, b, found):
                return False
        elif a is not b and name != "name":
            return False
    return True
