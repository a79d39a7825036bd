"""Media as words: a path stores the word of its medium, see kernels/media/medium.cl."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Words
from clpt.records import MEDIUM_BITS
from clpt.render.geometry.surroundings import SODIUM, Absorber, Filling
from clpt.render.lights.bodies import BodyLight, BrickLights, black_bodies, brick_counts
from clpt.render.lights.bounds import Bounds
from clpt.render.lights.find import Sources
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.media import grids
from clpt.render.records import MOST_AIMS, MediaFeatures
from clpt.render.records.materials import SPECTRUM_WORDS
from clpt.render.records.tables import as_words
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.media import Grid, Lattice, Medium
from clpt.scene.params import fields_of
from clpt.scene.phases import Phase
from clpt.scene.shapes import Shape
from clpt.spectra import Constant, Spectrum, index

WIDEST_CONE = 1.4  # [rad] a lamp of a larger half angle counts as having no cone


def medium_aims(sources: Sources) -> NDArray[np.float32]:
    """Return the points of lamps near which flights through media may end (equiangular sampling).

    (n, 4) float32: x, y, z [m], and the cumulative share of the power. n is 0, 1 or MOST_AIMS, so
    that kernels do not change with the number of lamps. The lamps of most power are taken, each in
    its middle. Where some of them shine into a cone, as many rows follow: the cone's axis and the
    cosine of its half angle, -1 without a cone.
    """
    points, powers, cones = [], [], []
    for source in sources.every:
        bounds, power = source.bounds, source.power
        if bounds.placed.all() and power.sum() > 0.0:
            points.append(np.average((bounds.low + bounds.high) / 2.0, axis=0, weights=power))
            powers.append(power.sum())
            cones.append(_cone(bounds))
    if not points:
        return np.zeros((0, 4), np.float32)
    brightest = np.argsort(-np.array(powers), kind="stable")[:MOST_AIMS]
    sums = np.cumsum(np.array(powers)[brightest])
    rows = np.column_stack([np.array(points)[brightest], sums / sums[-1]]).astype(np.float32)
    count = 1 if len(rows) == 1 else MOST_AIMS
    cone_rows = np.array(cones, np.float32)[brightest]
    tables = [rows, cone_rows] if (cone_rows[:, 3] >= 0.0).any() else [rows]
    padded = [np.pad(table, ((0, count - len(table)), (0, 0)), mode="edge") for table in tables]
    return np.concatenate(padded)


def _cone(bounds: Bounds) -> tuple[float, float, float, float]:
    """Return the axis of a point light's cone and the cosine of its half angle, -1: no cone."""
    angle = float(bounds.theta_o[0] + bounds.theta_e[0])
    is_point = len(bounds) == 1 and bool((bounds.low == bounds.high).all())
    x, y, z = bounds.axis[0].tolist()
    return x, y, z, float(np.cos(angle)) if is_point and angle < WIDEST_CONE else -1.0


class MediumWords:
    """The words of media, each appended on first use."""

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
        self._words: dict[Filling, int] = {}
        self.lights: list[tuple[int, BrickLights | BodyLight]] = []  # by their medium's word
        self._light_row = len(index.lights)  # in `lights`, of the next brick or body
        self._has_media = bool(index.media)  # False for an integrator that sees none

    def word(self, filling: Filling | None) -> int:
        """Return the word of a medium or of the inside of a body that absorbs, 0 of None."""
        if filling is None or not (self._has_media or isinstance(filling, Absorber)):
            return 0
        if filling not in self._words:
            if isinstance(filling, Absorber):
                self._words[filling] = self.absorber(filling.absorption)
            else:
                self._words[filling] = self._append(filling)
        return self._words[filling]

    def absorber(self, absorption: Spectrum) -> int:
        """Append the absorption of the inside of a body [1/m]; return its word."""
        words = self._encoder.named_words("medium", "absorption", absorption, roles.COEFFICIENT)[0]
        return 1 + self._encoder.store.append("materials", words)

    def of_shapes(self, shapes: Iterable[Shape]) -> NDArray[np.uint32]:
        """Return the words of shapes' interiors and exteriors (2 n,), () without media."""
        if not self._has_media:
            return np.zeros(0, np.uint32)
        sides = [self.word(side) for s in shapes for side in (s.interior, s.exterior)]
        return np.array(sides, np.uint32)

    def _append(self, medium: Medium) -> int:
        """Append the row of a medium to `materials`; return the medium's word."""
        spectral, lattice, emitting = self._index.spectral, medium.lattice, self._index.emitting
        glow = self._glows.get(medium)
        body = glow if isinstance(glow, BodyLight) else None
        rows = []
        if emitting:
            light = medium.light or Constant(0.0)
            rows.append(np.array([1 + self._light_row if body else 0], np.uint32))
            rows.append(self._encoder.named_words("medium", "light", light, roles.EMISSION)[0])
        phases = medium.collisions(spectral) if medium.scatters else ()
        rows += self._part_words(phases, medium.coefficients(spectral))
        mixture_rows = self._mixture_words(medium)
        if lattice is not None:
            rows.append(grids.row(lattice, self._encoder))
        before = 2 + (1 + SPECTRUM_WORDS) * bool(emitting)
        word = self._bits(medium) | before + self._encoder.store.size("materials")
        if body is not None:
            self._light_row += 1
            self.lights.append((word, body))
        if lattice is not None:
            rows += self._lattice_words(lattice, word)
        self._encoder.store.append("materials", np.concatenate([*rows, *mixture_rows]))
        return word

    def _bits(self, medium: Medium) -> int:
        bits = MEDIUM_BITS["flies"]
        if medium in self._sealed:
            bits |= MEDIUM_BITS["sealed"]
        if medium.glows and self._index.spectral:
            bits |= MEDIUM_BITS["dyed"]
        if medium.lattice is not None:
            bits |= MEDIUM_BITS["grid"]
            bits |= MEDIUM_BITS["bytes"] if medium.lattice.bits == 8 else 0
        return bits

    def _part_words(
        self, phases: tuple[Phase, ...], coefficients: tuple[Spectrum, Spectrum]
    ) -> list[Words]:
        """Return the word of the first phase function, 0 without, and the coefficients' words."""
        phase = self._materials.phase(phases[0]) if phases else 0
        words = [np.array([phase], np.uint32)]
        for name, value in zip(("absorption", "scattering"), coefficients, strict=True):
            words.append(self._encoder.named_words("medium", name, value, roles.COEFFICIENT)[0])
        return words

    def _mixture_words(self, medium: Medium) -> list[Words]:
        """Return the last words of a medium: the shares of its parts, and the parts.

        The first word is 1 + where the shares begin in `images`, 0 without shares.
        """
        count, spectral = self._index.grids.mixed, self._index.spectral
        lattice = medium.lattice
        if lattice is None or not medium.is_mixture:
            return [np.zeros(1, np.uint32)] if count and lattice is not None else []
        first = self._encoder.store.append("images", grids.shares(lattice, self._encoder, count))
        words = [np.array([1 + first], np.uint32)]
        for part, coefficients in zip(medium.parts, medium.of_parts(spectral), strict=True):
            phases = part.collisions(spectral) if part.scatters else ()
            words += self._part_words(phases, coefficients)
        for _ in range(count - len(medium.parts)):
            words += self._part_words((), (Constant(0.0), Constant(0.0)))
        return words

    def _lattice_words(self, medium: Lattice, word: int) -> list[Words]:
        """Return the words that follow a grid's row, for the features that the scene has."""
        features, rows = self._index.grids, []
        if features.emissive:
            rows.append(self._glow_words(medium, word))
        if features.tinted:
            rows.append(self._tint_words(medium, "albedo_grid"))
        if features.coloured:
            rows.append(self._tint_words(medium, "color_grid"))
        return rows

    def _tint_words(self, medium: Lattice, field: str) -> Words:
        """Return the word that says where the colours of a grid's bricks begin, 0 without colours.

        It is negative for an albedo that is trilinear apart from the density, see
        `Grid.albedo_with_density`. field: the medium's field with the colours.
        """
        fields = fields_of(medium)
        colours = fields.get(field)
        if colours is None:
            return np.zeros(1, np.uint32)
        words = self._encoder.cache(grids.colours, fields["density"], colours, self._index.spectral)
        first = self._encoder.store.append("images", words)
        apart = field == "albedo_grid" and not fields["albedo_with_density"]
        return np.array([-first if apart else first], np.int32).view(np.uint32)

    def _black_body_factor(self, medium: Grid) -> float:
        """Return the radiance of a black body in a grid over its radiance in a vacuum: n^2.

        n: the index behind the medium's own boundaries, at the yellow line of sodium. A normalised
        black body has 1 in any medium.
        """
        if medium.normalised:
            return 1.0
        materials = (shape.material for shape in self._index.shapes if shape.interior is medium)
        indices: list[Any] = [
            part.inside_index for material in materials for part in mt.parts(material)
        ]
        samples = [float(index(value).sample(SODIUM)) for value in indices]
        return max((n for n in samples if n > 0.0), default=1.0) ** 2

    def _glow_words(self, medium: Lattice, word: int) -> Words:
        """Return the words behind a grid's row: its bricks' light and their rows of `lights`."""
        words = np.zeros(grids.GLOW_WORDS, np.uint32)
        light: Any = medium.light
        store, cache = self._encoder.store, self._encoder.cache
        if light is None:
            return words
        rows = np.full(np.prod(brick_counts(medium.size)), -1, np.int32)
        glow = self._glows.get(medium)
        if not isinstance(glow, BrickLights):  # a cloud: none of its bricks is a light
            words[0] = store.append("images", rows.view(np.uint32))
            return words
        grid = cast("Grid", medium)
        source = grid.emission_grid
        if grid.temperature is not None:
            source = grid.temperature
            factor = self._black_body_factor(grid)
            table = black_bodies(grid, light.kelvin)
            words[1] = 2 if grid.normalised else 1
            words[4] = store.append_floats("distributions", factor * table[:, 1:])
            brightness = factor * grid.brightness
            words[3], words[5] = as_words([brightness, (len(table) - 1) / light.kelvin])
        if source is not None:
            words[2] = store.append("images", cache(grids.bricks, source))
        rows[:] = 0
        rows[glow.emitting] = -1
        rows[glow.numbers] = 1 + self._light_row + np.arange(len(glow.numbers))
        words[0] = store.append("images", rows.view(np.uint32))
        self._light_row += len(glow.numbers)
        self.lights.append((word, glow))
        return words


def media_features(
    index: SceneIndex,
    materials: MaterialWords,
    aims: int,
    sealed: frozenset[Medium],
    *,
    escapes: bool,
) -> MediaFeatures:
    """Return the features of a scene's media.

    aims: rows of `medium_aims`; sealed: media that rays to lights cannot leave; escapes: whether
    other rays leave sealed media toward lamps.
    """
    return MediaFeatures(
        absorption=materials.absorption,
        present=index.has_media,
        chromatic=any(medium.is_chromatic for medium in index.media),
        emissive=bool(index.emitting),
        dyed=index.dyed,
        sealed=bool(sealed) and not (index.balanced or index.guided),
        escapes=escapes and not index.balanced,
        bodies=index.nested,
        aims=aims,
        grids=index.grids,
    )
