"""Arrays on the device whose rows do not follow each other in memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
import pytest

import clpt
from clpt.scene import cameras, lights, materials, media, shapes, textures

CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0.5], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
UP = np.array([[0, 0.1, 1], [0, 0, 1], [0.1, 0, 1], [0, 0, 1]], np.float32)
IMAGE = np.linspace(0.1, 0.9, 4 * 6 * 3, dtype=np.float32).reshape(4, 6, 3)
DENSITY = np.linspace(0.0, 2.0, 4**3, dtype=np.float32).reshape(4, 4, 4)
MOVED = np.eye(4, dtype=np.float32) + np.float32(0.1) * np.eye(4, k=3, dtype=np.float32)


def skipping(queue: cl.CommandQueue, values: np.ndarray) -> Any:
    """Every second row of an array on the device."""
    return cl_array.to_device(queue, np.repeat(values, 2, 0))[::2]


def some_columns(queue: cl.CommandQueue, values: np.ndarray) -> Any:
    """An array in the middle of a wider one, whose first bytes are not its own."""
    wide = np.full((*values.shape[:-1], values.shape[-1] + 3), 9, values.dtype)
    wide[..., 2:-1] = values
    return cl_array.to_device(queue, wide)[..., 2:-1]


def backwards(queue: cl.CommandQueue, values: np.ndarray) -> Any:
    """The rows from the last to the first."""
    return cl_array.to_device(queue, np.ascontiguousarray(values[::-1]))[::-1]


FORMS = {one.__name__: one for one in (skipping, some_columns, backwards)}


def mesh(**given: Any) -> shapes.Mesh:
    return shapes.Mesh(**{"vertices": CORNERS, "faces": FACES, **given})


def lit(shape: Any) -> clpt.Scene:
    return clpt.Scene(
        camera=cameras.Perspective(origin=(0.0, 0.5, 4.0), target=(0, 0, 0)),
        shapes=[shape],
        lights=[lights.Constant(radiance=1.0), lights.Point(position=(1.0, 2.0, 3.0))],
        film=clpt.Film(size=(12, 12), mode="rgb"),
    )


Convert = Callable[[np.ndarray], Any]
SCENES: dict[str, Callable[[Convert], clpt.Scene]] = {
    "vertices": lambda on: lit(mesh(vertices=on(CORNERS))),
    "faces": lambda on: lit(mesh(faces=on(FACES))),
    "normals": lambda on: lit(mesh(normals=on(UP))),
    "uvs": lambda on: lit(
        mesh(
            uvs=on(CORNERS[:, :2]),
            material=materials.Diffuse(reflectance=textures.Checkerboard()),
        )
    ),
    "attributes": lambda on: lit(
        mesh(
            attributes={"vertex_tint": on(np.abs(UP))},
            material=materials.Diffuse(reflectance=textures.MeshAttribute(name="vertex_tint")),
        )
    ),
    "centers": lambda on: lit(shapes.Spheres(centers=on(CORNERS), radii=0.3)),
    "to_world": lambda on: lit(mesh(to_world=on(MOVED))),
    "density": lambda on: lit(
        shapes.Cube(
            material=materials.Null(),
            interior=media.Grid(sigma_s=1.0, density=on(DENSITY)),
        )
    ),
    "bitmap": lambda on: lit(
        mesh(
            uvs=CORNERS[:, :2],
            material=materials.Diffuse(reflectance=textures.Bitmap(image=on(IMAGE))),
        )
    ),
    "envmap": lambda on: clpt.Scene(
        camera=cameras.Spherical(), lights=[lights.Envmap(image=on(IMAGE))],
        film=clpt.Film(size=(8, 4), mode="rgb"),
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def whole(queue: cl.CommandQueue) -> Callable[[str], np.ndarray]:
    """The picture of each scene whose arrays lie on the host."""
    pictures: dict[str, np.ndarray] = {}

    def of(name: str) -> np.ndarray:
        if name not in pictures:
            pictures[name] = picture(SCENES[name](np.asarray), queue)
        return pictures[name]

    return of


def picture(scene: clpt.Scene, queue: cl.CommandQueue) -> np.ndarray:
    with clpt.Renderer(scene, queue=queue) as renderer:
        renderer.run(4)
        return renderer.image()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", SCENES)
def test_arrays_of_a_scene(
    queue: cl.CommandQueue, whole: Callable[[str], np.ndarray], name: str, form: str
) -> None:
    scene = SCENES[name](lambda values: FORMS[form](queue, values))
    np.testing.assert_allclose(picture(scene, queue), whole(name), rtol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_arrays_of_an_update(queue: cl.CommandQueue, form: str) -> None:
    make, moved = FORMS[form], CORNERS * np.float32(0.5)
    for changes, scene in (
        ({"vertices": {0: make(queue, moved)}}, lit(mesh(vertices=moved))),
        ({"transforms": {0: make(queue, MOVED)}}, lit(mesh(to_world=MOVED))),
    ):
        with clpt.Renderer(lit(mesh()), queue=queue) as renderer:
            renderer.update(**changes)
            renderer.run(4)
            np.testing.assert_allclose(renderer.image(), picture(scene, queue), atol=1e-5)


def test_masked_arrays_are_refused() -> None:
    hidden = np.ma.array(CORNERS, mask=np.arange(12).reshape(4, 3) == 5)
    for make in (
        lambda: mesh(vertices=hidden),
        lambda: mesh(attributes={"vertex_tint": hidden}),
        lambda: textures.Bitmap(image=np.ma.array(IMAGE, mask=IMAGE > 0.5)),
        lambda: cameras.Perspective(origin=hidden[1], target=(0, 0, 0)),
    ):
        with pytest.raises(clpt.SceneError, match="masked"):
            make()
    with pytest.raises(clpt.SceneError, match="masked"), clpt.Renderer(lit(mesh())) as renderer:
        renderer.update(vertices={0: hidden})
    shown = mesh(vertices=np.ma.array(CORNERS))  # nothing of it is hidden
    assert shown.vertices.shape == (4, 3)
