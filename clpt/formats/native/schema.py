"""The JSON Schema of scene.json, made from the dataclasses' own declarations.

`python -m clpt.formats.native.schema` writes it to scenes/schema.json.
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from clpt import spectra
from clpt.formats.native.read import ARRAYS, BASES, default
from clpt.formats.native.reradiation import RERADIATIONS
from clpt.formats.native.spectra import SPECTRA
from clpt.scene import KINDS, integrators, materials
from clpt.scene.params import ORDERS, SPECTRUM_ROLES, Kind, Param, params
from clpt.scene.textures import ATTRIBUTES
from clpt.spectra.sensors import OBSERVERS
from clpt.spectra.spaces import TEMPERATURES

Schema = dict[str, Any]

INDEX_FILE = {"type": "string", "description": "columns, or a page of refractiveindex.info"}


def _rows(width: int, item: str = "number", count: int = 0) -> Schema:
    """An array of rows of numbers."""
    row = {"type": "array", "items": {"type": item}, "minItems": width, "maxItems": width}
    exact = {"minItems": count, "maxItems": count} if count else {}
    return {"type": "array", "items": row, **exact}


NUMBERS = {"type": "array", "items": {"type": "number"}}
TRIPLE = {**NUMBERS, "minItems": 3, "maxItems": 3}
ANY_OF_SCALE = {"anyOf": [{"type": "number"}, TRIPLE]}


def schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a scene.json."""
    defs: Schema = {category: _category(category) for category in KINDS}
    defs |= {f"spectrum_{role}": _spectrum(role) for role in SPECTRUM_ROLES}
    defs["reradiation"] = _reradiation()
    defs |= {"spectrum": _typed_spectra(), "step": _step(), "transform": _transform()}
    film, defs["layer"] = _untyped(integrators.Film), _untyped(materials.Layer)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "clpt scene",
        "description": "A scene for clpt; file names are relative to this file.",
        "type": "object",
        "additionalProperties": False,
        "required": ["camera"],
        "properties": {
            "$schema": {"type": "string"},
            "name": {"type": "string"},
            "camera": _ref("camera"),
            "film": film,
            "integrator": _ref("integrator"),
            "sampler": _ref("sampler"),
            "materials": {"type": "object", "additionalProperties": _ref("material")},
            "groups": {
                "type": "object",
                "additionalProperties": {"type": "array", "items": _ref("shape")},
                "description": "shapes that instances place together",
            },
            "shapes": {"type": "array", "items": _ref("shape")},
            "lights": {"type": "array", "items": _ref("light")},
            "spp": {"type": "integer", "minimum": 1, "description": "samples of a pixel"},
            "noise": {
                "type": "number",
                "exclusiveMinimum": 0,
                "description": "below which a pixel gets no more samples",
            },
            "seed": {"type": "integer", "description": "of the random numbers"},
        },
        "$defs": defs,
    }


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _category(category: str) -> Schema:
    return {"oneOf": [_kind(cls) for cls in KINDS[category]]}


def _kind(cls: type[Kind]) -> Schema:
    """An object of one kind."""
    defaults = {field.name: default(field) for field in dataclasses.fields(cls)}
    properties: Schema = {"type": {"const": cls.kind}}
    for name, param in params(cls).items():
        properties[name] = _described(name, param, defaults[name])
    if {"eta", "k"} <= properties.keys():
        named: Schema = {"enum": list(spectra.metals())}
        either = [named, _object({"file": INDEX_FILE}, ["file"])]
        properties["metal"] = {"anyOf": either, "description": "stands for eta and k"}
    if "vertices" in properties:
        properties["file"] = {"type": "string", "description": "a mesh, in place of the arrays"}
    if "points" in properties:
        rows = "lines of x y z radius, blank ones between strands, in place of points and lengths"
        properties["file"] = {"type": "string", "description": rows}
    if "centers" in properties:
        arrays = "centers, radii and attributes by their names as .npz, in place of those"
        properties["file"] = {"type": "string", "description": arrays}
    if "group" in properties:
        several = "matrices (n, 3, 4) as .npy: an instance for each, before `to_world`"
        properties["file"] = {"type": "string", "description": several}
    summary = (cls.__doc__ or "").strip().splitlines()[0]
    return {
        "type": "object",
        "description": summary,
        "properties": properties,
        "required": ["type"],
        "additionalProperties": False,
    }


def _untyped(cls: type[Kind]) -> Schema:
    """An object that is always of one kind."""
    made = _kind(cls)
    del made["properties"]["type"], made["required"]
    return made


def _described(name: str, param: Param, value: Any) -> Schema:
    made = _value(name, param, value)
    doc = f"{param.doc} [{param.unit}]" if param.unit else param.doc
    shown = value.tolist() if isinstance(value, np.ndarray) else value
    shown = list(shown) if isinstance(shown, tuple) else shown
    plain = isinstance(shown, (bool, int, float, str, list))
    return {"description": doc, **({"default": shown} if plain else {}), **made}


def _value(name: str, param: Param, value: Any) -> Schema:
    if param.role == "flag":
        return {"type": "boolean"}
    if param.role == "choice":
        return {"enum": [*param.choices, *((None,) if param.optional else ())]}
    if param.role in SPECTRUM_ROLES:
        made = _ref(f"spectrum_{param.role}")
        return {"anyOf": [made, _ref("texture")]} if param.textured else made
    if param.role == "real":
        limits = {"minimum": param.low, "maximum": param.high}
        number = {"type": "number", **{k: v for k, v in limits.items() if math.isfinite(v)}}
        return {"anyOf": [number, _ref("texture")]} if param.textured else number
    if param.role == "reradiation":
        return _ref("reradiation")
    if param.role == "orders":
        return {**NUMBERS, "minItems": 1, "maxItems": 2 * ORDERS + 1}
    if param.role == "layers":
        return {"type": "array", "items": _ref("layer")}
    return _host(name, value)


def _host(name: str, value: Any) -> Schema:
    """What only the host needs, by its name or by the type of its default."""
    if name in ARRAYS:
        return _rows(*ARRAYS[name])
    if name == "points":
        return _rows(4)
    if name == "centers":
        return _rows(3)
    if name == "radii":
        return {"anyOf": [{"type": "number"}, NUMBERS]}
    if name == "lengths":
        return {"type": "array", "items": {"type": "integer", "minimum": 2}}
    if name == "attributes":
        rows = {"anyOf": [_rows(1), _rows(3)]}
        begins = {"pattern": f"^({'|'.join(ATTRIBUTES)})"}
        return {"type": "object", "propertyNames": begins, "additionalProperties": rows}
    if name == "image":
        name_of_file = {"type": "string"}
        six = {"type": "array", "items": name_of_file, "minItems": 6, "maxItems": 6}
        return {"anyOf": [name_of_file, six]}
    if name == "sensor":
        return {"anyOf": [{"enum": list(OBSERVERS)}, _sensor()]}
    if name == "white_balance":
        low, high = TEMPERATURES
        lights = {"enum": ["none", *spectra.illuminants()]}
        kelvin = {"type": "number", "minimum": low, "maximum": high, "description": "[K]"}
        return {"anyOf": [lights, kelvin, {**NUMBERS, "minItems": 2, "maxItems": 2}]}
    if name == "emission":
        return {"anyOf": [_ref("light"), {"type": "null"}]}
    if name == "crop":
        whole = {"type": "integer", "minimum": 0}
        return {"type": "array", "items": whole, "minItems": 4, "maxItems": 4}
    if name == "map":
        return _ref("texture")
    if name == "group":
        return {"type": "string"}
    if name == "back" or isinstance(value, materials.Material):
        name_in_table = {"type": "string", "description": "a name in the scene's materials"}
        return {"anyOf": [_ref("material"), name_in_table]}
    if isinstance(value, Kind):
        return _ref(next(c for c, base in BASES.items() if isinstance(value, base)))
    if isinstance(value, np.ndarray):
        return _ref("transform")
    if isinstance(value, tuple):
        return {"type": "array", "items": {"type": "string"}} if _names(value) else TRIPLE
    names = {bool: "boolean", int: "integer", float: "number", str: "string"}
    return {"type": names[type(value)]}


def _sensor() -> Schema:
    curve = {"anyOf": [{"type": "number"}, _ref("spectrum")]}
    curves = {"type": "array", "items": curve, "minItems": 3, "maxItems": 3}
    matrix = {**_rows(3, count=3), "description": "from responses to XYZ; fitted if not given"}
    file = {"type": "string", "description": "wavelengths [nm] and three values a row"}
    return {
        "anyOf": [
            _object({"file": file, "matrix": matrix}, ["file"]),
            _object({"curves": curves, "matrix": matrix}, ["curves"]),
        ]
    }


def _names(value: tuple[Any, ...]) -> bool:
    return bool(value) and isinstance(value[0], str)


def _spectrum(role: str) -> Schema:
    number: Schema = {"type": "number"} if role == "factor" else {"type": "number", "minimum": 0}
    one_of = [number, {**TRIPLE, "description": "linear Rec. 709"}, _ref("spectrum")]
    if role == "reflectance":
        number["maximum"] = 1
    elif role == "emission":
        one_of.append({"enum": list(spectra.illuminants()), "description": "an illuminant"})
    elif role == "index":
        one_of.append({"enum": list(spectra.glasses()), "description": "a glass or liquid"})
    return {"anyOf": one_of}


def _typed_spectra() -> Schema:
    made = [
        _object({"file": INDEX_FILE}, ["file"]),
        _object({"values": {**_rows(2), "description": "[nm, value]"}}, ["values"]),
    ]
    for kind, cls in SPECTRA.items():
        properties: Schema = {"type": {"const": kind}}
        needed = ["type"]
        for field in dataclasses.fields(cls):  # type: ignore[arg-type]
            properties[field.name] = _spectrum_field(field.name, str(field.type))
            if field.default is dataclasses.MISSING:
                needed.append(field.name)
        made.append(_object(properties, needed))
    return {"anyOf": made}


def _spectrum_field(name: str, written: str) -> Schema:
    if name == "outside":
        return {"enum": ["zero", "hold"]}
    if name == "name":
        return {"enum": list(spectra.illuminants())}
    if written == "bool":
        return {"type": "boolean"}
    return NUMBERS if "tuple" in written else {"type": "number"}


def _reradiation() -> Schema:
    file = {"type": "string", "description": "a BFC matrix, or a table of values [1/nm]"}
    kinds = [{"type": {"const": kind}} for kind in RERADIATIONS]
    shapes = dict.fromkeys(("absorption", "emission"), _ref("spectrum_reflectance"))
    share = {"type": "number", "minimum": 0, "maximum": 1}
    table = {"out": NUMBERS, "into": NUMBERS, "rows": {"type": "array", "items": NUMBERS}}
    return {
        "anyOf": [
            {"type": "null"},
            _object({"file": file}, ["file"]),
            _object({**kinds[0], **shapes, "quantum_yield": share}, ["type", *shapes]),
            _object({**kinds[1], **table}, ["type", *table]),
        ]
    }


def _step() -> Schema:
    look_at = _object(dict.fromkeys(("origin", "target", "up"), TRIPLE), ["origin", "target", "up"])
    turn = _object({"axis": TRIPLE, "angle": {"type": "number"}}, ["axis", "angle"])
    steps = {"translate": TRIPLE, "scale": ANY_OF_SCALE, "rotate": turn, "look_at": look_at}
    return {"oneOf": [_object({name: made}, [name]) for name, made in steps.items()]}


def _transform() -> Schema:
    matrices = [_rows(size, count=size) for size in (4, 3)]
    return {"anyOf": [*matrices, _ref("step"), {"type": "array", "items": _ref("step")}]}


def _object(properties: Schema, required: list[str]) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def text() -> str:
    """Return the schema as the published file has it."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "scenes/schema.json")
    target.write_text(text(), "utf-8")
