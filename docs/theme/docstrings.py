"""Docstrings as the site shows them: an extension of griffe, which reads the sources.

Names of parameters that begin a paragraph or follow a semicolon become code, errors become links,
and a kind gets a table of its parameters, made from their declarations.
"""

from __future__ import annotations

import dataclasses
import importlib
import math
import re
from typing import Any

import griffe
import numpy as np

from clpt import errors
from clpt.scene import roles
from clpt.scene.params import Kind, params
from clpt.scene.roles import Param

ERRORS = [
    name
    for name, value in vars(errors).items()
    if isinstance(value, type) and issubclass(value, errors.ClptError)
]
SESSION = re.compile(r"^>>> .*(?:\n.+)*", re.M)
ROLES = {
    roles.REFLECTANCE: "reflectance, spectrum in 0 to 1",
    roles.EMISSION: "emitted spectrum",
    roles.INDEX: "refractive index",
    roles.FACTOR: "spectrum",
    roles.COEFFICIENT: "spectrum",
    roles.REAL: "number",
    roles.FLAG: "`bool`",
    roles.RERADIATION: "`spectra.Reradiation`",
    roles.ORDERS_OF_LIGHT: "numbers",
    roles.LAYERS: "`Layer`s",
    roles.QUANTITY: "spectrum",
    roles.ANGULAR: "rows of numbers",
    roles.MEASUREMENT: "`measured.Measurement`",
    roles.MERL: "`measured.MerlTable`",
}


class Sentences(griffe.Extension):
    """Adds markup to docstrings while griffe reads the sources."""

    def on_module(self, *, mod: griffe.Module, **_: object) -> None:
        """Mark the docstring of a module."""
        _mark(mod, set())

    def on_function(self, *, func: griffe.Function, **_: Any) -> None:
        """Mark the names of parameters in a docstring."""
        _mark(func, {parameter.name for parameter in func.parameters})

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Mark the names of fields and constructor parameters; tabulate a kind's parameters."""
        names = {name for name, member in cls.members.items() if member.is_attribute}
        if (init := cls.members.get("__init__")) is not None and init.is_function:
            names |= {parameter.name for parameter in init.parameters}
        _mark(cls, names)
        if cls.module.path.startswith("clpt.scene."):
            kind = getattr(importlib.import_module(cls.module.path), cls.name)
            if issubclass(kind, Kind):
                _tabulate(cls, kind)


def _mark(thing: griffe.Object, names: set[str]) -> None:
    """Rewrite a docstring in place."""
    if thing.docstring is None:
        return
    text = thing.docstring.value
    if names:
        some = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
        several = rf"(?:{some})(?:(?:, | and )(?:{some}))*"
        listed = re.compile(rf"(^|\n|[;.] )({several})(?= \[[^\]]*\]:|:)")
        text = listed.sub(lambda m: m[1] + re.sub(rf"\b({some})\b", r"`\1`", m[2]), text)
    text = re.sub(r"(?<![\w`])(clpt(?:\.\w+)+)(?!\w|`)", r"`\1`", text)
    text = re.sub(rf"(?<![\w`.])({'|'.join(ERRORS)})\b", r"[`\1`][clpt.errors.\1]", text)
    text = re.sub(r"<(\w+)>", r"\\<\1>", text)
    thing.docstring.value = SESSION.sub(lambda m: f"```pycon\n{m[0]}\n```", text)


def _tabulate(cls: griffe.Class, kind: type[Kind]) -> None:
    """Add the table of parameters; the signature shows defaults in place of declarations."""
    declared = params(kind)
    rows = ["| parameter | accepts | default | meaning |", "| --- | --- | --- | --- |"]
    for field in dataclasses.fields(kind):
        if (param := declared.get(field.name)) is None:
            continue
        default = _default(field)
        unit = f" [{param.unit}]" if param.unit else ""
        rows.append(
            f"| `{field.name}` | {_accepts(param, field)} | `{default}` | {param.doc}{unit} |"
        )
        if (member := cls.members.get(field.name)) is not None and member.is_attribute:
            member.value = default
    if cls.docstring is None or len(rows) == 2:
        return
    table = "\n".join(rows)
    cls.docstring.value = f"{cls.docstring.value}\n\n{table}\n"


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        value = field.default
    if isinstance(value, np.ndarray):
        return "identity" if value.ndim == 2 and value.shape[0] == value.shape[1] else "[]"
    if isinstance(value, Kind):
        return f"{type(value).__name__}()"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


def _accepts(param: Param, field: dataclasses.Field[Any]) -> str:
    if param.role.place == "host":
        return "" if field.type == "Any" else f"`{field.type}`".replace("|", "\\|")
    if param.role is roles.CHOICE:
        return ", ".join([f"`{c!r}`" for c in param.choices] + ["`None`"] * param.optional)
    limits = ""
    if param.role is roles.REAL and math.isfinite(param.low):
        limits = f" from {param.low:g}" + (
            f" to {param.high:g}" if math.isfinite(param.high) else ""
        )
    return ROLES[param.role] + limits + (" or texture" if param.textured else "")
