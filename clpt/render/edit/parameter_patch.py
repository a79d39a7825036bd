"""Edits of the parameters of the camera and of materials, as writes of a few words."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.geometry.instancing import distinct
from clpt.render.camera.encode import encode_camera
from clpt.render.edit.rebuild import ranges
from clpt.render.edit.scene_edit import Replacements
from clpt.render.lights.aims import is_sharp
from clpt.render.materials.check import check_material
from clpt.render.materials.encode import gloss_word
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.materials import CLEAR, COMPOSITES, Material
from clpt.scene.params import fields_of


def patch(on_device: DeviceScene, former: Scene, scene: Scene) -> Callable[[], None] | str:
    """Return a function that enqueues the words by which a scene differs from a former scene.

    The scenes may differ in the camera, of the same kind, and in values of materials. Else the
    result is a text that says what differs. After an error the function may be called again.
    Raises SceneError as `lower` does.
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
    return lambda: _write(on_device, camera, rows)


def _reflects(camera: Camera) -> tuple[bool, bool]:
    return camera.reflects, camera.has_ghosts


def _write(on_device: DeviceScene, camera: Any, rows: list[tuple[int, Any]]) -> None:
    """Enqueue the words of a camera, unless it is None, and of rows of materials."""
    lowered, stream = on_device.lowered, on_device.stream
    tables = dict(lowered.tables)
    if camera is not None:
        stream.write(on_device.tables["camera"], camera)
        tables["camera"] = camera
    if rows:
        table = tables["materials"] = tables["materials"].copy()
        for first, new in rows:
            row = table[first : first + len(new)]
            for begin, end in ranges(row, new):
                buffer = on_device.tables["materials"]
                stream.write(buffer, new[begin:end], 4 * (first + begin))
            row[:] = new
    on_device.lowered = dataclasses.replace(lowered, tables=tables)


def _pairs(former: Scene, scene: Scene) -> list[tuple[Any, Any]] | None:
    """Return pairs of old and new leaf materials; None if more than values differs."""
    pairs: Replacements = {}
    for old, new in zip(distinct(former.shapes), distinct(scene.shapes), strict=True):
        if not _pair(old.material, new.material, pairs):
            return None
    changed = [(old, new) for old, new in pairs.values() if old is not new]
    return [(old, new) for old, new in changed if not isinstance(old, COMPOSITES)]


def _pair(old: Material, new: Material, pairs: Replacements) -> bool:
    """Note that a material replaces another; return whether only values may differ."""
    if id(old) in pairs:
        return pairs[id(old)][1] is new
    pairs[id(old)] = old, new
    if old is new and not isinstance(old, COMPOSITES):
        return True
    if type(old) is not type(new):
        return False
    if not isinstance(old, COMPOSITES):
        absorb = [material.absorption != CLEAR for material in (old, new)]
        traits = [(material.transmits, material.uses_tangents) for material in (old, new)]
        return absorb[0] == absorb[1] and traits[0] == traits[1]
    others = fields_of(new)
    for name, a in fields_of(old).items():
        b = others[name]
        if isinstance(a, Material) and isinstance(b, Material):
            if not _pair(a, b, pairs):
                return False
        elif a is not b and name != "name":
            return False
    return True
