"""Light paths that are "auto": there are some where something sharp meets a small light.

The integrator `auto` adds photons where the camera sees mirrors or clear glass.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.lights.find import environment_of
from clpt.render.transport.hard_light import FEW, MANY, SOME, STREWN
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic, Perspective, ThinLens
from clpt.scene.integrators import Auto, Path, Vcm
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
from clpt.scene.shapes import Cube, Group, Instance, Rectangle, Shape, Sphere, Spheres

ROOM = Cube(flip_normals=True, material=m.Diffuse())  # from -1 to 1
BALL = Sphere(center=(0.3, -0.5, 0.2), radius=0.3, material=m.Dielectric())
LAMP = Point(position=(0.0, 0.8, 0.0))


def looking(x: float, y: float, z: float) -> Perspective:
    """A camera in the corner of the room, toward a point."""
    return Perspective(fov=20.0, to_world=tf.look_at([-0.9, -0.9, 0.9], [x, y, z], [0, 1, 0]))


AT_BALL, AT_WALL = looking(0.3, -0.5, 0.2), looking(-0.9, 1.0, 0.5)


def scene_of(*shapes: Shape, lights: Any = (LAMP,), **given: Any) -> Scene:
    """The shapes under a lamp, by "auto" unless another integrator is given."""
    usual = {"camera": Perspective(), "integrator": Path(light_paths="auto")}
    film = Film(width=8, height=8, mode=given.pop("mode", "rgb"))
    return Scene(shapes=list(shapes), lights=list(lights), film=film, **{**usual, **given})


def chosen(scene: Scene, former: Lowered | None = None) -> tuple[float, str]:
    """How many light paths a sample has, and why."""
    lowered = lower(scene, former=former)
    return float(lowered.settings["light_paths"]), lowered.reason


def sky(share: float, side: int = 64) -> np.ndarray:
    """A sky of 1 with a sun of about 2 degrees, which has a share of all its power."""
    rows, columns = np.indices((side, 2 * side))
    image = np.ones((side, 2 * side, 3), np.float32)
    sun = (abs(rows - side // 4) < 1) & (abs(columns - side) < 1)
    weights = np.sin(np.pi * rows / (side - 1))  # of texels, rows from pole to pole
    image[sun] = share / (1.0 - share) * weights[~sun].sum() / weights[sun].sum()
    return image


@pytest.mark.parametrize(
    "lamp",
    [
        LAMP,
        Spot(),
        Projector(),
        Goniometric(),
        Directional(),
        Envmap(image=sky(0.4)),
    ],
    ids=lambda lamp: lamp.kind,
)
def test_small_lights(lamp: Light) -> None:
    reason = "sphere is specular, and lights[0] is a small light"
    assert chosen(scene_of(ROOM, BALL, lights=[lamp], camera=AT_BALL)) == (SOME, reason)


def test_few_light_paths_where_most_light_is_of_large_lights() -> None:
    """A sky of radiance L sends 4 pi^2 r^2 L into a sphere, a sun pi r^2 times its irradiance."""
    for irradiance, few in ((3.9 * np.pi, True), (4.1 * np.pi, False)):
        lamps = [Constant(radiance=1.0), Directional(irradiance=irradiance)]
        for integrator in (Path(), Auto()):
            found, reason = chosen(scene_of(ROOM, BALL, lights=lamps, integrator=integrator))
            assert found == FEW  # the camera looks elsewhere
            assert ("though most light" in reason) == few


@pytest.mark.parametrize(
    "lamp",
    [
        Constant(),
        Point(falloff=False),
        Envmap(image=np.ones((8, 16, 3))),
        Envmap(image=np.zeros((8, 16, 3))),
        Envmap(image=sky(0.1)),
        CubeMap(image=np.ones((6, 4, 4, 3))),
    ],
    ids=lambda lamp: lamp.kind,
)
def test_large_lights(lamp: Light) -> None:
    assert chosen(scene_of(ROOM, BALL, lights=[lamp])) == (0, "no light is small")


@pytest.mark.parametrize(
    ("height", "distance"), [(0.8, 0.8), (0.0, 3**0.5 / 4)], ids=["above", "in the middle"]
)
def test_a_ball_that_shines_is_small_by_its_distance(height: float, distance: float) -> None:
    """4 pi r^2 is 3 % of 4 pi d^2; d is a fourth of the room's radius or more."""
    limit = 0.03**0.5 * distance
    for radius, number in ((0.99 * limit, FEW), (1.01 * limit, 0)):
        lamp = Sphere(center=(0.0, height, 0.0), radius=radius, emission=Area())
        assert chosen(scene_of(ROOM, BALL, lamp, lights=()))[0] == number
        balls = Spheres(centers=[[0.0, height, 0.0]], radii=radius, emission=Area())
        assert chosen(scene_of(ROOM, BALL, balls, lights=()))[0] == number


def test_triangles_that_shine_are_small_by_their_area() -> None:
    """The area of a square of side 2 s is 4 s^2, of a cube's faces 24 s^2."""
    for shape, faces in ((Rectangle, 1), (Cube, 6)):
        limit = (0.03 * np.pi * 0.8**2 / faces) ** 0.5
        for side, number in ((0.98 * limit, FEW), (1.02 * limit, 0)):
            flat = tf.rotate([1.0, 0.0, 0.0], 90.0)
            to_world = tf.translate([0.0, 0.8, 0.0]) @ flat @ tf.scale(side)
            lamp = shape(to_world=to_world, emission=Area(), name="lamp")
            number_, reason = chosen(scene_of(ROOM, BALL, lamp, lights=()))
            assert number_ == number and ("'lamp' is a small" in reason) == bool(number)


GLASS_LENS = ThinLens(glass="bk7", focal_length=0.05)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (scene_of(ROOM), "nothing is specular"),
        (scene_of(dataclasses.replace(ROOM, material=m.Conductor()), BALL), "nothing dull"),
        (scene_of(BALL, Sphere(material=m.Null())), "nothing dull"),
        (scene_of(BALL, Rectangle(material=m.BumpMap())), "nothing dull"),
        (scene_of(BALL, Sphere(emission=Area())), "nothing dull"),
        (scene_of(ROOM, BALL, camera=Orthographic()), "cannot be joined"),
        (scene_of(ROOM, BALL, camera=GLASS_LENS, mode="spectral"), "cannot be joined"),
        (scene_of(ROOM, BALL, integrator=Path(max_depth=2, light_paths="auto")), "too short"),
    ],
)  # fmt: skip
def test_where_there_are_none(scene: Scene, words: str) -> None:
    number, reason = chosen(scene)
    assert number == 0 and words in reason


def test_one_material_may_be_sharp_and_dull() -> None:
    waxed = m.Blend(first=m.Diffuse(), second=m.Conductor(), weight=0.5)
    assert chosen(scene_of(dataclasses.replace(ROOM, material=waxed)))[0] == SOME


AT_LAMP = tf.translate(LAMP.position) @ tf.scale(0.1)
PANE = tf.translate([0.0, 0.79, 0.0]) @ tf.rotate([1.0, 0.0, 0.0], 90.0)
GLASS_BALL = Sphere(radius=1.0, material=m.Dielectric())


@pytest.mark.parametrize(
    ("bulb", "number"),
    [
        (Sphere(center=LAMP.position, radius=0.1, material=m.Dielectric()), MANY),
        (Sphere(center=LAMP.position, radius=0.1, material=m.Diffuse()), 0),
        (Cube(to_world=AT_LAMP, material=m.Dielectric()), MANY),
        (Instance(group=Group(shapes=[GLASS_BALL]), to_world=AT_LAMP), MANY),
        (Rectangle(to_world=PANE, material=m.Dielectric()), FEW),
        (Sphere(center=(0.0, 0.5, 0.0), radius=0.2, material=m.Dielectric()), FEW),
    ],
    ids=["ball", "dull", "cube", "instance", "pane", "beside"],
)
def test_a_light_in_a_bulb_has_many_light_paths(bulb: Shape, number: float) -> None:
    found, reason = chosen(scene_of(ROOM, bulb))
    assert found == number and ("in a bulb" in reason) == (number == MANY)
    lamp = dataclasses.replace(LAMP, position=(0.0, 0.0, 0.0), intensity=3.0)  # has most power
    assert chosen(scene_of(ROOM, bulb, lights=[LAMP, lamp]))[0] in (0, FEW)
    made = lower(scene_of(ROOM, bulb, camera=looking(*LAMP.position), integrator=Auto()))
    assert made.settings["light_paths"] == {MANY: MANY, FEW: 1, 0: 0}[number]


def test_what_instances_show_counts() -> None:
    group = Group(shapes=[BALL])
    copies = [Instance(group=group, to_world=tf.translate([x, 0.0, 0.0])) for x in (-0.3, 0.3)]
    assert chosen(scene_of(ROOM, *copies))[0] == FEW
    assert chosen(scene_of(*copies))[0] == 0


def flat(to_world: np.ndarray, **given: Any) -> Rectangle:
    """A square that faces down."""
    down = tf.rotate([1.0, 0.0, 0.0], 90.0)
    return Rectangle(to_world=to_world @ down, **given)


@pytest.mark.parametrize(
    ("near", "number"),
    [
        ([Cube(to_world=tf.translate(LAMP.position) @ tf.scale(0.03))], STREWN),
        ([Cube(to_world=tf.translate(LAMP.position) @ tf.scale(0.06))], FEW),  # .05 of .8 m is .04
        ([flat(tf.translate([0.0, 0.77, 0.0]) @ tf.scale(0.1))], STREWN),
        ([flat(tf.translate([0.0, 0.77, 0.0]) @ tf.scale(0.01))], FEW),  # 1/40 of the directions
        ([flat(tf.translate([0.0, 0.77, 0.0]) @ tf.scale(0.1), emission=Area(radiance=0.01))], FEW),
    ],
    ids=["box", "far box", "sheet", "small sheet", "second lamp"],
)
def test_more_light_paths_for_lights_in_shades(near: list[Shape], number: float) -> None:
    lowered = lower(scene_of(ROOM, BALL, *near))
    assert lowered.settings["light_paths"] == number
    assert ("shades" in lowered.reason) == (number == STREWN)
    assert lowered.features.dull_paths_end == (number == FEW)


def test_a_group_is_no_shade_where_it_is_described() -> None:
    boxes = [Cube(to_world=tf.translate([0.0, y, 0.0]) @ tf.scale(0.03)) for y in (0.8, -0.8)]
    group = Group(shapes=boxes)
    away = [Instance(group=group, to_world=tf.translate([x, -1.5, 0.0])) for x in (0.0, 0.5)]
    assert chosen(scene_of(ROOM, BALL, *away))[0] == FEW


def test_a_shade_behind_a_lamp_is_none() -> None:
    lamp = flat(tf.translate([0.0, 0.8, 0.0]) @ tf.scale(0.05), emission=Area())
    for height, number in ((0.77, STREWN), (0.83, FEW)):
        sheet = flat(tf.translate([0.0, height, 0.0]) @ tf.scale(0.1))
        assert chosen(scene_of(ROOM, BALL, lamp, sheet, lights=()))[0] == number


@pytest.mark.parametrize(("shapes", "number"), [([ROOM], 0), ([ROOM, BALL], FEW)])
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_all_is_as_with_the_number(shapes: list[Shape], number: float, mode: str) -> None:
    made = lower(scene_of(*shapes, mode=mode))
    other = lower(scene_of(*shapes, mode=mode, integrator=Path(light_paths=number)))
    assert made.features == other.features and made.warnings == other.warnings
    assert made.settings == other.settings and other.reason == ""
    assert made.features.transport.weighed == (number > 0)
    for name, table in other.tables.items():
        assert np.array_equal(made.tables[name].view(np.uint32), table.view(np.uint32)), name


def test_an_edit_keeps_the_number() -> None:
    """A film has a place for light paths, or none, as long as it lives."""
    sharp, dull = scene_of(ROOM, BALL), scene_of(ROOM)
    assert chosen(dull, former=lower(sharp)) == (FEW, "as before the scene was edited")
    assert chosen(sharp, former=lower(dull))[0] == 0


@pytest.mark.parametrize(
    ("scene", "kind", "number"),
    [
        (scene_of(ROOM, BALL, camera=AT_BALL, integrator=Auto()), Vcm, 1),
        (scene_of(ROOM, BALL, camera=AT_WALL, integrator=Auto()), Path, FEW),
        (scene_of(ROOM, BALL, camera=AT_BALL, integrator=Auto(), noise=0.1), Path, SOME),
        (scene_of(ROOM, BALL, camera=AT_BALL, integrator=Path()), Path, SOME),
        (scene_of(ROOM, camera=AT_BALL, integrator=Auto()), Path, 0),
        (scene_of(ROOM, BALL, camera=Orthographic(), integrator=Auto()), Path, 0),
    ],
    ids=["sharp in view", "not in view", "noise", "path", "dull", "cannot be joined"],
)
def test_the_integrator_that_suits_a_scene(scene: Scene, kind: type, number: float) -> None:
    made = lower(scene)
    assert type(made.integrator) is kind and made.reason
    assert made.settings["light_paths"] == number
    assert made.features.transport.merged == (kind is Vcm)


def frosted(alpha: float) -> Sphere:
    """The ball of glass, with a roughness."""
    return dataclasses.replace(BALL, material=m.RoughDielectric(alpha=alpha))


@pytest.mark.parametrize(
    ("shapes", "kind"),
    [
        ([frosted(0.02)], Vcm),
        ([frosted(0.1)], Path),
        ([dataclasses.replace(BALL, radius=0.04)], Path),
        ([dataclasses.replace(BALL, radius=0.04), frosted(0.1)], Path),
    ],
    ids=["polished", "frosted", "a bead", "a bead in frosted glass"],
)
def test_photons_are_for_what_is_seen_through_clear_glass(shapes: list[Shape], kind: type) -> None:
    """Light paths are joined to what is rougher, and a bead fills less than 2 % of the picture."""
    far = Perspective(fov=50.0, to_world=AT_BALL.to_world)
    made = lower(scene_of(ROOM, *shapes, camera=far, integrator=Auto()))
    assert type(made.integrator) is kind
    assert made.settings["light_paths"] == (1 if kind is Vcm else FEW)
    assert ("sees little" in made.reason) == (kind is Path)
    assert made.features.dull_paths_end


def test_sides_and_heaps_do_not_count_twice() -> None:
    """Of a share of the picture: forty beads one behind the other fill as much as one."""
    eye, at = np.array([-0.9, -0.9, 0.9]), np.array([0.3, -0.5, 0.2])
    beads = [
        Sphere(center=tuple(eye + part * (at - eye)), radius=0.04 * part, material=m.Dielectric())
        for part in np.linspace(0.5, 1.0, 40)
    ]
    far = Perspective(fov=50.0, to_world=AT_BALL.to_world)
    assert type(lower(scene_of(ROOM, *beads, camera=far, integrator=Auto())).integrator) is Path


@pytest.mark.parametrize("name", ["max_depth", "rr_depth", "hide_lights"])
def test_what_is_chosen_has_the_depths_of_auto(name: str) -> None:
    value = {"max_depth": 5, "rr_depth": 4, "hide_lights": True}[name]
    for camera in (AT_BALL, AT_WALL):
        scene = scene_of(ROOM, BALL, camera=camera, integrator=Auto(**{name: value}))
        assert getattr(lower(scene).integrator, name) == value


def test_an_edit_keeps_the_integrator() -> None:
    at_ball, dull = (
        lower(scene_of(ROOM, *balls, camera=AT_BALL, integrator=Auto())) for balls in ([BALL], [])
    )
    for former in (at_ball, dull):
        edited = scene_of(ROOM, BALL, camera=AT_WALL, integrator=Auto(max_depth=7))
        made = lower(edited, former=former)
        assert type(made.integrator) is type(former.integrator)
        path = lower(dataclasses.replace(edited, integrator=Path()), former=former).integrator
        assert isinstance(path, Path)
        assert path.light_paths == former.integrator.light_paths  # type: ignore[attr-defined]
        assert made.integrator.max_depth == 7


def test_the_extent_of_an_image() -> None:
    """Above 3, below 1: half of the power is in two thirds of the half above."""
    above = np.ones((256, 4, 3), np.float32)
    above[:128] = 3.0
    faces = np.ones((6, 64, 64, 3), np.float32)
    faces[2] = 3.0
    for i in (0, 1, 4, 5):
        faces[i, :32] = 3.0
    look = lower(scene_of(ROOM)).encoder.look
    for lamp in (Envmap(image=above), CubeMap(image=faces)):
        for share, part in ((0.5, 1 / 3), (0.75, 1 / 2), (1.0, 1.0)):
            assert environment_of(lamp, look).extent(share) == pytest.approx(part, abs=0.01)
