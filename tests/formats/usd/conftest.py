"""Small stages for the tests, as text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from clpt.formats import load
from clpt.render.flow.check import check
from clpt.scene import Scene

Loader = Callable[..., Scene]
SQUARE = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
SUN = 'def DistantLight "Sun" { float inputs:intensity = 1; bool inputs:normalize = 1 }'


def usda(text: str, head: str = "") -> str:
    """Return the text of a file, in metres; a prim may end in the line of its last attribute."""
    ended = text.replace(" }", "\n}\n")
    unit = "" if "metersPerUnit" in head else "metersPerUnit = 1\n"
    return f"#usda 1.0\n(\n{unit}{head}\n)\n{ended}"


@pytest.fixture
def stage(tmp_path: Path) -> Loader:
    """Return a function that loads a stage of a text, and checks that it can be rendered."""

    def loaded(text: str, head: str = "", **variables: Any) -> Scene:
        file = tmp_path / "stage.usda"
        file.write_text(usda(text, head), encoding="utf-8")
        scene = load(file, **variables)
        check(scene)
        return scene

    return loaded
