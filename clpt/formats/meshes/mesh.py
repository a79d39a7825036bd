"""Triangle meshes from .obj, .ply, .stl and .off files.

Normals and texture coordinates are kept where the file has them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, transforms
from clpt.choices import Missing
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats.meshes import mtl, obj, off, ply, stl, triangles
from clpt.formats.meshes.triangles import TANGENTS, Triangles, attributes
from clpt.formats.reading import find
from clpt.geometry.polygons import smooth_normals
from clpt.scene.materials import Diffuse, Material, TwoSided
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap, MeshAttribute, Texture, textures_in

SUFFIXES = (".obj", ".ply", ".stl", ".off")
COLOURS = ("vertex_color", "face_color")  # attributes that show where no material is named
CHUNK = 1 << 14  # triangles that are checked at a time: in float64 they take 400 bytes each
MOST_TOLD = 6  # materials that a warning names
READERS: dict[str, Callable[[Path], list[Triangles]]] = {
    ".ply": lambda path: [ply.read(path)],
    ".stl": stl.read,
    ".off": off.read,
}
GREY = TwoSided(front=Diffuse(reflectance=0.6, name="grey"))


@dataclass
class MeshFile:
    """The meshes of a file, and warnings of omissions."""

    meshes: list[Mesh]
    warnings: list[str] = field(default_factory=list)


def read_mesh(path: Path, *, materials: bool = True, missing: Missing = "error") -> MeshFile:
    """Read all meshes of a file, with the file's materials if `materials`.

    missing: of images, see clpt.load.

    Raises SceneError for a file that is missing, broken or without triangles, for vertices that are
    not finite and for faces that name vertices which are not there.
    """
    warnings: list[str] = []
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise SceneError(f"unknown mesh suffix {suffix!r}; known: {', '.join(SUFFIXES)}", file=path)
    if suffix == ".obj":
        library = mtl.Library(path.parent, missing) if materials else None
        meshes = _obj(path, library, warnings)
    else:
        soups = READERS[suffix](path)
        meshes = [mesh for part in soups for mesh in _meshes(path, part, materials, warnings)]
    if not meshes:
        raise SceneError("holds no triangles", file=path)
    return MeshFile(meshes, list(dict.fromkeys(warnings)))


def join(meshes: list[Mesh]) -> Mesh:
    """Return a mesh of all triangles, in world space, with the material of the first mesh."""
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
    """Return whether any triangle of a mesh has an area."""
    for first in range(0, len(mesh.faces), CHUNK):
        if transforms.edge_crosses(mesh.vertices, mesh.faces[first : first + CHUNK]).any():
            return True
    return False


@dataclass(frozen=True)
class Arrays:
    """The arrays of a mesh in a file: vertices (n, 3), faces (m, 3), normals (n, 3), uvs (n, 2).

    attributes: further arrays (n, width) with a row for each vertex, or face if face_ begins the
    name.
    """

    vertices: NDArray[Any]
    faces: NDArray[Any]
    normals: NDArray[Any] | None = None
    uvs: NDArray[Any] | None = None
    attributes: Mapping[str, NDArray[Any]] | None = None


def _fault(faces: NDArray[Any], finite: NDArray[np.bool_]) -> str:
    """Say which triangle has no vertices; finite (n,): of each vertex whether it is."""
    if len(faces) and (faces.min() < 0 or faces.max() >= len(finite)):
        bad = int(np.argmax(((faces < 0) | (faces >= len(finite))).any(axis=1)))
        return f"triangle {bad} names a vertex outside 0 to {len(finite) - 1}"
    good = np.take(finite, faces.reshape(-1)).reshape(-1, 3).all(axis=1)
    if not good.all():
        return f"triangle {int(np.argmin(good))} has a vertex that is not a finite number"
    return ""


def checked(path: Path | None, name: str, source: Arrays, warnings: list[str]) -> dict[str, Any]:
    """Return a mesh's arrays without unused vertices; `warnings` get what else was left out.

    Triangles without an area stay: lowering leaves them out. Raises SceneError for indices out of
    range and vertices that are not finite.
    """
    faces = source.faces
    with np.errstate(over="ignore", invalid="ignore"):
        points = np.ascontiguousarray(source.vertices, np.float32)
        finite = np.asarray(np.isfinite(points).all(axis=1))
    if fault := _fault(faces, finite):
        raise SceneError(fault, file=path, where=name or None)
    used = np.zeros(len(points), bool)
    used[faces.reshape(-1)] = True
    arrays: dict[str, Any] = {"vertices": points, "normals": source.normals, "uvs": source.uvs}
    attributes = dict(source.attributes or {})
    if not used.all():
        arrays = {key: None if a is None else a[used] for key, a in arrays.items()}
        attributes = {k: a if k.startswith("face_") else a[used] for k, a in attributes.items()}
        faces = (np.cumsum(used) - 1)[faces]
    if (normals := arrays["normals"]) is not None:
        arrays["normals"] = _usable_normals(arrays["vertices"], faces, normals)
    if (uvs := arrays["uvs"]) is not None and not np.isfinite(uvs).all():
        warnings.append(f"{name or 'mesh'}: left out texture coordinates that are not finite")
        arrays["uvs"] = None
    whole = {**arrays, "faces": np.ascontiguousarray(faces, np.uint32)}
    held = [a for a in (*whole.values(), *attributes.values()) if a is not None]
    budget.take(sum(a.nbytes for a in held), f"the mesh {name!r}" if name else "a mesh", path)
    budget.take_parts(1, "meshes", path)
    return whole if source.attributes is None else {**whole, "attributes": attributes}


def _meshes(path: Path, triangles: Triangles, materials: bool, warnings: list[str]) -> list[Mesh]:
    """Return the triangles that a reader has found, a mesh for each image that they show."""
    warnings += triangles.warnings
    if not materials or not triangles.textures:
        parts = [_plain(path, triangles, materials, warnings)]
    else:
        parts = [_plain(path, part, True, warnings) for part in _by_texture(triangles, warnings)]
    return [mesh for mesh in parts if mesh is not None]


def _plain(path: Path, triangles: Triangles, materials: bool, warnings: list[str]) -> Mesh | None:
    name, colours = triangles.name or path.name, attributes(triangles)
    arrays_read = Arrays(
        triangles.vertices, triangles.faces, triangles.normals, triangles.uvs, colours
    )
    arrays = checked(path, name, arrays_read, warnings)
    if not len(arrays["faces"]):
        return None
    material = _coloured(colours) if materials else GREY
    if materials and triangles.textures and triangles.uvs is not None:
        material = _pictured(path, triangles.textures[0], material, warnings)
    arrays["tangents"] = arrays["attributes"].pop(TANGENTS, None)
    return Mesh(name=name, material=material, **arrays)


def _by_texture(triangles: Triangles, warnings: list[str]) -> list[Triangles]:
    """Return the triangles that show each image, by their column texnumber; last those of none."""
    if triangles.uvs is None:
        warnings.append(
            f"image {triangles.textures[0]!r} left out, as there are no texture coordinates"
        )
        return [triangles]
    number = triangles.columns["face"].get("texnumber")
    if number is None:
        for image in triangles.textures[1:]:
            warnings.append(f"image {image!r} left out, as no face names it")
        return [triangles]
    parts = []
    shown = np.where((number >= 0) & (number < len(triangles.textures)), number, -1)
    for i, images_ in enumerate([*([image] for image in triangles.textures), []]):
        members = shown == (i if images_ else -1)
        columns = {n: values[members] for n, values in triangles.columns["face"].items()}
        columns = {"vertex": triangles.columns["vertex"], "face": columns}
        parts.append(
            replace(triangles, faces=triangles.faces[members], columns=columns, textures=images_)
        )
    return parts


def _pictured(path: Path, image: str, otherwise: Material, warnings: list[str]) -> Material:
    """Return the material that shows an image beside a file, the other where there is none."""
    file = find(path.parent, image)
    if file is None:
        warnings.append(f"image {image!r} left out, as it is not there")
        return otherwise
    return TwoSided(front=Diffuse(reflectance=Bitmap(image=file), name=file.stem))


def _obj(path: Path, library: mtl.Library | None, warnings: list[str]) -> list[Mesh]:
    """Read an OBJ file: a mesh for each material, or a single mesh without a library."""
    contents = obj.read(path)
    if library is not None:
        for names in contents.libraries:
            library.add(names)
    parts = list(triangles.parts(contents, whole=library is None))
    if not parts:
        held = f"{len(contents.vertices)} vertices (v), but no faces (f)"
        message = "; ".join([f"holds no triangles: {held}", *contents.warnings])
        raise SceneError(message, file=path)
    warnings += contents.warnings
    scale = 1.0
    if contents.colours is not None:
        scale = 255.0 if np.nanmax(contents.colours, initial=0.0) > 1.0 else 1.0
    unknown: list[str] = []
    meshes: list[Mesh] = []
    for part in parts:
        label = contents.materials[part.material] if part.material >= 0 else ""
        colours = _vertex_colours(part.colours, scale, warnings)
        name = label if label and len(parts) > 1 else path.name
        arrays_read = Arrays(part.vertices, part.faces, part.normals, part.uvs, colours)
        arrays = checked(path, name, arrays_read, warnings)
        material, emission = _coloured(colours) if library is not None else GREY, None
        if library is not None and label:
            if (known := library.known(label)) is None:
                unknown.append(label)
            else:
                material, emission = library.material(known)
                if part.uvs is None and any(map(_is_image, textures_in(material))):
                    warnings.append(f"material {label!r} has images, but its faces no coordinates")
        meshes.append(Mesh(name=name, material=material, emission=emission, **arrays))
    if bare := sum(part.bare for part in parts):
        warnings.append(f"{bare} triangles have no texture coordinates; (0, 0) stands for them")
    if unknown:
        warnings.append(f"no library holds the material {_some(unknown)}; grey stands for it")
    if library is not None:
        warnings += library.warnings()
    return meshes


def _some(names: list[str]) -> str:
    """The first names of a list, and how many more there are."""
    more = f" and {len(names) - MOST_TOLD} more" if len(names) > MOST_TOLD else ""
    return ", ".join(map(repr, names[:MOST_TOLD])) + more


def _is_image(texture: Texture) -> bool:
    """Return whether a texture is an image file."""
    return isinstance(texture, Bitmap) and isinstance(texture.image, Path)


def _vertex_colours(
    colours: NDArray[np.float32] | None, scale: float, warnings: list[str]
) -> dict[str, NDArray[np.float32]]:
    """Return sRGB colours of vertices up to `scale` as a linear attribute, if there are any."""
    if colours is None or np.isnan(colours).all():
        return {}
    if np.isnan(colours).any():
        warnings.append("vertices without a colour beside others with one are white")
        colours = np.where(np.isnan(colours), np.float32(scale), colours)
    return {"vertex_color": images.srgb_to_linear(colours / np.float32(scale))}


def _usable_normals(
    vertices: NDArray[Any], faces: NDArray[Any], normals: NDArray[Any]
) -> NDArray[np.float32]:
    """Return unit normals; those of adjacent faces where the file's are zero or not finite."""
    length = np.linalg.norm(normals.astype(np.float64), axis=1, keepdims=True)
    bad = ~(np.isfinite(length) & (length > 0.0))[:, 0]
    # Unit normals stay as they are to the last bit, so that a saved mesh is read unchanged.
    exact = np.abs(length - 1.0) < 1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = np.where(exact, normals, normals / length)
    if bad.any():
        unit[bad] = smooth_normals(vertices, faces)[bad]
    return unit.astype(np.float32)


def _coloured(attributes: Mapping[str, Any]) -> Material:
    """Return the material that shows the colours of a file without materials."""
    name = next((name for name in COLOURS if name in attributes), None)
    if name is None:
        return GREY
    return TwoSided(front=Diffuse(reflectance=MeshAttribute(name=name), name=name))
