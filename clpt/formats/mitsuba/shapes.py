"""Shapes of a Mitsuba scene, with their groups and instances."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, transforms
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats import volumes
from clpt.formats.meshes import spheres_curves
from clpt.formats.mitsuba.bsdfs import bsdf
from clpt.formats.mitsuba.emitters import area
from clpt.formats.mitsuba.media import body, side
from clpt.formats.mitsuba.properties import (
    Context,
    NoArea,
    PluginReader,
    Properties,
    Wanted,
    unknown,
)
from clpt.formats.mitsuba.xml import Element
from clpt.formats.reading import attempt
from clpt.geometry import polygons
from clpt.scene import shapes
from clpt.scene.materials import Dielectric, Diffuse, Material, Null
from clpt.scene.shapes import Group, Instance, Shape

_READERS = (
    "mitsuba/mesh_files", "reading", "meshes/mesh", "meshes/obj", "meshes/ply", "meshes/triangles",
)  # fmt: skip
MESH_CODE: tuple[str | Path, ...] = (
    *(Path(__file__).parents[1] / f"{name}.py" for name in _READERS),
    *(str(module.__file__) for module in (polygons, input_files, transforms, images.colour)),
)
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


def _mesh(props: Properties, suffix: str, *, flip_v: bool) -> Parameters:
    """Read a mesh into world space, where Mitsuba makes the normals that the file lacks."""
    path, context = props.file(), props.context
    flat = props.flag("face_normals", False)
    crease = props.number("max_smooth_angle", -1.0) if context.old else -1.0
    to_world = props.placement(thin=True)
    if path.suffix.lower() != suffix:
        raise props.element.error(f"{path.name!r} is not a {suffix} file")
    number = props.integer("shape_index", 0) if suffix == ".serialized" else 0
    wanted = Wanted(suffix, number, flat, crease, context.document.makes_normals, flip_v)
    try:
        status = input_files.regular(path)

        def make() -> tuple[Parameters, list[str]]:
            from clpt.formats.mitsuba import mesh_files  # here: known meshes need no reader

            return mesh_files.in_world(path, wanted, to_world, context.archives)

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
