"""Scenes of others: all shapes, triangles and lights that were counted without clpt."""

from __future__ import annotations

import json
import time

import pytest

from clpt.formats import load
from clpt.scene import shapes

SCENES = (
    "bathroom2/bathroom2", "cornell-box/cornell-box", "cornell-box/cornell-box-silver",
    "cornell-box/cornell-box-specular", "cornell-box/cornell-box-volume", "cornell-box/smallpt",
    "cornell-box/volumetric-caustic", "living-room/living-room",
    "material-testball/material-testball", "staircase/staircase", "veach-mis/veach-mis",
    "veach-mis/veach-mis-colorized",
)  # fmt: skip
EXPLAINED = ("triangles without area", "since it has no area", "participating media are left out")


@pytest.mark.parametrize("name", SCENES)
def test_counts(assets, name):
    counted = json.loads((assets / "expected.json").read_text())["pbrt"][f"pbrt/{name}.pbrt"]
    start = time.process_time()
    scene = load(assets / "pbrt" / f"{name}.pbrt")
    assert time.process_time() - start < 15.0  # a million triangles take two seconds
    assert len(scene.shapes) == pytest.approx(counted["shapes"], rel=0.03)  # some have no area
    flat = sum(len(s.faces) for s in scene.shapes if isinstance(s, shapes.Mesh))
    assert flat == pytest.approx(counted["ply_triangles"] + counted["inline_triangles"], rel=1e-3)
    lights = len(scene.lights) + sum(s.emission is not None for s in scene.shapes)
    assert lights >= counted["lights"]
    unexplained = [w for w in scene.warnings if not any(part in w for part in EXPLAINED)]
    assert unexplained == []


def test_files_in_files(assets):
    """Two files with the shapes, named by a third."""
    scene = load(assets / "pbrt" / "material-testball" / "volumetric-sequance.pbrt")
    assert len(scene.shapes) == 1 + 25
