"""A document as a whole, before anything is made of it: references, ranges and extents.

What no scene shows is checked too, so that a broken file is refused whatever of it is used. What
the specification asks for and no picture depends on (alignment, bounds of accessors, lists that
are not empty) is not.
"""

from __future__ import annotations

import numpy as np

from clpt.formats.gltf import accessors, cameras_lights
from clpt.formats.gltf.document import Document, Element
from clpt.formats.gltf.geometry import target_types, types

DEEPEST = 32  # of textures within a material
FLOAT = 5126


def check(document: Document) -> None:
    """Raise SceneError for references and values that contradict each other."""
    for table, function in TABLES.items():
        for element in document.root.children(table):
            function(element)
    document.root.index("scene", "scenes", None)
    extension = document.root.extension(cameras_lights.LIGHTS)
    for light in [] if extension is None else extension.children("lights"):
        cameras_lights.light(light, np.eye(4))


def _view(view: Element) -> None:
    buffer = view.entry("buffer", "buffers")
    if buffer is None:
        raise view.error("'buffer' is missing")
    end = view.integer("byteOffset", 0) + view.integer("byteLength", low=1)
    if end > buffer.integer("byteLength", low=1):
        raise view.error(f"ends at byte {end}, its buffer has {buffer.integer('byteLength')}")
    if view.value.get("byteStride") == 0:
        view.warn("byteStride of 0 is read as none")
        del view.value["byteStride"]
    view.integer("byteStride", 4, low=4, high=252)


def _image(image: Element) -> None:
    if ("uri" in image) == ("bufferView" in image):
        raise image.error("needs either a uri or a bufferView")
    image.text("uri", "")
    image.index("bufferView", "bufferViews", None)


def _texture(texture: Element) -> None:
    texture.index("source", "images", None)
    texture.index("sampler", "samplers", None)


def _material(material: Element) -> None:
    """References to textures: those of extensions follow the same pattern."""
    open_ = [(material, 0)]
    while open_:
        element, depth = open_.pop()
        for key, value in element.value.items():
            if not isinstance(value, dict) or key == "extras" or depth == DEEPEST:
                continue
            child = element.needed(key)
            if key.endswith("Texture"):
                child.index("index", "textures")
                child.integer("texCoord", 0)
            open_.append((child, depth + 1))


def _mesh(mesh: Element) -> None:
    mesh.numbers("weights", None, ())
    for primitive in mesh.children("primitives"):
        primitive.index("indices", "accessors", None)
        primitive.index("material", "materials", None)
        base = primitive.needed("attributes")
        counts = set()
        for attributes in [base, *primitive.children("targets")]:
            for name in attributes.value:
                number = attributes.index(name, "accessors")
                accessor = attributes.document.entry("accessors", number)
                counts.add(accessor.integer("count"))
                known = (types if attributes is base else target_types)(name)
                if known:
                    accessor.text("type", choices=known)
                if name not in base:
                    raise attributes.error("moves an attribute that the primitive has not", name)
        if len(counts) > 1:
            raise base.error(f"accessors have different counts: {sorted(counts)}")


def _node(node: Element) -> None:
    for key, table in {"mesh": "meshes", "camera": "cameras", "skin": "skins"}.items():
        node.index(key, table, None)
    if "skin" in node and "mesh" not in node:
        raise node.error("has a skin and no mesh", "skin")


def _skin(skin: Element) -> None:
    joints = skin.indices("joints", "nodes")
    skin.index("skeleton", "nodes", None)
    matrices = skin.entry("inverseBindMatrices", "accessors")
    if not joints:
        raise skin.error("has no joints")
    if matrices is None:
        return
    _form(matrices, "MAT4")
    if matrices.integer("count") < len(joints):
        raise skin.error(f"has fewer matrices than its {len(joints)} joints", "inverseBindMatrices")


def _animation(animation: Element) -> None:
    for sampler in animation.children("samplers"):
        times = sampler.entry("input", "accessors")
        if times is None or sampler.entry("output", "accessors") is None:
            raise sampler.error("needs an input and an output")
        _form(times, "SCALAR")
    for channel in animation.children("channels"):
        channel.integer("sampler", high=max(animation.count("samplers") - 1, 0))
        target = channel.needed("target")
        target.index("node", "nodes", None)
        target.text("path")


def _form(accessor: Element, type_: str) -> None:
    accessor.text("type", choices=(type_,))
    if accessor.integer("componentType") != FLOAT:
        raise accessor.error("must be of floats", "componentType")


TABLES = {
    "buffers": lambda buffer: buffer.integer("byteLength", low=1),
    "bufferViews": _view,
    "accessors": accessors.check,
    "images": _image,
    "samplers": lambda sampler: sampler.integer("magFilter", 9729),
    "textures": _texture,
    "materials": _material,
    "meshes": _mesh,
    "cameras": lambda camera: cameras_lights.camera(camera, np.eye(4)),
    "skins": _skin,
    "nodes": _node,
    "scenes": lambda scene: scene.indices("nodes", "nodes"),
    "animations": _animation,
}
