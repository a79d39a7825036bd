"""Power, importance and brightness of lights, before any has a row in the tables."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.render.spectra.look import Look
from clpt.scene.lights import Light
from clpt.scene.params import fields_of, params
from clpt.scene.roles import REFLECTANCE
from clpt.scene.textures import (
    Bitmap,
    Checkerboard,
    Dots,
    MeshAttribute,
    Mix,
    Product,
    Solid,
    Texture,
)


def power(lamp: Light, strength: float, scene_radius: float, look: Look) -> float:
    """Estimate the power of a light off all shapes in the scene, mean of channels [W/nm].

    strength: the mean of its intensity, irradiance or radiance.
    """
    declared = params(type(lamp)).get("image")
    passes = declared is not None and declared.role is REFLECTANCE
    image_mean = brightness(fields_of(lamp)["image"], look) if passes else 1.0
    return lamp.sampling_power(strength, scene_radius, image_mean)


def importance(lamp: Light, strength: float, power: float) -> float:
    """Return the weight of a light off all shapes in a light tree.

    A small flat light of power P gives an irradiance of P / pi at a metre, so the irradiance of a
    light without a place counts pi times.
    """
    if lamp.reach == "placed" and lamp.falloff:
        return power
    return np.pi * strength * (np.pi if lamp.reach == "infinite" else 1.0)


def brightness(value: Any, look: Look) -> float:
    """Return the brightness of an emission, its mean over a texture; see `Look.brightness`."""
    if isinstance(value, Bitmap):
        return float(look.levels(value).mean())
    if isinstance(value, Checkerboard):
        return 0.5 * (brightness(value.color0, look) + brightness(value.color1, look))
    if isinstance(value, (MeshAttribute, Solid, Dots)):
        return 0.5  # whatever it is: this only shares out samples
    if isinstance(value, Product):
        return brightness(value.first, look) * brightness(value.second, look)
    if isinstance(value, Mix):
        amount = value.amount
        share = amount if isinstance(amount, float) else brightness(amount, look)
        first, second = (brightness(part, look) for part in (value.first, value.second))
        return (1.0 - share) * first + share * second
    return look.brightness(value)


LOOKS = 1 << 18  # at a texture, all triangles together
FEWEST, MOST = 16, 1024  # of them for a triangle
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

    look: of the film; uvs (n, 2): of the vertices; None: uv are barycentrics, as in
    kernels/lights/area.cl; attributes: values (m, k) of the mesh attributes that the emission
    reads by face.
    """
    mean = brightness(value, look)
    if not isinstance(value, Texture):
        return np.full(len(faces), mean)
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    corner_uvs = (
        np.tile(corners, (len(faces), 1, 1)) if uvs is None else np.asarray(uvs, float)[faces]
    )
    count = int(np.clip(LOOKS // max(len(faces), 1), FEWEST, MOST))
    u = np.modf(0.5 + np.arange(count)[:, None] * _GOLDEN)[0]
    root = np.sqrt(u[:, 0])
    weights = np.stack([1.0 - root, root * (1.0 - u[:, 1]), root * u[:, 1]], axis=1)
    places = np.einsum("kc,mcd->mkd", weights, corner_uvs)
    edges = corner_uvs[:, 1:] - corner_uvs[:, :1]
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    means = looked_up(value, look, places, area / count, attributes).mean(axis=1)
    return np.maximum(means, LEAST * mean)


def looked_up(
    value: object,
    look: Look,
    uv: Floats,
    area: Floats,
    attributes: Mapping[str, NDArray[np.float32]],
) -> Floats:
    """Return the brightness of a value at uv (m, k, 2); area (m,): area in uv of a lookup.

    A kind of texture without a case here has its mean everywhere.
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
    """Return the brightness of an image, averaged over the area of a lookup."""
    level = look.levels(texture)
    texels = area * level.size
    steps = np.ceil(0.5 * np.log2(np.maximum(texels, 1.0))).astype(np.int64)
    values = np.empty(uv.shape[:2])
    for step in range(int(steps.max(initial=0)) + 1):
        at_step = steps == step
        if at_step.any():
            values[at_step] = _nearest(texture, level, uv[at_step])
        level = _halved(level)
    return values


def _halved(image: Floats) -> Floats:
    """Return an image of half the size; an odd last row or column is taken twice."""
    height, width = image.shape
    even = np.pad(image, ((0, height % 2 * (height > 1)), (0, width % 2 * (width > 1))), "edge")
    if height > 1:
        even = 0.5 * (even[::2] + even[1::2])
    return even if width == 1 else 0.5 * (even[:, ::2] + even[:, 1::2])


def _nearest(texture: Bitmap, image: Floats, uv: Floats) -> Floats:
    """Return texels (m, k) at uv (m, k, 2); v = 0 is the bottom row."""
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
