"""Wavelengths of the camera: a density over those to which its film responds.

Visible importance, in closed form, is good where lights are smooth and the sensor is an eye. For
line spectra, cameras beyond the visible and films of bands the density is tabulated instead, from
the sensor and the scene's lights. All are unbiased; they differ in noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.arrays import Floats
from clpt.images import spectral_exr
from clpt.records import DENSITY_SIZES
from clpt.render.film.colour import sensor
from clpt.render.scene_index import SceneIndex
from clpt.scene.integrators import Film
from clpt.scene.materials import Material
from clpt.scene.media import Dyed
from clpt.scene.params import fields_of, params
from clpt.scene.phases import Reradiating
from clpt.scene.roles import EMISSION
from clpt.scene.textures import Texture
from clpt.spectra import RGB, RGBIlluminant, Spectrum
from clpt.spectra.reradiation import Reradiation
from clpt.spectra.spectrum import d65, gridded

STEP = 1.0  # [nm] at most, between the nodes of a table
LIGHTS, SENSOR = 0.5, 0.45  # shares of a table; the rest is even, so that nothing is left out
WORTH = 2.2  # times that the second moment must fall for a table, which costs time, to be taken
GUIDES = DENSITY_SIZES["guides"]


@dataclass(frozen=True)
class Density:
    """A density of the camera's wavelengths between lo and hi [nm]; zero outside.

    values: its nodes (n + 1,) at equal distances, linear between them, whose integral is 1; None
    for visible importance, which needs no table.
    """

    lo: float
    hi: float
    values: Floats | None = None

    def pdf(self, lambdas: ArrayLike) -> Floats:
        """The density [1/nm] at `lambdas`."""
        if self.values is None:
            return spectra.wavelength_pdf(lambdas, self.lo, self.hi)
        return np.interp(np.asarray(lambdas, np.float64), self.nodes, self.values, 0.0, 0.0)

    @property
    def nodes(self) -> Floats:
        """The wavelengths at which a table's values stand [nm]."""
        count = 2 if self.values is None else len(self.values)
        return np.linspace(self.lo, self.hi, count)

    def words(self) -> NDArray[np.float32]:
        """The table as kernels/spectra/density.cl reads it: n, lo, step, sums, values, guide.

        A sum (n + 1) is the share of what lies below a node; the guide (GUIDES + 1) the cells in
        which equal shares begin, so that a search begins near its end.
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
    """The density that suits a scene in spectral mode, or the one that its film asks for."""
    film = index.film
    lo, hi = _support(film)
    visible = Density(lo, hi)
    nodes = np.linspace(lo, hi, int(np.ceil((hi - lo) / STEP - 1e-9)) + 1)
    if film.wavelengths == "visible":
        return Density(lo, hi, _normalised(visible.pdf(nodes), nodes)) if film.bands else visible
    response = np.ones_like(nodes) if film.bands else np.abs(sensor(film).sample(nodes)).sum(axis=1)
    glow = _glow(index, nodes)
    emitted = [(gridded(light, nodes) + glow(light)) * response for light in emissions(index)]
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
    """The range [nm] within the film's to which it responds, between whole steps."""
    if film.bands:
        return film.lambda_min, film.lambda_max
    nodes = np.append(np.arange(film.lambda_min, film.lambda_max, STEP), film.lambda_max)
    seen = np.flatnonzero(sensor(film).sample(nodes).any(axis=1))
    if not len(seen):
        return film.lambda_min, film.lambda_max
    return float(nodes[max(seen[0] - 1, 0)]), float(nodes[min(seen[-1] + 1, len(nodes) - 1)])


def _second_moment(density: Density, nodes: Floats, light: Floats) -> float:
    """Return the second moment of an estimate of the integral of `light` (n,) from one wavelength.

    nodes (n,): the wavelengths at which light is given [nm].
    """
    return _integral(light**2 / density.pdf(nodes), nodes)


def _integral(values: Floats, nodes: Floats) -> float:
    """Return the integral of a function that is linear between nodes."""
    return float(((values[1:] + values[:-1]) / 2.0) @ np.diff(nodes))


def _normalised(values: Floats, nodes: Floats) -> Floats:
    return values / _integral(values, nodes)


def _glow(index: SceneIndex, nodes: Floats) -> Callable[[Spectrum], Floats]:
    """Return a function of a light: what all fluorescent materials emit under it at nodes [nm]."""
    film = index.film
    cells = int(np.ceil((film.lambda_max - film.lambda_min) / STEP - 1e-9))
    into = np.linspace(film.lambda_min, film.lambda_max, cells + 1)
    found = {id(m): m for shape in index.shapes for m in _fluorescent(shape.material)}
    for medium in (part for one in index.media for part in one.parts):
        given = [one.reradiation for one in medium.phase.leaves if isinstance(one, Reradiating)]
        given += [medium.dye] if isinstance(medium, Dyed) else []
        found |= {id(m): m for m in given if m is not None}
    whole = np.zeros((len(nodes), len(into)))
    for matrix in found.values():
        whole += (into[1] - into[0]) * matrix.sample(nodes[:, None], into[None, :])
    return lambda light: whole @ gridded(light, into)


def _fluorescent(material: object) -> Iterator[Reradiation]:
    """Yield the reradiation matrices of a material and of those inside it."""
    for value in fields_of(material).values() if isinstance(material, Material) else ():
        if isinstance(value, Reradiation):
            yield value
        elif isinstance(value, Material):
            yield from _fluorescent(value)


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
    """An emission as a spectrum, of a texture its mean."""
    if isinstance(value, Texture):
        return _mean(fields_of(value).get("image"), f"{value.kind}.image")
    return RGBIlluminant(value.r, value.g, value.b) if isinstance(value, RGB) else value


def _mean(image: object, where: str) -> Spectrum:
    """The mean light of an image of spectra; any other stands for D65."""
    found = spectral_exr.find(image, emissive=True, where=where)
    if found is None:
        return d65()
    return found.spectrum(np.nan_to_num(found.values.mean(axis=(0, 1), dtype=np.float64)))
