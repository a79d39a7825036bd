"""Features of programs that many scenes share: those of a scene, and all that scenes often have.

A program for a single scene holds only what the scene uses, so another scene compiles another. A
shared program also holds the usual materials, textures and lights. Its pictures have other noise.
`python -m bench.sharing` has what sharing costs and saves.
"""

from __future__ import annotations

import functools
from dataclasses import replace

from clpt.render.records import Features
from clpt.render.records.materials import Sources
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.params import device_params
from clpt.scene.roles import Param
from clpt.scene.scatterer import Scatterer

LEAVES: tuple[type[mt.Material], ...] = (
    mt.Diffuse,
    mt.Dielectric,
    mt.RoughDielectric,
    mt.Conductor,
    mt.RoughConductor,
    mt.Plastic,
    mt.RoughPlastic,
    mt.Principled,
)
SEEN_THROUGH: tuple[type[mt.Material], ...] = (mt.ThinDielectric, mt.Null)
SURFACES: tuple[type[mt.Material], ...] = (mt.GltfSurface, mt.Openpbr)  # those of whole scenes
LIGHTS = ("constant", "disk", "envmap", "rectangle", "sphere", "triangle")
TEXTURES = (
    ("bitmap", "real"),
    ("bitmap", "reflectance"),
    ("checkerboard", "reflectance"),
    ("packed_bitmap", "real"),
    ("packed_bitmap", "reflectance"),
)
MIXTURES = 2  # masks in blends, or blends in masks
# Lobes that 0 leaves out
LOBES = ("absorption", "base_metalness", "clearcoat", "coat_weight", "metallic", "spec_tint")
INNER: Sources = frozenset({
    ("emission", "value", "constant"),
    ("emission", "value", "table"),
    ("mixture", "weight", "constant"),
    ("mixture", "weight", "texture"),
    ("perturbation", "value", "texture"),
})  # fmt: skip


def leaves(own: tuple[type[mt.Material], ...]) -> tuple[type[mt.Material], ...]:
    """Return the kinds of leaf materials of a shared program for a scene's kinds."""
    panes = SEEN_THROUGH if any(cls in SEEN_THROUGH for cls in own) else ()
    every = {*own, *LEAVES, *panes}
    listed = tuple(cls for cls in mt.LEAVES if cls in every)
    return (*listed, *(cls for cls in own if cls not in mt.LEAVES))


def widened(own: Features) -> Features:
    """Return the features of a shared program for the features of a scene."""
    lights, textures, materials = own.lights, own.textures, own.materials
    every = (*LEAVES, *SEEN_THROUGH, *SURFACES)
    usual = tuple(cls for cls in every if cls in materials.leaves)
    return replace(
        own,
        transport=replace(own.transport, aimed=own.transport.aimed or int(own.transport.balanced)),
        lights=replace(
            lights,
            kinds=tuple(sorted({*lights.kinds, *LIGHTS})),
            infinite=True,
            visible=True,
            two_sided=True,
            few=False,
        ),
        geometry=replace(own.geometry, normals=True, uvs=True, tangents=True),
        textures=replace(textures, roles=tuple(sorted({*textures.roles, *TEXTURES}))),
        materials=replace(
            materials,
            transmitting=tuple(sorted({*materials.transmitting, *_transmitting(usual)})),
            shining=tuple(cls.kind for cls in materials.leaves if cls in usual),
            mixtures=max(materials.mixtures, MIXTURES),
            sources=materials.sources | _sources(usual) | INNER,
        ),
    )


@functools.cache
def _transmitting(kinds: tuple[type[mt.Material], ...]) -> tuple[str, ...]:
    return tuple(cls.kind for cls in kinds if cls().transmits)


@functools.cache
def _sources(kinds: tuple[type[mt.Material], ...]) -> Sources:
    return frozenset(
        (cls.kind, name, source)
        for cls in kinds
        for name, param in device_params(cls).items()
        for source in _sources_of(cls, name, param)
    )


def _sources_of(cls: type[Scatterer], name: str, param: Param) -> tuple[str, ...]:
    """Return the usual sources of a parameter, see `clpt.render.materials.cases`."""
    if param.role is roles.FLAG:
        return "0", "1"
    if param.role is roles.CHOICE:
        return tuple(map(str, range(len(param.choices))))
    if param.role is roles.INDEX:
        return ("grey",) if cls.refracts else ("grey", "table")
    none = ("none",) if param.lobe else ()
    if param.lobe and name not in LOBES:
        return none
    return ("constant", "texture", *none) if param.textured else ("constant", *none)
