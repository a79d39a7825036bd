"""State while a PBRT file is read: the graphics state, and what all parts of the file share."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from clpt import transforms
from clpt.choices import Missing
from clpt.errors import SceneError, did_you_mean
from clpt.files import input_files
from clpt.formats.missing import grey_for
from clpt.formats.pbrt.params import Parameter, Parameters
from clpt.scene.materials import Material
from clpt.scene.motion import Keys

TARGETS = ("shape", "light", "material", "medium", "texture")


@dataclass(eq=False)
class Definition:
    """A definition of the file: its type, its parameters and its graphics state.

    Textures stay definitions, since what a texture is made into depends on the parameter it serves.
    """

    kind: str
    params: Parameters
    state: State


@dataclass(eq=False)
class Shared:
    """Data that all graphics states of a file share, and those of the files that it includes."""

    folder: Path
    warnings: list[str] = field(default_factory=list)
    textures: dict[tuple[str, str], list[Definition]] = field(default_factory=dict)
    materials: dict[str, list[Definition]] = field(default_factory=dict)
    media: dict[str, Definition] = field(default_factory=dict)
    systems: dict[str, tuple[transforms.Matrix, transforms.Matrix | None]] = field(
        default_factory=dict
    )
    times: tuple[float, float] = (0.0, 1.0)  # of both transforms [s]
    files: dict[str, State] = field(default_factory=dict)  # the names, and where each stands
    made: dict[Any, Any] = field(default_factory=dict)
    make_material: Callable[..., Material] | None = None
    missing: Missing = "error"
    walks: bool = False  # light walks at random in bodies: no light is too small to be met
    old: bool = False  # the files are of version 2 or 3
    count: int = 0  # definitions so far
    mirrors: bool = False  # an old file has smooth metal or glass

    def once(self, key: object, source: Parameters | Parameter, make: Callable[[], Any]) -> Any:
        """Return make(), called once for each key. Raises SceneError where it needs itself."""
        if key not in self.made:
            self.made[key] = None
            self.made[key] = make()
        if self.made[key] is None:
            raise source.error("refers to itself")
        return self.made[key]


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

    def latest(self, versions: list[Definition] | None) -> Definition | None:
        """Return the last definition of a name before this state, else its first, else None."""
        if not versions:
            return None
        at = bisect_left(versions, self.number, key=lambda item: item.state.number)
        return versions[max(at - 1, 0)]

    def motion(self) -> Keys | None:
        """Return the keys of what the transforms move, None: it is still. Raises SceneError."""
        if self.end is None or np.array_equal(self.end, self.ctm):
            return None
        return Keys(self.shared.times, np.stack([self.ctm, self.end]))

    def copy(self) -> State:
        """Return a state of its own, which shares the definitions."""
        return copy(self)

    def warn(self, source: Parameters | Parameter, text: str) -> None:
        """Warn of what the picture will lack, with the file and line."""
        where = source.location()["where"]
        self.shared.warnings.append(f"{source.file.name}:{source.line}: {where}: {text}")

    def stand_in(self, error: SceneError, params: Parameters) -> None:
        """Warn of an unknown kind that is left out, or grey; raise where that is not allowed."""
        if self.shared.missing == "error":
            raise error
        self.warn(params, f"{error.message}; grey stands for it, or it is left out")

    def tell(self, text: str) -> None:
        """Warn of what a file beside the scene has that is left out, once."""
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
