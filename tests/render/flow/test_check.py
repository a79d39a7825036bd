"""What a combination cannot do is refused by `check`, which names both parts; nothing later."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.images.spectral_exr import SpectralImage
from clpt.render.edit.plans import prepare_patch
from clpt.render.flow.check import check
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Lens, Perspective, ThinLens
from clpt.scene.integrators import Mitchell, ParticleTracer
from clpt.scene.lights import Area, CubeMap, Directional, Envmap, Point, Projector, Spot
from clpt.scene.media import Homogeneous
from clpt.scene.motion import Deformation
from clpt.scene.shapes import Cube, Cylinder, Disk, Group, Instance, Mesh, Rectangle, Sphere
from clpt.scene.shapes import Spheres as Many
from clpt.scene.textures import Bitmap, Checkers, MeshAttribute, Mix, Product
from clpt.spectra import Constant as ConstantSpectrum
from clpt.spectra import Tabulated
from tests.together.strategies import scene_of

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
MESH: dict[str, Any] = {"vertices": CORNERS, "faces": np.array([[0, 1, 2]], np.uint32)}
UP = np.tile(np.float32([0.0, 0.0, 1.0]), (3, 1))
MOVES = Deformation((0.0, 1.0), np.array([CORNERS, CORNERS + 1.0]))
LONG = tf.scale([1.0, 2.0, 1.0])
SHEAR = np.array([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
BANDS = np.array([450.0, 600.0])
PIXELS = np.full((2, 2, 2), 0.5, np.float32)
MATT, SHINES = (SpectralImage(PIXELS, BANDS, emissive=light) for light in (False, True))
COLOURS = np.full((2, 2, 3), 0.5, np.float32)
PROJECTION = np.eye(4) + np.outer([0, 0, 0, 1], [0, 1, 0, 0])
MAP = m.NormalMap(map=Bitmap(image=COLOURS, raw=True))
BUMP = m.BumpMap(height=Bitmap(image=COLOURS))
FOG = Homogeneous(sigma_s=1.0)
ZERO = Tabulated((400.0, 500.0, 600.0), (1.5, 0.0, 1.5))
BALLS = Many(centers=CORNERS, radii=0.1)


def layered(*profiles: Any, **metal: Any) -> m.Material:
    return m.RoughConductor(layers=tuple(m.Layer(profile=one) for one in profiles), **metal)


COATED = layered(1.0)


def ball(material: m.Material) -> dict[str, Any]:
    return {"shapes": [Sphere(material=material)]}


def traced(**given: Any) -> dict[str, Any]:
    return {"integrator": ParticleTracer(), **given}


def grey() -> Bitmap:
    return Bitmap(image=COLOURS)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "a finer mesh with attributes": (
        {"shapes": [Mesh(**MESH, subdivision=1, attributes={"vertex_color": CORNERS})]},
        "mesh: a mesh that is subdivided has no attributes",
    ),
    "displacement without uvs": (
        {"shapes": [Mesh(**MESH, displacement=grey())]}, "displacement needs uvs",
    ),
    "displacement by light": (
        {"shapes": [Mesh(**MESH, uvs=CORNERS[:, :2], displacement=Bitmap(image=SHINES))]},
        "mesh.displacement",
    ),
    "displacement of what deforms": (
        {"shapes": [Mesh(**MESH, uvs=CORNERS[:, :2], displacement=grey(), deformation=MOVES)]},
        "mesh.deformation: a mesh with displacement cannot deform",
    ),
    "normals of what deforms": (
        {"shapes": [Mesh(**MESH, normals=UP, deformation=MOVES)]}, "needs normals at each time",
    ),
    "a sphere that is stretched": ({"shapes": [Sphere(to_world=LONG)]}, "it is no sphere"),
    "spheres that an instance stretches": (
        {"shapes": [Instance(group=Group((BALLS,)), to_world=LONG)]}, "it is no spheres",
    ),
    "a cylinder without length": ({"shapes": [Cylinder(p0=(0, 0, 1), p1=(0, 0, 1))]}, "coincide"),
    "attributes of a material": (
        ball(m.Diffuse(reflectance=MeshAttribute(name="face_a"))),
        "sphere: its material asks for the attribute 'face_a'; it has none",
    ),
    "attributes of a light": (
        {"shapes": [Sphere(emission=Area(radiance=MeshAttribute(name="face_a")))]},
        "sphere: its emission asks for the attribute 'face_a'",
    ),
    "a second set of uvs": (
        ball(m.Diffuse(reflectance=Bitmap(image=COLOURS, mapping="uv1"))), "'vertex_u1'",
    ),
    "glass beside two-sided": (
        ball(m.Blend(first=m.TwoSided(), second=m.Dielectric())), "dielectric .*two_sided",
    ),
    "two maps of a kind": (
        ball(m.NormalMap(map=MAP.map, material=MAP)), "sphere: a normal_map inside of a normal_map",
    ),
    "maps inside and around": (
        ball(m.NormalMap(map=MAP.map, material=m.TwoSided(front=BUMP))),
        "normal_map and bump_map.*two_sided",
    ),
    "a textured metal in RGB": (
        ball(layered(1.0, eta=grey())), "sphere: rough_conductor.eta .*layers in RGB mode",
    ),
    "two thicknesses in RGB": (ball(layered(grey(), grey())), "rough_conductor in RGB mode"),
    "reflectances that shine": (
        {"shapes": [Sphere(emission=Area(radiance=Bitmap(image=MATT)))]}, "light .* is needed",
    ),
    "light that reflects": (
        ball(m.Diffuse(reflectance=Bitmap(image=SHINES))), "reflectances .* is needed",
    ),
    "a light as a share": (
        {"shapes": [Sphere(emission=Area(radiance=Mix(amount=Bitmap(image=SHINES))))]},
        "reflectances .* is needed",
    ),
    "an envmap that reflects": ({"lights": [Envmap(image=MATT)]}, "envmap.image: .*reflectances"),
    "no image": ({"lights": [Envmap()]}, "envmap.image: an image is needed"),
    "no faces": ({"lights": [CubeMap()]}, "cube_map.image: an image is needed"),
    "a projector that shears": ({"lights": [Projector(to_world=SHEAR)]}, "must not shear"),
    "an area light as a lamp": ({"lights": [Area()]}, "is a shape's `emission`"),
    "planes of a camera": (
        {"camera": Perspective(near=2.0, far=1.0)}, "perspective: near must be below far",
    ),
    "a lens that is too near": (
        {"camera": Lens(focus_distance=1e-3)}, "lens.focus_distance: .*nearer",
    ),
    "an index of 0 somewhere": (
        ball(m.Dielectric(int_ior=ZERO)), "sphere: dielectric.int_ior: an index of 0 at 500 nm",
    ),
    "an index of a lens": (
        {"camera": ThinLens(glass=ZERO)},
        "thin_lens.glass: ",
    ),
    "a filter of nothing": (
        {"film": Film(width=4, height=4, filter=Mitchell(b=1e38))},
        "film.filter mitchell: .*integral",
    ),
    "a texture that is projected": (
        ball(m.Diffuse(reflectance=Bitmap(image=COLOURS, to_uv=PROJECTION[1:, 1:]))),
        "sphere: bitmap.to_uv: its last row",
    ),
    "a texture whose places are at infinity": (
        ball(m.Diffuse(reflectance=Bitmap(image=COLOURS, to_uv=np.diag([1.0, 1.0, 0.0])))),
        "sphere: bitmap.to_uv: its last row",
    ),
    "a solid texture that is projected": (
        ball(m.Diffuse(reflectance=Mix(amount=Checkers(to_texture=PROJECTION)))),
        "sphere: checkers.to_texture: its last row",
    ),
    "a white that is none": (
        {"film": Film(width=4, height=4, white_balance=(0.75, 0.25))}, "white_balance: .* white",
    ),
    "paths from lights in an open medium": (
        traced(shapes=[Disk(interior=FOG)], lights=[Point()]), "particle_tracer .*not closed",
    ),
    "paths from the sun in fog": (
        traced(camera=Perspective(medium=FOG), lights=[Directional()]),
        r"lights\[0\]: particle_tracer .* from infinity",
    ),
    "paths from lights where media shine": (
        traced(shapes=[Cube(material=m.Null(), interior=Homogeneous(sigma_a=1.0, emission=1.0))]),
        "particle_tracer .*gives out light",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused(name: str) -> None:
    """By `check` with one line, and so by a renderer."""
    given, message = REFUSED[name]
    scene = Scene(**{"camera": Perspective(), "film": Film(width=4, height=4, mode="rgb"), **given})
    with pytest.raises(SceneError, match=message) as refused:
        check(scene)
    assert refused.value.where and "\n" not in str(refused.value)
    with pytest.raises(SceneError, match=message):
        lower(scene)


def test_what_passes() -> None:
    """What is next to what is refused."""
    light = Product(first=0.5, second=Bitmap(image=SHINES))
    things = [
        Rectangle(material=layered(grey(), 1.0)),
        Sphere(emission=Area(radiance=light)),
        Sphere(emission=Area(radiance=Product(first=Bitmap(image=SHINES), second=grey()))),
        Instance(group=Group((Sphere(),)), to_world=LONG),
        Cube(material=m.NormalMap(map=MAP.map, material=BUMP)),
        Mesh(**MESH, normals="smooth", deformation=MOVES),
    ]
    given = {"lights": [Envmap(image=SHINES)], "camera": Perspective()}
    for mode in ("rgb", "spectral"):
        scene = Scene(shapes=things, film=Film(width=4, height=4, mode=mode), **given)
        check(scene)
        lower(scene)


def test_a_quick_update_keeps_the_rules() -> None:
    """Words alone would change: a texture below layers is refused as it is in a new scene."""
    former = Scene(camera=Perspective(), film=Film(width=4, height=4, mode="rgb"), **ball(COATED))
    metal = layered(1.0, eta=grey())
    edited = dataclasses.replace(former, shapes=[Sphere(material=metal)])
    with pytest.raises(SceneError, match="layers in RGB mode"):
        prepare_patch(cast(Any, SimpleNamespace(lowered=lower(former))), former, edited)


def test_a_quick_update_tells_gloss() -> None:
    """The tree over lights chooses by it, as in a new scene: a word before the material."""
    lamps = [Point(position=(i, 9.0, 0.0), intensity=1.0) for i in range(16)]
    given = {"camera": Perspective(), "lights": lamps}
    balls = (Sphere(material=m.RoughConductor(alpha=alpha)) for alpha in (0.1, 0.2))
    former, edited = (Scene(shapes=[ball], **given) for ball in balls)
    device = SimpleNamespace(lowered=lower(former), tables={"materials": None})
    device.stream = SimpleNamespace(write=lambda *_: None)
    plan = prepare_patch(cast(Any, device), former, edited)
    assert not isinstance(plan, str)
    plan.write()
    expected = lower(edited).tables["materials"]
    np.testing.assert_array_equal(device.lowered.tables["materials"], expected)


def test_few_drawn_scenes_are_refused() -> None:
    """As they are drawn by the same rules; that the others are lowered is shown by test_builds."""
    count = 60
    assert sum(is_refused(scene_of(by_chance(seed))) for seed in range(count)) < count // 10


def by_chance(seed: int) -> Callable[[int], int]:
    numbers = random.Random(seed)
    return lambda most: numbers.randint(0, most)


def is_refused(scene: Scene) -> bool:
    try:
        check(scene)
    except SceneError:
        return True
    return False


@pytest.mark.parametrize(
    "parts",
    [
        {"lights": [Spot(power=3000.0, cutoff=0.0)]},
        {"lights": [Point(lumens=5.0, intensity=ConstantSpectrum(0.0))]},
        {"shapes": [Sphere(emission=Area(power=5.0, radiance=ConstantSpectrum(0.0)))]},
    ],
)
def test_a_light_that_no_power_makes_bright_is_refused(parts: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match="its light is 0 whatever its strength"):
        check(Scene(camera=Perspective(), **parts))
