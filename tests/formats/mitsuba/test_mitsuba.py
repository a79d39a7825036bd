"""Mitsuba's XML: every element and default, every error with its place, agreement with Mitsuba."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from clpt import images, spectra
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats import load
from clpt.scene import integrators, lights, materials, studio, textures
from clpt.spectra import (
    RGB,
    Blackbody,
    Constant,
    RGBIlluminant,
    RGBUnbounded,
    Tabulated,
    glass,
    metal,
)
from clpt.spectra.spectrum import WIDEST

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
SENSOR = '<sensor type="perspective"/>'


@pytest.fixture
def scene(tmp_path):
    """Load what stands inside <scene> on its second line."""
    (tmp_path / "t.obj").write_text(TRIANGLE)
    (tmp_path / "t.png").write_bytes(b"")
    (tmp_path / "t.spd").write_text("400 1\n700 2\n")

    def of(body: str, sensor: str = SENSOR, **variables):
        path = tmp_path / "scene.xml"
        path.write_text(f'<scene version="3.0.0">\n{body}\n{sensor}</scene>', "utf-8")
        return load(path, **variables)

    return of


@pytest.fixture
def bsdf(scene):
    def of(xml: str):
        return scene(f'<shape type="sphere">{xml}</shape>').shapes[0].material

    return of


@pytest.fixture
def emitter(scene):
    def of(xml: str):
        return scene(xml).lights[0]

    return of


def test_defaults_are_mitsubas(scene):
    made = scene("")
    assert (made.film.width, made.film.height, made.spp) == (768, 576, 4)
    assert isinstance(made.film.filter, integrators.Gaussian)
    assert (made.integrator.max_depth, made.integrator.rr_depth) == (-1, 3)
    # The field of view of a 50 mm lens, as Mitsuba 3.9.1 prints it.
    assert made.camera.fov == pytest.approx(38.1848, abs=1e-4)


def test_variables(scene):
    body = '<default name="n" value="3"/><integrator type="path">' + (
        '<integer name="max_depth" value="$n"/></integrator>'
    )
    assert scene(body).integrator.max_depth == 3
    assert scene(body, n=7).integrator.max_depth == 7
    with pytest.raises(SceneError, match=r"scene.xml: has no variable 'm'; known: n"):
        scene(body, m=7)
    with pytest.raises(SceneError, match=r"scene.xml:2: .*\$q is not defined"):
        scene('<integrator type="$q"/>')


def test_light_paths_are_a_parameter_of_ours(scene):
    path = '<integrator type="path"><integer name="light_paths" value="2"/></integrator>'
    assert scene(path).integrator.light_paths == 2
    assert scene(path.replace("integer", "float").replace("2", "0.5")).integrator.light_paths == 0.5
    assert scene('<integrator type="path"/>').integrator.light_paths == "auto"
    auto = path.replace("integer", "string").replace('"2"', '"auto"')
    assert scene(auto).integrator.light_paths == "auto"
    with pytest.raises(SceneError, match=r"scene.xml:2: .*'many' is none of auto"):
        scene(auto.replace("auto", "many"))


def test_auto_is_an_integrator_of_ours(scene):
    inner = '<integer name="max_depth" value="9"/><boolean name="hide_emitters" value="true"/>'
    made = scene(f'<integrator type="auto">{inner}</integrator>').integrator
    assert vars(made) == {**vars(integrators.Auto()), "max_depth": 9, "hide_lights": True}


def test_vcm_is_an_integrator_of_ours(scene):
    given = {"max_depth": 9, "rr_depth": 4, "light_paths": 2, "wavelength_groups": 3}
    given |= {"photon_memory": 40, "radius": 0.25, "merging": False, "light_tracing": False}
    tags = {int: "integer", float: "float", bool: "boolean"}
    inner = "".join(
        f'<{tags[type(value)]} name="{name}" value="{str(value).lower()}"/>'
        for name, value in given.items()
    )
    made = scene(f'<integrator type="vcm">{inner}</integrator>').integrator
    assert vars(made) == {**vars(integrators.Vcm()), **given}
    usual = scene('<integrator type="vcm"/>').integrator
    assert vars(usual) == {**vars(integrators.Vcm()), "max_depth": -1, "rr_depth": usual.rr_depth}
    none = '<integrator type="vcm"><integer name="light_paths" value="0"/></integrator>'
    with pytest.raises(SceneError, match=r"scene.xml:2: .*light_paths.*from 1 to 64"):
        scene(none)


def test_include_and_path(scene, tmp_path):
    (tmp_path / "parts").mkdir()
    inner = '<scene><bsdf type="null" id="m"/>\n<shape type="cube"><ref id="m"/></shape></scene>'
    (tmp_path / "parts" / "part.xml").write_text(inner)
    assert len(scene('<path value="parts"/><include filename="part.xml"/>').shapes) == 1
    (tmp_path / "parts" / "part.xml").write_text("<scene>\n\n<oops/></scene>")
    with pytest.raises(SceneError, match=r"part.xml:3: <oops>"):
        scene('<path value="parts"/><include filename="part.xml"/>')
    with pytest.raises(SceneError, match=r"scene.xml:2: .*no folder 'nowhere'"):
        scene('<path value="nowhere"/>')


def test_an_include_of_itself_ends(scene):
    with pytest.raises(SceneError, match="include each other"):
        scene('<include filename="scene.xml"/>')


def test_transforms_apply_in_order(scene):
    steps = '<rotate z="1" angle="90"/><scale value="2"/><translate x="1" y="0"/>'
    xml = f'<shape type="cube"><transform name="to_world">{steps}</transform></shape>'
    expected = [[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]
    assert np.allclose(scene(xml).shapes[0].to_world, expected)
    matrix = '<matrix value="0 -2 0 1  2 0 0 0  0 0 2 0  0 0 0 1"/>'
    xml = f'<shape type="cube"><transform name="toWorld">{matrix}</transform></shape>'
    assert np.allclose(scene(xml).shapes[0].to_world, expected)


CAMERAS = {
    '<float name="fov" value="50"/><string name="fov_axis" value="y"/>': {"fov_axis": "y"},
    '<float name="fov" value="50"/><string name="fov_axis" value="diagonal"/>': {"fov": 40.9163},
    '<float name="principal_point_offset_x" value="0.1"/>': {"offset_x": 0.1},
    '<float name="near_clip" value="1"/><float name="far_clip" value="9"/>': {"near": 1, "far": 9},
    '<string name="focal_length" value="85mm"/>': {"fov": 23.0171},
}


@pytest.mark.parametrize(("xml", "expected"), CAMERAS.items())
def test_perspective(scene, xml, expected):
    camera = scene("", f'<sensor type="perspective">{xml}</sensor>').camera
    for name, value in expected.items():
        found = getattr(camera, name)
        assert found == (value if isinstance(value, str) else pytest.approx(value, abs=1e-3))


def test_thin_lens(scene):
    camera = scene(
        "", '<sensor type="thinlens"><float name="aperture_radius" value="0.2"/></sensor>'
    ).camera
    assert (camera.aperture_radius, camera.focus_distance) == (0.2, 1e4)
    with pytest.raises(SceneError, match="aperture_radius"):
        scene("", '<sensor type="thinlens"/>')


def test_thin_lens_of_a_glass(scene):
    camera = scene(
        "",
        '<sensor type="thinlens"><float name="aperture_radius" value="0.2"/>'
        '<string name="glass" value="sf11"/><float name="lens_focal_length" value="0.1"/></sensor>',
    ).camera
    assert (camera.glass, camera.focal_length) == ("sf11", 0.1)


FILTERS = {
    "box": integrators.Box(),
    "tent": integrators.Tent(),
    "gaussian": integrators.Gaussian(),
    "mitchell": integrators.Mitchell(),
    "catmullrom": integrators.Mitchell(b=0.0, c=0.5),
}


@pytest.mark.parametrize("name", FILTERS)
def test_filters(scene, name):
    film = f'<film type="hdrfilm"><rfilter type="{name}"/></film>'
    found = scene("", f'<sensor type="perspective">{film}</sensor>').film.filter
    assert dataclasses.asdict(found) == dataclasses.asdict(FILTERS[name])
    assert found.kind == FILTERS[name].kind


@pytest.mark.parametrize("name", ["independent", "multijitter"])
def test_samplers(scene, name):
    xml = f'<sampler type="{name}"><integer name="sample_count" value="9"/></sampler>'
    made = scene("", f'<sensor type="perspective">{xml}</sensor>')
    assert (made.sampler.kind, made.spp, made.extra["sampler"]) == ("sobol", 9, name)


def test_integrators(scene):
    assert scene('<integrator type="direct"/>').integrator.kind == "direct"
    moment = scene('<integrator type="moment"><integrator type="path"/></integrator>')
    assert moment.integrator.kind == "path"
    assert "second moments" in moment.warnings[0]
    aovs = '<string name="aovs" value="d:depth, n:sh_normal"/>'
    made = scene(f'<integrator type="aov">{aovs}</integrator>')
    assert made.film.layers == ("depth", "shading_normal") and not made.warnings
    assert (made.integrator.kind, made.integrator.max_depth) == ("path", 1)
    made = scene(f'<integrator type="aov">{aovs}<integrator type="direct"/></integrator>')
    assert made.integrator.kind == "direct" and made.film.layers == ("depth", "shading_normal")
    assert scene('<integrator type="depth"/>').film.layers == ("depth",)
    others = '<string name="aovs" value="a:dp_du"/><integrator type="ptracer"/>'
    made = scene(f'<integrator type="aov">{others}</integrator>')
    assert made.film.layers == () and "dp_du are left out" in made.warnings[0]
    for name in ("volpath", "volpathmis"):
        made = scene(f'<integrator type="{name}"/>').integrator
        assert made.kind == "path" and made.free_panes and made.max_depth == -1
    made = scene('<integrator type="prbvolpath"/>').integrator
    assert made.free_panes and made.max_depth == 6
    assert not scene('<integrator type="prb"/>').integrator.free_panes
    for inside, free in (
        ("", True),
        ('<integer name="max_depth" value="65"/>', True),
        ('<integer name="max_depth" value="9"/>', False),  # where each pane counts in Mitsuba
        ('<boolean name="hide_emitters" value="true"/>', False),
    ):
        made = scene(f'<integrator type="path">{inside}</integrator>').integrator
        assert made.free_panes is free


def test_shapes(scene):
    made = scene(
        '<shape type="sphere"><point name="center" x="1" y="2" z="3"/>'
        '<float name="radius" value="2"/><boolean name="flip_normals" value="true"/></shape>'
        '<shape type="rectangle"/><shape type="disk"/><shape type="cube"/>'
        '<shape type="cylinder"><point name="p1" value="0, 0, 4"/></shape>'
        '<shape type="obj"><string name="filename" value="t.obj"/></shape>'
    ).shapes
    assert [s.kind for s in made] == ["sphere", "rectangle", "disk", "cube", "cylinder", "mesh"]
    assert (*made[0].center, made[0].radius, made[0].flip_normals) == (1, 2, 3, 2, True)
    assert made[4].p1 == (0, 0, 4)


@pytest.mark.parametrize("flat", [True, False])
def test_mesh_normals(scene, flat):
    xml = (
        '<shape type="obj"><string name="filename" value="t.obj"/>'
        f'<boolean name="face_normals" value="{str(flat).lower()}"/></shape>'
    )
    mesh = scene(xml).shapes[0]
    assert (mesh.normals is None) == flat
    assert np.allclose(mesh.uvs, [[0, 1], [1, 1], [0, 0]])  # Mitsuba turns v of an OBJ around


MIRROR = '<transform name="to_world"><scale x="-1"/></transform>'


def test_mirrored_shapes_face_as_mitsubas_do(scene, tmp_path):
    (tmp_path / "n.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    sphere, disk, bare, given = scene(
        f'<shape type="sphere">{MIRROR}</shape><shape type="disk">{MIRROR}</shape>'
        f'<shape type="obj"><string name="filename" value="t.obj"/>{MIRROR}</shape>'
        f'<shape type="obj"><string name="filename" value="n.obj"/>{MIRROR}</shape>'
    ).shapes
    assert (sphere.flip_normals, disk.flip_normals) == (True, False)
    for mesh, front in ((bare, -1.0), (given, 1.0)):
        a, b, c = mesh.vertices[mesh.faces[0]]
        assert np.cross(b - a, c - a)[2] == front
        assert (mesh.normals[:, 2] == front).all()


BSDFS = {
    '<bsdf type="diffuse"/>': materials.Diffuse(),
    '<bsdf type="diffuse"><rgb name="reflectance" value=".1,.2,.3"/></bsdf>': materials.Diffuse(
        reflectance=(0.1, 0.2, 0.3)
    ),
    '<bsdf type="phong"><float name="exponent" value="9"/></bsdf>': materials.Phong(exponent=9.0),
    '<bsdf type="dielectric"/>': materials.Dielectric(int_ior=1.5046, ext_ior=1.000277),
    '<bsdf type="thindielectric"><string name="intIOR" value="water"/></bsdf>': (
        materials.ThinDielectric(int_ior=1.333)
    ),
    '<bsdf type="roughdielectric"><float name="alpha" value=".2"/></bsdf>': (
        materials.RoughDielectric(distribution="beckmann", alpha_u=0.2, alpha_v=0.2)
    ),
    '<bsdf type="dielectric"><float name="absorption" value="3"/></bsdf>': (
        materials.Dielectric(int_ior=1.5046, ext_ior=1.000277, absorption=3.0)
    ),
    '<bsdf type="roughdielectric"><rgb name="absorption" value="1,2,30"/></bsdf>': (
        materials.RoughDielectric(distribution="beckmann", absorption=RGBUnbounded(1, 2, 30))
    ),
    '<bsdf type="conductor"/>': materials.Conductor(eta=0.0, k=1.0),
    '<bsdf type="conductor"><string name="material" value="Au"/></bsdf>': materials.Conductor(
        eta=metal("Au")[0], k=metal("Au")[1]
    ),
    '<bsdf type="conductor"><float name="extEta" value="1"/></bsdf>': (
        materials.Conductor(eta=0.0, k=1.0)
    ),
    '<bsdf type="roughconductor"><string name="material" value="none"/></bsdf>': (
        materials.RoughConductor(distribution="beckmann")
    ),
    '<bsdf type="roughconductor"><rgb name="eta" value="1,2,3"/><float name="k" value="4"/>'
    '<float name="alphaU" value="0"/><string name="distribution" value="ggx"/></bsdf>': (
        materials.RoughConductor(eta=RGBUnbounded(1, 2, 3), k=4.0, alpha_u=1e-4)
    ),
    '<bsdf type="plastic"><boolean name="nonlinear" value="true"/></bsdf>': materials.Plastic(
        nonlinear=True
    ),
    '<bsdf type="roughplastic"/>': materials.RoughPlastic(distribution="beckmann"),
    '<bsdf type="principled"/>': materials.Principled(),
    '<bsdf type="principled"><rgb name="base_color" value=".1,.2,.3"/><float name="specular" '
    'value="0"/><float name="spec_trans" value=".5"/><float name="clearcoat_gloss" value=".2"/>'
    '<float name="diffuse_reflectance_sampling_rate" value="3"/></bsdf>': (
        materials.Principled(
            base_color=(0.1, 0.2, 0.3),
            eta=2.0 / (1.0 - 0.00008**0.5) - 1.0,
            spec_trans=0.5,
            clearcoat_gloss=0.2,
        )
    ),
    '<bsdf type="principledthin"><float name="diff_trans" value="2"/>'
    '<float name="eta" value="1.3"/></bsdf>': materials.PrincipledThin(diff_trans=2.0, eta=1.3),
    '<bsdf type="grating"/>': materials.Grating(),
    '<bsdf type="grating"><string name="profile" value="explicit"/>'
    '<float name="period" value="900"/><string name="efficiencies" value="1, 2, 0"/>'
    '<string name="material" value="Al"/></bsdf>': (
        materials.Grating(
            profile="explicit",
            period=900.0,
            efficiencies=(1, 2, 0),
            eta=metal("Al")[0],
            k=metal("Al")[1],
        )
    ),
    '<bsdf type="null"/>': materials.Null(),
}


@pytest.mark.parametrize("xml", BSDFS)
def test_bsdfs(bsdf, xml):
    found = bsdf(xml)
    assert type(found) is type(BSDFS[xml])
    assert dataclasses.asdict(found) == dataclasses.asdict(BSDFS[xml])


def test_absorption_from_files(bsdf, tmp_path):
    """A table holds the coefficient itself, a page of optical constants gives 4 pi k / lambda."""
    page = "DATA:\n - type: tabulated nk\n   data: |\n     0.4 1.5 1e-6\n     0.8 1.5 3e-6\n"
    (tmp_path / "page.yml").write_text(page)
    for file, expected in (
        ("t.spd", [1.0, 2.0]),
        ("page.yml", [10.0 * np.pi, 2.5e-6 * 4e9 / 700 * np.pi]),
    ):
        made = bsdf(
            f'<bsdf type="dielectric"><spectrum name="absorption" filename="{file}"/></bsdf>'
        )
        assert np.allclose(made.absorption.sample([400.0, 700.0]), expected)


def test_nested_bsdfs(bsdf):
    made = bsdf('<bsdf type="twosided"><bsdf type="null"/><bsdf type="diffuse"/></bsdf>')
    assert (made.front.kind, made.back.kind) == ("null", "diffuse")
    made = bsdf('<bsdf type="mask"><float name="opacity" value=".3"/><bsdf type="diffuse"/></bsdf>')
    assert (made.material.kind, made.opacity) == ("diffuse", 0.3)
    made = bsdf(
        '<bsdf type="blendbsdf"><float name="weight" value=".3"/>'
        '<bsdf type="diffuse"/><bsdf type="null"/></bsdf>'
    )
    assert (made.first.kind, made.second.kind, made.weight) == ("diffuse", "null", 0.3)


def test_references_share(scene):
    made = scene(
        '<bsdf type="diffuse" id="m"/><shape type="cube"><ref id="m"/></shape>'
        '<shape type="disk"><ref name="bsdf" id="m"/></shape>'
    )
    assert made.shapes[0].material is made.shapes[1].material
    assert made.shapes[0].material.name == "m"


def test_lights(scene):
    made = scene(
        '<emitter type="point"><point name="position" x="1" y="2" z="3"/></emitter>'
        '<emitter type="spot"><float name="cutoff_angle" value="40"/></emitter>'
        '<emitter type="directional"><vector name="direction" x="0" y="-1" z="0"/></emitter>'
        '<emitter type="constant"/>'
        '<emitter type="envmap"><string name="filename" value="t.png"/>'
        '<float name="scale" value="2"/><boolean name="mis_compensation" value="true"/></emitter>'
        '<shape type="disk"><emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>'
    )
    point, spot, directional, constant, envmap = made.lights
    assert point.position == (1, 2, 3)
    assert (spot.cutoff, spot.beam_width) == (40.0, 30.0)
    assert directional.direction == (0, -1, 0)
    assert constant.radiance == RGBIlluminant(1, 1, 1)
    assert (envmap.scale, envmap.image.name, envmap.mis_compensation) == (2.0, "t.png", True)
    assert made.shapes[0].emission.radiance == RGBIlluminant(2, 2, 2)


def test_lights_with_images(scene, scenes):
    file = f'<string name="filename" value="{scenes / "tiles.png"}"/>'
    picture = '<texture name="{}" type="bitmap">' + file + "</texture>"
    made = scene(
        '<emitter type="projector"><float name="fov" value="40"/><float name="scale" value="2"/>'
        + picture.format("irradiance") + "</emitter>"
        '<emitter type="projector"><float name="fov" value="40"/>'
        '<string name="fov_axis" value="y"/>'
        + picture.format("irradiance") + "</emitter>"
        '<emitter type="projector"><float name="fov" value="40"/>'
        '<rgb name="irradiance" value="1 2 3"/></emitter>'
        '<emitter type="projector"><float name="fov" value="40"/><float name="scale" value="3"/>'
        '<spectrum name="irradiance" value="2"/></emitter>'
        '<emitter type="spot">' + picture.format("texture") + "</emitter>"
    )  # fmt: skip
    across, up, plain, even, spot = made.lights
    assert (across.irradiance.r, across.fov) == (pytest.approx(2 * np.pi), pytest.approx(40))
    assert np.array_equal(across.image.to_uv, np.eye(3))  # upright as it is
    height, width = images.read(up.image.image).shape[:2]
    tan = np.tan(np.radians(20)) * width / height
    assert up.fov == pytest.approx(np.degrees(2 * np.arctan(tan)))
    assert plain.irradiance.b == pytest.approx(3 * np.pi)
    assert even.irradiance.value == pytest.approx(6 * np.pi)
    assert spot.image.image.name == "tiles.png"


def test_area_lights_by_reference(scene):
    made = scene(
        '<emitter type="area" id="a"><rgb name="radiance" value="2"/></emitter>'
        '<shape type="disk"><ref id="a"/></shape><shape type="sphere"><ref id="a"/></shape>'
    )
    assert made.lights == []
    assert [s.emission.radiance for s in made.shapes] == [RGBIlluminant(2, 2, 2)] * 2


EMITTED = {
    '<float name="radiance" value="2"/>': RGBIlluminant(2, 2, 2),
    '<rgb name="radiance" value="1 2 3"/>': RGBIlluminant(1, 2, 3),
    '<srgb name="radiance" value="#ff0000"/>': RGBIlluminant(1, 0, 0),
    '<spectrum name="radiance" value="2"/>': Constant(2),
    '<spectrum name="radiance" value="400:1, 700:2"/>': Tabulated((400, 700), (1, 2)),
    '<spectrum name="radiance" filename="t.spd"/>': Tabulated((400, 700), (1, 2)),
    '<spectrum name="radiance" type="d65"/>': RGBIlluminant(1, 1, 1),
    '<spectrum name="radiance" type="blackbody"><float name="temperature" value="3000"/></spectrum>'
    : Blackbody(3000),
    '<spectrum name="radiance" type="blackbody"><boolean name="normalised" value="true"/>'
    '<float name="scale" value="9"/></spectrum>': Blackbody(5000, 9, True),
    '<spectrum name="radiance" type="illuminant"><string name="name" value="mercury"/>'
    '<float name="scale" value="3"/></spectrum>': spectra.illuminant("mercury", 3),
    '<spectrum name="radiance" type="lines"><string name="wavelengths" value="436, 546"/>'
    '<string name="powers" value="1, 2"/><float name="width" value="2"/></spectrum>':
        spectra.Lines((436, 546), (1, 2), 2),
    '<spectrum name="radiance" type="led"><float name="peak" value="470"/></spectrum>':
        spectra.LED(470),
    '<spectrum name="radiance" type="uniform"><float name="value" value="3"/></spectrum>':
        Constant(3),
    '<spectrum name="radiance" type="irregular"><string name="wavelengths" value="400, 700"/>'
    '<string name="values" value="1, 2"/></spectrum>': Tabulated((400, 700), (1, 2)),
    '<spectrum name="radiance" type="regular"><float name="wavelength_min" value="400"/>'
    '<float name="wavelength_max" value="700"/><string name="values" value="1, 2"/></spectrum>':
        Tabulated((400, 700), (1, 2)),
}  # fmt: skip


@pytest.mark.parametrize("xml", EMITTED)
def test_emitted_spectra(emitter, xml):
    assert emitter(f'<emitter type="constant">{xml}</emitter>').radiance == EMITTED[xml]


INDICES = {
    '<spectrum name="int_ior" type="glass"><string name="name" value="sf11"/></spectrum>':
        spectra.glass("sf11"),
    '<spectrum name="int_ior" type="cauchy"><float name="a" value="1.5"/>'
    '<float name="b" value="0.004"/></spectrum>': spectra.Cauchy(1.5, 0.004),
    '<spectrum name="int_ior" type="sellmeier"><string name="b" value="1, 0.2"/>'
    '<string name="c" value="0.01, 100"/></spectrum>': spectra.Sellmeier((1, 0.2), (0.01, 100)),
    '<spectrum name="int_ior" filename="t.spd"/>': Tabulated((400, 700), (1, 2), "hold"),
}  # fmt: skip


AROUND = {  # Mitsuba 0.6 divides by the index of what is around a metal
    '<float name="eta" value="3"/>': (1.5, 0.5),
    '<rgb name="eta" value="2, 3, 4"/>': (RGBUnbounded(1.0, 1.5, 2.0), 0.5),
    '<spectrum name="k" value="400:2, 700:3"/>': (0.0, Tabulated((400, 700), (1.0, 1.5), "hold")),
    '<spectrum name="k" type="cauchy"><float name="a" value="3"/></spectrum>': (
        0.0, Tabulated(WIDEST, np.full(len(WIDEST), 1.5), "hold")
    ),
    '<string name="material" value="none"/>': (0.0, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("xml", AROUND)
def test_metals_in_what_is_no_air(bsdf, xml):
    eta, k = AROUND[xml]
    made = bsdf(f'<bsdf type="conductor"><float name="extEta" value="2"/>{xml}</bsdf>')
    assert dataclasses.asdict(made) == dataclasses.asdict(materials.Conductor(eta=eta, k=k))


def test_textures_of_metals_in_what_is_no_air(bsdf):
    texture = '<texture name="eta" type="checkerboard"/>'
    made = bsdf(f'<bsdf type="conductor"><float name="extEta" value="2"/>{texture}</bsdf>').eta
    assert isinstance(made.first, textures.Checkerboard)
    assert made.second == Constant(0.5)


def test_what_is_around_a_metal_may_be_named(bsdf):
    water = bsdf('<bsdf type="conductor"><string name="extEta" value="water"/></bsdf>')
    assert water.k == Constant(1.0 / 1.333)
    with pytest.raises(SceneError, match="must be a number above 0 or the name"):
        bsdf('<bsdf type="conductor"><float name="extEta" value="0"/></bsdf>')


@pytest.mark.parametrize("xml", INDICES)
def test_dispersive_indices(bsdf, xml):
    assert bsdf(f'<bsdf type="dielectric">{xml}</bsdf>').int_ior == INDICES[xml]


def test_textures(bsdf):
    made = bsdf(
        '<bsdf type="diffuse"><texture name="reflectance" type="bitmap">'
        '<string name="filename" value="t.png"/><string name="wrap_mode" value="clamp"/>'
        '<string name="filter_type" value="nearest"/><boolean name="raw" value="true"/>'
        '<transform name="to_uv"><scale x="2" y="4"/></transform></texture></bsdf>'
    ).reflectance
    assert isinstance(made, textures.Bitmap)
    assert (made.wrap, made.filter, made.raw) == ("clamp", "nearest", True)
    # Ours starts at the bottom row: v = 1 - 4 v'.
    assert np.allclose(made.to_uv, [[2, 0, 0], [0, -4, 1], [0, 0, 1]])
    old = bsdf(
        '<bsdf type="diffuse"><texture name="reflectance" type="bitmap">'
        '<string name="filename" value="t.png"/><float name="gamma" value="1"/>'
        '<string name="filterType" value="trilinear"/></texture></bsdf>'
    ).reflectance
    assert (old.filter, old.raw) == ("bilinear", True)  # as Mitsuba 0.6 writes them
    made = bsdf(
        '<bsdf type="diffuse"><texture name="reflectance" type="checkerboard">'
        '<rgb name="color0" value="0.7"/></texture></bsdf>'
    ).reflectance
    assert (made.color0, made.color1) == (RGB(0.7, 0.7, 0.7), Constant(0.2))


def test_look_at_without_up(scene):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    for line in ("1,-2,5", "1,-2,-5", "-3,0,0"):
        look = f'<lookat origin="{line}" target=".2,.1,.3"/>'
        steps = f'<transform name="to_world">{look}</transform>'
        sensor = f'<sensor type="perspective">{steps}</sensor>'
        theirs = mi.load_string(f'<scene version="3.0.0">{sensor}</scene>').sensors()[0]
        found = scene("", sensor).camera.to_world
        np.testing.assert_allclose(found, theirs.world_transform().matrix, atol=1e-5)


def test_rotation_about_a_long_axis_is_a_warning(scene):
    step = '<transform name="to_world"><rotate x="{}" angle="30"/></transform>'
    made = [scene(f'<shape type="cube">{step.format(x)}</shape>') for x in (1, 2)]
    assert np.allclose(made[0].shapes[0].to_world, made[1].shapes[0].to_world)
    assert not made[0].warnings and "unit length" in made[1].warnings[0]


def test_direct_light_by_one_strategy_only_is_a_warning(scene):
    none = '<integrator type="direct"><integer name="bsdf_samples" value="0"/></integrator>'
    assert "bsdf_samples of 0" in scene(none).warnings[0]


def test_a_sunsky_shines_from_where_its_sun_is(scene):
    """The sun is where sun_direction says in the world, whatever to_world is; up is its +z."""
    toward = np.array([0.3, -0.5, 0.6])
    sun = '<vector name="sun_direction" value="0.3, -0.5, 0.6"/><float name="turbidity" value="4"/>'
    turn = '<transform name="to_world"><rotate x="1" angle="-20"/></transform>'
    for more in ("", turn):
        made = scene(f'<emitter type="sunsky">{sun}{more}</emitter>')
        lamp = made.lights[0]
        up, around = np.radians([lamp.sun_elevation, lamp.sun_azimuth])
        own = [np.sin(around) * np.cos(up), np.sin(up), np.cos(around) * np.cos(up)]
        found = lamp.to_world[:3, :3] @ own
        np.testing.assert_allclose(found, toward / np.linalg.norm(toward), atol=1e-6)
        assert "sky by physics" in made.warnings[0] and lamp.aerosol == pytest.approx(
            0.30, abs=0.01
        )


def test_checkerboard_of_numbers_is_mitsubas(scene):
    """It swaps the two where it asks for a number; a reference elsewhere sees them as they are."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    theirs = mi.load_dict({"type": "checkerboard", "color0": 0.1, "color1": 0.5})
    made = scene(
        '<texture type="checkerboard" id="t"><float name="color0" value="0.1"/>'
        '<float name="color1" value="0.5"/></texture><shape type="sphere"><bsdf type="mask">'
        '<ref name="opacity" id="t"/><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf>'
        "</bsdf></shape>"
    )
    mask = made.shapes[0].material
    near, far = mi.SurfaceInteraction3f(), mi.SurfaceInteraction3f()
    near.uv, far.uv = (0.2, 0.2), (0.7, 0.2)
    ours = [mask.opacity.color0.value, mask.opacity.color1.value]
    assert ours == pytest.approx([theirs.eval_1(near), theirs.eval_1(far)])
    board = mask.material.reflectance
    ours = [board.color0.value, board.color1.value]
    assert ours == pytest.approx([theirs.eval(near)[0], theirs.eval(far)[0]])


ERRORS = {
    '<bsdf type="hare" id="p"/>': r":2: <bsdf type=.hare.>: unknown bsdf",
    '<bsdf type="principled"><float name="eta" value="2"/><float name="specular" value="1"/>'
    "</bsdf>":
        "either 'eta' or 'specular'",
    '<bsdf type="principled"><float name="specular" value="13"/></bsdf>': "below 12.5, not 13",
    '<bsdf type="difuse"/>': "did you mean 'diffuse'",
    '<shape type="heightfield"/>': r":2: <shape .*unknown shape 'heightfield'",
    '<shape type="instance"/>': r":2: <shape .*needs a <shape type=.shapegroup.>",
    '<shape type="shapegroup"><shape type="instance"/></shape>': r":2: <shape type=.instance.>"
    ": cannot stand in a shapegroup",
    '<emitter type="sky"/>': "unknown emitter",
    '<emitter type="timed_sunsky"/>': "timed_sunsky.>: is a plugin of Mitsuba that is not supp",
    '<emitter type="sunsky"/>': "<emitter type=.sunsky.>: needs a 'sun_direction'",
    '<integrator type="bdpt"/>': "unknown integrator",
    '<bsdf type="diffuse"><float name="foo" value="1"/></bsdf>': "has no parameter 'foo'",
    '<bsdf type="diffuse"><float name="reflectance" value="x"/></bsdf>': "must be numbers",
    '<bsdf type="diffuse"><float name="reflectance" value="nan"/></bsdf>': "must be finite",
    '<bsdf type="diffuse"><string name="reflectance" value="2"/></bsdf>': "must be a number",
    '<bsdf type="diffuse"><ref name="reflectance" id="x"/></bsdf>': "no object with the id 'x'",
    '<bsdf type="diffuse"><bsdf type="null"/></bsdf>': "cannot stand in bsdf 'diffuse'",
    '<bsdf type="twosided"/>': "needs 1 or 2 nested",
    '<bsdf type="twosided" id="a"><ref id="a"/></bsdf>': "refers to itself",
    '<bsdf type="blendbsdf"><bsdf type="null"/><bsdf type="null"/></bsdf>': "'weight'",
    '<bsdf type="dielectric"><string name="int_ior" value="bk8"/></bsdf>': "unknown glass",
    '<bsdf type="conductor"><string name="material" value="Xx"/></bsdf>': "unknown metal",
    '<bsdf type="null" id="a"/><bsdf type="null" id="a"/>': "already used",
    '<emitter type="constant"><spectrum name="radiance" type="lines"><string name="wavelengths" '
    'value="5"/><string name="powers" value="1, 2"/></spectrum></emitter>': "as many powers",
    '<shape type="obj"/>': "needs the parameter 'filename'",
    '<shape type="obj"><string name="filename" value="no.obj"/></shape>': "no file 'no.obj'",
    '<shape type="obj"><string name="filename" value="t.png"/></shape>': "not a .obj file",
    '<shape type="sphere"><float name="radius" value="-1"/></shape>': "must be positive",
    '<emitter type="constant"/><emitter type="spot"><transform name="to_world"><scale value="0"/>'
    "</transform></emitter>": "cannot be inverted",
    '<shape type="cube"><transform name="to_world"><skew/></transform></shape>': "<skew>: is no",
    '<shape type="cube"><emitter type="point"/></shape>': "only an area light",
    '<emitter type="area"/>': "must stand in a <shape>",
    '<emitter type="projector"><float name="fov" value="0"/></emitter>': "field of view",
    '<integrator type="path"><integer name="max_depth" value="1.5"/></integrator>': "whole number",
    '<integrator type="path"><boolean name="hide_emitters" value="1"/></integrator>': "true or",
    '<integrator type="path"><integer name="rr_depth" value="1"/>'
    '<integer name="rr_depth" value="2"/></integrator>': "given twice",
    '<shape type="cube"><medium type="homogenous" name="interior"/></shape>':
        "<medium type=.homogenous.>: .*did you mean 'homogeneous'",
    '<shape type="cube"><medium type="homogeneous" name="inside"/></shape>': "cannot stand in",
    '<phase type="hg" id="m"/><shape type="cube"><ref name="interior" id="m"/></shape>':
        "<ref name=.interior.>: .*must be a <medium>",
    '<shape type="cube"><medium type="homogeneous" name="interior"><texture name="sigma_t"'
    ' type="checkerboard"/></medium></shape>': "<medium type=.homogeneous.>: 'sigma_t' cannot be",
    '<shape type="cube"><medium type="homogeneous" name="interior"><phase type="hg">'
    '<float name="g" value="1.5"/></phase></medium></shape>': "<phase type=.hg.>: .*outside",
    '<phase type="sggx" id="p"/><shape type="cube"><medium type="homogeneous" name="interior">'
    '<ref id="p"/></medium></shape>': "<phase type=.sggx.>: is not supported: its density",
    '<shape type="cube"><medium type="homogeneous" name="interior"><phase type="tabphase">'
    '<string name="values" value="1, x"/></phase></medium></shape>': "must be numbers, with commas",
    '<shape type="cube"><medium type="homogeneous" name="interior"><phase type="tabphase"/>'
    "</medium></shape>": "needs its 'values'",
    '<shape type="cube"><medium type="homogeneous" name="interior"><phase type="blendphase">'
    '<phase type="hg"/></phase></medium></shape>': "two phase functions, not 1",
    '<alias id="no" as="a"/>': "no object with the id 'no'",
    '<bsdf type="null" id="a"/><alias id="a" as="a"/>': "already used",
    '<shape type="cube"><bsdf type="normalmap"><texture type="checkerboard" name="normalmap"/>'
    '<bsdf type="diffuse"/></bsdf></shape>': "must be a bitmap, or one colour",
    '<bsdf type="diffuse"><texture type="volume" name="reflectance"><volume type="gridvolume" '
    'name="volume"/></texture></bsdf>': "<volume type=.gridvolume.>: needs",
    '<bsdf type="roughconductor"><spectrum name="alpha" value="400:0, 500:0.1"/></bsdf>':
        "must be a number or a texture",
    '<float value="1"/>': "needs the attribute 'name'",
    "<scene>": "broken XML: no element found",
}  # fmt: skip


@pytest.mark.parametrize("body", ERRORS)
def test_errors_tell_the_place(scene, body):
    with pytest.raises(SceneError, match=ERRORS[body]) as caught:
        scene(body)
    assert caught.value.file.name == "scene.xml"
    assert caught.value.line in (2, 3)
    assert "\n" not in str(caught.value)


def test_error_types(scene):
    with pytest.raises(UnknownKindError):
        scene('<bsdf type="hare"/>')
    with pytest.raises(UnusedParameterError):
        scene('<shape type="cube"><float name="radius" value="1"/></shape>')


def test_entity_bombs_and_deep_nesting_are_refused(tmp_path):
    path = tmp_path / "bomb.xml"
    path.write_text('<!DOCTYPE s [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><scene>&b;</scene>')
    with pytest.raises(SceneError, match="document type"):
        load(path)
    path.write_text("<scene>" + '<bsdf type="twosided">' * 100_000)
    with pytest.raises(SceneError, match="nested deeper"):
        load(path)


def test_a_scene_without_sensor_is_framed(scene):
    made = scene('<shape type="cube"/>', "")
    assert made.camera.kind == "perspective"
    assert "no sensor" in made.warnings[0]


def test_the_tests_own_scenes_load(scenes):
    for path in sorted(scenes.glob("*.xml")):
        made = load(path)
        assert made.shapes and bool(made.warnings) == (path.name == "bent.xml"), path


@pytest.mark.peers
@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "scenes").glob("*.xml")))
def test_shapes_and_film_agree_with_mitsuba(path):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    theirs, ours = mi.load_file(str(path), optimize=False), load(path)
    film = theirs.sensors()[0].film()
    assert tuple(film.size()) == (ours.film.width, ours.film.height)
    assert theirs.sensors()[0].sampler().sample_count() == ours.spp
    assert len(theirs.emitters()) == len(ours.lights) + sum(
        shape.emission is not None for shape in ours.shapes
    )
    instances = any(shape.kind == "instance" for shape in ours.shapes)
    for a, b in zip(sorted(_boxes_of(theirs)), sorted(_boxes(ours)), strict=True):
        if instances:  # of which Mitsuba bounds the group's box, and not what is in it
            assert np.all(np.subtract(a, b)[:3] < 1e-4) and np.all(np.subtract(a, b)[3:] > -1e-4)
        else:
            assert np.allclose(a, b, atol=1e-5)


def _boxes(scene):
    return [
        np.concatenate(studio.world_bounds([shape])).round(4).tolist() for shape in scene.shapes
    ]


def _boxes_of(scene):
    boxes = [shape.bbox() for shape in scene.shapes()]
    return [np.concatenate([box.min, box.max]).round(4).tolist() for box in boxes]


@pytest.mark.peers
@pytest.mark.parametrize("extra", [{}, {"face_normals": True}])
def test_mesh_normals_agree_with_mitsuba(scenes, tmp_path, extra):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    turn = mi.ScalarTransform4f().rotate([1, 2, 3], 40).scale([1, 2, -1])
    flag = "true" if extra else "false"
    path = tmp_path / "s.xml"
    values = " ".join(str(x) for x in np.array(turn.matrix).reshape(-1))
    path.write_text(
        f'<scene><shape type="obj"><string name="filename" value="{scenes / "bowl.obj"}"/>'
        f'<boolean name="face_normals" value="{flag}"/>'
        f'<transform name="to_world"><matrix value="{values}"/></transform></shape>{SENSOR}</scene>'
    )
    ours = load(path).shapes[0]
    theirs = mi.load_dict(
        {"type": "obj", "filename": str(scenes / "bowl.obj"), "to_world": turn, **extra}
    )
    table = mi.traverse(theirs)
    found = _by_vertex(ours.vertices, ours.normals, ours.uvs)
    normals = np.array(table["vertex_normals"]).reshape(-1, 3)
    expected = _by_vertex(
        np.array(table["vertex_positions"]).reshape(-1, 3),
        None if extra else normals,
        np.array(table["vertex_texcoords"]).reshape(-1, 2),
    )
    assert np.allclose(found, expected, atol=2e-4)


def _by_vertex(vertices, normals, uvs):
    """Rows in an order that does not depend on the file reader's."""
    rows = np.column_stack([uvs, vertices] + ([] if normals is None else [normals]))
    return rows[np.lexsort(rows[:, :2].round(4).T)]


def test_the_assets_agree_with_what_mitsuba_found(assets):
    import json

    expected = json.loads((assets / "expected.json").read_text())["mitsuba"]
    others = (f"{name}/scene.xml" for name in ("veach-ajar", "tire", "ashtray"))
    for name in ("cornell_box_picture/scene_picture.xml", *others):
        made = load(assets / "mitsuba" / name, integrator="path")
        known = expected[f"mitsuba/{name}"]
        assert np.allclose(studio.world_bounds(made.shapes), known["bounds"], atol=1e-4)
        emitters = [shape for shape in made.shapes if isinstance(shape.emission, lights.Area)]
        assert len(emitters) + len(made.lights) == known["emitters"]
        assert [made.film.width, made.film.height] == known["film"]


def test_glass_has_mitsubas_index():
    assert glass("bk7", dispersion=False) == Constant(1.5046)


LAMBDAS = np.array([450.0, 520.0, 560.0, 620.0])
MEANINGS = [
    ("emission", '<float name="radiance" value="2"/>'),
    ("emission", '<spectrum name="radiance" value="2"/>'),
    ("emission", '<rgb name="radiance" value="1, 2, 3"/>'),
    ("emission", '<spectrum name="radiance" value="400:1, 500:2, 700:3"/>'),
    ("emission", '<spectrum name="radiance" type="d65"><float name="scale" value="2"/></spectrum>'),
    ("reflectance", '<float name="reflectance" value="0.5"/>'),
    ("reflectance", '<rgb name="reflectance" value="0.1, 0.2, 0.3"/>'),
    ("reflectance", '<spectrum name="reflectance" value="400:0.1, 500:0.2, 700:0.3"/>'),
]


@pytest.mark.peers
@pytest.mark.parametrize("variant", ["scalar_rgb", "scalar_spectral"])
@pytest.mark.parametrize(("role", "xml"), MEANINGS)
def test_spectra_mean_what_they_mean_to_mitsuba(scene, variant, role, xml):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant(variant)
    si = mi.SurfaceInteraction3f()
    si.wi = [0, 0, 1]
    if variant == "scalar_spectral":
        si.wavelengths = LAMBDAS
    if role == "emission":
        ours = scene(f'<emitter type="constant">{xml}</emitter>').lights[0].radiance
        text = f'<emitter version="3.0.0" type="constant">{xml}</emitter>'
        theirs = np.array(mi.load_string(text).eval(si))
    else:
        text = f'<bsdf version="3.0.0" type="diffuse">{xml}</bsdf>'
        ours = scene(f'<shape type="cube">{text}</shape>').shapes[0].material.reflectance
        bsdf = mi.load_string(text)
        theirs = np.pi * np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)))
    found = ours.sample(LAMBDAS) if variant == "scalar_spectral" else ours.to_rgb(role)
    # Tables of the observer and of D65 at 1 nm and 5 nm differ by less than this.
    assert np.allclose(found, theirs, rtol=2e-3)


def test_light_tracing(scene):
    loaded = scene(
        '<integrator type="ptracer"><boolean name="hide_emitters" value="true"/></integrator>'
        '<shape type="disk"><emitter type="directionalarea">'
        '<float name="radiance" value="3"/></emitter></shape>'
    )
    tracer = loaded.integrator
    assert isinstance(tracer, integrators.ParticleTracer)
    assert (tracer.max_depth, tracer.rr_depth, tracer.hide_lights) == (-1, 3, True)
    beam = loaded.shapes[0].emission
    assert isinstance(beam, lights.DirectionalArea)
    assert beam.irradiance == RGBIlluminant(3, 3, 3)
    with pytest.raises(SceneError, match="must stand in a <shape>"):
        scene('<emitter type="directionalarea"/>')


def test_hair(bsdf):
    plain = bsdf('<bsdf type="hair"/>')
    assert plain.eta == pytest.approx(1.55 / 1.000277)
    assert (plain.scale_tilt, plain.longitudinal_roughness) == (2.0, 0.3)
    rgb = [plain.sigma_a.r, plain.sigma_a.g, plain.sigma_a.b]
    np.testing.assert_allclose(rgb, [0.5821, 0.9861, 1.991])
    given = bsdf(
        '<bsdf type="hair"><rgb name="sigma_a" value="1, 2, 3"/><float name="scale" value="2"/>'
        '<float name="int_ior" value="1.6"/><float name="ext_ior" value="1"/></bsdf>'
    )
    assert given.sigma_a == RGBUnbounded(2.0, 4.0, 6.0) and given.eta == 1.6
    with pytest.raises(SceneError, match="not both"):
        bsdf('<bsdf type="hair"><float name="sigma_a" value="1"/>'
             '<float name="eumelanin" value="1"/></bsdf>')  # fmt: skip
