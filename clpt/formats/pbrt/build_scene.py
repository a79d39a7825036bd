"""From the definitions of a file to shapes, groups and lights, with their materials."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from clpt.formats.pbrt.curves import joined
from clpt.formats.pbrt.files import Contents
from clpt.formats.pbrt.lights import area_light, light
from clpt.formats.pbrt.materials import material
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.shapes import Geometry, geometry, with_uvs
from clpt.formats.pbrt.state import Definition, State, nearest
from clpt.formats.pbrt.textures import textured
from clpt.scene.lights import Light
from clpt.scene.materials import Diffuse, Mask, Material, TwoSided
from clpt.scene.params import Kind, params
from clpt.scene.shapes import Curves, Group, Instance, Shape

Progress = Callable[[float, str], None]
GREY = TwoSided(front=Diffuse(reflectance=0.5))


def shapes(contents: Contents, progress: Progress | None) -> list[Shape]:
    """Make all shapes, those of objects as instances. Raises SceneError."""
    used = {use.kind for use in contents.uses}
    parts = [contents.shapes, *(part for name, part in contents.objects.items() if name in used)]
    flat = [found for part in parts for found in part]
    made = dict(zip(map(id, flat), _all(flat, progress), strict=True))
    groups = {
        name: Group(shapes=tuple(joined(_present(made, found))), name=name)
        for name, found in contents.objects.items()
        if name in used
    }
    whole = list(joined(_present(made, contents.shapes)))
    for use in contents.uses:
        if use.kind not in groups:
            hint = nearest(use.kind, contents.objects)
            raise use.params.error(f"there is no object {use.kind!r}{hint}")
        if groups[use.kind].shapes:
            with use.params.locating():
                whole.append(Instance(group=groups[use.kind], to_world=use.state.ctm))
    return whole


def _present(made: dict[int, Shape | None], found: Sequence[Definition]) -> Iterator[Shape]:
    return (shape for one in found if (shape := made[id(one)]) is not None)


def _all(found: list[Definition], progress: Progress | None) -> list[Shape | None]:
    """The shapes of definitions: geometry side by side, then materials one after the other."""
    made: list[Shape | None] = []
    workers = min(8, os.cpu_count() or 1)
    with ThreadPoolExecutor(workers) as pool:
        try:
            for one, read in zip(found, pool.map(geometry, found), strict=True):
                made.append(_shape(one, read))
                if progress is not None:
                    progress(len(made) / len(found), f"{len(made)} of {len(found)} shapes")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return made


def _shape(found: Definition, read: Geometry | None) -> Shape | None:
    given, state = found.params, found.state
    opacity = textured(given, "alpha", "real", state, 1.0)
    _report(given, state)
    if read is None:
        state.warn(given, "left out, since it has no area")
        return None
    for note in read.notes:
        state.warn(given, note)
    surface = _material(given, state)
    emission = _emission(state, read)
    if not isinstance(opacity, float) or opacity < 1.0:
        surface = Mask(material=surface, opacity=opacity)
        if emission is not None:
            state.warn(given, "'alpha' hides its surface, but not its light")
    if _has_texture(surface) or _has_texture(emission):
        if read.kind is Curves:
            state.warn(given, "textures run around and along curves, not along and across")
        read = with_uvs(read)
    with given.locating():
        return read.made(material=surface, emission=emission)


def _material(place: Parameters, state: State) -> Material:
    """The material that the state names, made once."""
    current = state.material
    if current is None:
        return GREY
    if isinstance(current, str):
        return state.named_material(current, place)
    return _made(current)


def _made(found: Definition) -> Material:
    made: Material = found.state.shared.once(
        found, found.params, lambda: named(found.kind, found.params, found.state, "")
    )
    return made


def named(kind: str, given: Parameters, state: State, name: str) -> Material:
    """Make a material, and tell which of its parameters mean nothing to it."""
    made = material(kind, given, state, name)
    _report(given, state)
    return made


def _emission(state: State, read: Geometry) -> Light | None:
    """The light of the state on a shape: one for all shapes, but where its power is given."""
    found = state.area_light
    if found is None:
        return None
    area = read.area() if "power" in found.params else 0.0

    def make() -> Light:
        made = area_light(found.kind, found.params, found.state, area)
        _report(found.params, found.state)
        return made

    made: Light = state.shared.once((found, area), found.params, make)
    return made


def lights(contents: Contents) -> list[Light]:
    """Make all lights that are on no shape. Raises SceneError."""
    made = []
    for found in contents.lights:
        made.append(light(found.kind, found.params, found.state))
        _report(found.params, found.state)
    return made


def remaining(contents: Contents) -> None:
    """Make the named materials that no shape has, so that their errors are told too."""
    for name, found in contents.shared.materials.items():
        found.state.named_material(name, found.params)


def report(options: Sequence[Definition]) -> None:
    """Tell which parameters of camera, film and the like mean nothing."""
    for found in options:
        _report(found.params, found.state)


def _report(given: Parameters, state: State) -> None:
    for extra in given.unused():
        extra.used = True
        hint = nearest(extra.name, given.asked)
        state.warn(extra, f"means nothing here{hint}")


def _has_texture(thing: Any) -> bool:
    """Whether a material or light, or one inside it, varies with uv."""
    if getattr(thing, "is_texture", False):
        return True
    if not isinstance(thing, Kind):
        return False
    return any(_has_texture(getattr(thing, name)) for name in params(type(thing)))


def folded(warnings: Sequence[str]) -> list[str]:
    """Warnings of which those that say the same of many places stand once, with their number."""
    first: dict[str, str] = {}
    count: dict[str, int] = {}
    for warning in warnings:
        said = warning.partition(": ")[2]
        first.setdefault(said, warning)
        count[said] = count.get(said, 0) + 1
    more = {said: f" (in {n} places)" if n > 1 else "" for said, n in count.items()}
    return [text + more[said] for said, text in first.items()]
