"""Scenes as Mitsuba 3's Python dictionaries, with its transforms, as a tree of elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt import transforms
from clpt.errors import UnknownKindError
from clpt.formats.mitsuba import bsdfs, emitters, media, sensors, shapes, spectra
from clpt.formats.mitsuba.xml import MAX_NESTING, Element


class _Step:
    """A method that appends a step, of a transform or, as in older scripts, of the class."""

    def __init__(self, function: Callable[..., Any]):
        self.function = function

    def __get__(self, start: ScalarTransform4f | None, owner: type[ScalarTransform4f]) -> Any:
        before = np.eye(4) if start is None else start.matrix
        return lambda *values, **named: owner(before @ self.function(*values, **named))


class ScalarTransform4f:
    """A transform (4, 4) float64; its steps act from right to left, as matrices do.

    `look_at(origin, target, up)`, `translate(v)`, `scale(v)` and `rotate(axis, angle)` [degrees]
    return the transform with another step. `@` joins two. matrix: (4, 4), by default the identity.
    """

    look_at = _Step(lambda origin, target, up: transforms.look_at(origin, target, up))
    translate = _Step(lambda v: transforms.translate(v))
    scale = _Step(lambda v: transforms.scale(v))
    rotate = _Step(lambda axis, angle: transforms.rotate(axis, angle))

    def __init__(self, matrix: ArrayLike | None = None):
        self.matrix = np.eye(4) if matrix is None else np.array(matrix, np.float64).reshape(4, 4)

    def __matmul__(self, other: ScalarTransform4f) -> ScalarTransform4f:
        return ScalarTransform4f(self.matrix @ other.matrix)

    def inverse(self) -> ScalarTransform4f:
        """Return the transform back. Raises SceneError where there is none."""
        return ScalarTransform4f(transforms.inverse(self.matrix))


VERSION = "3.0.0"
COLOURS = ("rgb", "srgb", "spectrum")
# the tag of a plugin, by its name
TAGS: dict[str, str] = {
    **dict.fromkeys(spectra.PLUGINS, "spectrum"),
    **dict.fromkeys((*spectra.TEXTURES, "volume"), "texture"),
    **dict.fromkeys(bsdfs.PLUGINS, "bsdf"),
    **dict.fromkeys((*media.MEDIA,), "medium"),
    **dict.fromkeys((*media.PHASES,), "phase"),
    **dict.fromkeys((*emitters.PLUGINS, *emitters.ON_SHAPES), "emitter"),
    **dict.fromkeys((*shapes.PLUGINS, "shapegroup", "instance", "merge"), "shape"),
    **dict.fromkeys((*sensors.CAMERAS, "batch"), "sensor"),
    **dict.fromkeys(sensors.FILMS, "film"),
    **dict.fromkeys(sensors.SAMPLERS, "sampler"),
    **dict.fromkeys(sensors.FILTERS, "rfilter"),
    **dict.fromkeys(sensors.INTEGRATORS, "integrator"),
    **dict.fromkeys(spectra.VOLUMES, "volume"),
    **dict.fromkeys(COLOURS, "colour"),
    "ref": "ref",
    "scene": "scene",
}


def tree(scene: Mapping[str, Any], folder: Path) -> Element:
    """Return the tree of a dictionary; `folder` is that of its file names. Raises SceneError."""
    return _object("scene", scene, folder / "dict", 0)


def _object(name: str, values: Mapping[str, Any], file: Path, depth: int) -> Element:
    kind = values.get("type")
    element = Element(str(kind), {"name": name}, file, 0)
    if depth > MAX_NESTING:
        raise element.error(f"nested deeper than {MAX_NESTING} dictionaries")
    if not isinstance(kind, str):
        raise element.error("needs a 'type', the name of a plugin")
    if kind not in TAGS:
        raise UnknownKindError("plugin", kind, TAGS, **element.location())
    if TAGS[kind] == "colour":
        return _colour(element, kind, values)
    element = Element(TAGS[kind], {"type": kind, "name": name}, file, 0)
    if kind == "ref":
        return Element("ref", {"name": name, "id": str(values.get("id"))}, file, 0)
    if element.tag == "scene":
        element.attributes["version"] = VERSION
    elif "id" in values or depth == 1:  # a <ref> may name what stands in the scene itself
        element.attributes["id"] = str(values.get("id", name))
    for key, value in values.items():
        if key not in ("type", "id"):
            element.children.append(_child(str(key), value, file, depth + 1))
    return element


def _colour(element: Element, kind: str, values: Mapping[str, Any]) -> Element:
    """Return an <rgb> or a <spectrum>: numbers, pairs of wavelengths and values, or a file."""
    attributes = {"name": element.attributes["name"]}
    if "filename" in values:
        attributes["filename"] = str(values["filename"])
    elif "value" in values:
        numbers = np.asarray(values["value"], np.float64)
        if numbers.ndim == 2 and numbers.shape[1] == 2:
            attributes["value"] = ", ".join(f"{a!r}:{b!r}" for a, b in numbers.tolist())
        else:
            attributes["value"] = " ".join(map(repr, numbers.reshape(-1).tolist()))
    else:
        raise element.error("needs a 'value'")
    return Element(kind, attributes, element.file, 0)


def _child(name: str, value: object, file: Path, depth: int) -> Element:
    """Return the element of an object, a parameter, a transform or an array."""
    if isinstance(value, Mapping):
        return _object(name, value, file, depth)

    def parameter(tag: str, text: object) -> Element:
        return Element(tag, {"name": name, "value": str(text)}, file, 0)

    if isinstance(value, (bool, np.bool_)):
        return parameter("boolean", str(bool(value)).lower())
    if isinstance(value, (int, np.integer)):
        return parameter("integer", int(value))
    if isinstance(value, (float, np.floating)):
        return parameter("float", repr(float(value)))
    if isinstance(value, (str, Path)):
        return parameter("string", value)
    if hasattr(value, "matrix"):
        return _transform(name, value.matrix, file)
    return _array(name, value, file)


def _transform(name: str, matrix: ArrayLike, file: Path) -> Element:
    element = Element("transform", {"name": name}, file, 0)
    numbers = np.asarray(matrix, np.float64)
    if numbers.shape[:2] not in ((4, 4), (3, 3)) or numbers.size not in (16, 9):
        raise element.error(f"a transform is a matrix of 4 x 4 numbers, not {numbers.shape}")
    text = " ".join(map(repr, numbers.reshape(-1).tolist()))
    element.children.append(Element("matrix", {"value": text}, file, 0))
    return element


def _array(name: str, value: object, file: Path) -> Element:
    """Return three numbers as a <vector>; a larger array, such as an image, as it is."""
    element = Element("vector", {"name": name}, file, 0)
    try:
        numbers = np.asarray(value)
        numbers = numbers if numbers.dtype == np.uint8 else numbers.astype(np.float32)
    except (TypeError, ValueError):
        message = f"cannot be a {type(value).__name__}: give an object of Mitsuba as its dictionary"
        raise element.error(message) from None
    if numbers.ndim == 1 and numbers.size == 3:
        element.attributes["value"] = " ".join(map(repr, np.asarray(value, np.float64).tolist()))
        return element
    element.tag, element.array = "array", numbers
    return element
