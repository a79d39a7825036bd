"""Meshes and scenes of trimesh as clpt has them: arrays, colours, materials and their images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area, Light
from clpt.scene.materials import Diffuse, GltfSurface, Mask, Material, NormalMap, TwoSided
from clpt.scene.params import Texture
from clpt.scene.textures import Bitmap, MeshAttribute, Product
from clpt.scene.values import Textured, TexturedNumber

WHITE = (1.0, 1.0, 1.0)
_EYE_TO_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])  # trimesh's camera looks along -z, +x right


class Camera(Protocol):
    """The camera of a scene of trimesh."""

    fov: Sequence[float]


def is_scene(thing: object) -> bool:
    """Return whether a thing is a scene of trimesh."""
    return hasattr(thing, "graph") and hasattr(thing, "geometry")


def is_mesh(thing: object) -> bool:
    """Return whether a thing is a mesh of trimesh."""
    return hasattr(thing, "faces") and hasattr(thing, "vertices") and hasattr(thing, "visual")


def colours_of(visual: object) -> dict[str, NDArray[np.float32]]:
    """Return the colours of vertices or faces, 8-bit sRGB, as a linear attribute of a mesh."""
    kind = _of(visual, "kind", str)
    if kind not in ("vertex", "face"):
        return {}
    levels = np.asarray(_of(visual, f"{kind}_colors", np.ndarray))[:, :3]
    linear = images.srgb_to_linear(levels.astype(np.float32) / np.float32(255.0))
    return {f"{kind}_color": linear}


def coloured(name: str) -> Material:
    """Return the material that shows an attribute of a mesh."""
    return TwoSided(front=Diffuse(reflectance=MeshAttribute(name=name), name=name))


def material_of(visual: object) -> tuple[Material, Light | None] | None:
    """Return the material of a mesh with uvs and its light, None where it has no material.

    A `PBRMaterial` becomes what clpt.load makes of glTF, a `SimpleMaterial` a matt surface.
    """
    given = _of(visual, "material", object)
    if given is None:
        return None
    name = _of(given, "name", str) or ""
    if hasattr(given, "baseColorFactor"):
        return _physical(given, name)
    image = _image(given, "image")
    shown: Textured = _levels(given, "diffuse", (0.5,) * 3) if image is None else image
    return TwoSided(front=Diffuse(reflectance=shown, name=name)), None


def _physical(given: object, name: str) -> tuple[Material, Light | None]:
    """Return the material and the light of a `PBRMaterial`."""
    rough = {"b": "metallic", "g": "roughness"}
    numbers: dict[str, TexturedNumber] = {}
    for channel, parameter in rough.items():
        share = _of(given, f"{parameter}Factor", (float, int))
        value = 1.0 if share is None else float(share)
        image = _image(given, "metallicRoughnessTexture", raw=True, channel=channel)
        numbers[parameter] = value if image is None else _times(image, value)
    base, factor = _image(given, "baseColorTexture"), _levels(given, "baseColorFactor", WHITE)
    colour: Textured = factor if base is None else _times(base, factor)
    front: Material = GltfSurface(
        base_color=colour, metallic=numbers["metallic"], roughness=numbers["roughness"], name=name
    )
    bent = _image(given, "normalTexture", raw=True)
    if bent is not None:
        front = NormalMap(material=front, map=bent, along_v=True)
    made: Material = TwoSided(front=front)
    if base is not None and _of(given, "alphaMode", str) in ("MASK", "BLEND"):
        opacity = _image(given, "baseColorTexture", raw=True, channel="a")
        assert opacity is not None
        made = Mask(material=made, opacity=opacity)
    return made, _glow(given)


def _glow(given: object) -> Light | None:
    """Return the light of a material that is emissive."""
    image, factor = _image(given, "emissiveTexture"), _levels(given, "emissiveFactor", (0.0,) * 3)
    if max(factor) == 0.0:
        return None
    return Area(radiance=factor if image is None else _times(image, factor))


def _times(image: Bitmap, factor: float | tuple[float, ...]) -> Texture:
    """Return an image times a number or a colour."""
    if factor in (1.0, WHITE):
        return image
    grey = isinstance(factor, float) or max(factor) == min(factor)
    return Product(first=image, second=factor, rgb=not grey)


def _image(
    given: object, name: str, *, raw: bool = False, channel: str = "luminance"
) -> Bitmap | None:
    """Return the image of a material as a texture, None where it has none."""
    image = _of(given, name, object)
    if image is None:
        return None
    modes = ("L", "RGB", "RGBA")
    mode = _of(image, "mode", str)
    if mode not in modes and hasattr(image, "convert"):
        image = image.convert("RGBA" if channel == "a" else "RGB")
    return Bitmap(image=np.asarray(image), raw=raw, channel=channel)


def _levels(given: object, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return a colour of a material: linear, whole numbers of 255 or floats to 1."""
    value = _of(given, name, object)
    if value is None:
        return default
    numbers = np.asarray(value)
    numbers = numbers / 255.0 if numbers.dtype.kind in "iu" else numbers.astype(float)
    return tuple(float(one) for one in np.clip(numbers[:3], 0.0, None))


_T = TypeVar("_T")


def _of(thing: object, name: str, kind: type[_T] | tuple[type[_T], ...]) -> _T | None:
    """Return an attribute where it is of a type, else None."""
    value = getattr(thing, name, None)
    return value if isinstance(value, kind) else None


def camera_of(camera: Camera, to_world: ArrayLike) -> Perspective:
    """Return the camera of a scene of trimesh; to_world: its transform (4, 4)."""
    matrix = np.asarray(to_world, np.float64) @ _EYE_TO_CAMERA
    return Perspective(to_world=matrix, fov=float(camera.fov[0]))
