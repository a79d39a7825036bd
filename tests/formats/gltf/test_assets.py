"""Files that others made: triangles and bounds as other programs count them."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest
import trimesh

from clpt.cli.files.scene_contents import summary
from clpt.formats import gltf, load
from clpt.scene import studio

# Where expected.json has bounds before sparse values and morph targets; Fox there is without skin.
KNOWN = {
    "SimpleSparseAccessor": [[0, 0, 0], [6, 4, 0]],
    "morph-primitives": [[-0.5, 0, -0.5], [0.5, 0.1, 0.5]],
}


def test_triangles_and_bounds(assets):
    expected = json.loads((assets / "expected.json").read_text())["gltf"]
    for name, known in expected.items():
        found = summary(load(assets / name))
        for key in ("triangles", "triangles_instanced"):
            assert found[key] == known[key], (name, key)
        bounds = KNOWN.get(name.split("/")[1], known.get("bounds"))
        if found["triangles"] == 0 or bounds is None or "Fox" in name:
            continue
        atol = 1e-5 + 2e-5 * np.abs(bounds).max()
        assert np.allclose(found["bounds"], bounds, atol=atol), name


def test_many_copies_are_instances(assets):
    file = assets / "gltf" / "derived-gpu-instancing" / "suzanne_instances.glb"
    placed = load(file).shapes
    assert len(placed) == 27 and len({id(shape.group) for shape in placed}) == 1
    copies = gltf.read_mesh(file).meshes
    assert np.allclose(studio.world_bounds(placed), studio.world_bounds(copies), atol=1e-5)


def test_cameras_and_lights(assets):
    found = summary(load(assets / "gltf" / "derived-extension-grid" / "extension_grid.glb"))
    assert found["cameras"] == ["perspective cam", "orthographic ortho"]
    assert found["lights"] == {"area": 1, "directional": 1, "point": 1, "spot": 1}
    assert (found["film"]["width"], found["film"]["height"]) == (768, 576)


@pytest.mark.slow
def test_a_million_triangles_take_seconds(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=8)
    (tmp_path / "ball.glb").write_bytes(trimesh.exchange.gltf.export_glb(ball.scene()))
    start = time.perf_counter()
    assert len(load(tmp_path / "ball.glb").shapes[0].faces) == 1_310_720
    assert time.perf_counter() - start < 20.0
