"""Lights as they shine: what temperature and strengths such as lumens say, as their emission."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

from clpt.errors import SceneError
from clpt.geometry import analytic
from clpt.geometry.shapes import where
from clpt.scene import Scene
from clpt.scene.lights import STRENGTHS, TEMPERATURE, Light, with_emission
from clpt.scene.shapes import Group, Shape


def plainly_lit(scene: Scene) -> Scene:
    """Return a scene whose lights have plain emissions; the same scene where they have already.

    A light on a shape has the area of the shape in the world, in a group before its instances'
    transforms. Raises SceneError for a light that is dark.
    """
    groups: dict[int, Group] = {}
    lights = [with_emission(light) for light in scene.lights]
    shapes = [_lit(shape, groups) for shape in scene.shapes]
    if _same(lights, scene.lights) and _same(shapes, scene.shapes):
        return scene
    return dataclasses.replace(scene, lights=lights, shapes=shapes)


def _lit(shape: Shape, groups: dict[int, Group]) -> Shape:
    """Return a shape with a plain emission; groups: what was made of each, by its id."""
    if (group := shape.group) is not None:
        if id(group) not in groups:
            shapes = tuple(_lit(shape, groups) for shape in group.shapes)
            same = _same(shapes, group.shapes)
            groups[id(group)] = group if same else dataclasses.replace(group, shapes=shapes)
        lit_group = groups[id(group)]
        placing: dict[str, Any] = {"group": lit_group}
        return shape if lit_group is group else dataclasses.replace(shape, **placing)
    light = shape.emission
    if light is None or not any(_asked(light, name) for name in (TEMPERATURE, *STRENGTHS)):
        return shape
    powered = _asked(light, "power") or _asked(light, "lumens")
    try:
        emission = with_emission(light, analytic.area(shape) if powered else 0.0)
    except SceneError as error:
        raise SceneError(error.message, where=f"{where(shape)}.emission") from None
    return dataclasses.replace(shape, emission=emission)


def _asked(light: Light, name: str) -> bool:
    return vars(light).get(name) is not None


_T = TypeVar("_T", Light, Shape)


def _same(new: Sequence[_T], old: Sequence[_T]) -> bool:
    return all(shape is other for shape, other in zip(new, old, strict=True))
