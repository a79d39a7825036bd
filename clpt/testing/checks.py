"""Checks of a material's functions; a check that fails raises AssertionError.

`check_material` puts a material through every check.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device, spectra
from clpt.records import LOBE_BITS
from clpt.render.records import materials
from clpt.render.records.materials import ORDERS_WORDS
from clpt.scene import roles
from clpt.scene.materials import LEAVES, Material
from clpt.scene.params import device_params, fields_of
from clpt.scene.roles import Param, Role, Spectral
from clpt.scene.textures import Texture
from clpt.testing.probe import CONTRACTED, LAMBDAS, Probe, contracts
from clpt.testing.settings import directions, pairs, settings, tilted, white

TRANSMIT, DELTA, DISPERSE = (LOBE_BITS[name] for name in ("transmit", "delta", "disperse"))
SAMPLES, THETA, PHI, FINE = 60_000, 16, 24, 12
ANGLES = (25.0, 75.0, 140.0)  # of wo to the normal [degrees]
ALL_ANGLES = (1.0, 30.0, 60.0, 80.0, 88.0, 100.0, 135.0, 178.0)
LIT = 8192  # samples of an albedo

Params = Mapping[str, Any]
Random = np.random.Generator


def samples_follow_the_pdf(probe: Probe, params: Params, rng: Random, significance: float) -> None:
    """Chi-square tests of `sample` against `pdf` over the sphere, at each of ANGLES.

    significance: the chance that a test fails although the functions are right.
    """
    grid, solid = _fine_grid()
    for angle in ANGLES:
        wo = tilted(angle)[None]
        sampled = probe(params, wo, grid, rng.random((SAMPLES, 3)))
        expected = _in_bins(sampled["pdf"][: len(solid)].astype(float) * solid)
        spread = (sampled["sampled_pdf"] > 0.0) & (sampled["lobe"] & DELTA == 0)
        counts = np.bincount(_bin_of(sampled["wi"][spread]), minlength=THETA * PHI)
        total = expected.sum()
        _hold(total < 1.005, f"pdf integrates to {total:.4f} at {angle} degrees", params)
        missing = max(0.0, 1.0 - total)
        p = _p_value(
            np.append(counts, SAMPLES - spread.sum()), SAMPLES * np.append(expected, missing)
        )
        message = f"sample does not follow pdf: p = {p:.1e} at {angle} degrees"
        _hold(p > significance, message, params)


def weight_is_eval_over_pdf(probe: Probe, params: Params, rng: Random) -> None:
    """Assert that `sample` agrees with `pdf` and `eval` in the direction that it returns."""
    wo, _ = pairs(rng, 2000)
    r = probe(params, wo, wo, rng.random((len(wo), 3)))
    spread = (r["sampled_pdf"] > 1e-3) & (r["lobe"] & DELTA == 0)
    r = {k: v[spread] for k, v in r.items()}
    _close(r["sampled_pdf"], r["pdf_again"], "sample's pdf is not pdf", params, rtol=2e-3)
    product = r["weight"] * r["sampled_pdf"][:, None]
    _close(product, r["eval_again"], "weight is not eval / pdf", params, rtol=3e-3, atol=1e-5)


def lobes_are_told_truly(
    probe: Probe, params: Params, rng: Random, *, hero_alone: bool = False
) -> None:
    """Assert sides, unit lengths and signs, and that eval is 0 where the pdf is 0.

    hero_alone: the pdf holds for the hero wavelength; other wavelengths may reach further.
    """
    wo, wi = pairs(rng, 2000)
    r = probe(params, wo, wi, rng.random((len(wo), 3)))
    valid = r["sampled_pdf"] > 0.0
    crossed = (wo[:, 2] * r["wi"][:, 2] < 0.0)[valid]
    flagged = (r["lobe"][valid] & TRANSMIT) != 0
    _hold(np.array_equal(crossed, flagged), "LOBE_TRANSMIT is not where wi crosses", params)
    _hold(np.all(r["eta"][valid][~crossed] == 1.0), "eta of a reflection is not 1", params)
    delta = valid & (r["lobe"] & DELTA != 0)
    _hold(np.all(r["sampled_pdf"][delta] <= 1.0), "a delta lobe's pdf is above 1", params)
    lengths = np.linalg.norm(r["wi"][valid], axis=1)
    _close(lengths, np.ones_like(lengths), "wi is not of unit length", params, atol=1e-5)
    for name in ("eval", "pdf"):
        _hold(np.all(r[name] >= 0.0), f"{name} is negative", params)
    if not hero_alone:
        dark = r["eval"][r["pdf"] == 0.0] < 1e-6
        _hold(np.all(dark), "eval is above 0 where pdf is 0", params)


def flags_are_told_truly(probe: Probe, params: Params, rng: Random) -> None:
    """Assert that the class declares to the kernels what `sample` does: flags and `transmits`."""
    cls = probe.cls
    wo, u = directions(rng, 1000), rng.random((1000, 3))
    r = probe(params, wo, wo, u)
    valid = r["sampled_pdf"] > 0.0
    if not (cls.uses_lobe_sample or cls.fluoresces):
        again = probe(params, wo, wo, np.where([True, True, False], u, rng.random((1000, 3))))
        same = np.array_equal(r["wi"], again["wi"]) and np.array_equal(r["lobe"], again["lobe"])
        _hold(same, "sample uses u.z: set uses_lobe_sample = True", params)
    if cls.delta:
        _hold(np.all(r["lobe"][valid] & DELTA), "a lobe is not delta, but delta is True", params)
    if not (cls.disperses or cls.refracts):
        alone = r["lobe"][valid] & DISPERSE
        _hold(not np.any(alone), "LOBE_DISPERSE is returned: set disperses = True", params)
    if cls.transmits is Material.transmits:
        through = r["lobe"][valid] & (TRANSMIT | DELTA) == TRANSMIT
        _hold(not np.any(through), "light goes through: define `transmits`", params)
    for name in (name for name, param in device_params(cls).items() if param.linear):
        _is_linear(probe, params, rng, name)


def tangents_are_declared(probe: Probe, params: Params, rng: Random) -> None:
    """Assert that a material without `uses_tangents` is the same when it turns about the normal.

    `uses_tangents` is read from an instance of the class with these parameters. f and the pdf are
    compared, and the directions of mirror-like lobes.
    """
    if _instance(probe.cls, params).uses_tangents:
        return
    (wo, wi), u = pairs(rng, 1000), rng.random((1000, 3))
    angle = rng.uniform(0.0, 2.0 * np.pi, len(wo))
    still = probe(params, wo, wi, u)
    turned = probe(params, _turned(wo, angle), _turned(wi, angle), u)
    message = "turns with the tangents: define `uses_tangents`"
    for name in ("eval", "pdf"):
        _close(turned[name], still[name], f"{name} {message}", params, rtol=1e-2, atol=1e-4)
    delta = (still["lobe"] & turned["lobe"] & DELTA) != 0
    delta &= (still["sampled_pdf"] > 0.0) & (still["lobe"] == turned["lobe"])
    expected = _turned(still["wi"], angle)[delta]
    _close(turned["wi"][delta], expected, f"a delta lobe {message}", params, atol=1e-3)


def _instance(cls: type[Material], params: Params) -> Material:
    """Return a material with the numbers, choices and data of `params`, and default spectra."""
    declared: dict[str, Any] = {}
    for name, param in device_params(cls).items():
        if param.role is roles.REAL:
            declared[name] = float(params[name])
        elif param.role is roles.FLAG:
            declared[name] = bool(params[name])
        elif param.role is roles.CHOICE:
            declared[name] = param.choices[int(params[name])]
        elif param.role in (roles.MEASUREMENT, roles.MERL, roles.LAYERS):
            declared[name] = params[name]
    return cls(**declared)


def _turned(w: NDArray, angle: NDArray) -> NDArray:
    """Return directions (n, 3) turned about z by angles (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * w[:, 0] - s * w[:, 1], s * w[:, 0] + c * w[:, 1], w[:, 2]], axis=1)


def _is_linear(probe: Probe, params: Params, rng: Random, name: str) -> None:
    """Assert that light is linear in a parameter, and that directions and pdf ignore it."""
    (wo, wi), u = pairs(rng, 1000), rng.random((1000, 3))
    a, b = rng.random((2, probe.components))
    low, high, mean = (probe({**params, name: v}, wo, wi, u) for v in (a, b, (a + b) / 2))
    for value in ("wi", "eta", "lobe", "sampled_pdf", "pdf"):
        same = np.array_equal(low[value], high[value])
        _hold(same, f"{value} depends on {name}, which is declared as linear", params)
    for value in ("eval", "weight"):
        between = (low[value] + high[value]) / 2
        message = f"{value} is not linear in {name}"
        _close(mean[value], between, message, params, rtol=1e-4, atol=1e-6)


def lanes_agree(wide: Probe, narrow: Probe, params: Params, rng: Random) -> None:
    """Assert that two widths return the same numbers, as far as the device's compiler allows."""
    near = CONTRACTED if contracts(narrow.on) else {"rtol": 2e-5, "atol": 2e-6}
    wo, wi = pairs(rng, 500)
    u = rng.random((len(wo), 3))
    results, again = (probe(params, wo, wi, u) for probe in (wide, narrow))
    for name, value in results.items():
        message = f"{name} differs between {wide.lanes} and {narrow.lanes} lanes"
        _close(again[name], value, message, params, **near)


def albedos(
    probe: Probe, params: Params, rng: Random, angles: Sequence[float] = ALL_ANGLES
) -> tuple[NDArray, NDArray]:
    """Return the albedo for light from each angle and its standard error, (angles, components).

    The change of radiance by refraction is undone.
    """
    u = np.stack(np.meshgrid(*[(np.arange(64) + 0.5) / 64, (np.arange(128) + 0.5) / 128]), -1)
    u = np.concatenate([u.reshape(-1, 2), rng.permutation(LIT)[:, None] / LIT], axis=1)
    wo = np.repeat([tilted(angle) for angle in angles], LIT, axis=0)
    r = probe(params, wo, wo, np.tile(u, (len(angles), 1)))
    scale = (r["sampled_pdf"] > 0.0) * r["eta"] ** 2
    energy = np.where(scale[:, None] > 0.0, r["weight"] * scale[:, None], 0.0)
    energy = energy.reshape(len(angles), LIT, -1)
    return energy.mean(axis=1), energy.std(axis=1) / np.sqrt(LIT)


def energy_is_not_made(probe: Probe, params: Params, rng: Random, tolerance: float = 2e-3) -> None:
    """Assert that the albedo exceeds 1 by at most a tolerance and four standard errors.

    Indices are set equal at all wavelengths: otherwise the pdf is the hero's alone.
    """
    ends = {k: np.full_like(v, np.mean(v)) for k, v in params.items() if k.endswith("_ior")}
    params = {**params, **ends} if "int_ior" in params else params
    mean, error = albedos(probe, params, rng)
    excess = np.max(mean - 1.0 - 4.0 * error)
    angle = ALL_ANGLES[int(np.argmax((mean - 4.0 * error).max(axis=1)))]
    _hold(excess < tolerance, f"{excess:.4f} too much energy at {angle} degrees", params)


def delta_lobes_keep_energy(probe: Probe, params: Params, rng: Random) -> None:
    """Assert that no mirror-like lobe makes light."""
    wo = directions(rng, 1000)
    r = probe(params, wo, wo, rng.random((1000, 3)))
    delta = (r["sampled_pdf"] > 0.0) & (r["lobe"] & DELTA != 0)
    energy = r["weight"] * (r["eta"] ** 2 * r["sampled_pdf"])[:, None]
    _hold(np.all(energy[delta] <= 1.0 + 1e-5), "a delta lobe makes energy", params)


def is_reciprocal(probe: Probe, params: Params, rng: Random) -> None:
    """Assert that f is the same with wo and wi exchanged."""
    wo, wi = clear_pairs(rng)
    there, back = both_ways(probe, params, wo, wi)
    _close(there, back, "f(wo, wi) is not f(wi, wo)", params, rtol=5e-3, atol=1e-4)


def clear_pairs(rng: Random) -> tuple[NDArray, NDArray]:
    """Return pairs of uniform directions (n, 3) that are not grazing."""
    wo, wi = directions(rng, 3000), directions(rng, 3000)
    keep = (np.abs(wo[:, 2]) > 0.02) & (np.abs(wi[:, 2]) > 0.02)
    return wo[keep], wi[keep]


def both_ways(probe: Probe, params: Params, wo: NDArray, wi: NDArray) -> tuple[NDArray, NDArray]:
    """Return f(wo, wi) and f(wi, wo), (n, components) each [1/sr]."""
    there = probe(params, wo, wi, wo)["eval"] / np.abs(wi[:, 2:])
    return there, probe(params, wi, wo, wi)["eval"] / np.abs(wo[:, 2:])


def extremes_are_finite(probe: Probe, rng: Random, **fixed: Any) -> None:
    """Assert finite values at grazing directions, ends of parameters, random numbers near 0 and 1.

    fixed: parameters that are not drawn.
    """
    edge = [0.0, 0.5, 1.0 - 2.0**-24]
    u = np.stack(np.meshgrid(edge, edge, edge), -1).reshape(-1, 3)
    w = _extreme_directions()
    broad = np.broadcast_arrays(w[:, None, None], w[:, None], u)
    wo, wi, us = (a.reshape(-1, 3) for a in broad)
    for ends in _limits(probe.cls):
        (params,) = settings(probe.cls, probe.mode, rng, 1, **{**ends, **fixed})
        r = probe(params, wo, wi, us)
        for name in ("eval", "pdf", "sampled_pdf", "albedo"):
            good = np.isfinite(r[name]) & (r[name] >= 0.0)
            _hold(np.all(good), f"{name} is not finite or negative", params)
        valid = r["sampled_pdf"] > 0.0
        for name in ("wi", "weight", "eta"):
            _hold(np.all(np.isfinite(r[name][valid])), f"{name} is not finite", params)
        _hold(np.all(r["weight"][valid] >= 0.0), "weight is negative", params)


def _limits(cls: type) -> list[dict[str, Any]]:
    """Return parameters at the ends of their ranges, singly and some together."""
    limits: list[dict[str, Any]] = [{}]
    declared = device_params(cls)
    for name, param in declared.items():
        if param.role is roles.REAL:
            limits += [{name: max(param.low, -1e5)}, {name: min(param.high, 1e5)}]
        if param.role is roles.INDEX:
            limits += [{name: 1.0}, {name: 0.0 if not name.endswith("ior") else 1.7}]
        if param.role is roles.CHOICE:
            limits += [{name: i} for i in range(len(param.choices))]
    least = {k: max(p.low, -1e5) for k, p in declared.items() if p.role is roles.REAL}
    flat = {k: 1.0 for k in declared if k.endswith("ior")}
    return [*limits, least, flat, least | flat, least | {"distribution": 1}]


def _extreme_directions() -> NDArray:
    z = np.array([1.0, 1.0 - 1e-7, 0.5, 1e-3, 1e-5, 1e-8, 0.0])
    z = np.concatenate([z, -z])
    r = np.sqrt(1.0 - z * z)
    return np.concatenate([np.stack([r * c, r * s, z], 1) for c, s in ((1.0, 0.0), (-0.6, 0.8))])


@cache
def _fine_grid() -> tuple[NDArray, NDArray]:
    """Return midpoints of FINE x FINE cells in every bin of theta and phi; their solid angles (n,).

    The midpoints are padded to (SAMPLES, 3).
    """
    theta = (np.arange(THETA * FINE) + 0.5) / (THETA * FINE) * np.pi
    phi = (np.arange(PHI * FINE) + 0.5) / (PHI * FINE) * 2.0 * np.pi
    t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    w = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    w = np.pad(w, ((0, SAMPLES - len(w)), (0, 0)), "edge")
    return w, np.sin(t) * np.pi / (THETA * FINE) * 2.0 * np.pi / (PHI * FINE)


def _in_bins(values: NDArray) -> NDArray:
    """Return sums (THETA * PHI,) of values on the fine grid."""
    return values.reshape(THETA, FINE, PHI, FINE).sum(axis=(1, 3)).ravel()


def _bin_of(w: NDArray) -> NDArray:
    t = np.arccos(np.clip(w[:, 2], -1.0, 1.0)) / np.pi * THETA
    p = (np.arctan2(w[:, 1], w[:, 0]) / (2.0 * np.pi)) % 1.0 * PHI
    return np.minimum(t.astype(int), THETA - 1) * PHI + np.minimum(p.astype(int), PHI - 1)


def _p_value(observed: NDArray, expected: NDArray) -> float:
    """Return the p-value of a chi-square test; bins of few expected samples are joined."""
    order = np.argsort(expected)
    o, e = observed[order], expected[order]
    few = int(np.searchsorted(np.cumsum(e), 10.0)) + 1
    few = max(few, int(np.searchsorted(e, 5.0)))
    o, e = np.append(o[few:], o[:few].sum()), np.append(e[few:], e[:few].sum())
    if len(o) < 2:
        return 1.0
    return chi_square_tail(float(np.sum((o - e) ** 2 / np.maximum(e, 1e-9))), len(o) - 1)


def chi_square_tail(x: float, degrees: int) -> float:
    """Return the chance of a chi-square above x (Abramowitz and Stegun 26.4.4 and 26.4.5)."""
    if x <= 0.0:
        return 1.0
    half, odd = 0.5 * x, degrees % 2
    orders = np.arange(0.5 * odd, 0.5 * degrees)
    terms = [math.exp(n * math.log(half) - half - math.lgamma(n + 1.0)) for n in orders]
    return min(1.0, math.fsum(terms) + (math.erfc(math.sqrt(half)) if odd else 0.0))


def _hold(held: object, message: str, params: Params) -> None:
    if not held:
        raise AssertionError(f"{message}, {params}")


def _close(
    actual: NDArray,
    expected: NDArray,
    message: str,
    params: Params,
    rtol: float = 0.0,
    atol: float = 0.0,
) -> None:
    if not np.allclose(
        actual, expected, rtol, atol, equal_nan=True
    ):  # formatting params takes long
        said = f"{message}, {params}"
        np.testing.assert_allclose(actual, expected, rtol=rtol, atol=atol, err_msg=said)


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
        tests = len(modes) * SETTINGS * len(ANGLES)
        for number, params in enumerate(drawn):
            lobes_are_told_truly(probe, params, rng, hero_alone=2 * number >= SETTINGS)
            _check_functions(probe, params, rng, CHANCE / tests)
            if reciprocal:
                is_reciprocal(probe, params, rng)
        for params in settings(cls, mode, rng, SETTINGS, **{**fixed, **white(cls)}):
            energy_is_not_made(probe, params, rng, tolerance)
        extremes_are_finite(probe, rng, **fixed)
        for lanes in (1, 8):
            lanes_agree(probe, Probe(cls, mode, lanes, probe.on), drawn[0], rng)


def _check_functions(
    probe: Probe, params: Params, rng: np.random.Generator, significance: float
) -> None:
    flags_are_told_truly(probe, params, rng)
    tangents_are_declared(probe, params, rng)
    weight_is_eval_over_pdf(probe, params, rng)
    samples_follow_the_pdf(probe, params, rng, significance)
    delta_lobes_keep_energy(probe, params, rng)


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
