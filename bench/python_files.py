"""Python files as figures and rules of the house see them: functions, imports, words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# A summary that begins so refers to its neighbour, and says nothing by itself.
DEPENDENT = re.compile(r"(What|Of|How|Those|The same)\b")
ARRAY = re.compile(r"^(\w+)(?:: TypeAlias)? = NDArray\[[\w.]+\]\s*(?:#|$)", re.MULTILINE)


@dataclass(frozen=True)
class Function:
    """A function: its lines, decorators aside, and how many parameters a caller may give."""

    name: str
    line: int
    lines: int
    parameters: int


@dataclass(frozen=True)
class Docstring:
    """The docstring of a module, a class or a function."""

    name: str
    line: int
    text: str


@dataclass(frozen=True)
class Import:
    """An import statement: a module's full name, and the names that are taken from it."""

    line: int
    module: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class PythonFile:
    """A file's properties for the rules; loaded: patterns of names for `import_module`."""

    text: str
    functions: tuple[Function, ...]
    docstrings: tuple[Docstring, ...]
    imports: tuple[Import, ...]
    loaded: tuple[str, ...]
    fields: dict[str, int]  # of each class: how many it declares
    prints: tuple[int, ...]  # lines

    def line_of(self, position: int) -> int:
        """The number of the line of a place in the text."""
        return self.text.count("\n", 0, position) + 1


@cache
def read(path: Path, root: Path) -> PythonFile:
    """Read a file of a checkout."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    name = full_name(path, root)
    functions, docstrings, imports = [], [], []
    fields: dict[str, int] = {}
    if dependent := _docstring(tree, "the module"):
        docstrings.append(dependent)
    for node in _statements(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            functions.append(_function(node))
        elif isinstance(node, ast.ClassDef):
            fields[node.name] = sum(isinstance(part, ast.AnnAssign) for part in node.body)
        elif isinstance(node, ast.Import):
            imports += [Import(node.lineno, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            inside = name.split(".")
            package = ".".join(inside[: len(inside) - node.level]) if node.level else ""
            module = ".".join(part for part in (package, node.module or "") if part)
            imports.append(Import(node.lineno, module, tuple(a.name for a in node.names)))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and (
            dependent := _docstring(node, node.name)
        ):
            docstrings.append(dependent)
    loaded, prints = [], []
    if re.search(r"\b(import_module|__import__|print)\(", text):  # else no call needs a look
        for called, call in _calls(tree):
            if called in ("import_module", "__import__") and call.args:
                loaded.append(_pattern(call.args[0], name.removesuffix(".__init__")))
            elif called == "print" and isinstance(call.func, ast.Name):
                prints.append(call.lineno)
    return PythonFile(
        text, tuple(functions), tuple(docstrings), tuple(imports), tuple(loaded), fields,
        tuple(prints),
    )  # fmt: skip


def full_name(path: Path, root: Path) -> str:
    """The full name of a file's module; "clpt.scene.__init__" of a package."""
    return ".".join(path.relative_to(root).with_suffix("").parts)


def _statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """All statements of a module, at whatever depth."""
    open_: list[ast.AST] = [tree]
    while open_:
        node = open_.pop()
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            open_ += getattr(node, part, [])
        if isinstance(node, ast.stmt):
            yield node


def _function(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Function:
    arguments = [*node.args.posonlyargs, *node.args.args]
    bound = bool(arguments) and arguments[0].arg in ("self", "cls")
    count = len(arguments) + len(node.args.kwonlyargs) - bound
    lines = (node.end_lineno or node.lineno) - node.lineno + 1
    return Function(node.name, node.lineno, lines, count)


def _docstring(
    node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef, name: str
) -> Docstring | None:
    text = ast.get_docstring(node)
    return None if text is None else Docstring(name, node.body[0].lineno, text)


def _calls(tree: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    """Yield all calls of a module, with the last part of the function's name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name):
                yield node.func.id, node
            elif isinstance(node.func, ast.Attribute):
                yield node.func.attr, node


def _pattern(name: ast.expr, package: str) -> str:
    r"""Return a pattern of names that an expression may give, with \w+ for unknown parts."""
    if isinstance(name, ast.Constant):
        return re.escape(str(name.value))
    if isinstance(name, ast.JoinedStr):
        return "".join(_pattern(part, package) for part in name.values)
    if isinstance(name, ast.FormattedValue):
        return _pattern(name.value, package)
    return re.escape(package) if isinstance(name, ast.Name) and name.id == "__name__" else r"\w+"
