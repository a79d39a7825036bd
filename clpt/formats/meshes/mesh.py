"""Triangle meshes from .ply, and through trimesh from .obj, .stl and .off files.

Normals and texture coordinates are kept where the file has them. Of a material only the base colour
is read.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, transforms
from clpt.errors import SceneError
from clpt.formats.meshes import ply
from clpt.scene.materials import Diffuse, Material, TwoSided
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap, MeshAttribute

if TYPE_CHECKING:
    import trimesh  # imported where it is used: it takes a second, which scenes without files save

SUFFIXES = (".obj", ".ply", ".stl", ".off")
TANGENTS = "vertex tangents"  # among attributes, while a mesh is read
TANGENT_COLUMNS = ("tx", "ty", "tz", "tw")  # of a PLY file that clpt has written
COLOURS = ("vertex_color", "face_color")  # attributes that show where no material is named
DUMMIES = (None, (2, 2))  # sizes of the image in trimesh's default material
SUMMED = 1 << 20  # triangles whose normals are summed at a time
CHUNK = 1 << 14  # triangles that are checked at a time: in float64 they take 400 bytes each
USEMTL = re.compile(rb"(?m)^[ \t]*usemtl[^\n]*")
GREY = TwoSided(front=Diffuse(reflectance=0.6, name="grey"))


@dataclass
class MeshFile:
    """The meshes of a file, and warnings of what was left out."""

    meshes: list[Mesh]
    warnings: list[str] = field(default_factory=list)


def read_mesh(path: Path, *, materials: bool = True) -> MeshFile:
    """Read all meshes of a file, with the file's base colours if `materials`.

    Raises SceneError for a file that is missing, broken or without triangles, for vertices that are
    not finite and for faces that name vertices which are not there.
    """
    warnings: list[str] = []
    if path.suffix.lower() == ".ply":
        return MeshFile([_ply(path, materials, warnings)], warnings)
    scene = _open(path, materials)
    parts = [_mesh(path, key, part, materials, warnings) for key, part in scene.geometry.items()]
    meshes = [mesh for mesh in parts if mesh is not None]
    if not meshes:
        raise SceneError("holds no triangles", file=path)
    return MeshFile(meshes, list(dict.fromkeys(warnings)))


def join(meshes: list[Mesh]) -> Mesh:
    """Return one mesh that holds all triangles, in world space, with the first one's material."""
    first = meshes[0]
    if len(meshes) == 1 and np.array_equal(np.asarray(first.to_world), np.eye(4)):
        return first
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    whole: dict[str, Any] = {"normals": None, "uvs": None}
    shared = set(first.attributes).intersection(*(mesh.attributes for mesh in meshes))
    whole["attributes"] = {k: np.concatenate([m.attributes[k] for m in meshes]) for k in shared}
    if all(mesh.normals is not None for mesh in meshes):
        turned = [transforms.transform_normals(np.asarray(m.to_world), m.normals) for m in meshes]
        whole["normals"] = np.concatenate(turned).astype(np.float32)
    if any(mesh.uvs is not None for mesh in meshes):
        none = [np.zeros((len(m.vertices), 2)) if m.uvs is None else m.uvs for m in meshes]
        whole["uvs"] = np.concatenate(none).astype(np.float32)
    moved = [transforms.transform_points(np.asarray(m.to_world), m.vertices) for m in meshes]
    return Mesh(
        vertices=np.concatenate(moved).astype(np.float32),
        faces=np.concatenate(faces).astype(np.uint32),
        material=first.material,
        name=first.name,
        **whole,
    )


def has_area(mesh: Mesh) -> bool:
    """Return whether one of a mesh's triangles has an area."""
    for first in range(0, len(mesh.faces), CHUNK):
        corners = mesh.vertices[mesh.faces[first : first + CHUNK]].astype(np.float64)
        if np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any():
            return True
    return False


def smooth_normals(vertices: NDArray[Any], faces: NDArray[Any]) -> NDArray[np.float32]:
    """Return vertex normals (n, 3): of the faces, weighted by angle (Thuermer, Wuethrich 1998)."""
    total = np.zeros((len(vertices), 3))
    for first in range(0, len(faces), SUMMED):
        _add_normals(total, vertices, faces[first : first + SUMMED])
    return _unit(total).astype(np.float32)


def _add_normals(total: NDArray[Any], vertices: NDArray[Any], faces: NDArray[Any]) -> None:
    corners = vertices[faces].astype(np.float64)
    normals = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    for i in range(3):
        a = _unit(corners[:, (i + 1) % 3] - corners[:, i])
        b = _unit(corners[:, (i + 2) % 3] - corners[:, i])
        angles = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))
        for axis in range(3):
            weights = angles * normals[:, axis]
            total[:, axis] += np.bincount(faces[:, i], weights, len(vertices))


def checked(
    path: Path | None,
    name: str,
    vertices: NDArray[Any],
    faces: NDArray[Any],
    normals: NDArray[Any] | None,
    uvs: NDArray[Any] | None,
    warnings: list[str],
    attributes: Mapping[str, NDArray[Any]] | None = None,
) -> dict[str, Any]:
    """Return a mesh's arrays without unused vertices; `warnings` get what else was left out.

    Triangles without an area stay: lowering leaves them out. attributes: further arrays (n, width),
    one row a vertex, or a face where face_ begins the name.

    Raises SceneError for indices out of range and vertices that are not finite.
    """
    where = name or None
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        bad = int(np.argmax(((faces < 0) | (faces >= len(vertices))).any(axis=1)))
        message = f"triangle {bad} names a vertex outside 0 to {len(vertices) - 1}"
        raise SceneError(message, file=path, where=where)
    with np.errstate(over="ignore", invalid="ignore"):
        points = np.ascontiguousarray(vertices, np.float32)
        finite = np.isfinite(points).all(axis=1)
    good = np.take(finite, faces.reshape(-1)).reshape(-1, 3).all(axis=1)
    if not good.all():
        message = f"triangle {int(np.argmin(good))} has a vertex that is not a finite number"
        raise SceneError(message, file=path, where=where)
    used = np.zeros(len(points), bool)
    used[faces.reshape(-1)] = True
    arrays: dict[str, Any] = {"vertices": points, "normals": normals, "uvs": uvs}
    own = dict(attributes or {})
    if not used.all():
        arrays = {key: None if a is None else a[used] for key, a in arrays.items()}
        own = {k: a if k.startswith("face_") else a[used] for k, a in own.items()}
        faces = (np.cumsum(used) - 1)[faces]
    normals, uvs = arrays["normals"], arrays["uvs"]
    if normals is not None:
        arrays["normals"] = _usable_normals(arrays["vertices"], faces, normals)
    if uvs is not None and not np.isfinite(uvs).all():
        warnings.append(f"{name or 'mesh'}: left out texture coordinates that are not finite")
        arrays["uvs"] = None
    whole = {**arrays, "faces": np.ascontiguousarray(faces, np.uint32)}
    return whole if attributes is None else {**whole, "attributes": own}


def _open(path: Path, materials: bool) -> trimesh.Scene:
    import trimesh

    suffix = path.suffix.lower()
    try:
        if suffix == ".stl":
            _check_stl(path.read_bytes())
        with np.errstate(all="ignore"):
            if suffix == ".obj" and not materials:
                # In one piece: trimesh cuts the mesh, and its normals, where the material changes.
                text = io.BytesIO(USEMTL.sub(b"", path.read_bytes()))
                return trimesh.load_scene(text, "obj", process=False, skip_materials=True)
            return trimesh.load_scene(path, process=False)
    except Exception as error:  # trimesh's readers raise whatever their parsing runs into
        reason = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise SceneError(f"cannot be read as a {suffix} mesh: {reason}", file=path) from None


def _check_stl(data: bytes) -> None:
    """Raise ValueError for a binary file that is cut off, which trimesh would take for a text."""
    if data.lstrip().startswith(b"solid") and b"\0" not in data[:1024]:
        return
    if len(data) < 84:
        raise ValueError("it ends within its header")
    count, held = int.from_bytes(data[80:84], "little"), (len(data) - 84) // 50
    if held < count:
        raise ValueError(f"it ends early: it holds {held} of {count} triangles")


def _ply(path: Path, materials: bool, warnings: list[str]) -> Mesh:
    """Read a PLY file; trimesh would take ten times as long."""
    triangles = ply.read(path)
    warnings += triangles.warnings
    own = _attributes(triangles)
    arrays = checked(
        path,
        path.name,
        triangles.vertices,
        triangles.faces,
        triangles.normals,
        triangles.uvs,
        warnings,
        own,
    )
    if not len(arrays["faces"]):
        raise SceneError("holds no triangles", file=path)
    arrays["tangents"] = arrays["attributes"].pop(TANGENTS, None)
    return Mesh(name=path.name, material=_coloured(own) if materials else GREY, **arrays)


def _mesh(
    path: Path, name: str, geometry: Any, materials: bool, warnings: list[str]
) -> Mesh | None:
    from trimesh import Trimesh

    if not isinstance(geometry, Trimesh):
        warnings.append(f"{name}: left out, since it has no triangles")
        return None
    vertices = np.asarray(geometry.vertices).reshape(-1, 3)
    faces = np.asarray(geometry.faces, np.int64).reshape(-1, 3)
    # Asking for `vertex_normals` would compute them; the file's own wait in the cache.
    normals = _per_vertex(geometry._cache.cache.get("vertex_normals"), vertices, 3)
    uvs = _per_vertex(getattr(geometry.visual, "uv", None), vertices, 2)
    arrays = checked(path, name, vertices, faces, normals, uvs, warnings)
    if not len(arrays["faces"]):
        return None
    material = _material(geometry.visual, warnings) if materials else GREY
    return Mesh(name=name, material=material, **arrays)


def _attributes(triangles: ply.Triangles) -> dict[str, NDArray[np.float32]]:
    """Return colours and other numbers of a PLY file per vertex and face, by Mitsuba's names.

    r, g, b or red, green, blue are vertex_color or face_color, bytes decoded from sRGB; x_0, x_1,
    x_2 or x_r, x_g, x_b are vertex_x.
    """
    attributes: dict[str, NDArray[np.float32]] = {}
    for element in ("vertex", "face"):
        for name, parts in _grouped(triangles.columns[element]).items():
            values = np.column_stack(parts)
            if values.shape[1] in (1, 3):
                scaled = values.dtype == np.uint8
                linear = images.srgb_to_linear(values / np.float32(255.0)) if scaled else values
                attributes[f"{element}_{name}"] = linear.astype(np.float32)
    vertex = triangles.columns["vertex"]
    if all(name in vertex for name in TANGENT_COLUMNS):
        columns = [vertex[name] for name in TANGENT_COLUMNS]
        attributes[TANGENTS] = np.column_stack(columns).astype(np.float32)
    return attributes


def _grouped(columns: dict[str, NDArray[Any]]) -> dict[str, list[NDArray[Any]]]:
    """Return the columns of each attribute by its name."""
    groups: dict[str, list[NDArray[Any]]] = {}
    for name, values in columns.items():
        head, _, tail = name.rpartition("_")
        letter = {"red": "r", "green": "g", "blue": "b"}.get(name, name)
        if letter in ("r", "g", "b"):
            groups.setdefault("color", []).append(values)
        elif head and tail in (*"rgbxyz", *"012"):
            groups.setdefault(head, []).append(values)
    return groups


def _per_vertex(values: Any, vertices: NDArray[Any], width: int) -> NDArray[np.float32] | None:
    if values is None or np.shape(values) != (len(vertices), width):
        return None
    return np.ascontiguousarray(values, np.float32)


def _usable_normals(
    vertices: NDArray[Any], faces: NDArray[Any], normals: NDArray[Any]
) -> NDArray[np.float32]:
    """Return unit normals; those of adjacent faces where the file's are zero or not finite."""
    length = np.linalg.norm(normals.astype(np.float64), axis=1, keepdims=True)
    bad = ~(np.isfinite(length) & (length > 0.0))[:, 0]
    # What is of length one stays as it is to the last bit, so that a saved mesh is read unchanged.
    exact = np.abs(length - 1.0) < 1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = np.where(exact, normals, normals / length)
    if bad.any():
        unit[bad] = smooth_normals(vertices, faces)[bad]
    return unit.astype(np.float32)


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def _coloured(attributes: Mapping[str, Any]) -> Material:
    """Return the material that shows the colours of a file without materials."""
    name = next((name for name in COLOURS if name in attributes), None)
    if name is None:
        return GREY
    return TwoSided(front=Diffuse(reflectance=MeshAttribute(name=name), name=name))


def _material(visual: Any, warnings: list[str]) -> Material:
    material = getattr(visual, "material", None)
    if material is None or _is_default(material):
        if getattr(visual, "kind", None) in ("vertex", "face"):
            warnings.append("vertex colours left out")
        return GREY
    colour, image = _base_colour(material)
    if image is None:
        return TwoSided(front=Diffuse(reflectance=tuple(colour), name=material.name or ""))
    texels = images.from_pillow(image).decoded()
    texels = texels[..., :3] * np.asarray(colour, np.float32)
    texture = Bitmap(image=texels, raw=True)
    return TwoSided(front=Diffuse(reflectance=texture, name=material.name or ""))


def _is_default(material: Any) -> bool:
    """Return whether trimesh made this material, for uv of a file that names no material."""
    from trimesh.visual.material import SimpleMaterial

    simple = isinstance(material, SimpleMaterial)
    return simple and not material.kwargs and getattr(material.image, "size", None) in DUMMIES


def _base_colour(material: Any) -> tuple[list[float], Any]:
    """Return linear r, g, b of a trimesh material, and its image or None."""
    factor, image = getattr(material, "diffuse", None), getattr(material, "image", None)
    if factor is None or image is not None:
        return [1.0, 1.0, 1.0], image
    return [float(value) / 255.0 for value in np.asarray(factor).reshape(-1)[:3]], image
