"""Files of PBRT versions 2 and 3: their words, defaults and formulas, by pbrt-v3's sources."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.pbrt import old_words
from clpt.scene import integrators, materials, textures
from clpt.spectra import Constant, RGBIlluminant

DISK = 'Shape "disk"'


@pytest.fixture
def read(tmp_path):
    """Load a world of version 3, and options before it."""

    def of(world: str, options: str = "", **more):
        path = tmp_path / "scene.pbrt"
        path.write_text(f"{options}\nWorldBegin\n{world}\nWorldEnd\n")
        return load(path, **more)

    return of


def level(value) -> float:
    return value.value if isinstance(value, Constant) else value


def surface(read, text: str):
    """The material of a disk, without its other side."""
    made = read(f"Material {text}\n{DISK}").shapes[0].material
    return made.front if isinstance(made, materials.TwoSided) else made


@pytest.mark.parametrize("text, old", [
    ("WorldEnd", True), ("# WorldEnd", False), ('Film "image"', True), ('Film "rgb"', False),
    ('Material "matte" "color Kd" [1 1 1]', True), ('# Material "matte"', False),
    ('Material "diffuse" "rgb reflectance" [1 1 1]', False), ('SurfaceIntegrator "path"', True),
    ('MakeNamedMaterial "a" "string type" ["plastic"]', True),
    ('Texture "a" "color" "scale"', True),
    ('MakeNamedMaterial "matte" "string type" "diffuse"', False),
])  # fmt: skip
def test_the_version_of_a_file(text, old):
    assert old_words.is_old(f"# a\n{text}\n".encode()) == old


def test_rows_name_their_sources():
    for table in (old_words.DIRECTIVES, old_words.KINDS, old_words.PARAMETERS, old_words.IGNORED):
        assert all("src/" in row[-1] for row in table)


def test_options_have_the_defaults_of_their_version(read):
    scene = read(DISK)
    assert (scene.film.width, scene.film.height) == (640, 480)
    assert isinstance(scene.film.filter, integrators.Box) and scene.film.exposure == 1.0
    scene = read(
        DISK,
        'Film "image" "float scale" 2 "integer xresolution" 8\nSampler "lowdiscrepancy"\n'
        'Camera "environment" "float shutteropen" 1 "float shutterclose" 1\nAccelerator "kdtree"\n'
        'PixelFilter "gaussian" "float xwidth" 3 "float ywidth" 3 "float alpha" 0.5\n'
        'SurfaceIntegrator "photonmap" "integer nused" 3\nRenderer "sampler"',
    )
    assert scene.film.exposure == 2.0 and scene.camera.kind == "spherical"
    assert scene.film.filter.stddev == pytest.approx(1.0) and scene.film.filter.radius == 3.0
    assert isinstance(scene.integrator, integrators.Path)
    assert any("photonmap" in text and "read as path" in text for text in scene.warnings)


def test_direct_light_with_and_without_mirrors(read):
    chosen = 'Integrator "directlighting" "string strategy" "all"'
    assert isinstance(read(DISK, chosen).integrator, integrators.Direct)
    scene = read(f'Material "mirror"\n{DISK}', chosen)
    assert isinstance(scene.integrator, integrators.Path)
    assert any("mirrors or glass" in text for text in scene.warnings)


def test_commas_between_numbers(read):
    scene = read(
        'Translate 1, 2, 3\nTexture "a, b" "color" "constant" "color value" [.1, .2 ,.3]\n'
        f'Material "matte" "texture Kd" "a, b"\n{DISK}'
    )
    assert np.allclose(np.asarray(scene.shapes[0].to_world)[:3, 3], [1, 2, 3])
    assert tuple(scene.shapes[0].material.front.reflectance.to_rgb()) == pytest.approx(
        (0.1, 0.2, 0.3)
    )


def test_lights_have_their_own_values(read):
    lights = read(
        'LightSource "infinite" "color L" [.5 1 2] "color scale" [2 2 1] "integer samples" 4\n'
        'LightSource "point" "rgb I" [1 1 1] "float scale" 3\n'
        'LightSource "point" "spectrum I" [300 4 900 4]\n'
        'LightSource "distant" "blackbody L" [4000 2.5]'
    ).lights
    assert lights[0].radiance == RGBIlluminant(1.0, 2.0, 2.0)
    assert lights[1].intensity == RGBIlluminant(3.0, 3.0, 3.0)
    assert np.allclose(lights[2].intensity.sample(np.array([400.0, 600.0])), 4.0)
    body = lights[3].irradiance.sample(np.linspace(600.0, 850.0, 500))
    assert body.max() == pytest.approx(2.5, rel=1e-3)  # at 724 nm


def test_maps_in_latitude_and_longitude(read, tmp_path):
    """A texel of each corner of pbrt's map shines from where pbrt-v3 has it: +z is up there."""
    image = np.zeros((16, 32, 3), np.float32)
    image[2, 5] = 1.0
    images.write(tmp_path / "map.exr", image)
    for transform in ("", "Rotate 90 1 0 0", "Scale -1 1 1"):
        light = read(
            f'{transform}\nLightSource "infinite" "string mapname" "map.exr" "color L" [2 2 2]'
        ).lights[0]
        theta, phi = (2.5) * np.pi / 16, 5.5 * 2 * np.pi / 32
        wanted = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        turn = {"": np.eye(3), "Scale -1 1 1": np.diag([-1.0, 1, 1])}
        wanted = turn.get(transform, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])) @ wanted
        row, column = np.unravel_index(np.argmax(light.image[..., 0]), light.image.shape[:2])
        t, p = row * np.pi / 15, (column + 0.5) * 2 * np.pi / 32
        ours = np.array([np.sin(p) * np.sin(t), np.cos(t), -np.cos(p) * np.sin(t)])
        seen = np.asarray(light.to_world)[:3, :3] @ ours
        assert seen @ wanted > np.cos(1.5 * np.pi / 16)
        assert light.image.max() > 1.0  # times L


def test_materials(read):
    matte = surface(read, '"matte" "color Kd" [.2 .4 .6]')
    assert tuple(matte.reflectance.to_rgb()) == pytest.approx((0.2, 0.4, 0.6))
    mirror = surface(read, '"mirror" "color Kr" [.9 .8 .7]')
    assert isinstance(mirror, materials.Conductor) and level(mirror.eta) == 0.0
    assert tuple(mirror.specular_reflectance.to_rgb()) == pytest.approx((0.9, 0.8, 0.7))
    glass = surface(read, '"glass" "float index" 1.3 "color Kt" [.5 .5 .5]')
    assert level(glass.int_ior) == 1.3 and isinstance(glass, materials.Dielectric)
    rough = surface(read, '"glass" "float uroughness" .1 "float vroughness" .1')
    assert rough.alpha_u == pytest.approx(0.46176, abs=1e-4)
    metal = surface(read, '"metal" "float roughness" .2 "bool remaproughness" "false"')
    assert metal.alpha_u == pytest.approx(0.2)
    leaf = surface(
        read, '"translucent" "color Ks" [0 0 0] "color Kd" [1 1 1] "color reflect" [.2 .2 .2]'
    )
    assert leaf.reflectance.to_rgb()[0] == pytest.approx(0.2)
    assert leaf.transmittance.to_rgb()[0] == pytest.approx(0.5)
    disney = surface(read, '"disney" "color color" [.1 .2 .3] "float metallic" 1')
    assert isinstance(disney, materials.Principled) and disney.sheen_tint == 0.5
    assert isinstance(surface(read, '"none"'), materials.Null)
    assert surface(read, '"kdsubsurface" "color Kd" [.5 .5 .5]') is not None


def parts(made, share=1.0):
    """The leaves of a blend and their shares."""
    if isinstance(made, materials.Blend):
        yield from parts(made.first, share * (1.0 - made.weight))
        yield from parts(made.second, share * made.weight)
    else:
        yield share, made


@pytest.mark.parametrize("factors", [(0.25, 0.25), (0.5, 0.5), (0.8, 0.1), (0.1, 0.8), (0.3, 0.0)])
def test_plastic_is_a_sum_of_lobes(read, factors):
    """Each leaf's factor times its share is the lobe's: .25 and .25 of the file stay so."""
    kd, ks = factors
    made = surface(read, f'"plastic" "color Kd" [{kd} {kd} {kd}] "color Ks" [{ks} {ks} {ks}]')
    sums = {"diffuse": 0.0, "rough_conductor": 0.0}
    for share, leaf in parts(made):
        name = "reflectance" if leaf.kind == "diffuse" else "specular_reflectance"
        value = getattr(leaf, name)
        value = value if isinstance(value, float) else value.to_rgb()[0]
        assert value <= 1.0
        sums[leaf.kind] += share * value
        if leaf.kind != "diffuse":
            assert (level(leaf.eta), level(leaf.k)) == (1.5, 0.0)
            assert leaf.alpha_u == pytest.approx(0.46176, abs=1e-4)
    assert sums["diffuse"] == pytest.approx(kd) and sums["rough_conductor"] == pytest.approx(ks)


def test_uber_is_a_sum_with_holes(read):
    text = '"uber" "color opacity" [.5 .5 .5] "color Kd" [.2 .2 .2] "color Kr" [.1 .1 .1]'
    made = surface(read, text)
    assert isinstance(made, materials.Mask) and made.opacity == 0.5
    inside = made.material.front
    assert {leaf.kind for _, leaf in parts(inside)} == {"diffuse", "rough_conductor", "conductor"}


def test_a_sum_above_one_is_told(read):
    scene = read(f'Material "plastic" "color Kd" [.9 .9 .9] "color Ks" [.9 .9 .9]\n{DISK}')
    assert any("1.8 in all" in text for text in scene.warnings)


def test_a_mix_counts_its_first(read):
    text = (
        'MakeNamedMaterial "a" "string type" "matte" "color Kd" [.8 .8 .8]\n'
        'MakeNamedMaterial "b" "string type" "matte" "color Kd" [.2 .2 .2]\n'
        'Material "mix" "color amount" [.25 .25 .25] "string namedmaterial1" "a" '
        f'"string namedmaterial2" "b"\n{DISK}'
    )
    made = read(text).shapes[0].material
    albedo = sum(share * leaf.front.reflectance.to_rgb()[0] for share, leaf in parts(made))
    assert albedo == pytest.approx(0.25 * 0.8 + 0.75 * 0.2)


def test_names_that_are_defined_again_count_from_there(read):
    paint = 'Texture "t" "color" "constant" "color value" [{0} {0} {0}]\n'
    named = 'MakeNamedMaterial "m" "string type" "matte" "texture Kd" "t"\nNamedMaterial "m"\n'
    part = 'ObjectBegin "o"\nShape "sphere" "float radius" {0}\nObjectEnd\nObjectInstance "o"\n'
    scene = read(
        "".join(paint.format(v) + named + DISK + "\n" + part.format(v) for v in (0.2, 0.6))
    )
    disks = [one for one in scene.shapes if one.kind == "disk"]
    assert [one.material.front.reflectance.to_rgb()[0] for one in disks] == pytest.approx(
        [0.2, 0.6]
    )
    groups = [one.group for one in scene.shapes if one.kind == "instance"]
    assert [group.shapes[0].radius for group in groups] == [0.2, 0.6]


def test_transform_begin_keeps_transforms_alone(read):
    scene = read(f'TransformBegin\nTranslate 5 0 0\nMaterial "mirror"\nTransformEnd\n{DISK}')
    assert np.allclose(np.asarray(scene.shapes[0].to_world)[:3, 3], 0.0)
    assert scene.shapes[0].material.front.kind == "conductor"


@pytest.mark.parametrize("text, area", [
    ('"cone" "float radius" 3 "float height" 4', np.pi * 3 * 5),
    ('"cone" "float radius" 3 "float height" 4 "float phimax" 90', np.pi * 3 * 5 / 4),
    ('"hyperboloid" "point p1" [2 0 -1] "point p2" [2 0 2]', 2 * np.pi * 2 * 3),
    ('"hyperboloid" "point p1" [3 0 0] "point p2" [1 0 0]', np.pi * 8),
    ('"paraboloid" "float radius" 2 "float zmax" 1', 8 * np.pi / 3 * (2**1.5 - 1)),
    ('"heightfield" "integer nu" 2 "integer nv" 3 "float Pz" [0 0 0 0 0 0]', 1.0),
])  # fmt: skip
def test_quadrics_are_meshes(read, text, area):
    """Areas of surfaces of revolution; of the paraboloid the integral of 4 pi sqrt(z + 1)."""
    mesh = read(f"Shape {text}").shapes[0]
    points = mesh.vertices[mesh.faces].astype(float)
    cross = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    assert 0.5 * np.linalg.norm(cross, axis=1).sum() == pytest.approx(area, rel=2e-3)
    if mesh.normals is not None:
        assert (np.einsum("fx,fcx->fc", cross, mesh.normals[mesh.faces]) > 0.0).all()


def test_textures(read, tmp_path):
    images.write(tmp_path / "a.png", np.full((2, 2, 3), 0.5, np.float32))
    image = 'Texture "i" "color" "imagemap" "string filename" "a.png" '
    for more, raw in (("", False), ('"bool gamma" "false"', True), ('"float gamma" 2.2', True)):
        made = surface(read, f'"matte"\n{image}{more}\nMaterial "matte" "texture Kd" "i"')
        assert made.reflectance.raw == raw
    scaled = 'Texture "s" "color" "scale" "texture tex1" "i" "color tex2" [.5 .5 .5]'
    made = surface(read, f'"matte"\n{image}\n{scaled}\nMaterial "matte" "texture Kd" "s"')
    assert isinstance(made.reflectance, textures.Product)
    even = 'Texture "s" "color" "scale" "color tex1" [.4 .4 .4] "color tex2" [.5 .5 .5]'
    made = surface(read, f'"matte"\n{even}\nMaterial "matte" "texture Kd" "s"')
    assert made.reflectance.to_rgb()[0] == pytest.approx(0.2)
    bump = '"matte" "texture bumpmap" "f"'
    height = 'Texture "f" "float" "fbm"\n'
    made = read(f"{height}Material {bump}\n{DISK}").shapes[0].material
    assert isinstance(made, materials.BumpMap)


def test_parameters_given_twice(tmp_path):
    """As in pbrt-v4, the later value counts."""
    path = tmp_path / "a.pbrt"
    path.write_text('WorldBegin\nShape "sphere" "float radius" 1 "float radius" 2\n')
    scene = load(path)
    assert scene.shapes[0].radius == 2.0
    assert any("given twice" in text for text in scene.warnings)


@pytest.mark.parametrize("text, message", [
    ('Material "fourier" "string bsdffile" "a.bsdf"', "Fourier"),
    ('Material "ofafork"', "unknown material 'ofafork'"),
    ('Shape "nurbs"', "not supported"),
    ('Shape "cone" "float height" -1', "must be positive"),
    ('Shape "paraboloid" "float zmin" 1 "float zmax" 1', "must differ"),
    ('Shape "heightfield" "integer nu" 3 "integer nv" 3 "float Pz" [1 2]', "nu times nv"),
    ('LightSource "point" "blackbody I" [0 1]', "above 0"),
    ('Texture "a" "color" "uv"\nTexture "b" "float" "uv"\nMaterial "matte" "texture sigma" "b"',
     "no numbers"),
])  # fmt: skip
def test_errors_say_where(read, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(f"{text}\n{DISK}")
    assert "scene.pbrt:" in str(caught.value)


@pytest.mark.parametrize("end", ["", "WorldEnd"])
def test_unknown_kinds_are_errors_that_an_option_turns_into_grey(tmp_path, end):
    path = tmp_path / "a.pbrt"
    world = f'Material "ofafork"\n{DISK}\nShape "portal"\nLightSource "aaplane"\n{end}\n'
    path.write_text(f"WorldBegin\n{world}")
    with pytest.raises(SceneError, match="unknown"):
        load(path)
    scene = load(path, missing_textures="grey")
    assert [shape.kind for shape in scene.shapes] == ["disk"] and not scene.lights
    told = " ".join(scene.warnings)
    assert all(word in told for word in ("ofafork", "portal", "aaplane"))


def test_rough_matte_and_substrate(read):
    made = surface(read, '"matte" "float sigma" 20')
    assert (made.kind, made.sigma, made.interreflection) == ("oren_nayar", 20.0, False)
    made = surface(read, '"substrate" "float uroughness" .1 "float vroughness" .2')
    assert made.kind == "ashikhmin_shirley"
    assert made.alpha_u == pytest.approx(0.46176, abs=1e-4) and made.alpha_u < made.alpha_v


NAMED = 'MakeNamedMaterial "m" "string type" "matte" "rgb Kd" [{0} {0} {0}]'
PAINT = 'Texture "t" "color" "constant" "rgb value" [{0} {0} {0}]'


@pytest.mark.parametrize("define, use", [
    (NAMED, 'NamedMaterial "m"'), (PAINT, 'Material "matte" "texture Kd" "t"'),
])  # fmt: skip
@pytest.mark.parametrize("scope", ["Attribute", "Object", "Transform"])
def test_definitions_end_with_their_scope(read, define, use, scope):
    """GraphicsState of src/core/api.cpp holds the names; a TransformBegin does not save it."""
    name = ' "o"' if scope == "Object" else ""
    inner = f"{scope}Begin{name} {define.format(0.25)} {use} {DISK} {scope}End"
    outer = f"{define.format(0.5)} {inner} {use} {DISK} {define.format(0.75)} {use} {DISK}"
    shapes = read(outer).shapes
    found = [shape.material.front.reflectance.r for shape in shapes]
    first = [] if scope == "Object" else [0.25]
    assert found == [*first, 0.25 if scope == "Transform" else 0.5, 0.75]


def test_what_version_3_reports_and_goes_on(read):
    """src/core/api.cpp and paramset.cpp: options in the world, names that nothing defines."""
    scene = read(
        'Film "image" "integer xresolution" 7\nIntegrator "bdpt"\n'
        'Material "matte" "rgb Kd" [.1 .2 .3]\nNamedMaterial "nobody"\n' + DISK
        + '\nMaterial "matte" "texture Kd" "nothing"\n' + DISK,
        'Sampler "poissondisk" "integer pixelsamples" 9',
    )  # fmt: skip
    assert (scene.film.width, scene.spp) == (640, 9)
    first, second = (shape.material.front.reflectance for shape in scene.shapes)
    assert (first.r, first.g, first.b) == (0.1, 0.2, 0.3)
    assert level(second) == 0.5, "the default of Kd"
    told = " ".join(scene.warnings)
    words = ("poissondisk", "stands after WorldBegin", "no material 'nobody'", "'nothing'")
    assert [word for word in words if word not in told] == []
    with pytest.raises(SceneError, match="no material 'nobody'"):
        read('Material "mix" "string namedmaterial1" "nobody"\n' + DISK)


def test_uv_texture_is_red_by_u_and_green_by_v(read):
    made = read('Texture "t" "color" "uv"\nMaterial "matte" "texture Kd" "t"\n' + DISK)
    texture = made.shapes[0].material.front.reflectance
    corners = texture.image.reshape(2, 2, 3)  # the top row is v = 1
    np.testing.assert_array_equal(corners[:, :, 0], [[0, 1], [0, 1]])
    np.testing.assert_array_equal(corners[:, :, 1], [[1, 1], [0, 0]])


@pytest.mark.parametrize("end", ["", "WorldEnd"])
@pytest.mark.parametrize(
    ("kind", "value"),
    [('"matte" "spectrum Kd"', "[400 0.5 700 18.4]"), ('"matte" "spectrum Kd"', '"stdillum-D65"')],
)
def test_a_spectrum_above_1_is_cut_off(tmp_path, end, kind, value):
    path = tmp_path / "a.pbrt"
    kind = kind if end else kind.replace("matte", "diffuse").replace("Kd", "reflectance")
    path.write_text(f"WorldBegin\nMaterial {kind} {value}\n{DISK}\n{end}\n")
    scene = load(path)
    values = scene.shapes[0].material.front.reflectance.values
    assert max(values) == 1.0 and min(values) < 1.0
    assert any("exceeds 1 and is cut off" in text for text in scene.warnings)


@pytest.mark.parametrize("kind", ["infinite", "goniometric", "projection"])
def test_images_of_lights_are_linear_whatever_their_bits(read, tmp_path, kind):
    """src/core/imageio.cpp divides the bytes of a PNG by 255."""
    images.write(tmp_path / "map.png", np.full((4, 8, 3), 0.2, np.float32))
    values = images.read_stored(tmp_path / "map.png").values
    assert values.max() > 100, "encoded as sRGB"
    images.write(tmp_path / "map.exr", values.astype(np.float32) / 255.0)
    of_bytes, of_floats = (
        read(f'LightSource "{kind}" "string mapname" "map.{end}"\n' + DISK).lights[0].image
        for end in ("png", "exr")
    )
    if kind != "infinite":
        of_bytes, of_floats = of_bytes.image, of_floats.image
    np.testing.assert_allclose(of_bytes, of_floats, rtol=1e-3)


def test_a_second_picture_in_a_file_is_left_out(tmp_path):
    """Version 2 renders one world after the other."""
    path = tmp_path / "two.pbrt"
    first = (
        f'Film "image" "integer xresolution" 9\nWorldBegin\n{DISK}\nVolume "x"\n{DISK}\nWorldEnd'
    )
    path.write_text(f'{first}\nFilm "image"\nWorldBegin\nShape "ofafork"\nWorldEnd\n')
    scene = load(path)
    assert scene.film.width == 9 and len(scene.shapes) == 2
    assert any("the pictures behind it are left out" in text for text in scene.warnings)
    path.write_text(first + "\n# the end\n")
    assert not any("pictures" in text for text in load(path).warnings)


@pytest.mark.parametrize(
    ("p1", "p2", "turn"),
    [((-3.2, 0.8, 0.4), (-1.0, -0.5, -1.25), 360), ((3.0, 1.2, 1.0), (0.65, -0.5, -1.0), 270)],
)
def test_a_hyperboloid_has_its_waist_at_0(read, p1, p2, turn):
    """pbrt-v3 solves a r^2 - c z^2 = 1 for p2 and p1 + 2 (p2 - p1); p1 gives its other end."""
    numbers = [" ".join(map(str, p)) for p in (p1, p2)]
    text = '"hyperboloid" "point p1" [{}] "point p2" [{}] "float phimax" {}'
    mesh = read(f"Shape {text.format(*numbers, turn)}").shapes[0]
    first, second = np.array(p1), np.array(p2)
    ends = np.array([second, first + 2.0 * (second - first)])
    a, c = np.linalg.solve(np.column_stack([(ends[:, :2] ** 2).sum(1), -(ends[:, 2] ** 2)]), [1, 1])
    squares = (mesh.vertices[:, :2] ** 2).sum(axis=1)
    wanted = np.maximum((1.0 + c * mesh.vertices[:, 2] ** 2) / a, 0.0)  # none between two sheets
    np.testing.assert_allclose(squares, wanted, atol=1e-5)
    assert mesh.vertices[:, 2].min() == pytest.approx(min(p1[2], p2[2]))
    assert mesh.vertices[:, 2].max() == pytest.approx(max(p1[2], p2[2]))
    assert np.linalg.norm(mesh.vertices - second, axis=1).min() < 1e-5


def test_no_hyperboloid(read):
    with pytest.raises(SceneError, match="no hyperboloid goes through"):
        read('Shape "hyperboloid" "point p1" [0 0 0] "point p2" [0 0 1]')


@pytest.mark.parametrize("end", ["", "WorldEnd"])
def test_the_inside_of_dots_surrounds_them(tmp_path, end):
    """pbrt-v3's dots.cpp hands "inside" to the parameter `outsideDot`; so does pbrt-v4's."""
    path = tmp_path / "a.pbrt"
    texture = 'Texture "d" "float" "dots" "float inside" 0.2 "float outside" 0.7'
    kind = '"matte" "texture sigma"' if end else '"coateddiffuse" "texture roughness"'
    path.write_text(f'WorldBegin\n{texture}\nMaterial {kind} "d"\n{DISK}\n{end}\n')
    material = load(path).shapes[0].material.front
    mixed = material.sigma if end else material.alpha
    assert isinstance(mixed.amount, textures.Dots)
    assert level(mixed.first) < level(mixed.second)
    if end:
        assert (level(mixed.first), level(mixed.second)) == (0.2, 0.7)


def test_glass_in_a_mix_has_the_front_of_the_rest(read):
    text = (
        'MakeNamedMaterial "a" "string type" "glass"\nMakeNamedMaterial "b" "string type" "matte"\n'
        'Material "mix" "color amount" [.4 .4 .4] "string namedmaterial1" "a" '
        f'"string namedmaterial2" "b"\n{DISK}'
    )
    scene = read(text)
    kinds = [part.kind for part in materials.parts(scene.shapes[0].material)]
    assert "dielectric" in kinds and "two_sided" not in kinds
    assert any("black from behind" in text for text in scene.warnings)
    assert np.isfinite(np.asarray(clpt.render(scene, 1, size=(4, 4)))).all()
