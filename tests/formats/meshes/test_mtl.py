"""Materials of MTL files: what each statement becomes, and what is told."""

from __future__ import annotations

import codecs
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.meshes import mesh
from clpt.formats.reading import EVEN, GREY
from clpt.scene.textures import Bitmap, Product

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
FACE = "f 1/1 2/2 3/3 4/4\n"


@pytest.fixture
def folder(tmp_path):
    """A folder with images; red.png is of red texels."""
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "red.png")
    Image.new("RGB", (2, 2), (128, 130, 250)).save(tmp_path / "normals.png")
    Image.new("L", (2, 2), 128).save(tmp_path / "grey.png")
    Image.new("RGBA", (2, 2), (255, 0, 0, 51)).save(tmp_path / "leaf.png")
    (tmp_path / "maps").mkdir()
    Image.new("RGB", (2, 2), (0, 255, 0)).save(tmp_path / "maps" / "Green Leaf.PNG")
    return tmp_path


@pytest.fixture
def read(folder):
    """Return the mesh of a face with the material `a` of a library, and the warnings."""

    def of(statements, name="a", **options):
        data = statements if isinstance(statements, bytes) else f"newmtl a\n{statements}\n".encode()
        (folder / "a.mtl").write_bytes(data)
        (folder / "a.obj").write_text(f"mtllib a.mtl\n{OBJ}usemtl {name}\n{FACE}", encoding="utf-8")
        made = mesh.read_mesh(folder / "a.obj", **options)
        (one,) = made.meshes
        return one, made.warnings

    return of


def leaf(one):
    """The material of both sides of a mesh."""
    assert one.material.kind == "two_sided" and one.material.back is None
    return one.material.front


def rgb(value):
    """A colour as three numbers."""
    return [value.r, value.g, value.b]


KD = {
    "Kd 0.8 0.2 0.1": [0.8, 0.2, 0.1],
    "Kd .0018 .0018 .0018": [0.0018] * 3,
    "Kd\t0.8\t0.2\t0.1\t": [0.8, 0.2, 0.1],
    "  kd 8e-1 2E-1 .1 # red": [0.8, 0.2, 0.1],
    "Kd 0.4": [0.4] * 3,
    "Kd 0.4 0.2": [0.4, 0.2, 0.4],
    "Kd 0 0 0": [0, 0, 0],
    "Kd 1 0 0\nKd 0 1 0": [0, 1, 0],
    "Kd xyz 0.4124 0.2126 0.0193": [1, 0, 0],
    "Ka 1 1 1\nKd .5 .5 .5\nKs 0 0 0\nNs 250\nNi 1.45\nd 1\nillum 2\nKe 0 0 0": [0.5] * 3,
    "illum 4\nKd .5 .5 .5\nKa 0 0 0\nTf 1.00 1.00 1.00\nNi 1.00": [0.5] * 3,  # of Maya
    "Kd .5 .5 .5\nKs 1 1 1\nNs 0\nillum 2": [0.5] * 3,  # of MeshLab, without its Tr
    "Kd .5 .5 .5\nKs 1 1 1\nNs 10\nillum 1": [0.5] * 3,
    "": [0.6] * 3,
}


@pytest.mark.parametrize("statements", KD)
def test_diffuse_colours(read, statements):
    one, warnings = read(statements)
    assert leaf(one).kind == "diffuse" and leaf(one).name == "a"
    np.testing.assert_allclose(rgb(leaf(one).reflectance), KD[statements], atol=1e-3, rtol=1e-6)
    assert one.emission is None and warnings == []


def test_colours_beyond_the_limits(read):
    one, warnings = read("Kd 1.5 -0.5 0.5")
    assert rgb(leaf(one).reflectance) == [1, 0, 0.5]
    assert warnings == [
        "material 'a': Kd is below 0, which is taken as 0",
        "material 'a': Kd is above 1, which is taken as 1",
    ]


@pytest.mark.parametrize("factor", ["", " 0.5"])
@pytest.mark.parametrize("name", ["paint.rfl", "my paint.rfl"])
def test_colours_by_a_curve(read, folder, factor, name):
    (folder / name).write_text("400 0.2\n700 0.8\n")
    one, _ = read(f"Kd spectral {name}{factor}")
    curve = leaf(one).reflectance
    share = float(factor or 1)
    np.testing.assert_allclose(curve.sample([400, 550, 700]), share * np.array([0.2, 0.5, 0.8]))


KINDS = {
    "Kd .5 .5 .5\nKs .5 .5 .5\nNs 198\nillum 2": ("rough_plastic", {"alpha": 0.1, "int_ior": 1.5}),
    "Kd .5 .5 .5\nKs .5 .5 .5\nNs 198\nNi 1.3": ("rough_plastic", {"alpha": 0.1, "int_ior": 1.3}),
    "Kd .5 .5 .5\nKs .5 .5 .5\nNs 6\nNi 1.0": ("rough_plastic", {"alpha": 0.5, "int_ior": 1.5}),
    "Kd 0 0 0\nKs .9 .6 .2\nNs 198": ("rough_conductor", {"alpha_u": 0.1, "alpha_v": 0.1}),
    "Kd 0 0 0\nillum 3": ("conductor", {}),
    "Kd 0 0 0\nKs .9 .6 .2\nillum 8": ("conductor", {}),
    "Kd .3 .3 .3\nKs .5 .5 .5\nillum 3": ("blend", {"weight": 0.5}),
    "Kd .3 .3 .3\nillum 5": ("plastic", {"int_ior": 1.5}),
    "Kd .3 .3 .3\nKs 1 1 1\nNi 1.3\nillum 5": ("plastic", {"int_ior": 1.3}),
    "Kd .3 .3 .3\nPr .3": ("principled", {"roughness": 0.3, "metallic": 0.0}),
    "Kd .3 .3 .3\nPm 1\nPr 0": ("principled", {"roughness": 0.0, "metallic": 1.0}),
    "Kd .3 .3 .3\nPs .2\nPc .4\nPcr .25": (
        "principled",
        {"sheen": 0.2, "clearcoat": 0.4, "clearcoat_gloss": 0.75, "roughness": 0.5},
    ),
    "Kd .3 .3 .3\naniso .5\nanisor 0": ("principled", {"anisotropic": 0.5}),
    "Kd .3 .3 .3\nPr 2": ("principled", {"roughness": 1.0}),
}


@pytest.mark.parametrize("statements", KINDS)
def test_illumination_models(read, statements):
    one, warnings = read(statements)
    kind, values = KINDS[statements]
    assert leaf(one).kind == kind and warnings == []
    for name, expected in values.items():
        value = getattr(leaf(one), name)
        assert getattr(value, "value", value) == pytest.approx(expected), name


@pytest.mark.parametrize("model", [4, 6, 7, 9])
@pytest.mark.parametrize("further", ["", "d .3\nKs 0 0 0\nKd .8 .8 .8"])
def test_glass(read, model, further):
    one, warnings = read(f"illum {model}\nNi 1.45\nTf 1 .5 1\n{further}")
    glass = one.material
    assert (glass.kind, glass.int_ior.value, glass.ext_ior.value) == ("dielectric", 1.45, 1.0)
    assert rgb(glass.specular_transmittance) == [1, 0.5, 1] and warnings == []
    one, _ = read(f"illum {model}\nNi 1.45\nPr .4")
    assert one.material.kind == "rough_dielectric"
    assert one.material.alpha_u == pytest.approx(0.16)
    one, warnings = read(f"illum {model}\nNi 1.45\nmap_Pr grey.png\nPm 0\nmap_Kd red.png")
    squared = one.material.alpha_u
    assert squared.kind == "product" and squared.first is squared.second
    assert warnings == ["left out of its materials: map_Kd"]
    assert read(f"illum {model}\nNi 1.45\nPr 0")[0].material.kind == "dielectric"


def test_glass_without_an_index(read):
    assert read("illum 7")[0].material.int_ior.value == 1.5
    for statements in ("illum 9", "illum 7\nNi 1.0", "illum 4", "illum 6\nNi 1"):
        one, warnings = read(f"{statements}\nd .5")
        assert leaf(one).kind == "mask"
        told = f"{statements[:7]} is glass where Ni is above 1, which it is not"
        assert warnings == [f"material 'a': {told}"]


def test_a_mirror_keeps_its_sum(read):
    """illum 3 is Kd scattered plus Ks mirrored."""
    blend = leaf(read("illum 3\nKd .3 .2 .1\nKs .5 .25 .5")[0])
    np.testing.assert_allclose(0.5 * np.array(rgb(blend.first.reflectance)), [0.3, 0.2, 0.1])
    mirrored = 0.5 * np.array(rgb(blend.second.specular_reflectance))
    np.testing.assert_allclose(mirrored, [0.5, 0.25, 0.5])


OPACITY = {
    "d .3": (0.3, ""),
    "Tr .7": (0.3, ""),
    "d .3\nTr .3": (0.3, ""),
    "d -halo .3": (0.3, "d -halo is rendered as d"),
    "d 0": (0.0, "d is 0: it is not seen"),
    "d 1": (None, ""),
    "d 1.5": (None, ""),
    "Tr 0": (None, ""),
    "Tr 1": (None, "Tr 1 without d is taken as opaque"),
    "d 1\nTr 1": (None, ""),
}


@pytest.mark.parametrize("statements", OPACITY)
def test_opacity(read, statements):
    one, warnings = read(f"Kd .5 .5 .5\n{statements}")
    opacity, told = OPACITY[statements]
    if opacity is None:
        assert leaf(one).kind == "diffuse"
    else:
        assert leaf(one).opacity == pytest.approx(opacity) and leaf(one).material.kind == "diffuse"
    assert told in "".join(warnings) and bool(told) == bool(warnings)


@pytest.mark.parametrize(
    ("statement", "channel"),
    [
        ("map_d grey.png", "luminance"),
        ("map_d leaf.png", "a"),
        ("map_d -imfchan r leaf.png", "r"),
        ("map_d -imfchan m leaf.png", "a"),
        ("map_d -imfchan l leaf.png", "luminance"),
    ],
)
def test_images_of_opacity(read, folder, statement, channel):
    one, _ = read(f"Kd .5 .5 .5\n{statement}")
    image = leaf(one).opacity
    assert (image.kind, image.raw, image.channel) == ("bitmap", True, channel)
    one, _ = read(f"Kd .5 .5 .5\nd .5\n{statement}")
    assert leaf(one).opacity.kind == "product" and leaf(one).opacity.second.value == 0.5


def test_emission(read):
    one, warnings = read("Ke 5 4 3")
    assert rgb(one.emission.radiance) == [5, 4, 3] and one.emission.two_sided
    assert read("Ke 0 0 0")[0].emission is None
    assert read("Ke 2")[0].emission.radiance.r == 2 and warnings == []
    assert read("map_Ke red.png")[0].emission.radiance.kind == "bitmap"
    one, _ = read("Ke 5 5 5\nmap_Ke red.png")
    assert rgb(one.emission.radiance.second) == [5, 5, 5]
    one, warnings = read("Ke 0 0 0\nmap_Ke red.png")
    assert one.emission.radiance.kind == "bitmap"
    assert warnings == ["material 'a': Ke is 0 beside map_Ke: the image alone counts"]
    one, _ = read("Ke 5 5 5\nd .3")  # a surface that is cut away does not shine
    assert one.emission.radiance.second.value == 0.3


def image(one):
    """The image of a diffuse colour."""
    value = leaf(one).reflectance
    return value.first if isinstance(value, Product) else value


def test_kd_times_its_image(read):
    one, warnings = read("Kd .5 .25 1\nmap_Kd red.png")
    product = leaf(one).reflectance
    assert product.first.image.name == "red.png" and not product.first.raw and product.rgb
    assert rgb(product.second) == [0.5, 0.25, 1] and warnings == []
    for white in ("", "Kd 1 1 1", "Kd 1"):
        assert isinstance(leaf(read(f"{white}\nmap_Kd red.png")[0]).reflectance, Bitmap)
    one, warnings = read("Kd 0 0 0\nmap_Kd red.png")
    assert isinstance(leaf(one).reflectance, Bitmap)
    assert warnings == ["material 'a': Kd is 0 beside map_Kd: the image alone counts"]


NAMES = {
    "red.png": "red.png",
    "./red.png": "red.png",
    r".\red.png": "red.png",
    "RED.PNG": "red.png",
    '"red.png"': "red.png",
    "'red.png'": "red.png",
    "red.png # the best": "red.png",
    "maps/Green Leaf.PNG": "Green Leaf.PNG",
    r"maps\Green Leaf.PNG": "Green Leaf.PNG",
    r"MAPS\\green leaf.png": "Green Leaf.PNG",
    r'"maps\Green Leaf.PNG"': "Green Leaf.PNG",
    r"C:\Users\me\textures\red.png": "red.png",
    "/nowhere/red.png": "red.png",
    "-s 2 2 2 maps/Green Leaf.PNG": "Green Leaf.PNG",
    "red.png -s 2 2 2": "red.png",
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_images(read, name):
    one, warnings = read(f"map_Kd {name}")
    assert image(one).image.samefile(one_path(one)) and image(one).image.name == NAMES[name]
    assert warnings == []
    if "-s" in name:
        assert image(one).to_uv[0, 0] == 2.0


def one_path(one):
    """The path of an image, which exists."""
    assert image(one).image.is_file()
    return image(one).image


OPTIONS = {
    "-s 2 3 4": {"to_uv": [[2, 0, 0], [0, 3, 0], [0, 0, 1]]},
    "-s 2": {"to_uv": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]},
    "-o .1 .2": {"to_uv": [[1, 0, 0.1], [0, 1, 0.2], [0, 0, 1]]},
    "-s 2 3 1 -o .1 0 0": {"to_uv": [[2, 0, 0.1], [0, 3, 0], [0, 0, 1]]},
    "-O 1e-1 -S 2 2 2": {"to_uv": [[2, 0, 0.1], [0, 2, 0], [0, 0, 1]]},
    "-clamp on": {"wrap": "clamp"},
    "-clamp off": {"wrap": "repeat"},
    "-blendu off -blendv off": {"filter": "nearest"},
    "-blendu on -blendv off": {"filter": "bilinear"},
    "-imfchan g": {"channel": "g"},
    "-texres 512 -bm 1 -mm 0 1 -boost 0 -cc off -t 0 0 0": {"filter": "bilinear"},
}


@pytest.mark.parametrize("options", OPTIONS)
def test_options_of_images(read, options):
    one, warnings = read(f"map_Kd {options} red.png")
    for name, expected in OPTIONS[options].items():
        np.testing.assert_array_equal(getattr(image(one), name), expected)
    assert image(one).image.name == "red.png" and warnings == []


def test_base_and_gain_of_an_image(read):
    """-mm base gain: base + gain value, linear."""
    texels = image(read("map_Kd -mm .25 .5 red.png")[0])
    assert texels.raw and texels.image[0, 0].tolist() == [0.75, 0.25, 0.25]


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("map_Kd -t 1 1 1 red.png", "map_Kd -t"),
        ("map_Kd -boost 2 red.png", "map_Kd -boost"),
        ("map_Kd -cc on red.png", "map_Kd -cc"),
        ("map_Kd -imfchan z red.png", "map_Kd -imfchan"),
        ("refl -type sphere red.png", "refl"),
        ("disp red.png", "disp"),
        ("map_disp red.png", "map_disp"),
        ("decal red.png", "decal"),
        ("map_Ns red.png", "map_Ns"),
        ("map_aat on", "map_aat"),
        ("map_Ka grey.png", "map_Ka"),
        ("map_Kd grey.png\nmap_Ka red.png", "map_Ka"),
        ("Tf .5 .5 .5", "Tf"),
        ("Km 1", "Km"),
        ("hello world", "hello"),
        ("refl red.png\ndisp red.png", "refl, disp"),
    ],
)
def test_what_is_left_out_is_told(read, statement, told):
    assert read(statement)[1] == [f"left out of its materials: {told}"]


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            ["newmtl a\n", "Kd ", "Ks ", "Ns ", "d ", "illum ", "map_Kd ", "map_d ", "bump ", "Pr ",
             "red.png", "-s ", "-o ", "-mm ", "-bm ", "-imfchan ", "-clamp on ", "spectral ",
             "xyz ", "1 ", "0 ", ".5 ", "-1 ", "7 ", "9e99 ", "nan ", "#",
             "\n", "\t", '"', "\\", "\0", "é"]
        ),
        max_size=40,
    )
)  # fmt: skip
def test_no_text_crashes(tmp_path_factory, words):
    folder = tmp_path_factory.mktemp("mtl")
    Image.new("RGB", (2, 2), (255, 0, 0)).save(folder / "red.png")
    (folder / "a.mtl").write_text("newmtl a\n" + "".join(words), encoding="utf-8")
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{OBJ}usemtl a\n{FACE}")
    try:
        mesh.read_mesh(folder / "a.obj")
    except SceneError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    "statement", ["map_Ka red.png\nmap_Kd red.png", "Tf 1 1 1", "Ka .2 .2 .2", "sharpness 60"]
)
def test_what_asks_for_nothing_is_not_told(read, statement):
    assert read(statement)[1] == []


def test_normals_from_images(read):
    for key in ("map_Bump", "bump", "map_bump"):
        one, warnings = read(f"{key} -bm .1 -imfchan r grey.png")
        assert leaf(one).kind == "bump_map" and leaf(one).scale == pytest.approx(0.1)
        assert leaf(one).height.raw and leaf(one).height.channel == "r" and warnings == []
    one, warnings = read("map_Bump -bm .5 normals.png")
    assert leaf(one).kind == "normal_map" and leaf(one).scale == 0.5 and leaf(one).map.raw
    assert leaf(one).along_v
    assert warnings == ["material 'a': map_Bump looks like a normal map, and is read as one"]
    one, warnings = read("norm normals.png\nmap_Bump grey.png\nd .5")
    assert leaf(one).material.kind == "normal_map" and warnings == []
    assert leaf(one).material.along_v


def test_images_of_physical_materials(read):
    one, warnings = read(
        "Kd 1 1 1\nmap_Kd red.png\nmap_Pr grey.png\nPm .5\nmap_Pm -imfchan b red.png"
    )
    surface = leaf(one)
    assert surface.base_color.kind == "bitmap" and surface.roughness.raw
    assert surface.metallic.first.channel == "b" and surface.metallic.second.value == 0.5
    one, warnings = read("Pm 0\nmap_Pm grey.png")
    assert leaf(one).metallic.kind == "bitmap" and len(warnings) == 1


def test_ks_times_its_image(read):
    one, _ = read("Kd .5 .5 .5\nKs .5 .5 .5\nNs 10\nmap_Ks red.png")
    assert leaf(one).specular_reflectance.kind == "product"
    assert leaf(read("Kd .5 .5 .5\nKs 0 0 0\nNs 10\nmap_Ks red.png")[0]).kind == "diffuse"


MISSING = {
    "map_Kd no.png": "map_Kd: there is no file 'no.png'",
    "map_Kd": "map_Kd: there is no file ''",
    "map_Kd maps": "map_Kd: there is no file 'maps'",
    "map_Kd ../../../no.png": "there is no file '../../../no.png'",
    "map_Kd no\0.png": "there is no file",
    "map_Kd a.mtl": "map_Kd: unknown image suffix '.mtl'",
    "norm no.png": "norm: there is no file 'no.png'",
    "map_d no.png": "map_d: there is no file 'no.png'",
    "map_Bump no.png": "map_Bump: there is no file 'no.png'",
    "map_Pr no.png": "map_Pr: there is no file 'no.png'",
    "map_Ke no.png": "map_Ke: there is no file 'no.png'",
}


@pytest.mark.parametrize("statement", MISSING)
def test_images_that_are_not_there(read, folder, statement):
    with pytest.raises(SceneError, match=MISSING[statement]) as caught:
        read(f"Kd 1 1 1\n{statement}")
    assert caught.value.line == 3 and caught.value.file == folder / "a.mtl"
    one, warnings = read(f"Kd 1 1 1\n{statement}", missing="grey")
    assert len(warnings) == 1 and "grey stands for it" in warnings[0]
    if statement.startswith("map_Kd"):
        assert leaf(one).reflectance.image is GREY
    if statement.startswith("norm"):
        assert leaf(one).map.image is EVEN
    scene = load(folder / "a.obj", missing_textures="grey")
    assert scene.warnings == warnings


BAD = {
    "Kd 0,5 0,5 0,5": "Kd: write numbers with a decimal point, not a comma: '0,5 0,5 0,5'",
    "Kd red": "Kd: needs numbers, not 'red'",
    "Kd": "Kd: needs finite numbers, not ''",
    "Kd nan 0 0": "Kd: needs finite numbers",
    "Kd spectral no.rfl": "Kd: there is no file 'no.rfl'",
    "d x": "d: needs numbers",
    "Ns x": "Ns: needs numbers",
    "map_Kd -s red.png": "map_Kd: -s needs 3 numbers",
    "map_Kd -mm 1 red.png": "map_Kd: -mm needs 2 numbers",
    "map_Kd -s 0,5 0,5 red.png": "map_Kd: write numbers with a decimal point",
}


@pytest.mark.parametrize("statement", BAD)
def test_bad_statements(read, statement):
    with pytest.raises(SceneError, match=BAD[statement]) as caught:
        read(f"Ks .5 .5 .5\n{statement}")
    assert caught.value.line == 3 and "\n" not in str(caught.value)


RED = "newmtl red\nKd 1 0 0\n"
WAYS = {
    "plain": RED.encode(),
    "CRLF": RED.replace("\n", "\r\n").encode(),
    "CR": RED.replace("\n", "\r").encode(),
    "tabs": RED.replace(" ", "\t").encode(),
    "indented": b"  newmtl red\n\tKd 1 0 0\n",
    "upper case": b"NEWMTL red\nKD 1 0 0\n",
    "comments": b"# a\nnewmtl red # b\n#c\nKd 1 0 0 # d\n",
    "UTF-8 mark": codecs.BOM_UTF8 + RED.encode(),
    "UTF-16": RED.encode("utf-16"),
    "Latin-1": "# geprüft\n".encode("latin-1") + RED.encode(),
    "twice": b"newmtl red\nKd 0 0 1\n" + RED.encode(),
    "others": b"newmtl blue\nKd 0 0 1\n" + RED.encode() + b"newmtl green\nKd 0 1 0\n",
}


@pytest.mark.parametrize("name", WAYS)
def test_ways_to_write_a_library(read, name):
    one, warnings = read(WAYS[name], "red")
    assert rgb(leaf(one).reflectance) == [1, 0, 0] and warnings == []


@pytest.mark.parametrize(
    ("known", "used"),
    [
        ("dark red", "dark red"),
        ("Material #25", "Material #25"),
        ("red", "red # of the roof"),
        ("red # of the roof", "red"),
        ("größe", "größe"),
        ("a:b/c.001", "a:b/c.001"),
        ("(null)", "(null)"),
    ],
)
def test_names_of_materials(read, known, used):
    one, warnings = read(f"newmtl {known}\nKd 1 0 0\n".encode(), used)
    assert rgb(leaf(one).reflectance) == [1, 0, 0] and warnings == []


def test_names_that_differ_behind_a_hash(folder):
    text = "newmtl Material #1\nKd 1 0 0\nnewmtl Material #2\nKd 0 0 1\n"
    (folder / "a.mtl").write_text(text)
    face = "".join(f"usemtl Material #{i}\n{FACE}" for i in (2, 1))
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{OBJ}{face}")
    made = mesh.read_mesh(folder / "a.obj").meshes
    assert [rgb(leaf(one).reflectance) for one in made] == [[0, 0, 1], [1, 0, 0]]


@pytest.mark.parametrize(
    "lines",
    [
        "mtllib a.mtl b.mtl",
        "mtllib a.mtl\nmtllib b.mtl",
        "mtllib b.mtl a.mtl # both",
        'mtllib "a.mtl" "b.mtl"',
        "mtllib a.mtl B.MTL",
        r"mtllib .\a.mtl .\b.mtl",
        "mtllib a.mtl my colours.mtl",
        "mtllib my colours.mtl",
        r"mtllib a.mtl my\ colours.mtl",
        "mtllib a.mtl\tb.mtl",
        "mtllib a.mtl \\\nb.mtl",
    ],
)
def test_libraries(folder, lines):
    (folder / "a.mtl").write_text("newmtl other\nKd 1 0 0\n")
    for name in ("b.mtl", "my colours.mtl"):
        (folder / name).write_text("newmtl green\nKd 0 1 0\n")
    (folder / "a.obj").write_text(f"{lines}\n{OBJ}usemtl green\n{FACE}")
    made = mesh.read_mesh(folder / "a.obj")
    assert rgb(leaf(made.meshes[0]).reflectance) == [0, 1, 0] and made.warnings == []


def test_images_beside_the_library_or_the_mesh(folder):
    (folder / "lib").mkdir()
    Image.new("RGB", (1, 1)).save(folder / "lib" / "own.png")
    for name in ("own.png", "red.png"):
        (folder / "lib" / "a.mtl").write_text(f"newmtl a\nmap_Kd {name}\n")
        (folder / "a.obj").write_text(f"mtllib lib\\a.mtl\n{OBJ}usemtl a\n{FACE}")
        assert image(mesh.read_mesh(folder / "a.obj").meshes[0]).image.name == name


def test_a_library_behind_its_use_and_one_that_is_not_there(folder):
    (folder / "a.mtl").write_text("newmtl green\nKd 0 1 0\n")
    (folder / "a.obj").write_text(f"{OBJ}usemtl green\n{FACE}mtllib no.mtl a.mtl\n")
    made = mesh.read_mesh(folder / "a.obj")
    assert rgb(leaf(made.meshes[0]).reflectance) == [0, 1, 0]
    assert made.warnings == ["there is no library 'no.mtl': what it holds is left out"]


def test_materials_of_one_kind_are_told_together(folder):
    (folder / "a.mtl").write_text(
        "".join(f"newmtl m{i}\nKd 0 0 0\nmap_Kd red.png\nrefl red.png\n" for i in range(9))
    )
    uses = "".join(f"usemtl {name}{i}\n{FACE}" for name in "mx" for i in range(9))
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{OBJ}{uses}")
    names = ", ".join(f"'x{i}'" for i in range(6))
    assert mesh.read_mesh(folder / "a.obj").warnings == [
        f"no library holds the material {names} and 3 more; grey stands for it",
        "left out of its materials: refl",
        "material 'm0' and 8 more: Kd is 0 beside map_Kd: the image alone counts",
    ]


def test_materials_that_no_face_uses_are_not_looked_at(read):
    one, warnings = read(b"newmtl a\nKd 1 0 0\nnewmtl b\nKd x\nmap_Kd no.png\nrefl no.png\n")
    assert rgb(leaf(one).reflectance) == [1, 0, 0] and warnings == []


def test_images_without_coordinates_are_told(folder):
    (folder / "a.mtl").write_text("newmtl a\nmap_Kd red.png\n")
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{OBJ}usemtl a\nf 1 2 3\n")
    told = ["material 'a' has images, but its faces no coordinates"]
    assert mesh.read_mesh(folder / "a.obj").warnings == told


def test_without_materials_no_library_is_read(read):
    one, warnings = read("map_Kd no.png\nKe 5 5 5", materials=False)
    assert one.material.front.name == "grey" and one.emission is None and warnings == []


def test_in_a_scene_the_entry_comes_first(read, folder):
    """A material in scene.json replaces the file's, with its light."""
    read("Kd 1 0 0\nKe 5 5 5")
    shape = {"type": "mesh", "file": "a.obj"}
    shapes = [shape, {**shape, "material": {"type": "diffuse"}}]
    scene = {"camera": {"type": "perspective"}, "shapes": shapes}
    (folder / "scene.json").write_text(json.dumps(scene))
    first, second = load(folder / "scene.json").shapes
    assert rgb(leaf(first).reflectance) == [1, 0, 0] and first.emission is not None
    assert second.material.kind == "diffuse" and second.emission is None


def test_a_grey_image_of_16_bits_is_decoded(read, folder):
    """.50196 through sRGB is .2159 (IEC 61966-2-1)."""
    from clpt import images

    Image.fromarray(np.full((2, 2), 32896, np.uint16)).save(folder / "deep.png")
    path = image(read("map_Kd deep.png")[0]).image
    np.testing.assert_allclose(images.read(path), 0.2159, atol=1e-4)
