"""Directives of a PBRT file without a file: what the loader's parts are called with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clpt.formats.pbrt.materials import material
from clpt.formats.pbrt.params import Parameter, Parameters
from clpt.formats.pbrt.state import Definition, Shared, State

HERE = Path("test.pbrt")


def state(folder: Path = Path()) -> State:
    """A fresh graphics state."""
    return State(shared=Shared(folder=folder, make_material=material), file_folder=folder)


def params(**given: Any) -> Parameters:
    """Parameters by name: `L=("rgb", 1, 1, 1)`; a dot in a name is written as two underscores."""
    made = [_one(name.replace("__", "."), *value) for name, value in given.items()]
    return Parameters(label="test", file=HERE, line=1, given=made)


def _one(name: str, kind: str, *values: Any) -> Parameter:
    numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    held = np.array(values, np.float64) if numbers else list(values)
    return Parameter(type=kind, name=name, values=held, file=HERE, line=1, where="test")


def define(into: State, values: str, name: str, kind: str, **given: Any) -> None:
    """A `Texture` directive."""
    into.shared.textures[values, name] = [(0, Definition(kind, params(**given), into))]
