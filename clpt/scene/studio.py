"""Bounds of shapes, the camera that frames them, and the studio of a bare mesh.

A studio has a camera that frames the mesh, a backdrop, a warm and a cool light.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from clpt import spectra, transforms
from clpt.arrays import corners_of
from clpt.errors import SceneError
from clpt.scene import cameras, integrators, lights, shapes
from clpt.scene.cameras import Perspective
from clpt.scene.materials import Diffuse
from clpt.spectra import RGBIlluminant

Placed = list[tuple[NDArray[np.float64], NDArray[np.float64]]]  # see `grouped`
FOV = 35.0
EXACT = 1 << 25  # most points of instances that are transformed; else corners of boxes
CHUNK = 1 << 18  # points at a time
MARGIN = 1.05
FROM = (0.4, 0.35, 1.0)  # direction from the centre of the scene to the camera, +y up


def framing_camera(
    scene_shapes: Sequence[shapes.Shape],
    up: transforms.Matrix = transforms.IDENTITY,
    *,
    from_: Sequence[float] = FROM,
    top: Sequence[float] = (0.0, 1.0, 0.0),
    distance: float = 1.0,
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    placed: Placed | None = None,
) -> Perspective:
    """Return a camera that looks at the middle of shapes; together they fill its shorter side.

    from_: the direction from the shapes to the camera, the front and above by default; top: the
    upward direction in its picture, both before the rotation `up`; distance: a factor on the
    distance that frames all shapes; bounds and placed: `world_bounds` and `grouped` of the shapes,
    where they are known.
    Raises SceneError for shapes too large to be framed.
    """
    centre, radius = middle(*(bounds or world_bounds(scene_shapes)), where="the scene")
    upward = transforms.transform_vectors(up, top)
    view = transforms.look_at(direction(from_, up), np.zeros(3), upward)[:3, :3]
    all_seen = 1.5 * radius
    half_picture = np.tan(np.radians(FOV / 2.0))
    sides = [side * view[:, axis] / half_picture for axis in (0, 1) for side in (-1.0, 1.0)]
    placed = grouped(scene_shapes) if placed is None else placed
    for points in _outlines(scene_shapes, placed, np.array(sides) - view[:, 2]):
        local = (points - centre) @ view
        aside = np.abs(local[:, :2]).max(axis=1) / half_picture
        all_seen = max(all_seen, MARGIN * float(np.max(aside - local[:, 2])))
    origin = centre + distance * all_seen * direction(from_, up)
    return Perspective(
        to_world=transforms.look_at(origin, centre, upward),
        fov=FOV,
        fov_axis="smaller",
        near=1e-3 * min(distance, 1.0) * all_seen,
        far=1e3 * max(distance, 1.0) * all_seen,
    )


def world_bounds(
    scene_shapes: Sequence[shapes.Shape], placed: Placed | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and largest corner (3,) of all shapes in world space; a box for no shapes.

    For very many instances they bound the boxes of groups. placed: `grouped` of the shapes, where
    it is known.
    """
    boxes = [
        shape_bounds(shape) for shape in scene_shapes if not isinstance(shape, shapes.Instance)
    ]
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    for points in _instance_points(grouped(scene_shapes) if placed is None else placed, axes):
        boxes.append((points.min(axis=0), points.max(axis=0)))
    if not boxes:
        boxes = [(-np.ones(3), np.ones(3))]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def shape_bounds(shape: shapes.Shape) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and largest corner (3,) of a shape in world space."""
    matrix = np.asarray(shape.to_world, np.float64)
    linear = matrix[:3, :3]
    if isinstance(shape, shapes.Sphere):
        points = transforms.transform_points(matrix, np.atleast_2d(shape.center))
        reach = shape.radius * np.linalg.norm(linear, axis=1)
    elif isinstance(shape, shapes.Spheres):
        rows = np.asarray(shape.centers, np.float64)
        points = transforms.transform_points(matrix, rows[:, :3])
        radius = np.max(rows[:, 3] if rows.shape[1] == 4 else shape.radii)
        reach = radius * np.linalg.norm(linear, axis=1)
    elif isinstance(shape, shapes.Disk):
        points, reach = matrix[None, :3, 3], np.linalg.norm(linear[:, :2], axis=1)
    elif isinstance(shape, shapes.Cylinder):
        points = transforms.transform_points(matrix, np.stack([shape.p0, shape.p1]))
        axis = np.subtract(shape.p1, shape.p0) / np.linalg.norm(np.subtract(shape.p1, shape.p0))
        # A circle about the axis reaches r |row x axis| along each row of the matrix.
        reach = shape.radius * np.linalg.norm(np.cross(linear, axis), axis=1)
    elif isinstance(shape, shapes.Curves):
        rows = np.asarray(shape.points, np.float64)
        points = transforms.transform_points(matrix, rows[:, :3])
        reach = rows[:, 3].max() * np.linalg.norm(linear, axis=1)
    else:
        points, reach = transforms.transform_points(matrix, _corners(shape)), np.zeros(3)
    low, high = corners_of(points)
    return low - reach, high + reach


def _outlines(
    scene_shapes: Sequence[shapes.Shape], placed: Placed, directions: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    """Yield points (n, 3) in world space; no shape reaches farther along any direction (k, 3)."""
    for shape in scene_shapes:
        if not isinstance(shape, shapes.Instance):
            yield _hull(shape)
    yield from _instance_points(placed, directions)


def _hull(shape: shapes.Shape) -> NDArray[np.float64]:
    """Return points (n, 3) in world space whose hull contains a shape, no instance."""
    if isinstance(shape, shapes.Mesh):
        return transforms.transform_points(np.asarray(shape.to_world), shape.vertices)
    return _box_corners(*shape_bounds(shape))


def grouped(scene_shapes: Sequence[shapes.Shape]) -> Placed:
    """Return of each group its points (m, 3) and the places (n, 3, 4) of its instances."""
    instances: dict[int, list[shapes.Instance]] = {}
    for shape in scene_shapes:
        if isinstance(shape, shapes.Instance) and shape.group.shapes:
            instances.setdefault(id(shape.group), []).append(shape)
    return [
        (
            np.concatenate([_hull(shape) for shape in several[0].group.shapes]),
            np.array([shape.to_world for shape in several], np.float64)[:, :3],
        )
        for several in instances.values()
    ]


def _instance_points(
    placed: Placed, directions: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    """Yield points (n, 3) as `_outlines` does, of instances; of boxes of groups for very many."""
    for points, matrices in placed:
        matrices = matrices[_may_be_outermost(matrices, points, directions)]
        if len(points) * len(matrices) > EXACT:
            points = _box_corners(points.min(axis=0), points.max(axis=0))
        step = max(CHUNK // len(points), 1)
        for first in range(0, len(matrices), step):
            part = matrices[first : first + step]
            yield (points @ part[:, :, :3].transpose(0, 2, 1) + part[:, None, :, 3]).reshape(-1, 3)


def _may_be_outermost(
    matrices: NDArray[np.float64], points: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which matrices (n, 3, 4) may move points (m, 3) farthest along a direction (k, 3).

    Points reach at least as far as their mean does, and no farther than their box does.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    along = directions @ matrices  # (n, k, 4): a row is linear in the coordinates of a point
    least = along[:, :, :3] @ points.mean(axis=0) + along[:, :, 3]
    most = along[:, :, :3] @ ((low + high) / 2.0) + along[:, :, 3]
    most += np.abs(along[:, :, :3]) @ ((high - low) / 2.0)
    rounding = 1e-9 * np.abs(most).max()
    farthest: NDArray[np.bool_] = (most >= least.max(axis=0) - rounding).any(axis=1)
    return farthest


def _box_corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    return low + (high - low) * (_corners(shapes.Cube()) + 1.0) / 2.0


def _corners(shape: shapes.Shape) -> NDArray[np.float64]:
    if isinstance(shape, shapes.Mesh):
        return np.asarray(shape.vertices, np.float64)
    if isinstance(shape, shapes.SdfGrid):
        return np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    depth = (-1.0, 1.0) if isinstance(shape, shapes.Cube) else (0.0,)
    return np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in depth])


def middle(
    low: NDArray[np.float64], high: NDArray[np.float64], **location: Any
) -> tuple[NDArray[np.float64], float]:
    """Return the middle (3,) and the radius of a box. Raises SceneError if the radius overflows."""
    with np.errstate(over="ignore"):
        centre, radius = (low + high) / 2.0, _radius(low, high)
    if not np.isfinite(radius):
        raise SceneError("is too large to be framed", **location)
    return centre, radius


def _radius(low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return the radius of the sphere around a box; above zero, even around a point."""
    radius = float(np.linalg.norm(high - low)) / 2.0
    return radius if radius > 0.0 else max(1.0, float(np.abs(low).max()))


def direction(from_: Sequence[float], up: transforms.Matrix) -> NDArray[np.float64]:
    """Return a direction (3,) of unit length after the rotation `up`."""
    turned = transforms.transform_vectors(up, from_)
    return turned / np.linalg.norm(turned)


Up = Literal["y", "z"]

BELOW = 1e-3  # radii from the shapes down to the ground: flat shapes do not lie in it
KEY_FROM = (-0.8, 1.3, 0.7)  # direction from the centre of the scene to the key light, +y up
KEY_IRRADIANCE = RGBIlluminant(4.6, 3.9, 3.1)  # at the centre, warm
FILL = RGBIlluminant(0.26, 0.33, 0.42)  # radiance from all sides, cool
PAPER = 0.36  # albedo of the backdrop
FLOOR, BEND, WALL = 24.0, 12.0, 40.0  # radii of the backdrop's floor and bend, and its height
SIDES, RINGS = 96, 17  # of the backdrop around its middle, and along its bend
Z_UP = transforms.rotate([1.0, 0.0, 0.0], 90.0)
# From a space whose up is +y and whose front is +z.
UPS: dict[str, transforms.Matrix] = {"y": transforms.IDENTITY, "z": Z_UP}


def parts(
    scene_shapes: Sequence[shapes.Shape],
    *,
    camera: cameras.Camera | None = None,
    own_lights: Sequence[lights.Light] = (),
    up: Up = "y",
) -> dict[str, Any]:
    """Return the arguments of a Scene of shapes; the studio adds a camera or lights if missing.

    Without lights it adds a constant light and a key light. The key light is a square above a
    ground if the camera is the studio's too, else a directional light. `extra["studio"]` counts
    what was added. Raises SceneError for shapes too large to be framed.
    """
    if up not in UPS:
        raise SceneError(f"{up!r} is none of {', '.join(UPS)}", where="up")
    turn = UPS[up]
    placed = grouped(scene_shapes)
    low, high = world_bounds(scene_shapes, placed)
    centre, radius = middle(low, high)
    extra_shapes: list[shapes.Shape] = []
    extra_lights: list[lights.Light] = []
    if not own_lights:
        extra_lights = [lights.Constant(radiance=FILL)]
        if camera is None:
            floor, axis = centre.copy(), int(np.argmax(turn[:3, 1]))
            floor[axis] = low[axis] - BELOW * radius
            extra_shapes = [_backdrop(floor, radius, turn), _key(centre, radius, turn)]
        else:
            extra_lights.append(_distant_key(turn))
    counts = {"shapes": len(extra_shapes), "lights": len(extra_lights)}
    added = {"camera": camera is None, **counts, "up": up}
    return {
        "camera": camera or framing_camera(scene_shapes, turn, bounds=(low, high), placed=placed),
        "shapes": [*scene_shapes, *extra_shapes],
        "lights": [*own_lights, *extra_lights],
        "film": integrators.Film(filter=integrators.Gaussian()),
        "extra": {"studio": added},
    }


def _backdrop(floor: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    """Return a dish: a floor around a point that curves up to a wall on all sides, without a seam.

    So the camera may stand anywhere within it, and sees no horizon.
    """
    turn = np.linspace(0.0, 0.5 * np.pi, RINGS)
    out = np.concatenate([[0.0], FLOOR + BEND * np.sin(turn), [FLOOR + BEND]])
    high = np.concatenate([[0.0], BEND * (1.0 - np.cos(turn)), [WALL]])
    around = 2.0 * np.pi * np.arange(SIDES) / SIDES
    points = np.stack(
        [
            np.outer(out, np.sin(around)),
            np.outer(high, np.ones(SIDES)),
            np.outer(out, np.cos(around)),
        ],
        axis=-1,
    )
    here = np.arange(len(out) - 1)[:, None] * SIDES + np.arange(SIDES)
    beside = np.arange(len(out) - 1)[:, None] * SIDES + (np.arange(SIDES) + 1) % SIDES
    inner = np.stack([here, here + SIDES, beside + SIDES], axis=-1)
    outer = np.stack([here, beside + SIDES, beside], axis=-1)[1:]  # none at the middle
    faces = np.concatenate([inner.reshape(-1, 3), outer.reshape(-1, 3)]).astype(np.uint32)
    return shapes.Mesh(
        vertices=points.reshape(-1, 3).astype(np.float32),
        faces=faces,
        normals=shapes.SMOOTH,
        to_world=transforms.translate(floor) @ up @ transforms.scale(radius),
        material=Diffuse(reflectance=PAPER),
        name="backdrop",
    )


def _distant_key(up: transforms.Matrix) -> lights.Light:
    """Return a light about as bright as the square light, from the same side."""
    return lights.Directional(direction=tuple(-direction(KEY_FROM, up)), irradiance=KEY_IRRADIANCE)


def _key(centre: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    """Return a square light of 3 radii, 4 radii away from the centre, that faces it."""
    origin = centre + 4.0 * radius * direction(KEY_FROM, up)
    to_world = transforms.look_at(origin, centre, up[:3, 1]) @ transforms.scale(1.5 * radius)
    return shapes.Rectangle(
        to_world=to_world,
        material=Diffuse(reflectance=0.0),
        emission=lights.Area(radiance=spectra.scaled(KEY_IRRADIANCE, 16.0 / 9.0)),
        name="key light",
    )
