"""<volume>s of a Mitsuba scene: constants, and numbers on grids, brought to the points of a medium.

A grid of a surface is a texture by itself.

A medium of clpt has all its numbers at the points of a single lattice, and ends with its box. In
Mitsuba each volume has its own lattice, and continues beyond the lattice with its outermost
values; a heterogeneous medium ends with the box of `sigma_t`, a homogeneous medium does not end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.formats import volumes
from clpt.formats.mitsuba.properties import Context, Properties
from clpt.formats.mitsuba.xml import Element
from clpt.scene.textures import Voxels
from clpt.scene.volumes import Volume, resampled

Bounds = tuple[NDArray[np.float64], NDArray[np.float64]]
THICKER = 3  # an odd multiple: the points of the coarser lattice are among those of the finer
MOST_POINTS = 1 << 23  # of a lattice that is refined or enlarged to match another lattice


def grid(props: Properties, name: str) -> Element | None:
    """Take a <volume> of the type `gridvolume`, if that is what a parameter is."""
    child = props.named.get(name)
    volume = None if child is None else props.context.resolve(child)
    if volume is None or volume.tag != "volume" or volume.type != "gridvolume":
        return None
    props.take(name)
    return volume


def one_channel(element: Element, context: Context) -> Volume:
    """Return the numbers of a grid with a single channel."""
    return _kept("numbers", element, context, _one_channel)


def _one_channel(element: Element, context: Context) -> Volume:
    result = channels(element, context)
    if result.values.shape[3] != 1:
        raise element.error(f"its file has {result.values.shape[3]} channels; read is 1")
    return Volume(result.values[..., 0], result.to_world)


def colours(element: Element, context: Context) -> Volume:
    """Return an albedo at each point of a grid, (nx, ny, nz, 3), clamped to 1 with a warning."""
    return _kept("colours", element, context, _colours)


def _colours(element: Element, context: Context) -> Volume:
    result = channels(element, context)
    if result.values.max() > 1.0:
        context.warn(element, "its albedo exceeds 1 somewhere; it is clamped")
    values = np.minimum(result.values, np.float32(1.0))
    return Volume(np.repeat(values, 3 // values.shape[3], axis=3), result.to_world)


def channels(element: Element, context: Context) -> Volume:
    """Return the numbers of a grid (nx, ny, nz, 1 or 3) of a medium."""
    return _kept("channels", element, context, _channels)


def _channels(element: Element, context: Context) -> Volume:
    volume, smoothing, wrap = _kept("grid", element, context, _read)
    if wrap != "clamp":
        context.warn(element, "at its ends the grid goes on as 'clamp'")
    if smoothing != "trilinear":
        context.warn(element, "the grid is trilinear, not 'nearest'")
    return volume


def voxels(element: Element, context: Context) -> Voxels:
    """Return the texture of a surface that a grid is, the same for all references."""
    return _kept("voxels", element, context, _voxels)


def _voxels(element: Element, context: Context) -> Voxels:
    volume, smoothing, wrap = _kept("grid", element, context, _read)
    with element.locating():
        return Voxels(values=volume, filter=smoothing, wrap=wrap)


def _kept(
    label: str, element: Element, context: Context, make: Callable[[Element, Context], Any]
) -> Any:
    """Make something of a grid once, so that all references to the grid share its arrays."""
    key = label, id(element)
    if key not in context.volumes:
        context.volumes[key] = make(element, context)
    return context.volumes[key]


def _read(element: Element, context: Context) -> tuple[Volume, str, str]:
    """Return a grid (nx, ny, nz, 1 or 3), and how it goes on between its points and outside."""
    props = Properties(element, context)
    props.ignore("raw", "accel")
    to_world, array = props.placement(), props.array("data", "grid")
    if array is None:
        path = props.file()
        with element.locating():
            values, box = volumes.read_channels(path)
    else:  # (z, y, x) or (z, y, x, channels), as Mitsuba's tensors
        values, box = (
            (array if array.ndim == 4 else array[..., None]).transpose(2, 1, 0, 3),
            np.eye(4),
        )
    if props.flag("use_grid_bbox", context.old):  # 0.6: src/volume/gridvolume.cpp
        to_world = to_world @ box
    wrap = props.text("wrap_mode", "clamp", ("clamp", "repeat", "mirror"))
    smoothing = props.text("filter_type", "trilinear", ("trilinear", "nearest"))
    props.finish()
    if values.shape[3] not in (1, 3):
        raise element.error(f"its file has {values.shape[3]} channels; read are 1 and 3")
    if (least := float(np.min(values, initial=0.0))) < 0.0:
        context.warn(element, f"the grid is negative somewhere, down to {least:.3g}: 0 counts")
        values = np.maximum(values, 0)
    return Volume(values, to_world), smoothing, wrap


def even_box(props: Properties, name: str) -> NDArray[np.float64]:
    """Return the box (4, 4) of a parameter that is the same everywhere, and warn of the unit cube.

    That is the box of a heterogeneous medium: a number, or a <volume> without `to_world`, has the
    unit cube from (0, 0, 0) to (1, 1, 1).
    """
    child = props.named.get(name)
    target = props.element if child is None else props.context.resolve(child)
    if target.tag == "volume":
        inner = Properties(target, props.context)
        if "to_world" in inner.named:
            return inner.placement()
    message = (
        f"as in Mitsuba it fills the unit cube alone: {name!r} is a <volume> without to_world, "
        "or none"
    )
    props.context.warn(props.element, message)
    return np.eye(4)


def together(first: Volume, *others: Volume) -> list[Volume]:
    """Return grids resampled at the points of a common lattice in the box of the first grid.

    Beyond its box a grid has its outermost values. The result is exact if all share a box and each
    axis has equal numbers of points, or 1. Else the lattice is finer, up to MOST_POINTS.
    """
    box = np.asarray(first.to_world, float)
    size = np.array(first.values.shape[:3])
    wanted, thicker = size.copy(), np.zeros(3, bool)
    for other in others:
        there = np.linalg.inv(np.asarray(other.to_world, float)) @ box
        its = np.array(other.values.shape[:3])
        across = np.ceil(np.abs(there[:3, :3]).T @ its - 1e-6).astype(int)
        fits = np.allclose(there, np.eye(4), 1e-6, 1e-9) & (
            (its == size) | (its == 1) | (size == 1)
        )
        thicker |= ~fits
        wanted = np.maximum(wanted, across)
    finer = np.where(thicker, THICKER * wanted, wanted)
    size = finer if np.prod(finer) <= MOST_POINTS else wanted
    if np.prod(size) > MOST_POINTS:
        size = np.array(first.values.shape[:3])
    shape = tuple(int(n) for n in size)
    return [
        item
        if item.values.shape[:3] == shape and np.allclose(item.to_world, box, 1e-6, 1e-9)
        else Volume(resampled(item.values, item.to_world, shape, box, hold=True), box)
        for item in (first, *others)
    ]


def spread(entries: Volume, bounds: Bounds, element: Element) -> Volume:
    """Return a grid whose box holds those bounds too: beyond its own it goes on as at its ends.

    Raises SceneError where that takes too many points.
    """
    low, high = bounds
    corners = np.array([[low[0], high[0]], [low[1], high[1]], [low[2], high[2]]])
    points = np.stack(np.meshgrid(*corners, indexing="ij"), axis=-1).reshape(-1, 3)
    size = np.array(entries.values.shape[:3])
    inner = transforms.transform_points(np.linalg.inv(entries.to_world), points) * size
    before = np.ceil(np.maximum(-inner.min(axis=0), 0.0) - 1e-4)
    after = np.ceil(np.maximum(inner.max(axis=0) - size, 0.0) - 1e-4)
    if np.prod(size + before + after) > MOST_POINTS:
        message = "its grid is too fine for so large a shape: make the shape smaller, or its box"
        raise element.error(message)
    pairs = [(int(a), int(b)) for a, b in zip(before, after, strict=True)]
    values = np.pad(entries.values, [*pairs, *[(0, 0)] * (entries.values.ndim - 3)], "edge")
    larger = transforms.translate(-before / size) @ transforms.scale((size + before + after) / size)
    return Volume(values, np.asarray(entries.to_world, float) @ larger)


def density(element: Element, context: Context) -> tuple[Any, Volume, Volume | None]:
    """Return `sigma_t` of a grid: a colour, a density, and colours on the grid where they vary."""
    result: tuple[Any, Volume, Volume | None] = _kept("density", element, context, _density)
    return result


def _density(element: Element, context: Context) -> tuple[Any, Volume, Volume | None]:
    result = channels(element, context)
    if result.values.shape[3] == 1:
        return 1.0, Volume(result.values[..., 0], result.to_world), None
    sigma_t, numbers, tints = volumes.factored(result.values)
    placed = None if tints is None else Volume(tints, result.to_world)
    return sigma_t, Volume(numbers, result.to_world), placed


def ones(to_world: Any, shape: Sequence[int] = (1, 1, 1)) -> Volume:
    """Return a density of 1 in a box."""
    return Volume(np.ones(tuple(shape), np.float32), to_world)
