"""Tables: the scene as arrays of words and floats, filled while it is lowered."""

from __future__ import annotations

from collections import defaultdict
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.records import TABLES
from clpt.render.contract.parameter_words import ORDERS_WORDS, REAL_WORDS, SPECTRUM_WORDS
from clpt.render.lowering.camera.wavelengths import Density
from clpt.render.lowering.lowering_cache import LoweringCache
from clpt.render.lowering.materials import reradiation
from clpt.render.lowering.materials.thin_films import layers_words
from clpt.render.lowering.textures.bitmaps import Images
from clpt.scene.params import Kind, device_params, interior_params
from clpt.spectra import (
    RGB,
    Constant,
    Reradiation,
    RGBIlluminant,
    Sensor,
    Spectrum,
    Tabulated,
    observer,
)
from clpt.spectra.spectrum import Role, d65, on_grid

STEP = 1.0  # [nm] of the tabulated spectra
BLACK = (Constant(0.0), RGB(0.0, 0.0, 0.0))
ONE = 1e4  # sigmoid coefficient at which it is 1 in float32
# How a spectrum is turned to rgb, by the role of the parameter (see clpt.spectra.spectrum).
RGB_ROLES: dict[str, Role] = {
    "reflectance": "reflectance",
    "emission": "emission",
    "index": "unbounded",
    "factor": "unbounded",
    "coefficient": "unbounded",
}
Words = NDArray[np.uint32]


@lru_cache(maxsize=1 << 16)
def _uplifted(value: RGB) -> tuple[float, ...]:
    """The coefficients of a colour; scenes of many materials have few."""
    return tuple(spectra.uplift(value.to_rgb()).tolist())


def as_words(values: ArrayLike) -> Words:
    """Return float32 values as the words that hold them."""
    return np.ascontiguousarray(values, np.float32).view(np.uint32)


class Tables:
    """The read-only tables of a scene, by the names in clpt.records.TABLES.

    mode: "spectral" or "rgb"; lambda_min, lambda_max: the film's range [nm]; sensor: what it
    records with, by default cie1931; density: of its wavelengths, by default visible importance.
    texture_budget: [bytes] for images, None for any number; memo: of costly pieces.
    `sources` tells, per kind and parameter, where values come from: "none" (a lobe's share is 0),
    "constant", "table", "texture", "layers".
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
        self.mode, self.lambda_min, self.lambda_max = mode, lambda_min, lambda_max
        self.sources: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
        self.expected: NDArray[np.float64] | None = (
            None  # light, see clpt.render.lowering.materials.reradiation
        )
        self.images = Images(mode == "spectral", texture_budget, self.cache)
        self.textures: dict[tuple[int, str], int] = {}
        self.texture_roles: set[tuple[str, str]] = set()  # (kind, role) that occur
        self.attributes: dict[tuple[str, str], int] = {}  # (name, role) -> its place in directories
        self.texture_mappings = False  # some texture makes uv of the place
        self.texture_depth = (
            0  # of their programs, see clpt.render.lowering.textures.texture_programs
        )
        self.folded: dict[tuple[int, str], Any] = {}  # textures with their constants put together
        self.kept: list[Any] = []  # what is known by identity here stays alive
        self._parts: dict[str, list[np.ndarray]] = {name: [] for name in TABLES}
        self._sizes: dict[str, int] = dict.fromkeys(TABLES, 0)
        self._spectra: dict[Any, int] = {}
        self._rows: dict[tuple[int, str, bytes], tuple[int, Kind]] = {}
        self._spent = False  # whether it knows of words that no device has
        if mode == "spectral":
            self._sensor(sensor or observer("cie1931"), density or Density(lambda_min, lambda_max))

    @property
    def spectral(self) -> bool:
        return self.mode == "spectral"

    @property
    def spectra_size(self) -> int:
        """Samples in a row of `spectra`."""
        return int(np.ceil((self.lambda_max - self.lambda_min) / STEP - 1e-9)) + 1

    def append(self, name: str, words: ArrayLike) -> int:
        """Append words to a table of `uint`; return the index of the first."""
        return self._append(name, "uint", np.ascontiguousarray(words, np.uint32).reshape(-1))

    def append_floats(self, name: str, values: ArrayLike) -> int:
        """Append values to a table of `float`; return the index of the first."""
        return self._append(name, "float", np.ascontiguousarray(values, np.float32).reshape(-1))

    def _append(self, name: str, element: str, values: np.ndarray) -> int:
        if TABLES[name][0] != element:
            raise TypeError(f"table {name!r} holds {TABLES[name][0]}, not {element}")
        first = self._sizes[name]
        self._parts[name].append(values)
        self._sizes[name] += values.size
        return first

    def size(self, name: str) -> int:
        """Return how many elements a table has so far."""
        return self._sizes[name]

    def finish(self) -> list[str]:
        """Put in what waits until all of it is known: images. Returns warnings."""
        from clpt.render.contract.texture_records import KINDS

        return self.images.finish(self, KINDS)

    def arrays(self) -> dict[str, np.ndarray]:
        """Give out every table as one array; an empty one has a single zero, for OpenCL's sake."""
        made = {}
        for name, (element, _) in TABLES.items():
            dtype = np.float32 if element == "float" else np.uint32
            parts = self._parts[name]
            joined = parts[0] if len(parts) == 1 else np.concatenate([*parts, np.zeros(0, dtype)])
            made[name] = joined if joined.size else np.zeros(1, dtype)
        self._parts = {name: [] for name in TABLES}
        return made

    def spectra_row(self, spectrum: Spectrum) -> int:
        """Tabulate a spectrum on the common grid; return its row in `spectra`."""
        if spectrum not in self._spectra:
            values = on_grid(spectrum, self.lambda_min, self.lambda_max, STEP)
            self._spectra[spectrum] = self.append_floats("spectra", values) // self.spectra_size
        return self._spectra[spectrum]

    def _sensor(self, sensor: Sensor, density: Density) -> None:
        """Rows 0 to 3: D65, and the sensor's curves, scaled so that Y of 1 is 1.

        Where visible importance is the density the curves are over it, as it is smooth.
        """
        self.spectra_row(d65())
        lambdas = self.lambda_min + STEP * np.arange(self.spectra_size)
        inside = np.minimum(lambdas, self.lambda_max)  # the last sample may lie past the end
        curves = sensor.sample(inside)
        if density.values is None:
            pdf = density.pdf(inside)
            curves = np.where(
                pdf[:, None] > 0.0, curves / np.where(pdf > 0.0, pdf, 1.0)[:, None], 0
            )
        self.append_floats("spectra", (curves / spectra.CIE_Y_INTEGRAL).T)

    def spectrum_words(self, value: Spectrum | str, role: str) -> tuple[Words, str]:
        """Return the five words of a spectrum and its source: "constant" or "table".

        role: one of SPECTRUM_ROLES in clpt.scene.params; an index may be a glass's name.
        """
        if isinstance(value, str) or role in ("index", "coefficient"):
            value = spectra.index(value)
        if role == "emission" and isinstance(value, RGB):
            value = RGBIlluminant(value.r, value.g, value.b)
        words = np.zeros(SPECTRUM_WORDS, np.uint32)
        if not self.spectral:
            words[:3] = as_words(value.to_rgb(RGB_ROLES[role]))
            return words, "constant"
        if isinstance(value, Constant):
            words[:4] = as_words([0.0, 0.0, ONE, value.value])
        elif type(value) is RGB:
            words[:4] = as_words([*_uplifted(value), 1.0])
        else:
            words[3] = as_words([1.0])[0]
            words[4] = np.int32(-1 - self.spectra_row(value)).view(np.uint32)
            return words, "table"
        return words, "constant"

    def row(self, kind: Kind, table: str, before: Words | None = None) -> int:
        """Append what the kernels read of a kind to a table; return its first word.

        before: words that stand in front of it. The same object after the same words is put in
        once.
        """
        key = (id(kind), table, b"" if before is None else before.tobytes())
        if key not in self._rows:
            if before is not None:
                self.append(table, before)
            self._rows[key] = self.append(table, self.kind_words(kind)), kind
        return self._rows[key][0]

    def replaced(self, old: Kind, new: Kind, table: str) -> list[tuple[int, Words]] | None:
        """Put a kind in the rows of another whose values differ, after `arrays`.

        Returns first words of the rows and what stands there now; None, from then on for all kinds,
        where more than values differs: the tables must be made anew.
        """
        if self._spent:
            return None
        owned = [key for key in self._rows if key[:2] == (id(old), table)]
        known = any(key[:2] == (id(new), table) for key in self._rows)
        if known or not owned:
            return None
        self._spent = True
        sizes, sources, found = dict(self._sizes), self.sources, []
        for kind in (old, new):
            self.sources = defaultdict(lambda: defaultdict(set))
            words = self.kind_words(kind)
            found.append(self.sources)
        self.sources = sources
        if found[0] != found[1] or sizes != self._sizes:
            return None
        self._spent = False
        rows = [self._rows.pop(key)[0] for key in owned]
        for key, row in zip(owned, rows, strict=True):
            self._rows[id(new), key[1], key[2]] = row, new
        return [(row, words) for row in rows]

    def kind_words(self, kind: Kind) -> Words:
        """Return the words of what the kernels read of a kind."""
        words: list[Words] = []
        read = {**device_params(type(kind)), **interior_params(type(kind))}
        for name, param in read.items():
            if param.role == "layers":
                value, source = layers_words(kind, self)
            else:
                value, source = self.param_words(getattr(kind, name), param.role, param.choices)
                if param.lobe and getattr(kind, name) in (0.0, *BLACK):
                    source = "none"
            words.append(value)
            self.sources[kind.kind][name].add(source)
        return np.concatenate(words) if words else np.zeros(1, np.uint32)

    def param_words(
        self, value: Any, role: str, choices: tuple[str, ...] = ()
    ) -> tuple[Words, str]:
        """Return the words of one parameter and where its value comes from."""
        if getattr(value, "is_texture", False):
            from clpt.render.lowering.textures.texture_programs import folded
            from clpt.render.lowering.textures.textures import lower_texture

            key = (id(value), role)
            if key not in self.folded:
                self.folded[key] = folded(value, role)
                self.kept.append(value)
            value = self.folded[key]
        if getattr(value, "is_texture", False):
            words = np.zeros(REAL_WORDS if role == "real" else SPECTRUM_WORDS, np.uint32)
            words[-1] = 1 + lower_texture(value, role, self)
            return words, "texture"
        if role in ("flag", "choice"):
            number = choices.index(value) if choices else int(value)
            return np.array([number], np.uint32), "constant"
        if role == "real":
            plain = value.value if isinstance(value, Constant) else value
            return np.array([as_words([plain])[0], 0], np.uint32), "constant"
        if role == "orders":
            beyond = (ORDERS_WORDS - len(value)) // 2
            return as_words(np.pad(value, beyond)), "constant"
        if role == "reradiation":
            return self.reradiation_words(value)
        return self.spectrum_words(value, role)

    def reradiation_words(self, value: Reradiation | None) -> tuple[Words, str]:
        """Return the words of a matrix: of the sum of its rows; the first says where it lies.

        In RGB mode: what is given out under D65.
        """
        words = np.zeros(SPECTRUM_WORDS, np.uint32)
        if not self.spectral:
            if value is not None:
                words[:3] = as_words(value.to_rgb(self.lambda_min, self.lambda_max))
            return words, "constant"
        nodes = reradiation.nodes(self.lambda_min, self.lambda_max)
        light = np.ones_like(nodes) if self.expected is None else self.expected
        values, sums = reradiation.table(value, nodes, light)
        words[0] = self.append_floats("distributions", values)
        words[3] = as_words([1.0])[0]
        words[4] = np.int32(-1 - self.spectra_row(Tabulated(nodes, sums, "hold"))).view(np.uint32)
        return words, "table"

    def emission_words(self, value: Any) -> Words:
        """Return the five words that `emission_load` reads: a spectrum or a texture."""
        words, source = self.param_words(value, "emission")
        self.sources["emission"]["value"].add(source)
        return words

    def factor_words(self, value: Any) -> Words:
        """Return the five words that `factor_load` reads: a reflectance, perhaps a texture."""
        words, source = self.param_words(value, "reflectance")
        self.sources["factor"]["value"].add(source)
        return words
