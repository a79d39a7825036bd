"""The same picture at every scale: wherever a scene stands, and however small or large it is.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Integrator, Path, Vcm
from clpt.scene.lights import (
    Area,
    Constant,
    Directional,
    Envmap,
    Goniometric,
    Point,
    Projector,
    Sky,
    Spot,
)
from clpt.scene.materials import Conductor, Dielectric, Diffuse, TwoSided
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Sphere
from tests.pictures.builders import BLACK, DOWN, UP
from tests.pictures.support import assert_agree, blocks, exposures

EVEN = Constant(radiance=(1.0, 1.0, 1.0))
DEEP = Path(max_depth=60, rr_depth=100)
CLEAR = {"int_ior": 1.0, "ext_ior": 1.0}  # a boundary that bends and reflects nothing


def looking_at(point: Any, half: float, shapes: list[Shape], **more: Any) -> Scene:
    """Shapes seen along -z from 4 m above a point, in a square 2 * half wide, under an even sky."""
    point = np.asarray(point, float)
    view = tf.look_at(np.add(point, (0, 0, 4)), point, UP) @ tf.scale([half, half, 1])
    return Scene(
        camera=Orthographic(to_world=view),
        shapes=shapes,
        integrator=DEEP,
        film=Film(width=4, height=4, mode="rgb"),
        **{"lights": [EVEN], **more},
    )


@pytest.mark.parametrize("at", [0.0, 10.0], ids=["at_the_origin", "ten_metres_away"])
def test_absorption_takes_the_whole_thickness(at: float) -> None:
    """A cube that absorbs 1 / e, however thin: the ray's step off its surface is no part of it."""
    for thickness in (1e-3, 1e-2):
        dye = Dielectric(**CLEAR, absorption=1.0 / thickness)
        cube = Cube(to_world=tf.translate([at] * 3) @ tf.scale(thickness / 2), material=dye)
        image = clpt.render(looking_at([at] * 3, thickness / 8, [cube]), 4)
        ulp = float(np.spacing(np.float32(at)))  # by which faces are rounded
        np.testing.assert_allclose(image, np.exp(-1.0), rtol=1e-5 + 2.0 * ulp / thickness)


def test_thin_bodies_are_left_again() -> None:
    """Clear panes far from the origin, and a small ball: nobody sees them in an even sky."""
    glass = Dielectric(int_ior=1.5, ext_ior=1.0)
    panes = ((20.0, 1e-3), (50.0, 2e-3), (100.0, 4e-3), (1e4, 0.4))
    for x, thickness in panes:
        placed = tf.translate([x] * 3) @ tf.scale([1, 1, thickness / 2])
        image = clpt.render(looking_at([x] * 3, 0.5, [Cube(to_world=placed, material=glass)]), 16)
        np.testing.assert_allclose(image, 1.0, atol=1e-4, err_msg=f"{thickness} m at {x} m")
    image = clpt.render(looking_at([0] * 3, 1.5e-5, [Sphere(radius=2e-5, material=glass)]), 16)
    np.testing.assert_allclose(image, 1.0, atol=1e-4)


def still_life() -> list[Shape]:
    """A shape of each kind on a white floor, under a square lamp and a round one."""
    white = Diffuse(reflectance=0.7)
    turned = tf.rotate([1, 2, 3], 40) @ tf.scale(0.3)
    glow = Area(radiance=(4.0, 4.0, 4.0))
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.uint32)
    return [
        Rectangle(to_world=tf.scale(2.0), material=white),
        Cube(to_world=tf.translate([0.6, 0.6, 0.6]) @ turned, material=white),
        Sphere(center=(-0.6, 0.6, 0.4), radius=0.4, material=white),
        Disk(to_world=tf.translate([0.6, -0.6, 0.4]) @ turned, material=white),
        Cylinder(p0=(-0.9, -0.6, 0.4), p1=(-0.3, -0.5, 0.5), radius=0.2, material=white),
        Mesh(vertices=vertices, faces=tetrahedron, to_world=tf.scale(0.5), material=white),
        Rectangle(
            to_world=tf.translate([0.5, 0.5, 3.0]) @ DOWN @ tf.scale(0.5),
            material=BLACK,
            emission=glow,
        ),
        Sphere(center=(-1.5, 0.0, 1.5), radius=0.2, material=BLACK, emission=glow),
    ]


def placed(shapes: list[Shape], to_world: np.ndarray, mode: str) -> Scene:
    """The shapes and the camera that looks at them, all of them moved and scaled."""
    view = tf.look_at([2.5, -2.0, 2.5], [0, 0, 0.4], [0, 0, 1])
    view[:3, 3] = (to_world @ view)[:3, 3]
    return Scene(
        camera=Perspective(to_world=view, fov=50.0, near=1e-9),
        shapes=[dataclasses.replace(s, to_world=to_world @ s.to_world) for s in shapes],
        integrator=Path(max_depth=4),
        film=Film(width=16, height=16, mode=mode),
    )


FAR_AWAY = tf.translate([1e4, -1e4, 1e4])
PLACES = {  # 1e4 m away float32 has steps of 1 mm: there the scene is 400 m wide
    "small": tf.scale(1e-3),
    "large": tf.scale(1e3),
    "far_away": FAR_AWAY @ tf.scale(100.0),
}


QUICK = (("wide8", "rgb"),)


def gpu_form() -> dev.Device:
    """The device of all tests, which says that it is a GPU."""
    on = dev.choose()
    info = dataclasses.replace(on.info, kind="gpu", compute_units=2)
    return dev.Device(on.context, on.queue, info)


# Quick where programs are the same in other tests; every layout is slow in both modes.
@pytest.mark.parametrize(
    ("layout", "mode"),
    [
        pytest.param(layout, mode, marks=() if (layout, mode) in QUICK else pytest.mark.slow)
        for layout in ("wide8", "brute", "compact", "binary", "gpu")
        for mode in ("rgb", "spectral")
    ],
)
def test_the_same_picture_everywhere(layout: str, mode: str) -> None:
    """Means over blocks of a still life, as large as it is and where it is, and elsewhere."""
    form: dict[str, Any] = {"layout": layout}
    if layout == "gpu":
        form = {"device": gpu_form(), "slots": 1 << 12}
    shapes = still_life()
    here = blocks(exposures(placed(shapes, np.eye(4), mode), 8, 32, **form))
    for name, to_world in PLACES.items():
        there = blocks(exposures(placed(shapes, to_world, mode), 8, 32, 101, **form))
        assert_agree(there, here, name, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "integrator", [Vcm(light_paths=4), Path(light_paths=4)], ids=["vcm", "path"]
)
def test_the_same_caustics_everywhere(integrator: Integrator) -> None:
    """A ball of glass and a mirror in the still life; photons are as far apart as the scene is."""
    glass = Sphere(center=(0.2, 0.0, 0.7), radius=0.35, material=Dielectric(int_ior=1.5))
    upright = tf.translate([-0.9, 0.9, 0.6]) @ tf.rotate([1, -1, 0], 90) @ tf.scale(0.6)
    mirror = Rectangle(to_world=upright, material=TwoSided(front=Conductor()))
    shapes = [*still_life()[:1], glass, mirror, *still_life()[-2:]]
    scenes = {
        name: dataclasses.replace(placed(shapes, to_world, "rgb"), integrator=integrator)
        for name, to_world in {"here": np.eye(4), **PLACES}.items()
    }
    here = blocks(exposures(scenes.pop("here"), 12, 64))
    for name, scene in scenes.items():
        assert_agree(blocks(exposures(scene, 12, 64, 101)), here, name, 2e-3)


@pytest.mark.parametrize("layout", ["brute", "wide8"])
def test_a_closed_box_is_black_inside(layout: str) -> None:
    """A bright sky outside of a white box, as it stands and turned: no path finds a way out."""
    white = Diffuse(reflectance=0.9)
    turned = tf.rotate([1, 2, 3], 40)
    for to_world in (np.eye(4), turned, *PLACES.values()):
        box = Cube(to_world=to_world, material=TwoSided(front=white))
        scene = placed([], to_world, "rgb")
        view = tf.look_at([0.1, 0.2, 0.3], [1, 1, 1], UP)
        view[:3, 3] = (to_world @ view)[:3, 3]
        scene = dataclasses.replace(
            scene,
            shapes=[box],
            camera=Perspective(to_world=view, fov=90.0, near=1e-9),
            lights=[Constant(radiance=(1e6, 1e6, 1e6))],
            integrator=Path(max_depth=20, rr_depth=20),
        )
        assert clpt.render(scene, 64, layout=layout).max() == 0.0, to_world


LAMPS = {  # what emits in a hall of every light, each by the factor on its emission
    "sphere": lambda v: Sphere(center=(-1.5, 0, 1.5), radius=0.2, emission=grey(4 * v)),
    "disk": lambda v: Disk(to_world=over(0.5, 1.0, 2.0, 0.3), emission=grey(2 * v)),
    "rectangle": lambda v: Rectangle(to_world=over(-0.5, 1.0, 2.5, 0.3), emission=grey(v)),
    "cylinder": lambda v: Cylinder(p0=(0, 0, 2), p1=(0.5, 0, 2), radius=0.1, emission=grey(v)),
    "mesh": lambda v: Mesh(
        vertices=np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2.5]], np.float32),
        faces=np.array([[0, 2, 1]], np.uint32),
        emission=grey(v),
    ),
    "point": lambda v: Point(position=(1.0, 1.0, 2.0), intensity=v),
    "spot": lambda v: Spot(to_world=over(-1.0, 1.0, 2.0), intensity=v, cutoff=50.0),
    "projector": lambda v: Projector(to_world=over(0.0, -1.0, 2.0), irradiance=v),
    "goniometric": lambda v: Goniometric(to_world=over(-1.0, -1.0, 2.0), intensity=v),
    "directional": lambda v: Directional(direction=(0.0, 0.3, -1.0), irradiance=0.2 * v),
    "constant": lambda v: Constant(radiance=0.1 * v),
    "envmap": lambda v: Envmap(image=IMAGE * np.float32(v)),
    "sky": lambda v: Sky(sky_scale=v, sun_scale=v),
}
IMAGE = np.random.default_rng(5).uniform(0.0, 0.2, (4, 8, 3)).astype(np.float32)
DIM_AND_BRIGHT = (-60, -41, -17, 11, 25, 40)  # exponents of 2


def grey(radiance: float) -> Area:
    return Area(radiance=(radiance,) * 3)


def over(x: float, y: float, z: float, size: float = 1.0) -> np.ndarray:
    """What looks down from a point."""
    return tf.translate([x, y, z]) @ DOWN @ tf.scale(size)


def lit_hall(
    size: float, lamps: dict[str, Any], factor: float, at: float = 0.0, **changes: Any
) -> Scene:
    """A floor, and a ball of glass, under lamps; a lamp at a point is size^2 as strong.

    at: where the middle is along x [m].
    """
    to_world = tf.translate([at, 0.0, 0.0]) @ tf.scale(size)
    scene = placed(
        [
            Rectangle(to_world=tf.scale(2.0), material=Diffuse(reflectance=0.7)),
            Sphere(center=(0.4, 0.2, 0.4), radius=0.4, material=Dielectric(int_ior=1.5)),
        ],
        to_world,
        "rgb",
    )
    shapes, lights = list(scene.shapes), []
    for make in lamps.values():
        lamp = make(factor)
        if isinstance(lamp, Shape):
            own = to_world @ lamp.to_world
            shapes.append(dataclasses.replace(lamp, to_world=own, material=BLACK))
        elif hasattr(lamp, "position"):
            position = tuple(tf.transform_points(to_world, lamp.position))
            lights.append(dataclasses.replace(make(factor * size**2), position=position))
        elif lamp.reach == "placed":
            own = lamp.to_world.copy()
            own[:3, 3] = tf.transform_points(to_world, own[:3, 3])
            lights.append(dataclasses.replace(make(factor * size**2), to_world=own))
        else:
            lights.append(lamp)
    camera = dataclasses.replace(scene.camera, near=1e-4 * size, far=1e3 * size)
    return dataclasses.replace(scene, camera=camera, shapes=shapes, lights=lights, **changes)


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, marks=pytest.mark.slow),
        pytest.param({"integrator": Path(max_depth=4, light_paths=1)}, marks=pytest.mark.slow),
        pytest.param({"integrator": Vcm(max_depth=4)}, marks=pytest.mark.slow),
        pytest.param({"film": Film(width=16, height=16)}, marks=pytest.mark.slow),
        pytest.param({"film": Film(width=16, height=16, bands=4)}, marks=pytest.mark.slow),
    ],
    ids=["path", "light_paths", "vcm", "spectral", "bands"],
)
def test_light_of_any_strength(changes: dict[str, Any]) -> None:
    """All emission times a power of two gives the picture times it, from 1e-18 to 1e12.

    A film in units of 2^-48 W m^-2 sr^-1 nm^-1 would be black in the dim half, and full in the
    bright one. Every kind of light is there.
    """
    ordinary = clpt.render(lit_hall(1.0, LAMPS, 1.0, **changes), 4)
    assert ordinary.max() > 0.0
    for exponent in DIM_AND_BRIGHT:
        found = clpt.render(lit_hall(1.0, LAMPS, 2.0**exponent, **changes), 4)
        error = np.abs(found / 2.0**exponent - ordinary).max() / ordinary.max()
        assert error < 1e-5, (exponent, error)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAMPS)
def test_light_of_one_kind_of_any_strength(name: str) -> None:
    ordinary = clpt.render(lit_hall(1.0, {name: LAMPS[name]}, 1.0), 4)
    assert ordinary.max() > 0.0
    for exponent in DIM_AND_BRIGHT:
        found = clpt.render(lit_hall(1.0, {name: LAMPS[name]}, 2.0**exponent), 4)
        error = np.abs(found / 2.0**exponent - ordinary).max() / ordinary.max()
        assert error < 1e-5, (exponent, error)


@pytest.mark.parametrize(
    "integrator",
    [
        Path(max_depth=4),
        Path(max_depth=4, light_paths=1),
        pytest.param(Vcm(max_depth=4, light_paths=1), marks=pytest.mark.slow),
    ],
    ids=["path", "light_paths", "vcm"],
)
def test_light_in_a_scene_of_any_size(integrator: Integrator) -> None:
    """The same samples in scenes from a micrometre to a hundred million kilometres.

    Squares of areas leave float32 from sides of 4e9 m on, and MIS ratios of light paths grow with
    the square of the size. Sizes are powers of two, so that samples go the same ways.
    """
    ordinary = blocks(clpt.render(lit_hall(1.0, LAMPS, 1.0, integrator=integrator), 16))
    for exponent in (-20, -13, 13, 24, 27, 33, 36):
        scene = lit_hall(2.0**exponent, LAMPS, 1.0, integrator=integrator)
        found = blocks(clpt.render(scene, 16))
        np.testing.assert_allclose(found, ordinary, rtol=1e-3, err_msg=f"2^{exponent}")


def test_a_lamp_far_from_the_origin_lights_glass() -> None:
    """What a lamp sends along a direction does not depend on where it is: 2e7 m away a float32
    has steps of 2 m, and a metre beside the lamp was no other place."""
    lamps = {**LAMPS, "point": lambda v: Point(position=(1.0, 1.0, 2.0), intensity=40.0 * v)}
    traced = Path(max_depth=4, light_paths=1)
    here, there = (
        clpt.render(lit_hall(2e4, lamps, 1.0, at, integrator=traced), 256).mean()
        for at in (0.0, 2e7)
    )
    assert there == pytest.approx(here, rel=0.01)
