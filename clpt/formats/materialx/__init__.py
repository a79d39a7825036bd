"""Materials of MaterialX: documents `.mtlx`, and networks that readers of stages have.

A reader of a stage calls `surface(node, host)` with an object for the surface's shader that has the
members of `Node`: `kind` (such as ND_open_pbr_surface_surfaceshader), `path`, `source(input)`,
`value(input)` and `color_space(input)`. `Host` tells what the reader has to do: warn, read images,
and name sets of texture coordinates. The result is a material, an emission for the shape, and a
medium for the inside of a closed shape. Only standard_surface and nodes that the library defines by
graphs need `materialx` to be installed. docs/materialx.md says what is read.
"""

from clpt.formats.materialx.graph import Host, Node
from clpt.formats.materialx.materials import load, load_material, load_materials, networks
from clpt.formats.materialx.surfaces import Surface, surface

__all__ = [
    "Host", "Node", "Surface", "load", "load_material", "load_materials", "networks", "surface",
]  # fmt: skip
