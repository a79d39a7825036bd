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
        color3f inputs:default = (0.25, 0.5, 1)
        color3f outputs:out
    }"""
    mesh, _ = _mesh(stage, "color3f inputs:base_color.connect = </Look/G.outputs:out>", nodes)
    color = _leaf(mesh).base_color
    assert isinstance(color, MeshAttribute) and color.name == "vertex_tone"
    assert np.array_equal(mesh.attributes["vertex_tone"], [(0.25, 0.5, 1.0)] * 4)


DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.39" colorspace="lin_rec709">
  <nodegraph name="G">
    <image name="i" type="color3"><input name="file" type="filename" value="tex/a.png"
      colorspace="srgb_texture" /></image>
    <output name="out" type="color3" nodename="i" />
  </nodegraph>
  <open_pbr_surface name="S" type="surfaceshader">
    <input name="base_color" type="color3" nodegraph="G" output="out" />
    <input name="specular_roughness" type="float" value="0.25" /></open_pbr_surface>
  <surfacematerial name="M" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="S" /></surfacematerial>
</materialx>
"""
NAMING = f"""
def Scope "Looks" (
    prepend references = @{{}}@</MaterialX/Materials>
) {{{{
}}}}
def Mesh "A" (
    apiSchemas = ["MaterialBindingAPI"]
) {{{{
    {SQUARE}
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "vertex"
    )
    rel material:binding = </Looks/M>
}}}}
"""


def test_a_stage_names_a_document_of_materialx(stage: Loader, tmp_path: Path) -> None:
    """`usd-core` has no plugin for it. A document that is not there has a warning."""
    pytest.importorskip("MaterialX")
    folder = tmp_path / "looks"
    (folder / "tex").mkdir(parents=True)
    Image.fromarray(np.full((1, 1, 3), 188, np.uint8)).save(folder / "tex/a.png")
    (folder / "look.mtlx").write_text(DOCUMENT)
    for _ in range(2):  # the second time the root layer is read anew
        scene = stage(NAMING.format("looks/look.mtlx"))
        shape = next(s for s in scene.shapes if s.name == "A")
        surface = shape.material.front
        assert isinstance(surface, Openpbr)
        assert surface.name == "M"
        assert surface.specular_roughness == 0.25
        assert surface.base_color.pixels("reflectance").mean() == pytest.approx(0.5, abs=0.01)
        assert shape.uvs is not None
        assert not scene.warnings
    (told,) = stage(NAMING.format("looks/other.mtlx")).warnings
    assert "/Looks: Could not open asset @looks/other.mtlx@" in told.replace(str(tmp_path), "@")
