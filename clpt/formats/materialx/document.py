"""Documents of MaterialX, `.mtlx`, by the library `materialx`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from clpt.errors import SceneError
from clpt.formats.materialx.graph import LeftOut, Node

MISSING = "MaterialX is read with `materialx`: pip install 'clpt[materialx]'"
TRANSLATED = {"standard_surface": "standard_surface_to_open_pbr_surface"}


def library() -> Any:
    """Return the modules of `materialx`. Raises SceneError where it is not installed."""
    try:
        import MaterialX
    except ImportError:
        raise SceneError(MISSING) from None
    return MaterialX


@cache
def standard() -> Any:
    """Return the document of the standard libraries. Raises SceneError, see `library`."""
    mx = library()
    document = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
    return document


def read(path: Path) -> Any:
    """Return a document, upgraded to the library's version. Raises SceneError for a bad one."""
    mx = library()
    document = mx.createDocument()
    try:
        mx.readFromXmlFile(document, str(path))
    except Exception as error:  # the library's own exceptions have no common base
        raise SceneError(f"no document of MaterialX: {error}", file=path) from None
    document.setDataLibrary(standard())
    return document


@dataclass(frozen=True)
class Element:
    """A node of a document, as `graph.Node`.

    outer: the node whose definition's graph it stands in, None outside of one.
    """

    node: Any
    outer: Node | None = None

    @property
    def kind(self) -> str:
        definition = self.node.getNodeDef()
        return str(definition.getName() if definition else self.node.getCategory())

    @property
    def path(self) -> str:
        name = str(self.node.getNamePath())
        return name if self.outer is None else f"{self.outer.path}/{name}"

    def source(self, name: str) -> tuple[Node, str] | None:
        found = self._input(name)
        if found is None:
            return _of_surface(self.node.getNodeDef(), name, self.path)
        inside = found.getInterfaceName()
        if inside and self.outer is not None:
            return self._outside(self.outer, inside)
        if inside:  # of a graph in the document
            found = self.node.getParent().getInput(inside) or found
        output = found.getConnectedOutput()
        if output is not None:
            node = output.getConnectedNode()
            return None if node is None else (Element(node), output.getOutputString() or "out")
        node = found.getConnectedNode()
        if node is None:
            return None
        return Element(node, self.outer), found.getOutputString() or "out"

    def _outside(self, outer: Node, inside: str) -> tuple[Node, str] | None:
        """Return the node and output outside that a graph's input gets; None for a value."""
        source = outer.source(inside)
        if source is not None or outer.value(inside) is not None:
            return source
        return _of_surface(self.node.getParent().getNodeDef(), inside, outer.path)

    def value(self, name: str, default: object = None) -> Any:
        found = self._input(name)
        if found is None:
            return default
        inside = found.getInterfaceName()
        if inside and self.outer is not None:
            value = self.outer.value(inside)
            return self._declared(inside, default) if value is None else value
        if inside:
            found = self.node.getParent().getInput(inside) or found
        if found.getType() == "filename":
            return found.getResolvedValueString() or default
        if found.getType().startswith("matrix"):
            return tuple(map(float, found.getValueString().split(","))) or default
        value = found.getValue()
        if value is None:
            return default
        return value.asTuple() if hasattr(value, "asTuple") else value

    def color_space(self, name: str) -> str:
        found = self._input(name)
        if found is None:
            return ""
        inside = found.getInterfaceName()
        if inside and self.outer is not None:
            return self.outer.color_space(inside)
        if inside:
            found = self.node.getParent().getInput(inside) or found
        colors = found.getType() in ("color3", "color4", "filename")
        return str(found.getActiveColorSpace()) if colors else ""

    def _input(self, name: str) -> Any:
        """Return an input, of the node or of its definition."""
        found = self.node.getInput(name)
        if found is not None:
            return found
        definition = self.node.getNodeDef()
        declared = definition.getActiveInput(name) if definition else None
        return None if declared is None or declared.getDefaultGeomPropString() else declared

    def _declared(self, name: str, default: object) -> Any:
        """Return the default of an input of the definition that this node's graph is of."""
        definition = self.node.getParent().getNodeDef()
        found = definition.getActiveInput(name) if definition else None
        value = None if found is None else found.getValue()
        if value is None:
            return default
        return value.asTuple() if hasattr(value, "asTuple") else value


@dataclass(frozen=True)
class Property:
    """A property of a surface that stands for an input which nothing is connected to."""

    kind: str
    path: str

    def source(self, name: str) -> tuple[Node, str] | None:
        return None

    def value(self, name: str, default: object = None) -> Any:
        return default

    def color_space(self, name: str) -> str:
        return ""


PLACE = "ND_position_vector3"  # in the world: an object's place in its own space is not known
PROPERTIES = {"UV0": "ND_texcoord_vector2", "Pobject": PLACE, "Pworld": PLACE}


def _of_surface(definition: Any, name: str, path: str) -> tuple[Node, str] | None:
    """Return the property that a definition puts in the place of an input; None without one."""
    declared = definition.getActiveInput(name) if definition else None
    stands = str(declared.getDefaultGeomPropString()) if declared else ""
    if not stands:
        return None
    return Property(PROPERTIES.get(stands, f"property {stands}"), f"{path}/{stands}"), "out"


def inner(node: Node, output: str) -> tuple[Node, str] | None:
    """Return the node and output in the graph of a node's definition; None without a graph.

    Raises LeftOut where `materialx` is not installed.
    """
    try:
        definition = standard().getNodeDef(node.kind)
    except SceneError as error:
        raise LeftOut(f"{node.kind}: {error.message}") from None
    if definition is None and isinstance(node, Element):
        definition = node.node.getNodeDef()
    graph = definition.getImplementation() if definition else None
    if graph is None or not graph.isA(library().NodeGraph):
        return None
    found = graph.getOutput(output) or next(iter(graph.getOutputs()), None)
    source = found.getConnectedNode() if found else None
    return (Element(source, node), found.getOutputString() or "out") if found and source else None


@dataclass(frozen=True)
class Translated:
    """A surface shader as OpenPBR, by the library's own graph of translation.

    Its inputs are the graph's outputs, whose interface the shader has.
    """

    shader: Node

    @property
    def kind(self) -> str:
        return "open_pbr_surface"

    @property
    def path(self) -> str:
        return self.shader.path

    def source(self, name: str) -> tuple[Node, str] | None:
        outputs = {f"{name}_out", name}
        graph = _translation(self.shader.kind)
        found = next((o for o in graph.getOutputs() if o.getName() in outputs), None)
        source = found.getConnectedNode() if found else None
        if not found or not source:
            return None
        return Element(source, self.shader), found.getOutputString() or "out"

    def value(self, name: str, default: object = None) -> Any:
        return default

    def color_space(self, name: str) -> str:
        return ""


def _translation(kind: str) -> Any:
    category = next(name for name in TRANSLATED if name in kind)
    definition = standard().getNodeDef(f"ND_{TRANSLATED[category]}")
    return definition.getImplementation()
