"""Many spheres in a single shape, as arrays on their way to the device.

All of them share a row of `shapes` and a row of `geometry` with their rotation; the table `spheres`
has four words for each: centre and radius in the world. Spheres with deformation have these words
for each key, and a word behind the row of `geometry` is their offset.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Balls, Words, on_host, single
from clpt.errors import SceneError
from clpt.geometry import analytic, shapes
from clpt.scene.params import fields_of
from clpt.scene.shapes import Shape, Spheres

FARTHEST = 1e38  # [m], of a centre or a radius: a box around them is float32


def balls(shape: Spheres) -> Balls:
    """Return centre and radius of every sphere in the world, (n, 4) float32 [m].

    Raises SceneError for arrays of other shapes, values that are not finite, radii not above zero,
    or a transform that stretches.
    """
    scale = float(common(shape).view(np.float32)[analytic.member("sphere", "radius")])
    matrix = shapes.placement(shape)
    centers = _numbers(shape, "centers")
    if centers.ndim != 2 or centers.shape[1] not in (3, 4) or not len(centers):
        message = f"centers must be (n, 3) or (n, 4), n at least one, found {centers.shape}"
        raise SceneError(message, where=shapes.where(shape))
    radii = centers[:, 3] if centers.shape[1] == 4 else _numbers(shape, "radii")
    centers = centers[:, :3]
    if radii.shape not in ((), (len(centers),)):
        message = f"radii must be one number or ({len(centers)},), found {radii.shape}"
        raise SceneError(message, where=shapes.where(shape))
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
            where = f"{shapes.where(shape)}.deformation"
            raise SceneError(f"at {time:g} s: {error.message}", where=where) from None
    return np.stack(at_all, axis=1)


def common(shape: Shape) -> Words:
    """Return the row of `geometry` of all: a sphere of radius 1 before `to_world`."""
    return analytic.row(shape)


def rows(shape: Shape, placed: Balls) -> Words:
    """Return a row of `geometry` for each of the balls of a shape, (n, words) uint32."""
    words = np.tile(common(shape), (len(placed), 1))
    center, radius = (analytic.member("sphere", name) for name in ("center", "radius"))
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
    reach = (radii + np.float32(analytic.PADDING) * reach)[:, None]
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
        raise SceneError(f"{name} are not numbers: {error}", where=shapes.where(shape)) from error


def _check(shape: Shape, placed: Balls) -> None:
    for wrong, form in (
        (~np.isfinite(placed[:, :3]).all(axis=1), "centers[{}] is not finite"),
        (~(np.isfinite(placed[:, 3]) & (placed[:, 3] > 0.0)), "radii[{}] must be above zero"),
        (np.abs(placed).max(axis=1) > FARTHEST, "centers[{}] or its radius is too large"),
    ):
        if wrong.any():
            at = int(np.argmax(wrong))
            message = f"{form.format(at)}: in the world it is {placed[at].tolist()}"
            raise SceneError(message, where=shapes.where(shape))
