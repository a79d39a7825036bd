"""Light paths that are aimed at glass: where they go, what they carry, and how densely.

Weighed by what aiming makes them denser, they go wherever they went before, and carry the same
light there. Counts in bins, in independent batches, are compared at the significance of
tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from clpt import transforms as tf
from clpt.render.flow import flags, stages
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.geometry import cases as shapes
from clpt.render.lights import cases as lights
from clpt.render.textures import cases as textures
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import (
    Area,
    Constant,
    CubeMap,
    Directional,
    Envmap,
    Goniometric,
    Light,
    Point,
    Projector,
    Spot,
)
from clpt.scene.shapes import Curves, Disk, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap
from tests.kernels.scene_harness import SceneProbe
from tests.pictures.support import assert_agree, quick

UP = [0.0, 1.0, 0.0]
GLASS = ((0.0, 0.5, 0.0, 0.3), (2.5, 0.5, 1.0, 0.45), (-1.0, 2.0, 0.0, 0.2))  # centres and radii
BATCHES, PATHS = 24, 1 << 15
DOWN = tf.rotate([1, 0, 0], 90)
SPOT = tf.look_at([1.0, 3.0, 0.5], [0.2, 0.5, 0.0], UP)
IMAGE = np.random.default_rng(3).random((6, 8, 3)).astype(np.float32) ** 2
STRANDS = np.array(  # two, 3 cm thick and thinner: x y z and the radius
    [
        [(x, 1.0 + 0.3 * i, 0.8 + 0.1 * i * x, 0.03 - 0.005 * i) for i in range(4)]
        for x in (-0.5, 1.0)
    ],
    np.float32,
).reshape(-1, 4)

LIGHTS: dict[str, Light | Shape] = {
    "point": Point(position=(0.5, 2.5, 1.0)),
    "point in a bulb": Point(position=(-1.0, 2.1, 0.0)),
    "spot": Spot(to_world=SPOT, cutoff=25.0, beam_width=10.0),
    "projector": Projector(to_world=SPOT, fov=40.0, image=0.5),
    "directional": Directional(direction=(0.3, -1.0, 0.1)),
    "constant": Constant(),
    "disk": Disk(
        to_world=tf.translate([0.2, 3.0, 0.0]) @ DOWN @ tf.scale(0.3), emission=Area(radiance=2.0)
    ),
    "disk beside glass": Disk(
        to_world=tf.translate([-0.4, 2.05, 0.0]) @ DOWN @ tf.scale(0.3), emission=Area(radiance=2.0)
    ),
    "two sides": Rectangle(
        to_world=tf.translate([1.0, 1.0, 1.0]) @ tf.rotate([0, 1, 0], 50) @ tf.scale(0.2),
        emission=Area(radiance=2.0, two_sided=True),
    ),
    "sphere": Sphere(center=(-0.5, 0.8, 1.0), radius=0.1, emission=Area(radiance=2.0)),
    "hair": Curves(points=STRANDS, lengths=(4, 4), emission=Area(radiance=2.0)),
    "envmap": Envmap(image=IMAGE, to_world=tf.rotate([0, 1, 0], 130)),
    "cube_map": CubeMap(image=[np.full((2, 2, 3), 0.1 + 0.2 * i, np.float32) for i in range(6)]),
    "thrown image": Projector(to_world=SPOT, fov=40.0, image=Bitmap(image=IMAGE)),
    "image spot": Spot(to_world=SPOT, cutoff=25.0, image=Bitmap(image=IMAGE)),
    "goniometric": Goniometric(to_world=SPOT, image=Bitmap(image=IMAGE)),
}
QUICK = ("spot", "directional", "two sides", "envmap")

BODY = """
    vec2 u = {x[0], x[1]}, v = {x[2], x[3]};
    Wavelengths lambdas = {0.0f, 0.0f, 0.0f};
    LightRay l = light_emit(scene, x[4], u, v, lambdas);
    r[0] = l.o.x; r[1] = l.o.y; r[2] = l.o.z; r[3] = l.d.x; r[4] = l.d.y; r[5] = l.d.z;
    r[6] = l.power.x; r[7] = 1.0f; r[8] = 1.0f;
"""
GAIN = """
    real t = sel(l.away, (real)(FAR), (real)(1.5f));
    vec3 p = madd3(l.d, sel(l.away, (real)(1.5f), t), l.o), wi = neg3(l.d);
    real seen = light_path_pdf(scene, l.row, p, wi, t, l.n);
    r[7] = l.gain; r[8] = seen / light_emit_pdf(scene, l.row, wi, t);
"""


def scene_of(light: Light | Shape) -> Scene:
    """Balls of glass on a floor, and a light."""
    floor = Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(4.0), material=m.Diffuse())
    balls = [Sphere(center=(x, y, z), radius=r, material=m.Dielectric()) for x, y, z, r in GLASS]
    lamps = [light] if isinstance(light, Light) else []
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 2, 8], [0, 0, 0], UP)),
        shapes=[floor, *balls, *([light] if isinstance(light, Shape) else [])],
        lights=lamps,
        film=Film(width=8, height=8, mode="rgb"),
        integrator=Path(light_paths=1),
    )


def probe(lowered: Lowered, aimed: bool) -> SceneProbe:
    """Rays from the lights: five random numbers to o, d, power, gain from either end."""
    features = lowered.features
    transport = dataclasses.replace(features.transport, aimed=aimed)
    sent = dataclasses.replace(features, transport=transport)
    virtual = {
        **shapes.virtual_files(features),
        **lights.virtual_files(),
        "generated/lights.cl": stages.lights_text(sent),
        "generated/emission.cl": lights.emission_text(sent),
        "generated/textures.cl": textures.dispatch_text(features.textures),
    }
    return SceneProbe(
        BODY + GAIN * aimed,
        5,
        9,
        files=("generated/lights.cl", "generated/emission.cl"),
        virtual=virtual,
        defines=flags.of_scene(features),
        tables={name: lowered.table(name) for name in lowered.tables},
        settings={name: lowered.settings[name] for name in lowered.settings.dtype.names or ()},
    )


def meets(o: NDArray[np.floating], d: NDArray[np.floating]) -> NDArray[np.intp]:
    """A bit for each ball that a ray (3, n) meets."""
    bits = np.zeros(o.shape[1], np.intp)
    for k, (*center, radius) in enumerate(GLASS):
        to = np.array(center)[:, None] - o
        along = (to * d).sum(axis=0)
        square = (to * to).sum(axis=0)
        ahead = (along > 0) | (square < radius**2)
        bits |= (((square - along**2) < radius**2) & ahead).astype(np.intp) << k
    return bits


def binned(made: NDArray[np.floating], weights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Sums of weights by what a ray meets, and by the octant and slope of its direction."""
    o, d = made[0:3].astype(np.float64), made[3:6].astype(np.float64)
    octant = (d > 0).T @ np.array([1, 2, 4])
    steep = np.minimum((np.abs(d[1]) * 4).astype(np.intp), 3)
    each = (meets(o, d), 8 + octant * 4 + steep)
    return sum(np.bincount(bins, weights, minlength=40) for bins in each) / len(weights)


def batches(lowered: Lowered, aimed: bool) -> Iterator[NDArray[np.float64]]:
    """Rays (9, PATHS) as `probe` makes them, of which both ends know the same density."""
    kernel, rng = probe(lowered, aimed), np.random.default_rng(7 + aimed)
    for _ in range(BATCHES):
        made = kernel(*rng.random((5, PATHS), np.float32)).astype(np.float64)
        off = np.abs(made[8] / made[7] - 1.0)[made[6] > 0] > 2e-3
        assert off.mean() < 2e-3, "but on the edge of a sphere"
        yield made


@pytest.mark.parametrize("name", quick(LIGHTS, *QUICK))
def test_paths_go_and_carry_light_where_they_did(name: str) -> None:
    lowered = lower(scene_of(LIGHTS[name]))
    assert lowered.features.transport.aimed
    sums: dict[bool, list[NDArray[np.float64]]] = {True: [], False: []}
    hits = {}
    for aimed, found in sums.items():
        for made in batches(lowered, aimed):
            flux, count = binned(made, made[6]), binned(made, (made[6] > 0) / made[7])
            found.append(np.concatenate([flux, count]))
            hits[aimed] = (meets(made[0:3], made[3:6]) > 0).mean()
    assert_agree(np.array(sums[True])[:, None, None], np.array(sums[False])[:, None, None], name)
    if name != "point in a bulb":  # which aims at nothing
        assert hits[True] > 0.35 and hits[True] > 1.5 * hits[False]


@pytest.mark.parametrize("name", ["point", "directional"])
def test_the_density_at_glass(name: str) -> None:
    """The share of unaimed paths that meets a ball, of its solid angle or its disk."""
    lowered = lower(scene_of(LIGHTS[name]))
    exact = []
    for *center, radius in GLASS:
        far = np.linalg.norm(np.array(center) - getattr(LIGHTS["point"], "position", 0))
        whole = 1.001 * float(lowered.settings["scene_radius"])  # of light from infinity
        shares = {
            "point": (1 - np.sqrt(1 - (radius / far) ** 2)) / 2,
            "directional": (radius / whole) ** 2,
        }
        exact.append(shares[name])
    found = []
    for made in batches(lowered, True):
        bits = meets(made[0:3], made[3:6])
        found.append([((bits >> k & 1) / made[7]).mean() for k in range(len(GLASS))])
    ours = np.array(found)[:, None, None]
    assert_agree(ours, np.array(exact)[None, None, None], name)
    assert (ours.std(axis=0) / np.sqrt(BATCHES) < 0.006 * np.array(exact)).all(), "what is seen"
