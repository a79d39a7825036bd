"""The parts that the schema of scene.json is made of."""

from __future__ import annotations

from typing import Any

from clpt.scene.textures.graph import TEXTURE
from clpt.scene.textures.nodes import NODES as NODES_OF_GRAPHS

Schema = dict[str, Any]

STRING: Schema = {"type": "string"}
NUMBER: Schema = {"type": "number"}
NUMBERS: Schema = {"type": "array", "items": NUMBER}
TRIPLE: Schema = {**NUMBERS, "minItems": 3, "maxItems": 3}


def ref(name: str) -> Schema:
    """Return a reference to a definition of the schema."""
    return {"$ref": f"#/$defs/{name}"}


def rows(width: int, item: str = "number", count: int = 0) -> Schema:
    """Return an array of rows of numbers, of `count` rows unless that is 0."""
    row = {"type": "array", "items": {"type": item}, "minItems": width, "maxItems": width}
    exact = {"minItems": count, "maxItems": count} if count else {}
    return {"type": "array", "items": row, **exact}


def object_of(properties: Schema, required: list[str], description: str = "") -> Schema:
    """Return an object that has these properties and no others."""
    return {
        "type": "object",
        **({"description": description} if description else {}),
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


VALUE: Schema = {"anyOf": [NUMBER, STRING, {**NUMBERS, "minItems": 1, "maxItems": 4}]}


NODES: Schema = {
    "type": "object",
    "required": ["type"],
    "properties": {
        "type": {"enum": [*NODES_OF_GRAPHS, TEXTURE]},
        "stops": {"type": "array", "items": NUMBERS, "minItems": 2},
    },
    "additionalProperties": VALUE,
}
INDEX_FILE_OBJECT = object_of(
    {"file": {**STRING, "description": "columns, or a page of refractiveindex.info"}}, ["file"]
)
