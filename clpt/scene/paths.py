"""Parameters of a scene by path, such as "ball.material.reflectance".

A path begins with `camera`, `film`, `integrator`, `sampler`, `spp`, `noise` or `seed`; with the
name of a shape or of a material; or with `shapes[0]` or `lights[0]`. It goes on with names of
parameters, and with numbers in brackets in lists.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Sequence
from typing import Protocol, TypeVar, cast

from clpt.errors import SceneError, nearest
from clpt.scene.lights import Light
from clpt.scene.materials import Material
from clpt.scene.params import Kind, defaults, params, shorthands
from clpt.scene.shapes import Group, Shape
from clpt.spectra import Spectrum

SINGLE = ("camera", "film", "integrator", "sampler")
NUMBERS = ("spp", "noise", "seed")
MOST_NAMED = 10_000  # shapes, of which more go by their places alone
STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")

MOST_LISTED = 8  # names of parts in a message
Key = str | int


class Parts(Protocol):
    """A scene, as far as paths lead into it."""

    shapes: list[Shape]
    lights: list[Light]


def parameters(scene: Parts) -> dict[str, object]:
    """Return all parameters of a scene by their paths, in its order.

    A material with a name stands once, under that name, and so does what several places share.
    """
    found: dict[str, object] = {}
    seen: set[int] = set()
    for path, root in _roots(scene).items():
        found.update(_inside(path, root, seen))
    return found


def get(scene: Parts, path: str) -> object:
    """Return what is at a path. Raises SceneError, with the nearest names, where nothing is."""
    chain, last = _walked(scene, path)
    return _children(chain[-1][1])[last] if chain else _roots(scene)[cast("str", last)]


def changes(scene: Parts, path: str, value: object) -> dict[str, object]:
    """Return the parts of a scene, by name, with another value at a path.

    What several places share changes at all of them; what is a default changes at this one alone.
    Raises SceneError for a path to nothing, and for a value that makes no sense there.
    """
    if path in (*SINGLE, *NUMBERS):
        return {path: value}
    chain, key = _walked(scene, path, shorthand=True)
    made: dict[int, object] = {}
    if not chain:
        made[id(_roots(scene)[cast("str", key)])] = value
    for i in reversed(range(len(chain))):
        step, thing = chain[i]
        value = _with(thing, key, value)
        above = chain[i - 1][1] if i else None
        usual = isinstance(above, Kind) and defaults(type(above)).get(str(step)) is thing
        if not usual:
            made[id(thing)] = value
        key = step
    seen: dict[int, object] = {}
    parts = {name: _swapped(vars(scene)[name], made, seen) for name in SINGLE}
    parts["shapes"] = [_swapped(one, made, seen) for one in scene.shapes]
    parts["lights"] = [_swapped(one, made, seen) for one in scene.lights]
    return parts


def _roots(scene: Parts) -> dict[str, object]:
    """Return what paths begin with; a name that two have names neither."""
    found: dict[str, object] = {name: vars(scene)[name] for name in (*SINGLE, *NUMBERS)}
    materials = _named_materials(scene)
    names = [shape.name for shape in scene.shapes]
    several = len(names) > MOST_NAMED
    counts = {name: names.count(name) for name in set(names)} if not several else {}
    for i, shape in enumerate(scene.shapes):
        alone = counts.get(shape.name) == 1 and shape.name and shape.name not in found
        found[shape.name if alone else f"shapes[{i}]"] = shape
    found |= {f"lights[{i}]": light for i, light in enumerate(scene.lights)}
    return found | {name: one for name, one in materials.items() if name not in found}


def _named_materials(scene: Parts) -> dict[str, object]:
    """Return the materials that have a name, by it: the first of each name."""
    found: dict[str, object] = {}
    seen: set[int] = set()
    waiting: list[object] = list(reversed(scene.shapes))
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        if isinstance(thing, Material) and thing.name:
            found.setdefault(thing.name, thing)
        waiting += [one for one in _children(thing).values() if _is_inner(one)]
    return found


def _is_inner(thing: object) -> bool:
    """Return whether a value has parameters itself."""
    if isinstance(thing, tuple):
        return any(map(_is_inner, thing))
    return isinstance(thing, (Kind, Group))


def _children(thing: object) -> dict[Key, object]:
    """Return what is directly in a thing: parameters of a kind, fields of a spectrum, items."""
    if isinstance(thing, Kind):
        return {name: vars(thing)[name] for name in params(type(thing))}
    if isinstance(thing, tuple):
        return dict(enumerate(thing))
    if isinstance(thing, (Spectrum, Group)) and dataclasses.is_dataclass(thing):
        return {field.name: vars(thing)[field.name] for field in dataclasses.fields(thing)}
    return {}


def _inside(path: str, thing: object, seen: set[int]) -> dict[str, object]:
    """Return the parameters in a thing by their paths; seen: what is shared and stands already."""
    if not _is_inner(thing) or id(thing) in seen:
        return {path: thing}
    if isinstance(thing, (Material, Group)):
        seen.add(id(thing))
    found: dict[str, object] = {}
    for key, value in _children(thing).items():
        here = f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}"
        named = isinstance(value, Material) and value.name
        found.update({here: value} if named else _inside(here, value, seen))
    return found


def _walked(
    scene: Parts, path: str, *, shorthand: bool = False
) -> tuple[list[tuple[Key, object]], Key]:
    """Return the things on the way to the end of a path, each with its key, and the last key.

    shorthand: whether the last key may be an argument that stands for parameters. Raises SceneError
    where a path leads to nothing.
    """
    if not isinstance(path, str):
        raise TypeError(f"a path is text, such as 'camera.fov', not {path!r}")
    roots = _roots(scene)
    root = max((name for name in roots if _begins(path, name)), key=len, default="")
    if not root:
        raise SceneError(_no_root(path, scene, roots), where=path)
    chain: list[tuple[Key, object]] = []
    key: Key = root
    thing = roots[root]
    for step in _steps(path, path[len(root) :]):
        chain.append((key, thing))
        known = _children(thing)
        key = step
        last = shorthand and isinstance(thing, Kind) and step in shorthands(type(thing))
        if key not in known and not last:
            what = getattr(thing, "kind", type(thing).__name__)
            names = [str(name) for name in known]
            message = f"{what} has no {key!r}{nearest(str(key), names)}"
            raise SceneError(message, where=path)
        thing = known.get(key)
    return chain, key


def _no_root(path: str, scene: Parts, roots: dict[str, object]) -> str:
    """Return what to say of a path whose beginning is no part of a scene."""
    first = re.split(r"[.\[]", path)[0]
    lists: dict[str, Sequence[object]] = {"shapes": scene.shapes, "lights": scene.lights}
    if first not in lists:
        return f"a scene has no {first!r}{nearest(first, _shown(roots))}"
    parts = {id(one) for one in lists[first]}
    known = [name for name, one in roots.items() if id(one) in parts]
    listed = ", ".join(map(repr, known[:MOST_LISTED])) + (", ..." if known[MOST_LISTED:] else "")
    number = re.match(r"[^.]*", path)
    head = number[0] if number else first
    return f"a scene has no {head!r}; its {first} are {listed or 'none'}"


def _shown(roots: dict[str, object]) -> Iterator[str]:
    """Return the names that a message about a wrong root compares."""
    return (name for name in roots if "[" not in name)


def _begins(path: str, root: str) -> bool:
    return path == root or path.startswith((f"{root}.", f"{root}["))


def _steps(path: str, rest: str) -> Iterator[Key]:
    """Yield the names and numbers of the rest of a path. Raises SceneError for another form."""
    at = 0
    while at < len(rest):
        found = STEP.match(rest, at)
        if found is None:
            message = "must be names with dots between, and numbers in brackets"
            raise SceneError(message, where=path)
        yield found[1] if found[1] is not None else int(found[2])
        at = found.end()


def _with(thing: object, key: Key, value: object) -> object:
    """Return a thing with another value at one of its keys."""
    if isinstance(thing, tuple):
        return tuple(value if i == key else one for i, one in enumerate(thing))
    if isinstance(thing, Kind):
        fields = {f.name for f in dataclasses.fields(thing) if f.init}
        plain: dict[str, object] = {name: vars(thing)[name] for name in fields}
        for shorthand in type(thing).shorthands if key in shorthands(type(thing)) else ():
            if key in shorthand.arguments:
                plain = {k: v for k, v in plain.items() if k not in shorthand.stands_for}
        return type(thing)(**{**plain, str(key): value})
    assert dataclasses.is_dataclass(thing) and not isinstance(thing, type)
    return dataclasses.replace(thing, **{str(key): value})


_T = TypeVar("_T")


def _swapped(thing: _T, made: dict[int, object], seen: dict[int, object]) -> _T:
    """Return a thing in which others stand in the place of some, by their ids; seen: so far."""
    if id(thing) in made:
        return cast("_T", made[id(thing)])
    if not _is_inner(thing):
        return thing
    if id(thing) not in seen:
        old = _children(thing)
        new = {key: _swapped(value, made, seen) for key, value in old.items()}
        other: object = thing
        for key, value in new.items():
            if value is not old[key]:
                other = _with(other, key, value)
        seen[id(thing)] = other
    return cast("_T", seen[id(thing)])
