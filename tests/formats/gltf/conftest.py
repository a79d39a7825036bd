"""Small glTF documents for the tests."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt.formats import load
from clpt.scene import Scene

TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))


class Builder:
    """A document that grows: accessors are put into one buffer behind each other."""

    def __init__(self, **top: Any):
        self.data = bytearray()
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            **top,
        }

    def accessor(self, values: Any, dtype: str = "f4", **more: Any) -> int:
        """Append an accessor of (n,) or (n, width) values; its number."""
        array = np.ascontiguousarray(values, "<" + dtype)
        rows = array.reshape(len(array), -1)
        view = self.view(rows.tobytes())
        self.json["accessors"].append(
            {
                "bufferView": view,
                "componentType": COMPONENTS[dtype],
                "count": len(rows),
                "type": TYPES[rows.shape[1]],
                **more,
            }
        )
        return len(self.json["accessors"]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        """Append a buffer view; its number."""
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        self.json["bufferViews"].append(view)
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def mesh(self, vertices: Any = TRIANGLE, **more: Any) -> Builder:
        """Append a mesh of one primitive; `attributes` in `more` come beside POSITION."""
        attributes = {"POSITION": self.accessor(vertices), **more.pop("attributes", {})}
        primitive = {"attributes": attributes, **more}
        self.json.setdefault("meshes", []).append({"primitives": [primitive]})
        return self

    def text(self) -> str:
        """The document as JSON, its buffer in a data URI."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        buffers = [{"byteLength": len(self.data), "uri": uri}] if self.data else []
        return json.dumps({"buffers": buffers, **self.json})

    def glb(self) -> bytes:
        """The document as a binary file."""
        chunk = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        text = json.dumps({"buffers": [{"byteLength": len(chunk)}], **self.json}).encode()
        text += b" " * (-len(text) % 4)
        parts = [(b"JSON", text), (b"BIN\0", chunk)]
        body = b"".join(len(d).to_bytes(4, "little") + kind + d for kind, d in parts)
        head = b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little")
        return head + body


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Scene]:
    """Write a document, or text, and load it."""

    def of(content: Builder | str | bytes, name: str = "a.gltf", **variables: Any) -> Scene:
        if isinstance(content, Builder):
            content = content.text()
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return load(path, **variables)

    return of


@pytest.fixture
def build() -> type[Builder]:
    """The class of documents that grow."""
    return Builder
