"""Directions and random valid parameters of material kinds, generated from their declarations."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.measured import Measurement, MerlTable, fit
from clpt.render.records.materials import array_size
from clpt.scene import roles
from clpt.scene.materials import Layer
from clpt.scene.params import Kind, device_params
from clpt.scene.roles import Param, Role
from clpt.testing.probe import COMPONENTS

# narrower lobes fall into too few bins of the chi-square test
TESTED_RANGES: dict[str, dict[str, Any]] = {
    "roughness": {"low": 0.5},
    "anisotropic": {"high": 0.7},
    "anisotropy": {"high": 0.8},
    "clearcoat_gloss": {"high": 0.4},
    "clearcoat_roughness": {"low": 0.5},
    "longitudinal_roughness": {"low": 0.3},
    "azimuthal_roughness": {"low": 0.3},
    "iridescence_thickness": {"low": 200.0, "high": 600.0},
    "specular_roughness": {"low": 0.5},
    "specular_roughness_anisotropy": {"high": 0.6},
    "coat_roughness": {"low": 0.5},
    "coat_roughness_anisotropy": {"high": 0.6},
    "fuzz_roughness": {"low": 0.4},
    "specular_weight": {"high": 1.0},
    "thin_film_thickness": {"low": 0.2, "high": 0.6},
}


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return uniform directions on the sphere, (n, 3)."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def pairs(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of directions (n, 3): uniform pairs, and pairs near mirror reflection."""
    wo, wi = directions(rng, n), directions(rng, n)
    near = wi * 0.3 + wo * [-1.0, -1.0, 1.0]
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    return wo, np.where((np.arange(n) % 2 == 0)[:, None], wi, near)


def tilted(degrees: float, azimuth: float = 0.7) -> np.ndarray:
    """Return the direction (3,) at an angle to the normal; beyond 90 degrees, on the back."""
    t = np.radians(degrees)
    return np.array([np.sin(t) * np.cos(azimuth), np.sin(t) * np.sin(azimuth), np.cos(t)])


def settings(
    cls: type[Kind], mode: str, rng: np.random.Generator, count: int, /, **fixed: Any
) -> list[dict[str, Any]]:
    """Return `count` random valid sets of parameters: numbers and spectra (components,).

    fixed: parameters that are not random. Indices of refraction alternate between near 1 and well
    above 1, in either order: a ratio near 1 refracts into lobes too narrow for bins. A single index
    and a coat's are well above 1. In the first half of the sets, indices are equal at all
    wavelengths. Every second set has thin films that absorb nothing, if the kind takes films.
    """
    result = []
    indices = [k for k, p in device_params(cls).items() if p.role is roles.INDEX]
    dense_first = len(indices) == 1 or "coat_ior" in indices
    for i in range(count):
        disperses, turn = 2 * i >= count, 1 if dense_first else int(rng.integers(2))
        drawn: dict[str, Any] = {}
        for name, param in device_params(cls).items():
            if param.role is roles.INDEX:
                turn += 1
                drawn[name] = _draw_index(turn % 2 == 0, mode, rng, disperses)
            elif param.role is roles.LAYERS:
                drawn[name] = _draw_layers(rng) if i % 2 else ()
            else:
                drawn_from = dataclasses.replace(param, **TESTED_RANGES.get(name, {}))
                drawn[name] = _draw(drawn_from, mode, rng)
        result.append(drawn | {k: v for k, v in fixed.items() if k in drawn})
    return result


def white(cls: type[Kind]) -> dict[str, float]:
    """Return values for `settings` that make every reflectance 1 and no light fluorescent."""
    kept = {roles.REFLECTANCE: 1.0, roles.RERADIATION: 0.0}
    return {k: kept[p.role] for k, p in device_params(cls).items() if p.role in kept}


def _draw_index(dense: bool, mode: str, rng: np.random.Generator, disperses: bool) -> np.ndarray:
    c = COMPONENTS[mode]
    middle = rng.uniform(1.4, 2.0) if dense else rng.uniform(1.0, 1.1)
    return np.full(c, middle) + disperses * rng.uniform(0.0, 0.03, c)


def _draw_layers(rng: np.random.Generator) -> tuple[Layer, ...]:
    etas, thick = rng.uniform(1.2, 2.4, 2), rng.uniform(50.0, 400.0, 2)
    return tuple(Layer(eta=e, thickness=t) for e, t in zip(etas, thick, strict=True))


def _draw_measurement(rng: np.random.Generator) -> Measurement:
    """Return random tables around a matt material; about half of them are isotropic."""
    turns = [0.0] if rng.integers(2) else np.linspace(-np.pi, 0.0, 4)
    colour = rng.uniform(0.1, 1.0, 3) / np.pi
    matt = fit(
        lambda wo, wi: np.broadcast_to(colour, wi.shape),
        theta_i=np.radians([0.0, 40.0, 85.0]), phi_i=turns, normals=12, size=8,
    )  # fmt: skip
    noise = rng.uniform(0.2, 1.0, matt.spectra.shape).astype(np.float32)
    shares = rng.uniform(0.2, 1.0, matt.luminance.shape).astype(np.float32)
    return dataclasses.replace(
        matt, spectra=matt.spectra * noise, luminance=matt.luminance * shares
    )


def _draw_spectrum(param: Param, mode: str, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0.0, 1.0, COMPONENTS[mode])


def _draw_number(param: Param, mode: str, rng: np.random.Generator) -> np.ndarray:
    high = min(param.high, param.low + 100.0)  # lobes no narrower than a bin
    return np.array(param.low + rng.uniform(0.1, 1.0) * (high - param.low))


def _draw(param: Param, mode: str, rng: np.random.Generator) -> Any:
    draw: Callable[..., Any] = DRAWS.get(param.role, _draw_number)
    return draw(param, mode, rng)


# a random value of a parameter in the kernels' form, by its role
DRAWS: dict[Role, Callable[[Param, str, np.random.Generator], Any]] = {
    **dict.fromkeys((*roles.SPECTRA, roles.RERADIATION), _draw_spectrum),
    roles.REAL: _draw_number,
    roles.MEASUREMENT: lambda _, __, rng: _draw_measurement(rng),
    roles.MERL: lambda _, __, rng: MerlTable(values=rng.uniform(0.05, 1.0, (6, 5, 8, 3)) / np.pi),
    roles.ORDERS_OF_LIGHT: lambda param, _, rng: rng.uniform(0.0, 1.0, array_size(param)),
    roles.FLAG: lambda _, __, rng: np.array(rng.integers(2)),
    roles.CHOICE: lambda param, _, rng: np.array(rng.integers(len(param.choices))),
}
