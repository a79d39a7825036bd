"""The scenes of the folder scenes: the list of them, and whether their glass is closed."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh

import clpt
from clpt.scene.shapes import Mesh

ROOT = Path(__file__).resolve().parents[1]
GLASS = ("dielectric", "rough_dielectric")
FILES = sorted(
    f
    for f in ROOT.glob("scenes/*/scene.json")
    if any(f'"type": "{kind}"' in f.read_text("utf-8") for kind in GLASS)
    and f.parent.name != "atrium"  # whose meshes stand in no checkout
)


def test_the_readme_lists_every_scene() -> None:
    text = (ROOT / "scenes/README.md").read_text("utf-8")
    names = [f.parent.name for f in ROOT.glob("scenes/*/scene.json")]
    assert [name for name in names if f"[{name}]({name})" not in text] == []


def bodies(path: Path) -> dict[str, trimesh.Trimesh]:
    """The meshes of a scene around what has one index, by the index, with the front outside.

    They are the surfaces whose inside has the index, and the backs of those whose outside has it.
    """
    scene, named = clpt.load(path), json.loads(path.read_text("utf-8"))["materials"]
    parts = defaultdict(list)
    for shape in scene.shapes:
        entry = named.get(getattr(shape.material, "name", ""), {})
        if isinstance(shape, Mesh) and entry.get("type") in GLASS:
            made = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
            made.apply_transform(shape.to_world)
            parts[json.dumps(entry.get("int_ior"))].append(made)
            if "ext_ior" in entry:
                back = made.copy()
                back.invert()
                parts[json.dumps(entry["ext_ior"])].append(back)
    return {index: trimesh.util.concatenate(made) for index, made in parts.items()}


@pytest.mark.parametrize("path", FILES, ids=lambda f: f.parent.name)
def test_glass_and_liquids_are_closed(path: Path) -> None:
    for index, body in bodies(path).items():
        size = np.ptp(body.vertices, axis=0).max()
        body.merge_vertices(merge_norm=True, digits_vertex=int(6 - np.floor(np.log10(size))))
        assert body.is_watertight, f"index {index}: an edge has one side only"
        assert body.is_winding_consistent, f"index {index}: fronts and backs meet"
        assert body.volume > 0.0, f"index {index}: the front is inside"
