"""Shapes: where surfaces are. All but spheres, disks, cylinders and curves become triangles."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import in_memory
from clpt.errors import SceneError
from clpt.scene import trimeshes
from clpt.scene.lights import ON_SHAPES, PoweredLamp
from clpt.scene.materials import Diffuse, Material
from clpt.scene.media import Medium
from clpt.scene.motion import Deformation, Keys
from clpt.scene.params import Kind, choice, host
from clpt.scene.textures import Bitmap
from clpt.scene.values import Matrix4, OnDevice, Vector3

ShapeKind = TypeVar("ShapeKind", bound="Shape")
SMOOTH = "smooth"  # normals of a mesh: the means of the triangles around a vertex, by their areas
NO_ATTRIBUTES: Mapping[str, Any] = MappingProxyType({})
BASES = ("linear", "bspline", "bezier")


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape(Kind):
    """Base of all shapes; placed by `to_world`."""

    is_tree = False  # it holds trees side by side
    is_open: ClassVar[bool] = False  # no shape of this kind encloses a volume by itself
    deformed_field: ClassVar[str] = ""  # the parameter that a deformation replaces by its points
    flattens: ClassVar[bool] = False  # its triangles may have no area, as of a tube of radius 0
    # of a kind without such parameters
    group = cast("Group | None", None)
    attributes = NO_ATTRIBUTES
    vertices = cast(Any, None)
    faces = cast(Any, None)
    radii = cast(Any, None)
    normals = cast(Any, None)
    tangents = cast(Any, None)
    deformation = cast("Deformation | None", None)
    displacement = cast("Bitmap | None", None)

    @property
    def members(self) -> tuple[Shape, ...]:
        """The shape, or the shapes that an instance places."""
        return (self,)

    @property
    def shared_parts(self) -> dict[str, Any]:
        """The parts that other shapes may share, by their parameters."""
        return {"material": self.material}

    def at_time(self: ShapeKind, time: float) -> ShapeKind:
        """Return the shape with the points of its deformation at a time [s], without deformation.

        Its `deformation` must not be None.
        """
        points, _ = cast(Deformation, self.deformation).at(time)
        changes: dict[str, Any] = {self.deformed_field: points, "deformation": None}
        return dataclasses.replace(self, **changes)

    def placed(self: ShapeKind, to_world: ArrayLike) -> ShapeKind:
        """Return the shape with another `to_world`, (4, 4); no other parameter is checked again."""
        return self.placed_at([in_memory(to_world)])[0]

    def placed_at(self: ShapeKind, to_worlds: Iterable[ArrayLike]) -> list[ShapeKind]:
        """Return the shape at each of `to_worlds`, (4, 4) in memory, as `placed` does."""
        return [self.altered(to_world=to_world) for to_world in to_worlds]

    material: Material = host(Diffuse(), "of the surface", form="material")
    emission: PoweredLamp | None = host(None, "an `area` light, or None", form="area_light")
    interior: Medium | None = host(None, "medium behind its front, or None", form="medium")
    exterior: Medium | None = host(None, "medium before its front, or None", form="medium")
    priority: int = host(
        0, "where bodies overlap, the body with the highest priority fills the place"
    )
    to_world: Matrix4 | OnDevice = host(np.eye(4), "placement, (4, 4)")
    motion: Keys | None = host(None, "moves it after `to_world`, or None", form="keys")
    flip_normals: bool = host(False, "turn the front to the other side")
    name: str = host("", "for messages")

    def check(self) -> None:
        """Raise SceneError for a material or a light that is none."""
        material: object = self.material
        if not isinstance(material, Material):
            advice = "such as clpt.scene.materials.Diffuse()"
            message = f"must be a material, {advice}, not {material!r}"
            raise SceneError(message, where=f"{self.kind}.material")
        if not isinstance(self.emission, (*ON_SHAPES, type(None))):
            names = " or ".join(cls.__name__ for cls in ON_SHAPES)
            message = f"must be a light of a surface, {names}, not {self.emission!r}"
            raise SceneError(message, where=f"{self.kind}.emission")


def check_faces(faces: NDArray[Any], vertices: int, where: str) -> None:
    """Raise SceneError for faces (m, 3) of integers that name a vertex beyond so many."""
    lowest, highest = int(faces.min()), int(faces.max())
    if lowest < 0 or highest >= vertices:
        wrong = lowest if lowest < 0 else highest
        raise SceneError(f"a face names vertex {wrong}, there are {vertices}", where=where)


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh(Shape):
    """Triangles, counter-clockwise seen from the front."""

    deformed_field = "vertices"

    vertices: Any = host(None, "(n, 3) float32", "m", form="rows3")
    faces: Any = host(None, "(m, 3) uint32", form="triangles")
    normals: Any = host(
        None,
        "(n, 3) float32 per vertex; None for flat; 'smooth': from the triangles",
        form="normals",
    )
    uvs: Any = host(None, "(n, 2) float32 per vertex, or None", form="rows2")
    tangents: Any = host(
        None,
        "(n, 4) float32 per vertex, beside normals: the tangent, along u; and 1 or -1, as v is on "
        "the side of normal x tangent or not; None: from the uvs",
        form="rows4",
    )
    attributes: Mapping[str, Any] = host(
        {},
        "name -> (n, 1 or 3) float32; one row a vertex or a face, as vertex_ or face_ begins it",
        form="attributes",
    )
    deformation: Deformation | None = host(
        None, "where the vertices are at times, or None", form="deformation"
    )
    subdivision: int = host(0, "levels of Loop subdivision, to the smooth limit surface; 0: none")
    displacement: Bitmap | None = host(
        None, "bitmap: heights by uv, along smooth normals, after subdivision", form="texture"
    )
    displacement_scale: float = host(1.0, "factor on them", "m")
    displacement_edge: float = host(0.05, "longest edge of displaced triangles, in the world", "m")

    def at_time(self, time: float) -> Mesh:
        """Return the mesh with the vertices and normals of its deformation at a time [s]."""
        _, normals = cast(Deformation, self.deformation).at(time)
        still = super().at_time(time)
        normals = self.normals if normals is None else normals
        return dataclasses.replace(still, normals=normals, tangents=None)

    def check(self) -> None:
        """Raise SceneError for faces of vertices that are not there, as far as the host knows."""
        super().check()
        if not all(isinstance(a, (np.ndarray, list, tuple)) for a in (self.vertices, self.faces)):
            return
        vertices, faces = self.vertices, np.asarray(self.faces)
        if (
            faces.size and len(vertices) and faces.dtype.kind in "iu"
        ):  # else `triangulate` says what they lack
            check_faces(faces, len(vertices), "mesh.faces")

    @classmethod
    def from_trimesh(cls, geometry: Any, **parameters: Any) -> Mesh:
        """Return a `trimesh.Trimesh` as a mesh: its vertices, faces, uvs, colours and material.

        geometry: its arrays are shared where they have clpt's types already. Colours of vertices or
        faces, 8-bit sRGB, become the linear attribute `vertex_color` or `face_color`, which the
        material shows; a material with its images becomes a material of clpt, and a light if it
        glows. parameters: further parameters of the mesh, such as material, to_world, name, or
        normals="smooth"; without normals the triangles are flat. A `material` takes the place of
        trimesh's.

        Raises SceneError for an object that is not a Trimesh; `Scene.from_trimesh` takes scenes.
        """
        if not trimeshes.is_mesh(geometry):
            advice = "; Scene.from_trimesh takes a scene" if trimeshes.is_scene(geometry) else ""
            message = f"must be a trimesh.Trimesh, not {type(geometry).__name__}{advice}"
            raise SceneError(message, where="mesh")
        visual, values = geometry.visual, dict(parameters)
        uvs, colours = getattr(visual, "uv", None), trimeshes.colours_of(visual)
        if uvs is not None:
            values.setdefault("uvs", np.ascontiguousarray(uvs, np.float32))
        if colours:
            values["attributes"] = {**colours, **values.get("attributes", {})}
            values.setdefault("material", trimeshes.coloured(next(iter(colours))))
        if "material" not in values and (shown := trimeshes.material_of(visual)):
            values["material"], emission = shown
            values.setdefault("emission", emission)
        return cls(
            vertices=np.ascontiguousarray(geometry.vertices, np.float32),
            faces=np.ascontiguousarray(geometry.faces, np.uint32),
            **values,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Sphere(Shape):
    """A sphere; uv from the azimuth and polar angle about z."""

    center: Vector3 = host((0.0, 0.0, 0.0), "before `to_world`", "m")
    radius: float = host(
        1.0, "radius before `to_world`, which may scale it evenly", "m", positive=True
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Spheres(Shape):
    """Many spheres in a single shape, such as particles; rays meet each as a `sphere`.

    A `mesh_attribute` texture reads the attributes: the first row is the first sphere's.
    """

    deformed_field = "centers"

    centers: Any = host(
        None, "(n, 3) float32 before `to_world`; (n, 4): with the radii", "m", form="rows3"
    )
    radii: Any = host(
        1.0, "(n,), or one number; `to_world` may scale them, evenly", "m", form="number_or_list"
    )
    attributes: Mapping[str, Any] = host(
        {}, "name that begins with vertex_ -> (n, 1 or 3) float32, per sphere", form="attributes"
    )
    deformation: Deformation | None = host(
        None, "where the spheres are at times, perhaps with radii, or None", form="deformation"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Rectangle(Shape):
    """The square [-1, 1]^2 in the plane z = 0, facing +z; uv run from 0 to 1."""

    is_open = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Disk(Shape):
    """The unit disk in the plane z = 0, facing +z; u is the radius, v the azimuth over 2 pi."""

    is_open = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Cube(Shape):
    """The cube [-1, 1]^3, facing outward; uv run from 0 to 1 on each side."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cylinder(Shape):
    """An open tube around the line from p0 to p1, facing outward; u azimuth, v along the line."""

    is_open = True

    p0: Vector3 = host((0.0, 0.0, 0.0), "start of the axis", "m")
    p1: Vector3 = host((0.0, 0.0, 1.0), "end of the axis", "m")
    radius: float = host(
        1.0, "radius before `to_world`, which may scale it evenly", "m", positive=True
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves(Shape):
    """Strands of a round cross-section, such as hair: the space that spheres along a line fill.

    u runs around a strand. v runs along, from 0 to 1 over all pieces of all strands. At the
    beginning of a strand u is as in Mitsuba: 1/4 on the side of +z of the world, or of +y if the
    strand goes along z. From there u is carried on without a twist. Mitsuba looks for +z at each
    point instead. For straight strands, and for strands in a plane with z or across z, both are the
    same. A B-spline is uniform and cubic. A Bezier strand has 4, 7, 10, ... points. `to_world`
    scales radii too. Strands end in half spheres. Some curves become tubes of triangles, which are
    open at the ends: curves that emit light, that deform, that a transform stretches, or that more
    than 16 instances share.
    """

    is_open = True
    deformed_field = "points"
    flattens = True

    points: Any = host(None, "(n, 4) of all strands: x y z and the radius", "m", form="rows4")
    lengths: Any = host(
        (), "points of each strand, in their order; empty: a single strand", form="lengths"
    )
    basis: str = choice("bspline", "meaning of the points", BASES)
    deformation: Deformation | None = host(
        None, "where the points are at times, or None", form="deformation"
    )


def _ball() -> np.ndarray:
    """Distances to a sphere of radius 0.35 in the middle of the unit cube, (9, 9, 9) float32."""
    x, y, z = np.meshgrid(*[np.linspace(-0.5, 0.5, 9)] * 3, indexing="ij")
    return (np.sqrt(x * x + y * y + z * z) - 0.35).astype(np.float32)


@dataclass(frozen=True, kw_only=True, eq=False)
class SdfGrid(Shape):
    """The surface where a signed distance on a grid over the unit cube is zero; as triangles.

    The outer points of the grid lie on the faces of the cube. Between points the distance is
    trilinear. The distance is positive in front of the surface. Corners of triangles lie on the
    surface. The inside of a triangle is off the surface by at most .005 of a cell on a ball 11
    cells across, and by .09 at a sharp edge, with 2 `pieces`. Twice the pieces divide this by 4.
    uv are 0 everywhere: a texture is constant over it.
    """

    flattens = True

    values: ArrayLike = host(
        _ball(), "(nx, ny, nz) float32, below 0 inside; default: a ball", form="grid"
    )
    smooth: bool = host(True, "normals are smooth over the cells; False: those of the triangles")
    pieces: int = host(2, "of the side of a cell that the surface crosses, 1 to 16")


@dataclass(frozen=True, eq=False)
class Group:
    """Shapes that instances place together; by itself it is nowhere in the scene.

    shapes: placed by their own `to_world` in the group's space; name: for messages and files.

    Raises SceneError for an object that is no shape, and for an instance: groups do not nest.
    """

    shapes: tuple[Shape, ...] = ()
    name: str = ""

    @property
    def shared_parts(self) -> dict[str, Any]:
        return {"shapes": self.shapes}

    def __post_init__(self) -> None:
        object.__setattr__(self, "shapes", tuple(self.shapes))
        for i, shape in enumerate(self.shapes):
            if isinstance(shape, Instance) or not isinstance(shape, Shape):
                kind = "an instance" if isinstance(shape, Instance) else repr(shape)
                where = f"group {self.name!r}.shapes[{i}]"
                raise SceneError(f"a group holds shapes, not {kind}", where=where)


@dataclass(frozen=True, kw_only=True, eq=False)
class Instance(Shape):
    """A group at a place; many share its triangles. In a mirror a front stays a front."""

    group: Group = host(None, "the shapes: a name in the scene's `groups`", form="group")
    # The surfaces are those of the group's shapes.
    material: Material = field(default=cast(Material, None), init=False, repr=False)
    emission: PoweredLamp | None = field(default=None, init=False, repr=False)
    flip_normals: bool = field(default=False, init=False, repr=False)

    @property
    def members(self) -> tuple[Shape, ...]:
        return self.group.shapes

    @property
    def shared_parts(self) -> dict[str, Any]:
        return {"group": self.group}

    def check(self) -> None:
        """Raise SceneError unless `group` is a group."""
        if not isinstance(self.group, Group):
            raise SceneError(f"must be a group, not {self.group!r}", where="instance.group")


KINDS = (
    Mesh, Sphere, Spheres, Rectangle, Disk, Cube, Cylinder, Curves, SdfGrid, Instance,
)  # fmt: skip
