"""Media as words: what a path knows its medium by, see kernels/media/medium.cl."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Words
from clpt.records import MEDIUM_BITS
from clpt.render.lights.bodies import BodyLight
from clpt.render.lights.bounds import Bounds
from clpt.render.lights.bricks import BrickLights, black_bodies, brick_counts
from clpt.render.lights.encode import LightRows
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.media import encode_grids as grids
from clpt.render.records.media import MOST_AIMS
from clpt.render.records.parameter_words import SPECTRUM_WORDS
from clpt.render.records.tables import as_words
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.media import Dyed, Grid, Lattice, Medium, Mixture
from clpt.scene.params import fields_of
from clpt.scene.phases import Phase
from clpt.scene.shapes import Shape
from clpt.spectra import Constant, Spectrum, index

MIDDLE = 589.3  # wavelength at which indices are named [nm]
BROAD = 1.4  # [rad] half angle from which a cone is none


def medium_aims(lights: LightRows) -> NDArray[np.float32]:
    """Return the places of the lamps that flights through media may end near.

    (n, 4) float32: x, y, z [m], and the sum of the shares of those up to it; n is 0, 1 or
    MOST_AIMS, so that kernels do not change with the number of lamps. The lamps of most power are
    taken, each in its middle; the share is that of its power. Where some of them shine into a cone
    as many rows follow: its axis and the cosine of its half angle, -1 for no cone.
    """
    places, powers, cones, row = [], [], [], 0
    for bounds in lights.bounds:
        power = lights.power[row : row + len(bounds)]
        row += len(bounds)
        if bounds.placed.all() and power.sum() > 0.0:
            places.append(np.average((bounds.low + bounds.high) / 2.0, axis=0, weights=power))
            powers.append(power.sum())
            cones.append(_cone(bounds))
    if not places:
        return np.zeros((0, 4), np.float32)
    first = np.argsort(-np.array(powers), kind="stable")[:MOST_AIMS]
    sums = np.cumsum(np.array(powers)[first])
    rows = np.column_stack([np.array(places)[first], sums / sums[-1]]).astype(np.float32)
    count = 1 if len(rows) == 1 else MOST_AIMS
    around = np.array(cones, np.float32)[first]
    kinds = [rows, around] if (around[:, 3] >= 0.0).any() else [rows]
    return np.concatenate(
        [part for one in kinds for part in (one, np.repeat(one[-1:], count - len(one), axis=0))]
    )


def _cone(bounds: Bounds) -> tuple[float, float, float, float]:
    """The cone into which a lamp shines: its axis and the cosine of its half angle, -1: none."""
    angle = float(bounds.theta_o[0] + bounds.theta_e[0])
    point = len(bounds) == 1 and bool((bounds.low == bounds.high).all())
    x, y, z = bounds.axis[0].tolist()
    return x, y, z, float(np.cos(angle)) if point and angle < BROAD else -1.0


class MediumWords:
    """Makes the words of media, each once."""

    def __init__(
        self,
        index: SceneIndex,
        encoder: Encoder,
        materials: MaterialWords,
        sealed: frozenset[Medium] = frozenset(),
        glows: Mapping[Medium, BrickLights | BodyLight] = MappingProxyType({}),
    ):
        self._index, self._encoder, self._materials = index, encoder, materials
        self._sealed, self._glows = sealed, glows
        self._words: dict[Medium, int] = {}
        # words of media, and their lights
        self.lights: list[tuple[int, BrickLights | BodyLight]] = []
        self._row = len(index.lights)  # in `lights`, of the next part of a medium
        self._has_media = bool(index.media)  # not of an integrator that sees none

    def word(self, medium: Medium | None) -> int:
        """Return the word of a medium, 0 of None."""
        if medium is None or not self._has_media:
            return 0
        if medium not in self._words:
            self._words[medium] = self._new_word(medium)
        return self._words[medium]

    def of_shapes(self, shapes: Iterable[Shape]) -> NDArray[np.uint32]:
        """Return the words of shapes' insides and outsides (2 n,), () where there are no media."""
        if not self._has_media:
            return np.zeros(0, np.uint32)
        sides = [self.word(side) for s in shapes for side in (s.interior, s.exterior)]
        return np.array(sides, np.uint32)

    def _new_word(self, medium: Medium) -> int:
        spectral = self._index.spectral
        absorbs, scatters = medium.coefficients(spectral)
        phases = medium.collisions(spectral) if medium.scatters else ()
        rows = []
        body = self._glows.get(medium)
        body = body if isinstance(body, BodyLight) else None
        if self._index.emitting:
            light = medium.light or Constant(0.0)
            rows.append(np.array([1 + self._row if body else 0], np.uint32))
            rows.append(self._encoder.named_words("medium", "light", light, roles.EMISSION)[0])
        rows += self._part_words(phases, (absorbs, scatters))
        mixture = self._mixture_words(medium)
        word = MEDIUM_BITS["flies"] | (MEDIUM_BITS["sealed"] if medium in self._sealed else 0)
        if isinstance(medium, Dyed) and medium.glows and spectral:
            word |= MEDIUM_BITS["dyed"]
        if isinstance(medium, Lattice):
            rows.append(grids.row(medium, self._encoder))
            word |= MEDIUM_BITS["grid"]
            word |= MEDIUM_BITS["bytes"] if isinstance(medium, Grid) and medium.bits == 8 else 0
        before = 2 + (1 + SPECTRUM_WORDS) * bool(self._index.emitting)
        word |= before + self._encoder.store.size("materials")
        if body is not None:
            self._row += 1
            self.lights.append((word, body))
        if isinstance(medium, Lattice) and self._index.grids.emissive:
            rows.append(self._glow(medium, word))
        if isinstance(medium, Lattice) and self._index.grids.tinted:
            rows.append(self._tint(medium, "albedo_grid"))
        if isinstance(medium, Lattice) and self._index.grids.coloured:
            rows.append(self._tint(medium, "color_grid"))
        rows += mixture
        self._encoder.store.append("materials", np.concatenate(rows))
        return word

    def _part_words(
        self, phases: tuple[Phase, ...], coefficients: tuple[Spectrum, Spectrum]
    ) -> list[Words]:
        """The word of the first phase function, 0 of none, and those of the coefficients."""
        first = self._materials.phase(phases[0]) if phases else 0
        words = [np.array([first], np.uint32)]
        for name, value in zip(("absorption", "scattering"), coefficients, strict=True):
            words.append(self._encoder.named_words("medium", name, value, roles.COEFFICIENT)[0])
        return words

    def _mixture_words(self, medium: Medium) -> list[Words]:
        """Return the words behind all others of a medium: its shares of parts, and the parts.

        The first word tells where the shares begin, 0 for nowhere.
        """
        count, spectral = self._index.grids.mixed, self._index.spectral
        if not isinstance(medium, Mixture):
            return [np.zeros(1, np.uint32)] if count and isinstance(medium, Lattice) else []
        first = self._encoder.store.append("images", grids.shares(medium, self._encoder, count))
        words = [np.array([1 + first], np.uint32)]
        for part, coefficients in zip(medium.parts, medium.of_parts(spectral), strict=True):
            phases = part.collisions(spectral) if part.scatters else ()
            words += self._part_words(phases, coefficients)
        for _ in range(count - len(medium.parts)):
            words += self._part_words((), (Constant(0.0), Constant(0.0)))
        return words

    def _tint(self, medium: Lattice, name: str) -> Words:
        """Return the word that tells where the colours of a grid's bricks begin, 0 for nowhere.

        It is negative for an albedo that is trilinear apart from the density, see
        `Grid.albedo_with_density`. name: of the medium's field that has the colours.
        """
        colours = fields_of(medium).get(name)
        if not isinstance(medium, Grid) or colours is None:
            return np.zeros(1, np.uint32)
        given = (medium.density, colours, self._index.spectral)
        first = self._encoder.store.append("images", self._encoder.cache(grids.colours, *given))
        apart = name == "albedo_grid" and not medium.albedo_with_density
        return np.array([-first if apart else first], np.int32).view(np.uint32)

    def _within(self, medium: Grid) -> float:
        """Return how much more radiance a black body has in a medium than in a vacuum: n^2.

        n: the index behind the medium's own boundaries, at the yellow line of sodium. A black
        body that is normalised has 1 wherever it is.
        """
        if medium.normalised:
            return 1.0
        bounds = (one.material for one in self._index.shapes if one.interior is medium)
        parts = [part for material in bounds for part in mt.parts(material)]
        given: list[Any] = [part.inside_index for part in parts]
        found = [float(index(one).sample(MIDDLE)) for one in given]
        return max((n for n in found if n > 0.0), default=1.0) ** 2

    def _glow(self, medium: Lattice, word: int) -> Words:
        """Return the words behind a grid's row: its bricks' light and their rows of `lights`."""
        words = np.zeros(grids.GLOW_WORDS, np.uint32)
        light: Any = medium.light
        store = self._encoder.store
        if light is None:
            return words
        if not isinstance(medium, Grid):  # none of its bricks is a light
            rows = np.full(np.prod(brick_counts(medium.size)), -1, np.int32)
            words[0] = store.append("images", rows.view(np.uint32))
            return words
        source = medium.emission_grid
        if medium.temperature is not None:
            source = medium.temperature
            table, more = black_bodies(medium, light.kelvin), self._within(medium)
            words[1] = 2 if medium.normalised else 1
            words[4] = store.append_floats("distributions", more * table[:, 1:])
            brightness = more * medium.brightness
            words[3], words[5] = as_words([brightness, (len(table) - 1) / light.kelvin])
        if source is not None:
            words[2] = store.append("images", self._encoder.cache(grids.bricks, source))
        bright = self._glows[medium]
        assert isinstance(bright, BrickLights)
        rows = np.zeros(np.prod(brick_counts(medium.size)), np.int32)
        rows[bright.emitting] = -1
        rows[bright.numbers] = 1 + self._row + np.arange(len(bright.numbers))
        words[0] = store.append("images", rows.view(np.uint32))
        self._row += len(bright.numbers)
        self.lights.append((word, bright))
        return words
