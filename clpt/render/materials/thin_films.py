"""Thin films on boundaries: their kernel text, and in RGB mode a table of their colours.

In spectral mode the kernels sum the waves themselves (kernels/materials/film_stack.cl). In RGB mode
the host sums them for every angle, and for every thickness where a texture varies it. It integrates
reflectance and transmittance over the wavelengths of D65, as an RGB renderer sees all reflectances.
Belcour and Barla 2017 integrate on the device, by a Fourier series of the observer; a table is
exact, and as fast.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Array
from clpt.render.materials.cases import load_text, struct_text, value_text
from clpt.render.records.materials import FILM_COSINES, row_words
from clpt.scene import roles
from clpt.scene.materials import Layer
from clpt.scene.params import Kind, params
from clpt.spectra import Spectrum, cie
from clpt.spectra.spectrum import d65

THICKNESS_STEP = 4.0  # [nm] of the table, where a texture varies the thickness
MOST_ROWS = 1024

Sources = Mapping[str, frozenset[str]]
_WAVES = '#include "materials/boundary.cl#film_layers"\n#include "materials/boundary.cl#film"\n'
_TABLE = '#include "materials/boundary.cl#table_layers"\n#include "materials/boundary.cl#table"\n'

_ZERO = spectra.Constant(0.0)


def boundary_text(cls: type[Kind], mode: str, sources: Sources, layer: Sources) -> str:
    """Return the text of a kind's boundary: bare, with layers, or by the table of colours.

    sources: of the kind's parameters; layer: of the parameters of all layers in the scene.
    """
    coated = [name for name, param in params(cls).items() if param.role is roles.LAYERS]
    if not coated:
        return ""
    if not any("layers" in sources.get(name, ()) for name in coated):
        return '#include "materials/boundary.cl#bare"\n'
    if mode == "rgb":
        profile = value_text("film_profile", params(Layer)["profile"], layer["profile"])
        return f"{profile}#define FILM_COSINES {FILM_COSINES}\n{_TABLE}"
    loader = load_text(Layer, layer, "materials")
    return f"{struct_text(Layer)}{loader}#define LAYER_WORDS {row_words(Layer)}\n{_WAVES}"


def film_colours(material: Kind) -> NDArray[np.float32]:
    """Return the reflectance and transmittance of a material's layers, linear Rec. 709 under D65.

    (parts, profiles, FILM_COSINES, 6) float32: r and t. kernels/materials/boundary.cl lists the
    parts; a metal has only the first. Profiles and cosines are even from 0 to 1. Without a texture
    of the thickness the table has a single profile.
    """
    layers: tuple[Any, ...] = material.layers  # type: ignore[attr-defined]
    textured = [layer for layer in layers if layer.has_textures]
    thickest = max((layer.thickness for layer in textured), default=0.0)
    count = int(np.clip(np.ceil(thickest / THICKNESS_STEP) + 1, 2, MOST_ROWS)) if textured else 1
    lambdas = cie.GRID[:: 5 if textured else 1]
    weights = _colour_weights(lambdas)
    films = [_complex(layer.eta, layer.k, lambdas) for layer in layers]
    parts = _parts(material, lambdas)
    table = np.empty((len(parts), count, FILM_COSINES, 6), np.float32)
    for part, (above, below, tangential) in enumerate(parts):
        step = 1 if above is parts[0][0] else -1  # from inside the layers are met in reverse
        indices = [above, *films[::step], below]
        for row, profile in enumerate(np.linspace(0.0, 1.0, count) if textured else [1.0]):
            thick = [e.thickness * (profile if e.has_textures else e.profile) for e in layers]
            r, t = film_shares(indices, thick[::step], tangential, lambdas)
            table[part, row] = np.clip(np.hstack([r @ weights, t @ weights]), 0.0, 1.0)
    return table


def _parts(material: Any, lambdas: Array) -> list[tuple[Array, Array, Array]]:
    """Return for each part the index before and behind the films, and index times sine before."""
    even = np.linspace(0.0, 1.0, FILM_COSINES)[:, None] ** 2
    if "int_ior" not in params(type(material)):
        vacuum = np.ones(len(lambdas), complex)
        return [(vacuum, _complex(material.eta, material.k, lambdas), np.sqrt(1.0 - even) * vacuum)]
    ends = [spectra.index(value) for value in (material.ext_ior, material.int_ior)]
    outside, inside = (_complex(end, _ZERO, lambdas) for end in ends)
    outer, inner = (end.to_rgb("unbounded") for end in ends)
    eta = np.mean(inner / outer)  # as the kernels have it
    dense, rare = (inside, outside) if eta >= 1.0 else (outside, inside)
    shared = np.sqrt(1.0 - even) * rare
    beyond = np.sqrt(1.0 + even * (max(eta, 1.0 / eta) ** 2 - 1.0)) * rare
    return [(outside, inside, shared), (inside, outside, shared), (dense, rare, beyond)]


def film_shares(
    indices: Sequence[Array], thicknesses: Sequence[float], tangential: Array, lambdas: Array
) -> tuple[Array, Array]:
    """Return the reflectance and transmittance of a stack for unpolarised light.

    indices: complex, (wavelengths,) each, of the incident medium, of the films, and of the medium
    behind them; thicknesses [nm] of the films; tangential (angles, wavelengths): the index times
    the sine in the incident medium; lambdas [nm]. Two arrays (angles, wavelengths) float64.
    kernels/materials/film_stack.cl has the same formulas, and their sources.
    """
    beta = np.minimum(tangential.real, indices[0].real * math.sqrt(1.0 - 1e-12))
    q = [np.sqrt(n**2 - beta**2) for n in indices]
    q = [np.where(np.abs(along) < 1e-6, 1e-6, along) for along in q]  # not quite grazing
    r_sum, t_sum = np.zeros(q[0].shape), np.zeros(q[0].shape)
    for admittances in (q, [q_i / n**2 for q_i, n in zip(q, indices, strict=True)]):
        r = np.zeros(q[0].shape, complex)
        t = np.where(admittances[-1].real > 0.0, 1.0, 0.0)
        for i in range(len(indices) - 2, -1, -1):
            above, below = admittances[i], admittances[i + 1]
            d = above + below + (above - below) * r
            r = (above - below + (above + below) * r) / d
            t = t * 4.0 * np.abs(above) * np.abs(below) / np.abs(d) ** 2
            if i > 0:
                turn = np.exp(4j * np.pi * q[i] * thicknesses[i - 1] / lambdas)
                r, t = r * turn, t * np.abs(turn)
        r_sum += 0.5 * np.abs(r) ** 2
        t_sum += 0.5 * t
    return r_sum, t_sum


def profile(material: Kind) -> Any:
    """Return the texture that varies the thickness of a material's layers, 1 without a texture."""
    layers: tuple[Layer, ...] = material.layers  # type: ignore[attr-defined]
    return next((layer.profile for layer in layers if layer.has_textures), 1.0)


def _complex(eta: Spectrum | str, k: Spectrum | str, lambdas: Array) -> Array:
    n, extinction = (spectra.index(value).sample(lambdas) for value in (eta, k))
    return n + 1j * extinction


def _colour_weights(lambdas: Array) -> Array:
    """Return the weights (wavelengths, 3) that sum reflectances to linear Rec. 709 under D65."""
    weights = cie.xyz_to_rgb(cie.cie_xyz(lambdas) * d65().sample(lambdas)[:, None])
    return weights / weights.sum(axis=0)
