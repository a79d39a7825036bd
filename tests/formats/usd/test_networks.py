"""Networks of MaterialX on a stage: OpenPBR with an image, primvars, and what is inside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clpt.formats.materialx.graph import Probing
from clpt.scene.materials import Openpbr, parts
from clpt.scene.shapes import Mesh
from clpt.scene.textures import MeshAttribute
from tests.formats.usd.conftest import SQUARE, SUN, Loader

pytest.importorskip("pxr")
pytest.importorskip("MaterialX")

STAGE = """
def Material "Look" {{
    token outputs:mtlx:surface.connect = </Look/S.outputs:out>
    token outputs:surface.connect = </Look/P.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "ND_open_pbr_surface_surfaceshader"
        {inputs}
        token outputs:out
    }}
    def Shader "P" {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }}
    {nodes}
}}
def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    {square}
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </Look>
}}
"""


def _mesh(stage: Loader, inputs: str, nodes: str = "") -> tuple[Mesh, list[str]]:
    text = STAGE.format(inputs=inputs, nodes=nodes, square=SQUARE)
    scene = stage(text + SUN)
    return next(s for s in scene.shapes if s.name == "M"), scene.warnings


def _leaf(mesh: Mesh) -> Openpbr:
    return next(part for part in parts(mesh.material) if isinstance(part, Openpbr))


def test_an_image_under_arithmetic(stage: Loader, tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 2, 3), 128, np.uint8)).save(tmp_path / "a.png")
    nodes = """
    def Shader "I" {
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @a.png@ (colorSpace = "srgb_texture")
        color3f outputs:out
    }
    def Shader "D" {
        uniform token info:id = "ND_multiply_color3FA"
        color3f inputs:in1.connect = </Look/I.outputs:out>
        float inputs:in2 = 0.5
        color3f outputs:out
    }"""
    inputs = "color3f inputs:base_color.connect = </Look/D.outputs:out>"
    mesh, warnings = _mesh(stage, inputs + "\nfloat inputs:coat_weight = 0.25", nodes)
    leaf = _leaf(mesh)
    assert not warnings and leaf.coat_weight == 0.25 and leaf.name == "Look"
    graph = leaf.base_color
    assert [step.kind for step in graph.steps] == ["texture", "multiply"]
    found = graph.evaluated(Probing(graph))
    np.testing.assert_allclose(found, 0.5 * 0.21586, rtol=1e-3)


def test_what_is_inside_and_what_is_emitted(stage: Loader) -> None:
    inputs = "float inputs:subsurface_weight = 1\nfloat inputs:emission_luminance = 2"
    mesh, _ = _mesh(stage, inputs)
    assert mesh.interior is not None and mesh.emission is not None
    assert _leaf(mesh).subsurface_inside


def test_a_primvar(stage: Loader) -> None:
    nodes = """
    def Shader "G" {
        uniform token info:id = "ND_geompropvalue_color3"
        string inputs:geomprop = "tone"
        color3f outputs:out
    }"""
    mesh, _ = _mesh(stage, "color3f inputs:base_color.connect = </Look/G.outputs:out>", nodes)
    color = _leaf(mesh).base_color
    assert isinstance(color, MeshAttribute) and color.name == "vertex_tone"
    assert np.shape(mesh.attributes["vertex_tone"]) == (4, 3)
