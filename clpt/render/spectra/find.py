"""The density of sampled wavelengths over the range of the film's response, and looks of lights.

Visible importance, in closed form, suits smooth lights and the sensor of an eye. For line spectra,
sensors beyond the visible range and films with bands a density is tabulated from the sensor and the
scene's lights. All densities are unbiased; they differ in noise.

A look is the importance of lights to a film, from their spectra or their colours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.arrays import Floats
from clpt.files import budget
from clpt.images import spectral_exr
from clpt.records import DENSITY_SIZES
from clpt.render.film.colour import sensor
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.scene import Film
from clpt.scene.materials import Material, parts
from clpt.scene.params import fields_of, params
from clpt.scene.roles import EMISSION
from clpt.scene.textures import Bitmap
from clpt.scene.values import is_texture
from clpt.spectra import Spectrum
from clpt.spectra.reradiation import Reradiation
from clpt.spectra.spectrum import d65, gridded

STEP = 1.0  # largest distance of the nodes of a table [nm]
LIGHTS, SENSOR = 0.5, 0.45  # shares of a table; the remaining share is even over the range
WORTH = 2.2  # least ratio of second moments, without and with a table, that is worth its time
GUIDES = DENSITY_SIZES["guides"]


@dataclass(frozen=True)
class Density:
    """A density of wavelengths between lo and hi [nm]; zero outside.

    values: at nodes (n + 1,) with equal distances, linear between them, with the integral 1; None
    for visible importance, which needs no table.
    """

    lo: float
    hi: float
    values: Floats | None = None

    def pdf(self, lambdas: ArrayLike) -> Floats:
        """Return the density [1/nm] at `lambdas` [nm]."""
        if self.values is None:
            return spectra.wavelength_pdf(lambdas, self.lo, self.hi)
        return np.interp(np.asarray(lambdas, np.float64), self.nodes, self.values, 0.0, 0.0)

    @property
    def nodes(self) -> Floats:
        """The wavelengths of a table's values [nm]."""
        count = 2 if self.values is None else len(self.values)
        return np.linspace(self.lo, self.hi, count)

    def words(self) -> NDArray[np.float32]:
        """Return the table for kernels/spectra/wavelengths.cl: n, lo, step, sums, values, guide.

        The sums (n + 1) are the cumulative distribution at the nodes. The guide (GUIDES + 1) has
        the first cell of each equal share; a search begins there.
        """
        if self.values is None:
            raise ValueError("visible importance has no table")
        step = (self.hi - self.lo) / (len(self.values) - 1)
        cells = (self.values[1:] + self.values[:-1]) / 2.0 * step
        sums = np.concatenate([[0.0], np.cumsum(cells)])
        sums = np.minimum(sums, 1.0).astype(np.float32)
        shares = np.arange(GUIDES + 1) / GUIDES
        guide = np.clip(np.searchsorted(sums, shares, "right") - 1, 0, len(cells) - 1)
        head = [len(cells), self.lo, step]
        return np.concatenate([head, sums, self.values, guide]).astype(np.float32)


def density(index: SceneIndex) -> Density:
    """Return the density that `Film.wavelengths` names or, by default, that suits the scene."""
    film = index.film
    lo, hi = _support(film)
    visible = Density(lo, hi)
    nodes = np.linspace(lo, hi, int(np.ceil((hi - lo) / STEP - 1e-9)) + 1)
    if film.wavelengths == "visible":
        return Density(lo, hi, _normalised(visible.pdf(nodes), nodes)) if film.bands else visible
    response = np.ones_like(nodes) if film.bands else np.abs(sensor(film).sample(nodes)).sum(axis=1)
    glow, absorbed = _glow(index, nodes)
    emitted = [
        (gridded(light, nodes) + glow @ gridded(light, absorbed)) * response
        for light in emissions(index)
    ]
    emitted = [light for light in emitted if light.any()]
    shares = [(1.0 - LIGHTS - SENSOR, np.ones_like(nodes))]
    shares += [(SENSOR, response)] if response.any() else []
    shares += [(LIGHTS / len(emitted), light) for light in emitted]
    mixed = np.sum([share * _normalised(values, nodes) for share, values in shares], axis=0)
    table = Density(lo, hi, _normalised(mixed, nodes))
    if film.wavelengths == "auto" and not film.bands:
        gains = [_second_moment(visible, nodes, light) for light in emitted or [response]]
        costs = [_second_moment(table, nodes, light) for light in emitted or [response]]
        if all(gain < WORTH * cost for gain, cost in zip(gains, costs, strict=True)):
            return visible
    return table


def _support(film: Film) -> tuple[float, float]:
    """Return the range [nm] of the film's response, in whole steps."""
    if film.bands:
        return film.lambda_min, film.lambda_max
    nodes = np.append(np.arange(film.lambda_min, film.lambda_max, STEP), film.lambda_max)
    responding = np.flatnonzero(sensor(film).sample(nodes).any(axis=1))
    if not len(responding):
        return film.lambda_min, film.lambda_max
    return float(nodes[max(responding[0] - 1, 0)]), float(
        nodes[min(responding[-1] + 1, len(nodes) - 1)]
    )


def _second_moment(density: Density, nodes: Floats, light: Floats) -> float:
    """Return the second moment of an estimate of the integral of `light` from a single wavelength.

    light: (n,) at nodes (n,) [nm].
    """
    return _integral(light**2 / density.pdf(nodes), nodes)


def _integral(values: Floats, nodes: Floats) -> float:
    """Return the integral of a function that is linear between nodes."""
    budget.check_time()
    return float(((values[1:] + values[:-1]) / 2.0) @ np.diff(nodes))


def _normalised(values: Floats, nodes: Floats) -> Floats:
    return values / _integral(values, nodes)


def _glow(index: SceneIndex, nodes: Floats) -> tuple[Floats, Floats]:
    """Return the reradiation of all materials and media (n, m), and its absorbed wavelengths (m,).

    The matrix times the light at the absorbed wavelengths [nm] is the emission at the nodes (n,).
    """
    film = index.film
    cells = int(np.ceil((film.lambda_max - film.lambda_min) / STEP - 1e-9))
    absorbed = np.linspace(film.lambda_min, film.lambda_max, cells + 1)
    matrices = {id(m): m for shape in index.shapes for m in _fluorescent(shape.material)}
    for medium in (part for whole in index.media for part in whole.parts):
        dyes = (medium.dye, *(leaf.reradiation for leaf in medium.phase.leaves))
        matrices |= {id(m): m for m in dyes if m is not None}
    total = np.zeros((len(nodes), len(absorbed)))
    for matrix in matrices.values():
        total += (absorbed[1] - absorbed[0]) * matrix.sample(nodes[:, None], absorbed[None, :])
    return total, absorbed


def _fluorescent(material: Material) -> Iterator[Reradiation]:
    """Yield the reradiation matrices of a material and of the materials inside it."""
    for part in parts(material):
        yield from (v for v in fields_of(part).values() if isinstance(v, Reradiation))


def emissions(index: SceneIndex) -> Iterator[Spectrum]:
    """Yield the emissions of a scene's lights; an image of colours stands for D65."""
    sources: list[Any] = [
        *index.lights,
        *(shape.emission for shape in index.shapes),
        index.integrator,
    ]
    for source in sources:
        if source is None:
            continue
        declared = params(type(source))
        if "image" in declared and declared["image"].role.place == "host":
            yield _mean(source.image, f"{source.kind}.image")
        for name, param in declared.items():
            if param.role is EMISSION:
                yield _emitted(fields_of(source)[name])
    yield from (medium.light for medium in index.emitting if medium.light is not None)


def _emitted(value: Any) -> Spectrum:
    """Return an emission as a spectrum; a texture's mean."""
    if is_texture(value):
        return _mean(fields_of(value).get("image"), f"{value.kind}.image")
    return cast(Spectrum, value)


def _mean(image: object, where: str) -> Spectrum:
    """Return the mean of an image of spectra; D65 for an image of colours."""
    spectra_of = spectral_exr.find(image, emissive=True, where=where)
    if spectra_of is None:
        return d65()
    return spectra_of.spectrum(np.nan_to_num(spectra_of.values.mean(axis=(0, 1), dtype=np.float64)))


UNSEEN = 0.1  # factor of mean power in the film's range, beside the mean of the colour
LOOK_STEP = 1.0  # approximate distance of the wavelengths of that mean [nm]


@dataclass(frozen=True)
class Look:
    """The weights of lights for a film.

    spectral: by spectra from lo to hi [nm], or else by colours; cache: of costly results; unseen:
    factor of the mean power in that range, which also counts light without a visible colour.
    """

    spectral: bool
    lo: float
    hi: float
    cache: LoweringCache = field(default_factory=LoweringCache)
    unseen: float = UNSEEN

    @classmethod
    def of(cls, film: Film, cache: LoweringCache | None = None) -> Look:
        """Return the look of a film; with bands or a sensor, all wavelengths count equally."""
        unseen = 1.0 if film.bands or film.sensor != "cie1931" else UNSEEN
        range_ = film.lambda_min, film.lambda_max
        return cls(film.mode == "spectral", *range_, cache or LoweringCache(), unseen)

    @property
    def grid(self) -> Floats:
        """The wavelengths (n,) of the mean power, evenly spaced from lo to hi [nm]."""
        return np.linspace(self.lo, self.hi, max(round((self.hi - self.lo) / LOOK_STEP), 1) + 1)

    def brightness(self, light: Spectrum) -> float:
        """Return the weight of an emission: the mean of its colour plus its mean in the range.

        The second term samples invisible light that a sensor or a dye may absorb: paint that glows
        under an ultraviolet lamp, a film with bands in the infrared.
        """
        seen = float(np.mean(light.to_rgb("emission")))
        if not self.spectral:
            return seen
        return seen + self.unseen * max(float(gridded(light, self.grid).mean()), 0.0)

    @property
    def white(self) -> float:
        """The weight of a white light whose channels are 1."""
        return 1.0 + self.unseen * self.spectral

    def levels(self, image: Bitmap) -> Floats:
        """Return the weights of the texels of an emission (h, w), top row first."""
        seen = np.maximum(image.pixels(EMISSION), 0.0).mean(axis=2, dtype=np.float64)
        spectra = image.spectral(EMISSION) if self.spectral else None
        if spectra is None:
            return seen * self.white
        within = (spectra.lambdas >= self.lo) & (spectra.lambdas <= self.hi)
        power = np.maximum(spectra.values[..., within], 0.0)
        beyond = power.mean(axis=2, dtype=np.float64) if within.any() else 0.0
        return np.asarray(seen + self.unseen * beyond)
