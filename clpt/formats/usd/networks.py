"""Networks of MaterialX on a stage: nodes and images, as `clpt.formats.materialx` asks them."""

from __future__ import annotations

from dataclasses import dataclass

from pxr import UsdShade

from clpt import images
from clpt.formats import materialx
from clpt.formats.usd import textures
from clpt.formats.usd.document import Document
from clpt.formats.usd.nodes import Node
from clpt.formats.usd.textures import Uses
from clpt.scene.textures import MeshAttribute

CONTEXT = "mtlx"  # of renderers that read MaterialX


@dataclass(frozen=True)
class Network:
    """A stage as the host of a material's network."""

    document: Document
    uses: Uses

    def warn(self, message: str, path: str) -> None:
        self.document.warn(message, path)

    def image(self, asset: object, path: str) -> images.Stored | None:
        return textures.read(self.document, asset, path)

    def uv_mapping(self, name: str) -> str:
        return self.uses.uv_mapping(name or "st")

    def attribute(self, name: str, count: int) -> MeshAttribute:
        self.uses.fallbacks.setdefault(name, (0.0,) * count)
        return MeshAttribute(name=f"vertex_{name}")


def shader(document: Document, material: UsdShade.Material) -> Node | None:
    """Return the surface shader of MaterialX that a material has; None without one."""
    for context in (CONTEXT, ""):
        found = material.ComputeSurfaceSource(context)[0]
        node = Node(document, found) if found else None
        if node is not None and node.kind.startswith("ND_") and "UsdPreview" not in node.kind:
            return node
    return None


def surface(document: Document, node: Node, uses: Uses, name: str) -> materialx.Surface:
    """Return a shader of MaterialX as a material, its light, and the inside of its shapes."""
    return materialx.surface(node, Network(document, uses), name)
