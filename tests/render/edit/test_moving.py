"""Shapes that move on the device: the picture is that of a new renderer of the same scene."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
import pytest
import trimesh

from clpt import device as dev
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.edit.moving import Move, Moving
from clpt.render.records import TransportFeatures
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Film
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Cube, Group, Instance, Mesh, Rectangle, Sphere

BALL = trimesh.creation.icosphere(2)
VERTICES = BALL.vertices.astype(np.float32)
NORMALS = BALL.vertex_normals.astype(np.float32)
RED = m.Diffuse(reflectance=(0.8, 0.2, 0.1))
SPP = 4


def scene(**more: Any) -> Scene:
    """A smooth ball, a cube, two instances of a slab under a lamp."""
    slab = Group((Cube(to_world=tf.scale([0.5, 0.1, 0.5])), Cube(to_world=tf.scale(0.2))))
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1, 6], [0, 0, 0], [0, 1, 0])),
        film=Film(width=32, height=24, mode="rgb"),
        lights=[Constant(radiance=0.3)],
        shapes=[
            Mesh(name="ball", vertices=VERTICES, faces=BALL.faces, normals=NORMALS, material=RED),
            Cube(name="cube", to_world=tf.translate([2, -1, 0]) @ tf.scale(0.5)),
            Rectangle(
                name="lamp",
                to_world=tf.translate([0, 5, 2]) @ tf.rotate([1, 0, 0], 90),
                emission=Area(radiance=12.0),
            ),
            Sphere(name="bead", center=(-2, -1, 0), radius=0.4, material=RED),
            Instance(name="left", group=slab, to_world=tf.translate([-2, 1, 0])),
            Instance(name="right", group=slab, to_world=tf.translate([2, 1, 0])),
        ],
        **more,
    )


@pytest.fixture(scope="module")
def device() -> dev.Device:
    return dev.choose()


@pytest.fixture(
    scope="module",
    params=["wide8", *(pytest.param(n, marks=pytest.mark.slow) for n in ("compact", "binary"))],
)
def renderer(device: dev.Device, request: pytest.FixtureRequest) -> Renderer:
    return Renderer(scene(), device, layout=request.param)


def picture(renderer: Renderer) -> np.ndarray:
    renderer.reset()
    renderer.run(SPP)
    return renderer.image()


def bent(amount: float) -> np.ndarray:
    shape = VERTICES * (1 + amount * np.sin(5 * VERTICES[:, :1])) * [1, 1 + amount, 1]
    return shape.astype(np.float32)


def fresh(renderer: Renderer) -> np.ndarray:
    """What a new renderer makes of the scene as it is now."""
    layout = renderer._wavefront.scene.strategy.layout
    return picture(Renderer(renderer.scene, renderer.device, layout=layout))


def test_what_moved_is_seen_where_a_new_renderer_has_it(renderer: Renderer) -> None:
    queue = renderer.device.queue
    first = picture(renderer)
    squeeze = tf.translate([0.3, 0, 0]) @ tf.rotate([1, 1, 0], 30) @ tf.scale([1, 0.5, 1.2])
    renderer.update(transforms={"ball": squeeze})
    np.testing.assert_allclose(picture(renderer), fresh(renderer), atol=1e-3)

    points = cl_array.to_device(queue, bent(0.1))
    turn = tf.translate([1, -1, 1]) @ tf.rotate([0, 1, 1], 30) @ tf.scale([0.5, 0.7, 0.4])
    up = tf.translate([-1, 1.5, 1]) @ tf.rotate([1, 0, 0], 70)
    back = cl_array.to_device(queue, np.eye(4, dtype=np.float32))
    renderer.update(vertices={"ball": points}, transforms={"ball": back, "cube": turn, "left": up})
    moved = picture(renderer)
    assert np.abs(moved - first).max() > 0.05
    np.testing.assert_allclose(moved, fresh(renderer), atol=1e-3)

    place = tf.translate([1.5, -0.5, 1]) @ tf.rotate([0, 1, 1], 50) @ tf.scale([0.5, 1, 2])
    on_device = cl_array.to_device(queue, np.float32(place))
    renderer.update(transforms={"right": on_device, "bead": tf.translate([1, 1, 1]) @ tf.scale(2)})
    seen = picture(renderer)
    assert np.abs(moved - seen).max() > 0.05
    np.testing.assert_allclose(seen, fresh(renderer), atol=1e-3)

    points.set(bent(0.4))  # the same array, with other content; and it is placed now
    renderer.update(vertices={"ball": points.base_data}, transforms={"ball": squeeze})
    np.testing.assert_allclose(picture(renderer), fresh(renderer), atol=1e-3)


def test_a_mesh_that_explodes_is_not_seen_and_comes_back(renderer: Renderer) -> None:
    renderer.update(vertices={0: VERTICES})
    before = picture(renderer)
    renderer.update(vertices={0: cl_array.to_device(renderer.device.queue, VERTICES * np.nan)})
    gone = picture(renderer)
    assert np.isfinite(gone).all() and np.abs(gone - before).max() > 0.05
    renderer.update(vertices={0: VERTICES})
    np.testing.assert_allclose(picture(renderer), before, atol=1e-4)


def test_moves_on_a_queue_out_of_order(device: dev.Device) -> None:
    """Vertices of the caller wait for the caller's event, what follows for what comes before."""
    pictures = []
    for properties in (0, cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE):
        queue = cl.CommandQueue(device.context, properties=properties)
        with Renderer(scene(), dev.Device.adopt(queue), layout="wide8") as renderer:
            points = cl_array.to_device(queue, bent(0.2))
            late = cl.UserEvent(device.context)
            waits = [late]
            up = tf.translate([-1, 1.5, 1])
            renderer.update(vertices={"ball": points}, transforms={"left": up}, wait_for=waits)
            renderer.update(transforms={"ball": tf.scale([1, 0.5, 1]), "cube": up})
            late.set_status(cl.command_execution_status.COMPLETE)
            pictures.append(picture(renderer))
    np.testing.assert_array_equal(*pictures)


def test_what_cannot_be_is_told(renderer: Renderer) -> None:
    queue = renderer.device.queue
    short = cl_array.to_device(queue, np.zeros((len(VERTICES), 2), np.float32))
    before = picture(renderer)
    for vertices in (short, short.astype(np.float64)):
        with pytest.raises(SceneError, match="ball"):
            renderer.update(vertices={"ball": vertices})
    with pytest.raises(SceneError, match="singular"):
        renderer.update(transforms={"cube": np.zeros((4, 4))})
    np.testing.assert_array_equal(picture(renderer), before)


def test_where_light_is_traced_from_lights_nothing_moves_in_place(renderer: Renderer) -> None:
    target = renderer._wavefront.scene
    moving, lowered = Moving(target, renderer.scene.shapes), target.lowered
    assert isinstance(moving.plan(renderer.scene.shapes, {}), Move)
    features = dataclasses.replace(lowered.features, transport=TransportFeatures(light_paths=True))
    target.lowered = dataclasses.replace(lowered, features=features)
    assert "traced from lights" in str(moving.plan(renderer.scene.shapes, {}))
    target.lowered = lowered


@pytest.mark.parametrize(
    ("name", "changes", "reason"),
    [
        ("lamp", {"to_world": tf.translate([0, 5, 1])}, "rectangle 'lamp' emits light"),
        ("ball", {"to_world": tf.scale([-1, 1, 1])}, "the transform of mesh 'ball' mirrors it"),
        (
            "ball",
            {"vertices": np.vstack([VERTICES, VERTICES[:1]])},
            "mesh 'ball' has 163 vertices, and had 162",
        ),
        ("ball", {"flip_normals": True}, "mesh 'ball' has another flip_normals"),
        ("bead", {"to_world": tf.scale([1, 2, 1])}, "sphere 'bead' makes triangles of it"),
    ],
)
def test_the_reason_why_a_shape_does_not_move(
    renderer: Renderer, name: str, changes: dict[str, Any], reason: str
) -> None:
    scene_ = scene()
    moving = Moving(renderer._wavefront.scene, scene_.shapes)
    old = next(shape for shape in scene_.shapes if shape.name == name)
    refusal = moving.plan(scene_.shapes, {id(old): (old, dataclasses.replace(old, **changes))})
    assert reason in str(refusal)
