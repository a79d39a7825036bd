"""Mean brightness of an emitter's texture over each triangle, to choose among triangles by it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.render.lights.power import brightness
from clpt.render.spectra.look import Look
from clpt.scene.textures import Bitmap, Checkerboard, MeshAttribute, Mix, Product, Texture

LOOKS = 1 << 18  # at a texture, all triangles together
FEWEST, MOST = 16, 1024  # of them for one triangle
LEAST = 0.02  # of the texture's mean: a triangle that looks dark may yet hold a bright texel
_GOLDEN = np.array([0.7548776662466927, 0.5698402909980532])  # Roberts' sequence R2 (2018)


def triangle_means(
    value: object,
    look: Look,
    uvs: NDArray[np.float32] | None,
    faces: NDArray[Any],
    attributes: Mapping[str, NDArray[np.float32]] = MappingProxyType({}),
) -> Floats:
    """Return the mean brightness of an emission over triangles (m, 3), as (m,).

    uvs (n, 2): of the vertices; None: the barycentrics stand for them, as in
    kernels/lights/area.cl.
    look: of the film; attributes: the values (m, k) of each triangle, of those that the emission
    reads by face.
    """
    mean = brightness(value, look)
    if not isinstance(value, Texture):
        return np.full(len(faces), mean)
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    given = np.tile(corners, (len(faces), 1, 1)) if uvs is None else np.asarray(uvs, float)[faces]
    count = int(np.clip(LOOKS // max(len(faces), 1), FEWEST, MOST))
    u = np.modf(0.5 + np.arange(count)[:, None] * _GOLDEN)[0]
    root = np.sqrt(u[:, 0])
    weights = np.stack([1.0 - root, root * (1.0 - u[:, 1]), root * u[:, 1]], axis=1)
    places = np.einsum("kc,mcd->mkd", weights, given)
    edges = given[:, 1:] - given[:, :1]
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    found = looked_up(value, look, places, area / count, attributes).mean(axis=1)
    return np.maximum(found, LEAST * mean)


def looked_up(
    value: object,
    look: Look,
    uv: Floats,
    area: Floats,
    attributes: Mapping[str, NDArray[np.float32]],
) -> Floats:
    """Return the brightness of a value at uv (m, k, 2); area (m,): of uv that a look stands for.

    A kind of texture that is not known here has its mean everywhere.
    """
    if isinstance(value, MeshAttribute) and value.name in attributes:
        means = attributes[value.name].mean(axis=1, dtype=np.float64)
        return np.broadcast_to(np.maximum(means, 0.0)[:, None], uv.shape[:2])
    if isinstance(value, Product):
        first, second = (
            looked_up(v, look, uv, area, attributes) for v in (value.first, value.second)
        )
        return first * second
    if isinstance(value, Mix):
        share = looked_up(value.amount, look, uv, area, attributes)
        first, second = (
            looked_up(v, look, uv, area, attributes) for v in (value.first, value.second)
        )
        return (1.0 - share) * first + share * second
    if isinstance(value, (Bitmap, Checkerboard)):
        matrix = value.to_uv / value.to_uv[2, 2]
        there = uv @ matrix[:2, :2].T + matrix[:2, 2]
        if isinstance(value, Bitmap):
            return _bitmap(value, look, there, area * abs(np.linalg.det(matrix[:2, :2])))
        same = np.equal(*np.moveaxis(there % 1.0 < 0.5, -1, 0))
        first, second = (
            looked_up(v, look, uv, area, attributes) for v in (value.color0, value.color1)
        )
        return np.where(same, first, second)
    known = value if isinstance(value, (int, float)) else brightness(value, look)
    return np.full(uv.shape[:2], float(known))


def _bitmap(texture: Bitmap, look: Look, uv: Floats, area: Floats) -> Floats:
    """Looks at an image that is averaged over as many texels as one of them stands for."""
    level = look.levels(texture)
    texels = area * level.size
    steps = np.ceil(0.5 * np.log2(np.maximum(texels, 1.0))).astype(np.int64)
    found = np.empty(uv.shape[:2])
    for step in range(int(steps.max(initial=0)) + 1):
        own = steps == step
        if own.any():
            found[own] = _nearest(texture, level, uv[own])
        level = _halved(level)
    return found


def _halved(image: Floats) -> Floats:
    """An image of half the size, the last row and column taken twice where they are odd."""
    height, width = image.shape
    even = np.pad(image, ((0, height % 2 * (height > 1)), (0, width % 2 * (width > 1))), "edge")
    if height > 1:
        even = 0.5 * (even[::2] + even[1::2])
    return even if width == 1 else 0.5 * (even[:, ::2] + even[:, 1::2])


def _nearest(texture: Bitmap, image: Floats, uv: Floats) -> Floats:
    """Texels (m, k) at uv (m, k, 2), v = 0 at the bottom row."""
    inside = np.ones(uv.shape[:2], bool)
    at = []
    wraps = (texture.wrap, texture.wrap_v or texture.wrap)
    for axis, (wrap, size) in enumerate(zip(wraps, image.shape[::-1], strict=True)):
        x = uv[..., axis] if axis == 0 else 1.0 - uv[..., axis]
        if wrap == "zero":
            inside &= (x >= 0.0) & (x <= 1.0)
        elif wrap == "repeat":
            x = x % 1.0
        elif wrap == "mirror":
            x = 1.0 - np.abs(x % 2.0 - 1.0)
        at.append(np.clip(np.floor(x * size), 0, size - 1).astype(np.int64))
    return np.where(inside, image[at[1], at[0]], 0.0)
