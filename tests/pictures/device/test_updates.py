"""After an update the picture is that of a new renderer, bit for bit, whatever was edited."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
import pytest

import clpt
from clpt import device
from clpt import transforms as tf
from clpt.errors import MemoryBudgetError, SceneError
from clpt.render.edit.plans import has_other_paths
from clpt.render.flow.scene_to_tables import lower
from clpt.render.makers import planning
from clpt.scene import Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Film, Path
from clpt.scene.lights import Area, Point
from clpt.scene.media import Homogeneous
from clpt.scene.shapes import Mesh, Rectangle, Sphere
from clpt.scene.textures import Bitmap

SPP = 2
RNG = np.random.default_rng(2)
ONE, OTHER = RNG.random((4, 4, 3)).astype(np.float32), RNG.random((7, 5, 3)).astype(np.float32)
CORNERS = np.array([[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]], np.float32)
FACES = np.array([[0, 2, 1], [0, 3, 2]], np.uint32)
UVS = CORNERS[:, ::2].copy()

FLOOR = Mesh(
    vertices=CORNERS,
    faces=FACES,
    uvs=UVS,
    material=m.Diffuse(reflectance=Bitmap(image=ONE)),
    name="floor",
)
RED = m.Diffuse(reflectance=(0.8, 0.2, 0.1))
METAL = m.RoughConductor(alpha_u=0.2, alpha_v=0.2)
WALL = Rectangle(material=RED, to_world=tf.translate([0, 1, -2]), name="wall")
SIDE = Rectangle(material=METAL, to_world=tf.translate([0.5, 0, 0]) @ tf.rotate([0, 1, 0], 40))
BALL = Sphere(material=METAL, center=(0.6, 0.5, 0.0), radius=0.5)
LAMP = Rectangle(
    emission=Area(radiance=6.0),
    material=RED,
    to_world=tf.translate([0, 3, 0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.5),
)
CAMERA = Perspective(to_world=tf.look_at([0, 1.5, 4], [0, 0.6, 0], [0, 1, 0]), fov=45)
POINT = Point(position=(-1, 2, 1), intensity=3.0)


def scene(**more: Any) -> Scene:
    given = {
        "shapes": [FLOOR, WALL, BALL, LAMP],
        "lights": [POINT],
        "film": Film(width=20, height=16, mode="rgb"),
        "integrator": Path(max_depth=4, light_paths=0),
    }
    return Scene(camera=CAMERA, **{**given, **more})


def changed(now: Scene, place: int, **fields: Any) -> Scene:
    """The scene with fields of one of its shapes changed."""
    made = list(now.shapes)
    made[place] = dataclasses.replace(made[place], **fields)
    return dataclasses.replace(now, shapes=made)


@pytest.fixture(scope="module")
def renderer() -> clpt.Renderer:
    return clpt.Renderer(scene(), device.choose())


def picture(renderer: clpt.Renderer) -> np.ndarray:
    renderer.run(SPP)
    return renderer.image()


def check(renderer: clpt.Renderer) -> np.ndarray:
    """The picture, once it has been found to be that of a new renderer."""
    own, new = picture(renderer), picture(clpt.Renderer(renderer.scene, renderer.device))
    np.testing.assert_array_equal(own.view(np.uint32), new.view(np.uint32))
    return own


# name: what is updated, in this order, given the renderer's scene
EDITS: dict[str, Callable[[Scene], dict[str, Any]]] = {
    "a camera": lambda s: {"camera": dataclasses.replace(CAMERA, fov=60.0)},
    "a colour": lambda s: {"materials": {RED: m.Diffuse(reflectance=(0.1, 0.2, 0.9))}},
    "a colour again": lambda s: {"materials": {RED: m.Diffuse(reflectance=(0.1, 0.9, 0.1))}},
    "a roughness": lambda s: {
        "materials": {METAL: m.RoughConductor(alpha_u=0.05, alpha_v=0.05)},
        "camera": CAMERA,
    },
    "a material of one shape": lambda s: {"materials": {"wall": m.Diffuse(reflectance=0.3)}},
    "a texture": lambda s: {"materials": {"floor": m.Diffuse(reflectance=Bitmap(image=OTHER))}},
    "emission": lambda s: {"scene": changed(s, 3, emission=Area(radiance=(9.0, 3.0, 1.0)))},
    "a lamp on a shape moved": lambda s: {"transforms": {LAMP: tf.translate([0, 3, 1])}},
    "a lamp": lambda s: {"scene": dataclasses.replace(s, lights=[Point(position=(1, 2, 2))])},
    "vertices": lambda s: {"vertices": {FLOOR: CORNERS * np.float32(0.7)}},
    "a transform": lambda s: {"transforms": {BALL: tf.translate([-0.8, 0.2, 0])}},
    "a shape more": lambda s: {"scene": dataclasses.replace(s, shapes=[*s.shapes, SIDE])},
    "a shape less": lambda s: {"scene": dataclasses.replace(s, shapes=s.shapes[1:])},
    "the integrator's depth": lambda s: {
        "scene": dataclasses.replace(s, integrator=Path(max_depth=2, light_paths=0), seed=5)
    },
}


def test_edits(renderer: clpt.Renderer) -> None:
    """One after the other on one renderer; each one shows."""
    film, before = renderer.film.data, check(renderer)
    for name, edit in EDITS.items():
        event = renderer.update(**edit(renderer.scene))
        event.wait()
        assert renderer.samples == 0
        after = check(renderer)
        assert not np.array_equal(before, after), name
        before = after
    assert renderer.film.data is film, "the film is the same memory for life"
    renderer.update(scene=scene())
    check(renderer)


def test_values_are_a_few_words(
    renderer: clpt.Renderer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Colours and cameras write some bytes; they lower, build and bind nothing."""
    renderer.update(scene=scene())
    written: list[int] = []
    stream = renderer._wavefront.stream
    write = stream.write
    monkeypatch.setattr(
        stream, "write", lambda b, a, *more: (written.append(a.nbytes), write(b, a, *more))[1]
    )
    monkeypatch.setattr(planning, "_rebuilt", None)
    buffers, used = renderer._wavefront.arguments, renderer._wavefront.buffers.used
    with caplog.at_level(logging.INFO, "clpt"):
        renderer.update(materials={RED: m.Diffuse(reflectance=(0.1, 0.2, 0.3))})
        assert 4 <= sum(written) <= 12
        renderer.update(camera=dataclasses.replace(CAMERA, fov=30.0))
        assert sum(written) < 200
    assert not caplog.records
    assert renderer._wavefront.arguments == buffers
    assert renderer._wavefront.buffers.used == used
    check(renderer)


def test_the_log_says_why_an_update_was_slow(
    renderer: clpt.Renderer, caplog: pytest.LogCaptureFixture
) -> None:
    renderer.update(scene=scene())
    with caplog.at_level(logging.DEBUG, "clpt.render.renderer"):
        renderer.update(transforms={LAMP: tf.translate([0, 3, 0.5])})
        renderer.update(materials={"wall": m.RoughConductor()})
    assert [r.message for r in caplog.records] == [
        "shapes cannot move on the device: rectangle emits light: lights follow from it",
        "words alone do not change the scene: a material is of another kind or structure",
    ]


def test_what_cannot_be_changes_nothing(renderer: clpt.Renderer) -> None:
    renderer.update(scene=scene())
    before, now = picture(renderer), renderer.scene
    wide = dataclasses.replace(now, film=Film(width=40, height=16, mode="rgb"))
    for edit, message in (
        ({"scene": wide}, "make a new Renderer"),
        ({"transforms": {"wall": np.zeros((4, 4))}}, "rectangle 'wall': .*singular"),
        ({"vertices": {"floor": CORNERS[:2]}}, "a face names vertex 3, there are 2"),
        ({"materials": {RED: 3}}, "3 is not a material"),
        (
            {"transforms": {"wall": tf.translate([0, 1, -1])}, "materials": {"nobody": RED}},
            "no shape has the name 'nobody'",
        ),
    ):
        with pytest.raises(SceneError, match=message):
            renderer.update(**edit)
        assert renderer.scene is now
    buffers = renderer._wavefront.buffers
    limit, buffers.limit = buffers.limit, buffers.used + 40
    with pytest.raises(MemoryBudgetError):
        renderer.update(scene=dataclasses.replace(now, shapes=[*now.shapes, SIDE, SIDE]))
    buffers.limit = limit
    renderer.reset()
    np.testing.assert_array_equal(picture(renderer), before)
    renderer.update(scene=dataclasses.replace(now, shapes=[*now.shapes, SIDE]))
    check(renderer)


def test_other_paths() -> None:
    """Guiding is left aside in media: an update that brings some asks for other kinds of paths."""
    guided = dataclasses.replace(scene(), integrator=Path(guiding=True))
    fog = dataclasses.replace(FLOOR, exterior=Homogeneous(sigma_s=0.1))
    foggy = dataclasses.replace(guided, shapes=[*guided.shapes, fog])
    assert has_other_paths(lower(guided), lower(foggy))
    assert not has_other_paths(lower(guided), lower(dataclasses.replace(guided, seed=3)))


def test_arrays_of_the_device(renderer: clpt.Renderer) -> None:
    """Meshes and images whose arrays lie in device memory, at first and when they are updated."""
    queue = renderer.device.queue

    def there(values: np.ndarray) -> cl_array.Array:
        return cl_array.to_device(queue, values)

    floor = dataclasses.replace(
        FLOOR,
        vertices=there(CORNERS).data,
        faces=there(FACES),
        uvs=there(UVS),
        material=m.Diffuse(reflectance=Bitmap(image=there(ONE))),
    )
    own = clpt.Renderer(scene(shapes=[floor, WALL, BALL, LAMP]), renderer.device)
    host = clpt.Renderer(scene(), renderer.device)
    np.testing.assert_array_equal(picture(own), picture(host))
    smaller = CORNERS * np.float32(0.5)
    points, matrix = there(smaller), tf.rotate([0, 1, 0], 30)
    own.update(vertices={floor: points}, transforms={floor: there(matrix)})
    host.update(vertices={FLOOR: smaller}, transforms={FLOOR: matrix})
    np.testing.assert_array_equal(picture(own), picture(host))
    points *= np.float32(1.5)  # the same array, other values
    own.update(vertices={floor: points})
    host.update(vertices={FLOOR: points.get()})
    np.testing.assert_array_equal(picture(own), picture(host))


def test_arrays_of_another_context(renderer: clpt.Renderer) -> None:
    other = cl.CommandQueue(cl.Context([renderer.device.info.cl_device]))
    floor = dataclasses.replace(FLOOR, vertices=cl_array.to_device(other, CORNERS))
    with pytest.raises(SceneError, match="mesh 'floor': vertices lie in another OpenCL context"):
        renderer.update(scene=scene(shapes=[floor]))


@pytest.mark.slow
def test_trees_are_fitted_or_built(caplog: pytest.LogCaptureFixture) -> None:
    """A lamp that moves is lowered again and its tree fitted; a scene that is given is built."""
    own = clpt.Renderer(scene(), device.choose(), layout="wide8")
    tree = own._wavefront.scene.trees.triangles
    own.update(transforms={LAMP: tf.translate([0.3, 2.8, 0.5]) @ LAMP.to_world, FLOOR: tf.scale(2)})
    assert own._wavefront.scene.trees.triangles is tree
    fresh = picture(clpt.Renderer(own.scene, own.device, layout="wide8"))
    np.testing.assert_allclose(picture(own), fresh, atol=1e-5)
    with caplog.at_level(logging.INFO, "clpt.render.edit.plans"):
        own.update(scene=own.scene)
    assert own._wavefront.scene.trees.triangles is not tree
    assert [r.message for r in caplog.records] == ["trees are built over triangles and boxes"]
    np.testing.assert_array_equal(picture(own), fresh)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["spectral"])
def test_values_and_sources(mode: str) -> None:
    """Of more kinds than are shaded in place; edits of values and of where values come from."""
    kinds = [RED, METAL, m.Plastic(), m.Conductor(), m.Phong(), m.RoughPlastic()]
    balls = [
        Sphere(material=kind, center=(i % 3 - 1, i // 3 + 0.3, 0), radius=0.4)
        for i, kind in enumerate(kinds)
    ]
    film = Film(width=20, height=16, mode=mode)
    own = clpt.Renderer(scene(shapes=[FLOOR, LAMP, *balls], film=film), device.choose())
    used = own._wavefront.buffers.used
    for old, new in (
        (RED, m.Diffuse(reflectance=(0.9, 0.8, 0.1))),
        (kinds[2], m.Plastic(diffuse_reflectance=(0.1, 0.2, 0.3), int_ior=1.7)),
        (kinds[3], m.Conductor(eta=clpt.spectra.metal("Au")[0], k=clpt.spectra.metal("Au")[1])),
        (RED, m.Diffuse(reflectance=clpt.spectra.Tabulated([400, 700], [0.1, 0.9]))),
        (METAL, m.RoughConductor(alpha_u=0.3, alpha_v=0.1)),
        (METAL, m.TwoSided(front=m.Diffuse(reflectance=0.2))),
        (RED, m.Diffuse(reflectance=0.5)),
    ):
        own.update(materials={old: new})
        check(own)
    own.update(scene=scene(shapes=[FLOOR, LAMP, *balls], film=film))
    check(own)
    assert own._wavefront.buffers.used == used


@pytest.mark.slow
def test_other_kinds_and_films() -> None:
    """Kernels are built for what is new; of several films at once each is right."""
    own = clpt.Renderer(scene(), device.choose())
    glass = m.Dielectric()
    check(own)
    for edit in (
        {"materials": {RED: glass}},
        {"materials": {glass: m.TwoSided(front=RED)}},
        {"materials": {"wall": m.Mask(opacity=0.5, material=RED)}},
        {"scene": scene(integrator=clpt.scene.integrators.Whitted())},
    ):
        own.update(**edit)
        check(own)
