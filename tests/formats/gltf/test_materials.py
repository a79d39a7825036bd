"""Materials of glTF documents and what becomes of them; nothing is rendered."""

from __future__ import annotations

import base64
import io
import math

import numpy as np
import pytest
from PIL import Image

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene.materials import Diffuse, GltfSurface, Mask, NormalMap, Null, TwoSided
from clpt.scene.media import Homogeneous
from clpt.scene.textures import Bitmap, MeshAttribute, Mix, Product

PIXEL = np.array([[[255, 128, 64, 192], [0, 255, 32, 96]]], np.uint8)


def _uri(pixels):
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


@pytest.fixture
def shape(read, build):
    """The shape of a document with this material, `colours` of its vertices; and the notes."""

    def of(material, colours=None):
        top = {"images": [{"uri": _uri(PIXEL)}], "textures": [{"source": 0}]}
        document = build(materials=[material], **top)
        attributes = {"TEXCOORD_0": document.accessor([(0, 0), (1, 0), (0, 1)])}
        if colours is not None:
            attributes["COLOR_0"] = document.accessor(colours)
        scene = read(document.mesh(material=0, attributes=attributes))
        return scene.shapes[0], scene.warnings

    return of


def _extension(name, **values):
    return {"extensions": {f"KHR_materials_{name}": values}}


def _front(shape_and_notes):
    return shape_and_notes[0].material.front


def test_core_and_its_defaults(shape):
    found = shape({"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1]}})
    surface = _front(found)
    assert isinstance(surface, GltfSurface) and surface.name == "red"
    assert (surface.metallic, surface.roughness, surface.ior.value) == (1.0, 1.0, 1.5)
    np.testing.assert_allclose(surface.base_color.to_rgb(), [1, 0.5, 0])
    assert isinstance(found[0].material.back, Null)  # glTF culls what is not doubleSided
    assert shape({"doubleSided": True})[0].material.back is None


def test_textures_and_factors(shape):
    surface = _front(
        shape(
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 1, 1, 1],
                    "baseColorTexture": {"index": 0},
                    "metallicFactor": 0.5,
                    "metallicRoughnessTexture": {"index": 0},
                },
                "normalTexture": {"index": 0, "scale": 0.25},
            }
        )
    )
    assert isinstance(surface, NormalMap) and surface.scale == 0.25 and surface.along_v
    assert isinstance(surface.map, Bitmap)
    inner = surface.material
    assert isinstance(inner.base_color, Product) and isinstance(inner.metallic, Product)
    assert isinstance(inner.roughness, Bitmap) and inner.roughness.channel == "g"
    assert inner.metallic.first.channel == "b"


def test_sheet_and_body(shape):
    through = {"KHR_materials_transmission": {"transmissionFactor": 1}}
    sheet = shape({"extensions": through})[0].material
    assert isinstance(sheet, GltfSurface) and sheet.thin and sheet.transmits
    volume = {
        "thicknessFactor": 2,
        "attenuationDistance": 0.5,
        "attenuationColor": [1, math.exp(-1), math.exp(-2)],
    }
    body = {
        **through,
        "KHR_materials_volume": volume,
        "KHR_materials_ior": {"ior": 1.6},
        "KHR_materials_dispersion": {"dispersion": 0.5},
    }
    made = shape({"extensions": body})[0].material
    assert not made.thin
    np.testing.assert_allclose(made.absorption.to_rgb("unbounded"), [0, 2, 4], atol=1e-12)
    lines = np.array([587.6, 486.1, 656.3])  # [nm]; of the Abbe number, here 40
    d, f, c = made.ior.sample(lines)
    assert d == pytest.approx(1.6, abs=1e-4)
    assert (d - 1.0) / (f - c) == pytest.approx(40.0, rel=2e-3)
    volume["thicknessFactor"] = 0  # thin-walled
    assert shape({"extensions": body})[0].material.thin


def test_what_scatters_inside(shape):
    through = {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 1}}
    volume = {
        "thicknessFactor": 1,
        "attenuationDistance": 0.5,
        "attenuationColor": [1, math.exp(-1), math.exp(-2)],
    }
    scatter = {"multiscatterColor": [0.0, 0.5, 1.0], "scatterAnisotropy": 0.3}
    body = {
        **through,
        "KHR_materials_volume": volume,
        "KHR_materials_volume_scatter": scatter,
    }
    found, warnings = shape({"extensions": body})
    inside = found.interior
    assert not warnings and found.material.transmits and not found.material.thin
    assert found.material.absorption.value == 0.0  # the medium has it
    wanted = Homogeneous.from_albedo((0.0, 0.5, 1.0), 1.0, g=0.3)
    taken = np.array([0.0, 2.0, 4.0])
    absorbed, scattered = (v.to_rgb("unbounded") for v in inside.coefficients(spectral=False))
    np.testing.assert_allclose(absorbed + scattered, taken, atol=1e-9)
    np.testing.assert_allclose(scattered, taken * wanted.albedo.to_rgb(), atol=1e-9)
    assert scattered[2] == pytest.approx(4.0) and inside.phase.g.value == 0.3
    scatter["multiscatterColorFactor"] = scatter.pop("multiscatterColor")  # of a later draft
    scatter["scatterAnisotropy"] = 1
    assert shape({"extensions": body})[0].interior.phase.g.value == 0.99
    del scatter["multiscatterColorFactor"]  # black
    dark = shape({"extensions": body})[0]
    assert dark.interior is None and dark.material.absorption.to_rgb("unbounded")[2] > 3.9
    scatter["multiscatterColor"] = [1, 1, 1]
    volume["thicknessFactor"] = 0
    assert shape({"extensions": body})[0].interior is None  # a sheet has no inside
    scatter["scatterAnisotropy"] = 2
    volume["thicknessFactor"] = 1
    with pytest.raises(SceneError, match="scatterAnisotropy"):
        shape({"extensions": body})


def test_layers(shape):
    made = _front(
        shape(
            {
                "extensions": {
                    "KHR_materials_clearcoat": {"clearcoatFactor": 0.5},
                    "KHR_materials_sheen": {
                        "sheenColorFactor": [0.1, 0.2, 0.3],
                        "sheenRoughnessFactor": 0.4,
                    },
                    "KHR_materials_anisotropy": {
                        "anisotropyStrength": 0.6,
                        "anisotropyRotation": math.pi / 6,
                    },
                    "KHR_materials_iridescence": {
                        "iridescenceFactor": 1,
                        "iridescenceThicknessTexture": {"index": 0},
                    },
                }
            }
        )
    )
    assert (made.clearcoat, made.clearcoat_roughness, made.sheen_roughness) == (0.5, 0.0, 0.4)
    assert made.anisotropy == 0.6 and made.anisotropy_rotation == pytest.approx(30.0)
    thickness = made.iridescence_thickness
    assert isinstance(thickness, Mix) and thickness.amount.channel == "g"
    assert (thickness.first.value, thickness.second.value) == (100.0, 400.0)


def test_directions_of_anisotropy(shape):
    given = _extension("anisotropy", anisotropyStrength=1, anisotropyTexture={"index": 0})
    angles = _front(shape(given)).anisotropy_rotation
    assert angles.filter == "nearest"
    expected = np.degrees(np.arctan2([128 / 127.5 - 1, 1.0], [1.0, -1.0]))
    np.testing.assert_allclose(angles.image, [expected], atol=1e-3)


def test_a_turn_without_an_image_is_counted_from_the_normal_map(shape):
    """KHR_materials_anisotropy: tangents are those of `normalTexture` where there is no TANGENT."""
    given = _extension("anisotropy", anisotropyStrength=1, anisotropyRotation=0.5)
    for more, (mapping, linear) in {
        (0, 0.0): ("uv", None),
        (1, 0.0): ("uv1", np.eye(2)),
        (0, np.pi / 2): ("uv", np.array([[0, -1], [1, 0]])),
    }.items():
        where = {"KHR_texture_transform": {"rotation": more[1], "texCoord": more[0]}}
        base = {"baseColorTexture": {"index": 0}}
        mapped = {
            "normalTexture": {"index": 0, "extensions": where},
            "pbrMetallicRoughness": base,
        }
        front = _front(shape({**given, **mapped}))
        turn = front.material.anisotropy_rotation
        if linear is None:
            assert turn == pytest.approx(np.degrees(0.5))
            continue
        assert turn.mapping == mapping and np.ravel(turn.image) == pytest.approx(np.degrees(0.5))
        np.testing.assert_allclose(turn.to_uv[:2, :2], linear, atol=1e-7)


def test_specular(shape):
    strong = _front(shape(_extension("specular", specularColorFactor=[2, 1, 0])))
    f0 = ((strong.ior.value - 1) / (strong.ior.value + 1)) ** 2
    np.testing.assert_allclose(f0 * strong.specular_color.to_rgb(), [0.08, 0.04, 0.0], atol=1e-9)
    glossy = _front(
        shape(
            _extension(
                "pbrSpecularGlossiness",
                diffuseFactor=[0.1, 0.2, 0.3, 1],
                specularFactor=[0.4, 0.5, 0.6],
                glossinessFactor=0.75,
            )
        )
    )
    assert (glossy.ior.value, glossy.roughness, glossy.metallic) == (0.0, 0.25, 0.0)
    np.testing.assert_allclose(glossy.specular_color.to_rgb(), [0.4, 0.5, 0.6])


def test_alpha(shape):
    textured = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    cut = _front(shape({**textured, "alphaMode": "MASK", "alphaCutoff": 0.5}))
    assert isinstance(cut, Mask) and cut.opacity.image.tolist() == [[1.0, 0.0]]
    blended = _front(shape({**textured, "alphaMode": "BLEND"}))
    np.testing.assert_allclose(np.ravel(blended.opacity.image) / 255.0, [192 / 255, 96 / 255])
    assert isinstance(_front(shape(textured)), GltfSurface)
    faint = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}, "alphaMode": "BLEND"}
    assert _front(shape(faint)).opacity == 0.25


def test_colours_of_vertices(shape):
    found = shape({"alphaMode": "BLEND"}, colours=[(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    surface = _front(found).material
    assert isinstance(surface.base_color.first, MeshAttribute)
    assert found[0].attributes["vertex_color"].tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert found[0].attributes["vertex_alpha"].tolist() == [[1], [1], [1]]


def test_emission(shape):
    strong = _extension("emissive_strength", emissiveStrength=3)
    lamp = shape({"emissiveFactor": [1, 0.5, 0], "doubleSided": True, **strong})[0].emission
    np.testing.assert_allclose(lamp.radiance.to_rgb("emission"), [3.0, 1.5, 0.0])
    assert lamp.two_sided
    assert shape({"emissiveFactor": [0, 0, 0]})[0].emission is None
    plain = {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1]}}
    unlit = shape({**plain, **_extension("unlit")})[0]
    assert isinstance(unlit.material, TwoSided) and isinstance(unlit.material.front, Diffuse)
    np.testing.assert_allclose(unlit.emission.radiance.to_rgb("emission"), [0.2, 0.4, 0.6])
    gone = shape({**plain, **_extension("unlit"), "alphaMode": "MASK", "alphaCutoff": 2.0})[0]
    assert gone.emission.radiance.second.value == gone.material.front.opacity == 0.0


def _tangent_document(build, width=4):
    along = [[0, 1, 0, -1][:width]] * 3
    top = {"images": [{"uri": _uri(PIXEL)}], "textures": [{"source": 0}]}
    document = build(materials=[{"normalTexture": {"index": 0}}, {}], **top)
    attributes = {
        "TEXCOORD_0": document.accessor([(0, 0), (1, 0), (0, 1)]),
        "NORMAL": document.accessor([(0, 0, 1)] * 3),
        "TANGENT": document.accessor(along),
    }
    return document.mesh(material=0, attributes=attributes).mesh(material=1, attributes=attributes)


def test_tangents_are_those_of_the_file(build, read):
    """Where a material looks at them; they are saved and read again."""
    document = _tangent_document(build)
    document.json["nodes"] = [{"mesh": 0}, {"mesh": 1}]
    document.json["scenes"] = [{"nodes": [0, 1]}]
    mapped, plain = read(document).shapes[:2]
    np.testing.assert_array_equal(mapped.tangents, [[0, 1, 0, -1]] * 3)
    assert plain.tangents is None
    with pytest.raises(SceneError, match=r"accessors\[\d\].*VEC3"):
        read(_tangent_document(build, 3))


def test_variants_and_units_by_choice(build, read):
    """-D variant, lumens and multiple_scattering; wrong ones are errors."""
    name, lights = "KHR_materials_variants", "KHR_lights_punctual"
    document = build(materials=[{"name": "a"}, {"name": "b"}])
    variants = {"extensions": {name: {"mappings": [{"material": 1, "variants": [1]}]}}}
    document.mesh(material=0, **variants)
    document.json["extensions"] = {
        name: {"variants": [{"name": "first"}, {"name": "second"}]},
        lights: {"lights": [{"type": "point", "intensity": 683.0}]},
    }
    document.json["extensionsUsed"] = [name, lights]
    document.json["nodes"] += [{"extensions": {lights: {"light": 0}}}]
    document.json["scenes"] = [{"nodes": [0, 1]}]
    usual = read(document)
    assert usual.shapes[0].material.front.name == "a" and "first, second" in usual.warnings[0]
    chosen = read(document, variant="second", lumens=683, multiple_scattering="1")
    surface = chosen.shapes[0].material.front
    assert (surface.name, surface.multiple_scattering, chosen.warnings) == ("b", 1.0, [])
    lumens = spectra.lumens(usual.lights[0].intensity)
    assert (lumens, spectra.watts(chosen.lights[0].intensity)) == pytest.approx((683.0, 1.0))
    for wrong in ({"variant": "third"}, {"lumens": 0}, {"multiple_scattering": "much"}):
        with pytest.raises(SceneError, match=next(iter(wrong))):
            read(document, **wrong)


@pytest.mark.parametrize(
    ("generator", "intensity", "measure", "strength"),
    [
        ("Khronos glTF Blender I/O v4.3.47", 54351.4, spectra.watts, 1000.0),  # 683 / (4 pi)
        ("Khronos glTF Blender I/O v4.3.47", 79.577, spectra.watts, 1000.0),  # "Unitless"
        ("Khronos glTF Blender I/O v3.3.27", 54351.4, spectra.lumens, 683000.0),  # without modes
        ("Khronos Blender glTF 2.0 exporter", 1000.0, spectra.lumens, 4000.0 * math.pi),
        (None, 54351.4, spectra.lumens, 683000.0),
    ],
)
@pytest.mark.parametrize("unlit", [False, True])
def test_lamps_of_blender(build, read, generator, intensity, measure, strength, unlit):
    """Its watts are those of `power=`, and emission stays as strong beside them."""
    name = "KHR_lights_punctual"
    extensions = {"extensions": {"KHR_materials_unlit": {}}} if unlit else {}
    glow = {"emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}}
    document = build(materials=[{**glow, **extensions}])
    document.mesh(material=0)
    document.json["asset"] |= {} if generator is None else {"generator": generator}
    document.json["extensions"] = {name: {"lights": [{"type": "point", "intensity": intensity}]}}
    document.json["extensionsUsed"] = [name, *["KHR_materials_unlit"] * unlit]
    document.json["nodes"] += [{"extensions": {name: {"light": 0}}}]
    document.json["scenes"] = [{"nodes": [0, 1]}]
    scene = read(document)
    sent = 4.0 * math.pi * measure(scene.lights[0].intensity)
    assert sent == pytest.approx(strength, rel=1e-3)
    shown = scene.shapes[0].emission.radiance
    assert measure(shown) == pytest.approx(1.0, rel=1e-3)  # W m^-2 sr^-1, or cd/m^2
    on_a_screen = shown.to_rgb("emission") * 2.0**scene.film.display_exposure
    np.testing.assert_allclose(on_a_screen, 1.0, rtol=1e-6)
    watts = read(document, lumens=intensity).lights[0].intensity
    assert spectra.watts(watts) == pytest.approx(1.0)


def test_a_file_without_lights_has_no_unit(build, read):
    document = build(materials=[{"emissiveFactor": [1, 0.5, 0.25]}])
    scene = read(document.mesh(material=0))
    assert scene.film.display_exposure == 0.0
    np.testing.assert_allclose(scene.shapes[0].emission.radiance.to_rgb("emission"), [1, 0.5, 0.25])


@pytest.mark.parametrize(
    ("material", "place"),
    [
        ({"pbrMetallicRoughness": {"roughnessFactor": 2}}, "roughnessFactor"),
        (_extension("ior", ior=0.5), "KHR_materials_ior.ior"),
        (_extension("clearcoat", clearcoatTexture={"index": 7}), "clearcoatTexture.index"),
        ({"alphaMode": "CUT"}, "alphaMode"),
        (_extension("sheen", sheenColorFactor=[1, 2]), "sheenColorFactor"),
    ],
)
def test_refused(shape, material, place):
    with pytest.raises(SceneError, match=place):
        shape(material)


def test_normals_of_a_coat(shape):
    """A coat has those of its texture, else of the surface, and never those of the base's map."""
    own = _extension(
        "clearcoat", clearcoatFactor=1, clearcoatNormalTexture={"index": 0, "scale": 2}
    )
    made, notes = shape(own)
    surface = made.material.front
    assert not notes and surface.clearcoat_apart == 1.0 and surface.clearcoat_normal_scale == 2.0
    channels = [getattr(surface, f"clearcoat_normal_{x}").channel for x in "xyz"]
    assert channels == ["r", "g", "b"] and surface.uses_tangents
    smooth = _extension("clearcoat", clearcoatFactor=1) | {"normalTexture": {"index": 0}}
    inner = _front(shape(smooth)).material
    assert inner.clearcoat_apart == 1.0 and inner.clearcoat_normal_z == 1.0
    assert _front(shape(_extension("clearcoat", clearcoatFactor=1))).clearcoat_apart == 0.0
