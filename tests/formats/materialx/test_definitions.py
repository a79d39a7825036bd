"""All definitions of MaterialX's library: docs/materialx.md says which are not read."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt import images
from clpt.formats.materialx import document
from clpt.formats.materialx.graph import Graph, LeftOut
from clpt.formats.materialx.nodes import READERS
from clpt.scene.textures import MeshAttribute

pytest.importorskip("MaterialX")
PAGE = Path(__file__).parents[3] / "docs" / "materialx.md"
VALUES = {
    "float", "color3", "color4", "vector2", "vector3", "vector4", "integer", "boolean",
}  # fmt: skip


class _Host:
    def warn(self, message: str, path: str) -> None:
        pass

    def image(self, asset: Any, path: str) -> images.Stored:
        return images.Stored(np.full((2, 2, 4), 0.25, np.float32), encoded=False)

    def attribute(self, name: str, default: tuple[float, ...]) -> MeshAttribute:
        return MeshAttribute(name=f"vertex_{name}")

    def uv_mapping(self, name: str) -> str:
        return "uv"


class _Node:
    """A node of a definition that nothing is connected to."""

    def __init__(self, definition: Any):
        self.definition = definition
        self.kind = self.path = definition.getName()

    def source(self, name: str) -> Any:
        return document._of_surface(self.definition, name, self.path)

    def value(self, name: str, default: Any = None) -> Any:
        found = self.definition.getActiveInput(name)
        if found is None or found.getDefaultGeomPropString():
            return default
        if found.getType().startswith("matrix"):
            return tuple(map(float, found.getValueString().split(",")))
        value = found.getValue()
        if value is None:
            return "a.png" if found.getType() == "filename" else default
        return value.asTuple() if hasattr(value, "asTuple") else value

    def color_space(self, name: str) -> str:
        return ""


def test_the_page_names_what_is_refused() -> None:
    """Of values: those of surfaces, of light and of matrices are other tables of the page."""
    kinds: Counter[str] = Counter()
    refused, read = set(), set()
    for definition in document.standard().getNodeDefs():
        outputs = definition.getActiveOutputs()
        if (outputs[0].getType() if outputs else definition.getType()) not in VALUES:
            kinds["other"] += 1
            continue
        node, graph = _Node(definition), Graph(_Host(), READERS, document.inner)
        try:
            value = graph.output(node, outputs[0].getName())
            read.add(definition.getNodeString())
            kinds["folded" if value.numbers is not None else "compiled"] += 1
        except LeftOut:
            refused.add(definition.getNodeString())
            kinds["refused"] += 1
    text = PAGE.read_text("utf-8")
    (row,) = re.findall(r"^\| refused \| (.*) \|$", text, re.MULTILINE)
    apart = {"bump", "normalmap", "gltf_normalmap", "heighttonormal"}  # around the material
    assert set(re.findall(r"`(\w+)`", row)) == refused - read - apart
    counts = re.search(r"(\d+) definitions of values, (\d+)", text)
    assert counts is not None
    values = kinds["folded"] + kinds["compiled"] + kinds["refused"]
    assert [int(n) for n in counts.groups()] == [values, kinds["refused"]]
