"""What the pictures of kinds share: the knob, the studio around it, the form of a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.scene import Scene, cameras, integrators, lights, materials, shapes, textures
from clpt.transforms import look_at, rotate, scale, translate

Array = NDArray[np.float64]
UP = (0.0, 1.0, 0.0)
WHITE = (1.0, 1.0, 1.0)
WIDE, LARGE, SMALL = (300, 132), (450, 198), (192, 144)  # of a picture [pixels]
PLACES = (-1.42, 0.0, 1.42)  # x of three things that stand side by side
GREY = materials.Diffuse(reflectance=(0.42, 0.46, 0.5))
BLACK = materials.Diffuse(reflectance=0.0)


@dataclass(frozen=True)
class Picture:
    """A picture of one kind: what it shows, how its scene is made, and how large a pixel is."""

    caption: str
    scene: Callable[[], Scene]
    spp: int = 64
    zoom: int = 1  # a pixel of the film becomes so many by so many
    denoise: str | None = None  # the denoiser, or none


def lathe(*pieces: Sequence[tuple[float, float]], around: int = 96) -> dict[str, Array]:
    """Return the arrays of a mesh that polylines of (radius, height) sweep around y.

    A polyline is smooth within; two that meet make an edge. Its right side is outside, seen along
    it with y up. uv run around and along.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, around + 1)
    lengths = [np.linalg.norm(np.diff(piece, axis=0), axis=1).sum() for piece in pieces]
    ends = np.concatenate([[0.0], np.cumsum(lengths)]) / sum(lengths)
    vertices, normals, uvs, faces = [], [], [], []
    for piece, start, end in zip(map(np.array, pieces), ends, ends[1:], strict=False):
        tangent = np.gradient(piece, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(piece, axis=0), axis=1))])
        first = sum(map(len, vertices))
        index = first + np.arange(len(piece) * (around + 1)).reshape(len(piece), around + 1)
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
        faces += [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
        vertices.append(_swept(piece[:, 0], piece[:, 1], turn))
        normals.append(_swept(tangent[:, 1], -tangent[:, 0], turn))
        v = start + (end - start) * along / along[-1]
        uv = np.broadcast_arrays(turn / (2.0 * np.pi), v[:, None])
        uvs.append(np.stack(uv, -1).reshape(-1, 2))
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    corners = points[triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    triangles = triangles[np.linalg.norm(sides, axis=1) > 1e-9]  # those at the axis are none
    return {
        "vertices": points.astype(np.float32),
        "faces": triangles.astype(np.uint32),
        "normals": np.concatenate(normals).astype(np.float32),
        "uvs": np.concatenate(uvs).astype(np.float32),
    }


def _swept(radius: Array, height: Array, turn: Array) -> Array:
    out = radius[:, None]
    points = np.broadcast_arrays(out * np.cos(turn), height[:, None], out * np.sin(turn))
    return np.stack(points, -1).reshape(-1, 3)


def arc(x: float, y: float, radius: float, start: float, end: float, steps: int) -> list[Any]:
    """Points on a circle around (x, y), from `start` to `end` [degrees from +x to +y]."""
    angle = np.radians(np.linspace(start, end, steps))
    return list(zip(x + radius * np.cos(angle), y + radius * np.sin(angle), strict=True))


def knob(material: Any, x: float = 0.0, z: float = 0.0) -> shapes.Mesh:
    """A ball of radius 0.56 on a foot with a thin rim, 1.5 high, just above the floor."""
    pieces = (
        [(0.0, 0.0), (0.58, 0.0)],
        [(0.58, 0.0), (0.58, 0.09)],
        [(0.58, 0.09), *arc(0.58, 0.38, 0.29, 262.0, 180.0, 12)],
        [*arc(0.0, 0.94, 0.56, -56.0, 90.0, 48)],
    )
    pieces[2].append(pieces[3][0])
    return shapes.Mesh(**lathe(*pieces), material=material, to_world=translate([x, 0.004, z]))


def panel(size: float, origin: Any, target: Any, radiance: Any) -> shapes.Rectangle:
    """A square lamp, `size` wide."""
    place = look_at(origin, target, UP) @ scale([size / 2.0, size / 2.0, 1.0])
    return shapes.Rectangle(to_world=place, material=BLACK, emission=lights.Area(radiance=radiance))


def window(origin: Any, target: Any, radiance: Any) -> list[shapes.Shape]:
    """Four panes with a cross between them, to be seen in what reflects."""
    place = look_at(origin, target, UP)
    return [
        shapes.Rectangle(
            to_world=place @ translate([x, y, 0.0]) @ scale([0.5, 0.72, 1.0]),
            material=BLACK,
            emission=lights.Area(radiance=radiance),
        )
        for x in (-0.56, 0.56)
        for y in (-0.78, 0.78)
    ]


def floor(colours: tuple[Any, Any] = (0.7, 0.3), cells: float = 1.25) -> shapes.Rectangle:
    """A chequered floor of 16 m, `cells` to a metre, at y = 0."""
    checks = textures.Checkerboard(
        color0=colours[0], color1=colours[1], to_uv=np.diag([8.0 * cells, 8.0 * cells, 1.0])
    )
    place = rotate([1, 0, 0], -90) @ scale([8.0, 8.0, 1.0])
    return shapes.Rectangle(to_world=place, material=materials.Diffuse(reflectance=checks))


def film(size: tuple[int, int], mode: str = "rgb") -> integrators.Film:
    return integrators.Film(
        width=size[0], height=size[1], mode=mode, filter=integrators.BlackmanHarris()
    )


def studio(
    things: Sequence[shapes.Shape],
    *,
    size: tuple[int, int] = WIDE,
    dim: float = 1.0,
    mode: str = "rgb",
    **more: Any,
) -> Scene:
    """Things on a chequered floor, by a soft lamp at the left and a window at the right.

    dim: factor on all light; lamps: in place of both.
    """
    wall = shapes.Rectangle(
        to_world=translate([0, 0, -3.2]) @ scale([12.0, 6.0, 1.0]), material=GREY
    )
    lamps = more.pop("lamps", None) or [
        panel(2.6, [-3.6, 4.6, 3.6], [0, 0.5, 0], tuple(6.0 * dim for _ in WHITE)),
        *window([4.6, 3.0, 3.4], [0, 0.7, 0], tuple(4.5 * dim for _ in WHITE)),
    ]
    more.setdefault("camera", wide_camera())
    more.setdefault("integrator", integrators.Path(max_depth=10, rr_depth=4))
    sky = lights.Constant(radiance=tuple(0.5 * dim for _ in WHITE))
    return Scene(
        shapes=[*things, floor(), wall, *lamps], lights=[sky], film=film(size, mode), **more
    )


def wide_camera() -> cameras.Perspective:
    """Sees three things at PLACES."""
    return cameras.Perspective(to_world=look_at([0, 2.3, 8.0], [0, 0.68, 0], UP), fov=30.5)


def near_camera() -> cameras.Perspective:
    """Sees one thing, or two side by side."""
    return cameras.Perspective(to_world=look_at([0, 1.9, 6.2], [0, 0.72, 0], UP), fov=30.0)
