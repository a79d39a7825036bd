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

DIGEST = "sha256:"  # prefix of the digest of several values
SHORT = 4  # longest list of numbers that is shown
MOST_LISTED = 64  # longest list whose members are shown in full
MOST_DIGESTS = 4096  # longest list with a digest for each member; a longer list has a single digest
WITHOUT_SAMPLES = (
    "spp",
    "noise",
    "name",
    "warnings",
    "extra",
    "account",
)  # fields of a scene that change no sample
ARRAYS: dict[str, DTypeLike] = {  # how lowering reads a host parameter, by its form
    "rows2": np.float32, "rows3": np.float32, "rows4": np.float32, "normals": np.float32,
    "attributes": np.float32, "grid": np.float32, "triangles": np.uint32, "lengths": np.int64,
}  # fmt: skip
NAMELESS = frozenset({bool, int, float, type(None), np.ndarray})  # types without names of files
FILES = ("image", "cube_images")  # forms of host parameters that may name files
PIECE = 1 << 20  # bytes of a read


@dataclass(frozen=True)
class Fingerprint:
    """The values that decide a scene's samples, by flat names such as "camera.fov".

    An array, a file or a long list has the SHA-256 of its content as its value.
    """

    values: Mapping[str, Plain]

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of all values, in hexadecimal."""
        return _digest(self.values)

    def differences(self, other: Fingerprint) -> list[str]:
        """Return the differences of another fingerprint, such as "camera.fov: 40.0 -> 45.0"."""
        differing: dict[str, tuple[Plain, Plain]] = {}
        for name in dict.fromkeys((*self.values, *other.values)):
            before, after = self.values.get(name, ABSENT), other.values.get(name, ABSENT)
            if type(before) is not type(after) or before != after:
                differing[name] = before, after
        return [
            f"{name}: {_change(*values)}"
            for name, values in differing.items()
            if not any(_explained_by(differing, p, ABSENT in values) for p in _parents(name))
        ]


ABSENT = DIGEST + "absent"


def fingerprint(scene: Scene, files: Mapping[str, str] | None = None) -> Fingerprint:
    """Return the fingerprint of a scene.

    Fields that change no sample are left out: the number of samples, the limit of noise, names.
    Images are read as bytes; arrays on a device are copied to the host. files: digests of files
    that were read before, by path, see `file_digest`; the files may have changed since.

    Raises SceneError, with the name of a part, if the part cannot be read.
    """
    walk = _Walk(files or {})
    values: Values = {}
    for part in dataclasses.fields(scene):
        if part.name not in WITHOUT_SAMPLES:
            values |= _under(part.name, walk.values(getattr(scene, part.name), part.name))
    return Fingerprint(values)


class _Walk:
    """A walk through a scene, which reads shared objects once."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self._files = files
        self._known: dict[tuple[int, str], Values] = {}
        self._alive: list[Any] = []  # so that no id is used again

    def values(self, part: object, where: str, form: str = "") -> Values:
        """Return the plain values of a part, by paths relative to it; "" is the part itself.

        where: its path, for errors; form: of the parameter that holds it, see HostForm.
        """
        if part is None or isinstance(part, (bool, int, float, np.generic)):
            return {"": _plain(part)}
        if isinstance(part, (str, os.PathLike)):
            return {"": self._file(os.fspath(part), where) if form in FILES else os.fspath(part)}
        key = id(part), form
        if key not in self._known:
            self._alive.append(part)
            self._known[key] = self._inner(part, where, form)
        return self._known[key]

    def _inner(self, part: object, where: str, form: str) -> Values:
        if isinstance(part, Group):  # many instances may share many shapes
            return {"": _digest(self._fields(part, where))}
        if dataclasses.is_dataclass(part):
            return self._fields(part, where)
        if isinstance(part, Mapping):
            return self._members(sorted(part.items()), where, form)
        if isinstance(part, np.ndarray):
            return {"": _array(part, form)}
        if hasattr(part, "context"):  # arrays and buffers of PyOpenCL; buffers have no dtype
            if not hasattr(part, "get"):
                raise SceneError(
                    "is a buffer on a device; an Array of PyOpenCL is read", where=where
                )
            read = on_host(part) if on_device(part) else part.get()
            return {"": _array(np.asarray(read), form)}
        if isinstance(part, Sequence):
            numbers = _numbers(part)
            if numbers is not None:
                return {"": _array(numbers, form)}
            return self._list(part, where, form)
        raise SceneError(f"cannot be compared: a {type(part).__name__}", where=where)

    def _file(self, path: str, where: str) -> str:
        return self._files.get(path) or file_digest(Path(path), where)

    def _fields(self, part: Any, where: str) -> Values:
        """Return the parameters of a kind, or the fields of another dataclass."""
        cls: Any = type(part)
        values: Values = {".type": part.kind if isinstance(part, Kind) else cls.__name__}
        fields = fields_of(part)
        for name, form in _plan(cls):
            inner = self.values(fields[name], f"{where}.{name}", form)
            for below, value in inner.items():
                values[f".{name}{below}"] = value
        return values

    def _members(self, pairs: list[tuple[str, Any]], where: str, form: str) -> Values:
        values: Values = {}
        for name, value in pairs:
            values |= _under(f"[{name}]", self.values(value, f"{where}[{name}]", form))
        return values or {"": None}

    def _list(self, listed: Sequence[Any], where: str, form: str) -> Values:
        """Return the members of a list, in full or as digests; see MOST_LISTED and MOST_DIGESTS."""
        members = [self.values(member, f"{where}[{i}]", form) for i, member in enumerate(listed)]
        values: Values = {".count": len(members)}
        if len(members) > MOST_DIGESTS:
            return {**values, "": _digest([_digest(member) for member in members])}
        for i, member in enumerate(members):
            shown: Values = member if len(members) <= MOST_LISTED else {"": _digest(member)}
            values |= _under(f"[{i}]", shown)
        return values


def named_files(whole: object) -> set[str]:
    """Return the paths of the image files of a scene, or of a part of it."""
    paths: set[str] = set()
    seen: dict[int, object] = {}
    waiting: list[tuple[Any, str]] = [(whole, "")]
    while waiting:
        part, form = waiting.pop()
        if id(part) in seen:
            continue
        seen[id(part)] = part
        if form in FILES and isinstance(part, (str, os.PathLike)):
            paths.add(os.fspath(part))
        elif hasattr(part, "__dataclass_fields__"):
            fields = fields_of(part)
            below = [(fields[name], form) for name, form in _plan(part.__class__)]
            waiting += [each for each in below if type(each[0]) not in NAMELESS]
        elif isinstance(part, dict):
            waiting += [(value, form) for value in part.values()]
        elif isinstance(part, (list, tuple)) and form not in ARRAYS:
            waiting += [(value, form) for value in part if type(value) not in NAMELESS]
    return paths


@cache
def _plan(cls: Any) -> list[tuple[str, str]]:
    """Return the fields of a class that decide samples, each with its form as a host parameter."""
    declared, named = params(cls), issubclass(cls, (Shape, Material, Group))
    names = [part.name for part in dataclasses.fields(cls) if not (named and part.name == "name")]
    return [(name, declared[name].role.name if name in declared else "") for name in names]


def _under(name: str, values: Values) -> Values:
    return {name + below: value for below, value in values.items()}


def _parents(path: str) -> Iterator[str]:
    """Yield the enclosing paths: `shapes[3].fov` gives `shapes` and `shapes[3]`."""
    whole = path.removesuffix(".type").removesuffix(".count")
    for i, letter in enumerate(path):
        if letter in ".[" and i < len(whole):
            yield path[:i]


def _explained_by(differing: Mapping[str, Any], parent: str, missing: bool) -> bool:
    """Return whether the parent's type or length already differs."""
    return f"{parent}.type" in differing or (missing and f"{parent}.count" in differing)


def _plain(value: Any) -> Plain:
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return value


def _numbers(values: Sequence[Any]) -> NDArray[Any] | None:
    """Return a list of numbers, or of such lists, as an array; None for another list."""
    if not values or not all(isinstance(t, (int, float, np.generic, Sequence)) for t in values):
        return None
    try:
        array = np.asarray(values)
    except ValueError:  # of rows that differ in length
        return None
    return array if array.dtype.kind in "biuf" else None


def _array(array: NDArray[Any], form: str) -> str:
    """Return a few numbers as text; the digest of type, shape and bytes for more."""
    if array.size <= 16 and array.dtype.kind in "iuf":
        array = array.astype(np.float64)  # lists and other types of numbers give equal digests
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
    """Return the digest of a file's bytes. Raises SceneError for an unreadable file."""
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


def _change(before: Plain, after: Plain) -> str:
    """Describe the change of a value for people."""
    shown = [_shown(value) for value in (before, after)]
    return "its content differs" if shown == ["..", ".."] else " -> ".join(shown)


def _shown(value: Plain) -> str:
    if value == ABSENT:
        return "absent"
    return ".." if isinstance(value, str) and value.startswith(DIGEST) else str(value)
