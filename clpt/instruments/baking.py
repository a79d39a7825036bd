"""Light on the surface of a shape, at the texels of its uvs: lightmaps, and lux maps of a floor."""

from __future__ import annotations

import dataclasses
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, whole
from clpt.errors import SceneError
from clpt.geometry.triangles import triangulate
from clpt.instruments.interpolation import Surface
from clpt.instruments.measuring import LIFT, Measurement, Meter, measure
from clpt.instruments.quantities import QUANTITIES
from clpt.render.options import check_scene
from clpt.scene import Scene
from clpt.scene.shapes import Shape

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from clpt.instruments.measuring import MeasureOptions, MeterOptions

log = logging.getLogger(__name__)

MOST_TRIED = 1 << 22  # texels that are compared with triangles at once
WITHIN = 1e-6  # of a triangle, beyond its edges: texels on an edge belong to a side
PADDING = 2  # texels around a chart, which bilinear lookups of its edge read


@dataclass(frozen=True)
class Texels:
    """Points of a surface below the middles of texels.

    points [m], normals (n, 3) float64; covered (h, w) bool: which texels these are, row by row. As
    in every texture, the top row has the largest v.
    """

    points: Floats
    normals: Floats
    covered: NDArray[np.bool_]

    def picture(self, values: Floats, padding: int = PADDING) -> Floats:
        """Return values (n, ...) as a picture (h, w, ...); NaN beyond the surface.

        padding: rings of texels around it that get the mean of their neighbours.
        """
        picture = np.full((*self.covered.shape, *values.shape[1:]), np.nan)
        picture[self.covered] = values
        known = self.covered
        for _ in range(padding):
            grown, count = (_neighbours(each, known) for each in (picture, known.astype(float)))
            ring = (count > 0.0) & ~known
            picture[ring] = (grown[ring].T / count[ring]).T
            known = known | ring
        return picture


def texels(scene: Scene, name: str, size: tuple[int, int]) -> Texels:
    """Return points of a shape's surface at the texels of its uvs.

    name: of a rectangle, a cube or a mesh. size: width and height of the map [texels].

    Raises SceneError for a shape without uvs, and for uvs that leave 0 to 1.
    """
    width, height = (whole(side, 1, 1 << 14, where="size") for side in size)
    vertices, faces, shading, uvs = triangulate(_named(scene, name))
    if uvs is None:
        raise SceneError("has no uvs, so no texels", where=name)
    if uvs[faces].min() < -WITHIN or uvs[faces].max() > 1.0 + WITHIN:
        low, high = uvs[faces].min(), uvs[faces].max()
        raise SceneError(f"its uvs reach from {low:.3g} to {high:.3g}, not 0 to 1", where=name)
    places = uvs.astype(np.float64) * [width, -height] + [-0.5, height - 0.5]  # columns and rows
    owner, weights, overlaps = _owners(places[faces], width, height)
    if overlaps:
        log.warning("%s: %d texels belong to several triangles, the first counts", name, overlaps)
    covered = owner >= 0
    if not covered.any():
        raise SceneError(f"a map of {width}x{height} has no texel on it", where=name)
    corners = faces[owner[covered]]
    share = weights[covered][:, :, None]
    edges = vertices[corners].astype(np.float64)
    normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    if shading is not None:
        normals = (shading[corners] * share).sum(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Texels((edges * share).sum(axis=1), normals, covered)


def bake(
    scene: Scene,
    name: str,
    quantity: str = "irradiance",
    size: tuple[int, int] = (64, 64),
    *,
    padding: int = PADDING,
    **options: Unpack[MeasureOptions],
) -> Measurement:
    """Measure light on a shape's surface at the texels of its uvs.

    quantity: one at points, see `QUANTITIES`: of the hemisphere of the surface's normal, or of the
    whole sphere just above it. name, size: see `texels`; padding: see `Texels.picture`. Values and
    errors (h, w), or (h, w, bands), are NaN where nothing of the surface is. options: see
    `measure`, which raises the other errors; with `interpolate` most texels are interpolated.
    """
    check_scene(scene)
    if quantity in QUANTITIES and QUANTITIES[quantity].at != "points":
        raise SceneError(f"{quantity} is measured along rays", where="quantity")
    at = texels(scene, name, size)
    lifted = quantity in QUANTITIES and QUANTITIES[quantity].everywhere
    points = at.points + 2.0 * LIFT * at.normals if lifted else at.points
    step = whole(options.pop("interpolate", 1), 1, where="interpolate")
    if step == 1:
        measured = measure(scene, quantity, points, at.normals, **options)
    else:
        pictures = at.picture(points, 0), at.picture(at.normals, 0)
        surface = Surface(*pictures, at.covered)
        meter = Meter(scene, quantity, **cast("MeterOptions", options))
        measured = meter.measure_map(surface, step)
        measured = dataclasses.replace(measured.at(at.covered), measured=measured.measured)
    return dataclasses.replace(
        measured,
        values=at.picture(measured.values, padding),
        errors=at.picture(measured.errors, padding),
    )


def _named(scene: Scene, name: str) -> Shape:
    """Return the shape of a name. Raises SceneError."""
    named = [shape for shape in scene.shapes if shape.name == name]
    if len(named) != 1:
        known = ", ".join(sorted({shape.name for shape in scene.shapes if shape.name})) or "none"
        message = f"{len(named) or 'no'} shapes have the name {name!r}; names are: {known}"
        raise SceneError(message, where="texels")
    if named[0].kind not in ("mesh", "rectangle", "cube"):
        raise SceneError(f"a {named[0].kind} has no uvs of triangles, so no texels", where=name)
    return named[0]


def _owners(triangles: Floats, width: int, height: int) -> tuple[NDArray[np.int64], Floats, int]:
    """Return the first triangle (h, w) over each texel's middle, -1 for none.

    triangles (m, 3, 2): columns and rows of their corners. Also returns the weights (h, w, 3) of
    the corners, and how many texels several triangles cover with more than an edge.
    """
    owner, weights = np.full(height * width, -1), np.zeros((height * width, 3))
    inside = np.zeros(height * width, np.int64)
    low = np.maximum(np.ceil(triangles.min(axis=1) - WITHIN), 0.0).astype(np.int64)
    high = np.floor(triangles.max(axis=1) + WITHIN).astype(np.int64)
    spans = np.maximum(np.minimum(high, [width - 1, height - 1]) - low + 1, 0)
    counts = spans.prod(axis=1)
    order = np.flatnonzero(counts)
    for part in np.split(
        order, np.flatnonzero(np.diff(np.cumsum(counts[order]) // MOST_TRIED)) + 1
    ):
        which = np.repeat(part, counts[part])
        number = np.arange(len(which)) - np.repeat(
            np.cumsum(counts[part]) - counts[part], counts[part]
        )
        at = low[which] + np.column_stack([number % spans[which, 0], number // spans[which, 0]])
        shares = _barycentric(triangles[which], at.astype(np.float64))
        hit = (shares >= -WITHIN).all(axis=1)
        flat = at[:, 1] * width + at[:, 0]
        np.add.at(inside, flat[(shares > WITHIN).all(axis=1)], 1)
        flat, shares, which = flat[hit], shares[hit], which[hit]
        new, first = np.unique(flat, return_index=True)
        first = first[owner[new] < 0]
        owner[flat[first]], weights[flat[first]] = which[first], shares[first]
    form = height, width
    return owner.reshape(form), weights.reshape(*form, 3), int((inside > 1).sum())


def _barycentric(triangles: Floats, points: Floats) -> Floats:
    """Return weights (n, 3) of the corners of triangles (n, 3, 2) at points (n, 2)."""
    (ax, ay), (bx, by) = (
        (triangles[:, 1] - triangles[:, 0]).T,
        (triangles[:, 2] - triangles[:, 0]).T,
    )
    px, py = (points - triangles[:, 0]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        second = (px * by - py * bx) / (ax * by - ay * bx)
        third = (ax * py - ay * px) / (ax * by - ay * bx)
    return np.nan_to_num(np.column_stack([1.0 - second - third, second, third]), nan=-1.0)


def _neighbours(picture: Floats, known: NDArray[np.bool_]) -> Floats:
    """Return the sum of the eight neighbours of each texel that are known."""
    height, width = known.shape
    filled = np.where(known.reshape(*known.shape, *[1] * (picture.ndim - 2)), picture, 0.0)
    padded = np.pad(filled, [(1, 1), (1, 1), *[(0, 0)] * (picture.ndim - 2)])
    shifts = [(y, x) for y in range(3) for x in range(3) if (y, x) != (1, 1)]
    return np.asarray(sum(padded[y : y + height, x : x + width] for y, x in shifts))
