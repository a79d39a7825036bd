"""Media of a PBRT scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import transforms
from clpt.errors import UnknownKindError
from clpt.formats import volumes
from clpt.formats.pbrt import coated_albedo
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import scaled, spectrum
from clpt.formats.pbrt.state import Definition, State, nearest
from clpt.scene.media import Grid, HenyeyGreenstein, Homogeneous, Isotropic, Medium, Volume
from clpt.spectra import Constant, RGBUnbounded

GRIDS = ("uniformgrid", "nanovdb")
LEFT_OUT = ("rgbgrid", "cloud")
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
        if kind in LEFT_OUT:
            state.warn(params, f"a medium of the type {kind!r} is left out")
            return None
        if kind not in ("homogeneous", *GRIDS):
            raise UnknownKindError("medium", kind, ("homogeneous", *GRIDS, *LEFT_OUT))
        density = _density(kind, params, state) if kind in GRIDS else None
        if kind in GRIDS and ("Le" in params or "temperature" in params):
            state.warn(params, "its light is left out")
        params.ignore("temperature", "temperaturename", "temperatureoffset")
        params.ignore("temperaturescale", "temperaturecutoff", "LeScale")
        light: Any = Constant(0.0)
        if kind in GRIDS:
            params.ignore("Le", "Lescale")
        else:
            light = spectrum(params, "Le", "emission", state, light)
            light = scaled(light, params.one("Lescale", "float", 1.0))
        g = params.one("g", "float", 0.0)
        phase = HenyeyGreenstein(g=g) if g else Isotropic()
        scale = params.one("scale", "float", 1.0)
        absorbs, scatters = _coefficients(params, state, density is not None)
        own = {"sigma_a": absorbs, "sigma_s": scatters, "scale": scale, "phase": phase}
        own["emission"] = light
        made = Homogeneous(**own, name=name)
        if density is not None:
            made = Grid(**own, name=name, density=density)
    for given in params.unused():
        state.warn(params, f"{given.name!r} is left out")
    return made


def _density(kind: str, params: Parameters, state: State) -> Volume:
    """The density of a medium in the world; a layer without any is put around it."""
    if kind == "nanovdb":
        path = state.existing_file(params.one("filename", "string", ""))
        found = volumes.read(path, params.one("gridname", "string", "density"))
        return Volume(found.values, state.ctm @ found.to_world)
    nx, ny, nz = (params.one(n, "integer", 1) for n in ("nx", "ny", "nz"))
    values = params.several("density", "float")
    if values is None or min(nx, ny, nz) < 1 or len(values) != nx * ny * nz:
        count = 0 if values is None else len(values)
        raise params.error(f"nx, ny and nz are {nx}, {ny}, {nz}, 'density' has {count} numbers")
    low = params.one("p0", "point3", np.zeros(3))
    step = (params.one("p1", "point3", np.ones(3)) - low) / (nx, ny, nz)
    around = np.pad(np.reshape(values, (nz, ny, nx)).T.astype(np.float32), 1)
    box = transforms.translate(low - step) @ transforms.scale(step * around.shape)
    return Volume(around, state.ctm @ box)


def _coefficients(params: Parameters, state: State, grid: bool) -> tuple[Any, Any]:
    if grid:
        one = Constant(1.0)
        return (
            spectrum(params, "sigma_a", "coefficient", state, one),
            spectrum(params, "sigma_s", "coefficient", state, one),
        )
    preset = params.one("preset", "string", "")
    if preset and preset not in coated_albedo.MEDIA:
        raise UnknownKindError("preset", preset, coated_albedo.MEDIA)
    scatters, absorbs = (RGBUnbounded(*rgb) for rgb in coated_albedo.MEDIA[preset or MILK])
    return (
        spectrum(params, "sigma_a", "coefficient", state, absorbs),
        spectrum(params, "sigma_s", "coefficient", state, scatters),
    )
