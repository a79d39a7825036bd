"""Media of a PBRT scene."""

from __future__ import annotations

from typing import Any

from clpt.errors import UnknownKindError
from clpt.formats.pbrt import coated_albedo
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import Definition, State, nearest
from clpt.scene.media import HenyeyGreenstein, Homogeneous, Isotropic, Medium
from clpt.spectra import RGBUnbounded

GRIDS = ("uniformgrid", "rgbgrid", "cloud", "nanovdb")
MILK = "Wholemilk"  # of which a medium is that says nothing


def medium(name: str, source: Parameters, state: State) -> Medium | None:
    """Return the medium of a name, made once; None of "", and where it is left out."""
    if not name:
        return None
    definition = state.shared.media.get(name)
    if definition is None:
        hint = nearest(name, state.shared.media)
        raise source.error(f"there is no medium {name!r}{hint}")
    key, params = ("medium", name), definition.params
    made = state.shared.once(key, params, lambda: [_made(name, definition)])
    one: Medium | None = made[0]
    return one


def _made(name: str, definition: Definition) -> Medium | None:
    params, state = definition.params, definition.state
    kind = params.one("type", "string", "homogeneous")
    with params.locating():
        if kind in GRIDS:
            state.warn(params, f"a medium of the type {kind!r} is left out")
            return None
        if kind != "homogeneous":
            raise UnknownKindError("medium", kind, ("homogeneous", *GRIDS))
        if "Le" in params:
            state.warn(params, "its light is left out")
        params.ignore("Le", "Lescale")
        g = params.one("g", "float", 0.0)
        phase = HenyeyGreenstein(g=g) if g else Isotropic()
        scale = params.one("scale", "float", 1.0)
        absorbs, scatters = _coefficients(params, state)
        made = Homogeneous(sigma_a=absorbs, sigma_s=scatters, scale=scale, phase=phase, name=name)
    for given in params.unused():
        state.warn(params, f"{given.name!r} is left out")
    return made


def _coefficients(params: Parameters, state: State) -> tuple[Any, Any]:
    preset = params.one("preset", "string", "")
    if preset and preset not in coated_albedo.MEDIA:
        raise UnknownKindError("preset", preset, coated_albedo.MEDIA)
    scatters, absorbs = (RGBUnbounded(*rgb) for rgb in coated_albedo.MEDIA[preset or MILK])
    return (
        spectrum(params, "sigma_a", "coefficient", state, absorbs),
        spectrum(params, "sigma_s", "coefficient", state, scatters),
    )
