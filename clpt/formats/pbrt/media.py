"""Media of a PBRT scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import transforms
from clpt.errors import UnknownKindError, did_you_mean
from clpt.formats import volumes
from clpt.formats.pbrt import scattering
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import Definition, State
from clpt.scene.media import Cloud, Grid, Homogeneous, Medium
from clpt.scene.phases import HenyeyGreenstein, Isotropic
from clpt.scene.roles import COEFFICIENT, EMISSION
from clpt.scene.volumes import Volume
from clpt.spectra import Constant, RGBUnbounded, scaled

GRIDS = ("uniformgrid", "nanovdb", "rgbgrid", "cloud")
HEAT = ("temperatureoffset", "temperaturecutoff", "temperaturescale")
BLACK_BODY = {"normalised": True}  # so that it has 1 at its brightest wavelength
_AROUND = ((1, 1), (1, 1), (1, 1), (0, 0))
DEFAULT_PRESET = "Wholemilk"  # pbrt's, for a medium without coefficients


def medium(name: str, source: Parameters, state: State) -> Medium | None:
    """Return the medium of a name, made once; None of ""."""
    if not name:
        return None
    definition = state.shared.media.get(name)
    if definition is None:
        hint = did_you_mean(name, state.shared.media)
        raise source.error(f"there is no medium {name!r}{hint}")
    key, params = ("medium", name), definition.params
    result = state.shared.once(key, params, lambda: [_made(name, definition)])
    item: Medium | None = result[0]
    return item


def _made(name: str, definition: Definition) -> Medium:
    params, state = definition.params, definition.state
    kind = params.one("type", "string", "homogeneous")
    with params.locating():
        if kind not in ("homogeneous", *GRIDS):
            raise UnknownKindError("medium", kind, ("homogeneous", *GRIDS))
        g = params.one("g", "float", 0.0)
        phase = HenyeyGreenstein(g=g) if g else Isotropic()
        scale = params.one("scale", "float", 1.0)
        inner: dict[str, Any] = {"scale": scale, "phase": phase}
        if kind != "rgbgrid":
            absorbs, scatters = _coefficients(params, state, kind in GRIDS)
            inner |= {"sigma_a": absorbs, "sigma_s": scatters}
        if kind == "rgbgrid":
            result: Medium = Grid(**inner, **_coloured(params, state), name=name)
        elif kind == "homogeneous":
            result = Homogeneous(**inner, emission=_light(params, state), name=name)
        elif kind == "cloud":
            result = Cloud(**inner, **_cloud(params, state), name=name)
        else:
            result = Grid(**inner, **_grid(kind, params, state), name=name)
    for values in params.unused():
        state.warn(params, f"{values.name!r} is left out")
    return result


def _light(params: Parameters, state: State) -> Any:
    """Read the emission of a homogeneous medium."""
    light = spectrum(params, "Le", EMISSION, state, Constant(0.0))
    return scaled(light, params.one("Lescale", "float", 1.0))


def _cloud(params: Parameters, state: State) -> dict[str, Any]:
    """The density of a `cloud`, whose space is that of its medium."""
    return {
        "density": params.one("density", "float", 1.0),
        "wispiness": params.one("wispiness", "float", 1.0),
        "frequency": params.one("frequency", "float", 5.0),
        "low": params.one("p0", "point3", np.zeros(3)),
        "high": params.one("p1", "point3", np.ones(3)),
        "to_world": state.ctm,
    }


def _grid(kind: str, params: Parameters, state: State) -> dict[str, Any]:
    """The density of a medium in the world, and its light."""
    if kind == "nanovdb":
        path = state.existing_file(params.one("filename", "string", ""))
        density = _moved(volumes.read(path, params.one("gridname", "string", "density")), state)
        hot = params.one("temperaturename", "string", "temperature")
        scale = params.one("LeScale", "float", 1.0)
        if hot not in volumes.names(path) or not scale > 0.0:
            params.ignore(*HEAT)
            return {"density": density}
        kelvin = _kelvin(volumes.read(path, hot), params)
        return {"density": density, "temperature": _moved(kelvin, state), **BLACK_BODY,
                "brightness": scale}  # fmt: skip
    listed = _listed(params, "density", state)
    if listed is None:
        raise params.error("needs its 'density'")
    heat = _listed(params, "temperature", state)
    if heat is not None:
        if "Le" in params:
            raise params.error("has both 'Le' and 'temperature'")
        if "Lescale" in params:
            state.warn(params, "'Lescale' is left out, where a temperature says what is emitted")
            params.ignore("Lescale")
        return {"density": listed, "temperature": _kelvin(heat, params), **BLACK_BODY}
    params.ignore(*HEAT)
    light = spectrum(params, "Le", EMISSION, state, Constant(0.0))
    return {"density": listed, "emission": light,
            "emission_grid": _listed(params, "Lescale", state)}  # fmt: skip


def _coloured(params: Parameters, state: State) -> dict[str, Any]:
    """An `rgbgrid`: a density, its colours where these differ, and an albedo on the grid."""
    parts = [_listed(params, name, state, "rgb") for name in ("sigma_a", "sigma_s")]
    matches = next((part for part in parts if part is not None), None)
    if matches is None:
        raise params.error("needs its 'sigma_a' or 'sigma_s'")
    items = np.pad(np.ones([n - 2 for n in matches.values.shape[:3]] + [3], np.float32), _AROUND)
    absorbs, scatters = (items if part is None else part.values for part in parts)
    extinction = (absorbs + scatters).astype(float)
    sigma_t, density, colours = volumes.factored(extinction)
    if "Le" in params:
        state.warn(params, "its light is left out")
    params.ignore("Le", "Lescale")
    albedo = scatters / np.maximum(extinction, 1e-30)
    return {
        "density": Volume(density, matches.to_world),
        "color_grid": None if colours is None else Volume(colours, matches.to_world),
        "sigma_t": sigma_t,
        "albedo_grid": Volume(np.clip(albedo, 0.0, 1.0).astype(np.float32), matches.to_world),
        "albedo_with_density": True,  # as pbrt interpolates sigma_s
    }


def _kelvin(values: Volume, params: Parameters) -> Volume:
    """A temperature as PBRT scales it."""
    offset = params.one("temperaturecutoff", "float", 0.0)
    offset = params.one("temperatureoffset", "float", offset)
    scale = params.one("temperaturescale", "float", 1.0)
    return Volume(np.maximum((values.values - offset) * scale, 0.0), values.to_world)


def _moved(volume: Volume, state: State) -> Volume:
    return Volume(volume.values, state.ctm @ volume.to_world)


def _listed(params: Parameters, name: str, state: State, type_: str = "float") -> Volume | None:
    """Numbers or colours on a grid, from a list; a layer of 0 is put around them."""
    nx, ny, nz = (params.one(n, "integer", 1) for n in ("nx", "ny", "nz"))
    values = params.several(name, type_)
    if values is None:
        return None
    if min(nx, ny, nz) < 1 or len(values) != nx * ny * nz:
        message = f"nx, ny and nz are {nx}, {ny}, {nz}, {name!r} has {len(values)} numbers"
        raise params.error(message)
    low = params.one("p0", "point3", np.zeros(3))
    step = (params.one("p1", "point3", np.ones(3)) - low) / (nx, ny, nz)
    colours = np.shape(values)[1:]
    cells = np.reshape(values, (nz, ny, nx, *colours)).swapaxes(0, 2).astype(np.float32)
    around = np.pad(cells, _AROUND[: cells.ndim])
    box = transforms.translate(low - step) @ transforms.scale(step * around.shape[:3])
    return Volume(around, state.ctm @ box)


def _coefficients(params: Parameters, state: State, grid: bool) -> tuple[Any, Any]:
    if grid:
        item = Constant(1.0)
        return (
            spectrum(params, "sigma_a", COEFFICIENT, state, item),
            spectrum(params, "sigma_s", COEFFICIENT, state, item),
        )
    preset = params.one("preset", "string", "")
    if preset and preset not in scattering.MEDIA:
        raise UnknownKindError("preset", preset, scattering.MEDIA)
    scatters, absorbs = (RGBUnbounded(*rgb) for rgb in scattering.MEDIA[preset or DEFAULT_PRESET])
    return (
        spectrum(params, "sigma_a", COEFFICIENT, state, absorbs),
        spectrum(params, "sigma_s", COEFFICIENT, state, scatters),
    )
