"""Mitsuba's XML as a tree of elements that know their file and line.

`default`, `$name`, `include` and `path` are resolved here, in document order, so that the rest of
the loader sees objects and values only. Document types are refused, and with them entity bombs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from numpy.typing import NDArray

from clpt.errors import SceneError, nearest
from clpt.files import budget, input_files
from clpt.files.disk_cache import OfFiles
from clpt.formats.reading import Located

MAX_NESTING = 64
MAX_INCLUDES = 16  # of files inside each other
BYTES = 1024  # of an element in memory, about
CAMERA = "camera"
VARIABLE = re.compile(r"\\\$|\$(?:\{(\w+)\}|(\w*))")
# Before Mitsuba 2, names were written in camel case.
HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
RENAMED = {"lookAt": "lookat"}
OLD_VERSION = re.compile(r"\s*[01]\.\d")


@dataclass(eq=False)
class Element(Located):
    """An XML element: tag, attributes, children, and its location; of a dictionary an array."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    children: list[Element] = field(default_factory=list)
    array: NDArray[Any] | None = None

    @property
    def type(self) -> str:
        """The plugin's name in lower case, or ""; some files write it with a capital."""
        return self.attributes.get("type", "").lower()

    @property
    def name(self) -> str:
        """The parameter's name in snake case, or ""."""
        return HUMP.sub("_", self.attributes.get("name", "")).lower()

    def label(self) -> str:
        """Return its name in messages: <bsdf type="diffuse">."""
        shown = next((k for k in ("type", "name", "id") if k in self.attributes), None)
        return f'<{self.tag} {shown}="{self.attributes[shown]}">' if shown else f"<{self.tag}>"

    def location(self) -> dict[str, Any]:
        return {"file": self.file, "line": self.line, "where": self.label()}

    def attribute(self, name: str) -> str:
        """Return an attribute that must be there."""
        if name not in self.attributes:
            raise self.error(f"needs the attribute {name!r}")
        return self.attributes[name]

    def walk(self) -> Iterator[Element]:
        """Yield this element and all below it."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass
class Document:
    """An expanded scene file: its root, and the folders of file names: the scene's, its <path>s.

    camera: number or id of the chosen sensor; variables: values by name;
    renamed: plugins of old files, each with its old and its new name;
    makes_normals: whether a mesh without normals gets smooth ones, as in Mitsuba;
    meshes: that an earlier process has read.
    """

    root: Element
    folders: list[Path]
    camera: str | None = None
    variables: Mapping[str, str] = field(default_factory=dict)
    renamed: list[tuple[Element, str, str]] = field(default_factory=list)
    makes_normals: bool = True
    meshes: OfFiles = field(default_factory=OfFiles)

    @property
    def is_old(self) -> bool:
        """Whether the file is written for Mitsuba 0.x, whose defaults are others."""
        return OLD_VERSION.match(self.root.attributes.get("version", "")) is not None

    def find_file(self, element: Element, name: str) -> Path:
        """Resolve a file name that `element` gives: <path>s come first, the last <path> before all.

        Raises SceneError if there is no such file.
        """
        return _find(element, name, self.folders)


def parse(path: Path, variables: Mapping[str, object]) -> Document:
    """Read a scene file and all that it includes; `variables` stand for its `$names`.

    `camera` chooses a sensor in a file that has no variable of this name. Raises SceneError for
    broken XML, undefined or unused variables and missing includes.
    """
    expander = _Expander(path, variables)
    root = _read(path)
    if root.tag != "scene":
        raise root.error("the outermost element must be <scene>")
    expander.expand(root, 0)
    unused = sorted(set(variables) - expander.used - {CAMERA})
    if unused:
        known = expander.used | expander.values.keys() - variables.keys()
        advice = nearest(unused[0], known) if known else "; it has none"
        raise SceneError(f"has no variable {unused[0]!r}{advice}", file=path)
    chosen = expander.values[CAMERA] if CAMERA in set(variables) - expander.used else None
    inner = {name: value for name, value in expander.values.items() if name in expander.used}
    return Document(root, expander.folders, chosen, inner)


def _find(element: Element, name: str, folders: list[Path]) -> Path:
    places = [*folders[:0:-1], element.file.parent, folders[0]]
    return _first(element, name, places, "file")


def _first(element: Element, name: str, places: list[Path], label: str) -> Path:
    """Return the first of the places joined with a name that is a file, or a folder."""
    for place in places:
        candidate = place / name
        try:
            matches = candidate.is_file() if label == "file" else candidate.is_dir()
        except (OSError, ValueError):
            break
        if matches and label == "file":
            with element.locating():
                return input_files.named("mitsuba", element.file.parent, candidate)
        if matches:
            return candidate
    raise element.error(f"there is no {label} {name!r}")


def _read(path: Path) -> Element:
    """Parse a file into raw elements."""
    top = Element("", {}, path, 0)
    stack = [top]
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(RENAMED.get(tag, tag), attributes, path, parser.CurrentLineNumber)
        if len(stack) > MAX_NESTING:
            raise element.error(f"nested deeper than {MAX_NESTING} elements")
        budget.take(BYTES + 4 * sum(map(len, attributes.values())), "its elements", path)
        budget.take_parts(1, "its elements", path)
        stack[-1].children.append(element)
        stack.append(element)

    def doctype(*_: object) -> None:
        line = parser.CurrentLineNumber
        raise SceneError("a document type is not allowed in a scene", file=path, line=line)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(input_files.read_bytes(path), True)
    except expat.ExpatError as error:
        reason = expat.errors.messages.get(error.code, "not XML")
        raise SceneError(f"broken XML: {reason}", file=path, line=error.lineno) from None
    except SceneError:
        raise
    except (LookupError, ValueError) as error:
        raise SceneError(f"broken XML: {error}", file=path, line=1) from None
    return top.children[0]


class _Expander:
    """Walks a document in its order and resolves default, $name, include and path."""

    def __init__(self, path: Path, variables: Mapping[str, object]):
        self.values = {name: _as_text(value) for name, value in variables.items()}
        self.used: set[str] = set()
        self.folders = [path.parent]
        self.longest = max(map(len, self.values), default=0)

    def expand(self, element: Element, includes: int) -> None:
        kept: list[Element] = []
        for child in element.children:
            child.attributes = {k: self.substitute(child, v) for k, v in child.attributes.items()}
            if child.tag == "default":
                self.define(child)
            elif child.tag == "path":
                self.add_folder(child)
            elif child.tag == "include":
                kept += self.include(child, includes + 1)
            else:
                self.expand(child, includes)
                kept.append(child)
        element.children = kept

    def substitute(self, element: Element, text: str) -> str:
        def value(match: re.Match) -> str:
            if match[0] == "\\$":
                return "$"
            name = match[1] or self.prefix(match[2])
            if name not in self.values:
                name = match[1] or match[2]
                hint = f"give it by -D {name}=VALUE"
                raise element.error(f"the variable ${name} is not defined; {hint}")
            self.used.add(name)
            return self.values[name] + ("" if match[1] else match[2][len(name) :])

        if "$" not in text:
            return text
        size = len(text) + sum(len(value(match)) for match in VARIABLE.finditer(text))
        budget.take(4 * size, f"{element.label()} with its variables", element.file)
        return VARIABLE.sub(value, text)

    def prefix(self, word: str) -> str:
        """Return the longest variable that a word begins with, as Mitsuba does; or ""."""
        ends = range(min(len(word), self.longest), 0, -1)
        return next((word[:end] for end in ends if word[:end] in self.values), "")

    def define(self, element: Element) -> None:
        name = element.attribute("name")
        self.values.setdefault(name, element.attribute("value"))
        self.longest = max(self.longest, len(name))

    def add_folder(self, element: Element) -> None:
        """Add a folder that lies beside the file, or else in an earlier folder."""
        places = [element.file.parent, *self.folders[::-1]]
        name = element.attribute("value")
        self.folders.append(_first(element, name, places, "folder"))

    def include(self, element: Element, depth: int) -> list[Element]:
        if depth > MAX_INCLUDES:
            raise element.error(f"more than {MAX_INCLUDES} files include each other")
        path = _find(element, element.attribute("filename"), self.folders)
        root = _read(path)
        holder = root if root.tag == "scene" else Element("", {}, path, 0, [root])
        if holder is not root and "name" in element.attributes:
            root.attributes["name"] = element.attributes["name"]
        self.expand(holder, depth)
        return holder.children


def _as_text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
