"""Shapes as rows of parameters, their areas and boxes.

A rectangle has a row and triangles: rays meet its triangles, light is sampled on it as a whole.

Many spheres in a single shape share a row of `shapes` and a row of `geometry` with their rotation;
the table `spheres` has four words for each: centre and radius in the world. Spheres with
deformation have these words for each key, and a word behind the row of `geometry` is their offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import Balls, Points, Words, fits_single, on_host, single
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry.shapes import ANALYTIC, ONE_OF, RECORDS, ROWS, placement, where
from clpt.geometry.triangles import triangle_areas, triangulate
from clpt.scene import shapes
from clpt.scene.params import fields_of
from clpt.scene.shapes import Cylinder, Mesh, Shape, Sphere, Spheres

UNEVEN = 1e-5  # larger differences of axes' lengths, or their cosine, make no sphere

PADDING = 1e-6  # of the size of an analytic shape, for rounding to float32 in its kernel


def check(shape: shapes.Sphere | shapes.Spheres | shapes.Cylinder) -> None:
    """Raise SceneError for a sphere, spheres or a cylinder that its transform distorts."""
    if isinstance(shape, shapes.Cylinder):
        row(shape)
    elif not np.array_equal(on_host(shape.to_world), transforms.IDENTITY):
        _even_axes(placement(shape)[:3, :3], shape)


def row(shape: Shape) -> Words:
    """Return the words of a rectangle, sphere, disk or cylinder in `geometry`, placed.

    Spheres have the row of a sphere around the origin with radius 1 before `to_world`; curves the
    members that all their pieces share.

    Raises SceneError for a transform that is singular, or that makes the shape another kind.
    """
    matrix = placement(shape)
    record = ROWS[ONE_OF.get(shape.kind, shape.kind)]
    if isinstance(shape, shapes.Sphere):
        radius = _positive(shape.radius, "radius", shape)
        values = _sphere(shape, matrix, _three(shape.center, "center", shape), radius)
    elif isinstance(shape, shapes.Spheres):
        values = _sphere(shape, matrix, np.zeros(3), 1.0)
    elif isinstance(shape, shapes.Curves):
        nothing = {m.name: np.zeros(3 if m.type == "vec3" else 1) for m in record.members}
        values = {**nothing, "side": _side(shape), "scale": _even_axes(matrix[:3, :3], shape)[1]}
    elif isinstance(shape, shapes.Cylinder):
        values = _cylinder(shape, matrix)
    else:
        s, t, center = matrix[:3, 0], matrix[:3, 1], matrix[:3, 3]
        values = {"center": center, "s": s, "t": t, "n": facing(shape)}
    flat = np.concatenate([np.ravel(values[m.name]) for m in record.members])
    return _single(flat, shape).view(np.uint32)


def member(kind: str, name: str) -> int:
    """Return the place of a member in a kind's row, in words."""
    return next(m.word for m in ROWS[kind].members if m.name == name)


def _side(shape: Shape) -> float:
    return -1.0 if shape.flip_normals else 1.0


def facing(shape: Shape) -> NDArray[np.float64]:
    """Return where the front of a rectangle or disk faces in the world, (3,) of unit length."""
    return _side(shape) * transforms.transform_normals(placement(shape), [0.0, 0.0, 1.0])


def _sphere(
    shape: Shape, matrix: NDArray[np.float64], center: NDArray[np.float64], radius: float
) -> dict[str, ArrayLike]:
    axes, scale = _even_axes(matrix[:3, :3], shape)
    return {
        "center": transforms.transform_points(matrix, center),
        "radius": radius * scale,
        "side": _side(shape),
        "x": axes[:, 0],
        "y": axes[:, 1],
        "z": axes[:, 2],
    }


def _cylinder(shape: shapes.Cylinder, matrix: NDArray[np.float64]) -> dict[str, ArrayLike]:
    radius = _positive(shape.radius, "radius", shape)
    p0, p1 = _three(shape.p0, "p0", shape), _three(shape.p1, "p1", shape)
    length = np.linalg.norm(p1 - p0)
    if not length > 0.0:
        raise SceneError("p0 and p1 coincide", where=where(shape))
    frame = np.column_stack([*across((p1 - p0) / length), p1 - p0])
    placed = matrix[:3, :3] @ frame
    stretch = np.linalg.norm(placed[:, 2]) / np.linalg.norm(placed[:, 0])
    axes, scale = _even_axes(placed / [1.0, 1.0, stretch], shape)
    return {
        "p0": transforms.transform_points(matrix, p0),
        "axis": placed[:, 2],
        "radius": radius * scale,
        "side": _side(shape),
        "x": axes[:, 0],
        "y": axes[:, 1],
    }


def across(n: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two unit axes across a unit vector (Duff et al. 2017)."""
    sign = np.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    s = np.array([1.0 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]])
    return s, np.array([b, sign + n[1] ** 2 * a, -n[1]])


def _even_axes(linear: NDArray[np.float64], shape: Shape) -> tuple[NDArray[np.float64], float]:
    """The unit columns of a matrix that scales evenly, and its scale."""
    lengths = np.linalg.norm(linear, axis=0)
    axes = linear / lengths
    uneven = np.ptp(lengths) > UNEVEN * lengths.max()
    if uneven or np.abs(axes.T @ axes - np.eye(3)).max() > UNEVEN:
        raise SceneError(
            f"its transform stretches or shears it, and then it is no {shape.kind}; "
            "use a mesh for that",
            where=where(shape),
        )
    return axes, float(lengths[0])


def area(shape: Shape) -> float:
    """Return the area of a shape in world space [m^2]."""
    if shape.kind not in RECORDS:
        vertices, faces, _, _ = triangulate(shape)
        return float(triangle_areas(vertices, faces).sum())
    row_ = members_of(shape)
    if shape.kind == "sphere":
        return float(4.0 * np.pi * row_["radius"] ** 2)
    if shape.kind == "cylinder":
        return float(2.0 * np.pi * row_["radius"] * np.linalg.norm(row_["axis"]))
    parallelogram = float(np.linalg.norm(np.cross(row_["s"], row_["t"])))
    return (np.pi if shape.kind == "disk" else 4.0) * parallelogram


def bounds(shape: Shape) -> tuple[Points, Points]:
    """Return the corners (3,) float32 of a box around the shape [m]."""
    if shape.kind not in ANALYTIC or isinstance(shape, shapes.Curves):
        vertices = triangulate(shape)[0]
        return vertices.min(axis=0), vertices.max(axis=0)
    row_ = members_of(shape)
    if shape.kind == "sphere":
        ends, reach = row_["center"][None], np.full(3, row_["radius"])
    elif shape.kind == "disk":
        ends, reach = row_["center"][None], np.hypot(row_["s"], row_["t"])
    else:
        ends = np.stack([row_["p0"], row_["p0"] + row_["axis"]])
        reach = row_["radius"] * np.hypot(row_["x"], row_["y"])
    lo, hi = ends.min(axis=0) - reach, ends.max(axis=0) + reach
    pad = PADDING * max(np.ptp([lo, hi], axis=0).max(), np.abs([lo, hi]).max())
    return _single(lo - pad, shape), _single(hi + pad, shape)


def members_of(shape: Shape) -> dict[str, NDArray[np.float64]]:
    """Return the members of a shape's row by name, as float64."""
    record = RECORDS[shape.kind]
    values = row(shape).view(record.dtype)[0]
    return {m.name: np.asarray(values[m.name], np.float64) for m in record.members}


def _single(values: NDArray[np.float64], shape: Shape) -> Points:
    numbers = single(values)
    if not np.isfinite(numbers).all():
        message = "it is too large or too far away: coordinates are float32, up to 3.4e38 m"
        raise SceneError(message, where=where(shape))
    return numbers


def _three(value: ArrayLike, name: str, shape: Shape) -> NDArray[np.float64]:
    values = np.asarray(value, np.float64)
    if values.shape != (3,) or not fits_single(values):
        message = f"{name} must be three finite numbers, found {value!r}"
        raise SceneError(message, where=where(shape))
    return values


def _positive(value: float, name: str, shape: Shape) -> float:
    if not (np.isfinite(value) and value > 0.0):
        raise SceneError(f"{name} must be above zero, found {value}", where=where(shape))
    return float(value)


AROUND, ALONG = 96, 48  # steps of the azimuth, and of a sphere's polar angle


@dataclass(frozen=True, kw_only=True, eq=False)
class Tessellated(Mesh):
    """A sphere or a tube as triangles; layers still count it as a single primitive."""


def keeps_its_kind(shape: Shape) -> bool:
    """Whether rays can meet an analytic shape as it is; not where its transform stretches it."""
    try:
        row(shape)
    except SceneError:
        return False
    return True


def tessellate(shape: Sphere | Cylinder) -> Tessellated:
    """Return the shape as a mesh with normals and uvs, under the same transform."""
    along = ALONG if isinstance(shape, Sphere) else 1
    u, v = np.meshgrid(np.arange(AROUND + 1) / AROUND, np.arange(along + 1) / along)
    uvs = np.column_stack([u.ravel(), v.ravel()])
    circle = np.column_stack([np.cos(2.0 * np.pi * uvs[:, 0]), np.sin(2.0 * np.pi * uvs[:, 0])])
    if isinstance(shape, Sphere):
        polar = np.pi * uvs[:, 1:]
        normals = np.hstack([circle * np.sin(polar), np.cos(polar)])
        vertices = np.asarray(shape.center) + shape.radius * normals
    else:
        axis = np.subtract(shape.p1, shape.p0)
        normals = circle @ np.stack(across(axis / np.linalg.norm(axis)))
        vertices = np.asarray(shape.p0) + uvs[:, 1:] * axis + shape.radius * normals
    faces = _quads(along)
    budget.take_arrays((vertices, normals, uvs, faces), f"{shape.kind} {shape.name}, in triangles")
    budget.check_time()
    if isinstance(shape, Sphere):  # v runs down; at the poles a half of each quad has no area
        centre = faces[1:-1].reshape(-1, 3)
        faces = np.concatenate([faces[0, :, 1], centre, faces[-1, :, 0]])
        faces = faces[:, ::-1]
    return Tessellated(
        vertices=vertices.astype(np.float32),
        faces=faces.reshape(-1, 3).astype(np.uint32),
        normals=normals.astype(np.float32),
        uvs=uvs.astype(np.float32),
        material=shape.material,
        emission=shape.emission,
        interior=shape.interior,
        exterior=shape.exterior,
        priority=shape.priority,
        to_world=shape.to_world,
        flip_normals=shape.flip_normals,
        name=shape.name,
    )


def _quads(along: int) -> np.ndarray:
    """Two triangles a quad of the grid, (along, AROUND, 2, 3), counter-clockwise in u and v."""
    first = np.arange(along)[:, None] * (AROUND + 1) + np.arange(AROUND)
    halves = np.array([[0, 1, AROUND + 2], [0, AROUND + 2, AROUND + 1]])
    return first[..., None, None] + halves


FARTHEST = 1e38  # [m], of a centre or a radius: a box around them is float32


def balls(shape: Spheres) -> Balls:
    """Return centre and radius of every sphere in the world, (n, 4) float32 [m].

    Raises SceneError for arrays of other shapes, values that are not finite, radii not above zero,
    or a transform that stretches.
    """
    scale = float(common(shape).view(np.float32)[member("sphere", "radius")])
    matrix = placement(shape)
    centers = _numbers(shape, "centers")
    if centers.ndim != 2 or centers.shape[1] not in (3, 4) or not len(centers):
        message = f"centers must be (n, 3) or (n, 4), n at least one, found {centers.shape}"
        raise SceneError(message, where=where(shape))
    radii = centers[:, 3] if centers.shape[1] == 4 else _numbers(shape, "radii")
    centers = centers[:, :3]
    if radii.shape not in ((), (len(centers),)):
        message = f"radii must be one number or ({len(centers)},), found {radii.shape}"
        raise SceneError(message, where=where(shape))
    rows_ = np.empty((len(centers), 4), np.float32)
    moved = not np.array_equal(matrix, transforms.IDENTITY)
    with np.errstate(over="ignore"):
        rows_[:, :3] = transforms.transform_points(matrix, centers) if moved else centers
        rows_[:, 3] = radii * scale
    _check(shape, rows_)
    return rows_


def keyed(shape: Spheres, times: Sequence[float]) -> Balls:
    """Return what `balls` does at k times [s], (n, k, 4): those of a sphere side by side."""
    if shape.deformation is None:
        return np.repeat(balls(shape)[:, None], len(times), axis=1)
    at_all = []
    for time in times:
        try:
            at_all.append(balls(shape.at_time(time)))
        except SceneError as error:
            place = f"{where(shape)}.deformation"
            raise SceneError(f"at {time:g} s: {error.message}", where=place) from None
    return np.stack(at_all, axis=1)


def common(shape: Shape) -> Words:
    """Return the row of `geometry` of all: a sphere of radius 1 before `to_world`."""
    return row(shape)


def rows(shape: Shape, placed: Balls) -> Words:
    """Return a row of `geometry` for each of the balls of a shape, (n, words) uint32."""
    words = np.tile(common(shape), (len(placed), 1))
    center, radius = (member("sphere", name) for name in ("center", "radius"))
    words[:, center : center + 3] = placed[:, :3].view(np.uint32)
    words[:, radius] = placed[:, 3].view(np.uint32)
    return words


def swept(placed: Balls) -> NDArray[np.float32]:
    """Return a box (n, 2, 3) around the way of each sphere (n, k, 4), linear between keys."""
    at_all = np.stack([boxes([placed[:, key]]) for key in range(placed.shape[1])])
    return np.stack([at_all[:, :, 0].min(axis=0), at_all[:, :, 1].max(axis=0)], axis=1)


def boxes(placed: Sequence[Balls]) -> NDArray[np.float32]:
    """Return a box around each of the balls of all shapes, (n, 2, 3) float32."""
    whole = np.concatenate([np.zeros((0, 4), np.float32), *placed])
    centers, radii = whole[:, :3], whole[:, 3]
    reach = np.maximum(2.0 * radii, np.abs(centers).max(axis=1, initial=0.0) + radii)
    reach = (radii + np.float32(PADDING) * reach)[:, None]
    corners = np.empty((len(whole), 2, 3), np.float32)
    np.subtract(centers, reach, out=corners[:, 0])
    np.add(centers, reach, out=corners[:, 1])
    return corners


def _numbers(shape: Shape, name: str) -> NDArray[np.float32]:
    """A parameter as float32 on the host."""
    value = fields_of(shape)[name]
    try:
        return single(on_host(value))
    except (TypeError, ValueError) as error:
        raise SceneError(f"{name} are not numbers: {error}", where=where(shape)) from error


def _check(shape: Shape, placed: Balls) -> None:
    for wrong, form in (
        (~np.isfinite(placed[:, :3]).all(axis=1), "centers[{}] is not finite"),
        (~(np.isfinite(placed[:, 3]) & (placed[:, 3] > 0.0)), "radii[{}] must be above zero"),
        (np.abs(placed).max(axis=1) > FARTHEST, "centers[{}] or its radius is too large"),
    ):
        if wrong.any():
            at = int(np.argmax(wrong))
            message = f"{form.format(at)}: in the world it is {placed[at].tolist()}"
            raise SceneError(message, where=where(shape))
