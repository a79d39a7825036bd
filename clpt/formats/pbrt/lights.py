"""Lights of a PBRT scene. `scale` is the luminance of each spectrum; see spectra.py.

pbrt's light space has x to the right where it looks along z with y up, ours to the left: images
that are thrown are turned round accordingly, and images around a point are resampled in world
space, so that any transform, also a mirroring, is right.

pbrt keeps radiance and intensity around a point in equal-area octahedral images. The square
[0, 1]^2 stands for the sphere such that equal areas are equal solid angles (Clarberg 2008, "Fast
Equal-Area Mapping of the (Hemi)Sphere using SIMD"); its middle is +z, its corners are -z, and u
grows with x, v with y. A pixel's row 0 is at v = 0.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images, transforms
from clpt.arrays import Floats32
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import Maker, State
from clpt.formats.reading import GREY
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.roles import EMISSION
from clpt.scene.textures import Bitmap
from clpt.spectra import RGBIlluminant, luminance, scaled

TALLEST = 4096  # [rows] of an image in latitude and longitude that is made
DENSE = 1024  # [rows]: up to here each pixel takes 2 x 2 lookups, else a single lookup
CHUNK = 2**21  # directions that are looked up at once
PEAK = 8.0  # times the mean radiance: a brighter texel counts as a light source of its own
PARTS = 4  # points across a peak's texel


def to_square(directions: ArrayLike) -> NDArray[np.float64]:
    """Points (..., 2) in [0, 1]^2 of unit vectors (..., 3)."""
    d = np.asarray(directions, np.result_type(np.float32, np.asarray(directions).dtype))
    x, y, z = np.moveaxis(np.abs(d), -1, 0)
    r = np.sqrt(np.maximum(1.0 - z, 0.0))
    turn = np.arctan2(y, x) * (2.0 / np.pi)  # of a quarter
    u, v = r * (1.0 - turn), r * turn
    below = d[..., 2] < 0.0
    u, v = np.where(below, 1.0 - v, u), np.where(below, 1.0 - u, v)
    signed = np.stack([np.copysign(u, d[..., 0]), np.copysign(v, d[..., 1])], axis=-1)
    return 0.5 + 0.5 * signed


def to_sphere(points: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors (..., 3) of points (..., 2) in [0, 1]^2."""
    signed = 2.0 * np.asarray(points, np.float64) - 1.0
    u, v = np.abs(np.moveaxis(signed, -1, 0))
    inside = 1.0 - (u + v)
    r = 1.0 - np.abs(inside)
    angle = (np.where(r > 0.0, (v - u) / np.where(r > 0.0, r, 1.0), 0.0) + 1.0) * (np.pi / 4.0)
    across = r * np.sqrt(np.maximum(2.0 - r * r, 0.0))
    return np.stack(
        [
            np.copysign(np.cos(angle) * across, signed[..., 0]),
            np.copysign(np.sin(angle) * across, signed[..., 1]),
            np.copysign(1.0 - r * r, inside),
        ],
        axis=-1,
    )


def lat_long(image: Floats32, from_world: ArrayLike, *, on_poles: bool = True) -> Floats32:
    """Return the image (h, 2h, c) in latitude and longitude of an octahedral image (n, n, c).

    from_world: (3, 3), from directions of the world to the octahedron; it may mirror.
    The result has +y up and +z in the middle, as clpt.scene.lights.Envmap. Its first and last rows
    lie on the poles, as there, or half a row off them, as in the image of a Goniometric. Pixels are
    means of texels; radiance above PEAK, such as a sun, is splatted by its power.
    """
    matrix = np.asarray(from_world, np.float64)
    height = min(max(len(image), 2), TALLEST)
    off = 0.0 if on_poles else 0.5
    theta = (np.arange(height) + off) * np.pi / (height - 1 + 2 * off)
    low = np.minimum(image, np.float32(PEAK * image.mean(dtype=np.float64)))
    result = np.empty((height, 2 * height, image.shape[2]), np.float32)
    strata = 2 if height <= DENSE else 1
    step = max(CHUNK // (2 * height * strata**2), 1)
    for first in range(0, height, step):
        result[first : first + step] = _gathered(low, matrix, theta, first, step, strata)
    peaks = np.argwhere((image > low).any(axis=2))
    if len(peaks):
        light = image[tuple(peaks.T)] - low[tuple(peaks.T)]
        _lay_down(result, light, peaks, len(image), matrix, theta)
    return result


def _gathered(
    image: Floats32,
    from_world: NDArray[Any],
    theta: NDArray[Any],
    first: int,
    count: int,
    strata: int,
) -> NDArray[Any]:
    """Rows of the result from `first` on, each pixel the mean of strata^2 texels in its cell."""
    size, width, channels = len(image), 2 * len(theta), image.shape[2]
    within = (np.arange(strata) + 0.5) / strata - 0.5
    t = (theta[first : first + count, None] + within * (theta[1] - theta[0])).ravel()
    p = ((np.arange(width)[:, None] + 0.5 + within) * (2.0 * np.pi / width)).ravel()
    t, p = np.clip(t, 0.0, np.pi)[:, None], p[None, :]
    axes = (np.sin(p) * np.sin(t), np.cos(t), -np.cos(p) * np.sin(t))
    inner = [sum(m * axis for m, axis in zip(row, axes, strict=True)) for row in from_world]
    d = np.stack(inner, axis=-1, dtype=np.float32)
    at = np.minimum((to_square(d / np.linalg.norm(d, axis=-1, keepdims=True)) * size), size - 1)
    at = at[..., 1].astype(np.intp) * size + at[..., 0].astype(np.intp)
    texels = image.reshape(-1, channels)[at]
    cells = texels.reshape(-1, strata, width, strata, channels)
    return cells.mean(axis=(1, 3), dtype=np.float64)


def _lay_down(
    result: Floats32,
    light: Floats32,
    texels: NDArray[Any],
    size: int,
    from_world: NDArray[Any],
    theta: NDArray[Any],
) -> None:
    """Add the radiance (m, c) of texels (m, 2), row and column, to an image that is bilinear.

    Every point of a texel gives its power to the four pixels around it, whose share of the sphere
    is the integral of their tent: sin(theta) 2 (1 - cos D) / D in theta, D^2 / 6 at a pole.
    """
    height, width, _ = result.shape
    within = (np.arange(PARTS) + 0.5) / PARTS
    rows, columns = texels[:, 0, None, None], texels[:, 1, None, None]
    points = np.broadcast_arrays(columns + within[None, None, :], rows + within[None, :, None])
    d = to_sphere(np.stack(points, axis=-1) / size) @ np.linalg.inv(from_world).T
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    apart = theta[1] - theta[0]
    area = np.sin(theta) * 2.0 * (1.0 - np.cos(apart)) / apart
    area = np.maximum(area, apart * apart / 6.0) * (2.0 * np.pi / width)
    row = np.clip(np.arccos(np.clip(d[..., 1], -1.0, 1.0)) - theta[0], 0.0, np.ptp(theta)) / apart
    column = (np.arctan2(d[..., 0], -d[..., 2]) / (2.0 * np.pi)) % 1.0 * width - 0.5
    top = np.minimum(row.astype(np.intp), height - 2)
    left = np.floor(column).astype(np.intp)
    power = light[:, None, None, :] * (4.0 * np.pi / (size * PARTS) ** 2)
    for down in (0, 1):
        for right in (0, 1):
            share = np.abs(1 - down - (row - top)) * np.abs(1 - right - (column - left))
            share /= area[top + down]
            at = (top + down, (left + right) % width)
            np.add.at(result, at, (share[..., None] * power).astype(np.float32))


# from clpt's directions of a map in latitude and longitude to pbrt-v3's
LAT_LONG = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
WHITE = RGBIlluminant(1.0, 1.0, 1.0)
SWAP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # y is up for a goniometer


def light(kind: str, params: Parameters, state: State) -> Light | None:
    """Make the light of a `LightSource` directive; None for an unknown kind that is left out.

    Raises SceneError.
    """
    if kind not in MAKERS:
        state.stand_in(UnknownKindError("light", kind, MAKERS, **params.location()), params)
        return None
    with params.locating():
        return MAKERS[kind](params, state)


def area_light(kind: str, params: Parameters, state: State, area: float = 0.0) -> lights.Area:
    """Make the light of an `AreaLightSource` directive for a shape.

    area: of the shape [m^2], needed by a light with a "power"; of a mesh the mean of its triangles,
    since pbrt makes each triangle a light of that power. Raises SceneError.
    """
    if kind != "diffuse":
        raise UnknownKindError("area light", kind, ("diffuse",), **params.location())
    with params.locating():
        two_sided = params.one("twosided", "bool", False)
        file = params.one("filename", "string", "")
        values = _light_colour(params, "L", state)
        if file and values is not None:
            raise SceneError("give either 'L' or 'filename', not both")
        image = _image(file, state) if file else None
        mean = 1.0 if image is None else float(luminance(image).mean(dtype=np.float64))
        scale = _power_scale(params, state, (2.0 if two_sided else 1.0) * np.pi * area * mean)
        if image is None:
            return lights.Area(radiance=_bright(values, scale), two_sided=two_sided)
        shown = Bitmap(image=image * np.float32(scale), raw=True, wrap="clamp")
        return lights.Area(radiance=shown, two_sided=two_sided)


def _light_colour(params: Parameters, name: str, state: State) -> Any:
    """Take a light's spectrum; in versions 2 and 3 times a `scale` that may be a colour."""
    values = spectrum(params, name, EMISSION, state)
    if not state.shared.old:
        return values
    factor = spectrum(params, "scale", EMISSION, state)
    if factor is None:
        return values
    parts = [WHITE if part is None else part for part in (values, factor)]
    if isinstance(factor, float):
        return scaled(parts[0], factor)
    first, second = (np.asarray(part.to_rgb("unbounded")) for part in parts)
    return RGBIlluminant(*(first * second).tolist())


def _old_scale(params: Parameters, state: State) -> float:
    """Take a `scale` that is a number: in versions 2 and 3 the colour has it already."""
    return 1.0 if state.shared.old else float(params.one("scale", "float", 1.0))


def _bright(values: Any, scale: float) -> Any:
    if scale < 0.0:
        raise SceneError(f"a light cannot be negative: scale {scale:g}")
    return scaled(WHITE if values is None else values, scale)


def _power_scale(params: Parameters, state: State, per_unit: float) -> float:
    """Take the "scale" and the "power" [W] of a light that gives out `per_unit`: their factor."""
    scale, power = _old_scale(params, state), params.one("power", "float", -1.0)
    if power > 0.0:
        if not per_unit > 0.0:
            raise SceneError("what has no area or a dark image cannot have a 'power'")
        scale *= power / per_unit
    return float(scale)


def _intensity(params: Parameters, state: State, per_unit: float) -> Any:
    return _bright(_light_colour(params, "I", state), _power_scale(params, state, per_unit))


def _from_to(params: Parameters, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Take a light's position and direction in world space."""
    start = np.array(params.one("from", "point3", (0.0, 0.0, 0.0)))
    along = np.array(params.one("to", "point3", (0.0, 0.0, 1.0))) - start
    if not np.linalg.norm(along) > 0.0:
        raise SceneError("'from' and 'to' must differ")
    direction = transforms.transform_vectors(state.ctm, along / np.linalg.norm(along))
    return transforms.transform_points(state.ctm, start), direction / np.linalg.norm(direction)


def _point(params: Parameters, state: State) -> Light:
    start = np.array(params.one("from", "point3", (0.0, 0.0, 0.0)))
    return lights.Point(
        position=tuple(transforms.transform_points(state.ctm, start).tolist()),
        intensity=_intensity(params, state, 4.0 * np.pi),
    )


def _spot(params: Parameters, state: State) -> Light:
    cone = params.one("coneangle", "float", 30.0)
    beam = cone - params.one("conedeltaangle", "float", 5.0)
    if not 0.0 <= beam <= cone <= 180.0:
        raise SceneError("'conedeltaangle' must lie between 0 and 'coneangle'")
    full, edge = np.cos(np.radians([beam, cone]))
    start, direction = _from_to(params, state)
    return lights.Spot(
        to_world=_facing(start, direction),
        intensity=_intensity(params, state, 2.0 * np.pi * (1.0 - 0.5 * (full + edge))),
        cutoff=cone,
        beam_width=beam,
        edge="quartic" if state.shared.old else "smooth",
    )


def _facing(start: np.ndarray, direction: np.ndarray) -> np.ndarray:
    up = np.eye(3)[np.argmin(np.abs(direction))]
    return transforms.look_at(start, start + direction, up)


def _distant(params: Parameters, state: State) -> Light:
    _, direction = _from_to(params, state)
    scale, lux = _old_scale(params, state), params.one("illuminance", "float", -1.0)
    irradiance = _bright(_light_colour(params, "L", state), scale * lux if lux > 0.0 else scale)
    return lights.Directional(direction=tuple(direction.tolist()), irradiance=irradiance)


def _infinite(params: Parameters, state: State) -> Light:
    scale, lux = _old_scale(params, state), params.one("illuminance", "float", -1.0)
    values = _light_colour(params, "L", state)
    file = params.one("filename", "string", "")
    if params.several("portal", "point3") is not None:
        state.warn(params, "'portal' only guides sampling in pbrt's way; all directions shine here")
    if not file:
        return lights.Constant(
            radiance=_bright(values, scale * lux / np.pi if lux > 0.0 else scale)
        )
    if state.shared.old:
        return _lat_long(_image(file, state), values, state)
    if values is not None:
        raise SceneError("give either 'L' or 'filename', not both")
    image = _square(file, state)
    if lux > 0.0:
        scale *= lux / _upward(image)
    if scale < 0.0:
        raise SceneError(f"a light cannot be negative: scale {scale:g}")
    around = lat_long(image, transforms.inverse(state.ctm)[:3, :3])
    return lights.Envmap(image=around, scale=scale)


def _lat_long(image: Floats32, colour: RGBIlluminant | None, state: State) -> Light:
    """Return the light of a map in latitude and longitude: pbrt-v3, src/lights/infinite.cpp.

    Its +z is up, and u grows from +x to +y. Rows of ours lie on the poles, its half a row off.
    """
    rgb = np.ones(3) if colour is None else np.asarray(colour.to_rgb("unbounded"))
    height = max(len(image), 2)
    at = np.clip(np.arange(height) / (height - 1) * len(image) - 0.5, 0.0, len(image) - 1.0)
    above = np.minimum(at.astype(np.intp), max(len(image) - 2, 0))
    part = (at - above)[:, None, None]
    rows = (1.0 - part) * image[above] + part * image[np.minimum(above + 1, len(image) - 1)]
    turned = np.eye(4)
    turned[:3, :3] = state.ctm[:3, :3] @ LAT_LONG
    turned[:3, :3] /= np.linalg.norm(turned[:3, :3], axis=0)
    return lights.Envmap(image=(rows * rgb).astype(np.float32), to_world=turned)


def _upward(image: np.ndarray) -> float:
    """Return pbrt's illuminance of a surface that faces +z of an octahedral image.

    pbrt gives each pixel 2 pi / n^2 of solid angle, half of its true angle; its pictures show that.
    """
    centres = (np.arange(len(image)) + 0.5) / len(image)
    cosine = to_sphere(np.stack(np.meshgrid(centres, centres), axis=-1))[..., 2]
    lux = 2.0 * np.pi * float((luminance(image) * np.maximum(cosine, 0.0)).mean())
    if not lux > 0.0:
        raise SceneError("the upper half of the image is dark, so it has no 'illuminance'")
    return lux


def _goniometric(params: Parameters, state: State) -> Light:
    file = params.one("filename", "string", "")
    image: Floats32 = np.ones((2, 2, 1), np.float32)
    if file:
        image = (_image if state.shared.old else _square)(file, state).mean(axis=2, keepdims=True)
    if state.shared.old and file:
        return _old_goniometric(image, params, state)
    intensity = _intensity(params, state, 4.0 * np.pi * float(image.mean()))
    position = transforms.transform_points(state.ctm, np.zeros(3))
    around = lat_long(image, SWAP @ transforms.inverse(state.ctm)[:3, :3], on_poles=False)
    return lights.Goniometric(
        intensity=intensity,
        image=Bitmap(image=around, raw=True, wrap_v="clamp"),
        to_world=transforms.translate(position),
    )


def _old_goniometric(image: Floats32, params: Parameters, state: State) -> Light:
    """A map in latitude and longitude whose +y is up: pbrt-v3, src/lights/goniometric.h."""
    placed = transforms.translate(transforms.transform_points(state.ctm, np.zeros(3)))
    placed[:3, :3] = state.ctm[:3, :3] @ SWAP @ LAT_LONG
    placed[:3, :3] /= np.linalg.norm(placed[:3, :3], axis=0)
    intensity = _intensity(params, state, 4.0 * np.pi * float(image.mean()))
    shown = Bitmap(image=np.ascontiguousarray(image), raw=True)
    return lights.Goniometric(intensity=intensity, image=shown, to_world=placed)


def _projection(params: Parameters, state: State) -> Light:
    """pbrt's intensity is the image's; ours is that over cos^3, so that a plane across shows it."""
    file = params.one("filename", "string", "")
    if not file:
        raise SceneError("needs the parameter 'filename'")
    image = _image(file, state)
    fov = params.one("fov", "float", 45.0 if state.shared.old else 90.0)
    if not 0.0 < fov < 180.0:
        raise SceneError(f"'fov' must lie between 0 and 180, not {fov:g}")
    aspect = image.shape[1] / image.shape[0]
    half = np.tan(np.radians(fov) / 2.0) * np.array([max(aspect, 1.0), max(1.0 / aspect, 1.0)])
    x, y = (
        (2.0 * (np.arange(count) + 0.5) / count - 1.0) * reach
        for count, reach in zip(image.shape[1::-1], half, strict=True)
    )
    cosine3 = (1.0 + x[None, :] ** 2 + y[:, None] ** 2) ** -1.5
    per_unit = 4.0 * half[0] * half[1] * float((luminance(image) * cosine3).mean())
    shown = image * cosine3[..., None].astype(np.float32)
    to_world = state.ctm
    if transforms.flips_handedness(to_world):
        to_world = to_world @ transforms.scale([-1.0, 1.0, 1.0])
    else:
        shown = shown[:, ::-1]
    return lights.Projector(
        image=Bitmap(image=np.ascontiguousarray(shown), raw=True, filter="nearest"),
        irradiance=_intensity(params, state, per_unit)
        if state.shared.old
        else _bright(None, _power_scale(params, state, per_unit)),
        fov=float(np.degrees(2.0 * np.arctan(half[0]))),
        to_world=to_world,
    )


def _image(file: str, state: State) -> Any:
    """The colours (h, w, 3) float32 of a light's image, none of them negative."""
    path = state.image(file)
    image = GREY if path is None else _read(path, state)
    if not np.isfinite(image).all():
        raise SceneError(f"{file!r} has values that are not finite, so it cannot be a light")
    if image.shape[2] not in (1, 3, 4):
        raise SceneError(f"{file!r} has {image.shape[2]} channels; a light needs R, G and B")
    colours = np.broadcast_to(image[..., :3], (*image.shape[:2], 3))
    return np.maximum(colours, 0.0).astype(np.float32)


def _read(path: Path, state: State) -> Any:
    """Read an image; versions 2 and 3 take its numbers as light: src/core/imageio.cpp."""
    stored, raw = images.read_stored(path), state.shared.old
    for note in stored.notes_of(raw):
        state.tell(f"{path}: {note}")
    return stored.decoded(linear=not raw)


def _square(file: str, state: State) -> Any:
    image = _image(file, state)
    height, width, _ = image.shape
    if height != width:
        raise SceneError(
            f"{file!r} has {width}x{height} pixels; pbrt-v4 takes square, equal-area octahedral "
            "images only (imgtool makeequiarea converts one in latitude and longitude)"
        )
    return image


MAKERS: dict[str, Maker[Light]] = {
    "point": _point,
    "spot": _spot,
    "distant": _distant,
    "infinite": _infinite,
    "goniometric": _goniometric,
    "projection": _projection,
}
