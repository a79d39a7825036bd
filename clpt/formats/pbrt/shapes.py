"""Shapes of a PBRT scene, in their own space: meshes, spheres, disks, tubes and patches.

The front is pbrt's: where the normals of a mesh point, else where its triangles run counter-
clockwise, and for spheres, disks and tubes the outside, or +z, which a transform that mirrors turns
to the other side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.meshes import mesh, ply
from clpt.formats.pbrt import parametric
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import Definition, Maker, State
from clpt.formats.pbrt.textures import textured
from clpt.scene import shapes, subdivision
from clpt.scene.roles import REAL
from clpt.scene.shapes import Shape
from clpt.scene.textures import Bitmap

Parts = dict[str, Any]
QUADRICS = ("cylinder", "disk", "sphere", "cone", "hyperboloid", "paraboloid")
MOST_STEPS = 8  # along the line of a hyperboloid, for a point that decides its shape
OLD = ("cone", "hyperboloid", "paraboloid", "heightfield", "nurbs")
ALIKE = 1e-3  # relative difference of areas that is none
MOST_SPLITS = 10  # of a curve, each in two
LEAST = 1e-6  # of the largest area: what is smaller has no light of its own
PATCH = 8  # pieces of a bilinear patch's sides, where it is no parallelogram
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])  # uv of a triangle without any, in pbrt
DEEPEST = 10  # levels of subdivision


@dataclass(eq=False)
class Geometry:
    """A kind of clpt, its parameters but for material and light, and warnings.

    pieces: for each triangle of a mesh the number of the shape, and so of the light, that pbrt
    makes of it: a triangle, or a patch; None: a single number. split: lights that pbrt makes of
    each piece of a curve.
    """

    kind: type[Shape]
    parts: Parts
    warnings: list[str] = field(default_factory=list)
    pieces: NDArray[np.int64] | None = None
    split: int = 1

    def areas(self) -> NDArray[np.float64]:
        """The area of each of pbrt's lights, in the world [m^2]."""
        if self.kind is shapes.Curves:
            return parametric.areas(self.parts) / self.split
        if self.kind is not shapes.Mesh:
            return np.array([parametric.area(self.kind, self.parts)])
        points = transforms.transform_points(self.parts["to_world"], self.parts["vertices"])
        crosses = transforms.edge_crosses(points, self.parts["faces"])
        triangles = 0.5 * np.linalg.norm(crosses, axis=1)
        if self.pieces is None:
            return np.array([triangles.sum()])
        return np.bincount(self.pieces, triangles) / self.split

    def shares(self) -> NDArray[np.float32] | None:
        """Return each triangle's brightness over a mean area's; None if all are alike.

        Each of pbrt's lights has the whole power, so that small lights are brighter.
        """
        areas = self.areas()
        if self.pieces is None or np.ptp(areas) <= ALIKE * areas.max():
            return None
        least = LEAST * areas.max()
        return (areas.mean() / np.maximum(areas, least))[self.pieces].astype(np.float32)

    def made(self, **more: Any) -> Shape:
        """The shape, with its material and emission."""
        return self.kind(**self.parts, **more)


def geometry(definition: Definition) -> Geometry | None:
    """Read what a Shape directive describes; None where it is empty. Raises SceneError."""
    params, kind, state = definition.params, definition.kind, definition.state
    known = SHAPES if not state.shared.old else SHAPES | OLD_SHAPES
    if kind in OLD and kind not in known:
        raise params.error(f"the shape {kind!r} is not supported; use a mesh")
    if kind not in known:
        state.stand_in(UnknownKindError("shape", kind, known, **params.location()), params)
        return None
    with params.locating():
        if transforms.is_singular(state.ctm):
            raise SceneError("its transform flattens space")
        result = known[kind](params, state)
        if result is not None:
            turned = kind in QUADRICS and transforms.flips_handedness(state.ctm)
            result.parts.setdefault("to_world", state.ctm)
            result.parts["name"] = f"{params.file.name}:{params.line}"
            reverse = state.reverse and kind != "curve"  # a tube is seen from outside
            result.parts["flip_normals"] = reverse != turned
    return result


def _triangles(params: Parameters, state: State) -> Geometry | None:
    points = params.several("P", "point3")
    if points is None:
        raise SceneError("needs the parameter 'point3 P'")
    faces = params.several("indices", "integer")
    if faces is None and len(points) != 3:
        raise SceneError("needs the parameter 'integer indices'")
    faces = np.arange(3) if faces is None else faces
    if len(faces) % 3:
        raise SceneError(f"{len(faces)} indices make no triangles")
    params.ignore("S", "faceIndices")
    normals, uvs = _per_vertex(params, "N", "normal", points), _uvs(params, points)
    return _with_pieces(_mesh(points, faces.reshape(-1, 3), normals, uvs))


def _uvs(params: Parameters, points: NDArray[Any]) -> Any:
    name = "uv" if "uv" in params else "st"
    return _per_vertex(params, name, "point2", points)


def _per_vertex(params: Parameters, name: str, type: str, points: NDArray[Any]) -> Any:
    values = params.several(name, type)
    if values is not None and len(values) != len(points):
        raise SceneError(f"{name!r} has {len(values)} values for {len(points)} vertices")
    return values


def _mesh(
    points: NDArray[Any], faces: NDArray[Any], normals: Any, uvs: Any, warnings: Any = ()
) -> Geometry | None:
    """A mesh whose triangles turn their front to where the normals point, if it has any."""
    warnings = list(warnings)
    arrays = mesh.checked(None, "", mesh.Arrays(points, faces, normals, uvs), warnings)
    if not len(arrays["faces"]):
        return None
    for name in ("vertices", "normals", "uvs"):
        if arrays[name] is not None:
            arrays[name] = np.ascontiguousarray(arrays[name], np.float32)
    if arrays["normals"] is not None:
        arrays["faces"] = _toward_normals(arrays)
    return Geometry(shapes.Mesh, arrays, warnings)


def _with_pieces(result: Geometry | None, pieces: Any = None, split: int = 1) -> Geometry | None:
    """The mesh with the numbers of pbrt's shapes (m,), by default a triangle each."""
    if result is None:
        return None
    numbers = np.arange(len(result.parts["faces"])) if pieces is None else pieces
    return replace(result, pieces=numbers, split=split)


def _toward_normals(arrays: Parts) -> NDArray[np.uint32]:
    """The faces, turned where their normals point against their winding."""
    faces, points, normals = arrays["faces"], arrays["vertices"], arrays["normals"]
    toward = normals[faces[:, 0]] + normals[faces[:, 1]] + normals[faces[:, 2]]
    turned = (transforms.edge_crosses(points, faces) * toward).sum(axis=1) < 0.0
    if not turned.any():
        return faces
    return np.where(turned[:, None], faces[:, ::-1], faces)


def with_uvs(result: Geometry) -> Geometry:
    """The geometry with pbrt's uv where it has others or none, for textures."""
    parts = dict(result.parts)
    if result.kind is shapes.Disk:
        return Geometry(
            shapes.Mesh, parts | parametric.disk_mesh(1.0, 0.0, 0.0, 360.0), result.warnings
        )
    if result.kind is shapes.Cylinder:
        ends = parts.pop("p0")[2], parts.pop("p1")[2]
        tube = parametric.cylinder_mesh(parts.pop("radius"), *ends, 360.0)
        return Geometry(shapes.Mesh, parts | tube, result.warnings)
    if result.kind is not shapes.Mesh or parts["uvs"] is not None:
        return result
    faces = parts["faces"]
    for name in ("vertices", "normals"):
        parts[name] = None if parts[name] is None else parts[name][faces.reshape(-1)]
    parts["uvs"] = np.tile(CORNERS, (len(faces), 1)).astype(np.float32)
    parts["faces"] = np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
    return Geometry(shapes.Mesh, parts, result.warnings)


def _ply(params: Parameters, state: State) -> Geometry | None:
    name = params.one("filename", "string", "")
    path = state.existing_file(name)
    try:
        arrays = ply.read(path)
        result = _mesh(arrays.vertices, arrays.faces, arrays.normals, arrays.uvs, arrays.warnings)
        result = _with_pieces(result, arrays.polygons)
        params.ignore("displacement", "edgelength", "uvscale")  # see displaced
        return result
    except SceneError as error:
        raise SceneError(f"{path.name}: {error.message}") from None


def displaced(result: Geometry, params: Parameters, state: State) -> Geometry:
    """Return a `plymesh`, displaced by an image if it has a texture for that."""
    edge, scale = params.above_zero("edgelength", 1.0), params.above_zero("uvscale", 1.0)
    if "displacement" not in params:
        return result
    heights = textured(params, "displacement", REAL, state, 0.0)
    uv = isinstance(heights, Bitmap) and heights.mapping == "uv"
    if not uv or result.parts["uvs"] is None:
        reason = "it is no image by uv" if not uv else "the mesh has no uv"
        result.warnings.append(f"'displacement' is left out, as {reason}")
        return result
    heights = replace(heights, to_uv=np.asarray(heights.to_uv) @ np.diag([scale, scale, 1.0]))
    result.parts |= {"displacement": heights, "displacement_edge": edge}
    return result


def _loop(params: Parameters, state: State) -> Geometry | None:
    points, faces = params.several("P", "point3"), params.several("indices", "integer")
    if points is None or faces is None or len(faces) % 3:
        raise SceneError("needs 'point3 P' and 'integer indices', three for every triangle")
    levels = params.one("levels", "integer", 3)
    params.ignore("scheme")
    if not 0 <= levels <= DEEPEST:
        raise SceneError(f"'levels' must be 0 to {DEEPEST}, not {levels}")
    arrays = mesh.checked(None, "", mesh.Arrays(points, faces.reshape(-1, 3)), [])
    if not len(arrays["faces"]):
        return None
    coarse = arrays["vertices"].astype(np.float64), arrays["faces"].astype(np.int64)
    limit, finer, normals = subdivision.loop(*coarse, levels)
    return _with_pieces(_mesh(limit, finer, normals, None))


def _patches(params: Parameters, state: State) -> Geometry | None:
    """Bilinear patches: two triangles where they are parallelograms, else a fine grid."""
    points, corners = params.several("P", "point3"), params.several("indices", "integer")
    if points is None:
        raise SceneError("needs the parameter 'point3 P'")
    if corners is None and len(points) != 4:
        raise SceneError("needs the parameter 'integer indices'")
    corners = np.arange(4) if corners is None else corners
    if len(corners) % 4 or corners.min(initial=0) < 0 or corners.max(initial=0) >= len(points):
        raise SceneError(f"'indices' must be four a patch, each below {len(points)}")
    # pbrt samples the patch by that image; what it emits is the light's.
    params.ignore("emissionfilename", "faceIndices")
    normals, uvs = _per_vertex(params, "N", "normal", points), _uvs(params, points)
    corners = corners.reshape(-1, 4)
    tolerance = np.abs(points[corners] @ np.eye(3)).max(initial=1.0) * 1e-5
    twist = points[corners[:, 0]] - points[corners[:, 1]] - points[corners[:, 2]]
    plain = bool((np.abs(twist + points[corners[:, 3]]) <= tolerance).all())
    u, v, faces = parametric.grid(*([1, 1] if plain else [PATCH, PATCH]))
    result = _mesh(*_over_patches(u, v, faces, corners, (points, normals, uvs), plain))
    return _with_pieces(result, np.repeat(np.arange(len(corners)), len(faces)))


def _over_patches(
    u: Any, v: Any, faces: Any, corners: Any, arrays: tuple[Any, Any, Any], plain: bool
) -> tuple[Any, Any, Any, Any]:
    """Points, faces, normals and uvs of a grid laid over every patch."""
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], axis=1)
    points, normals, uvs = arrays
    laid = weights @ points[corners]
    if normals is not None:
        normals = (weights @ normals[corners]).reshape(-1, 3)
    elif not plain:
        along = np.stack([v - 1, 1 - v, -v, v], axis=1) @ points[corners]
        across = np.stack([u - 1, -u, 1 - u, u], axis=1) @ points[corners]
        normals = np.cross(along, across).reshape(-1, 3)
    inner = np.stack([u, v], axis=1)
    over = np.tile(inner, (len(corners), 1)) if uvs is None else weights @ uvs[corners]
    starts = len(u) * np.arange(len(corners))[:, None, None]
    return laid.reshape(-1, 3), (faces + starts).reshape(-1, 3), normals, over.reshape(-1, 2)


def _sphere(params: Parameters, state: State) -> Geometry | None:
    radius, turn = params.above_zero("radius", 1.0), parametric.phi_max(params)
    z = sorted(np.clip([params.one(n, "float", d) for n, d in _ends(radius)], -radius, radius))
    whole = z[0] <= -radius and z[1] >= radius and turn == 360.0
    if whole and parametric.is_even(state.ctm, 3):
        parts = {"radius": radius, "to_world": state.ctm @ parametric.UPWARD}
        return Geometry(shapes.Sphere, parts)
    if z[0] == z[1]:
        return None
    low, high = (math.acos(max(-1.0, min(1.0, end / radius))) for end in z)
    return Geometry(shapes.Mesh, parametric.sphere_mesh(radius, low, high, turn))


def _ends(radius: float) -> tuple[tuple[str, float], tuple[str, float]]:
    return ("zmin", -radius), ("zmax", radius)


def _disk(params: Parameters, state: State) -> Geometry | None:
    radius, turn = params.above_zero("radius", 1.0), parametric.phi_max(params)
    height, inner = params.one("height", "float", 0.0), params.one("innerradius", "float", 0.0)
    if inner == 0.0 and turn == 360.0:
        local = transforms.translate([0.0, 0.0, height]) @ transforms.scale([radius, radius, 1.0])
        return Geometry(shapes.Disk, {"to_world": state.ctm @ local})
    if not 0.0 <= inner < radius:
        raise SceneError(f"'innerradius' must be below the radius, not {inner:g}")
    return Geometry(shapes.Mesh, parametric.disk_mesh(radius, inner, height, turn))


def _cylinder(params: Parameters, state: State) -> Geometry | None:
    radius, turn = params.above_zero("radius", 1.0), parametric.phi_max(params)
    low, high = sorted((params.one("zmin", "float", -1.0), params.one("zmax", "float", 1.0)))
    if low == high:
        return None
    if turn == 360.0 and parametric.is_even(state.ctm, 2):
        ends = {"p0": (0.0, 0.0, low), "p1": (0.0, 0.0, high)}
        return Geometry(shapes.Cylinder, {"radius": radius, **ends, "to_world": state.ctm})
    return Geometry(shapes.Mesh, parametric.cylinder_mesh(radius, low, high, turn))


def _curve(params: Parameters, state: State) -> Geometry | None:
    kind, parts = parametric.curve(params)
    split = 2 ** min(max(params.one("splitdepth", "integer", 3), 0), MOST_SPLITS)
    if kind is None:
        result = _mesh(parts["points"], parts["faces"], parts["normals"], parts["uvs"])
        cubics = np.arange(len(parts["faces"])) // (2 * parametric.PIECES)
        return _with_pieces(result, cubics, split)
    current = state.material
    if isinstance(current, str):
        current = state.latest(state.shared.materials.get(current))
    flat = params.one("type", "string", "flat") == "flat"
    if not flat or (current is not None and current.kind == "hair"):  # there is no difference
        return Geometry(kind, parts, split=split)
    return Geometry(kind, parts, ["a flat curve is shaded as a round one"], split=split)


def _cone(params: Parameters, state: State) -> Geometry | None:
    radius, height = params.above_zero("radius", 1.0), params.above_zero("height", 1.0)
    return _revolved(params, [[radius, 0.0, 0.0], [0.0, 0.0, height]])


def _paraboloid(params: Parameters, state: State) -> Geometry | None:
    radius = params.above_zero("radius", 1.0)
    low, high = sorted((params.one("zmin", "float", 0.0), params.one("zmax", "float", 1.0)))
    if not 0.0 <= low < high:
        raise SceneError("'zmin' and 'zmax' must differ, and not be negative")
    z = np.linspace(low, high, parametric.ALONG + 1)
    r = radius * np.sqrt(z / high)
    return _revolved(params, np.stack([r, np.zeros_like(r), z], axis=1))


def _hyperboloid(params: Parameters, state: State) -> Geometry | None:
    """A hyperboloid about z = 0 as pbrt-v3 has it, which is not the turned line p1 to p2.

    It goes through p2 and a point of the line behind p2: src/shapes/hyperboloid.cpp.
    """
    p1 = np.array(params.one("p1", "point3", (0.0,) * 3))
    p2 = np.array(params.one("p2", "point3", (1.0,) * 3))
    if p2[2] == 0.0:
        p1, p2 = p2, p1
    parts = np.linspace(0.0, 1.0, parametric.ALONG + 1)[:, None]
    line = (1.0 - parts) * p1 + parts * p2
    if p2[2] == 0.0:
        return _revolved(params, line)  # a flat ring, at which pbrt does not end
    behind, squares = p1, np.zeros(2)
    for _ in range(MOST_STEPS):
        behind = behind + 2.0 * (p2 - p1)
        rows = np.array(
            [[point[0] ** 2 + point[1] ** 2, -(point[2] ** 2)] for point in (behind, p2)]
        )
        if np.linalg.det(rows) != 0.0:
            squares = np.linalg.solve(rows, np.ones(2))
            break
    if squares[0] == 0.0:
        raise SceneError("no hyperboloid goes through 'p1' and 'p2'")
    radii = np.sqrt(np.maximum((1.0 + squares[1] * line[:, 2:] ** 2) / squares[0], 0.0))
    lengths = np.linalg.norm(line[:, :2], axis=1, keepdims=True)
    around = np.where(
        lengths > 0.0, line[:, :2] / np.where(lengths > 0.0, lengths, 1.0), [1.0, 0.0]
    )
    return _revolved(params, np.hstack([around * radii, line[:, 2:]]))


def _revolved(params: Parameters, profile: ArrayLike) -> Geometry | None:
    turn = parametric.phi_max(params)
    return Geometry(shapes.Mesh, parametric.revolved_mesh(np.asarray(profile, np.float64), turn))


def _heightfield(params: Parameters, state: State) -> Geometry | None:
    """A grid of heights over the unit square: pbrt-v3, src/shapes/heightfield.cpp."""
    columns, rows = (params.one(name, "integer", 0) for name in ("nu", "nv"))
    heights = params.several("Pz", "float")
    if min(columns, rows) < 2 or heights is None or len(heights) != columns * rows:
        raise SceneError("needs 'nu' and 'nv' of at least 2, and nu times nv numbers 'Pz'")
    u, v, faces = parametric.grid(columns - 1, rows - 1)
    points = np.stack([u, v, heights], axis=1)
    return _with_pieces(_mesh(points, faces, None, np.stack([u, v], axis=1)))


SHAPES: dict[str, Maker[Geometry | None]] = {
    "bilinearmesh": _patches,
    "curve": _curve,
    "cylinder": _cylinder,
    "disk": _disk,
    "loopsubdiv": _loop,
    "plymesh": _ply,
    "sphere": _sphere,
    "trianglemesh": _triangles,
}
OLD_SHAPES: dict[str, Maker[Geometry | None]] = {
    "cone": _cone,
    "heightfield": _heightfield,
    "hyperboloid": _hyperboloid,
    "paraboloid": _paraboloid,
}
