"""The materials of a document of MaterialX, by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clpt import images
from clpt.choices import Missing
from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files
from clpt.formats import framing
from clpt.formats.materialx import document
from clpt.formats.materialx.surfaces import Surface, surface
from clpt.scene import Scene, shapes
from clpt.scene.textures import MeshAttribute
from clpt.scene.values import Texture


@dataclass
class Folder:
    """Reads the images of a document, in its folder and below; a `graph.Host`."""

    file: Path
    warnings: list[str] = field(default_factory=list)

    def warn(self, message: str, path: str) -> None:
        text = f"{self.file}: {path}: {message}"
        if text not in self.warnings:
            self.warnings.append(text)

    def image(self, asset: object, path: str) -> images.Stored | None:
        if not asset:
            self.warn("names no image", path)
            return None
        try:
            path_of = self.file.parent / str(asset)
            return images.read_stored(input_files.named("materialx", self.file.parent, path_of))
        except SceneError as error:
            self.warn(f"{error}; the default stands for it", path)
            return None

    def attribute(self, name: str, default: tuple[float, ...]) -> Texture:
        return MeshAttribute(name=f"vertex_{name}")

    def uv_mapping(self, name: str) -> str:
        return "uv1" if name == "uv1" else "uv"


def networks(file: Path) -> tuple[dict[str, document.Element], Any]:
    """Return the surface shaders of a document by the names of its materials, and the document.

    The library ends a document that nobody holds. Raises SceneError for a file that is no document
    of MaterialX, and where `materialx` is not installed.
    """
    found, read = {}, document.read(file)
    for material in read.getMaterialNodes():
        shaders = document.library().getShaderNodes(material)
        if shaders:
            found[str(material.getName())] = document.Element(shaders[0])
    return found, read


def load_materials(path: str | Path) -> tuple[dict[str, Surface], list[str]]:
    """Return the surfaces of a document by the names of its materials, and warnings.

    Raises SceneError for a file that is no document of MaterialX, for one without materials, and
    where `materialx` is not installed.
    """
    file = input_files.checked(Path(path))
    host = Folder(file)
    nodes, _held = networks(file)
    found = {name: surface(node, host, name) for name, node in nodes.items()}
    if not found:
        raise SceneError("has no surface materials", file=file)
    return found, host.warnings


def load_material(path: str | Path, name: str | None = None) -> tuple[Surface, list[str]]:
    """Return a surface of a document by the name of its material, and warnings.

    name: None for the only one. Raises SceneError, see `load_materials`, UnknownKindError for
    another name, and SceneError for None where there are several.
    """
    found, warnings = load_materials(path)
    if name is None and len(found) > 1:
        raise SceneError(f"has several materials, name one: {', '.join(found)}", file=path)
    chosen = next(iter(found)) if name is None else name
    if chosen not in found:
        raise UnknownKindError("material", chosen, found, file=path)
    return found[chosen], warnings


BESIDE = 2.4  # from the middle of a ball to the next, of radius 1


def load(path: Path, missing: Missing = "error") -> Scene:
    """Read a document as a scene: a ball of each material, side by side in the studio.

    missing: see clpt.load; here a warning tells of an image that is not there in any case. Raises
    SceneError, see `load_materials`.
    """
    found, warnings = load_materials(path)
    balls = [
        shapes.Sphere(
            center=(BESIDE * i, 0.0, 0.0),
            material=surface.material,
            emission=surface.emission,
            interior=surface.interior,
            name=name,
        )
        for i, (name, surface) in enumerate(found.items())
    ]
    scene = framing.show(balls, file=path)
    scene.warnings = warnings
    return scene
