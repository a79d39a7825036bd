"""Graphs of nodes come back from a stage: each node of the table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt.render.spectra.find import Look
from clpt.scene import materials, shapes
from clpt.scene.roles import REAL
from clpt.scene.textures import Bitmap, Graph
from clpt.scene.textures.nodes import NODES
from tests.formats.usd.test_export import again, openpbr_of, with_shape
from tests.kernels.test_graphs import MOVED, NAMES

pytest.importorskip("pxr")
pytest.importorskip("MaterialX")

import MaterialX as materialx

from clpt.formats.materialx.graph import Probing
from clpt.formats.usd.export_graphs import ABSENT, LETTERS, SIGNATURES

LOOK = Look(spectral=False, lo=360.0, hi=830.0)
WIDTHS = {"float": 1, "vector2": 2, "vector3": 3, "color3": 3, "color4": 4}


def graphs() -> dict[str, Graph]:
    """Graphs of a node each, of numbers and of three channels, whose inputs vary."""
    found = {}
    for kind, declared in NODES.items():
        if kind in ABSENT:
            continue
        letters = SIGNATURES.get(kind, "T" * (len(declared.inputs) + 1))
        for wide in (1, 3):
            if kind.startswith("combine") and wide == 3:
                continue
            nodes: dict[str, Any] = {**MOVED}
            node: dict[str, Any] = {"type": kind}
            for name, key, letter in zip(NAMES, declared.inputs, letters, strict=False):
                width = WIDTHS.get(LETTERS.get(letter, ""), 3 if letter == "W" else wide)
                nodes[f"{name}0"] = {"type": "convert", "in": name, "channels": width}
                node[key] = 2.0 if letter == "i" else f"{name}0"
            if "channels" in declared.settings and not kind.startswith("cell"):
                node["channels"] = wide
            found[f"{kind}{wide}"] = Graph(nodes={**nodes, "node": node})
    for number in range(3):
        stops = [
            [-0.5, 0.1, 0.2, 0.3],
            [0.1, 0.9, 0.5, 0.1],
            [0.1, 0.0, 1.0, 0.0],
            [0.8, 1.0, 1.0, 0.5],
        ]
        node = {"type": "ramp", "in": "a0", "stops": stops, "interpolation": number}
        nodes = {**MOVED, "a0": {"type": "extract", "in": "a"}, "node": node}
        found[f"ramp of kind {number}"] = Graph(nodes=nodes)
    return found


def values(graph: Any) -> np.ndarray:
    value = graph.evaluated(Probing(graph))
    value = np.broadcast_to(value, (16, value.shape[-1]))
    return (
        np.repeat(value, 3, axis=1)
        if value.shape[1] == 1
        else np.pad(value, ((0, 0), (0, 2)))[:, :3]
    )


def test_each_node_comes_back(tmp_path: Path) -> None:
    made = graphs()
    rectangles = [
        shapes.Rectangle(material=materials.Openpbr(base_color=graph, name=f"m{i}"))
        for i, graph in enumerate(made.values())
    ]
    read, lost = again(with_shape(*rectangles), tmp_path)
    assert not lost and not read.warnings
    wrong = []
    for (name, graph), shape in zip(made.items(), read.shapes, strict=True):
        found = openpbr_of(with_shape(shape)).base_color
        if not np.allclose(values(found), values(graph), atol=1e-5, rtol=1e-5):
            wrong.append(name)
    assert not wrong


def test_images_and_numbers_of_a_graph(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (4, 6, 4), np.uint8)
    nodes = {
        "bend": {"type": "noise2d", "channels": 2},
        "place": {"type": "add", "in1": "texcoord", "in2": "bend"},
        "image": {"type": "texture", "texcoord": "place", "channels": 4},
        "alpha": {"type": "extract", "in": "image", "index": 3},
    }
    image = Bitmap(image=pixels, to_uv=np.diag([2.0, 3.0, 1.0]), wrap="mirror")
    color, rough = (Graph(nodes=nodes, output=end, textures=[image]) for end in ("image", "alpha"))
    surface = materials.Openpbr(base_color=color, specular_roughness=rough)
    read, lost = again(with_shape(shapes.Rectangle(material=surface)), tmp_path)
    assert not lost and not read.warnings
    found = openpbr_of(read)
    uv = np.random.default_rng(2).uniform(-2.0, 2.0, (1, 200, 2))
    seen, expected = (g.brightness_at(LOOK, uv, np.zeros(1), {}) for g in (found.base_color, color))
    np.testing.assert_allclose(seen, expected, atol=1e-3)
    assert all(texture.wrap == "mirror" for texture in found.base_color.textures)
    alpha = found.specular_roughness.textures[-1].pixels(REAL)[..., 0]
    np.testing.assert_allclose(alpha, pixels[..., 3] / 255.0, atol=1e-3)


def test_materialx_has_all_other_nodes() -> None:
    document = materialx.createDocument()
    folders = materialx.getDefaultDataLibraryFolders(), materialx.getDefaultDataSearchPath()
    materialx.loadLibraries(*folders, document)
    declared = {definition.getNodeString() for definition in document.getNodeDefs()}
    assert {kind for kind in NODES if kind not in declared} == ABSENT


def test_nodes_that_materialx_does_not_have_are_lost(tmp_path: Path) -> None:
    for kind in sorted(ABSENT):
        varying = next(iter(NODES[kind].inputs))
        nodes = {"x": {"type": "extract", "in": "position"}, "node": {"type": kind, varying: "x"}}
        surface = materials.Openpbr(base_color=Graph(nodes=nodes))
        _, lost = again(with_shape(shapes.Rectangle(material=surface)), tmp_path)
        assert any(kind in text for text in lost)


def test_what_a_stage_cannot_say_is_lost(tmp_path: Path) -> None:
    graph = Graph(
        nodes={
            "a": {"type": "extract", "in": "position"},
            "b": {"type": "fractal3d", "octaves": "a"},
        }
    )
    surface = materials.Openpbr(base_color=graph)
    read, lost = again(with_shape(shapes.Rectangle(material=surface)), tmp_path)
    assert any("octaves that vary" in text for text in lost)
    assert openpbr_of(read).base_color.r == 0.5
