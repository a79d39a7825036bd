"""Bodies that overlap, of different priorities: the pictures are those of boundaries made by hand.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.materials import Dielectric, Diffuse, Layer, Null, RoughDielectric
from clpt.scene.shapes import Disk, Group, Instance, Rectangle, Shape, Sphere
from tests.pictures.support import (
    SIGNIFICANCE,
    agreement,
    assert_agree,
    assert_mean,
    blocks,
    exposures,
    mitsubas,
)

MILK = media.Homogeneous(sigma_s=3.0, sigma_a=(0.1, 0.3, 1.0), name="milk")
CLEAR = media.Homogeneous(sigma_s=2.0)
GLASS, WATER = Dielectric(int_ior=1.5, ext_ior=1.0), Dielectric(int_ior=1.33, ext_ior=1.0)
WET = Dielectric(int_ior=1.33, ext_ior=1.5)  # water, seen from glass
LAMP = Rectangle(
    to_world=tf.translate([0, 0, -4]) @ tf.scale(3.0),
    material=Diffuse(reflectance=0.0),
    emission=Area(radiance=1.0),
)


def scene(*shapes: Shape, mode: str = "rgb", at: float = 5.0, lamp: bool = True) -> Scene:
    return Scene(
        camera=Perspective(fov=26.0, to_world=tf.look_at([0, 0, at], [0, 0, at - 5], [0, 1, 0])),
        shapes=[*shapes, LAMP] if lamp else [*shapes],
        lights=[Constant(radiance=0.3 if lamp else 1.0)],
        film=Film(width=8, height=8, filter=Box(), mode=mode),
        integrator=PathIntegrator(max_depth=-1, rr_depth=1000, light_paths=0),
    )


HAND = (Sphere(material=GLASS), Sphere(radius=0.8, material=WET, interior=MILK))
SAME = {
    "milk displaces glass": (
        Sphere(material=GLASS, priority=1),
        Sphere(radius=0.8, material=WATER, interior=MILK, priority=2),
    ),
    "glass displaces milk": (
        Sphere(material=GLASS, priority=2),
        Sphere(radius=0.8, material=GLASS, flip_normals=True, priority=2),
        Sphere(radius=0.93, material=WATER, interior=MILK, priority=1),
    ),
    "one matter joins": (
        Sphere(material=GLASS, priority=1),
        Sphere(radius=0.7, to_world=tf.translate([0.2, 0, 0]), material=GLASS, priority=1),
        Sphere(radius=0.8, material=WATER, interior=MILK, priority=2),
    ),
}


@pytest.mark.slow
def test_as_three_boundaries_by_hand() -> None:
    """A glass of milk, of which each may displace the other; two glasses are one."""
    reference = exposures(scene(*HAND), 8, 128)
    for name, shapes in SAME.items():
        found = exposures(scene(*shapes), 8, 128, first_seed=100)
        means = (blocks(one).mean(axis=(1, 2)) for one in (found, reference))
        assert agreement(*means) > SIGNIFICANCE, name


MITSUBA = """<scene version="3.0.0">
<integrator type="volpath"><integer name="rr_depth" value="1000000"/></integrator>
<sensor type="perspective"><float name="fov" value="26"/><transform name="to_world">
<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform><film type="hdrfilm">
<integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/>
<string name="pixel_format" value="rgb"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="0.3"/></emitter>
<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-4"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
<emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>
<shape type="sphere"><bsdf type="dielectric">
<float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.8"/><bsdf type="dielectric">
<float name="int_ior" value="1.33"/><float name="ext_ior" value="1.5"/></bsdf>
<medium name="interior" type="homogeneous"><float name="scale" value="10"/>
<rgb name="sigma_t" value="0.31"/>
<rgb name="albedo" value="0.96774194"/></medium></shape></scene>"""


@pytest.mark.slow
@pytest.mark.peers
def test_as_mitsuba_has_it_by_hand(tmp_path: Path) -> None:
    """Grey milk that its glass displaces, beside Mitsuba's boundary between the two."""
    file = tmp_path / "milk.xml"
    file.write_text(MITSUBA)
    theirs = mitsubas(file, 12, 48)
    milk = media.Homogeneous(sigma_s=3.0, sigma_a=0.1)
    glass, shell, liquid = SAME["glass displaces milk"]
    ours = exposures(scene(glass, shell, dataclasses.replace(liquid, interior=milk)), 12, 128)
    assert_agree(blocks(ours), blocks(theirs), "milk in a glass")


@pytest.mark.parametrize(
    "material",
    [
        pytest.param(Null(), marks=pytest.mark.slow),
        GLASS,
        pytest.param(
            RoughDielectric(int_ior=1.5, ext_ior=1.0, alpha_u=0.02, alpha_v=0.02),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Dielectric(int_ior=1.5, ext_ior=1.0, layers=(Layer(eta=1.38, thickness=100.0),)),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["null", "dielectric", "rough", "filmed"],
)
def test_furnace(material) -> None:
    """Under even light nothing can be seen of what takes none, however it overlaps."""
    shapes = (
        Sphere(material=material, interior=CLEAR, priority=1),
        Sphere(
            to_world=tf.translate([0.6, 0, 0]) @ tf.scale(0.8),
            material=WATER,
            interior=CLEAR,
            priority=2,
        ),
    )
    one = scene(*shapes, mode="spectral" if material is GLASS else "rgb", lamp=False)
    rough = material.kind == "rough_dielectric"  # loses what meets a second facet
    assert_mean(exposures(one, 4, 64), 1.0, 0.03 if rough else 0.01)


def test_light_through_what_is_hidden() -> None:
    """A lamp shines through null bodies in each other: each place has one medium, none of two."""
    inner, outer = media.Homogeneous(sigma_a=1.1), media.Homogeneous(sigma_a=0.3)
    place = tf.translate([0, 0, -4]) @ tf.scale(9.0)
    wall = Rectangle(to_world=place, material=Diffuse(reflectance=1.0))
    for first, second, lost in ((1, 2, 0.3 * 2.0 + 1.1 * 2.0), (2, 1, 0.3 * 4.0)):
        one = scene(
            Sphere(material=Null(), interior=outer, to_world=tf.scale(2.0), priority=first),
            Sphere(material=Null(), interior=inner, priority=second),
            wall,
            lamp=False,
        )
        one.lights = [Point(position=(0.0, 0.0, 3.0), intensity=1.0)]
        one.camera = Perspective(fov=0.1, to_world=tf.look_at([5, 0, -2], [0, 0, -4], [0, 1, 0]))
        one.integrator = dataclasses.replace(one.integrator, max_depth=2)
        with clpt.Renderer(one) as renderer:
            renderer.run(4)
            got = renderer.image().mean()
            assert got == pytest.approx(np.exp(-lost) / (np.pi * 49.0), rel=1e-3)
            inside = tf.look_at([0, 0, 1.5], [0, 0, 9], [0, 1, 0])
            renderer.update(camera=dataclasses.replace(one.camera, to_world=inside, near=0.0))
            assert renderer._wavefront.scene.lowered.settings["camera_bodies"] == first


@pytest.mark.parametrize(
    "shapes, message",
    [
        ([Sphere(priority=-1)], "from 0"),
        ([Sphere(priority=1)], "not of diffuse"),
        ([Disk(material=GLASS), Sphere(material=WATER, priority=1)], "not closed"),
        ([Sphere(material=GLASS, exterior=MILK), Sphere(material=WATER, priority=1)], "exterior"),
        ([Instance(group=Group(shapes=(Sphere(),)), priority=1)], "of its group"),
    ],
)
def test_what_priorities_may_be(shapes, message) -> None:
    with pytest.raises(SceneError, match=message):
        clpt.render(scene(*shapes), spp=1)


def test_one_priority_twice_is_told() -> None:
    one, far = Sphere(material=GLASS, priority=1, name="a"), tf.translate([3, 0, 0])
    other = Sphere(material=WATER, priority=1, name="b")
    told = lower(scene(one, other)).warnings
    assert any("'a' and sphere 'b'" in line and "the latter" in line for line in told)
    for apart in (dataclasses.replace(other, to_world=far), dataclasses.replace(other, priority=2)):
        assert not any("overlap" in line for line in lower(scene(one, apart)).warnings)
