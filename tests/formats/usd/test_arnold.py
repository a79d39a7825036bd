"""Shaders of Arnold that are nodes of MaterialX under other names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clpt.scene.materials import Openpbr, parts
from tests.formats.usd.conftest import SQUARE, SUN, Loader

pytest.importorskip("pxr")

BOUND = f"""def Mesh "M" (apiSchemas = ["MaterialBindingAPI"]) {{
    {SQUARE}
    rel material:binding = </Look>
}}
"""
ARNOLD = """
    def Material "Look" {
        token outputs:arnold:surface.connect = </Look/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "%s"
            %s
            token outputs:surface
        }
        def Shader "T" {
            uniform token info:id = "%s"
            %s
            color3f outputs:out
            float outputs:g
        }
    }
    """


def _of_arnold(stage: Loader, *text: str) -> Any:
    scene = stage(ARNOLD % text + BOUND + SUN)
    assert not scene.warnings
    return scene.shapes[0]


def test_images_of_arnold(stage: Loader, tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 2, 3), 128, np.uint8)).save(tmp_path / "a.png")
    flat = "arnold:flat", "color3f inputs:color.connect = </Look/T.outputs:out>", "arnold:image"
    named = 'string inputs:filename = "a.png"\nstring inputs:twrap = "black"'
    glow = _of_arnold(stage, *flat, named).emission.radiance
    assert not glow.raw and glow.wraps == ("repeat", "zero")
    asset = 'asset inputs:filename = @a.png@\nstring inputs:color_space = "Raw"'
    assert _of_arnold(stage, *flat, asset).emission.radiance.raw


def test_a_channel_of_an_image_of_arnold(stage: Loader, tmp_path: Path) -> None:
    pytest.importorskip("MaterialX", reason="its library translates standard_surface")
    Image.fromarray(np.full((2, 2, 3), (255, 64, 0), np.uint8)).save(tmp_path / "a.png")
    rough = "float inputs:specular_roughness.connect = </Look/T.outputs:g>"
    raw = 'asset inputs:filename = @a.png@\nstring inputs:color_space = "Raw"'
    shape = _of_arnold(stage, "arnold:standard_surface", rough, "arnold:image", raw)
    base = next(part for part in parts(shape.material) if isinstance(part, Openpbr))
    assert base.specular_roughness.channel == "g"


def test_checkerboards_of_arnold_have_two_squares_for_each_count(stage: Loader) -> None:
    pytest.importorskip("MaterialX", reason="its library has the checkerboard")
    squares = """color3f inputs:color1 = (0, 0, 0)
            color3f inputs:color2 = (1, 0.5, 0.25)
            float inputs:u_frequency = 2
            float inputs:v_frequency = 1"""
    color = "color3f inputs:color.connect = </Look/T.outputs:out>"
    shape = _of_arnold(stage, "arnold:flat", color, "arnold:checkerboard", squares)

    class At:
        """The first, second, third and fifth square of a row, and the second row."""

        def source(self, name: str) -> Any:
            return np.array([[0.1, 0.1], [0.3, 0.1], [0.6, 0.1], [1.1, 0.1], [0.1, 0.6]])

    found = shape.emission.radiance.evaluated(At())
    light, dark = (1.0, 0.5, 0.25), (0.0, 0.0, 0.0)
    assert np.allclose(found, [light, dark, light, light, dark])


def test_lambert_and_products_of_arnold(stage: Loader) -> None:
    pytest.importorskip("MaterialX", reason="its library translates standard_surface")
    color = "color3f inputs:Kd_color.connect = </Look/T.outputs:out>\nfloat inputs:Kd = 0.5"
    pair = "color3f inputs:input1 = (0.5, 1, 0)\ncolor3f inputs:input2 = (0.5, 0.25, 1)"
    shape = _of_arnold(stage, "arnold:lambert", color, "arnold:multiply", pair)
    base = next(part for part in parts(shape.material) if isinstance(part, Openpbr))
    assert (base.base_weight, base.specular_weight) == (0.5, 0.0)
    assert np.allclose((base.base_color.r, base.base_color.g, base.base_color.b), (0.25, 0.25, 0.0))


def test_data_of_a_mesh_in_arnold_and_what_stands_for_it(stage: Loader) -> None:
    named = 'string inputs:attribute = "tone"\ncolor3f inputs:default = (0.5, 0.25, 0.125)'
    color = "color3f inputs:color.connect = </Look/T.outputs:out>"
    shape = _of_arnold(stage, "arnold:flat", color, "arnold:user_data_rgb", named)
    assert np.array_equal(shape.attributes["vertex_tone"], [(0.5, 0.25, 0.125)] * 4)


def test_surfaces_of_arnold_are_those_of_materialx(stage: Loader) -> None:
    pytest.importorskip("MaterialX", reason="its library translates standard_surface")
    text = f"""
    def Material "Look" {{
        token outputs:%s:surface.connect = </Look/S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "%s"
            float inputs:base = 1
            color3f inputs:base_color = (0.5, 0.25, 0.125)
            float inputs:specular_roughness = 0.625
            token outputs:surface
        }}
    }}
    {BOUND} {SUN}"""
    scenes = [
        stage(text % names)
        for names in (
            ("arnold", "arnold:standard_surface"),
            ("mtlx", "ND_standard_surface_surfaceshader"),
        )
    ]
    assert str(scenes[0].shapes[0].material) == str(scenes[1].shapes[0].material)
    assert not scenes[0].warnings and "0.625" in str(scenes[0].shapes[0].material)
