"""Reading a PBRT file and those that it includes, within limits."""

from __future__ import annotations

from abc import abstractmethod
from bisect import bisect_left
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from clpt import transforms
from clpt.choices import Missing
from clpt.errors import SceneError, did_you_mean
from clpt.files import budget, input_files
from clpt.formats.pbrt import old_words
from clpt.formats.pbrt.params import Lexer, Parameter, Parameters
from clpt.formats.reading import Located, grey_for
from clpt.scene.materials import Material
from clpt.scene.motion import Keys

BYTES = 1024  # of a directive in memory, about
T = TypeVar("T")
DEEPEST = 32  # files that include each other


@dataclass(eq=False)
class Contents:
    """The contents of a file: definitions in their order, and groups with their uses, by name."""

    shared: Shared
    shapes: list[Definition] = field(default_factory=list)
    lights: list[Definition] = field(default_factory=list)
    objects: dict[str, list[Definition]] = field(default_factory=dict)
    uses: list[Definition] = field(default_factory=list)
    options: dict[str, Definition] = field(default_factory=dict)
    seed: int | None = None


class Files(Located):
    """Reads the files; `state` is the graphics state at the directive that is being read."""

    def __init__(self, path: Path):
        self.path = path
        self.contents = Contents(Shared(path.parent))
        self.state = State(self.contents.shared, path.parent)
        self.files: list[Path] = []
        self.warned: set[str] = set()
        self.lexer: Lexer
        self.name = ""

    @abstractmethod
    def directive(self) -> None:
        """Take the next directive and carry it out."""

    def go_through(self, path: Path, continued: Lexer | None = None) -> None:
        """Read a file, which an Include or an Import may have named.

        continued: that of the file which has the parameters after the last directive of this file.
        """
        real = path.resolve()
        if real in self.files:
            raise self.lexer.error(f"{path.name} includes itself")
        if len(self.files) >= DEEPEST:
            raise self.lexer.error(f"{path.name} is included too deep: {DEEPEST} files in others")
        outer, lexer = getattr(self, "lexer", None), Lexer(path, continued)
        shared = self.contents.shared
        if outer is None:
            shared.old = old_words.is_old(lexer.data)
        if shared.old:
            lexer.take_old()
        self.files.append(real)
        self.lexer, before = lexer, self.state.file_folder
        self.state.file_folder = path.parent
        while lexer.peek():
            budget.take(BYTES, "its directives", path)
            budget.take_parts(1, "its directives", path)
            self.directive()
        self.files.pop()
        self.state.file_folder = before
        if outer is not None:
            self.lexer = outer

    def location(self) -> dict[str, Any]:
        return {"file": self.lexer.path, "line": self.lexer.line, "where": self.name}

    def warn(self, text: str) -> None:
        """Warn of something that the picture will lack, with this location."""
        location = f"{self.lexer.path.name}:{self.lexer.line}: {self.name}"
        self.contents.shared.warnings.append(f"{location}: {text}")

    def warn_once(self, text: str) -> None:
        """Warn, but only once of the same."""
        if text not in self.warned:
            self.warned.add(text)
            self.warn(text)


TARGETS = ("shape", "light", "material", "medium", "texture")


@dataclass(eq=False)
class Definition:
    """A definition of the file: its type, its parameters and its graphics state.

    Textures stay definitions, since what a texture is made into depends on the parameter it serves.
    """

    kind: str
    params: Parameters
    state: State


# Definitions of a name in their order, each with its first number in force.
Versions = list[tuple[int, Definition]]


@dataclass(eq=False)
class Shared:
    """Data that all graphics states of a file share, and those of the files that it includes."""

    folder: Path
    warnings: list[str] = field(default_factory=list)
    textures: dict[tuple[str, str], Versions] = field(default_factory=dict)
    materials: dict[str, Versions] = field(default_factory=dict)
    media: dict[str, Definition] = field(default_factory=dict)
    systems: dict[str, tuple[transforms.Matrix, transforms.Matrix | None]] = field(
        default_factory=dict
    )
    times: tuple[float, float] = (0.0, 1.0)  # of both transforms [s]
    files: dict[str, State] = field(default_factory=dict)  # the names, and where each stands
    results: dict[Any, Any] = field(default_factory=dict)
    make_material: Callable[..., Material] | None = None
    missing: Missing = "error"
    walks: bool = False  # light walks at random in bodies: no light is too small to be met
    old: bool = False  # the files are of version 2 or 3
    count: int = 0  # definitions so far
    mirrors: bool = False  # an old file has smooth metal or glass

    def end_scope(self, start: int) -> None:
        """Put the definitions back in force that definitions after number `start` have replaced.

        In versions 2 and 3 names of materials and textures belong to the graphics state.
        """
        self.count += 1
        for versions in (*self.textures.values(), *self.materials.values()):
            outer = [definition for number, definition in versions if number <= start]
            if outer and versions[-1][0] > start:
                versions.append((self.count, outer[-1]))

    def once(self, key: object, source: Parameters | Parameter, make: Callable[[], Any]) -> Any:
        """Return make(), called once for each key. Raises SceneError where it needs itself."""
        if key not in self.results:
            self.results[key] = None
            self.results[key] = make()
        if self.results[key] is None:
            raise source.error("refers to itself")
        return self.results[key]


Maker = Callable[[Parameters, "State"], T]  # makes a part of the scene of a definition


@dataclass(eq=False)
class State:
    """The graphics state at a point of a file; AttributeBegin keeps a `copy`.

    ctm: object to world. colour_space: "srgb", "rec2020", "aces2065-1" or "dci-p3".
    material: that of shapes to come, or its name; None for pbrt's grey. number: how many
    definitions stand before this state.
    """

    shared: Shared
    file_folder: Path
    ctm: transforms.Matrix = field(default_factory=lambda: np.eye(4))
    colour_space: str = "srgb"
    material: Definition | str | None = None
    area_light: Definition | None = None
    reverse: bool = False
    end: transforms.Matrix | None = None  # object to world at the last time; None: as `ctm`
    active: tuple[bool, bool] = (True, True)  # whether transforms count for the first and last time
    inside: str = ""
    outside: str = ""
    defaults: dict[str, tuple[Parameter, ...]] = field(default_factory=dict)
    number: int = 0

    def latest(self, versions: Versions | None) -> Definition | None:
        """Return the last definition of a name before this state, else its first, else None."""
        if not versions:
            return None
        at = bisect_left(versions, self.number, key=lambda version: version[0])
        return versions[max(at - 1, 0)][1]

    def motion(self) -> Keys | None:
        """Return the keys of moving transforms, None if they are still. Raises SceneError."""
        if self.end is None or np.array_equal(self.end, self.ctm):
            return None
        return Keys(self.shared.times, np.stack([self.ctm, self.end]))

    def copy(self) -> State:
        """Return a state of its own, which shares the definitions."""
        return copy(self)

    def warn(self, source: Parameters | Parameter, text: str) -> None:
        """Warn of something that the picture will lack, with the file and line."""
        where = source.location()["where"]
        self.shared.warnings.append(f"{source.file.name}:{source.line}: {where}: {text}")

    def stand_in(self, error: SceneError, params: Parameters) -> None:
        """Warn of an unknown kind that is left out, or grey; raise where that is not allowed."""
        if self.shared.missing == "error":
            raise error
        self.warn(params, f"{error.message}; grey stands for it, or it is left out")

    def tell(self, text: str) -> None:
        """Warn once of a part of a file beside the scene that is left out."""
        if text not in self.shared.warnings:
            self.shared.warnings.append(text)

    def file(self, name: str) -> Path:
        """Return the path that a file name means: beside the scene, else beside the naming file.

        It need not exist. Raises SceneError for an invalid name.
        """
        if not name or "\0" in name or len(name) > 4096:
            raise SceneError(f"{name[:40]!r} is no name of a file")
        path = Path(name.replace("\\", "/"))
        beside, other = self.shared.folder / path, self.file_folder / path
        try:
            return other if not beside.exists() and other.exists() else beside
        except OSError as error:
            raise SceneError(f"{name[:40]!r}: {error.strerror}") from None

    def existing_file(self, name: str) -> Path:
        """Return `file(name)`. Raises SceneError if it is missing, with all others that are."""
        path = self.file(name)
        if path.is_file():
            return input_files.named("pbrt", self.shared.folder, path)
        named = self.shared.files.items()
        missing = [n for n, state in named if n != name and not state.file(n).is_file()]
        nor = f"; nor are there {', '.join(map(repr, missing))}" if missing else ""
        raise SceneError(f"there is no file {name!r}{nor}")

    def image(self, name: str) -> Path | None:
        """Return the path of an image; None where grey is to stand for it. Raises SceneError."""
        if self.shared.missing == "error" or self.file(name).is_file():
            return self.existing_file(name)
        if grey_for(name) not in self.shared.warnings:
            self.shared.warnings.append(grey_for(name))
        return None

    def texture(self, values: str, name: str, source: Parameters | Parameter) -> Definition:
        """Return the definition of a texture of "float" or "spectrum" values. Raises SceneError."""
        definition = self.latest(self.shared.textures.get((values, name)))
        if definition is None:
            names = [known for kind, known in self.shared.textures if kind == values]
            raise source.error(f"there is no {values} texture {name!r}{did_you_mean(name, names)}")
        return definition

    def named_material(self, name: str, source: Parameters | Parameter) -> Material:
        """Return the material of a name, made once. Raises SceneError."""
        definition = self.latest(self.shared.materials.get(name))
        if definition is None:
            hint = did_you_mean(name, self.shared.materials)
            raise source.error(f"there is no material {name!r}{hint}")
        return self.material_of(name, definition)

    def material_of(self, name: str, definition: Definition) -> Material:
        """Return the material of a definition, made once. Raises SceneError."""
        kind, params, state = definition.kind, definition.params, definition.state
        make = self.shared.make_material
        assert make is not None
        material: Material = self.shared.once(
            ("material", definition), params, lambda: make(kind, params, state, name)
        )
        return material


class TransformDirectives(Files):
    """The directives that change `state.ctm`."""

    def _concat(self, matrix: transforms.Matrix) -> None:
        end = None if self.state.end is None else self.state.end @ matrix
        self._set(self.state.ctm @ matrix, end)

    def _set(self, matrix: transforms.Matrix, end: transforms.Matrix | None = None) -> None:
        """Set the transforms that are active; end: at the last time, None for the same."""
        end = matrix if end is None else end
        if not (np.isfinite(matrix).all() and np.isfinite(end).all()):
            raise SceneError("the transform is not finite any more")
        state = self.state
        at_first, at_last = state.active
        former = state.ctm if state.end is None else state.end
        end = end if at_last else former
        state.ctm = matrix if at_first else state.ctm
        state.end = None if end is state.ctm else end

    def identity(self) -> None:
        self._set(np.eye(4))

    def translate(self) -> None:
        self._concat(transforms.translate(self.lexer.numbers(3, "Translate")))

    def scale(self) -> None:
        self._concat(transforms.scale(self.lexer.numbers(3, "Scale")))

    def rotate(self) -> None:
        angle, *axis = self.lexer.numbers(4, "Rotate")
        self._concat(transforms.rotate(axis, angle))

    def look_at(self) -> None:
        values = self.lexer.numbers(9, "LookAt")
        self._concat(transforms.inverse(transforms.look_at(values[:3], values[3:6], values[6:])))

    def transform(self) -> None:
        self._set(self._matrix())

    def concat_transform(self) -> None:
        self._concat(self._matrix())

    def _matrix(self) -> transforms.Matrix:
        """Take 16 numbers, column by column."""
        return self.lexer.numbers(16, self.name).reshape(4, 4).T.copy()

    def coordinate_system(self) -> None:
        self.contents.shared.systems[self.lexer.string("a name")] = self.state.ctm, self.state.end

    def coord_sys_transform(self) -> None:
        name = self.lexer.string("a name")
        systems = self.contents.shared.systems
        if name not in systems:
            raise SceneError(f"there is no coordinate system {name!r}{did_you_mean(name, systems)}")
        self._set(*systems[name])

    def active_transform(self) -> None:
        which = input_files.decode(self.lexer.next("All, StartTime or EndTime"))
        if which not in ("All", "StartTime", "EndTime"):
            raise SceneError(f"{which[:40]!r} is none of All, StartTime, EndTime")
        self.state.active = which != "EndTime", which != "StartTime"

    def transform_times(self) -> None:
        first, last = self.lexer.numbers(2, "TransformTimes").tolist()
        if not last > first:
            raise SceneError(f"the last time, {last:g} s, must be after the first, {first:g} s")
        self.contents.shared.times = first, last
