"""Rules of shapes: what makes one of another form, and what its surface asks of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from clpt.errors import SceneError
from clpt.geometry import analytic, refining, shapes, triangles
from clpt.render.textures.check import check_image
from clpt.scene.shapes import Curves, Cylinder, Instance, Mesh, Shape, Sphere, Spheres
from clpt.scene.textures import attributes_in


def check_shapes(things: Iterable[Shape]) -> None:
    """Raise SceneError for the first shape whose parameters contradict each other.

    What its arrays hold is not looked at.
    """
    asked: dict[int, set[str]] = {}  # attributes, by what reads them
    for shape in things:
        if isinstance(shape, Instance):
            continue
        if isinstance(shape, (Mesh, Spheres, Curves)) and shape.deformation is not None:
            triangles.check_deformation(shape)
        if isinstance(shape, Mesh):
            refining.check(shape)
            if shape.displacement is not None:
                check_image(shape.displacement.image, "mesh.displacement", emissive=False)
        elif isinstance(shape, (Sphere, Spheres, Cylinder)):
            analytic.check(shape)
        for user, kind in (("material", shape.material), ("emission", shape.emission)):
            if id(kind) not in asked:
                asked[id(kind)] = attributes_in(kind)
            if asked[id(kind)]:
                _check_attributes(shape, user, asked[id(kind)])


def check_instances(things: Iterable[Shape]) -> None:
    """Raise SceneError for an instance that stretches what cannot become triangles."""
    for thing in things:
        if isinstance(thing, Instance):
            for shape in thing.group.shapes:
                if isinstance(shape, Spheres):
                    matrix = shapes.placement(thing) @ shapes.placement(shape)
                    analytic.check(replace(shape, to_world=matrix))


def _check_attributes(shape: Shape, user: str, asked: set[str]) -> None:
    """Raise SceneError for attributes that a shape lacks; user: which part of it reads them."""
    held = shape.attributes if isinstance(shape, (Mesh, Spheres)) else {}
    missing = sorted(asked.difference(held))
    if missing:
        known = ", ".join(held) or "none"
        message = f"its {user} asks for the attribute {missing[0]!r}; it has {known}"
        raise SceneError(message, where=shapes.where(shape))
