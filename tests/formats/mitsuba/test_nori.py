"""Scenes of Nori: its words, and pictures against its formulas (the course's assignments)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.scene import integrators, lights, materials
from clpt.spectra import RGB, Constant

FLOOR = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nf 1 2 3 4\n"
CAMERA = (
    '<camera type="perspective"><transform name="toWorld">'
    '<lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>'
    '<float name="fov" value="20"/><integer name="width" value="8"/>'
    '<integer name="height" value="8"/></camera>'
)
SKY = '<emitter type="constant"><color name="radiance" value="1,1,1"/></emitter>'


def floor(body: str = "") -> str:
    return f'<mesh type="obj"><string name="filename" value="floor.obj"/>{body}</mesh>'


@pytest.fixture
def read(tmp_path):
    def of(body: str, camera: str = CAMERA):
        (tmp_path / "floor.obj").write_text(FLOOR)
        path = tmp_path / "scene.xml"
        path.write_text(f"<scene>{body}{camera}</scene>")
        return clpt.load(path)

    return of


def test_words_of_nori(read):
    scene = read(
        '<sampler type="independent"><integer name="sampleCount" value="32"/></sampler>'
        '<integrator type="path_mis"/>'
        '<emitter type="point"><point name="position" value="0,0,2"/>'
        '<color name="power" value="4,8,12"/></emitter>'
        + floor('<bsdf type="diffuse"><color name="albedo" value="0.1 0.2 0.3"/></bsdf>')
        + floor('<bsdf type="mirror"/><transform name="toWorld">'
                '<rotate axis="1,0,0" angle="90"/></transform>')
        + floor('<bsdf type="dielectric"><float name="intIOR" value="1.3"/></bsdf>')
    )  # fmt: skip
    assert (scene.spp, scene.film.width, scene.film.height) == (32, 8, 8)
    assert isinstance(scene.film.filter, integrators.Gaussian)
    assert isinstance(scene.integrator, integrators.Path)
    diffuse, mirror, glass = (shape.material for shape in scene.shapes)
    assert diffuse.reflectance == RGB(0.1, 0.2, 0.3)
    assert isinstance(mirror, materials.Conductor)
    assert isinstance(glass, materials.Dielectric)
    assert glass.int_ior == Constant(1.3)
    assert scene.shapes[0].normals is None, "no smooth normals where the file has none"
    np.testing.assert_allclose(scene.shapes[1].vertices[2], (9.0, 0.0, 9.0), atol=1e-5)
    (lamp,) = scene.lights
    assert isinstance(lamp, lights.Point)
    np.testing.assert_allclose(
        (lamp.intensity.r, lamp.intensity.g, lamp.intensity.b), np.array([4, 8, 12]) / 4 / math.pi
    )
    assert not scene.warnings


def test_defaults_of_the_camera(read):
    scene = read(floor(), '<camera type="perspective"/>')
    assert (scene.film.width, scene.film.height, scene.camera.fov) == (1280, 720, 30.0)


def test_a_picture_of_direct_light_needs_no_paths(read):
    whitted = '<integrator type="whitted"/>'
    assert isinstance(read(whitted + floor()).integrator, integrators.Direct)
    scene = read(whitted + floor('<bsdf type="mirror"/>'))
    assert isinstance(scene.integrator, integrators.Path)
    assert scene.warnings == ["scene.xml: of Nori: read: integrator 'whitted' as path (line 1)"]


def test_simple_is_light_of_a_point(read):
    """energy / (4 pi^2) cos / r^2 where the surface sees the point, whatever its material."""
    lamp = (
        '<integrator type="simple"><point name="position" value="0,0,3"/>'
        '<color name="energy" value="500,1000,2000"/></integrator>'
    )
    scene = read(lamp + floor('<bsdf type="mirror"/>'))
    picture = np.asarray(clpt.render(scene, 64, size=(9, 9), mode="rgb"))[4, 4]
    expected = np.array([500.0, 1000.0, 2000.0]) / (4.0 * math.pi**2) / 9.0
    np.testing.assert_allclose(picture, expected, rtol=0.02)  # the pixel sees 0.2 of the floor


def test_ao_is_the_open_share(read):
    scene = read('<integrator type="ao"/>' + floor())
    picture = np.asarray(clpt.render(scene, 256, mode="rgb"))
    assert picture[4, 4].mean() == pytest.approx(1.0, abs=5 / 16 / 16), "5 sigma of a share"
    up = CAMERA.replace('target="0,0,0"', 'target="0,0,9"')
    away = read('<integrator type="ao"/>' + floor(), up)
    assert not np.asarray(clpt.render(away, 4, mode="rgb")).any()


def test_normals_are_a_layer(read):
    scene = read('<integrator type="normals"/>' + floor())
    assert scene.film.layers == ("shading_normal",)
    assert scene.integrator.max_depth == 1


def albedo_of_microfacet(kd: float, alpha: float, inner: float, outer: float) -> float:
    """Albedo straight from above: kd + (1 - kd) times the facets' reflection, in float64.

    Seen from above wi = (0, 0, 1), the facet's normal is half way: theta_o = 2 theta_h, and
    dwo = 4 cos(theta_h) dwh. D is Beckmann's, G1 is Smith's of 1 for wi.
    """
    theta = (np.arange(200_000) + 0.5) / 200_000 * math.pi / 4  # beyond it goes below the surface
    cos_h = np.cos(theta)
    d = np.exp(-(np.tan(theta) ** 2) / alpha**2) / (math.pi * alpha**2 * cos_h**4)
    eta = inner / outer
    cos_t = np.sqrt(1.0 - (1.0 - cos_h**2) / eta**2)
    s = (cos_h - eta * cos_t) / (cos_h + eta * cos_t)
    p = (eta * cos_h - cos_t) / (eta * cos_h + cos_t)
    a = 1.0 / (alpha * np.tan(2.0 * theta))
    tail = (3.535 * a + 2.181 * a**2) / (1.0 + 2.276 * a + 2.577 * a**2)
    g = np.where(a < 1.6, tail, 1.0)
    # f cos_o dwo = F D G / (4 cos_i cos_o) cos_o 4 cos_h dwh
    integrand = (s**2 + p**2) / 2.0 * d * g * cos_h * 2.0 * math.pi * np.sin(theta)
    return kd + (1.0 - kd) * float(integrand.sum() * math.pi / 4 / 200_000)


@pytest.mark.parametrize(("kd", "alpha"), [(0.0, 0.3), (0.4, 0.1), (0.2, 0.5)])
def test_microfacet_under_an_even_sky(read, kd, alpha):
    facets = (
        f'<bsdf type="microfacet"><color name="kd" value="{kd} {kd} {kd}"/>'
        f'<float name="alpha" value="{alpha}"/><float name="intIOR" value="1.7"/></bsdf>'
    )
    scene = read('<integrator type="path_mats"/>' + SKY + floor(facets))
    pixel = np.asarray(clpt.render(scene, 4096, size=(3, 3), mode="rgb"))[1, 1].mean()
    expected = albedo_of_microfacet(kd, alpha, 1.7, 1.000277)
    assert pixel == pytest.approx(expected, abs=0.004)  # the pixel sees slants of up to 3 degrees


def test_colours_of_a_microfacet_add_up(read):
    scene = read(floor('<bsdf type="microfacet"><color name="kd" value="0.1 0.2 0.4"/></bsdf>'))
    blend = scene.shapes[0].material
    assert isinstance(blend, materials.Blend)
    assert blend.weight == pytest.approx(0.6)
    shares = blend.first.reflectance
    np.testing.assert_allclose(np.array([shares.r, shares.g, shares.b]) * 0.4, (0.1, 0.2, 0.4))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<integrator type="av"><float name="length" value="1"/></integrator>', "and no light"),
        (floor('<bsdf type="shiny"/>'), "unknown bsdf 'shiny'"),
        (floor('<bsdf type="microfacet"><color name="kd" value="2 0 0"/></bsdf>'), "at most 1"),
        (floor('<bsdf type="microfacet"><color name="kd" value="2"/></bsdf>'), "3 numbers"),
    ],
)
def test_refused(read, body, message):
    with pytest.raises(SceneError, match=message):
        read(body)
