"""Shapes of a Mitsuba scene, with their groups and instances, and .serialized meshes.

A .serialized file has several meshes, each packed by deflate (mitsuba.readthedocs.io, "Serialized
mesh loader").
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clpt import images, transforms
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats import reading, volumes
from clpt.formats.meshes import mesh, obj, ply, spheres_curves, triangles
from clpt.formats.mitsuba.bsdfs import bsdf
from clpt.formats.mitsuba.emitters import area
from clpt.formats.mitsuba.media import body, side
from clpt.formats.mitsuba.properties import Context, NoArea, PluginReader, Properties, unknown
from clpt.formats.mitsuba.xml import Element
from clpt.formats.reading import attempt
from clpt.geometry import polygons
from clpt.geometry.polygons import smooth_normals
from clpt.scene import shapes
from clpt.scene.materials import Dielectric, Diffuse, Material, Null
from clpt.scene.shapes import Group, Instance, Mesh, Shape

MAGIC = 0x041C
VERSIONS = (3, 4)
NORMALS, UVS, COLOURS, FLAT, DOUBLE = 0x0001, 0x0002, 0x0008, 0x0010, 0x2000
DEFLATE = 1032  # most bytes that a compressed byte of deflate stands for


class _Stream:
    """The decompressed bytes of a mesh, read in their order."""

    def __init__(self, path: Path, packed: bytes):
        self.path, self.packed, self.inflate = path, packed, zlib.decompressobj()
        self.left = DEFLATE * len(packed)

    def take(self, size: int) -> bytes:
        """Return the next bytes. Raises SceneError where there are fewer."""
        if size > self.left:
            raise SceneError("names more vertices or triangles than it can hold", file=self.path)
        budget.check(2 * size, "a mesh in it", self.path)
        self.left -= size
        parts = []
        while size > 0:
            try:
                part = self.inflate.decompress(self.packed, size)
            except zlib.error as error:
                raise SceneError(f"is damaged: {error}", file=self.path) from None
            self.packed = self.inflate.unconsumed_tail
            if not part:
                raise SceneError("ends too early", file=self.path)
            parts.append(part)
            size -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def array(self, rows: int, columns: int, dtype: str) -> NDArray[Any]:
        data = self.take(rows * columns * np.dtype(dtype).itemsize)
        return np.frombuffer(data, dtype).reshape(rows, columns)

    def text(self) -> str:
        """Return the text up to a zero byte."""
        characters = bytearray()
        while (byte := self.take(1)) != b"\0":
            characters += byte
            if len(characters) > 4096:
                raise SceneError("a mesh's name has no end", file=self.path)
        return characters.decode("utf-8", "replace")


def read(path: Path, index: int, archives: dict[Path, bytes]) -> tuple[Mesh, bool, list[str]]:
    """Return the mesh number `index` of a file, whether it is to be flat, and what was left out.

    archives: the contents of the files that were read before, by path; a file is read once.
    Raises SceneError for a file that is missing or broken, or has no such mesh.
    """
    if not archives.get(path):
        archives[path] = input_files.read_bytes(path)
    data = archives[path]
    first, end, version = _mesh_range(path, data, index)
    stream = _Stream(path, data[first + 4 : end])
    (flags,) = struct.unpack("<I", stream.take(4))
    name = stream.text() if version == 4 else path.name
    n_vertices, n_faces = struct.unpack("<QQ", stream.take(16))
    real = "<f8" if flags & DOUBLE else "<f4"
    vertices = stream.array(n_vertices, 3, real)
    normals = stream.array(n_vertices, 3, real) if flags & NORMALS else None
    uvs = stream.array(n_vertices, 2, real) if flags & UVS else None
    inner = {"vertex_color": stream.array(n_vertices, 3, real)} if flags & COLOURS else {}
    wide = "<u8" if n_vertices > 0xFFFFFFFF else "<u4"
    faces = stream.array(n_faces, 3, wide)
    warnings: list[str] = []
    values = mesh.Arrays(vertices, faces, normals, uvs, inner)
    arrays = mesh.checked(path, name, values, warnings)
    if not len(arrays["faces"]):
        raise SceneError("holds no triangles", file=path)
    return Mesh(name=name, **arrays), bool(flags & FLAT), warnings


def _mesh_range(path: Path, data: bytes, index: int) -> tuple[int, int, int]:
    """Return where a mesh begins and ends, by the table at the file's end, and the version."""
    if len(data) < 12 or struct.unpack_from("<H", data)[0] != MAGIC:
        raise SceneError("is not a .serialized file", file=path)
    (version,) = struct.unpack_from("<H", data, 2)
    if version not in VERSIONS:
        raise SceneError(f"is of version {version}, not 3 or 4", file=path)
    (count,) = struct.unpack_from("<I", data, len(data) - 4)
    width = 8 if version == 4 else 4
    table = len(data) - 4 - width * count
    if count == 0 or table < 4:
        raise SceneError("has a broken table of meshes", file=path)
    if index >= count:
        raise SceneError(f"has no mesh {index}: it holds {count}", file=path)
    offsets = [*np.frombuffer(data, f"<u{width}", count, table).tolist(), table]
    first, end = offsets[index], offsets[index + 1]
    if not first + 4 <= end <= table or struct.unpack_from("<H", data, first)[0] != MAGIC:
        raise SceneError(f"has a broken mesh {index}", file=path)
    return first, end, version


MOST_TURNS = 64  # groups of triangles around a vertex; what is left after them stays together


def creased(mesh: Mesh, angle: float) -> Mesh:
    """Return a mesh without normals whose triangles share a vertex where they lie within an angle.

    angle: of the triangles' normals [degrees]. As src/librender/trimesh.cpp (rebuildTopology):
    at each position the first triangle without a group begins a group of all triangles within the
    angle to it.
    """
    faces = np.asarray(mesh.faces, np.int64)
    corners = faces.reshape(-1)
    places = _places(mesh)[corners]
    flat = transforms.unit_vectors(transforms.edge_crosses(mesh.vertices, faces))
    normals = np.repeat(flat, 3, axis=0)
    group = np.full(len(corners), -1)
    least = np.cos(np.radians(min(angle, 180.0)))
    for turn in range(MOST_TURNS):
        waiting = np.flatnonzero(group < 0)
        if not len(waiting):
            break
        kept, first = np.unique(places[waiting], return_index=True)
        seeds = waiting[first][np.searchsorted(kept, places[waiting])]
        near = np.einsum("ij,ij->i", normals[waiting], normals[seeds]) >= least
        group[waiting[near | (waiting == seeds)]] = turn
    keys = np.stack([places, group], axis=1)
    _, first, joined = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    kept = corners[first]
    return replace(
        mesh,
        vertices=mesh.vertices[kept],
        faces=joined.reshape(-1, 3).astype(np.uint32),
        normals=None,
        uvs=None if mesh.uvs is None else mesh.uvs[kept],
        attributes={
            name: values[kept] if name.startswith("vertex_") else values
            for name, values in mesh.attributes.items()
        },
    )


def _places(mesh: Mesh) -> NDArray[Any]:
    """Return for each vertex the number of its place: its position, and uv if it has any."""
    parts = [np.asarray(mesh.vertices, np.float32)]
    if mesh.uvs is not None:
        parts.append(np.asarray(mesh.uvs, np.float32))
    return np.unique(np.concatenate(parts, axis=1), axis=0, return_inverse=True)[1].reshape(-1)


_MODULES = mesh, obj, ply, triangles, polygons, reading, input_files, transforms, images.colour
MESH_CODE = (__file__, *(str(module.__file__) for module in _MODULES))
Parameters = dict[str, Any]
SDF_PIECES = 4  # of the side of a cell
UNEVEN = 1e-3  # relative stretch of round shapes that a transform may have
METER = "a sensor on a shape gives a number and no picture: clpt has none"
STRETCH = "stretch"  # no parameter: a transform that the shape takes as an instance


def shapes_of(elements: Iterable[Element], context: Context) -> list[Shape]:
    """Make the shapes that <shape> elements describe; a shapegroup makes none, but is checked.

    The shapes in a <shape type="merge"> are made as if they stood beside it.
    """
    result: list[Shape] = []
    for element in elements:
        if element.type == "shapegroup":
            _group(element, context)
        elif element.type == "merge":
            result += shapes_of(_merged(element, context), context)
        else:
            with suppress(NoArea):
                result += attempt(partial(_single, element, context), [])
    return result


def _single(element: Element, context: Context) -> list[Shape]:
    """Make the shape of an element; None for an unknown kind if missing kinds are grey."""
    if element.type == "instance":
        return [_instance(element, context)]
    plugins = _plugins(context)
    if element.type not in plugins:
        known = (*plugins, "shapegroup", "instance", "merge")
        return context.stand_in(unknown(element, known), element, [])
    return [shape(element, context)]


def _plugins(context: Context) -> dict[str, tuple[type[Shape], PluginReader[Parameters]]]:
    return {**PLUGINS, **OF_OLD} if context.old else PLUGINS


def _merged(element: Element, context: Context) -> list[Element]:
    props = Properties(element, context)
    inner = props.objects("shape")
    props.finish()
    for child in inner:
        if child.type in ("merge", "shapegroup"):
            raise child.error('cannot stand in a <shape type="merge">')
    return inner


def shape(element: Element, context: Context) -> Shape:
    """Make the shape that a <shape> describes, which is no group and no instance."""
    cls, read = _plugins(context)[element.type]
    props = Properties(element, context)
    props.ignore("silhouette_sampling_weight")
    material, emitter = props.object("bsdf"), props.object("emitter")
    for sensor in props.objects("sensor"):
        raise sensor.error(METER)
    media = {name: side(props, name) for name in ("interior", "exterior")}
    if material is None:
        surface = _default_material(emitter, in_medium=context.old and any(media.values()))
    else:
        surface = bsdf(material, context)
    parameters: Parameters = {
        "material": surface,
        "emission": None if emitter is None else area(emitter, context),
        **media,
        **_body(props),
        "flip_normals": props.flag("flip_normals", False),
        "name": element.attributes.get("id", ""),
    }
    parameters |= read(props)
    stretch = parameters.pop(STRETCH, None)
    if cls is shapes.Sphere and transforms.flips_handedness(parameters["to_world"]):
        # A mirror turns Mitsuba's spheres inside out, and no other shape.
        parameters["flip_normals"] = not parameters["flip_normals"]
    with element.locating():
        if stretch is None:
            result: Shape = cls(**parameters, motion=props.motion)
        else:
            inner = cls(**parameters)
            group = Group((inner,), inner.name or inner.kind)
            result = Instance(group=group, to_world=stretch, name=inner.name, motion=props.motion)
    props.finish()
    return result


def _instance(element: Element, context: Context) -> Shape:
    props = Properties(element, context)
    group = props.object("shape")
    if group is None or group.type != "shapegroup":
        raise element.error('needs a <shape type="shapegroup">, or a <ref> to one')
    name = element.attributes.get("id", "")
    with element.locating():
        to_world = props.placement(thin=True)
        result = Instance(
            group=_group(group, context), to_world=to_world, motion=props.motion, name=name
        )
    props.finish()
    return result


def _group(element: Element, context: Context) -> Group:
    """Return the group that an element describes, shared by all its instances."""

    def make(element: Element) -> Group:
        props = Properties(element, context)
        inner = props.objects("shape")
        for child in inner:
            if child.type in ("shapegroup", "instance"):
                raise child.error("cannot stand in a shapegroup")
        props.finish()
        return Group(tuple(shapes_of(inner, context)), element.attributes.get("id", ""))

    return context.once(element, make)


def _body(props: Properties) -> Parameters:
    """Take Mitsuba 0.6's <subsurface>: a smooth boundary, and the medium inside."""
    element = props.object("subsurface")
    if element is None:
        return {}
    medium, inside, outside = body(element, props.context)
    return {"material": Dielectric(int_ior=inside, ext_ior=outside), "interior": medium}


def _default_material(emitter: Element | None, in_medium: bool) -> Material:
    """Return the material of a shape without a bsdf: grey, but black where it emits.

    in_medium: whether Mitsuba 0.6 lets light through, as at the border of a medium: shape.cpp.
    """
    if in_medium:
        return Null()
    return Diffuse() if emitter is None else Diffuse(reflectance=0.0)


def _transform_only(props: Properties) -> Parameters:
    return {"to_world": props.placement(thin=True)}


def _sphere(props: Properties) -> Parameters:
    centre, radius = props.vector("center", (0.0, 0.0, 0.0)), _radius(props)
    to_world, even = _placed(props, (0.0, 0.0, 0.0))
    if even:
        return {"center": centre, "radius": radius, "to_world": to_world}
    message = "to_world stretches or shears the sphere, which stays round, as in Mitsuba"
    props.context.warn(props.element, message)
    turned, sizes = _rounded(to_world @ transforms.translate(centre))
    return {"center": (0.0, 0.0, 0.0), "radius": radius * sizes[0, 0], "to_world": turned}


def _cylinder(props: Properties) -> Parameters:
    p0, p1 = props.vector("p0", (0.0, 0.0, 0.0)), props.vector("p1", (0.0, 0.0, 1.0))
    if p0 == p1:
        raise props.element.error("p0 and p1 are the same point")
    radius = _radius(props)
    to_world, even = _placed(props, np.subtract(p1, p0))
    if even:
        return {"p0": p0, "p1": p1, "radius": radius, "to_world": to_world}
    return {"p0": p0, "p1": p1, "radius": radius, STRETCH: to_world}


def _rounded(matrix: transforms.Matrix) -> tuple[transforms.Matrix, NDArray[np.float64]]:
    """Part a matrix into what turns, mirrors and moves, (4, 4), and what stretches, (3, 3).

    Mitsuba takes a sphere's radius from the first number of the latter.
    """
    u, sizes, v = np.linalg.svd(matrix[:3, :3])
    turned = matrix.copy()
    turned[:3, :3] = u @ v
    return turned, v.T @ np.diag(sizes) @ v


def _placed(props: Properties, axis: Any) -> tuple[transforms.Matrix, bool]:
    """Take a transform, and tell whether it keeps a shape round about an axis, or about a point."""
    to_world = props.placement(thin=True)
    products = to_world[:3, :3].T @ to_world[:3, :3]
    along = np.outer(axis, axis) / max(np.dot(axis, axis), 1e-300)
    length = np.sum(along * products)
    even = (np.trace(products) - length) / (3.0 - np.trace(along))
    uneven = products - even * np.eye(3) - (length - even * np.trace(along)) * along
    return to_world, bool(np.abs(uneven).max() <= UNEVEN * np.trace(products))


def _radius(props: Properties) -> float:
    radius = props.number("radius", 1.0)
    if radius <= 0.0:
        raise props.element.error(f"the radius must be positive, not {radius:g}")
    return radius


def _obj(props: Properties) -> Parameters:
    return _mesh(props, ".obj", flip_v=props.flag("flip_tex_coords", True))


def _ply(props: Properties) -> Parameters:
    return _mesh(props, ".ply", flip_v=props.flag("flip_tex_coords", False))


def _serialized(props: Properties) -> Parameters:
    return _mesh(props, ".serialized", flip_v=False)


class _Wanted(NamedTuple):
    """An element's statements on the mesh in a file.

    number: of the mesh in a .serialized file; flat: without normals; crease: largest angle between
    smooth triangles [deg], below 0 for any; smooth: whether normals are made where there are none.
    """

    suffix: str
    number: int
    flat: bool
    crease: float
    smooth: bool
    flip_v: bool


def _mesh(props: Properties, suffix: str, *, flip_v: bool) -> Parameters:
    """Read a mesh into world space, where Mitsuba makes the normals that the file lacks."""
    path, context = props.file(), props.context
    flat = props.flag("face_normals", False)
    crease = props.number("max_smooth_angle", -1.0) if context.old else -1.0
    to_world = props.placement(thin=True)
    if path.suffix.lower() != suffix:
        raise props.element.error(f"{path.name!r} is not a {suffix} file")
    number = props.integer("shape_index", 0) if suffix == ".serialized" else 0
    wanted = _Wanted(suffix, number, flat, crease, context.document.makes_normals, flip_v)
    try:
        status, make = (
            input_files.regular(path),
            partial(_in_world, path, wanted, to_world, context),
        )
        by = *wanted, path.name, to_world.tobytes()
        (arrays, warnings), new = context.document.meshes.get(status, by, make)
        if not new:
            _count(path, status, arrays, context)
    except SceneError as error:
        raise props.element.error(f"{path.name}: {error.message}") from None
    for warning in warnings:
        context.warn(props.element, f"{path.name}: {warning}")
    return dict(arrays)


def _count(path: Path, status: os.stat_result, arrays: Parameters, context: Context) -> None:
    """Count a mesh that an earlier process has read, as if its file was read now."""
    if path not in context.archives:
        budget.reads(status)
    if path.suffix.lower() == ".serialized":  # such a file is read once, for all of its meshes
        context.archives[path] = context.archives.get(path, b"")
    held = [a for a in (*arrays.values(), *arrays["attributes"].values()) if a is not None]
    size = sum(a.nbytes for a in held if isinstance(a, np.ndarray))
    budget.take(size, f"the mesh {path.name!r}", path)
    budget.take_parts(1, "meshes", path)


def _in_world(
    path: Path, wanted: _Wanted, to_world: transforms.Matrix, context: Context
) -> tuple[Parameters, list[str]]:
    """Return the arrays of a mesh in world space, and warnings."""
    flat = wanted.flat
    if wanted.suffix == ".serialized":
        whole, own_flat, warnings = read(path, wanted.number, context.archives)
        flat |= own_flat
    else:
        loaded = mesh.read_mesh(path, materials=False)
        whole, warnings = mesh.join(loaded.meshes), loaded.warnings
    if wanted.crease >= 0.0 and not flat:
        whole = creased(whole, wanted.crease)
    flat |= whole.normals is None and not wanted.smooth
    vertices, moves = whole.vertices, not np.array_equal(to_world, transforms.IDENTITY)
    if moves:
        vertices = transforms.transform_points(to_world, vertices).astype(np.float32)
    uvs = whole.uvs
    if uvs is not None and wanted.flip_v:
        uvs = np.column_stack([uvs[:, 0], 1.0 - uvs[:, 1]]).astype(np.float32)
    normals, faces = None if flat else whole.normals, whole.faces
    if not flat and normals is None:
        normals = smooth_normals(vertices, faces)
    elif not flat and moves:
        normals = transforms.transform_normals(to_world, whole.normals).astype(np.float32)
        if transforms.flips_handedness(to_world):
            faces = faces[:, ::-1].copy()  # the file's normals decide the front, not the winding
    arrays = {"vertices": vertices, "faces": faces, "normals": normals, "uvs": uvs}
    return {**arrays, "attributes": dict(whole.attributes)}, warnings


def _bspline_curve(props: Properties) -> Parameters:
    return {"basis": "bspline", **_curves(props)}


def _linear_curve(props: Properties) -> Parameters:
    return {"basis": "linear", **_curves(props)}


def _hair(props: Properties) -> Parameters:
    """Mitsuba 0.x: strands of an even radius, which `to_world` scales: src/shapes/hair.cpp."""
    props.ignore("angle_threshold")
    if props.number("reduction", 0.0) != 0.0:
        props.context.warn(props.element, "'reduction' is left out: all strands are there")
    radius = props.number("radius", 0.025)
    arrays, to_world = _strands(props, spheres_curves.read_hair)
    radii = np.full(len(arrays["points"]), radius * np.linalg.norm(to_world[:3, 2]), np.float32)
    return {**arrays, "basis": "linear", "points": np.column_stack([arrays["points"], radii])}


def _curves(props: Properties) -> Parameters:
    """Read strands; `to_world` moves their points and, as in Mitsuba, leaves their radii."""
    return _strands(props, spheres_curves.read_strands)[0]


def _strands(
    props: Properties, read: Callable[[Path], dict[str, Any]]
) -> tuple[Parameters, transforms.Matrix]:
    """Return the strands of a file in the world, and `to_world`."""
    path, to_world = props.file(), props.placement(thin=True)
    try:
        arrays = read(path)
    except SceneError as error:
        line = f":{error.line}" if error.line else ""
        raise props.element.error(f"{path.name}{line}: {error.message}") from None
    points = arrays["points"]
    points[:, :3] = transforms.transform_points(to_world, points[:, :3])
    return arrays, to_world


def _sdf_grid(props: Properties) -> Parameters:
    """Mitsuba's silhouettes are those of the cells' trilinear distance; so are these vertices."""
    path = props.file()
    if props.text("normals", "smooth", ("analytic", "smooth")) == "analytic":
        message = "normals 'analytic' jump where cells meet; they are smooth here"
        props.context.warn(props.element, message)
    props.ignore("watertight")
    try:
        values = volumes.distances(path)
    except SceneError as error:
        raise props.element.error(f"{path.name}: {error.message}") from None
    return {"values": values, "to_world": props.placement(thin=True), "pieces": SDF_PIECES}


PLUGINS: dict[str, tuple[type[Shape], PluginReader[Parameters]]] = {
    "obj": (shapes.Mesh, _obj),
    "ply": (shapes.Mesh, _ply),
    "serialized": (shapes.Mesh, _serialized),
    "sphere": (shapes.Sphere, _sphere),
    "rectangle": (shapes.Rectangle, _transform_only),
    "disk": (shapes.Disk, _transform_only),
    "cube": (shapes.Cube, _transform_only),
    "cylinder": (shapes.Cylinder, _cylinder),
    "bsplinecurve": (shapes.Curves, _bspline_curve),
    "linearcurve": (shapes.Curves, _linear_curve),
    "sdfgrid": (shapes.SdfGrid, _sdf_grid),
}
OF_OLD: dict[str, tuple[type[Shape], PluginReader[Parameters]]] = {  # of Mitsuba 0.x alone
    "hair": (shapes.Curves, _hair),
}
