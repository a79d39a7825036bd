"""Glare of a view: UGR and DGP, out of a picture of all directions.

UGR: CIE 117:1995. DGP: Wienold and Christoffersen 2006, of daylight. The position index above the
line of sight is Guth's by the formula of the IES (Levin 1975), below it Iwata and Tokura's (1997).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import device as dev
from clpt import transforms
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.instruments.quantities import QUANTITIES
from clpt.render.options import check_scene
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene.cameras import Spherical
from clpt.scene.integrators import Box

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from clpt.render.options import RenderOptions

# Independent pictures: their scatter is the standard error. Each has rays through other points of
# the pixels [pixels], which a source covers or not: a mean would lose luminance at its rim.
OFFSETS = [
    ((i + 0.5) / 8 - 0.5, (j + 0.5) / 8 - 0.5) for i, j in enumerate([0, 4, 2, 6, 1, 5, 3, 7])
]
BRIGHT = 5.0  # a source has at least this many times the mean luminance of the view


@dataclass(frozen=True)
class Glare:
    """Glare of a view, and standard errors.

    ugr: unified glare rating, -inf without a source; dgp: daylight glare probability, made for
    values of .2 to .8. illuminance: at the eye, across the view [lx]. background: mean luminance
    beside the sources, by the cosine [cd/m^2]. luminance (h, 2 h) [cd/m^2]: of all directions, as
    of the camera `spherical`; sources (h, 2 h): which pixels glare.
    """

    ugr: float
    ugr_error: float
    dgp: float
    dgp_error: float
    illuminance: float
    background: float
    luminance: Floats
    sources: NDArray[np.bool_]


def glare(
    scene: Scene,
    view: ArrayLike,
    *,
    threshold: float | None = None,
    height: int = 256,
    samples: int = 256,
    device: dev.Device | str | int | None = None,
    **options: Unpack[RenderOptions],
) -> Glare:
    """Return the glare of a view in a scene.

    view: from the eye to the world (4, 4), along +z, such as of `clpt.transforms.look_at`.
    threshold: luminance of a source [cd/m^2]; None: BRIGHT times the mean of the view. height: of
    the picture [pixels], which is twice as wide; a source must take some pixels. samples: of a
    pixel. device, options: see `clpt.Renderer`.

    Raises SceneError for a view that cannot be used, and as `clpt.Renderer` does.
    """
    check_scene(scene)
    if height < 2 or samples < len(OFFSETS):
        message = f"height must be at least 2, samples {len(OFFSETS)}, not {height} and {samples}"
        raise SceneError(message, where="glare")
    matrix = Spherical(to_world=np.asarray(view, np.float64)).rigid_matrix()
    film = QUANTITIES["luminance"].film(scene.film, 0)
    film = dataclasses.replace(
        film, width=2 * height, height=height, crop=None, filter=Box(radius=0.01),
        filtering="importance",
    )  # fmt: skip
    seen = dataclasses.replace(scene, camera=Spherical(to_world=matrix), film=film, noise=None)
    pictures = []
    with Renderer(seen, device, **options) as renderer:
        for part, (across, along) in enumerate(OFFSETS):
            turn = transforms.rotate([0, 1, 0], 180.0 / height * across)
            turn = turn @ transforms.rotate([1, 0, 0], 180.0 / height * along)
            renderer.update(camera=Spherical(to_world=matrix @ turn))
            renderer.reset(seed=scene.seed + part)
            renderer.run(samples // len(OFFSETS))
            pictures.append(QUANTITIES["luminance"].value(renderer.image().astype(float), film))
    return rated(np.array(pictures), threshold)


def rated(pictures: ArrayLike, threshold: float | None = None) -> Glare:
    """Return the glare of independent pictures (n, h, 2 h) [cd/m^2] of all directions.

    The view is along the pictures' middle. Errors come by the jackknife, NaN of one picture.
    """
    parts = np.asarray(pictures, np.float64)
    if parts.ndim != 3 or parts.shape[2] != 2 * parts.shape[1]:
        raise SceneError(f"must be (n, h, 2 h), not {parts.shape}", where="pictures")
    mean, count = parts.mean(axis=0), len(parts)
    directions, angles = _directions(parts.shape[1])
    ahead = directions[..., 2] > 0.0
    if threshold is None:
        threshold = BRIGHT * float((mean * angles)[ahead].sum() / angles[ahead].sum())
    rows = np.array([_sums(part, (part > threshold) & ahead, directions, angles) for part in parts])
    errors = np.full(2, np.nan)
    if count > 1:
        without = np.array([_ratings(*(rows.sum(axis=0) - row) / (count - 1)) for row in rows])
        with np.errstate(invalid="ignore"):
            squares = ((without - without.mean(axis=0)) ** 2).sum(axis=0)
        errors = np.sqrt((count - 1) / count * squares)
    strength, illuminance, background = rows.mean(axis=0)
    ugr, dgp = _ratings(strength, illuminance, background)
    return Glare(
        ugr, float(errors[0]), dgp, float(errors[1]), float(illuminance), float(background), mean,
        (mean > threshold) & ahead,
    )  # fmt: skip


def _directions(height: int) -> tuple[Floats, Floats]:
    """Return directions (h, 2 h, 3) of a view, x left and y up, and solid angles (h, 2 h) [sr]."""
    edges = np.linspace(0.0, np.pi, height + 1)
    polar = (edges[1:] + edges[:-1]) / 2.0
    longitude = (0.5 - (np.arange(2 * height) + 0.5) / (2 * height)) * 2.0 * np.pi
    sine = np.sin(polar)[:, None]
    parts = sine * np.sin(longitude), np.cos(polar)[:, None], sine * np.cos(longitude)
    bands = (np.cos(edges[:-1]) - np.cos(edges[1:])) * np.pi / height
    return np.stack(np.broadcast_arrays(*parts), -1), np.repeat(bands[:, None], 2 * height, 1)


def _sums(
    luminance: Floats, sources: NDArray[np.bool_], directions: Floats, angles: Floats
) -> tuple[float, float, float]:
    """Return the sum of L^2 w / P^2 of sources, the illuminance, and the background's luminance."""
    light = luminance * angles * np.maximum(directions[..., 2], 0.0)
    index = position_index(directions[sources])
    strength = (luminance[sources] ** 2 * angles[sources] / index**2).sum()
    return float(strength), float(light.sum()), float(light[~sources].sum() / np.pi)


def _ratings(strength: float, illuminance: float, background: float) -> tuple[float, float]:
    """Return UGR and DGP of the sums."""
    with np.errstate(divide="ignore"):
        ugr = float(8.0 * np.log10(0.25 * strength / max(background, 1e-300)))
    weighed = strength / max(illuminance, 1e-300) ** 1.87
    return ugr, 5.87e-5 * illuminance + 9.18e-2 * math.log10(1.0 + weighed) + 0.16


def position_index(directions: ArrayLike) -> Floats:
    """Return the position index (...) of directions (..., 3): x left, y up, z along the view."""
    d = np.asarray(directions, np.float64)
    across = np.hypot(d[..., 0], d[..., 1])
    sigma = np.degrees(np.arctan2(across, d[..., 2]))
    tau = np.degrees(np.arctan2(np.abs(d[..., 0]), np.abs(d[..., 1])))
    guth = np.exp(
        (35.2 - 0.31889 * tau - 1.22 * np.exp(-2.0 * tau / 9.0)) * 1e-3 * sigma
        + (21.0 + 0.26667 * tau - 0.002963 * tau**2) * 1e-5 * sigma**2
    )
    with np.errstate(divide="ignore"):
        ratio = np.minimum(across / np.maximum(d[..., 2], 1e-9), 3.0)
    iwata = 1.0 + np.where(ratio < 0.6, 0.8, 1.2) * ratio
    return np.asarray(np.where(d[..., 1] >= 0.0, guth, iwata))
