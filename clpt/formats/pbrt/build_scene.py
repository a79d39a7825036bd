"""From the definitions of a file to shapes, groups and lights, with their materials."""

from __future__ import annotations

import contextvars
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np

from clpt import transforms
from clpt.errors import did_you_mean
from clpt.files import budget
from clpt.formats.pbrt.lights import area_light, light
from clpt.formats.pbrt.materials import material
from clpt.formats.pbrt.media import medium
from clpt.formats.pbrt.parametric import joined
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.scattering import body
from clpt.formats.pbrt.shapes import Geometry, displaced, geometry, with_uvs
from clpt.formats.pbrt.state import Contents, Definition, State
from clpt.formats.pbrt.textures import textured
from clpt.formats.reading import Progress, attempt
from clpt.scene.lights import Area, Light
from clpt.scene.materials import Diffuse, Mask, Material, Null, TwoSided
from clpt.scene.media import Medium
from clpt.scene.params import Kind, fields_of
from clpt.scene.roles import REAL
from clpt.scene.shapes import Curves, Group, Instance, Shape
from clpt.scene.textures import MeshAttribute, Product, Texture

SHARES = "face_power"  # the attribute of a mesh whose parts shine unequally
GREY: Material = TwoSided(front=Diffuse(reflectance=0.5))


def shapes(contents: Contents, progress: Progress | None) -> list[Shape]:
    """Make all shapes, those of objects as instances. Raises SceneError."""
    used = {use.kind for use in contents.uses}
    parts = [contents.shapes, *(part for name, part in contents.objects.items() if name in used)]
    definitions = [definition for part in parts for definition in part]
    product = dict(zip(map(id, definitions), _make_all(definitions, progress), strict=True))
    groups = {
        name: Group(shapes=tuple(joined(_of(definitions, product))), name=name)
        for name, definitions in contents.objects.items()
        if name in used
    }
    result = list(joined(_of(contents.shapes, product)))
    for use in contents.uses:
        if use.kind not in groups:
            hint = did_you_mean(use.kind, contents.objects)
            raise use.params.error(f"there is no object {use.kind!r}{hint}")
        if groups[use.kind].shapes:
            with use.params.locating():
                whole = Instance(group=groups[use.kind], to_world=use.state.ctm)
                result.append(_moving(whole, use.state))
    return result


def _of(definitions: Sequence[Definition], result: dict[int, Shape | None]) -> Iterator[Shape]:
    """Yield the shapes of definitions that are not empty."""
    return (shape for each in definitions if (shape := result[id(each)]) is not None)


def _make_all(definitions: list[Definition], progress: Progress | None) -> list[Shape | None]:
    """Make the shapes of definitions: geometry in threads, materials in order."""
    result: list[Shape | None] = []
    workers = min(8, os.cpu_count() or 1)
    with ThreadPoolExecutor(workers) as pool:
        try:
            context = contextvars.copy_context()
            tried = budget.carried(partial(_geometry, context))
            geometries = pool.map(tried, definitions)
            for definition, body in zip(definitions, geometries, strict=True):
                result.append(attempt(partial(_shape, definition, body), None))
                if progress is not None:
                    count = len(definitions)
                    progress(len(result) / count, f"{len(result)} of {count} shapes")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return result


def _geometry(context: contextvars.Context, definition: Definition) -> Geometry | None:
    """Return the geometry of a shape, in a thread of its own that collects errors as its parent."""
    return context.copy().run(attempt, lambda: geometry(definition), None)


def _shape(definition: Definition, form: Geometry | None) -> Shape | None:
    params, state = definition.params, definition.state
    opacity = textured(params, "alpha", REAL, state, 1.0)
    _warn_of_unused(params, state)
    if form is None:
        state.warn(params, "left out, since it has no area")
        return None
    if definition.kind == "plymesh":
        with params.locating():
            form = displaced(form, params, state)
    for warning in form.warnings:
        state.warn(params, warning)
    surface = _material(params, state)
    emission = _emission(state, form)
    if emission is not None and isinstance(surface, Null):
        state.warn(params, "its light is left out, as of all that is of the material 'interface'")
        emission = None
    if not isinstance(opacity, float) or opacity < 1.0:
        surface = Mask(material=surface, opacity=opacity)
        emission = _masked(emission, opacity)
    if _has_texture(surface) or _has_texture(emission):
        if form.kind is Curves:
            state.warn(params, "textures run around and along curves, not along and across")
        form = with_uvs(form)
    with params.locating():
        result = form.made(
            material=surface,
            emission=emission,
            interior=_body(params, state) or medium(state.inside, params, state),
            exterior=medium(state.outside, params, state),
        )
        return _moving(result, state)


def _moving(shape: Shape, state: State) -> Shape:
    """The shape with the keys of the transforms that it was defined in."""
    keys = state.motion()
    if keys is None:
        return shape
    inner = transforms.inverse(state.ctm) @ np.asarray(shape.to_world)
    return replace(shape, to_world=inner, motion=keys)


def _masked(emission: Light | None, opacity: float | Texture) -> Light | None:
    """Return the light of a shape with an alpha: what is not there does not shine.

    By pbrt's rule an alpha of 0 all over hides a lamp and leaves it all its light.
    """
    if emission is None:
        return None
    light = cast(Area, emission)  # as there is no other
    if isinstance(opacity, float) and opacity <= 0.0:
        return replace(light, visible=False)
    return replace(light, radiance=Product(first=light.radiance, second=opacity))


def _material(source: Parameters, state: State) -> Material:
    """Return the material of the state, made once for all shapes."""
    current = state.material
    if current is None:
        return GREY
    if isinstance(current, str):
        return state.named_material(current, source)
    kind, params, defined_in = current.kind, current.params, current.state
    result: Material = state.shared.once(
        current, params, lambda: make_material(kind, params, defined_in, "")
    )
    return result


def _body(source: Parameters, state: State) -> Medium | None:
    """Return the medium in a body of the state's material, made once; None of all but
    `subsurface`."""
    current = state.material
    if isinstance(current, str):
        current = state.latest(state.shared.materials.get(current))
    if current is None or current.kind != "subsurface":
        return None
    params, defined_in = current.params, current.state

    def make() -> list[Medium | None]:
        with params.locating():
            return [body(params, defined_in)]

    result: list[Medium | None] = state.shared.once(("body", id(current)), source, make)
    return result[0]


def make_material(kind: str, params: Parameters, state: State, name: str) -> Material:
    """Make a material, and warn of parameters that it does not have."""
    result = attempt(lambda: material(kind, params, state, name), GREY)
    _warn_of_unused(params, state)
    return result


def _emission(state: State, form: Geometry) -> Light | None:
    """Return the light of the state: all shapes share it, unless it has a power."""
    definition = state.area_light
    if definition is None:
        return None
    kind, params, defined_in = definition.kind, definition.params, definition.state
    powerful = "power" in params and params.one("power", "float", -1.0) > 0.0
    area = float(form.areas().mean()) if powerful else 0.0

    def make() -> Light:
        result = area_light(kind, params, defined_in, area)
        _warn_of_unused(params, defined_in)
        return result

    result: Any = state.shared.once(
        (definition, area), params, make
    )  # an Area, as there is no other
    moved = "displacement" in form.parts
    if powerful and moved:
        state.warn(params, "the 'power' is that of the mean triangle before displacement")
    shares = form.shares() if powerful and not moved else None
    if shares is None:
        return cast(Light, result)
    form.parts["attributes"] = {SHARES: shares[:, None]}
    radiance = Product(first=result.radiance, second=MeshAttribute(name=SHARES))
    return cast(Light, replace(result, radiance=radiance))


def lights(contents: Contents) -> list[Light]:
    """Make all lights that are on no shape. Raises SceneError."""
    lamps = []
    for each in contents.lights:
        lamp = attempt(partial(light, each.kind, each.params, each.state), None)
        if lamp is not None:
            lamps.append(lamp)
            _warn_of_unused(each.params, each.state)
    return lamps


def check_unused_materials(contents: Contents) -> None:
    """Make the named materials that no shape has, for their errors and warnings."""
    for name, versions in contents.shared.materials.items():
        for _, definition in versions:
            definition.state.material_of(name, definition)


def check_options(options: Sequence[Definition]) -> None:
    """Warn of parameters that camera, film and the like do not have."""
    for option in options:
        _warn_of_unused(option.params, option.state)


def _warn_of_unused(params: Parameters, state: State) -> None:
    for parameter in params.unused():
        parameter.used = True
        hint = did_you_mean(parameter.name, params.asked)
        state.warn(parameter, f"is not known here and is left out{hint}")


def _has_texture(item: object) -> bool:
    """Return whether a material or light, or a part of it, has a texture."""
    if isinstance(item, Texture):
        return True
    if not isinstance(item, Kind):
        return False
    return any(map(_has_texture, fields_of(item).values()))


def deduplicated(warnings: Sequence[str]) -> list[str]:
    """Return each warning once, at its first location, with the number of all its locations."""
    first: dict[str, str] = {}
    count: dict[str, int] = {}
    for warning in warnings:
        text = warning.partition(": ")[2]
        first.setdefault(text, warning)
        count[text] = count.get(text, 0) + 1
    numbers = {text: f" (in {n} places)" if n > 1 else "" for text, n in count.items()}
    return [warning + numbers[text] for text, warning in first.items()]
