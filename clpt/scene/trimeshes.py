"""Meshes and scenes of trimesh as clpt has them: arrays, colours, materials and their images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images
from clpt.arrays import number
from clpt.scene import gltf_material
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area, Light
from clpt.scene.materials import Diffuse, GltfSurface, Material, TwoSided
from clpt.scene.textures import Bitmap, MeshAttribute
from clpt.scene.values import TexturedNumber

UNSAID = (102 / 255, 102 / 255, 102 / 255, 1.0)  # of a SimpleMaterial without a colour
_EYE_TO_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])  # trimesh's camera looks along -z, +x right


class Camera(Protocol):
    """The camera of a scene of trimesh."""

    fov: Sequence[float]


def is_scene(value: object) -> bool:
    """Return whether a value is a scene of trimesh."""
    return hasattr(value, "graph") and hasattr(value, "geometry")


def is_mesh(value: object) -> bool:
    """Return whether a value is a mesh of trimesh."""
    return hasattr(value, "faces") and hasattr(value, "vertices") and hasattr(value, "visual")


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

    A `PBRMaterial` becomes the same as in glTF, a `SimpleMaterial` a matt surface. Beside an image,
    trimesh's default colour counts as white.
    """
    material = _of(visual, "material", object)
    if material is None:
        return None
    name = _of(material, "name", str) or ""
    if hasattr(material, "baseColorFactor"):
        return _physical(material, name)
    image, colour = _image(material, "image"), _levels(material, "diffuse", (0.5,) * 3)
    if image is not None and colour == UNSAID:
        colour = gltf_material.WHITE
    shown = gltf_material.tinted(image, colour[:3])
    return TwoSided(front=Diffuse(reflectance=shown, name=name)), None


def _physical(material: object, name: str) -> tuple[Material, Light | None]:
    """Return the material and the light of a `PBRMaterial`."""
    numbers: dict[str, TexturedNumber] = {}
    for channel, parameter in (("b", "metallic"), ("g", "roughness")):
        image = _image(material, "metallicRoughnessTexture", raw=True, channel=channel)
        value = _number(material, f"{parameter}Factor", 1.0)
        numbers[parameter] = gltf_material.times(image, value)
    base = _image(material, "baseColorTexture")
    factor = _levels(material, "baseColorFactor", (1.0,) * 4)
    inner: Material = GltfSurface(
        base_color=gltf_material.tinted(base, factor[:3]), metallic=numbers["metallic"],
        roughness=numbers["roughness"], name=name,
    )  # fmt: skip
    inner = gltf_material.with_normals(inner, _image(material, "normalTexture", raw=True))
    cutoff = _number(material, "alphaCutoff", gltf_material.CUTOFF)
    mode, alpha = _of(material, "alphaMode", str) or "OPAQUE", (*factor, 1.0)[3]
    share = gltf_material.opacity(mode, alpha, base, cutoff)
    both = bool(_of(material, "doubleSided", (bool, np.bool_)))
    return gltf_material.finished(inner, share, _glow(material, both), both=both)


def _glow(material: object, both: bool) -> Area | None:
    """Return the light of a material that is emissive."""
    image, factor = (
        _image(material, "emissiveTexture"),
        _levels(material, "emissiveFactor", (0.0,) * 3),
    )
    if max(factor) == 0.0:
        return None
    return Area(radiance=gltf_material.tinted(image, factor[:3]), two_sided=both)


def _image(
    material: object, name: str, *, raw: bool = False, channel: str = "luminance"
) -> Bitmap | None:
    """Return the image of a material as a texture, None where it has none."""
    image = _of(material, name, object)
    if image is None:
        return None
    if hasattr(image, "convert") and _of(image, "mode", str) not in ("L", "RGB", "RGBA"):
        clear = _of(image, "has_transparency_data", bool)
        image = image.convert("RGBA" if clear else "RGB")
    return Bitmap(image=np.asarray(image), raw=raw, channel=channel)


def _levels(material: object, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return a colour of a material: linear, whole numbers of 255 or floats to 1."""
    value = _of(material, name, object)
    if value is None:
        return default
    numbers = np.asarray(value)
    numbers = numbers / 255.0 if numbers.dtype.kind in "iu" else numbers.astype(float)
    return tuple(float(level) for level in np.clip(numbers, 0.0, None))


def _number(material: object, name: str, default: float) -> float:
    """Return a number of a material."""
    value = _of(material, name, object)
    return default if value is None else number(value, f"material.{name}")


_T = TypeVar("_T")


def _of(owner: object, name: str, kind: type[_T] | tuple[type[_T], ...]) -> _T | None:
    """Return an attribute where it is of a type, else None."""
    value = getattr(owner, name, None)
    return value if isinstance(value, kind) else None


def camera_of(camera: Camera, to_world: ArrayLike) -> Perspective:
    """Return the camera of a scene of trimesh; to_world: its transform (4, 4)."""
    matrix = np.asarray(to_world, np.float64) @ _EYE_TO_CAMERA
    return Perspective(to_world=matrix, fov=float(camera.fov[0]))
