"""Looks at a scene: without some parts, under a single lamp, at some wavelengths, in a region.

A look changes no scene: it makes a variant of it for the renderers.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from clpt.denoise import needs
from clpt.scene import Film, Scene
from clpt.scene.lights import Light
from clpt.scene.params import fields_of, params
from clpt.scene.roles import EMISSION
from clpt.spectra import Illuminant, Spectrum, illuminant, on_grid
from clpt.spectra.cie import CIE_Y_INTEGRAL, LAMBDA_MAX, LAMBDA_MIN, cie_xyz
from clpt.view.pictures import METHOD, PICTURE

Region = tuple[int, int, int, int]

GRID: Final = np.arange(LAMBDA_MIN, LAMBDA_MAX + 1.0)
MOST_STEPS = 100


@dataclasses.dataclass(frozen=True)
class Look:
    """A viewer's look at a scene.

    hidden: indices of shapes; lamp: all lights have its spectrum, with their luminance; wavelength,
    width: [nm] of the only light, None for all; region: of the film, see `Film.crop`;
    shows: the picture or a map of clpt.view.pictures; layers: of the film for that map, beside the
    scene's layers; denoises: whether denoisers can use the film.
    """

    hidden: frozenset[int] = frozenset()
    lamp: str | None = None
    wavelength: float | None = None
    width: float = 5.0
    region: Region | None = None
    shows: str = PICTURE
    layers: tuple[str, ...] = ()
    denoises: bool = False

    def apply(self, scene: Scene) -> Scene:
        """Return the scene that this look shows of a scene."""
        shapes, lights = scene.shapes, scene.lights
        if self.lamp is not None:
            exchanged = {
                id(s.emission): with_spectrum(s.emission, self.lamp) for s in shapes if s.emission
            }
            shapes = [
                dataclasses.replace(s, emission=exchanged[id(s.emission)]) if s.emission else s
                for s in shapes
            ]
            lights = [with_spectrum(light, self.lamp) for light in lights]
        if self.hidden:
            shapes = [shape for i, shape in enumerate(shapes) if i not in self.hidden]
        if self.denoises:
            scene = needs.prepared(scene, METHOD)
        film = self._film(scene.film)
        return dataclasses.replace(scene, shapes=shapes, lights=lights, film=film)

    def shape(self, number: int) -> int:
        """Return the index in the scene of a shape, by its index among the shown shapes."""
        for hidden in sorted(self.hidden):
            number += hidden <= number
        return number

    def _film(self, film: Film) -> Film:
        changes: dict[str, Any] = {}
        more = tuple(name for name in self.layers if name not in film.layers)
        if more:
            changes["layers"] = (*film.layers, *more)
        if self.region is not None:
            changes["crop"] = self.region
        if self.wavelength is not None and film.mode == "spectral":
            low, high = film.lambda_min, film.lambda_max
            width = min(self.width, high - low)
            first = float(np.clip(self.wavelength - width / 2, low, high - width))
            changes |= {
                "lambda_min": first,
                "lambda_max": first + width,
                # as bright as if all wavelengths were seen
                "exposure": film.exposure * (high - low) / width,
            }
        return dataclasses.replace(film, **changes) if changes else film


_L = TypeVar("_L", bound=Light)


def with_spectrum(light: _L, lamp: str) -> _L:
    """Return a light with a lamp's spectrum and its own luminance; textures and images stay."""
    changes: dict[str, Any] = {}
    fields = fields_of(light)
    for name, param in params(type(light)).items():
        value = fields[name]
        if param.role is EMISSION and isinstance(value, Spectrum):
            changes[name] = illuminant(lamp, _luminance(value))
    return dataclasses.replace(light, **changes) if changes else light


def _luminance(spectrum: Spectrum) -> float:
    """Return the luminance of an emission; that of the constant 1 is 1."""
    if isinstance(spectrum, Illuminant):
        return float(spectrum.scale)
    values = np.asarray(on_grid(spectrum, LAMBDA_MIN, LAMBDA_MAX), float)
    return float(values @ cie_xyz(GRID)[..., 1] / CIE_Y_INTEGRAL)


@dataclass(frozen=True)
class State:
    """A scene, and the look at it."""

    scene: Scene
    look: Look


class History:
    """States before the present state, and states that undoing has left."""

    def __init__(self) -> None:
        self._past: deque[State] = deque(maxlen=MOST_STEPS)
        self._future: list[State] = []
        self._last: Hashable = None

    def note(self, before: State, by: Hashable = None) -> None:
        """Note the state before a change.

        by: the changed part, such as a parameter. Consecutive changes of a part are a single step,
        as a slider makes many; None is never the same part.
        """
        if by is None or by != self._last:
            self._past.append(before)
        self._future.clear()
        self._last = by

    def back(self, now: State) -> State | None:
        """Return the state before the present state; None where there is none."""
        self._last = None
        if not self._past:
            return None
        self._future.append(now)
        return self._past.pop()

    def forward(self, now: State) -> State | None:
        """Return the state that was undone last; None where there is none."""
        self._last = None
        if not self._future:
            return None
        self._past.append(now)
        return self._future.pop()

    def clear(self) -> None:
        """Forget all states, after another scene was opened."""
        self._past.clear()
        self._future.clear()
        self._last = None
