"""UsdPreviewSurface and its textures, tiles, and volumes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clpt.scene import Scene
from clpt.scene.materials import Blend, Mask, Material, NormalMap, ThinDielectric, TwoSided
from clpt.scene.textures import Bitmap, Product
from tests.formats.usd.conftest import SQUARE, SUN, Loader

pytest.importorskip("pxr")

STAGE = """
def Material "Look" {{
    float inputs:shine = 0.25
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        {}
    }}
    def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./image.png@
        float2 inputs:st.connect = </Look/X.outputs:result>
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:a
        {}
    }}
    def Shader "X" {{
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </Look/R.outputs:result>
        {}
        float2 outputs:result
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "map1"
        float2 outputs:result
    }}
}}
def Mesh "M" (apiSchemas = ["MaterialBindingAPI"]) {{
    {}
    texCoord2f[] primvars:map1 = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </Look>
}}
{}
"""
BOUND = f"""def Mesh "M" (apiSchemas = ["MaterialBindingAPI"]) {{
    {SQUARE}
    rel material:binding = </Look>
}}
"""
RGBA = [[(255, 0, 0, 255), (0, 255, 0, 0)], [(0, 0, 255, 102), (128, 128, 128, 204)]]


@pytest.fixture
def look(stage: Loader, tmp_path: Path) -> Loader:
    """Return a function that reads a material of inputs of its surface, texture and transform."""
    Image.fromarray(np.array(RGBA, np.uint8)).save(tmp_path / "image.png")

    def scene(surface: str = "", texture: str = "", transform: str = "") -> Scene:
        return stage(STAGE.format(surface, texture, transform, SQUARE, SUN))

    return scene


def material(scene: Scene) -> Material:
    return next(shape for shape in scene.shapes if shape.name == "M").material


def inner(scene: Scene) -> Material:
    whole = material(scene)
    return whole.front if isinstance(whole, TwoSided) else whole


def numbers(color: object) -> list[float]:
    return [color.r, color.g, color.b]


def test_defaults_are_those_of_the_specification(look: Loader) -> None:
    surface = inner(look())
    assert numbers(surface.base_color) == pytest.approx([0.18] * 3)
    assert (surface.roughness, surface.metallic, surface.ior.value) == (0.5, 0.0, 1.5)
    assert (surface.clearcoat, surface.clearcoat_roughness) == (0.0, pytest.approx(0.01))


def test_values_come_through_the_interface(look: Loader) -> None:
    surface = inner(look("float inputs:roughness.connect = </Look.inputs:shine>"))
    assert surface.roughness == 0.25


def test_the_specular_workflow(look: Loader) -> None:
    text = """int inputs:useSpecularWorkflow = 1
    float inputs:metallic = 1
    color3f inputs:specularColor = (0.1, 0.2, 0.3)"""
    surface = inner(look(text))
    assert (surface.ior.value, surface.metallic) == (0.0, 0.0)
    assert numbers(surface.specular_color) == pytest.approx([0.1, 0.2, 0.3])


def test_what_is_not_opaque(look: Loader) -> None:
    pane = inner(look("float inputs:opacity = 0.25\n float inputs:ior = 1.3"))
    assert isinstance(pane, Blend)
    assert isinstance(pane.first, ThinDielectric)
    assert pane.weight == 0.25
    text = 'float inputs:opacity = 0.25\n token inputs:opacityMode = "presence"'
    mask = inner(look(text))
    assert isinstance(mask, Mask)
    assert mask.opacity == 0.25
    cut = inner(look("float inputs:opacity = 0.25\n float inputs:opacityThreshold = 0.5"))
    assert isinstance(cut, Mask)
    assert cut.opacity == 0.0


def test_opacity_is_cut_at_its_threshold(look: Loader) -> None:
    text = (
        "float inputs:opacity.connect = </Look/T.outputs:a>\n float inputs:opacityThreshold = 0.5"
    )
    mask = inner(look(text))
    assert np.asarray(mask.opacity.image).tolist() == [[1, 0], [0, 1]]


def test_textures_have_their_wraps_spaces_and_channels(look: Loader) -> None:
    text = """color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>
    float inputs:roughness.connect = </Look/T.outputs:g>"""
    wraps = 'token inputs:wrapS = "mirror"\n token inputs:sourceColorSpace = "raw"'
    surface = inner(look(text, wraps))
    color, rough = surface.base_color, surface.roughness
    assert (color.wrap, color.wrap_v, color.raw) == ("mirror", "zero", True)
    assert rough.channel == "g"
    assert not inner(look(text)).base_color.raw  # auto: four channels of 8 bits
    assert np.allclose(color.to_uv, np.eye(3))


def test_textures_are_scaled_and_moved(look: Loader) -> None:
    text = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    raw = 'token inputs:sourceColorSpace = "raw"\n float4 inputs:scale = (0.5, 0.5, 0.25, 1)\n'
    scaled = inner(look(text, raw)).base_color
    assert isinstance(scaled, Product)
    moved = inner(look(text, raw + "float4 inputs:bias = (0.25, 0, 0, 0)")).base_color
    assert isinstance(moved, Bitmap)
    assert np.allclose(moved.image[0, 0], [0.75, 0.0, 0.0, 1.0])
    assert np.allclose(moved.image[1, 0], [0.25, 0.0, 0.25, 0.4])


def test_coordinates_are_transformed(look: Loader) -> None:
    """Scale, then a counter-clockwise turn, then a translation."""
    text = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    turn = """float2 inputs:scale = (2, 3)
    float inputs:rotation = 90
    float2 inputs:translation = (10, 20)"""
    bitmap = inner(look(text, "", turn)).base_color
    assert np.allclose(bitmap.to_uv @ [1, 1, 1], [-3 + 10, 2 + 20, 1])


def test_normal_maps_of_any_scale(look: Loader) -> None:
    text = "normal3f inputs:normal.connect = </Look/T.outputs:rgb>"
    raw = 'token inputs:sourceColorSpace = "raw"\n'
    usual = "float4 inputs:scale = (2, 2, 2, 1)\n float4 inputs:bias = (-1, -1, -1, 0)"
    plain = inner(look(text, raw + usual))
    assert isinstance(plain, NormalMap)
    assert plain.map.image.dtype == np.uint8
    flipped = usual.replace("(2, 2,", "(2, -2,").replace("(-1, -1,", "(-1, 1,")
    turned = inner(look(text, raw + flipped)).map.image
    assert np.allclose(turned[0, 1], [0.0, 0.0, 0.0])
    assert np.allclose(turned[0, 0], [1.0, 1.0, 0.0])


def test_tiles_become_one_image(stage: Loader, tmp_path: Path) -> None:
    for tile, color in ((1001, (255, 0, 0)), (1012, (0, 0, 255))):
        Image.new("RGB", (2, 2), color).save(tmp_path / f"image.{tile}.png")
    text = STAGE.format(
        "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>", "", "", SQUARE, SUN
    )
    scene = stage(text.replace("image.png", "image.<UDIM>.png"))
    bitmap = inner(scene).base_color
    assert bitmap.image.shape == (4, 4, 3)
    assert bitmap.image[0, 3].tolist() == [0, 0, 255]  # of the second column, second row
    assert bitmap.image[3, 0].tolist() == [255, 0, 0]
    assert bitmap.image[3, 3].tolist() == [0, 0, 0]
    assert np.allclose(bitmap.to_uv @ [2, 2, 1], [1, 1, 1])


def test_what_emits_shines_from_both_sides_of_a_sheet(look: Loader, stage: Loader) -> None:
    glow = "color3f inputs:emissiveColor = (1, 2, 3)"
    shape = look(glow).shapes[0]
    assert numbers(shape.emission.radiance) == pytest.approx([1, 2, 3])
    assert not shape.emission.two_sided
    sheet = SQUARE + "uniform bool doubleSided = 1\n"
    both = stage(STAGE.format(glow, "", "", sheet, SUN)).shapes[0]
    assert both.emission.two_sided


def test_shaders_that_are_not_read_are_told(look: Loader, stage: Loader) -> None:
    scene = look("float inputs:roughness.connect = </Look/X.outputs:result>")
    assert scene.warnings == [
        "/Look/X: UsdTransform2d is not read; its input's fallback stands for it"
    ]
    text = STAGE.format("", "", "", SQUARE, SUN).replace("UsdPreviewSurface", "Mystery")
    assert stage(text).warnings == ["/Look: Mystery is not read; grey stands for it"]


def test_volumes_have_their_field(stage: Loader, tmp_path: Path) -> None:
    np.save(tmp_path / "smoke.npy", np.ones((2, 3, 4), np.float32))
    text = """def Volume "V" {
        rel field:density = </V/D>
        rel field:heat = </V/D>
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def OpenVDBAsset "D" { asset filePath = @./smoke.npy@; token fieldName = "density" }
    }
    """
    scene = stage(text + SUN, "metersPerUnit = 0.1")
    box = scene.shapes[0]
    assert box.interior.size == (2, 3, 4)
    assert np.allclose(box.to_world @ [1, 1, 1, 1], [0.6, 0.1, 0.1, 1])
    assert np.allclose(box.interior.to_world @ [1, 1, 1, 1], [0.6, 0.1, 0.1, 1])
    assert scene.warnings == ["/V: field 'heat' is left out"]


def test_fallbacks_of_primvars(stage: Loader) -> None:
    """A mesh without the primvar has the fallback of its reader, of one number or of three."""
    text = f"""
    def Material "Look" {{
        token outputs:surface.connect = </Look/S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Look/C.outputs:result>
            float inputs:roughness.connect = </Look/R.outputs:result>
            token outputs:surface
        }}
        def Shader "C" {{
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "paint"
            float3 inputs:fallback = (0.5, 0.25, 0.125)
            float3 outputs:result
        }}
        def Shader "R" {{
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "wear"
            float inputs:fallback = 0.75
            float outputs:result
        }}
    }}
    {BOUND} {SUN}"""
    shape = stage(text).shapes[0]
    assert np.allclose(shape.attributes["vertex_paint"], (0.5, 0.25, 0.125))
    assert np.allclose(shape.attributes["vertex_wear"], 0.75)


def test_a_mesh_without_texture_coordinates_shows_one_texel(stage: Loader, tmp_path: Path) -> None:
    Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "image.png")
    color = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    text = STAGE.format(color, "", "", SQUARE, SUN).replace("primvars:map1", "primvars:other")
    mesh = stage(text).shapes[0]
    assert np.array_equal(mesh.uvs, np.zeros((4, 2)))
