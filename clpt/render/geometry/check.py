"""Rules of shapes: deformations, subdivision, displacement, placement and attributes."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.errors import SceneError
from clpt.geometry import analytic, refining, shapes, triangles
from clpt.scene.pixels import check_image
from clpt.scene.shapes import Cylinder, Mesh, Shape, Sphere, Spheres
from clpt.scene.textures import attributes_in


def check_shapes(scene_shapes: Iterable[Shape]) -> None:
    """Raise SceneError for the first shape whose parameters contradict each other.

    The values in arrays are not checked.
    """
    names: dict[int, set[str]] = {}  # of attributes, by the id of the material or light
    for shape in scene_shapes:
        if shape.deformation is not None:
            triangles.check_deformation(shape)
        if isinstance(shape, Mesh):
            refining.check(shape)
            if shape.displacement is not None:
                check_image(shape.displacement.image, "mesh.displacement", emissive=False)
        elif isinstance(shape, (Sphere, Spheres, Cylinder)):
            analytic.check(shape)
        for user, kind in (("material", shape.material), ("emission", shape.emission)):
            if id(kind) not in names:
                names[id(kind)] = attributes_in(kind)
            if names[id(kind)]:
                _check_attributes(shape, user, names[id(kind)])


def check_instances(scene_shapes: Iterable[Shape]) -> None:
    """Raise SceneError for an instance that stretches spheres."""
    for instance in scene_shapes:
        for shape in instance.members:
            if shape is not instance and isinstance(shape, Spheres):
                matrix = shapes.placement(instance) @ shapes.placement(shape)
                analytic.check(shape.placed(matrix))


def _check_attributes(shape: Shape, user: str, names: set[str]) -> None:
    """Raise SceneError for attributes that a shape lacks; user: the part of it that reads them."""
    missing = sorted(names.difference(shape.attributes))
    if missing:
        known = ", ".join(shape.attributes) or "none"
        message = f"its {user} asks for the attribute {missing[0]!r}; it has {known}"
        raise SceneError(message, where=shapes.where(shape))
