"""Every shape: its name in messages, the source of its geometry, its transform, its record.

Lowering writes the records into `geometry`, and kernels read them there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import fits_single, on_host
from clpt.errors import SceneError
from clpt.files import budget
from clpt.records.layout import Record
from clpt.scene.params import fields_of
from clpt.scene.shapes import Shape


def where(shape: Shape) -> str:
    """Return how a message names the shape."""
    kind = {"tubes": "curves", "tessellated": "mesh"}.get(shape.kind, shape.kind)
    return f"{kind} {shape.name!r}" if shape.name else kind


def geometry(shape: Shape) -> tuple[Any, ...]:
    """Return all that the triangles of a shape follow from: its fields but for the surface."""
    fields = fields_of(shape)
    return type(shape), *[fields[name] for name in fields if name not in ("material", "emission")]


def placement(shape: Shape) -> NDArray[np.float64]:
    """Return a shape's transform. Raises SceneError if it is singular, or no affine 4x4 matrix."""
    budget.check_time()
    try:
        matrix = np.asarray(on_host(shape.to_world), np.float64)
    except (TypeError, ValueError) as error:
        raise SceneError(f"to_world is not a matrix: {error}", where=where(shape)) from error
    if matrix.shape != (4, 4):
        raise SceneError(f"to_world must be (4, 4), found {matrix.shape}", where=where(shape))
    if transforms.is_singular(matrix):
        raise SceneError(
            "its transform is singular: it flattens space or is not finite", where=where(shape)
        )
    if not fits_single(matrix):
        raise SceneError("its transform is beyond float32, 3.4e38", where=where(shape))
    if not transforms.is_affine(matrix):
        raise SceneError("its transform is a projection, not affine", where=where(shape))
    return matrix


ANALYTIC = ("sphere", "disk", "cylinder", "spheres", "curves")  # rays meet these as they are

ONE_OF = {"spheres": "sphere", "curves": "curve"}  # kinds of many: what each of them is

_FLAT = {
    "center": ("vec3", "[m]"),
    "s": ("vec3", "from the centre to where local x is 1 [m]"),
    "t": ("vec3", "the same for local y"),
    "n": ("vec3", "unit normal, toward the front"),
}

RECORDS: dict[str, Record] = {
    "triangle": Record(
        "Triangle",
        "One triangle as a light.",
        v0=("vec3", "first vertex [m]"),
        e1=("vec3", "from it to the second"),
        e2=("vec3", "from it to the third"),
        side=("real", "1: counter-clockwise seen from the front; -1: clockwise"),
    ),
    "rectangle": Record("Rectangle", "A parallelogram, local x and y in [-1, 1].", **_FLAT),
    "disk": Record("Disk", "A disk or ellipse, x^2 + y^2 <= 1 in local x and y.", **_FLAT),
    "sphere": Record(
        "Sphere",
        "A sphere.",
        center=("vec3", "[m]"),
        radius=("real", "[m]"),
        side=("real", "1: the front is outside; -1: inside"),
        x=("vec3", "unit axis where the azimuth is 0"),
        y=("vec3", "unit axis where it is 90 degrees"),
        z=("vec3", "unit axis to the pole"),
    ),
    "cylinder": Record(
        "Cylinder",
        "An open tube.",
        p0=("vec3", "start of the axis [m]"),
        axis=("vec3", "from there to its end"),
        radius=("real", "[m]"),
        side=("real", "1: the front is outside; -1: inside"),
        x=("vec3", "unit axis where the azimuth is 0, across the line"),
        y=("vec3", "unit axis where it is 90 degrees"),
    ),
}

# A piece of `curves`. `geometry` has what the pieces of a shape share, `spheres` the other members.
CURVE = Record(
    "Curve",
    "A sphere that runs along a Bezier cubic.",
    side=("real", "1: the front is outside; -1: inside"),
    scale=("real", "by how much the transform to the world enlarges"),
    first=("integer", "word in `spheres` where primitive 0 would be"),
    p0=("vec3", "control points [m]"),
    p1=("vec3", "control points [m]"),
    p2=("vec3", "control points [m]"),
    p3=("vec3", "control points [m]"),
    r0=("real", "radius at them [m]; negated at an end that a half sphere closes"),
    r1=("real", "radius at them [m]"),
    r2=("real", "radius at them [m]"),
    r3=("real", "as r0 [m]"),
    axis=("vec3", "across the curve at its beginning, where u is 0"),
    v=("real", "v at its beginning"),
    dv=("real", "by how much v grows along it"),
)
ROWS = {**RECORDS, "curve": CURVE}  # of all kinds, lights or not

# What the functions of shapes return, see kernels/shapes/shape.cl and emission.cl.
SHAPE_SAMPLE = Record(
    "ShapeSample",
    "A point of a shape, chosen as seen from some point p.",
    wi=("vec3", "unit length, from p to the point", "v3(0.0f, 0.0f, 1.0f)"),
    t=("real", "distance [m]", "FAR"),
    n=("vec3", "unit normal there, toward the front", "v3(0.0f, 0.0f, 1.0f)"),
    uv=("vec2", "there"),
    size=("real", "of the primitive, see kernels/core/rounding.cl [m]"),
    pdf=("real", "[1/sr]; 0: nothing"),
)
SURFACE_POINT = Record(
    "SurfacePoint",
    "A point of a shape, chosen evenly over its area.",
    p=("vec3", "[m]"),
    n=("vec3", "unit normal, toward the front", "v3(0.0f, 0.0f, 1.0f)"),
    uv=("vec2", "there"),
    area=("real", "of the shape [m^2]"),
)
VALUES = (SHAPE_SAMPLE, SURFACE_POINT)
