"""What a user's type checker sees: mypy reads this file, nothing runs it."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array
from typing_extensions import assert_type

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import cameras, lights, materials, shapes, textures
from clpt.scene.values import Matrix4, SpectrumLike, Textured


def pictures(queue: cl.CommandQueue) -> None:
    """A program that embeds a renderer."""
    scene = clpt.load("scenes/cornell_box")
    assert_type(scene, clpt.Scene)
    with clpt.Renderer(scene, queue=queue) as renderer:
        event = renderer.step(16)
        assert_type(event, cl.Event)
        assert_type(renderer.step(16, wait_for=[event]), cl.Event)
        assert_type(renderer.image(), NDArray[np.float32])
        assert_type(renderer.samples, int)
        assert_type(renderer.update(camera=cameras.Perspective()), cl.Event)
        assert_type(renderer.reset(), cl.Event)
        assert_type(renderer.run(16), bool)
        film: Array = renderer.film
        renderer.update(vertices={"ball": film})
        renderer.update(materials={scene.shapes[0]: materials.Diffuse()})
        renderer.cancel()
    assert_type(clpt.render(scene, 16), NDArray[np.float32])


def rays(queue: cl.CommandQueue, points: Array, directions: Array) -> None:
    """A program that asks what rays meet."""
    accel = clpt.Accel(queue, np.zeros((3, 3), np.float32), np.zeros((1, 3), np.uint32))
    hits = accel.intersect(points, directions)
    assert_type(hits, clpt.Hits)
    assert_type(hits.event, cl.Event)


def scenes() -> None:
    """A program that makes a scene: what its parameters accept."""
    red: Textured = (0.8, 0.1, 0.1)
    light: SpectrumLike = spectra.illuminant("D65")
    place: Matrix4 = tf.translate([0, 1, 0])
    metal = materials.RoughConductor(eta=1.5, k=spectra.metal("Au")[1], alpha_u=0.1)
    paper = materials.Diffuse(reflectance=textures.Checkerboard(color0=0.2, color1=red))
    ball = shapes.Sphere(material=metal, emission=lights.Area(radiance=light), to_world=place)
    sheet = shapes.Rectangle(material=materials.TwoSided(front=paper))
    scene = clpt.Scene(camera=cameras.ThinLens(glass="BK7"), shapes=[ball, sheet])
    clpt.save(scene, "scene.json")
    assert_type(clpt.read_image("a.png"), NDArray[np.float32])

    # What a type checker refuses; --strict tells if it does not.
    materials.Diffuse(reflectance="red")  # type: ignore[arg-type]
    materials.Dielectric(int_ior=textures.Dots())  # type: ignore[arg-type]
    lights.Point(intensity=textures.Dots())  # type: ignore[arg-type]
    shapes.Sphere(to_world=1.0)  # type: ignore[arg-type]
    clpt.Renderer(scene, layuot="wide8")  # type: ignore[call-arg]
    clpt.render(scene, slots="many")  # type: ignore[arg-type]
    options: clpt.RenderOptions = {"layout": "wide8", "slots": 1024}
    clpt.render(scene, 16, **options)
