"""Cameras, films, filters, samplers and integrators of pbrt."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from clpt import lenses, transforms
from clpt.choices import MOST_LIGHT_PATHS
from clpt.errors import UnknownKindError
from clpt.formats.pbrt.media import medium
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import Definition, Maker, State
from clpt.scene import cameras, integrators
from clpt.scene.integrators import Film, Filter, Integrator, Sampler
from clpt.scene.motion import Keys, Shutter

TO_RIGHT = np.diag([-1.0, 1.0, 1.0, 1.0])
BLADES = {"square": 4, "pentagon": 5}
FARTHEST = 1e20  # [m], pbrt cuts nothing off; below the FAR of rays that meet nothing
# pbrt's directions for a map in latitude and longitude, in our camera space.
ROUND = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def camera(definition: Definition, film: Film, diagonal: float) -> cameras.Camera:
    """Make the camera that a Camera directive describes; diagonal: of the film [mm].

    Raises SceneError.
    """
    if definition.kind not in (*CAMERAS, "realistic"):
        known = (*CAMERAS, "realistic")
        raise UnknownKindError("camera", definition.kind, known, **definition.params.location())
    params, state = definition.params, definition.state
    exposure_time(params, state.shared.old)
    with params.locating():
        if definition.kind == "realistic":
            result = _realistic(params, state, film, diagonal)
        else:
            result = CAMERAS[definition.kind](params, state, film)
        result = _moving(result, state)
        opens, closes = _shutter(params)
        shutter = Shutter(opens, max(opens, closes))
    return replace(result, medium=medium(state.outside, params, state), shutter=shutter)


def _moving(camera: cameras.Camera, state: State) -> cameras.Camera:
    """The camera with the keys of the transforms that it was defined in."""
    if state.motion() is None or state.end is None:
        return camera
    keys = [_without_scale(transforms.inverse(matrix))[0] for matrix in (state.ctm, state.end)]
    inner = transforms.inverse(keys[0]) @ camera.to_world
    return replace(camera, to_world=inner, motion=Keys(state.shared.times, keys))


def exposure_time(params: Parameters, old: bool) -> float:
    """Take the time [s] of the open shutter; 1 in old files, which ignore it."""
    opens, closes = _shutter(params)
    time = closes - opens
    if old:
        return 1.0
    if not time > 0.0:
        raise params.error("the shutter does not open: 'shutterclose' must be above 'shutteropen'")
    return float(time)


def _shutter(params: Parameters) -> tuple[float, float]:
    """Take when the shutter opens and closes [s]."""
    return params.one("shutteropen", "float", 0.0), params.one("shutterclose", "float", 1.0)


def _window(params: Parameters, film: Film) -> tuple[float, float, float, float]:
    """Take the part of the plane at distance 1 (of a fov of 90) seen: its centre, width, height."""
    frame = params.above_zero("frameaspectratio", film.width / film.height)
    x, y = (frame, 1.0) if frame > 1.0 else (1.0, 1.0 / frame)
    values = params.several("screenwindow", "float")
    left, right, low, high = (-x, x, -y, y) if values is None else _four(params, values)
    if not (left < right and low < high):
        raise params.error("'screenwindow' must be left, right, bottom, top, in this order")
    return (left + right) / 2.0, (low + high) / 2.0, right - left, high - low


def _four(params: Parameters, values: Any) -> tuple[float, ...]:
    if len(values) != 4:
        raise params.error(f"'screenwindow' must be 4 numbers, not {len(values)}")
    return tuple(float(value) for value in values)


def _perspective(params: Parameters, state: State, film: Film) -> cameras.Camera:
    fov = params.one("fov", "float", 90.0)
    if not 0.0 < fov < 180.0:
        raise params.error(f"the field of view must lie between 0 and 180, not {fov:g}")
    x, y, width, height = _window(params, film)
    across = width * math.tan(math.radians(fov) / 2.0)
    stretch = height / width * film.width / film.height
    to_world, size = _without_scale(transforms.inverse(state.ctm))
    values: dict[str, Any] = {
        "to_world": to_world @ TO_RIGHT @ np.diag([1.0, stretch, 1.0, 1.0]),
        "fov": math.degrees(2.0 * math.atan(across / 2.0)),
        "offset_x": x / width,
        "offset_y": -y / height,
        "near": 0.0,
        "far": FARTHEST,
    }
    radius = params.one("lensradius", "float", 0.0) * size
    distance = params.above_zero("focaldistance", 1e6) * size
    if radius <= 0.0:
        return cameras.Perspective(**values)
    return cameras.ThinLens(aperture_radius=radius, focus_distance=distance, **values)


def _without_scale(matrix: transforms.Matrix) -> tuple[transforms.Matrix, float]:
    """A camera's placement without the size that it has in all directions, and that size."""
    size = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    if abs(size - 1.0) < 1e-4:
        return matrix, 1.0
    smaller = matrix.copy()
    smaller[:3, :3] /= size
    return smaller, size


def _orthographic(params: Parameters, state: State, film: Film) -> cameras.Camera:
    if params.one("lensradius", "float", 0.0) > 0.0:
        state.warn(params, "parallel rays have no aperture here: 'lensradius' is left out")
    params.ignore("focaldistance")
    x, y, width, height = _window(params, film)
    size = [width / 2.0, height / 2.0 * film.width / film.height, 1.0]
    window = transforms.translate([x, y, 0.0]) @ transforms.scale(size)
    to_world = transforms.inverse(state.ctm) @ window @ TO_RIGHT
    return cameras.Orthographic(to_world=to_world, near=0.0, far=FARTHEST)


def _spherical(params: Parameters, state: State, film: Film) -> cameras.Camera:
    mappings = ("equalarea", "equirectangular")
    usual = mappings[1] if state.shared.old else mappings[0]
    if params.choice("mapping", usual, mappings) == "equalarea":
        state.warn(params, "'equalarea' is not supported: the picture is equirectangular")
    _window(params, film)
    params.ignore("lensradius", "focaldistance")
    to_world, _ = _without_scale(transforms.inverse(state.ctm))
    return cameras.Spherical(to_world=to_world @ ROUND)


def _realistic(params: Parameters, state: State, film: Film, diagonal: float) -> cameras.Camera:
    name = params.one("lensfile", "string", "")
    if not name:
        raise params.error("needs a 'lensfile' with the rows of the lens")
    path = state.existing_file(name)
    if path.suffix.lower() not in lenses.READERS:
        raise params.error(f"a lens file ends in {', '.join(lenses.READERS)}, not {path.suffix!r}")
    lens = lenses.read(path)
    # pbrt's own default is 1 mm, and it never opens a lens further than its file says.
    aperture = params.above_zero("aperturediameter", 1.0)
    largest = 2.0 * lens.surfaces[lens.stop].semi_diameter
    if aperture > largest:
        state.warn(params, f"'aperturediameter' is above the lens's {largest:g} mm, which counts")
    shape = params.one("aperture", "string", "")
    if shape and shape not in BLADES:
        state.warn(params, f"the aperture {shape[:40]!r} is left out: it is round")
    to_world, size = _without_scale(transforms.inverse(state.ctm))
    return cameras.Lens(
        lens=lens.with_stop(0.5 * min(aperture, largest)),
        to_world=to_world @ TO_RIGHT,
        film_width=1e-3 * size * diagonal * film.width / math.hypot(film.width, film.height),
        focus_distance=params.above_zero("focusdistance", 10.0) * size,
        blades=BLADES.get(shape, 0),
        blade_angle=90.0 if shape == "pentagon" else 45.0,
        exposure="irradiance",
        unit=1e-3 * size,
    )


CAMERAS = {"perspective": _perspective, "orthographic": _orthographic, "spherical": _spherical}


FILMS = ("rgb", "gbuffer", "spectral")
GBUFFER = ("albedo", "position", "geometric_normal", "shading_normal", "uv")
SPACES = {
    "srgb": "rec709", "rec2020": "rec2020", "dci-p3": "display_p3", "aces2065-1": "aces2065_1",
}  # fmt: skip
SAMPLERS = (
    "halton", "sobol", "zsobol", "paddedsobol", "pmj02bn", "stratified", "independent",
)  # fmt: skip
STORED = ("filename", "savefp16")  # how a file is stored is decided when it is written
SIZE = (("xresolution", 1280), ("yresolution", 720))
OLD_SIZE = (("xresolution", 640), ("yresolution", 480))  # pbrt-v3, src/core/film.cpp
DAYLIGHT = 6500.0  # [K], what pbrt takes a measured sensor's white to be


def film(
    definition: Definition | None, filter: Definition | None, exposure: float, old: bool
) -> Film:
    """Make the film; `exposure` is how long the shutter is open [s]. Raises SceneError.

    old: whether the file is of version 2 or 3, whose film has a `scale` instead.
    """
    chosen = _filter(filter, old)
    size = OLD_SIZE if old else SIZE
    if definition is None:
        return Film(width=size[0][1], height=size[1][1], filter=chosen)
    params, state = definition.params, definition.state
    if definition.kind not in FILMS:
        raise UnknownKindError("film", definition.kind, FILMS, **params.location())
    params.ignore(*STORED)
    diagonal(definition)
    if definition.kind == "gbuffer" and "world" not in params.one(
        "coordinatesystem", "string", "camera"
    ):
        state.warn(params, "the layers of the film 'gbuffer' are in the world, not the camera")
    width, height = (params.one(name, "integer", n) for name, n in size)
    with params.locating():
        made_film = Film(
            width=width,
            height=height,
            filter=chosen,
            crop=_crop(params, width, height),
            **_colour(params, state, exposure),
            **(_bands(params) if definition.kind == "spectral" else {}),
            layers=GBUFFER if definition.kind == "gbuffer" else (),
        )
    if params.one("maxcomponentvalue", "float", math.inf) < math.inf:
        state.warn(params, "'maxcomponentvalue' is left out: bright samples are kept as they are")
    return made_film


def diagonal(definition: Definition | None) -> float:
    """Return the film's diagonal [mm], which only lenses traced by surfaces ask for."""
    return 35.0 if definition is None else definition.params.above_zero("diagonal", 35.0)


def _colour(params: Parameters, state: State, exposure: float) -> dict[str, Any]:
    """Take the sensor: what becomes white, and the factor on the picture."""
    sensor = params.one("sensor", "string", "cie1931")
    balance = params.one("whitebalance", "float", 0.0)
    if state.shared.old:
        exposure = params.above_zero("scale", 1.0)
    values: dict[str, Any] = {"exposure": exposure * params.above_zero("iso", 100.0) / 100.0}
    if sensor != "cie1931":
        state.warn(params, f"the sensor {sensor!r} is not known: cie1931 is used")
        balance = balance or DAYLIGHT
    if balance > 0.0:
        values["white_balance"] = balance
    return {**values, "output_space": SPACES[state.colour_space]}


def _bands(params: Parameters) -> dict[str, Any]:
    return {
        "bands": params.one("nbuckets", "integer", 16),
        "lambda_min": params.above_zero("lambdamin", 360.0),
        "lambda_max": params.above_zero("lambdamax", 830.0),
    }


def _crop(params: Parameters, width: int, height: int) -> tuple[int, int, int, int] | None:
    """Take the part of the film that is rendered: x, y, width and height, or None for all of it.

    A `cropwindow` counts before `pixelbounds`; both give left, right, top, bottom.
    """
    bounds, window = params.several("pixelbounds", "integer"), params.several("cropwindow", "float")
    for name, values in (("pixelbounds", bounds), ("cropwindow", window)):
        if values is not None and len(values) != 4:
            raise params.error(f"{name!r} must be 4 numbers, not {len(values)}")
    if window is not None:
        x, y = np.sort(np.clip(window[:2], 0, 1)), np.sort(np.clip(window[2:], 0, 1))
        x, y = np.ceil(width * x), np.ceil(height * y)
    elif bounds is not None:
        x, y = np.clip(bounds[:2], 0, width), np.clip(bounds[2:], 0, height)
    else:
        return None
    if not (x[0] < x[1] and y[0] < y[1]):
        raise params.error("no pixel is left of the film by its crop window or pixel bounds")
    return int(x[0]), int(y[0]), int(x[1] - x[0]), int(y[1] - y[0])


def _filter(definition: Definition | None, old: bool) -> Filter:
    if definition is None:
        return integrators.Box() if old else integrators.Gaussian()
    if definition.kind not in FILTERS:
        raise UnknownKindError("filter", definition.kind, FILTERS, **definition.params.location())
    with definition.params.locating():
        return FILTERS[definition.kind](definition.params, definition.state)


def _radius(params: Parameters, state: State, default: float) -> float:
    """Take the radius [pixels]; clpt has a single radius for both axes."""
    x, y = (params.above_zero(name, default) for name in ("xradius", "yradius"))
    if x != y:
        state.warn(params, f"one radius of {math.sqrt(x * y):.3g} pixels replaces two")
    return math.sqrt(x * y)


def _box(params: Parameters, state: State) -> Filter:
    return integrators.Box(radius=_radius(params, state, 0.5))


def _triangle(params: Parameters, state: State) -> Filter:
    return integrators.Tent(radius=_radius(params, state, 2.0))


def _gaussian(params: Parameters, state: State) -> Filter:
    if state.shared.old:  # exp(-alpha d^2)
        sigma = 1.0 / math.sqrt(2.0 * params.above_zero("alpha", 2.0))
        return integrators.Gaussian(stddev=sigma, radius=_radius(params, state, 2.0))
    radius = _radius(params, state, 1.5)
    return integrators.Gaussian(stddev=params.above_zero("sigma", 0.5), radius=radius)


def _mitchell(params: Parameters, state: State) -> Filter:
    b, c = params.one("B", "float", 1 / 3), params.one("C", "float", 1 / 3)
    return integrators.Mitchell(b=b, c=c, radius=_radius(params, state, 2.0))


def _sinc(params: Parameters, state: State) -> Filter:
    radius = _radius(params, state, 4.0)
    return integrators.Lanczos(radius=radius, lobes=params.above_zero("tau", 3.0))


FILTERS: dict[str, Maker[Filter]] = {
    "box": _box,
    "gaussian": _gaussian,
    "mitchell": _mitchell,
    "sinc": _sinc,
    "triangle": _triangle,
}


def sampler(definition: Definition | None) -> tuple[Sampler, int, int | None]:
    """Return the sampler, the samples of a pixel, and the seed if it is given.

    Sobol stands for all but zsobol: other random numbers, the same picture in the end.
    """
    if definition is None:
        return integrators.Sobol(), 16, None
    params = definition.params
    if definition.kind not in SAMPLERS and definition.state.shared.old:
        definition.state.warn(params, "is not known here: other random numbers are used")
    elif definition.kind not in SAMPLERS:
        raise UnknownKindError("sampler", definition.kind, SAMPLERS, **params.location())
    if definition.kind == "stratified":
        params.ignore("jitter")
        spp = math.prod(params.one(name, "integer", 4) for name in ("xsamples", "ysamples"))
    else:
        spp = params.one("pixelsamples", "integer", 16)
    params.ignore("randomization")
    seed = params.one("seed", "integer", None)
    if not 0 < spp < 2**31:
        raise params.error(f"there must be at least one sample in a pixel, not {spp}")
    result = integrators.Zsobol() if definition.kind == "zsobol" else integrators.Sobol()
    return result, spp, None if seed is None else seed % 2**31


LIGHT_PATHS = ("path", "volpath", "simplepath", "simplevolpath", "randomwalk")
OTHERS = {  # what finds light in other ways than from the camera alone
    "bdpt": ("visualizestrategies", "visualizeweights"),
    "mlt": (
        "bootstrapsamples", "chains", "mutationsperpixel", "largestepprobability", "sigma",
    ),
    "lightpath": (),
}  # fmt: skip
CHOSEN = "clpt chooses what suits the scene instead: path, light paths beside it, or vcm"
PHOTONS = (
    "its photons are those of vcm: they count beside paths from the camera and from lights, where "
    "something sharp has gathered light; the radius is one for all pixels, and shrinks by the "
    "number of passes, not by the photons found"
)
IGNORED = ("regularize", "lightsampler", "rrthreshold", "samplelights", "samplebsdf")
MOST_DEPTH = 2**31 - 2
NO_LIGHT = ("ao", "function", "ambientocclusion")
OLD_OTHERS = ("directsamples", "causticphotons", "indirectphotons", "nused", "finalgather")


def integrator(definition: Definition | None, film: Film) -> Integrator:
    """Make the counterpart of pbrt's integrator; pbrt's depth is 1 less.

    film: its pixels share pbrt's photons.
    """
    if definition is None:
        return integrators.Path(max_depth=6, free_panes=False)
    params, state = definition.params, definition.state
    if definition.kind in NO_LIGHT:
        raise params.error("this integrator shows no light; use 'path'")
    if state.shared.old and definition.kind in ("directlighting", "whitted"):
        return _direct(params, state)
    known = (*LIGHT_PATHS, *OTHERS, "sppm")
    if state.shared.old and definition.kind not in known:
        state.warn(params, "is read as path")
    elif definition.kind not in known:
        raise UnknownKindError("integrator", definition.kind, known, **params.location())
    params.ignore(*IGNORED, *OTHERS.get(definition.kind, ()))
    depth = params.one("maxdepth", "integer", 5)
    if depth < 0:
        raise params.error(f"'maxdepth' cannot be negative: {depth}")
    longest = min(depth, MOST_DEPTH) + 1
    free = integrators.is_long(longest)
    if definition.kind in OTHERS:
        state.warn(params, CHOSEN)
        return integrators.Auto(max_depth=longest, free_panes=free)
    if definition.kind != "sppm":
        params.ignore(*OLD_OTHERS if state.shared.old else ())
        return integrators.Path(max_depth=longest, free_panes=free)
    state.warn(params, PHOTONS)
    return integrators.Vcm(max_depth=longest, free_panes=free, **_photons(params, film))


def _direct(params: Parameters, state: State) -> Integrator:
    """Direct light, which versions 2 and 3 follow through mirrors and glass as well."""
    depth = params.one("maxdepth", "integer", 5)
    if not state.shared.mirrors:
        return integrators.Direct()
    state.warn(
        params, "is read as path, since mirrors or glass are there: other surfaces light each other"
    )
    return integrators.Path(max_depth=min(max(depth, 0), MOST_DEPTH) + 1, free_panes=False)


def _photons(params: Parameters, film: Film) -> dict[str, Any]:
    """Read the photons of `sppm`; pbrt's default radius of 1 suits few scenes: 0 takes ours."""
    params.ignore("seed")
    radius = params.above_zero("radius", 0.0) if "radius" in params else 0.0
    each = params.one("photonsperiteration", "integer", -1) / math.prod(film.size)
    return {"radius": radius, "light_paths": min(max(round(each), 1), MOST_LIGHT_PATHS)}
