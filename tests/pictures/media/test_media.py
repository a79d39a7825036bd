"""Media: invisible where nothing absorbs, exponential where nothing scatters, and the same bits
however a render is split.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene, media, phases
from clpt.scene.cameras import Perspective, Spherical
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Area, Constant, Point, Spot
from clpt.scene.materials import Dielectric, Diffuse, GltfSurface, Null
from clpt.scene.shapes import Cube, Rectangle, Sphere
from tests.pictures.support import (
    assert_agree,
    assert_mean,
    blocks,
    exposures,
    mitsubas,
    pictures_of_parts,
)

SHARED = Path(__file__).resolve().parents[4] / "shared" / "bench" / "media"
LONG = PathIntegrator(max_depth=-1, rr_depth=1000, light_paths=0)
CHROMATIC = (0.5, 2.0, 3.0)  # [1/m]
MODES = ("rgb", "spectral")
# one part of which differs between wavelengths
VARIED = phases.Blend(
    weight=0.4,
    first=phases.HenyeyGreenstein(g=spectra.Tabulated((400.0, 700.0), (-0.3, 0.8), "hold")),
    second=phases.Draine(g=0.3, alpha=2.0),
)
WITHIN = 0.02  # relative; most of it is noise


def ball(medium: media.Medium, material=None, **more) -> Scene:
    """A ball that fills the picture, under the same light from everywhere."""
    body = Sphere(material=material or Null(), interior=medium, **more)
    return Scene(
        camera=Perspective(fov=12.0, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])),
        shapes=[body],
        lights=[Constant(radiance=1.0)],
        film=Film(width=8, height=8, filter=Box()),
        integrator=LONG,
    )


def with_mode(scene: Scene, mode: str) -> Scene:
    return dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))


ALL_LEAVES = {phases.Reradiating: {"reflectance": 1.0}}  # by default some light is lost
LOSSLESS = [cls(**ALL_LEAVES.get(cls, {})) for cls in phases.KINDS]
FURNACES = [
    pytest.param(phase, mode, id=f"{phase.kind}-{mode}", marks=marks)
    for phase in (*LOSSLESS, VARIED)
    for mode in MODES
    for marks in (() if mode == "spectral" and phase is VARIED else pytest.mark.slow,)
]


@pytest.mark.parametrize(("phase", "mode"), FURNACES)
def test_furnace(phase: phases.Phase, mode: str) -> None:
    """What scatters all light cannot be seen under the same light from everywhere."""
    scene = ball(media.Homogeneous(sigma_s=CHROMATIC, phase=phase))
    assert_mean(exposures(with_mode(scene, mode), 8, 64), 1.0, WITHIN)


@pytest.mark.parametrize("number", range(len(LOSSLESS) + 1))
def test_furnace_beside_others(number: int) -> None:
    """A ball of each phase function, one of which is seen: all of them by one program."""
    places = [9.0 * i for i in range(len(LOSSLESS) + 1)]
    balls = [
        ball(media.Homogeneous(sigma_s=CHROMATIC, phase=phase), to_world=tf.translate([x, 0, 0]))
        for phase, x in zip((*LOSSLESS, VARIED), places, strict=True)
    ]
    x = places[number]
    scene = dataclasses.replace(
        balls[0],
        shapes=[shape for one in balls for shape in one.shapes],
        camera=Perspective(fov=12.0, to_world=tf.look_at([x, 0, 5], [x, 0, 0], [0, 1, 0])),
    )
    assert_mean(exposures(with_mode(scene, "rgb"), 8, 64), 1.0, WITHIN)


GLASS = [
    Dielectric(int_ior=1.3, ext_ior=1.0),
    pytest.param(
        GltfSurface(metallic=0.0, roughness=0.05, transmission=1.0), marks=pytest.mark.slow
    ),
]


@pytest.mark.parametrize("glass", GLASS, ids=["dielectric", "gltf_surface"])
def test_furnace_behind_glass(glass) -> None:
    scene = ball(media.Homogeneous(sigma_s=4.0), glass)
    assert_mean(exposures(with_mode(scene, "rgb"), 8, 128), 1.0, WITHIN)


def test_camera_in_a_medium() -> None:
    """It is told, or known from the boundary that its first ray meets from inside."""
    fog = media.Homogeneous(sigma_t=0.7, albedo=1.0)
    scene = with_mode(ball(fog, to_world=tf.scale(9.0)), "rgb")
    assert_mean(exposures(scene, 8, 64), 1.0, WITHIN)
    told = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, medium=fog))
    assert np.array_equal(exposures(told, 1, 16), exposures(scene, 1, 16))


def test_camera_enters_a_medium_and_leaves_it() -> None:
    """Of a wall within fog no boundary tells; the camera's medium follows it, and the boundary."""
    fog = media.Homogeneous(sigma_a=0.5, name="fog")
    scene = with_mode(ball(fog, to_world=tf.scale(3.0)), "rgb")
    scene.camera = dataclasses.replace(scene.camera, fov=1.0, near=0.0)
    wall = Rectangle(emission=Area(radiance=1.0), material=BLACK, to_world=tf.scale(2.0))
    scene.shapes, scene.lights = [*scene.shapes, wall], []
    inside = dataclasses.replace(
        scene.camera, to_world=tf.look_at([0, 0, 2.0], [0, 0, 0], [0, 1, 0])
    )
    with clpt.Renderer(scene) as renderer:
        for camera, way in ((inside, 2.0), (scene.camera, 3.0), (inside, 2.0)):
            renderer.update(camera=camera)
            renderer.run(4)
            assert renderer.image().mean() == pytest.approx(np.exp(-0.5 * way), rel=1e-3)
        renderer.update(transforms={0: tf.translate([0, 0, 9]) @ tf.scale(3.0)})
        renderer.run(4)
        assert renderer.image().mean() == pytest.approx(1.0, rel=1e-3)


def test_camera_is_told_a_medium_where_there_was_none() -> None:
    scene = with_mode(ball(media.Homogeneous()), "rgb")
    wall = Rectangle(emission=Area(radiance=1.0), material=BLACK, to_world=tf.scale(2.0))
    scene.shapes, scene.lights = [wall], []
    away = tf.look_at([0, 0, 2.0], [0, 0, 0], [0, 1, 0])
    scene.camera = Perspective(fov=1.0, near=0.0, to_world=away)
    fog = media.Homogeneous(sigma_a=0.5)
    with clpt.Renderer(scene) as renderer:
        renderer.update(camera=dataclasses.replace(scene.camera, medium=fog))
        renderer.run(4)
        assert renderer.image().mean() == pytest.approx(np.exp(-1.0), rel=1e-3)


def test_absorbs_as_beer_and_lambert_say() -> None:
    """exp(-sigma_a t) through a cube, without any noise, and for each wavelength of its own."""
    dye = spectra.Tabulated((360.0, 500.0, 560.0, 830.0), (0.1, 0.4, 1.5, 0.2))
    film = Film(width=4, height=4, filter=Box(), bands=16, lambda_min=420, lambda_max=680)
    scene = dataclasses.replace(ball(media.Homogeneous(sigma_a=dye)), film=film)
    scene.shapes = [Cube(material=Null(), interior=media.Homogeneous(sigma_a=dye))]
    scene.lights = [Constant(radiance=spectra.Constant(1.0))]
    scene.camera = Perspective(fov=0.1, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]))
    with clpt.Renderer(scene) as renderer:
        renderer.run(256)
        bands = renderer.image().mean(axis=(0, 1))
    edges = np.linspace(420, 680, 17)
    fine = [np.linspace(a, b, 201) for a, b in pairwise(edges)]
    expected = [np.exp(-2.0 * dye.sample(one)).mean() for one in fine]
    np.testing.assert_allclose(bands, expected, rtol=0.02)


LAMPS: dict[str, list[Point | Spot]] = {
    "near": [Point(position=(0.3, 0.0, -1.0), intensity=1.0)],
    "three": [
        Point(position=at, intensity=power)
        for at, power in (((0.2, 0.1, -2.0), 1.0), ((0.0, -0.8, 2.0), 0.5), ((-4.0, 0.0, 1.0), 9.0))
    ],
}


def _spot(at: list[float], to: list[float], power: float, cutoff: float) -> Spot:
    matrix = tf.look_at(at, to, [0.1, 1, 0.2])
    return Spot(to_world=matrix, intensity=power, cutoff=cutoff, beam_width=cutoff - 1e-3)


LAMPS["spot"] = [_spot([0.5, 2.0, 0.0], [0.0, 0.0, 0.5], 2.0, 12.0)]
LAMPS["spots"] = [  # across the ray, along it, against it, away from it, and one that is none
    *LAMPS["spot"],
    _spot([0.1, 0.3, 2.0], [0.0, 0.0, -2.0], 0.5, 15.0),
    _spot([-0.2, 0.1, -4.0], [0.0, 0.0, 5.0], 0.5, 9.0),
    _spot([0.2, 0.2, 3.0], [2.0, 2.0, 3.0], 0.2, 40.0),
    LAMPS["three"][2],
]
SLOWLY = (pytest.param(name, marks=pytest.mark.slow) for name in ("near", "spot"))


def shines(lamp: Point | Spot, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ways (n, 3) from points to a lamp, and what it sends them [W/sr]."""
    if isinstance(lamp, Point):
        to = np.asarray(lamp.position) - points
        return to, np.full(len(to), lamp.intensity.r)
    to = lamp.to_world[:3, 3] - points
    cosine = -(to @ lamp.to_world[:3, 2]) / np.linalg.norm(to, axis=1)
    lit = cosine > np.cos(np.radians(lamp.cutoff))
    return to, lit * lamp.intensity.r


@pytest.mark.parametrize("lamps", [*SLOWLY, "three", "spots"])
def test_light_scattered_once_is_an_integral_over_the_ray(lamps: str) -> None:
    """Of lamps in haze that flights end near: sigma_s p I / r^2 exp(-sigma_t (t + r))."""
    sigma, albedo, g, end = np.array([0.05, 0.2, 0.3]), 0.8, 0.5, 10.0
    phase = phases.HenyeyGreenstein(g=g)
    haze = media.Homogeneous(sigma_t=tuple(sigma), albedo=albedo, phase=phase)
    wall = Rectangle(
        to_world=tf.translate([0, 0, 5 - end]) @ tf.scale(9.0), material=Diffuse(reflectance=0.0)
    )
    scene = with_mode(ball(haze), "rgb")
    scene.shapes = [wall]
    scene.lights = list(LAMPS[lamps])
    scene.integrator = dataclasses.replace(LONG, max_depth=2)
    scene.camera = Perspective(
        fov=0.01, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]), medium=haze
    )
    t = (np.arange(200_000) + 0.5) / 200_000 * end
    expected = np.zeros(3)
    for lamp in LAMPS[lamps]:
        to, power = shines(lamp, np.column_stack([0 * t, 0 * t, 5.0 - t]))
        r = np.linalg.norm(to, axis=1)
        cosine = -to[:, 2] / r  # of how far it turns
        hg = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        lit = (hg * power / r**2)[:, None] * np.exp(-sigma * (t + r)[:, None])
        expected += (sigma * albedo * lit).mean(axis=0) * end
    assert_mean(exposures(scene, 8, 256), expected, WITHIN)


def test_light_through_boundaries() -> None:
    """A lamp seen through two balls, one in the other: the sum of the ways through each."""
    outer, inner = (media.Homogeneous(sigma_a=a) for a in (0.3, 1.1))
    shapes = [
        Sphere(material=Null(), interior=outer, to_world=tf.scale(2.0)),
        Sphere(material=Null(), interior=inner, exterior=outer),
        Rectangle(
            to_world=tf.translate([0, 0, -4]) @ tf.scale(9.0),
            material=Diffuse(reflectance=1.0),
        ),
    ]
    scene = dataclasses.replace(ball(outer), shapes=shapes, lights=[])
    scene.lights = [Point(position=(0.0, 0.0, 3.0), intensity=1.0)]
    scene.camera = Perspective(fov=0.1, to_world=tf.look_at([5, 0, 0], [0, 0, -4], [0, 1, 0]))
    scene.integrator = dataclasses.replace(LONG, max_depth=2)
    with clpt.Renderer(with_mode(scene, "rgb")) as renderer:
        renderer.run(4)
        got = renderer.image().mean()
    lost = np.exp(-(0.3 * 2.0 + 1.1 * 2.0))
    # the camera's own way: from (5, 0, 0) to (0, 0, -4), nearest to the centre at 20 / sqrt 41
    near = 20.0 / np.sqrt(41.0)
    seen = np.exp(-0.3 * 2.0 * np.sqrt(max(4.0 - near**2, 0.0)))
    assert got == pytest.approx(lost * seen / (np.pi * 49.0), rel=1e-3)


def test_same_bits_however_split() -> None:
    scene = with_mode(ball(media.Homogeneous(sigma_t=CHROMATIC, albedo=0.9)), "spectral")
    assert np.array_equal(*pictures_of_parts(scene))


def test_layers_of_what_scatters() -> None:
    """Denoisers see the albedo of an opaque mist's light; other layers are of surfaces."""
    scene = with_mode(ball(media.Homogeneous(sigma_s=5000.0)), "rgb")
    wanted = ("denoising_albedo", "depth", "shading_normal", "shape_id")
    film = dataclasses.replace(scene.film, layers=wanted, filtering="importance")
    scene = dataclasses.replace(scene, film=film)
    scene.integrator = dataclasses.replace(LONG, max_depth=2)
    with clpt.Renderer(scene) as renderer:
        renderer.run(8)
        layers = renderer.layers()
    assert layers["denoising_albedo"] == pytest.approx(1.0, abs=1e-5)
    assert not layers["depth"].any()
    assert not layers["shading_normal"].any()
    assert (layers["shape_id"] == -1).all()


def test_depth_counts_collisions() -> None:
    """With max_depth 1 light is only met; dark beyond what passes unscattered."""
    scene = with_mode(ball(media.Homogeneous(sigma_s=1.0)), "rgb")
    scene.integrator = dataclasses.replace(LONG, max_depth=1)
    scene.camera = Perspective(fov=0.1, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]))
    assert_mean(exposures(scene, 8, 256), np.exp(-2.0), WITHIN)


def test_what_media_may_be() -> None:
    with pytest.raises(SceneError, match="above 0"):
        media.Homogeneous.from_albedo(0.5, 0.0)
    with pytest.raises(SceneError, match="between"):
        media.Homogeneous.from_albedo(0.5, 1.0, g=1.0)
    white = media.Homogeneous.from_albedo((0.0, 0.5, 1.0), 2.0).coefficients(spectral=False)
    assert [one.r + two.r for one, two in [white]] == [0.5]
    assert white[0].b == 0.0 and white[1].r == 0.0
    with pytest.raises(SceneError, match="not both"):
        media.Homogeneous(sigma_a=1.0, sigma_t=1.0)
    with pytest.raises(SceneError, match="outside"):
        media.Homogeneous(sigma_t=1.0, albedo=1.5)


@pytest.mark.parametrize(
    "g, mode", [(0.0, "rgb"), pytest.param(0.6, "spectral", marks=pytest.mark.slow)]
)
def test_albedo_of_a_thick_body(g: float, mode: str) -> None:
    """It reflects what was asked for, of even light: 2 mu R(mu) summed over the cosines mu."""
    wanted = (0.8, 0.5, 0.2)
    if mode == "spectral":
        wanted = (0.6,) * 3
    body = media.Homogeneous.from_albedo(wanted, 0.02, g=g)
    scene = with_mode(ball(body), mode)
    deep = tf.translate([0, -1, 0]) @ tf.scale([200.0, 1.0, 200.0])
    floor = tf.translate([0, -3, 0]) @ tf.rotate([1, 0, 0], -90.0) @ tf.scale(1e3)
    scene.shapes = [
        Cube(material=Null(), interior=body, to_world=deep),
        Rectangle(material=BLACK, to_world=floor),
    ]
    scene.camera = Spherical(to_world=tf.translate([0, 0.01, 0]))
    scene.film = dataclasses.replace(scene.film, width=16, height=32)
    scene.integrator = dataclasses.replace(LONG, rr_depth=8)
    with clpt.Renderer(scene) as renderer:
        renderer.run(128)
        rows = np.asarray(renderer.image()).mean(axis=1)[16:]
    theta = np.pi * (np.arange(16) + 0.5) / 32.0
    weights = np.sin(theta) * np.cos(theta)
    found = weights[::-1] @ rows.reshape(16, -1) / weights.sum()
    assert found[:3] == pytest.approx(wanted, abs=0.01)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the benchmark's scenes are not there")
@pytest.mark.parametrize(
    "name",
    [
        "iso_a0.99_t2",
        "hg8_a0.9_t2",
        "iso_a1_t2",
        pytest.param("rayleigh_a0.99_t2", marks=pytest.mark.slow),
    ],
)
def test_slab_against_adding_and_doubling(name: str) -> None:
    """Reflectance of a slab seen from above, under radiance 1."""
    case = json.loads((SHARED / "references" / "slab.json").read_text())["cases"][name]
    kinds = {"iso": phases.Isotropic(), "hg8": phases.HenyeyGreenstein(g=0.8)}
    slab = media.Homogeneous(
        sigma_t=case["tau"],
        albedo=case["albedo"],
        phase=kinds.get(case["phase"], phases.Rayleigh()),
    )
    scene = with_mode(ball(slab), "rgb")
    scene.shapes = [
        Cube(material=Null(), interior=slab, to_world=tf.scale([500, 500, 0.5])),
        Rectangle(to_world=tf.translate([0, 0, -0.6]) @ tf.scale(9e2), material=BLACK),
    ]
    scene.camera = Perspective(fov=0.5, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]))
    assert_mean(exposures(scene, 8, 256), case["R_normal"], WITHIN)


BLACK = Diffuse(reflectance=0.0)


MITSUBA = """<scene version="3.0.0">
<integrator type="volpath"><integer name="max_depth" value="6"/></integrator>
<sensor type="perspective"><float name="fov" value="30"/>
<transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
<rfilter type="box"/></film></sensor>
<emitter type="directional"><vector name="direction" x="1" y="-0.3" z="-0.8"/></emitter>
<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior">
<float name="sigma_t" value="2"/><float name="albedo" value="0.9"/>
<phase type="blendphase"><float name="weight" value="0.7"/>
<phase type="hg"><float name="g" value="-0.4"/></phase>
<phase type="tabphase"><string name="values" value="0.3, 0.1, 0.4, 1.5, 6"/></phase>
</phase></medium></shape></scene>"""


@pytest.mark.peers
@pytest.mark.slow
def test_tables_and_blends_are_mitsubas(tmp_path: Path) -> None:
    """The same picture, and a table that looks forward where Mitsuba's does."""
    path = tmp_path / "blend.xml"
    path.write_text(MITSUBA)
    theirs = mitsubas(path, 24, 64)
    ours = exposures(with_mode(clpt.load(path), "rgb"), 24, 64)
    assert_agree(blocks(ours), blocks(theirs), "a blend of hg and a table")
