"""MaterialX: shaders as materials, graphs as textures, and what is left out."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.formats import materialx
from clpt.formats.materialx import document
from clpt.formats.materialx.graph import Graph, Probing, category, from_space, width
from clpt.formats.materialx.nodes import READERS
from clpt.scene.materials import (
    Blend,
    BumpMap,
    GltfSurface,
    Mask,
    NormalMap,
    Openpbr,
    TwoSided,
    parts,
)
from clpt.scene.textures import Bitmap, MeshAttribute, noise
from clpt.scene.textures import Graph as GraphTexture
from clpt.spectra import Cauchy

HEAD = '<?xml version="1.0"?><materialx version="1.39" colorspace="lin_rec709">'


def _written(folder: Path, shader: str, more: str = "", kind: str = "open_pbr_surface") -> Path:
    """Write a document of one material; shader: inputs of its shader; more: other nodes."""
    path = folder / "a.mtlx"
    node = f'<{kind} name="S" type="surfaceshader">{shader}</{kind}>'
    material = '<surfacematerial name="M" type="material">'
    material += '<input name="surfaceshader" type="surfaceshader" nodename="S"/></surfacematerial>'
    path.write_text(f"{HEAD}{more}{node}{material}</materialx>", encoding="utf-8")
    return path


def _input(name: str, type_: str, value: str = "", node: str = "", **more: str) -> str:
    words = {"value": value, "nodename": node, **more}
    rest = " ".join(f'{key}="{word}"' for key, word in words.items() if word)
    return f'<input name="{name}" type="{type_}" {rest}/>'


def _leaf(surface: materialx.Surface, kind: type = Openpbr) -> Any:
    return next(part for part in parts(surface.material) if isinstance(part, kind))


def _read(folder: Path, *given: Any, **more: Any) -> tuple[materialx.Surface, list[str]]:
    return materialx.load_material(_written(folder, *given, **more))


def test_openpbr_by_its_numbers(tmp_path: Path) -> None:
    shader = _input("base_color", "color3", "0.1, 0.6, 0.9") + _input("coat_weight", "float", "0.5")
    surface, warnings = _read(tmp_path, shader)
    leaf = _leaf(surface)
    assert not warnings and isinstance(surface.material, TwoSided) and leaf.name == "M"
    assert (leaf.base_color.r, leaf.base_color.b, leaf.coat_weight) == (0.1, 0.9, 0.5)
    assert surface.emission is None and surface.interior is None


def test_what_is_inside(tmp_path: Path) -> None:
    """A depth gives an absorption, scattering a medium, and an Abbe number dispersion."""
    glass = _input("transmission_weight", "float", "1") + _input("transmission_depth", "float", "2")
    glass += _input("transmission_color", "color3", "0.5, 0.25, 1")
    clear, _ = _read(tmp_path, glass)
    a = _leaf(clear).absorption
    np.testing.assert_allclose([a.r, a.g, a.b], -np.log([0.5, 0.25, 1.0]) / 2.0)
    cloudy, _ = _read(tmp_path, glass + _input("transmission_scatter", "color3", "1, 1, 1"))
    assert cloudy.interior is not None
    s, a = cloudy.interior.sigma_s, cloudy.interior.sigma_a
    np.testing.assert_allclose([s.r, s.g, s.b], 0.5)
    shifted = -np.log([0.5, 0.25, 1.0]) / 2.0 - 0.5
    np.testing.assert_allclose([a.r, a.g, a.b], shifted - shifted.min(), atol=1e-12)
    abbe = _input("transmission_dispersion_scale", "float", "0.5")
    ior = _leaf(_read(tmp_path, glass + abbe)[0]).specular_ior
    assert isinstance(ior, Cauchy)
    f, d, c = ior.sample([486.13, 587.56, 656.27])
    assert d == pytest.approx(1.5, abs=1e-6) and (d - 1.0) / (f - c) == pytest.approx(40.0)


def test_subsurface_walks_where_it_may(tmp_path: Path) -> None:
    path = _written(tmp_path, _input("subsurface_weight", "float", "1"))
    surface, _ = materialx.load_material(path)
    assert _leaf(surface).subsurface_inside and surface.interior is not None
    read = document.read(path)
    at_once = materialx.surface(document.Element(read.getNode("S")), _Told(), walk=False)
    assert at_once.interior is None and not _leaf(at_once).subsurface_inside


def test_emission_opacity_and_heights(tmp_path: Path) -> None:
    light = _input("emission_luminance", "float", "10") + _input(
        "emission_color", "color3", "1,2,3"
    )
    light += _input("coat_weight", "float", "1") + _input("coat_color", "color3", "0.5, 0.5, 0.5")
    light += _input("geometry_opacity", "float", "0.25") + _input(
        "geometry_normal", "vector3", node="B"
    )
    bump = '<bump name="B" type="vector3">' + _input("height", "float", node="R") + "</bump>"
    ramp = '<ramplr name="R" type="float">' + _input("valuel", "float", "1") + "</ramplr>"
    surface, _ = _read(tmp_path, light, bump + ramp)
    assert surface.emission is not None
    through = 0.5 * (1.0 - (0.6 / 2.6) ** 2)
    radiance = surface.emission.radiance.first
    np.testing.assert_allclose([radiance.r, radiance.b], [10 * through, 30 * through], rtol=1e-6)
    assert any(isinstance(part, Mask) and part.opacity == 0.25 for part in parts(surface.material))
    assert _kinds(_leaf(surface, BumpMap).height) == ["ramplr"]


def _kinds(graph: GraphTexture) -> list[str]:
    """The kinds of a graph's nodes, in their order."""
    return [step.kind for step in graph.steps]


def test_standard_surface_by_the_library(tmp_path: Path) -> None:
    shader = _input("base", "float", "0.5") + _input("metalness", "float", "1")
    shader += _input("specular_roughness", "float", "0.35") + _input("sheen", "float", "0.2")
    leaf = _leaf(_read(tmp_path, shader, kind="standard_surface")[0])
    assert (leaf.base_metalness, leaf.specular_roughness, leaf.fuzz_weight) == (1.0, 0.35, 0.2)
    assert leaf.coat_ior == 1.5  # its default, not OpenPBR's


def test_gltf_and_preview(tmp_path: Path) -> None:
    shader = _input("metallic", "float", "0.25") + _input("clearcoat", "float", "1")
    leaf = _leaf(_read(tmp_path, shader, kind="gltf_pbr")[0], GltfSurface)
    assert (leaf.metallic, leaf.clearcoat) == (0.25, 1.0)
    leaf = _leaf(_read(tmp_path, shader, kind="UsdPreviewSurface")[0], GltfSurface)
    assert (leaf.metallic, leaf.clearcoat, leaf.base_color.g) == (0.25, 1.0, 0.18)


def _picture(folder: Path, name: str = "p.png") -> np.ndarray:
    pixels = np.random.default_rng(1).integers(0, 256, (6, 4, 3), np.uint8)
    Image.fromarray(pixels).save(folder / name)
    return pixels


def _image(name: str, file: str, type_: str = "color3", space: str = "", **more: str) -> str:
    space = f' colorspace="{space}"' if space else ""
    rest = "".join(_input(key, "string", value) for key, value in more.items())
    found = f'<input name="file" type="filename" value="{file}"{space}/>'
    return f'<image name="{name}" type="{type_}">{found}{rest}</image>'


@pytest.mark.parametrize(("space", "raw"), [("srgb_texture", False), ("lin_rec709", True)])
def test_a_plain_image_stays_as_its_file_has_it(tmp_path: Path, space: str, raw: bool) -> None:
    pixels = _picture(tmp_path)
    image = _image("I", "p.png", space=space, uaddressmode="clamp", vaddressmode="mirror")
    surface, warnings = _read(tmp_path, _input("base_color", "color3", node="I"), image)
    bitmap = _leaf(surface).base_color
    assert not warnings and isinstance(bitmap, Bitmap)
    assert np.array_equal(bitmap.image, pixels) and bitmap.raw is raw
    assert (bitmap.wrap, bitmap.wrap_v) == ("clamp", "mirror")


def test_a_color_space_is_heeded(tmp_path: Path) -> None:
    pixels = _picture(tmp_path) / 255.0
    image = _image("I", "p.png", space="acescg")
    bitmap = _leaf(_read(tmp_path, _input("base_color", "color3", node="I"), image)[0]).base_color
    red = pixels @ [1.70505, -0.62179, -0.08326]
    np.testing.assert_allclose(bitmap.image[..., 0], red, atol=1e-4)


def test_what_is_done_to_an_image_is_a_graph(tmp_path: Path) -> None:
    pixels = _picture(tmp_path)
    nodes = _image("I", "p.png", "vector3")
    nodes += '<tiledimage name="T" type="float">' + _input("file", "filename", "p.png")
    nodes += _input("uvtiling", "vector2", "2, 3") + "</tiledimage>"
    nodes += '<invert name="N" type="vector3">' + _input("in", "vector3", node="I") + "</invert>"
    nodes += '<convert name="C" type="color3">' + _input("in", "vector3", node="N") + "</convert>"
    nodes += '<power name="P" type="float">' + _input("in1", "float", node="T")
    nodes += _input("in2", "float", "2") + "</power>"
    shader = _input("base_color", "color3", node="C") + _input("coat_weight", "float", node="P")
    leaf = _leaf(_read(tmp_path, shader, nodes)[0])
    assert _kinds(leaf.base_color) == ["texture", "invert"]
    assert np.array_equal(leaf.base_color.textures[0].image, pixels)
    assert _kinds(leaf.coat_weight) == ["texture", "power"]
    tiled = leaf.coat_weight.textures[0]
    assert tiled.channel == "r" and np.array_equal(tiled.to_uv, np.diag([2.0, 3.0, 1.0]))
    found = leaf.base_color.evaluated(Probing(leaf.base_color))
    np.testing.assert_allclose(found[0], 1.0 - pixels.mean(axis=(0, 1)) / 255.0, atol=1e-6)


def test_what_changes_nothing_leaves_an_image(tmp_path: Path) -> None:
    """As the library's translation of standard_surface multiplies a color by a weight of 1."""
    pixels = _picture(tmp_path)
    shader = _input("base_color", "color3", node="I") + _input("base", "float", "1")
    leaf = _leaf(_read(tmp_path, shader, _image("I", "p.png"), kind="standard_surface")[0])
    assert isinstance(leaf.base_color, Bitmap) and np.array_equal(leaf.base_color.image, pixels)


def test_an_image_where_a_graph_bends_its_coordinates(tmp_path: Path) -> None:
    _picture(tmp_path)
    nodes = '<noise2d name="W" type="vector2"/><image name="I" type="color3">'
    nodes += _input("file", "filename", "p.png") + _input("texcoord", "vector2", node="W")
    nodes += "</image>"
    graph = _leaf(_read(tmp_path, _input("base_color", "color3", node="I"), nodes)[0]).base_color
    assert _kinds(graph) == ["noise2d", "texture"]
    assert graph.steps[1].operands == {"texcoord": 0} and graph.steps[0].width == 2


def test_a_channel_and_a_normal_map(tmp_path: Path) -> None:
    pixels = _picture(tmp_path)
    nodes = _image("I", "p.png", "vector3") + '<normalmap name="N" type="vector3">'
    nodes += _input("in", "vector3", node="I") + _input("scale", "float", "0.5") + "</normalmap>"
    nodes += '<extract name="G" type="float">' + _input("in", "vector3", node="I")
    nodes += _input("index", "integer", "1") + "</extract>"
    shader = _input("geometry_normal", "vector3", node="N")
    shader += _input("specular_roughness", "float", node="G")
    surface, warnings = _read(tmp_path, shader, nodes)
    rough, normals = _leaf(surface).specular_roughness, _leaf(surface, NormalMap)
    assert not warnings and rough.channel == "g" and np.array_equal(rough.image, pixels)
    assert normals.scale == 0.5 and normals.map.raw


def test_normals_that_are_changed_and_a_channel_of_channels(tmp_path: Path) -> None:
    """As a map whose green runs the other way: the normal map is a graph of the image."""
    _picture(tmp_path)
    nodes = _image("I", "p.png", "vector3")
    for index, name in enumerate("XYZ"):
        nodes += f'<extract name="{name}" type="float">' + _input("in", "vector3", node="I")
        nodes += _input("index", "integer", str(index)) + "</extract>"
    nodes += '<invert name="V" type="float">' + _input("in", "float", node="Y") + "</invert>"
    nodes += '<combine3 name="C" type="vector3">' + _input("in1", "float", node="X")
    nodes += _input("in2", "float", node="V") + _input("in3", "float", node="Z") + "</combine3>"
    nodes += '<normalmap name="N" type="vector3">' + _input("in", "vector3", node="C")
    nodes += '</normalmap><extract name="R" type="float">' + _input("in", "vector3", node="C")
    nodes += _input("index", "integer", "2") + "</extract>"
    shader = _input("geometry_normal", "vector3", node="N")
    shader += _input("specular_roughness", "float", node="R")
    surface, warnings = _read(tmp_path, shader, nodes)
    bent, rough = _leaf(surface, NormalMap).map, _leaf(surface).specular_roughness
    assert not warnings and isinstance(bent, GraphTexture) and bent.width == 3
    assert isinstance(rough, Bitmap) and rough.channel == "b"


def test_patterns_cost_no_image(tmp_path: Path) -> None:
    nodes = '<ramptb name="R" type="color3">' + _input("valuet", "color3", "1, 0, 0") + "</ramptb>"
    graph = _leaf(_read(tmp_path, _input("base_color", "color3", node="R"), nodes)[0]).base_color
    assert _kinds(graph) == ["ramptb"] and not graph.textures
    found = graph.evaluated(Probing(graph))
    v = Probing(graph).source("texcoord")[:, 1]
    np.testing.assert_allclose(found, np.outer(np.clip(v, 0.0, 1.0), [1.0, 0.0, 0.0]))


def test_a_tangent_is_turned(tmp_path: Path) -> None:
    """As Blender writes it, for metal that is brushed."""
    nodes = '<tangent name="T" type="vector3"/><normal name="N" type="vector3"/>'
    nodes += '<rotate3d name="R" type="vector3">' + _input("in", "vector3", node="T")
    nodes += _input("amount", "float", "-60") + _input("axis", "vector3", node="N") + "</rotate3d>"
    shader = _input("geometry_tangent", "vector3", node="R")
    assert _leaf(_read(tmp_path, shader, nodes)[0]).anisotropy_rotation == 0.0
    brushed = shader + _input("specular_roughness_anisotropy", "float", "0.5")
    surface, warnings = _read(tmp_path, brushed, nodes)
    assert not warnings and _leaf(surface).anisotropy_rotation == -60.0


def test_noise_in_space(tmp_path: Path) -> None:
    """Noise of scaled places, by its formula; heights of it are a bump map."""
    nodes = '<position name="Q" type="vector3"/><multiply name="V" type="vector3">'
    nodes += (
        _input("in1", "vector3", node="Q") + _input("in2", "vector3", "5, 4, 3") + "</multiply>"
    )
    nodes += '<fractal3d name="F" type="float">' + _input("position", "vector3", node="V")
    nodes += _input("octaves", "integer", "2") + _input("diminish", "float", "0.4") + "</fractal3d>"
    nodes += '<mix name="X" type="color3">' + _input("fg", "color3", "1, 0, 0")
    nodes += _input("mix", "float", node="F") + "</mix>"
    nodes += '<heighttonormal name="H" type="vector3">' + _input("in", "float", node="F")
    nodes += '</heighttonormal><normalmap name="N" type="vector3">'
    nodes += _input("in", "vector3", node="H") + _input("scale", "float", "0.01") + "</normalmap>"
    shader = _input("base_color", "color3", node="X") + _input(
        "geometry_normal", "vector3", node="N"
    )
    surface, warnings = _read(tmp_path, shader, nodes)
    color = _leaf(surface).base_color
    assert not warnings and _kinds(color) == ["multiply", "fractal3d", "mix"]
    at = Probing(color).source("position")
    octaves = noise.fractal(
        at * [5.0, 4.0, 3.0], np.ones(1) * 2.0, np.ones(1) * 2.0, np.ones(1) * 0.4, 1
    )
    np.testing.assert_allclose(color.evaluated(Probing(color)), octaves * [1.0, 0.0, 0.0])
    bump = _leaf(surface, BumpMap)
    assert bump.scale == 0.01 and _kinds(bump.height) == ["multiply", "fractal3d"]


def test_nodes_of_scattering(tmp_path: Path) -> None:
    """As Blender writes a mixture of shaders, and as others write a gloss over a matt base."""
    nodes = '<mix name="X" type="BSDF">' + _input("bg", "BSDF", node="G")
    nodes += _input("fg", "BSDF", node="L") + _input("mix", "float", "0.25") + "</mix>"
    nodes += '<dielectric_bsdf name="G" type="BSDF">' + _input("scatter_mode", "string", "RT")
    nodes += _input("ior", "float", "1.4") + "</dielectric_bsdf>"
    nodes += '<layer name="L" type="BSDF">' + _input("top", "BSDF", node="R")
    nodes += _input("base", "BSDF", node="D") + "</layer>"
    nodes += '<dielectric_bsdf name="R" type="BSDF">' + _input("roughness", "vector2", "0.04, 0.04")
    nodes += '</dielectric_bsdf><oren_nayar_diffuse_bsdf name="D" type="BSDF">'
    nodes += _input("color", "color3", "0.1, 0.2, 0.3") + "</oren_nayar_diffuse_bsdf>"
    surface, warnings = _read(tmp_path, _input("bsdf", "BSDF", node="X"), nodes, kind="surface")
    blend = surface.material
    assert not warnings and isinstance(blend, Blend) and blend.weight == 0.25
    glass, matt = blend.first, _leaf(materialx.Surface(blend.second))
    assert isinstance(glass, Openpbr) and glass.transmits and glass.specular_ior.value == 1.4
    assert (matt.base_color.g, matt.specular_weight) == (0.2, 1.0)
    assert matt.specular_roughness == pytest.approx(0.2)
    metal = '<conductor_bsdf name="X" type="BSDF"/>'
    surface, _ = _read(tmp_path, _input("bsdf", "BSDF", node="X"), metal, kind="surface")
    gold = _leaf(surface).base_color
    np.testing.assert_allclose([gold.r, gold.g, gold.b], [0.944, 0.776, 0.373], atol=2e-3)


def test_nodes_that_are_not_read_are_told_by_name(tmp_path: Path) -> None:
    nodes = '<multiply name="A" type="color3">' + _input("in1", "color3", node="V") + "</multiply>"
    nodes += '<normal name="Q" type="vector3"/><convert name="V" type="color3">'
    nodes += _input("in", "vector3", node="Q") + "</convert>"
    surface, warnings = _read(tmp_path, _input("base_color", "color3", node="A"), nodes)
    assert len(warnings) == 1 and "ND_normal_vector3" in warnings[0] and "base_color" in warnings[0]
    assert _leaf(surface).base_color.r == 0.8


def test_a_missing_image_is_told(tmp_path: Path) -> None:
    shader = _input("base_color", "color3", node="I")
    surface, warnings = _read(tmp_path, shader, _image("I", "gone.png"))
    assert len(warnings) == 1 and "gone.png" in warnings[0] and _leaf(surface).base_color.r == 0.0


def test_bad_documents(tmp_path: Path) -> None:
    path = tmp_path / "a.mtlx"
    for text, message in (("<materialx", "no document"), (f"{HEAD}</materialx>", "no surface mat")):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(SceneError, match=message):
            materialx.load_materials(path)
    circle = '<add name="A" type="color3">' + _input("in1", "color3", node="B") + "</add>"
    circle += '<add name="B" type="color3">' + _input("in1", "color3", node="A") + "</add>"
    _, warnings = _read(tmp_path, _input("base_color", "color3", node="A"), circle)
    assert "circle" in warnings[0]


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _written(tmp_path, "")
    monkeypatch.setitem(__import__("sys").modules, "MaterialX", None)
    with pytest.raises(SceneError, match=r"clpt\[materialx\]"):
        materialx.load_materials(path)
    document.standard.cache_clear()
    host = _Told()
    materialx.surface(_Shader("ND_standard_surface_surfaceshader"), host)
    tint = {"base_color": _Shader("ND_saturate_color3", {"in": (1, 0, 0), "amount": 0})}
    leaf = _leaf(materialx.surface(_Shader("ND_open_pbr_surface_surfaceshader", {}, tint), host))
    assert len(host.told) == 3 and all("clpt[materialx]" in told for told in host.told[::2])
    assert leaf.base_color.r == 0.8


@dataclass
class _Told:
    """A host that keeps what it is told, and has one image."""

    told: list[str] = field(default_factory=list)

    def warn(self, message: str, path: str) -> None:
        self.told.append(f"{path}: {message}")

    def image(self, asset: Any, path: str) -> images.Stored | None:
        return images.Stored(np.full((2, 2, 3), 0.25, np.float32), encoded=False)

    def attribute(self, name: str, default: tuple[float, ...]) -> MeshAttribute:
        return MeshAttribute(name=f"vertex_{name}")

    def uv_mapping(self, name: str) -> str:
        return "uv1" if name == "lightmap" else "uv"


@dataclass(frozen=True)
class _Shader:
    """A shader as a reader of stages has it."""

    kind: str
    values: dict[str, Any] = field(default_factory=dict)
    sources: dict[str, _Shader] = field(default_factory=dict)

    @property
    def path(self) -> str:
        return f"/M/{self.kind}{len(self.values)}"

    def source(self, name: str) -> tuple[_Shader, str] | None:
        return (self.sources[name], "out") if name in self.sources else None

    def value(self, name: str, default: Any = None) -> Any:
        return self.values.get(name, default)

    def color_space(self, name: str) -> str:
        return ""


def test_a_network_of_a_stage() -> None:
    """Names of definitions and values of a stage are enough, with sets of coordinates by name."""
    st = _Shader("ND_geompropvalue_vector2", {"geomprop": "lightmap"})
    image = _Shader("ND_image_color3", {"file": "a"}, {"texcoord": st})
    dark = _Shader("ND_multiply_color3FA", {"in2": 0.5}, {"in1": image})
    values = {"coat_weight": 1.0, "base_metalness": 1}
    shader = _Shader("ND_open_pbr_surface_surfaceshader", values, {"base_color": dark})
    host = _Told()
    leaf = _leaf(materialx.surface(shader, host, "m"))
    assert not host.told and leaf.coat_weight == 1.0 and leaf.base_metalness == 1.0
    assert _kinds(leaf.base_color) == ["texture", "multiply"]
    assert leaf.base_color.textures[0].mapping == "uv1"
    np.testing.assert_allclose(leaf.base_color.evaluated(Probing(leaf.base_color)), 0.125)


def test_a_shader_that_is_not_read_is_grey() -> None:
    host = _Told()
    materialx.surface(_Shader("ND_toon_surfaceshader"), host)
    assert host.told == [
        "/M/ND_toon_surfaceshader0: ND_toon_surfaceshader is not read; grey stands for it"
    ]


# Each node, its inputs, and what it gives by the specification.
NODES: list[tuple[str, dict[str, Any], Any]] = [
    ("ND_mix_color3", {"fg": (1, 0, 0), "bg": (0, 0, 1), "mix": 0.25}, (0.25, 0, 0.75)),
    ("ND_remap_float", {"in": 3, "inlow": 2, "inhigh": 4, "outlow": 10, "outhigh": 20}, 15),
    ("ND_smoothstep_float", {"in": 0.25, "low": 0, "high": 1}, 0.15625),
    ("ND_modulo_float", {"in1": -0.25, "in2": 1}, 0.75),
    ("ND_divide_float", {"in1": 3, "in2": 2}, 1.5),
    ("ND_clamp_float", {"in": 1.5}, 1.0),
    ("ND_ifgreater_float", {"value1": 2, "value2": 1, "in1": 5, "in2": 6}, 5),
    ("ND_ifequal_floatI", {"value1": 2, "value2": 1, "in1": 5, "in2": 6}, 6),
    ("ND_rgbtohsv_color3", {"in": (0.2, 0.8, 0.5)}, (5 / 12, 0.75, 0.8)),
    ("ND_hsvtorgb_color3", {"in": (5 / 12, 0.75, 0.8)}, (0.2, 0.8, 0.5)),
    ("ND_rotate2d_vector2", {"in": (1, 0), "amount": 90}, (0, -1)),
    ("ND_rotate3d_vector3", {"in": (1, 0, 0), "amount": 90, "axis": (0, 0, 1)}, (0, 1, 0)),
    ("ND_dotproduct_vector3", {"in1": (1, 2, 3), "in2": (4, 5, 6)}, 32),
    ("ND_crossproduct_vector3", {"in1": (1, 0, 0), "in2": (0, 1, 0)}, (0, 0, 1)),
    ("ND_normalize_vector3", {"in": (3, 0, 4)}, (0.6, 0, 0.8)),
    ("ND_screen_float", {"fg": 0.5, "bg": 0.5}, 0.75),
    ("ND_burn_float", {"fg": 0.5, "bg": 0.75}, 0.5),
    ("ND_dodge_float", {"fg": 0.5, "bg": 0.25}, 0.5),
    ("ND_combine3_color3", {"in1": 1, "in2": 2, "in3": 3}, (1, 2, 3)),
    ("ND_extract_color3", {"in": (1, 2, 3), "index": 2}, 3),
    ("ND_convert_float_color3", {"in": 0.5}, (0.5, 0.5, 0.5)),
    ("ND_luminance_color3", {"in": (1, 0, 0)}, (0.2722287,) * 3),
    ("ND_logical_and", {"in1": True, "in2": False}, 0),
    ("ND_roughness_anisotropy", {"roughness": 0.5, "anisotropy": 0.75}, (0.5, 0.125)),
    ("ND_roughness_dual", {"roughness": (0.5, 0.2)}, (0.25, 0.04)),
    ("ND_artistic_ior", {"reflectivity": (0.25,) * 3, "edge_color": (1,) * 3}, (0.6,) * 3),
    ("ND_blackbody", {"temperature": 6500}, (1.043216, 0.983593, 1.035224)),
    ("ND_matte_color4", {"fg": (1, 0, 0, 0.5), "bg": (0, 1, 0, 0.5)}, (0.5, 0.5, 0, 0.75)),
    ("ND_acescg_to_lin_rec709_color3", {"in": (1, 0, 0)}, (1.705051, -0.130256, -0.024003)),
    ("ND_contrast_float", {"in": 1, "amount": 2, "pivot": 0.5}, 1.5),  # a graph of the library
    ("ND_saturate_color3", {"in": (1, 0, 0), "amount": 0}, (0.2722287,) * 3),
]


@pytest.mark.parametrize(("kind", "values", "expected"), NODES, ids=[row[0] for row in NODES])
def test_nodes(kind: str, values: dict[str, Any], expected: Any) -> None:
    graph = Graph(_Told(), READERS, document.inner)
    found = graph.output(_Shader(kind, values), "out")
    np.testing.assert_allclose(found.numbers, np.atleast_1d(expected), atol=1e-6)


def test_definitions_are_named() -> None:
    assert category("ND_ifgreater_vector2I") == "ifgreater" and width("ND_ifgreater_vector2I") == 2
    assert category("ND_open_pbr_surface_surfaceshader") == "open_pbr_surface"
    assert category("ND_combine2_color4CF") == category("ND_combine2_vector4VV") == "combine2"
    assert category("ND_multiply_color3FA") == "multiply" and width("ND_image_color4") == 4


def test_noises() -> None:
    """Perlin's noise is 0 on its lattice, of the range that it is scaled to, and smooth."""
    rng = np.random.default_rng(3)
    for count in (2, 3):
        at = rng.uniform(-50.0, 50.0, (4000, count))
        assert np.abs(noise.perlin(np.round(at), 3)).max() == 0.0
        values = noise.perlin(at, 1)
        assert 0.5 < np.abs(values).max() < 1.05 and abs(values.mean()) < 0.03
        near = noise.perlin(at + 1e-4, 1)
        assert np.abs(near - values).max() < 1e-3
        octaves = noise.fractal(at, np.array([2.0]), np.array([2.0]), np.array([0.5]), 1)
        np.testing.assert_allclose(octaves, values + 0.5 * noise.perlin(2.0 * at, 1))
        cells = noise.cells(at, 1)
        np.testing.assert_array_equal(cells, noise.cells(np.floor(at) + 0.5, 1))
        assert abs(cells.mean() - 0.5) < 0.03
        distances = noise.worley(at, np.ones(1), 3, 0)
        assert np.all(np.diff(distances, axis=-1) >= 0.0) and distances.max() < 2.5


def test_our_own_scenes_name_a_document(tmp_path: Path) -> None:
    shader = _input("subsurface_weight", "float", "1") + _input("emission_luminance", "float", "2")
    _written(tmp_path, shader)
    wax = {"type": "materialx", "file": "a.mtlx", "material": "M"}
    shapes = [
        {"type": "sphere", "material": wax},
        {"type": "sphere", "material": "wax", "emission": None},
    ]
    scene = {"camera": {"type": "perspective"}, "materials": {"wax": wax}, "shapes": shapes}
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    for shape in clpt.load(path).shapes:
        assert isinstance(shape.material, Openpbr) and shape.interior is not None
        assert shape.emission is not None
    for wrong, message in (
        ({"material": "N"}, "'N'"),
        ({"file": "b.mtlx"}, "b.mtlx"),
        ({"a": 1}, "'a'"),
    ):
        path.write_text(json.dumps({**scene, "materials": {"wax": {**wax, **wrong}}}), "utf-8")
        with pytest.raises(SceneError, match=message):
            clpt.load(path)


def test_a_document_is_a_scene(tmp_path: Path) -> None:
    scene = clpt.load(_written(tmp_path, ""))
    assert [shape.name for shape in scene.shapes][:1] == ["M"] and scene.extra["format"] == "mtlx"
    with pytest.raises(SceneError, match="several"):
        two = _written(tmp_path, "").read_text("utf-8")
        (tmp_path / "b.mtlx").write_text(
            two.replace("</materialx>", two[two.index("<surfacem") :].replace('"M"', '"N"')),
            "utf-8",
        )
        materialx.load_material(tmp_path / "b.mtlx")


@pytest.mark.parametrize(
    ("own", "common"),
    [
        ("acescg", "lin_ap1_scene"), ("lin_displayp3", "lin_p3d65_scene"),
        ("srgb_displayp3", "srgb_p3d65_scene"), ("lin_adobergb", "lin_adobergb_scene"),
        ("adobergb", "g22_adobergb_scene"), ("g22_ap1", "g22_ap1_scene"),
        ("g18_rec709", "g18_rec709_scene"), ("srgb_texture", "srgb_rec709_scene"),
    ],
)  # fmt: skip
def test_spaces_have_the_names_of_the_color_interop_forum(own: str, common: str) -> None:
    color = np.array([0.25, 0.5, 0.75])
    linear = from_space(color, common)
    assert (
        np.allclose(linear, from_space(color, own), atol=1e-3) and abs(linear - color).max() > 0.01
    )


def test_a_space_of_the_color_interop_forum_alone() -> None:
    assert from_space(np.array([0.0, 1.0, 0.0]), "lin_rec2020_scene") == pytest.approx(
        [-0.5876, 1.1329, -0.1006], abs=1e-3
    )
