"""The part of a file before WorldBegin: camera, film, filter, sampler and integrator.

pbrt's camera space has x to the right of the picture, ours to the left; `Scale -1 1 1` in a file
mirrors the picture, as it does in pbrt.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from clpt import lenses, transforms
from clpt.errors import UnknownKindError
from clpt.formats.pbrt.media import medium
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import Definition, State
from clpt.scene import cameras
from clpt.scene.integrators import Film
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
    """Take the time [s] for which the shutter is open; 1 in old files, which do not count it."""
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


CAMERAS: dict[str, Callable[[Parameters, State, Film], cameras.Camera]] = {
    "perspective": _perspective,
    "orthographic": _orthographic,
    "spherical": _spherical,
}
