"""The public names: the page lists all of them; each is typed, and says what its arguments are."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import clpt
from clpt import scene

PAGE = Path(__file__).resolve().parents[1] / "docs" / "stability.md"
# What a renderer has beside its methods and properties.
ATTRIBUTES = {"Renderer": {"scene", "device", "warnings"}, "MultiRenderer": set[str]()}


def listed(heading: str) -> set[str]:
    """The names in code under a heading of the page."""
    text = PAGE.read_text(encoding="utf-8")
    section = text.split(f"\n### {heading}\n", 1)[1]
    section = re.split(r"\n##", section, maxsplit=1)[0]
    return set(re.findall(r"^- `(\w+)", section, re.MULTILINE))


def members(cls: type) -> set[str]:
    """The public names of a class, with the fields of a dataclass."""
    fields = {f.name for f in dataclasses.fields(cls)} if dataclasses.is_dataclass(cls) else set()
    names = {name for name in dir(cls) if not name.startswith("_")} | fields
    return names | ATTRIBUTES.get(cls.__name__, set())


@pytest.mark.parametrize(
    ("heading", "names"),
    [
        ("clpt", set(clpt.__all__)),
        ("clpt.scene", set(scene.__all__)),
        ("clpt.Scene", members(clpt.Scene)),
        ("clpt.Renderer", members(clpt.Renderer)),
        ("clpt.MultiRenderer", members(clpt.MultiRenderer) - members(clpt.Renderer)),
    ],
)
def test_the_page_lists_what_is_public(heading: str, names: set[str]) -> None:
    assert listed(heading) == names


def public() -> list[tuple[str, Callable[..., Any]]]:
    """The public functions, constructors and methods, by their full names."""
    found = [(f"clpt.{name}", getattr(clpt, name)) for name in clpt.__all__]
    found = [(name, one) for name, one in found if callable(one)]
    for cls in (clpt.Scene, clpt.Renderer, clpt.MultiRenderer):
        for name in sorted(members(cls)):
            one = inspect.getattr_static(cls, name, None)
            one = one.fget if isinstance(one, property) else getattr(one, "__func__", one)
            if inspect.isfunction(one):
                found.append((f"clpt.{cls.__name__}.{name}", one))
    return found


def arguments(one: Callable[..., Any]) -> list[inspect.Parameter]:
    """The parameters of a function or a class, without self and what is passed on."""
    target = inspect.unwrap(one)
    own = list(inspect.signature(target).parameters.values())
    passed = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return [p for p in own if p.name not in ("self", "cls") and p.kind not in passed]


NAMES = public()


@pytest.mark.parametrize("full", [name for name, _ in NAMES])
def test_each_is_documented(full: str) -> None:
    """A summary that ends with a point, and each argument by its name."""
    one = dict(NAMES)[full]
    text = inspect.getdoc(one) or ""
    summary = text.split("\n\n")[0].replace("\n", " ")
    assert re.search(r"[.:]$|\. |: ", summary), f"{full} has no summary"
    plain = isinstance(one, type) and issubclass(one, (Exception, dict))
    if plain or "see `Renderer" in text:
        return
    given = text + (inspect.getdoc(one.__init__) or "") if isinstance(one, type) else text
    missing = [p.name for p in arguments(one) if not re.search(rf"\b{p.name}\b", given)]
    assert not missing, f"{full} does not say what these are: {missing}"


@pytest.mark.parametrize("full", [name for name, one in NAMES if not isinstance(one, type)])
def test_each_is_typed(full: str) -> None:
    one = inspect.unwrap(dict(NAMES)[full])
    bare = [p.name for p in arguments(one) if p.annotation is inspect.Parameter.empty]
    assert not bare, f"{full}: no types of {bare}"
    assert inspect.signature(one).return_annotation is not inspect.Signature.empty, full


@pytest.mark.parametrize("module", [scene, *(getattr(scene, name) for name in scene.__all__)])
def test_modules_of_scenes_show_what_is_theirs(module: Any) -> None:
    """TAB after `clpt.scene.` and `clpt.scene.materials.` shows no imports."""
    if inspect.ismodule(module):
        strangers = {"annotations", "dataclass", "field", "math", "numbers", "Any", "np"}
        assert not strangers & set(dir(module))
