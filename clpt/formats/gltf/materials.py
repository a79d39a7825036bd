"""Materials: what glTF says of a surface."""

from __future__ import annotations

from clpt.formats.gltf.document import Element
from clpt.formats.gltf.textures import texture
from clpt.scene.lights import Area
from clpt.scene.materials import Diffuse, Material, TwoSided

EXTENSIONS: tuple[str, ...] = ()
DEFAULT = TwoSided(front=Diffuse(reflectance=1.0))


def material(element: Element | None, *, colours: bool = False) -> tuple[Material, Area | None]:
    """Return a material and what it emits; the default one if None.

    colours: the mesh has an attribute "vertex_color" that multiplies the base colour, and
    "vertex_alpha" its alpha.
    """
    if element is None:
        return DEFAULT, None
    surface = element.child("pbrMetallicRoughness")
    name = element.text("name", "")
    if surface is None:
        return TwoSided(front=Diffuse(reflectance=1.0, name=name)), None
    factor = surface.numbers("baseColorFactor", 4, (1.0, 1.0, 1.0, 1.0), low=0.0, high=1.0)
    info = surface.child("baseColorTexture")
    colour = factor[:3] if info is None else texture(info)
    return TwoSided(front=Diffuse(reflectance=colour, name=name)), None
