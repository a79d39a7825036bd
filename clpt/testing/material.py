"""One material through every check."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import device, spectra
from clpt.render.contract import custom_materials
from clpt.render.contract.parameter_words import ORDERS_WORDS
from clpt.render.lowering.spectra.spectra_table import RGB_ROLES
from clpt.scene.materials import LEAVES, Material
from clpt.scene.params import Param, device_params
from clpt.testing import checks
from clpt.testing.probe import LAMBDAS, Probe
from clpt.testing.settings import settings, white

SETTINGS = 4  # drawn parameters that a class is checked with
CHANCE = 1e-3  # that any chi-square test of a material fails where all is right


def check_material(
    material: Material | type[Material],
    *,
    reciprocal: bool = True,
    tolerance: float = 2e-3,
    modes: tuple[str, ...] = ("rgb", "spectral"),
    device: device.Device | None = None,
    seed: int = 1,
) -> None:
    """Check that a material's functions are those of one, as the kernels rely on.

    `sample` follows `pdf`, its weight is `eval` / `pdf`, with every reflectance at one no energy is
    made, f is reciprocal, nothing is NaN at grazing directions and at the ends of the parameters,
    all numbers of lanes give the same, and the class's flags are what `sample` does.

    material: a class, whose parameters are drawn within their limits, or an instance, of which only
    textures are. reciprocal: whether f(wo, wi) is to be f(wi, wo). tolerance: how much more energy
    may leave than comes. device: by default the first one; seed: of what is drawn. It takes some
    seconds.

    Raises AssertionError, telling what fails and for which parameters; KernelBuildError, with the
    line of the author's file; SceneError for a class that is no material kind.
    """
    cls = material if isinstance(material, type) else type(material)
    if cls not in LEAVES:
        custom_materials.check(cls)
    on = _chosen(device)
    for mode in modes:
        fixed = {} if isinstance(material, type) else _values(material, mode)
        rng, probe = np.random.default_rng(seed), Probe(cls, mode, on=on)
        drawn = settings(cls, mode, rng, SETTINGS, **fixed)
        tests = len(modes) * SETTINGS * len(checks.ANGLES)
        for number, params in enumerate(drawn):
            same = 2 * number < SETTINGS  # at all wavelengths
            checks.lobes_are_told_truly(probe, params, rng, hero_alone=not same)
            checks.flags_are_told_truly(probe, params, rng)
            checks.weight_is_eval_over_pdf(probe, params, rng)
            checks.samples_follow_the_pdf(probe, params, rng, CHANCE / tests)
            checks.delta_lobes_keep_energy(probe, params, rng)
            if reciprocal:
                checks.is_reciprocal(probe, params, rng)
        for params in settings(cls, mode, rng, SETTINGS, **{**fixed, **white(cls)}):
            checks.energy_is_not_made(probe, params, rng, tolerance)
        checks.extremes_are_finite(probe, rng, **fixed)
        for lanes in (1, 8):
            checks.lanes_agree(probe, Probe(cls, mode, lanes, on), drawn[0], rng)


def _chosen(given: device.Device | None) -> device.Device:
    return device.choose() if given is None else given


def _values(material: Material, mode: str) -> dict[str, Any]:
    """The parameters of a material as the kernels get them; those of textures are left out."""
    declared = device_params(type(material))
    given = {name: getattr(material, name) for name in declared}
    return {
        name: _value(value, declared[name], mode)
        for name, value in given.items()
        if not getattr(value, "is_texture", False)
    }


def _value(value: Any, param: Param, mode: str) -> Any:
    if param.role == "choice":
        return np.array(param.choices.index(value))
    if param.role == "orders":
        return np.pad(value, (ORDERS_WORDS - len(value)) // 2)
    if param.role in RGB_ROLES:
        spectrum = spectra.index(value)
        if mode == "rgb":
            return np.asarray(spectrum.to_rgb(RGB_ROLES[param.role]))
        return np.asarray(spectrum.sample(np.array(LAMBDAS)))
    return value if param.role in ("layers", "measurement", "merl") else np.array(value, float)
