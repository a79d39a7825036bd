"""Panels for the parts of a scene, from the declarations of `clpt.scene`; and edits by them."""

from __future__ import annotations

import dataclasses
import json
import math
from functools import cache
from typing import Any, NoReturn

import numpy as np

from clpt import spectra
from clpt.errors import SceneError
from clpt.formats.native import forms
from clpt.formats.native.cursor import Cursor
from clpt.images.colour import TONES
from clpt.render.edit.scene_edit import Successors, edit_scene
from clpt.scene import Scene
from clpt.scene.materials import LEAVES, Material, parts
from clpt.scene.params import Kind, defaults, fields_of, params
from clpt.scene.roles import INDEX, MEASUREMENT, MERL, SPECTRA, Param
from clpt.scene.shapes import Shape
from clpt.scene.values import is_texture
from clpt.spectra.sensors import OBSERVERS
from clpt.view.beginning import each
from clpt.view.messages import OF_VIEW, CommandError
from clpt.view.target import Change

# Controls of the page by the names of roles; others cannot be edited there.
CONTROLS = {
    **dict.fromkeys((role.name for role in SPECTRA), "spectrum"),
    "real": "number",
    "flag": "flag",
    "choice": "choice",
    "orders": "numbers",
    "boolean": "flag",
    "integer": "whole",
    "number": "number",
    "numbers": "numbers",
    "vector": "vector",
    "direction": "vector",
    "white_balance": "white",
    "sensor": "choice",
    "number_or_auto": "number_or_auto",
}
METAL = "metal"  # a name in place of `eta` and `k`
KIND = "type"  # of a material, as scene.json calls it
MOST_OBJECTS = 500  # that a page lists
MOST_PANELS = 300
LONGEST_NAME = 80  # characters of a name on the page
CURVE_AT = range(380, 781, 20)  # [nm]
OF_FILM = (  # what can change while the renderers stay
    "sensor", "white_balance", "exposure", "display_exposure", "lambda_min", "lambda_max",
    "wavelengths",
)  # fmt: skip


def panels(scene: Scene) -> list[dict[str, Any]]:
    """Return a description of a panel for each kind of the scene that can be edited.

    target, index: arguments of `edited`; title, kind, doc: for people; kinds: that KIND as the key
    takes; metals: that METAL as the key takes; shapes: indices of shapes that have the material or
    emission; parameters: see `_parameter`.
    """
    described: list[dict[str, Any]] = []
    for target, targets in _targets(scene).items():
        for index, (target_kind, owners) in enumerate(targets[: MOST_PANELS - len(described)]):
            described.append(
                {
                    "target": target,
                    "index": index,
                    "title": _title(target, target_kind, owners, scene),
                    "kind": target_kind.kind,
                    "kinds": list(_material_kinds()) if target == "material" else [],
                    "metals": list(spectra.metals()) if _is_metal(target_kind) else [],
                    "doc": (type(target_kind).__doc__ or "").strip().splitlines()[0],
                    "shapes": owners[:MOST_OBJECTS],
                    "parameters": _parameters(target, target_kind),
                }
            )
    return described


def names(with_view: bool) -> dict[str, list[str]]:
    """Return the names that the page offers, by subject; with_view: of OpenColorIO."""
    return {
        "tones": [*TONES, *[OF_VIEW] * with_view],
        "illuminants": list(spectra.illuminants()),
        "glasses": list(spectra.glasses()),
    }


def objects(scene: Scene) -> list[dict[str, Any]]:
    """Return the shapes of a scene for people: names, kinds, and the index of their material."""
    number = {id(m): i for i, (m, _) in enumerate(_targets(scene)["material"])}
    return [
        {
            "name": for_people(shape.name) or f"{shape.kind} {i + 1}",
            "kind": shape.kind,
            "material": number.get(id(shape.material)),
        }
        for i, shape in enumerate(scene.shapes[:MOST_OBJECTS])
    ]


def object_of(scene: Scene, index: int) -> dict[str, Any]:
    """Return a shape for people: name, kind, name of its material, and the index of its panel."""
    shape = scene.shapes[index]
    materials = [id(material) for material, _ in _targets(scene)["material"]]
    panel = materials.index(id(shape.material)) if id(shape.material) in materials else None
    made_of = "" if shape.material is None else shape.material.name or shape.material.kind
    name = for_people(shape.name) or f"{shape.kind} {index + 1}"
    return {
        "name": name, "kind": shape.kind, "made_of": for_people(made_of), "material": panel
    }  # fmt: skip


def for_people(name: str) -> str:
    """Return a name of a scene as a page shows it; a file may hold any text.

    It is short, and has no invisible characters, such as marks that turn the text around.
    """
    shown = "".join(letter if letter.isprintable() else "?" for letter in name[: LONGEST_NAME + 1])
    return shown if len(shown) <= LONGEST_NAME else f"{shown[: LONGEST_NAME - 3]}..."


def edited(scene: Scene, target: str, index: int, key: str, value: object) -> tuple[Scene, Change]:
    """Return a scene with another value of a parameter, and the change.

    value: as in scene.json, but it names no file; of a material KIND is a key too. Raises
    CommandError, SceneError.
    """
    targets = _targets(scene).get(target, [])
    if index >= len(targets):
        raise CommandError(f"the scene has no {target} {index + 1}")
    edited_kind = targets[index][0]
    if key == KIND and target == "material":
        return _replaced(scene, target, edited_kind, _of_kind(edited_kind, value))
    if key == METAL and target == "material" and _is_metal(edited_kind):
        return _replaced(scene, target, edited_kind, _of_metal(edited_kind, value))
    param = params(type(edited_kind)).get(key)
    if param is None or not _editable(target, key, param):
        raise CommandError(f"{edited_kind.kind}.{key} cannot be edited")
    new = dataclasses.replace(edited_kind, **{key: read(key, value, param)})
    return _replaced(scene, target, edited_kind, new)


@cache
def _material_kinds() -> dict[str, type[Material]]:
    """Return the materials that need no parameter and no measured table, by their kinds."""
    measured = {MEASUREMENT, MERL}
    return {
        cls.kind: cls
        for cls in LEAVES
        if not measured & {param.role for param in params(cls).values()}
    }


def _is_metal(material: Kind) -> bool:
    return any(METAL in shorthand.arguments for shorthand in material.shorthands)


def _of_metal(material: Material, metal: object) -> Material:
    """Return a material with the optical constants of a metal by its name. Raises SceneError."""
    if not isinstance(metal, str):
        raise CommandError("a metal is given by its name")
    known = fields_of(material)
    plain = {name: value for name, value in known.items() if name not in ("eta", "k")}
    return type(material)(**plain, **{METAL: metal})


def _of_kind(material: Material, kind: object) -> Material:
    """Return a material of another kind, with the parameters that both have.

    Raises CommandError for a name of no such kind.
    """
    cls = _material_kinds().get(str(kind))
    if cls is None:
        raise CommandError(f"there is no kind {kind!r} to choose")
    old, new = params(type(material)), params(cls)
    values = {
        name: value
        for name, value in fields_of(material).items()
        if name in new and name in old and new[name].role is old[name].role
    }
    try:
        return cls(**values)
    except SceneError:  # of values that fit a single kind
        return cls(name=material.name)


def written(kind: Kind) -> dict[str, Any]:
    """Return a camera or a light as scene.json has it, without what cannot be shown."""
    values, declared = fields_of(kind), params(type(kind)).items()
    known = {name: _shown(values[name], param) for name, param in declared}
    return {"type": kind.kind, **{key: value for key, value in known.items() if value is not None}}


def _targets(scene: Scene) -> dict[str, list[tuple[Any, list[int]]]]:
    """Return what can be edited: things, and the indices of the shapes that have them."""
    materials: dict[int, tuple[Material, list[int]]] = {}
    emissions: dict[int, tuple[Any, list[int]]] = {}
    for i, shape in enumerate(scene.shapes):
        for member in shape.members:
            for part in parts(member.material):
                owners = materials.setdefault(id(part), (part, []))[1]
                if not owners or owners[-1] != i:
                    owners.append(i)
            if member.emission is not None:
                emissions.setdefault(id(member.emission), (member.emission, []))[1].append(i)
    return {
        "camera": [(scene.camera, [])],
        "film": [(scene.film, [])],
        "integrator": [(scene.integrator, [])],
        "light": [(light, []) for light in scene.lights],
        "emission": [*emissions.values()],
        "material": [*materials.values()],
    }


def _title(target: str, kind: Any, owners: list[int], scene: Scene) -> str:
    if getattr(kind, "name", ""):
        return for_people(kind.name)
    named = [scene.shapes[i].name for i in owners if scene.shapes[i].name]
    return for_people(named[0]) if named else kind.kind.replace("_", " ")


def _parameters(target: str, kind: Kind) -> list[dict[str, Any]]:
    values, default = fields_of(kind), defaults(type(kind))
    return [
        _parameter(name, param, values[name], default[name])
        for name, param in params(type(kind)).items()
        if _editable(target, name, param)
    ]


def is_plain(param: Param) -> bool:
    """Return whether a parameter can go to a page and come back: a value, no other thing."""
    return param.role.name in (*CONTROLS, "matrix4")


def _editable(target: str, key: str, param: Param) -> bool:
    if target == "film" and key not in OF_FILM:
        return False
    return param.role.name in CONTROLS


def _parameter(name: str, param: Param, value: object, default: object) -> dict[str, Any]:
    """Return a parameter for the page: control, words, unit, limits, choices, value."""
    form = param.role.name
    choices = list(OBSERVERS) if form == "sensor" else list(param.choices)
    if form == "white_balance":
        choices = ["none", *spectra.illuminants()]
    return {
        "key": name,
        "control": CONTROLS[form],
        "doc": param.doc,
        "unit": param.unit,
        "low": param.low if math.isfinite(param.low) else None,
        "high": param.high if math.isfinite(param.high) else None,
        "choices": choices,
        "optional": param.optional,
        "role": form,
        "value": _shown(value, param),
        "default": _shown(default, param),
        "curve": _curve(value, param),
        "texture": value.kind if is_texture(value) else None,
    }


def _curve(value: Any, param: Param) -> list[float] | None:
    """Return a spectrum at CURVE_AT, for a small plot; None for other values."""
    if param.role not in SPECTRA or is_texture(value):
        return None
    try:
        if param.role is INDEX:
            spectrum: Any = spectra.index(value)
        else:
            plain = isinstance(value, (int, float))
            spectrum = spectra.Constant(float(value)) if plain else value
        return [float(f"{number:.4g}") for number in spectrum.sample(np.array(CURVE_AT, float))]
    except (SceneError, AttributeError):
        return None


def _shown(value: object, param: Param) -> Any:
    """Return a value as scene.json has it, None where the page cannot show it."""
    if is_texture(value) or not is_plain(param):
        return None
    shown = forms.write(value, param, _WRITER)
    try:
        return json.loads(json.dumps(shown, allow_nan=False))
    except (TypeError, ValueError):
        return None


def read(key: str, value: object, param: Param) -> Any:
    """Return the value of a parameter that a page gave, which names no file.

    Raises SceneError, CommandError.
    """
    if value is None and param.optional:
        return None
    document = {key: value}
    cursor = Cursor(document, None, json.dumps(document)).at(key)
    try:
        if param.role.name == "sensor" and not isinstance(value, str):
            raise CommandError("must be the name of an observer")
        return forms.read(cursor, param, _READER)
    except SceneError as error:
        raise CommandError(f"{key}: {error.message}") from None


def _replaced(scene: Scene, target: str, old: Any, new: Any) -> tuple[Scene, Change]:
    if target == "camera":
        return dataclasses.replace(scene, camera=new), Change(camera=new)
    if target in ("film", "integrator"):
        return dataclasses.replace(scene, **{target: new}), Change(whole=True)
    if target == "light":
        lights = [new if light is old else light for light in scene.lights]
        return dataclasses.replace(scene, lights=lights), Change(whole=True)
    if target == "material":
        changed, _ = edit_scene(scene, Successors(), {old: new})
        same = type(old) is type(new)
        return changed, Change(materials={old: new}) if same else Change(whole=True)

    def emitting(shape: Shape) -> Shape:
        return dataclasses.replace(shape, emission=new) if shape.emission is old else shape

    return dataclasses.replace(scene, shapes=each(scene.shapes, emitting)), Change(whole=True)


class _NoParts:
    """Reads and writes values alone; it refuses parts of a scene."""

    def __getattr__(self, name: str) -> NoReturn:
        raise CommandError("only a value can stand here")


_READER: Any = _NoParts()
_WRITER: Any = _NoParts()

__all__ = ["edited", "objects", "panels", "read", "written"]
