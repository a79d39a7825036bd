"""A material through every check."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import device, spectra
from clpt.render.records import materials
from clpt.render.records.materials import ORDERS_WORDS
from clpt.scene import roles
from clpt.scene.materials import LEAVES, Material
from clpt.scene.params import device_params, fields_of
from clpt.scene.roles import Param, Role, Spectral
from clpt.scene.textures import Texture
from clpt.testing import checks
from clpt.testing.probe import LAMBDAS, Probe
from clpt.testing.settings import settings, white

SETTINGS = 4  # random sets of parameters per class
CHANCE = 1e-3  # that any chi-square test of a right material fails


def check_material(
    material: Material | type[Material],
    *,
    reciprocal: bool = True,
    tolerance: float = 2e-3,
    modes: tuple[str, ...] = ("rgb", "spectral"),
    device: device.Device | None = None,
    seed: int = 1,
) -> None:
    """Check that a material's functions have the properties that the kernels rely on.

    `sample` follows `pdf`, its weight is `eval` / `pdf`, no light is created, f is reciprocal,
    values are finite, widths of lanes agree, and the class's flags, `transmits` and
    `uses_tangents` agree with its functions. It takes some seconds.

    material: a class, whose parameters are drawn at random within their limits, or an instance,
    whose textured parameters alone are drawn. reciprocal: whether f(wo, wi) must equal f(wi, wo).
    tolerance: how far the albedo may exceed 1. device: by default the first; seed: of the random
    parameters.

    Raises AssertionError with the failed property, KernelBuildError, SceneError for other classes.
    """
    cls = material if isinstance(material, type) else type(material)
    if cls not in LEAVES:
        materials.check(cls)
    for mode in modes:
        fixed = {} if isinstance(material, type) else _values(material, mode)
        rng, probe = np.random.default_rng(seed), Probe(cls, mode, on=_chosen(device))
        drawn = settings(cls, mode, rng, SETTINGS, **fixed)
        tests = len(modes) * SETTINGS * len(checks.ANGLES)
        for number, params in enumerate(drawn):
            checks.lobes_are_told_truly(probe, params, rng, hero_alone=2 * number >= SETTINGS)
            _check_functions(probe, params, rng, CHANCE / tests)
            if reciprocal:
                checks.is_reciprocal(probe, params, rng)
        for params in settings(cls, mode, rng, SETTINGS, **{**fixed, **white(cls)}):
            checks.energy_is_not_made(probe, params, rng, tolerance)
        checks.extremes_are_finite(probe, rng, **fixed)
        for lanes in (1, 8):
            checks.lanes_agree(probe, Probe(cls, mode, lanes, probe.on), drawn[0], rng)


def _check_functions(
    probe: Probe, params: checks.Params, rng: np.random.Generator, significance: float
) -> None:
    checks.flags_are_told_truly(probe, params, rng)
    checks.tangents_are_declared(probe, params, rng)
    checks.weight_is_eval_over_pdf(probe, params, rng)
    checks.samples_follow_the_pdf(probe, params, rng, significance)
    checks.delta_lobes_keep_energy(probe, params, rng)


def _chosen(requested: device.Device | None) -> device.Device:
    return device.choose() if requested is None else requested


def _values(material: Material, mode: str) -> dict[str, Any]:
    """Return a material's parameters in the kernels' form, without textured parameters."""
    values, declared = fields_of(material), device_params(type(material))
    return {
        name: _value(values[name], param, mode)
        for name, param in declared.items()
        if not isinstance(values[name], Texture)
    }


def _value(value: object, param: Param, mode: str) -> Any:
    change: Callable[..., Any] = VALUES.get(param.role, _numbers)
    return change(value, param, mode)


def _numbers(value: object, param: Param, mode: str) -> Any:
    return np.array(value, float)


def _same(value: object, param: Param, mode: str) -> Any:
    return value


def _choice(value: object, param: Param, mode: str) -> Any:
    return np.array(param.choices.index(value))


def _orders(value: Any, param: Param, mode: str) -> Any:
    return np.pad(value, (ORDERS_WORDS - len(value)) // 2)


def _spectrum(value: Any, param: Param, mode: str) -> Any:
    spectrum = spectra.index(value)
    if mode == "rgb":
        assert isinstance(param.role, Spectral)
        return np.asarray(spectrum.to_rgb(param.role.meaning))
    return np.asarray(spectrum.sample(np.array(LAMBDAS)))


# a parameter's value in the kernels' form, by its role; `_numbers` for other roles
VALUES: dict[Role, Callable[[Any, Param, str], Any]] = {
    **dict.fromkeys(roles.SPECTRA, _spectrum),
    **dict.fromkeys((roles.LAYERS, roles.MEASUREMENT, roles.MERL), _same),
    roles.CHOICE: _choice,
    roles.ORDERS_OF_LIGHT: _orders,
}
