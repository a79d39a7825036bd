"""The form of a picture: how a film's words become it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.render.records.layer_names import LayerNames
from clpt.scene import Film


@dataclass(frozen=True)
class PictureForm:
    """The way from a film's words to a picture.

    to_output: (3, 3), rows of the matrix from the sums to the output space; light_paths: all paths
    start at lights; weighed: some do, beside the camera's; weights: samples serve several pixels;
    paper: the matrix (3, 3) from sums of layers that are colours to the output space, see
    `clpt.render.film.layers.white_paper`; names: what layers tell of; adaptive: whether pixels may
    differ in their numbers of samples; octaves: that of the sampler where octaves of samples are
    kept apart, else 0; place: of a crop the column and the row where it begins and the size of the
    whole film, (x, y, width, height); the others are those of `clpt.scene.Film`.
    """

    to_output: tuple[tuple[float, ...], ...]
    light_paths: bool = False
    weighed: bool = False
    weights: bool = False
    alpha: bool = False
    bands: int = 0
    lambda_min: float = 360.0
    lambda_max: float = 830.0
    output_space: str = "rec709"
    exposure: float = 1.0
    display_exposure: float = 0.0
    layers: tuple[str, ...] = ()
    paper: tuple[tuple[float, ...], ...] = ()
    names: LayerNames = LayerNames()
    adaptive: bool = False
    octaves: float = 0.0
    place: tuple[int, int, int, int] | None = None

    @property
    def band_centres(self) -> NDArray[np.float64]:
        """The wavelengths at the centres of the bands, (bands,) [nm]."""
        film = Film(bands=self.bands, lambda_min=self.lambda_min, lambda_max=self.lambda_max)
        return film.band_centres
