"""The encoder: parameters of materials, lights and layers become the words that kernels read."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import cache
from typing import Any, cast

import numpy as np

from clpt.arrays import Words
from clpt.render.materials import thin_films
from clpt.render.records.materials import LAYERS_WORDS, ORDERS_WORDS, Sources, words
from clpt.render.records.tables import LoweringCache, TableStore, as_words
from clpt.render.spectra.encode import SpectraTable
from clpt.render.spectra.find import Density, Look
from clpt.render.textures.bitmaps import Images
from clpt.render.textures.encode import TextureTable
from clpt.scene import roles
from clpt.scene.materials import Material
from clpt.scene.params import (
    Kind,
    device_params,
    fields_of,
    interior_params,
    params,
    place_of,
)
from clpt.scene.roles import Param, Role, Spectral
from clpt.scene.values import is_texture
from clpt.spectra import RGB, Constant, Sensor, Tabulated

BLACK = (Constant(0.0), RGB(0.0, 0.0, 0.0))


class Encoder:
    """Encodes parameters, and appends the data that they refer to.

    mode, lambda_min, lambda_max, sensor, density: see `SpectraTable`; texture_budget: [bytes] for
    images, None for any number; cache: of costly parts.
    """

    def __init__(
        self,
        mode: str,
        lambda_min: float = 360.0,
        lambda_max: float = 830.0,
        sensor: Sensor | None = None,
        density: Density | None = None,
        texture_budget: int | None = None,
        cache: LoweringCache | None = None,
    ):
        self.cache = cache or LoweringCache()
        self.store = TableStore()
        self.spectra = SpectraTable(self.store, mode, lambda_min, lambda_max, sensor, density)
        images = Images(self.spectra.spectral, texture_budget, self.cache)
        self.textures = TextureTable(self.store, self.spectra, images)
        self._sources: dict[str, dict[str, set[str]]] = _no_sources()
        self._rows: dict[tuple[int, str, bytes], tuple[int, Kind]] = {}
        self.warnings: set[str] = set()  # of tables that the film does not reach
        self._spent = False  # `replaced` failed: rows hold words that no device has

    @property
    def look(self) -> Look:
        """The film's wavelengths, for the brightness of lights that are images."""
        return Look(self.spectra.spectral, *self.spectra.range, self.cache)

    @property
    def sources(self) -> Sources:
        """The sources of the values of parameters: (kind, parameter, source).

        clpt.render.materials.cases lists the sources.
        """
        return frozenset(
            (kind, name, source)
            for kind, params in self._sources.items()
            for name, sources in params.items()
            for source in sources
        )

    def row(self, kind: Kind, table: str, before: Words | None = None) -> int:
        """Append the words of a kind to a table; return the first word.

        before: words in front of it. The same object after the same words is appended once.
        """
        key = (id(kind), table, b"" if before is None else before.tobytes())
        if key not in self._rows:
            if before is not None:
                self.store.append(table, before)
            self._rows[key] = self.store.append(table, self.kind_words(kind)), kind
        return self._rows[key][0]

    def replaced(self, old: Kind, new: Kind, table: str) -> list[tuple[int, Words]] | None:
        """Put a kind into the rows of another kind that has other values, after the arrays exist.

        Return the first word of each row and its new words. Return None if more than values
        differs, and then for all later calls: the tables must be made again.
        """
        if self._spent:
            return None
        owned = [key for key in self._rows if key[:2] == (id(old), table)]
        known = any(key[:2] == (id(new), table) for key in self._rows)
        if known or not owned:
            return None
        self._spent = True
        sizes, kept = self.store.sizes, self._sources
        sources = []
        for kind in (old, new):
            self._sources = _no_sources()
            new_words = self.kind_words(kind)
            sources.append(self._sources)
        self._sources = kept
        if sources[0] != sources[1] or sizes != self.store.sizes:
            return None
        self._spent = False
        rows = [self._rows.pop(key)[0] for key in owned]
        for key, row in zip(owned, rows, strict=True):
            self._rows[id(new), key[1], key[2]] = row, new
        return [(row, new_words) for row in rows]

    def kind_words(self, kind: Kind) -> Words:
        """Return the words of a kind's parameters that kernels read."""
        parts: list[Words] = []
        values = fields_of(kind)
        for name, param in _read(type(kind)):
            value = values[name]
            self._note_reach(value, kind, name)
            encoded, source = self.param_words(value, param, kind)
            if param.lobe and value in (0.0, *BLACK):
                source = "none"
            parts.append(encoded)
            self._sources[kind.kind][name].add(source)
        return np.concatenate(parts) if parts else np.zeros(1, np.uint32)

    def _note_reach(self, value: object, kind: Kind, name: str) -> None:
        """Warn of a tabulated spectrum outside of the film's wavelengths."""
        if isinstance(value, Tabulated) and not self.spectra.reaches(value):
            low, high = self.spectra.range
            self.warnings.add(
                f"{place_of(kind, name)}: its table from {value.lambdas[0]:g} to"
                f" {value.lambdas[-1]:g} nm has nothing within the film's {low:g} to {high:g} nm"
            )

    def param_words(
        self, value: object, param: Param, owner: Kind | None = None
    ) -> tuple[Words, str]:
        """Return the words of a parameter and its source.

        owner: the kind with this parameter, if any.
        """
        value = self.textures.folded(value, param.role)
        if is_texture(value):
            texture_words = np.zeros(words(param), np.uint32)
            texture_words[-1] = 1 + self.textures.row(value, param.role)
            return texture_words, "texture"
        return ENCODINGS[param.role](self, value, param, owner)

    def named_words(self, kind: str, name: str, value: object, role: Role) -> tuple[Words, str]:
        """Return the words and the source of a value that belongs to no kind.

        kind, name: under them `sources` lists the source.
        """
        encoded, source = self.param_words(value, Param(role))
        self._sources[kind][name].add(source)
        return encoded, source

    def emission_words(self, value: object) -> Words:
        """Return the five words that `emission_load` reads: a spectrum or a texture."""
        return self.named_words("emission", "value", value, roles.EMISSION)[0]

    def factor_words(self, value: object) -> Words:
        """Return the five words that `factor_load` reads: a reflectance or a texture."""
        return self.named_words("factor", "value", value, roles.REFLECTANCE)[0]

    def layers_words(self, material: Material) -> tuple[Words, str]:
        """Return the two words of a material's thin films, and "constant" without films.

        They name a row for each layer in spectral mode, a table of colours in RGB mode.
        """
        if not material.layers:
            return np.zeros(LAYERS_WORDS, np.uint32), "constant"
        if self.spectra.spectral:
            rows = np.concatenate([self.kind_words(layer) for layer in material.layers])
        else:
            for layer in material.layers:
                for name in params(type(layer)):
                    self._note_reach(getattr(layer, name), layer, name)
            colours = thin_films.film_colours(material)
            table = self.store.append_floats("spectra", colours)
            profile, _ = self.named_words(
                "layer", "profile", thin_films.profile(material), roles.REAL
            )
            rows = np.array([table, colours.shape[1], *profile], np.uint32)
        first = self.store.append("materials", rows)
        return np.array([first, len(material.layers)], np.uint32), "layers"


@cache
def _read(cls: type[Kind]) -> tuple[tuple[str, Param], ...]:
    """Return the parameters of a kind that kernels read, in the order of its row."""
    return (*device_params(cls).items(), *interior_params(cls).items())


def _spectrum(encoder: Encoder, value: Any, param: Param, owner: object) -> tuple[Words, str]:
    return encoder.spectra.words(value, cast(Spectral, param.role))


def _number(encoder: Encoder, value: Any, param: Param, owner: object) -> tuple[Words, str]:
    number = param.choices.index(value) if param.choices else int(value)
    return np.array([number], np.uint32), str(number)


def _real(encoder: Encoder, value: Any, param: Param, owner: object) -> tuple[Words, str]:
    number = value.value if isinstance(value, Constant) else value
    return np.array([as_words([number])[0], 0], np.uint32), "constant"


def _orders(encoder: Encoder, value: Any, param: Param, owner: object) -> tuple[Words, str]:
    beyond = (ORDERS_WORDS - len(value)) // 2
    return as_words(np.pad(value, beyond)), "constant"


Encoding = Callable[[Encoder, Any, Param, Any], tuple[Words, str]]
# the encodings of values other than textures
ENCODINGS: dict[Role, Encoding] = {
    **dict.fromkeys(roles.SPECTRA, _spectrum),
    roles.REAL: _real,
    roles.FLAG: _number,
    roles.CHOICE: _number,
    roles.ORDERS_OF_LIGHT: _orders,
    roles.LAYERS: lambda encoder, value, _, owner: encoder.layers_words(owner),
    roles.ANGULAR: lambda encoder, value, _, owner: encoder.spectra.angular_words(owner),
    roles.MEASUREMENT: lambda encoder, value, *_: encoder.spectra.measurement_words(value),
    roles.MERL: lambda encoder, value, *_: encoder.spectra.merl_words(value),
    roles.RERADIATION: lambda encoder, value, *_: encoder.spectra.reradiation_words(value),
}


def _no_sources() -> dict[str, dict[str, set[str]]]:
    return defaultdict(lambda: defaultdict(set))
