"""Edits of the parameters of the camera and of materials, as writes of a few words."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry.instancing import distinct
from clpt.render.camera.encode import encode_camera
from clpt.render.edit.plan import Plan
from clpt.render.edit.rebuild import ranges
from clpt.render.edit.scene_edit import Replacements
from clpt.render.lights.aims import is_sharp
from clpt.render.materials.check import check_material
from clpt.render.materials.encode import gloss_word
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.materials import Material
from clpt.scene.params import fields_of


@dataclass(frozen=True, eq=False)
class Patch(Plan):
    """New words of the camera, unless it is None, and of rows of materials.

    rows: the first word of each row in `materials`, and its words.
    """

    target: DeviceScene
    camera: NDArray[np.float32] | None
    rows: list[tuple[int, Any]]

    def write(self) -> None:
        lowered, stream = self.target.lowered, self.target.stream
        tables = dict(lowered.tables)
        if self.camera is not None:
            stream.write(self.target.tables["camera"], self.camera)
            tables["camera"] = self.camera
        if self.rows:
            table = tables["materials"] = tables["materials"].copy()
            for first, new in self.rows:
                row = table[first : first + len(new)]
                for begin, end in ranges(row, new):
                    buffer = self.target.tables["materials"]
                    stream.write(buffer, new[begin:end], 4 * (first + begin))
                row[:] = new
        self.target.lowered = dataclasses.replace(lowered, tables=tables)


def patch(on_device: DeviceScene, former: Scene, scene: Scene) -> Patch | str:
    """Return the words that change from a former scene to a scene.

    The scenes may differ in the camera, of the same kind, and in values of materials. Else the
    function returns the difference as a text. Raises SceneError as `lower` does.
    """
    lowered = on_device.lowered
    pairs = [] if scene.shapes is former.shapes else _pairs(former, scene)
    if pairs is None:
        return "a material is of another kind or structure"
    if lowered.features.transport.balanced and any(
        is_sharp(old) != is_sharp(new) for old, new in pairs
    ):
        return "light paths aim at what is sharp, and a material is so now, or no more"
    if lowered.features.media.bodies and pairs:
        return "bodies that overlap know each other's indices"
    camera = None
    if scene.camera is not former.camera:
        if scene.camera.dispersive_glasses != former.camera.dispersive_glasses:
            return "the camera's lens is of another glass"
        film, rows_ = scene.film, lowered.glass_rows
        camera = encode_camera(scene.camera, film.width, film.height, rows_)
        kind = lowered.features.camera.kind
        if scene.camera.kind != kind or len(camera) != len(lowered.tables["camera"]):
            return "the camera is of another kind"
        if _reflects(scene.camera) != _reflects(former.camera):
            return "the camera's lens reflects, or no more"
    rows: list[tuple[int, Any]] = []
    for old, new in pairs:
        check_material(new, scene.film)
        changed = lowered.encoder.replaced(old, new, "materials")
        if changed is None:
            return f"parameters of a {new.kind} come from elsewhere, such as a texture or a table"
        rows += changed
        if before := lowered.features.lights.gloss:
            word = np.array([gloss_word(new)], np.uint32)
            rows += [(row - before, word) for row, _ in changed]
    return Patch(on_device, camera, rows)


def _reflects(camera: Camera) -> tuple[bool, bool]:
    return camera.reflects, camera.has_ghosts


def _pairs(former: Scene, scene: Scene) -> list[tuple[Any, Any]] | None:
    """Return pairs of old and new leaf materials; None if more than values differs."""
    pairs: Replacements = {}
    for old, new in zip(distinct(former.shapes), distinct(scene.shapes), strict=True):
        if not _pair(old.material, new.material, pairs):
            return None
    changed = [(old, new) for old, new in pairs.values() if old is not new]
    return [(old, new) for old, new in changed if not old.is_composite]


def _pair(old: Material, new: Material, pairs: Replacements) -> bool:
    """Note that a material replaces another; return whether only values may differ."""
    if id(old) in pairs:
        return pairs[id(old)][1] is new
    pairs[id(old)] = old, new
    if old is new and not old.is_composite:
        return True
    if type(old) is not type(new):
        return False
    if not old.is_composite:
        traits = [(m.absorbs_inside, m.transmits, m.uses_tangents) for m in (old, new)]
        return traits[0] == traits[1]
    parts, others = old.shared_parts, fields_of(new)
    if parts.keys() != new.shared_parts.keys():
        return False
    free = parts.keys() | {"name"}
    same = all(a is others[name] for name, a in fields_of(old).items() if name not in free)
    return same and all(_pair(part, others[name], pairs) for name, part in parts.items())
