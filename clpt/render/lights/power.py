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
from clpt.scene.texture_values import brightness_at, is_texture, mean


def power(lamp: Light, strength: float, scene_radius: float, look: Look) -> float:
    """Estimate the power of a light off all shapes in the scene, mean of channels [W/nm].

    strength: the mean of its intensity, irradiance or radiance.
    """
    declared = params(type(lamp)).get("image")
    passes = declared is not None and declared.role is REFLECTANCE
    image_mean = mean(fields_of(lamp)["image"], look) if passes else 1.0
    return lamp.sampling_power(strength, scene_radius, image_mean)


def importance(lamp: Light, strength: float, power: float) -> float:
    """Return the weight of a light off all shapes in a light tree.

    A small flat light of power P gives an irradiance of P / pi at a metre, so the irradiance of a
    light without a place counts pi times.
    """
    if lamp.reach == "placed" and lamp.falloff:
        return power
    return np.pi * strength * (np.pi if lamp.reach == "infinite" else 1.0)


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
    if not is_texture(value):
        return np.full(len(faces), mean(value, look))
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
    means = brightness_at(value, look, places, area / count, attributes).mean(axis=1)
    return np.maximum(means, LEAST * mean(value, look))
