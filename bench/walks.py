"""A value's ways through the package: the functions that see it, in order.

A stay is a function with a scene as a parameter, or that reads `index.scene`; a room is a file. A
way leads from a function to functions that it names, and to methods of its class; methods of other
objects are not followed.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path

from bench.imports import modules

START = "clpt.render.one_call.render"
SCENE = re.compile(r"\bScene\b")
FOUND = "index"  # the name of a scene's index


@dataclass(frozen=True)
class _Function:
    """A function: its module, its class ("" for none), what its names are, and its code."""

    module: str
    owner: str
    names: dict[str, str]
    code: ast.FunctionDef

    @property
    def stays(self) -> bool:
        """Whether it sees the scene."""
        signature = self.code.args
        types = [
            argument.annotation
            for argument in (*signature.posonlyargs, *signature.args, *signature.kwonlyargs)
        ]
        if any(kind is not None and SCENE.search(ast.unparse(kind)) for kind in types):
            return True
        return any(
            isinstance(node, ast.Attribute)
            and node.attr == "scene"
            and ast.unparse(node.value).split(".")[-1] == FOUND
            for node in ast.walk(self.code)
        )


def stays(root: Path, start: str = START) -> list[str]:
    """Return the stays of a scene, each as "file name"."""
    known = modules(root)
    functions, names = _functions(known)
    seen: set[str] = set()
    open_ = [start]
    while open_:
        name = open_.pop()
        room, _, last = name.rpartition(".")
        if last in names.get(room, {}) and names[room][last] != name:  # which another room hands on
            open_.append(names[room][last])
        name = name if name in functions else f"{name}.__init__"
        if name in functions and name not in seen:
            seen.add(name)
            open_ += _called(functions[name])
    staying = [functions[name] for name in sorted(seen) if functions[name].stays]
    return [
        f"{known[function.module].relative_to(root).as_posix()} {function.code.name}"
        for function in staying
    ]


def _functions(known: dict[str, Path]) -> tuple[dict[str, _Function], dict[str, dict[str, str]]]:
    """The functions of all modules by their full names, and what names mean in each module."""
    functions: dict[str, _Function] = {}
    everywhere = {}
    for module, path in known.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        everywhere[module] = names = dict[str, str]()
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                inside = module.split(".") + ["__init__"] * (path.name == "__init__.py")
                package = ".".join(inside[: len(inside) - node.level]) if node.level else ""
                source = ".".join(part for part in (package, node.module or "") if part)
                names |= {
                    alias.asname or alias.name: f"{source}.{alias.name}" for alias in node.names
                }
        names |= {
            node.name: f"{module}.{node.name}"
            for node in tree.body
            if isinstance(node, (ast.FunctionDef, ast.ClassDef))
        }
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                functions[f"{module}.{node.name}"] = _Function(module, "", names, node)
            for part in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(part, ast.FunctionDef):
                    full_name = f"{module}.{node.name}"
                    functions[f"{full_name}.{part.name}"] = _Function(
                        module, full_name, names, part
                    )
    return functions, everywhere


def _called(function: _Function) -> list[str]:
    """Return the full names of functions that a function names."""
    types = {
        id(part)
        for node in ast.walk(function.code)
        if isinstance(node, (ast.AnnAssign, ast.arg)) and node.annotation is not None
        for part in ast.walk(node.annotation)
    }
    names = []
    for node in ast.walk(function.code):
        if isinstance(node, (ast.Name, ast.Attribute)) and id(node) not in types:
            first, *attributes = ast.unparse(node).split(".")
            name = ".".join([function.names.get(first, first), *attributes])
            names += [name, f"{function.owner}.{'.'.join(attributes)}"]
    return names
