"""The JSON Schema of scene.json, made from the dataclasses' own declarations.

`python -m clpt.formats.native.schema` writes it to scenes/schema.json.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

from clpt import spectra
from clpt.files import output_files
from clpt.formats.native import forms, motion
from clpt.formats.native.json_schema import (
    INDEX_FILE_OBJECT,
    NUMBER,
    NUMBERS,
    STRING,
    TRIPLE,
    Schema,
    object_of,
    ref,
    rows,
)
from clpt.formats.native.shape_files import FILES
from clpt.formats.native.spectra import RERADIATIONS, SPECTRA
from clpt.images.colour import HEX
from clpt.scene import KINDS, integrators, materials, roles
from clpt.scene.params import Kind, defaults, params
from clpt.scene.roles import Param, Role, Spectral

ANY_OF_SCALE = {"anyOf": [NUMBER, TRIPLE]}


def schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a scene.json."""
    defs: Schema = {category: _category(category) for category in KINDS}
    defs |= {f"spectrum_{role.name}": _spectrum(role) for role in roles.SPECTRA}
    defs["reradiation"] = _reradiation()
    defs |= {
        "spectrum": _typed_spectra(),
        "step": _step(),
        "keys": motion.KEYS_SCHEMA,
        "deformation": motion.DEFORMATION_SCHEMA,
        "shutter": motion.SHUTTER_SCHEMA,
        "transform": _transform(),
    }
    defs["layer"] = _untyped(materials.Layer)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "clpt scene",
        "description": "A scene for clpt; file names are relative to this file.",
        "type": "object",
        "additionalProperties": False,
        "required": ["camera"],
        "properties": _properties(),
        "$defs": defs,
    }


MATERIALX: Schema = {
    "title": "materialx",
    "description": "A material of a document of MaterialX, with its light and its inside.",
    "type": "object",
    "additionalProperties": False,
    "required": ["type", "file"],
    "properties": {
        "type": {"const": "materialx"},
        "file": {**STRING, "description": "a .mtlx"},
        "material": {**STRING, "description": "its name, if there are several"},
    },
}


def _properties() -> Schema:
    """The entries of a scene."""
    return {
        "$schema": STRING,
        "version": {
            "type": "integer",
            "minimum": 1,
            "maximum": 2,
            "description": "of the format: 2; files of lamps give candela since then",
        },
        "name": STRING,
        "camera": ref("camera"),
        "film": _untyped(integrators.Film),
        "integrator": ref("integrator"),
        "sampler": ref("sampler"),
        "materials": {"type": "object", "additionalProperties": ref("material")},
        "media": {"type": "object", "additionalProperties": ref("medium")},
        "groups": {
            "type": "object",
            "additionalProperties": {"type": "array", "items": ref("shape")},
            "description": "shapes that instances place together",
        },
        "shapes": {"type": "array", "items": ref("shape")},
        "lights": {"type": "array", "items": ref("light")},
        "spp": {"type": "integer", "minimum": 1, "description": "samples of a pixel"},
        "noise": {
            "type": "number",
            "exclusiveMinimum": 0,
            "description": "below which a pixel gets no more samples",
        },
        "seed": {"type": "integer", "description": "of the random numbers"},
    }


def _category(category: str) -> Schema:
    others = [MATERIALX] if category == "material" else []
    return {"oneOf": [*(_kind(cls) for cls in KINDS[category]), *others]}


def _kind(cls: type[Kind]) -> Schema:
    """Return the schema of an object of a kind."""
    default = defaults(cls)
    properties: Schema = {"type": {"const": cls.kind}}
    for name, param in params(cls).items():
        properties[name] = _parameter(param, default[name])
    for shorthand in cls.shorthands:
        stands = f"stands for {' and '.join(shorthand.stands_for)}"
        for name, param in shorthand.arguments.items():
            doc = f"{param.doc} [{param.unit}]" if param.unit else param.doc
            properties[name] = {"description": f"{doc}; {stands}", **forms.schema(param)}
    if (file := FILES.get(cls)) is not None:
        properties["file"] = {**STRING, "description": f"{file.accepts}: {file.meaning}"}
    summary = (cls.__doc__ or "").strip().splitlines()[0]
    return object_of(properties, ["type"], summary)


def _untyped(cls: type[Kind]) -> Schema:
    """Return the schema of an object whose kind is implied, so that it has no `type`."""
    typed = _kind(cls)
    del typed["properties"]["type"], typed["required"]
    return typed


def _parameter(param: Param, default: object) -> Schema:
    """The values of a parameter, with its description and its default."""
    doc = f"{param.doc} [{param.unit}]" if param.unit else param.doc
    shown = forms.plain(default)
    has_default = isinstance(shown, (bool, int, float, str, list))
    has_default &= param.role.name not in ("volume", "media")
    return {
        "description": doc,
        **({"default": shown} if has_default else {}),
        **forms.schema(param),
    }


# of a number in the place of a spectrum, where it is not any from 0
LIMITS: dict[Role, Schema] = {
    roles.FACTOR: {}, roles.QUANTITY: {}, roles.REFLECTANCE: {"minimum": 0, "maximum": 1},
}  # fmt: skip
NAMES: dict[Role, Schema] = {
    roles.EMISSION: {"enum": list(spectra.illuminants()), "description": "an illuminant"},
    roles.INDEX: {"enum": list(spectra.glasses()), "description": "a glass or liquid"},
}


def _spectrum(role: Role) -> Schema:
    number: Schema = {**NUMBER, **LIMITS.get(role, {"minimum": 0})}
    one_of = [number, {**TRIPLE, "description": "linear Rec. 709"}, ref("spectrum")]
    if isinstance(role, Spectral) and role.codes:
        one_of.append({**STRING, "pattern": f"^{HEX}$", "description": "a colour in sRGB"})
    return {"anyOf": [*one_of, *([NAMES[role]] if role in NAMES else [])]}


def _typed_spectra() -> Schema:
    variants = [
        INDEX_FILE_OBJECT,
        object_of({"values": {**rows(2), "description": "[nm, value]"}}, ["values"]),
    ]
    for kind, cls in SPECTRA.items():
        properties: Schema = {"type": {"const": kind}}
        needed = ["type"]
        for field in dataclasses.fields(cls):  # type: ignore[arg-type]
            properties[field.name] = _spectrum_field(field.name, str(field.type))
            if field.default is dataclasses.MISSING:
                needed.append(field.name)
        variants.append(object_of(properties, needed))
    return {"anyOf": variants}


def _spectrum_field(name: str, written: str) -> Schema:
    if name == "outside":
        return {"enum": ["zero", "hold"]}
    if name == "name":
        return {"enum": list(spectra.illuminants())}
    if written == "bool":
        return {"type": "boolean"}
    return NUMBERS if "tuple" in written else NUMBER


def _reradiation() -> Schema:
    file = {**STRING, "description": "a BFC matrix, or a table of values [1/nm]"}
    kinds = [{"type": {"const": kind}} for kind in RERADIATIONS]
    shapes = dict.fromkeys(("absorption", "emission"), ref("spectrum_reflectance"))
    share = {**NUMBER, "minimum": 0, "maximum": 1}
    table = {"out": NUMBERS, "into": NUMBERS, "rows": {"type": "array", "items": NUMBERS}}
    return {
        "anyOf": [
            {"type": "null"},
            object_of({"file": file}, ["file"]),
            object_of({**kinds[0], **shapes, "quantum_yield": share}, ["type", *shapes]),
            object_of({**kinds[1], **table}, ["type", *table]),
        ]
    }


def _step() -> Schema:
    points = ("origin", "target", "up")
    look_at = object_of(dict.fromkeys(points, TRIPLE), list(points))
    turn = object_of({"axis": TRIPLE, "angle": NUMBER}, ["axis", "angle"])
    steps = {"translate": TRIPLE, "scale": ANY_OF_SCALE, "rotate": turn, "look_at": look_at}
    return {"oneOf": [object_of({name: form}, [name]) for name, form in steps.items()]}


def _transform() -> Schema:
    matrices = [rows(size, count=size) for size in (4, 3)]
    return {"anyOf": [*matrices, ref("step"), {"type": "array", "items": ref("step")}]}


def text() -> str:
    """Return the schema as the published file has it."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "scenes/schema.json")
    output_files.write_text(target, text())
