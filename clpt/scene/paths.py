"""Parameters of a scene by path, such as "ball.material.reflectance".

A path begins with `camera`, `film`, `integrator`, `sampler`, `spp`, `noise` or `seed`; with the
name of a shape or of a material; or with `shapes[0]` or `lights[0]`. Names of parameters follow,
and indices in brackets.
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
MOST_NAMED = 10_000  # most shapes with names in paths; more shapes have indices alone
STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")

MOST_LISTED = 8  # names of parts in a message
Key = str | int


class Parts(Protocol):
    """The lists of a scene that paths enter."""

    shapes: list[Shape]
    lights: list[Light]


def parameters(scene: Parts) -> dict[str, object]:
    """Return all parameters of a scene by their paths, in its order.

    A named material appears once, under its name; a shared object appears at its first path.
    """
    values: dict[str, object] = {}
    seen: set[int] = set()
    for path, root in _roots(scene).items():
        values.update(_inside(path, root, seen))
    return values


def get(scene: Parts, path: str) -> object:
    """Return the value at a path. Raises SceneError with the nearest names for an unknown path."""
    chain, last = _walked(scene, path)
    return _children(chain[-1][1])[last] if chain else _roots(scene)[cast("str", last)]


def changes(scene: Parts, path: str, value: object) -> dict[str, object]:
    """Return the parts of a scene, by name, with another value at a path.

    A shared object changes at all its places; a default object changes at this place alone.
    Raises SceneError for an unknown path, and for a value that its parameter refuses.
    """
    if path in (*SINGLE, *NUMBERS):
        return {path: value}
    chain, key = _walked(scene, path, shorthand=True)
    replacements: dict[int, object] = {}
    if not chain:
        replacements[id(_roots(scene)[cast("str", key)])] = value
    for i in reversed(range(len(chain))):
        step, holder = chain[i]
        value = _with(holder, key, value)
        above = chain[i - 1][1] if i else None
        usual = isinstance(above, Kind) and defaults(type(above)).get(str(step)) is holder
        if not usual:
            replacements[id(holder)] = value
        key = step
    seen: dict[int, object] = {}
    parts = {name: _swapped(vars(scene)[name], replacements, seen) for name in SINGLE}
    parts["shapes"] = [_swapped(shape, replacements, seen) for shape in scene.shapes]
    parts["lights"] = [_swapped(light, replacements, seen) for light in scene.lights]
    return parts


def _roots(scene: Parts) -> dict[str, object]:
    """Return the first parts of paths with their values; a name of two shapes is left out."""
    roots: dict[str, object] = {name: vars(scene)[name] for name in (*SINGLE, *NUMBERS)}
    materials = _named_materials(scene)
    names = [shape.name for shape in scene.shapes]
    several = len(names) > MOST_NAMED
    counts = {name: names.count(name) for name in set(names)} if not several else {}
    for i, shape in enumerate(scene.shapes):
        alone = counts.get(shape.name) == 1 and shape.name and shape.name not in roots
        roots[shape.name if alone else f"shapes[{i}]"] = shape
    roots |= {f"lights[{i}]": light for i, light in enumerate(scene.lights)}
    return roots | {name: material for name, material in materials.items() if name not in roots}


def _named_materials(scene: Parts) -> dict[str, object]:
    """Return the first material of each name, by its name."""
    named: dict[str, object] = {}
    seen: set[int] = set()
    waiting: list[object] = list(reversed(scene.shapes))
    while waiting:
        value = waiting.pop()
        if id(value) in seen:
            continue
        seen.add(id(value))
        if isinstance(value, Material) and value.name:
            named.setdefault(value.name, value)
        waiting += [child for child in _children(value).values() if _is_inner(child)]
    return named


def _is_inner(value: object) -> bool:
    """Return whether a value has parameters."""
    if isinstance(value, tuple):
        return any(map(_is_inner, value))
    return isinstance(value, (Kind, Group))


def _children(value: object) -> dict[Key, object]:
    """Return the direct parts of a value: parameters of a kind, fields of a spectrum, members."""
    if isinstance(value, Kind):
        return {name: vars(value)[name] for name in params(type(value))}
    if isinstance(value, tuple):
        return dict(enumerate(value))
    if isinstance(value, (Spectrum, Group)) and dataclasses.is_dataclass(value):
        return {field.name: vars(value)[field.name] for field in dataclasses.fields(value)}
    return {}


def _inside(path: str, value: object, seen: set[int]) -> dict[str, object]:
    """Return the parameters in a value by their paths; seen: ids of shared objects so far."""
    if not _is_inner(value) or id(value) in seen:
        return {path: value}
    if isinstance(value, (Material, Group)):
        seen.add(id(value))
    inner: dict[str, object] = {}
    for key, child in _children(value).items():
        here = f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}"
        named = isinstance(child, Material) and child.name
        inner.update({here: child} if named else _inside(here, child, seen))
    return inner


def _walked(
    scene: Parts, path: str, *, shorthand: bool = False
) -> tuple[list[tuple[Key, object]], Key]:
    """Return the objects along a path, each with its key, and the last key.

    shorthand: whether the last key may be an argument that stands for parameters. Raises SceneError
    for an unknown path.
    """
    if not isinstance(path, str):
        raise TypeError(f"a path is text, such as 'camera.fov', not {path!r}")
    roots = _roots(scene)
    root = max((name for name in roots if _begins(path, name)), key=len, default="")
    if not root:
        raise SceneError(_no_root(path, scene, roots), where=path)
    chain: list[tuple[Key, object]] = []
    key: Key = root
    value = roots[root]
    for step in _steps(path, path[len(root) :]):
        chain.append((key, value))
        known = _children(value)
        key = step
        last = shorthand and isinstance(value, Kind) and step in shorthands(type(value))
        if key not in known and not last:
            kind = getattr(value, "kind", type(value).__name__)
            names = [str(name) for name in known]
            message = f"{kind} has no {key!r}{nearest(str(key), names)}"
            raise SceneError(message, where=path)
        value = known.get(key)
    return chain, key


def _no_root(path: str, scene: Parts, roots: dict[str, object]) -> str:
    """Return the message for a path whose first part is unknown."""
    first = re.split(r"[.\[]", path)[0]
    lists: dict[str, Sequence[object]] = {"shapes": scene.shapes, "lights": scene.lights}
    if first not in lists:
        return f"a scene has no {first!r}{nearest(first, _shown(roots))}"
    parts = {id(part) for part in lists[first]}
    known = [name for name, part in roots.items() if id(part) in parts]
    listed = ", ".join(map(repr, known[:MOST_LISTED])) + (", ..." if known[MOST_LISTED:] else "")
    number = re.match(r"[^.]*", path)
    head = number[0] if number else first
    return f"a scene has no {head!r}; its {first} are {listed or 'none'}"


def _shown(roots: dict[str, object]) -> Iterator[str]:
    """Return the names that a message about an unknown first part compares."""
    return (name for name in roots if "[" not in name)


def _begins(path: str, root: str) -> bool:
    return path == root or path.startswith((f"{root}.", f"{root}["))


def _steps(path: str, tail: str) -> Iterator[Key]:
    """Yield the names and indices in the tail of a path. Raises SceneError for another form."""
    at = 0
    while at < len(tail):
        step = STEP.match(tail, at)
        if step is None:
            message = "must be names with dots between, and numbers in brackets"
            raise SceneError(message, where=path)
        yield step[1] if step[1] is not None else int(step[2])
        at = step.end()


def _with(holder: object, key: Key, value: object) -> object:
    """Return a copy of an object with another value at a key."""
    if isinstance(holder, tuple):
        return tuple(value if i == key else member for i, member in enumerate(holder))
    if isinstance(holder, Kind):
        fields = {f.name for f in dataclasses.fields(holder) if f.init}
        plain: dict[str, object] = {name: vars(holder)[name] for name in fields}
        for shorthand in type(holder).shorthands if key in shorthands(type(holder)) else ():
            if key in shorthand.arguments:
                plain = {k: v for k, v in plain.items() if k not in shorthand.stands_for}
        return type(holder)(**{**plain, str(key): value})
    assert dataclasses.is_dataclass(holder) and not isinstance(holder, type)
    return dataclasses.replace(holder, **{str(key): value})


_T = TypeVar("_T")


def _swapped(value: _T, replacements: dict[int, object], seen: dict[int, object]) -> _T:
    """Return a value with parts replaced, by the ids of the former; seen: results by id."""
    if id(value) in replacements:
        return cast("_T", replacements[id(value)])
    if not _is_inner(value):
        return value
    if id(value) not in seen:
        old = _children(value)
        new = {key: _swapped(child, replacements, seen) for key, child in old.items()}
        other: object = value
        for key, child in new.items():
            if child is not old[key]:
                other = _with(other, key, child)
        seen[id(value)] = other
    return cast("_T", seen[id(value)])
