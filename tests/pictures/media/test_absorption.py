"""Absorption inside of dielectrics: Beer and Lambert's law, with all reflections between faces.

Formulas are written here in float64; significance as in tests/pictures/support.py. A plate lets a
share of light through and sends a share back: geometric series of Fresnel's reflectance and
exp(-absorption * the way through).
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import ParticleTracer, Path, Whitted
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.materials import Dielectric, Diffuse, Layer, Null, RoughDielectric
from clpt.scene.shapes import Cube, Rectangle, Sphere
from tests.pictures.builders import BLACK, DOWN, UP
from tests.pictures.spectra.test_spectral import FINE, HALF_WIDTH, band, to_rgb
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures
from tests.rotation import rotating

THICKNESS = 0.4  # [m]
GLASS = spectra.glass("sf11")
DYE = spectra.Tabulated((360.0, 500.0, 560.0, 830.0), (0.4, 1.0, 6.0, 2.0))  # [1/m]
DEEP = {"path": Path(max_depth=60, rr_depth=100), "whitted": Whitted(max_depth=60)}
OUT_OF_SIGHT = tf.translate([0, 60, -50]) @ tf.scale(1e-3)
DARK = spectra.Tabulated((400.0, 700.0), (0.0, 0.0))
CLEAR = {"int_ior": 1.0, "ext_ior": 1.0}  # a boundary that bends and reflects nothing


def slab(n: Any, a: Any, degrees: float) -> tuple[Any, Any]:
    """(transmitted, reflected) by a plate of index n and coefficient a, in the air of index 1."""
    cos_i = np.cos(np.radians(degrees))
    cos_t = np.sqrt(1.0 - (np.sin(np.radians(degrees)) / n) ** 2)
    rs = (cos_i - n * cos_t) / (cos_i + n * cos_t)
    rp = (n * cos_i - cos_t) / (n * cos_i + cos_t)
    f = 0.5 * (rs**2 + rp**2)  # clpt, like its peers, knows no polarisation
    x = np.exp(-a * THICKNESS / cos_t)
    passed = (1.0 - f) ** 2 * x / (1.0 - (f * x) ** 2)
    return passed, f + f * x * passed


def plate(material: Dielectric, degrees: float, light: Any, below: bool) -> Scene:
    """A wide plate seen at an angle; the light is a lamp below it, or even, from everywhere.

    The other one is dark and out of sight, so that one set of programs serves both.
    """
    t = np.radians(degrees)
    eye = np.array([np.sin(t), 0.0, np.cos(t)]) * 5.0
    lamp = tf.translate([0, 0, -1.0]) @ tf.scale(1000.0) if below else OUT_OF_SIGHT
    shapes = [
        Cube(to_world=tf.scale([90.0, 90.0, THICKNESS / 2]), material=material),
        Rectangle(to_world=lamp, material=BLACK, emission=Area(radiance=light if below else DARK)),
    ]
    return Scene(
        camera=Orthographic(to_world=tf.look_at(eye, [0, 0, 0], UP) @ tf.scale([0.01, 0.01, 1.0])),
        shapes=shapes,
        lights=[Constant(radiance=DARK if below else light)],
        film=Film(width=8, height=8),
    )


@rotating(
    "degrees, centre, integrator",
    (0.0, 40.0, 75.0),
    (450.0, 550.0, 640.0),
    tuple(DEEP),
    turn={0.0: 0, 40.0: 3, 75.0: 4}.get,  # so that every centre and integrator has a turn
)
def test_plate(integrator: str, degrees: float, centre: float) -> None:
    """A dyed plate of flint in narrow light, at angles and wavelengths: what passes, and all."""
    light = band(centre)
    values = np.maximum(1.0 - np.abs(FINE - centre) / HALF_WIDTH, 0.0)
    passed, reflected = slab(GLASS.sample(FINE), DYE.sample(FINE), degrees)
    glass = Dielectric(int_ior=GLASS, ext_ior=1.0, absorption=DYE)
    for below, share in ((True, passed), (False, passed + reflected)):
        scene = plate(glass, degrees, light, below)
        ends = {"lambda_min": centre - HALF_WIDTH, "lambda_max": centre + HALF_WIDTH}
        film = dataclasses.replace(scene.film, **ends)
        scene = dataclasses.replace(scene, integrator=DEEP[integrator], film=film)
        expected = to_rgb(values * share)
        images = exposures(scene, 16, 128).mean(axis=(1, 2))
        # Bands lie beyond Rec. 709, so colours are compared by their greatest component.
        off = np.abs(images.mean(axis=0) - expected).max() / np.abs(expected).max()
        assert off < 0.01, f"{images.mean(axis=0)}, expected {expected}"
        assert_agree(images[:, None, None], expected[None, None, None], allowed=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_plate_in_rgb(degrees: float) -> None:
    """In RGB mode each component of the coefficient absorbs its own."""
    a = np.array([0.3, 2.0, 7.0])
    glass = Dielectric(int_ior=1.5, ext_ior=1.0, absorption=tuple(a))
    for below in (True, False):
        passed, reflected = slab(1.5, a, degrees)
        scene = plate(glass, degrees, (1.0, 1.0, 1.0), below)
        scene.film = Film(width=8, height=8, mode="rgb")
        scene.integrator = DEEP["path"]
        assert_mean(exposures(scene, 16, 64), passed if below else passed + reflected, 0.01)


def bowl(material: Any, mode: str, inside: list, lights: list, depth: int = 20) -> Scene:
    """A ball of radius 1 seen from above, and what is inside of it."""
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0, 0, 4], [0, 0, 0], UP) @ tf.scale([0.01, 0.01, 1])
        ),
        shapes=[Sphere(material=material), *inside],
        lights=lights,
        integrator=Path(max_depth=depth, rr_depth=100),
        film=Film(width=8, height=8, mode=mode),
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("layers", [(), (Layer(eta=1.0),)], ids=["bare", "film"])
def test_lamp_inside(layers: tuple, mode: str) -> None:
    """A lamp of radius .25, seen through .75 m of the medium; a film of air changes nothing."""
    lamp = Sphere(radius=0.25, material=BLACK, emission=Area(radiance=(1.0, 1.0, 1.0)))
    scene = bowl(Dielectric(**CLEAR, absorption=2.0, layers=layers), mode, [lamp], [])
    assert_mean(exposures(scene, 8, 64), [np.exp(-2.0 * 0.75)] * 3, 0.01, 1e-3)


@pytest.mark.parametrize("mode", [pytest.param("rgb", marks=pytest.mark.slow), "spectral"])
@pytest.mark.parametrize("integrator", ["path", pytest.param("whitted", marks=pytest.mark.slow)])
def test_direct_light_inside(integrator: str, mode: str) -> None:
    """The middle of a table inside, a point light .5 m above: the light's way and ours absorb."""
    table = Rectangle(to_world=tf.scale(0.6), material=Diffuse(reflectance=0.5))
    lamp = Point(position=(0.0, 0.0, 0.5), intensity=(1.0, 1.0, 1.0))
    scene = bowl(Dielectric(**CLEAR, absorption=2.0), mode, [table], [lamp], depth=3)
    three = {"path": Path(max_depth=3), "whitted": Whitted(max_depth=3, ambient=0.0)}
    scene = dataclasses.replace(scene, integrator=three[integrator])
    expected = 0.5 / np.pi / 0.5**2 * np.exp(-2.0 * (0.5 + 1.0))
    assert_mean(exposures(scene, 8, 32), [expected] * 3, 0.01, 2e-3)


@pytest.mark.slow
def test_sky_is_infinitely_far() -> None:
    """Below an endless surface of what absorbs, all light is lost; above clear glass, none."""
    for a, expected in ((0.5, 0.0), (0.0, 1.0)):
        sheet = Rectangle(to_world=tf.scale(50.0), material=Dielectric(**CLEAR, absorption=a))
        dyed = Sphere(center=(9.0, 0.0, 0.0), material=Dielectric(**CLEAR, absorption=1.0))
        scene = dataclasses.replace(
            bowl(Null(), "spectral", [sheet, dyed], [Constant(radiance=(1.0, 1.0, 1.0))]),
            shapes=[sheet, dyed],
        )
        assert abs(clpt.render(scene, 16).mean() - expected) < 0.01


def test_camera_inside() -> None:
    """A ray that begins inside learns of the medium where it meets the boundary's back."""
    scene = bowl(Dielectric(**CLEAR, absorption=2.0), "rgb", [], [Constant(radiance=(1, 1, 1))])
    view = tf.look_at([0, 0, 0.5], [0, 0, 0], UP) @ tf.scale([0.01, 0.01, 1])
    scene.camera = Orthographic(to_world=view, near=1e-4)
    assert_mean(exposures(scene, 4, 16), [np.exp(-2.0 * 1.5)] * 3, 0.01, 1e-3)


@pytest.mark.slow
def test_light_traced_from_the_lamp() -> None:
    """A dyed block between a lamp and a table: its shadow is the same from either end.

    The camera does not see the block, in which light traced from the lamp shows nothing.
    """
    lamp = tf.translate([0, 0, 2.0]) @ DOWN @ tf.scale(0.5)
    block = tf.translate([0, 0, 1.0]) @ tf.scale([0.4, 0.4, 0.2])
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([3, 0, 3], [0, 0, 0], UP), fov=8.0),
        shapes=[
            Rectangle(to_world=tf.scale(2.0), material=Diffuse(reflectance=0.8)),
            Cube(to_world=block, material=Dielectric(int_ior=GLASS, ext_ior=1.0, absorption=DYE)),
            Rectangle(to_world=lamp, material=BLACK, emission=Area(radiance=(4.0, 4.0, 4.0))),
        ],
        film=Film(width=16, height=16),
    )
    images = [
        exposures(dataclasses.replace(scene, integrator=integrator), 16, 256)
        for integrator in (Path(max_depth=8, rr_depth=100), ParticleTracer(max_depth=8))
    ]
    assert_agree(blocks(images[0]), blocks(images[1]), "shadow")
    whole = [image.mean(axis=(1, 2), keepdims=True) for image in images]
    assert_agree(whole[0], whole[1], "all of it")


def coloured(material: type, **changes: Any) -> Scene:
    """A ball of glass on a table, under a lamp, with a lamp and a pebble inside."""
    glass = material(int_ior=1.5, ext_ior=1.0, **changes)
    lamp = Rectangle(
        to_world=tf.translate([0, 3, 0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.7),
        material=BLACK,
        emission=Area(radiance=(9.0, 8.0, 7.0)),
    )
    floor = tf.translate([0, -1.001, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(4.0)
    spark = Area(radiance=(6.0, 6.0, 6.0))
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0, 2, 4], [0, -0.2, 0], UP) @ tf.scale([1.6, 1.6, 1])
        ),
        shapes=[
            Rectangle(to_world=floor, material=Diffuse(reflectance=0.6)),
            Sphere(material=glass),
            Sphere(center=(0.4, 0.1, 0.2), radius=0.2, material=BLACK, emission=spark),
            Sphere(center=(-0.4, 0.0, 0.2), radius=0.25, material=Diffuse(reflectance=0.7)),
            lamp,
        ],
        integrator=Path(max_depth=9, rr_depth=100),
        film=Film(width=24, height=24),
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("integrator", ["path", "whitted"])
def test_no_absorption_changes_no_bit(integrator: str, mode: str) -> None:
    """A coefficient of 0, with the code that reads it and without, gives the same picture."""
    zero = spectra.Tabulated((400.0, 700.0), (0.0, 0.0))
    scenes = [coloured(Dielectric, absorption=zero), coloured(Dielectric)]
    images = []
    for scene in scenes:
        scene = dataclasses.replace(scene, integrator=DEEP[integrator])
        scene.film = Film(width=24, height=24, mode=mode)
        images.append(clpt.render(scene, 4))
    assert np.array_equal(*images)


MITSUBA = {"dielectric": Dielectric, "roughdielectric": RoughDielectric}


@pytest.mark.peers
@pytest.mark.parametrize("mode", [pytest.param("rgb", marks=pytest.mark.slow), "spectral"])
@pytest.mark.parametrize(
    "plugin", ["dielectric", pytest.param("roughdielectric", marks=pytest.mark.slow)]
)
def test_ball_beside_mitsuba(plugin: str, mode: str) -> None:
    """The ball with a homogeneous medium that only absorbs, through Mitsuba's `volpath`."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant(f"scalar_{mode}")
    a = 0.8 if mode == "spectral" else (0.3, 1.0, 2.0)
    scene = coloured(
        MITSUBA[plugin],
        absorption=a,
        **({"alpha_u": 0.2, "alpha_v": 0.2} if plugin != "dielectric" else {}),
    )
    scene.film = Film(width=24, height=24, mode=mode)
    made = mi.load_dict(_for_mitsuba(mi, scene, plugin, a))
    theirs = np.array([np.array(mi.render(made, spp=32, seed=i)) for i in range(12)])
    assert_agree(blocks(exposures(scene, 24, 32)), blocks(theirs), "blocks", 3e-3)


def _for_mitsuba(mi: Any, scene: Scene, plugin: str, a: Any) -> dict:
    """The scene of `coloured` as a Mitsuba dictionary."""

    def place(matrix: np.ndarray) -> Any:
        return mi.ScalarTransform4f(np.asarray(matrix, float).tolist())

    def rgb(value: Any) -> dict:
        return {"type": "rgb", "value": list(np.broadcast_to(value, 3).astype(float))}

    def diffuse(value: float) -> dict:
        return {"type": "diffuse", "reflectance": {"type": "uniform", "value": value}}

    def lamp(*value: float) -> dict:
        return {"type": "area", "radiance": rgb(value)}

    floor, _, spark, pebble, light = scene.shapes
    glass = {"type": plugin, "int_ior": 1.5, "ext_ior": 1.0}
    if plugin == "roughdielectric":
        glass |= {"distribution": "ggx", "alpha": 0.2}
    sigma = (
        {"type": "uniform", "value": a / 2.0} if isinstance(a, float) else rgb(np.divide(a, 2.0))
    )
    medium = {
        "type": "homogeneous",
        "scale": 2.0,
        "sigma_t": sigma,
        "albedo": {"type": "uniform", "value": 0.0},
    }
    own = {"type": "ref", "id": "inside"}
    film = {"type": "hdrfilm", "width": 24, "height": 24, "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 9, "rr_depth": 100},
        "inside": medium,
        "sensor": {
            "type": "orthographic",
            "to_world": place(scene.camera.to_world),
            "film": film,
        },
        "floor": {"type": "rectangle", "to_world": place(floor.to_world), "bsdf": diffuse(0.6)},
        "ball": {"type": "sphere", "bsdf": glass, "interior": own},
        "spark": {
            "type": "sphere", "center": list(spark.center), "radius": 0.2,
            "bsdf": diffuse(0.0), "emitter": lamp(6.0, 6.0, 6.0), "exterior": own,
        },
        "pebble": {
            "type": "sphere", "center": list(pebble.center), "radius": 0.25,
            "bsdf": diffuse(0.7), "exterior": own,
        },
        "lamp": {
            "type": "rectangle", "to_world": place(light.to_world),
            "bsdf": diffuse(0.0), "emitter": lamp(9.0, 8.0, 7.0),
        },
    }  # fmt: skip
