"""Fingerprints of scenes: whether two scenes have the same samples, and what differs if not."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from clpt.arrays import on_device, on_host
from clpt.errors import SceneError
from clpt.files import input_files
from clpt.scene import Scene
from clpt.scene.materials import Material
from clpt.scene.params import Kind, fields_of, params
from clpt.scene.shapes import Group, Shape

Plain: TypeAlias = bool | int | float | str | None
Values: TypeAlias = dict[str, Plain]

DIGEST = "sha256:"  # begins a value that stands for many
SHORT = 4  # numbers of a list up to which it is shown
MOST_LISTED = 64  # members of a list up to which each is shown in full
MOST_DIGESTS = 4096  # up to which each has a digest; more have one together
WITHOUT_SAMPLES = (
    "spp",
    "noise",
    "name",
    "warnings",
    "extra",
    "account",
)  # of a scene: they change no sample
ARRAYS: dict[str, DTypeLike] = {  # how the lowering reads what a host parameter holds, by its form
    "rows2": np.float32, "rows3": np.float32, "rows4": np.float32, "normals": np.float32,
    "attributes": np.float32, "grid": np.float32, "triangles": np.uint32, "lengths": np.int64,
}  # fmt: skip
NAMELESS = (bool, int, float, type(None), np.ndarray, np.generic)  # hold no name of a file
FILES = ("image", "cube_images")  # forms of host parameters that may name files
PIECE = 1 << 20  # bytes of a file that are read at once


@dataclass(frozen=True)
class Fingerprint:
    """The values that decide a scene's samples, by flat names such as "camera.fov".

    Arrays, files and long lists stand as the SHA-256 of their content.
    """

    values: Mapping[str, Plain]

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of all of it, in hexadecimal."""
        return _digest(self.values)

    def differences(self, other: Fingerprint) -> list[str]:
        """Return what differs in another one, such as "camera.fov: 40.0 -> 45.0"."""
        found: dict[str, tuple[Plain, Plain]] = {}
        for name in dict.fromkeys((*self.values, *other.values)):
            own, given = self.values.get(name, ABSENT), other.values.get(name, ABSENT)
            if type(own) is not type(given) or own != given:
                found[name] = own, given
        return [
            f"{name}: {_change(*values)}"
            for name, values in found.items()
            if not any(_tells(found, owner, ABSENT in values) for owner in _owners(name))
        ]


ABSENT = DIGEST + "absent"


def fingerprint(scene: Scene, files: Mapping[str, str] | None = None) -> Fingerprint:
    """Return the fingerprint of a scene.

    It leaves out what changes no sample: how many there are, the limit of noise, names. Images are
    read as bytes; arrays on a device are copied to the host. files: what stands for files that were
    read before, by path, see `file_digest`; they may have changed since.

    Raises SceneError for what cannot be read, with its name.
    """
    walk = _Walk(files or {})
    values: Values = {}
    for part in dataclasses.fields(scene):
        if part.name not in WITHOUT_SAMPLES:
            values |= _under(part.name, walk.values(getattr(scene, part.name), part.name))
    return Fingerprint(values)


class _Walk:
    """One walk through a scene; what several shapes share is read once."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self._files = files
        self._known: dict[tuple[int, str], Values] = {}
        self._alive: list[Any] = []  # so that no id is used again

    def values(self, thing: object, where: str, form: str = "") -> Values:
        """Return what a thing consists of, by names below its own; "" is the thing itself.

        where: its name, for errors; form: of the parameter that holds it, see HostForm.
        """
        if thing is None or isinstance(thing, (bool, int, float, np.generic)):
            return {"": _plain(thing)}
        if isinstance(thing, (str, os.PathLike)):
            return {"": self._file(os.fspath(thing), where) if form in FILES else os.fspath(thing)}
        key = id(thing), form
        if key not in self._known:
            self._alive.append(thing)
            self._known[key] = self._inner(thing, where, form)
        return self._known[key]

    def _inner(self, thing: object, where: str, form: str) -> Values:
        if isinstance(thing, Group):  # many instances may share many shapes
            return {"": _digest(self._fields(thing, where))}
        if dataclasses.is_dataclass(thing):
            return self._fields(thing, where)
        if isinstance(thing, Mapping):
            return self._members(sorted(thing.items()), where, form)
        if isinstance(thing, np.ndarray):
            return {"": _array(thing, form)}
        if hasattr(thing, "context"):  # PyOpenCL's arrays, and its buffers, which have no type
            if not hasattr(thing, "get"):
                raise SceneError(
                    "is a buffer on a device; an Array of PyOpenCL is read", where=where
                )
            read = on_host(thing) if on_device(thing) else thing.get()
            return {"": _array(np.asarray(read), form)}
        if isinstance(thing, Sequence):
            numbers = _numbers(thing)
            if numbers is not None:
                return {"": _array(numbers, form)}
            return self._list(thing, where, form)
        raise SceneError(f"cannot be compared: a {type(thing).__name__}", where=where)

    def _file(self, path: str, where: str) -> str:
        return self._files.get(path) or file_digest(Path(path), where)

    def _fields(self, thing: Any, where: str) -> Values:
        """The parameters of a kind, or the fields of another dataclass."""
        cls: Any = type(thing)
        found: Values = {".type": thing.kind if isinstance(thing, Kind) else cls.__name__}
        given = fields_of(thing)
        for name, form in _plan(cls):
            inner = self.values(given[name], f"{where}.{name}", form)
            for below, value in inner.items():
                found[f".{name}{below}"] = value
        return found

    def _members(self, pairs: list[tuple[str, Any]], where: str, form: str) -> Values:
        found: Values = {}
        for name, value in pairs:
            found |= _under(f"[{name}]", self.values(value, f"{where}[{name}]", form))
        return found or {"": None}

    def _list(self, things: Sequence[Any], where: str, form: str) -> Values:
        """The members of a list: in full, or as digests where there are many."""
        members = [self.values(one, f"{where}[{i}]", form) for i, one in enumerate(things)]
        found: Values = {".count": len(members)}
        if len(members) > MOST_DIGESTS:
            return {**found, "": _digest([_digest(one) for one in members])}
        for i, one in enumerate(members):
            shown: Values = one if len(members) <= MOST_LISTED else {"": _digest(one)}
            found |= _under(f"[{i}]", shown)
        return found


def named_files(whole: object) -> set[str]:
    """Return the paths of the files that the images of a scene, or of a part, are read from."""
    found: set[str] = set()
    seen: dict[int, object] = {}
    waiting: list[tuple[Any, str]] = [(whole, "")]
    while waiting:
        thing, form = waiting.pop()
        if isinstance(thing, NAMELESS) or id(thing) in seen:
            continue
        seen[id(thing)] = thing
        if form in FILES and isinstance(thing, (str, os.PathLike)):
            found.add(os.fspath(thing))
        elif hasattr(thing, "__dataclass_fields__"):
            held = fields_of(thing)
            waiting += [(held[name], one) for name, one in _plan(thing.__class__)]
        elif isinstance(thing, dict):
            waiting += [(one, form) for one in thing.values()]
        elif isinstance(thing, (list, tuple)) and form not in ARRAYS:
            waiting += [(one, form) for one in thing]
    return found


@cache
def _plan(cls: Any) -> list[tuple[str, str]]:
    """The fields of a class that count, with the forms of its host parameters."""
    declared, named = params(cls), issubclass(cls, (Shape, Material, Group))
    names = [part.name for part in dataclasses.fields(cls) if not (named and part.name == "name")]
    return [(name, declared[name].role.name if name in declared else "") for name in names]


def _under(name: str, values: Values) -> Values:
    return {name + below: value for below, value in values.items()}


def _owners(name: str) -> Iterator[str]:
    """Yield what a name stands in, as far as it is not that which tells its own type or count."""
    whole = name.removesuffix(".type").removesuffix(".count")
    for i, letter in enumerate(name):
        if letter in ".[" and i < len(whole):
            yield name[:i]


def _tells(found: Mapping[str, Any], owner: str, absent: bool) -> bool:
    """Whether another type, or another count of members, tells why what stands in it differs."""
    return f"{owner}.type" in found or (absent and f"{owner}.count" in found)


def _plain(value: Any) -> Plain:
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return value


def _numbers(things: Sequence[Any]) -> NDArray[Any] | None:
    """A list, perhaps of lists, as an array if it holds numbers only; None: it does not."""
    if not things or not all(isinstance(t, (int, float, np.generic, Sequence)) for t in things):
        return None
    try:
        array = np.asarray(things)
    except ValueError:  # of rows that differ in length
        return None
    return array if array.dtype.kind in "biuf" else None


def _array(array: NDArray[Any], form: str) -> str:
    """Numbers as a text: those of a few, else the digest of their type, shape and bytes."""
    if array.size <= 16 and array.dtype.kind in "iuf":
        array = array.astype(np.float64)  # a matrix is the same as lists or in another type
        if array.ndim == 1 and array.size <= SHORT:
            return ", ".join(f"{float(value)!r}" for value in array)
    elif form in ARRAYS:
        array = np.asarray(array, ARRAYS[form])
    array = np.ascontiguousarray(array)
    hashed = hashlib.sha256(f"{array.dtype.str} {array.shape} ".encode())
    content: Any = array.reshape(-1).view(np.uint8)
    hashed.update(content)
    return DIGEST + hashed.hexdigest()


def file_digest(path: Path, where: str = "") -> str:
    """Return what stands for a file's bytes. Raises SceneError for what cannot be read."""
    hashed = hashlib.sha256()
    try:
        with input_files.opened(path) as file:
            while piece := file.read(PIECE):
                hashed.update(piece)
    except SceneError as error:
        raise SceneError(error.message, file=path, where=where) from None
    except OSError as error:
        raise SceneError(f"cannot be read: {error.strerror}", file=path, where=where) from error
    return DIGEST + hashed.hexdigest()


def _digest(values: Any) -> str:
    text = json.dumps(values if isinstance(values, list) else dict(values), sort_keys=True)
    return DIGEST + hashlib.sha256(text.encode()).hexdigest()


def _change(own: Plain, given: Plain) -> str:
    """Describe the change of a value for people."""
    shown = [_shown(value) for value in (own, given)]
    return "its content differs" if shown == ["..", ".."] else " -> ".join(shown)


def _shown(value: Plain) -> str:
    if value == ABSENT:
        return "absent"
    return ".." if isinstance(value, str) and value.startswith(DIGEST) else str(value)
