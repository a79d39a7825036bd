"""Rules of materials that hold others, or layers."""

from __future__ import annotations

import dataclasses

from clpt.errors import SceneError
from clpt.scene.insides import check_indices
from clpt.scene.integrators import Film
from clpt.scene.materials import Layer, Material, parts
from clpt.scene.params import fields_of
from clpt.scene.textures import check_textures
from clpt.scene.values import is_texture

Maps = tuple[tuple[type[Material], bool], ...]


def check_material(material: Material, film: Film) -> None:
    """Raise SceneError for a material whose parts do not fit each other, or the film."""
    listed = list(parts(material))
    for part in listed:
        _check_held(part)
    if len(listed) > 1:
        _check_sides(listed)
        _check_maps(material, (), False)
    for part in listed:
        check_textures(part)
        check_indices((part, *part.layers), film)
        if part.layers and film.mode == "rgb":
            _check_layers(part, part.layers)


def _check_held(material: Material) -> None:
    """Raise SceneError for a composite that lacks a material."""
    values = fields_of(material)
    for field in dataclasses.fields(material):
        if field.type == "Material" and values[field.name] is None:
            raise SceneError(f"{material.kind} needs a material as its {field.name!r}, not none")


def _check_sides(listed: list[Material]) -> None:
    """Raise SceneError for a part that transmits light beside a two_sided material."""
    passing = next((part for part in listed if part.transmits), None)
    if passing is not None and any(part.two_sided for part in listed):
        message = f"{passing.kind} lets light through, so it cannot be a part of two_sided"
        raise SceneError(f"{message}, or be mixed with it")


def _check_maps(material: Material, outer: Maps, inside: bool) -> None:
    """Raise SceneError for nested maps of the same kind, or maps inside and around a two_sided.

    outer: the kinds of the maps around, and whether each is inside of a two_sided material;
    inside: whether this material is.
    """
    if material.perturbs_normals:
        kind = type(material)
        if any(other is kind for other, _ in outer):
            message = f"a {kind.kind} inside of a {kind.kind} is not supported"
            raise SceneError(message)
        if any(before != inside for _, before in outer):
            message = "of normal_map and bump_map, one cannot stand inside and one around a "
            raise SceneError(f"{message}two_sided")
        outer = (*outer, (kind, inside))
    for part in material.shared_parts.values():
        _check_maps(part, outer, inside or material.two_sided)


def _check_layers(material: Material, layers: tuple[Layer, ...]) -> None:
    """Raise SceneError for layers that need the mode spectral."""
    instead = 'or render in the mode "spectral"'
    for name in ("eta", "k"):
        if is_texture(fields_of(material).get(name)):
            message = f"{material.kind}.{name} cannot be a texture below layers in RGB mode; "
            raise SceneError(f"{message}give a spectrum, {instead}")
    textures = {id(layer.profile) for layer in layers if layer.has_textures}
    if len(textures) > 1:
        message = f"one texture can vary the layers of {material.kind} in RGB mode, not several; "
        raise SceneError(f"{message}give them the same one, {instead}")
