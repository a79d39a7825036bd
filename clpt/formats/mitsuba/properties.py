"""The parameters of an object of a Mitsuba scene: typed, with defaults, each read once."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.choices import Missing
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats.mitsuba.xml import MAX_NESTING, Document, Element
from clpt.formats.reading import GREY, grey_for, note
from clpt.scene.motion import Keys

OLD_VALUES, OLD_OBJECTS = {"blackbody"}, {"subsurface"}  # of Mitsuba 0.x alone
VALUES = {
    "integer", "float", "string", "boolean", "vector", "point", "rgb", "srgb", "spectrum",
    "transform", "animation",
}  # fmt: skip
OBJECTS = {
    "integrator", "sensor", "sampler", "film", "rfilter", "bsdf", "texture", "emitter", "shape",
    "volume", "medium", "phase", "ref",
}  # fmt: skip
UNSUPPORTED = {
    "measured", "sdfgrid", "ellipsoids", "ellipsoidsmesh",
    "timed_sunsky", "distant", "irradiancemeter", "radiancemeter", "batch", "specfilm",
}  # fmt: skip
LEFT_OUT = VALUES | OLD_VALUES | {"texture"}  # parameters that old files may have in vain
MOST_NOTES, MOST_LINES = 16, 3  # notes of a warning, and lines of a note
FLAT_SIZE = 1e-5  # thickness over size of a shape that is flattened
SEPARATOR = re.compile(r"[\s,]+")
LARGEST_INTEGER = 2**31 - 1
T = TypeVar("T")
PluginReader = Callable[["Properties"], T]  # reads the parameters of a plugin


class Wanted(NamedTuple):
    """An element's statements on the mesh in a file.

    number: of the mesh in a .serialized file; flat: without normals; crease: largest angle between
    smooth triangles [deg], below 0 for any; smooth: whether normals are made where there are none.
    """

    suffix: str
    number: int
    flat: bool
    crease: float
    smooth: bool
    flip_v: bool


class Context:
    """State that all parts of the loader share: the document, its ids, the objects made, warnings.

    layers: of the film, which integrators ask for; rooms: the corners of the box that each endless
    medium fills, by the id of its element; endless: media whose boxes are still unknown;
    volumes: the grids that were read; archives: contents of the .serialized files, by path;
    old: whether the file is of Mitsuba 0.x.
    """

    def __init__(
        self,
        document: Document,
        missing: Missing = "error",
        rooms: Mapping[int, tuple[NDArray[Any], NDArray[Any]]] = MappingProxyType({}),
    ):
        self.document, self.missing, self.rooms = document, missing, rooms
        self.old = document.is_old
        self.left_out: dict[str, list[int]] = {}
        self.replaced: dict[str, list[int]] = {}
        for element, old, new in document.renamed:
            self.read_as(element, f"{element.tag} {old!r}", new)
        self.endless: dict[int, Any] = {}
        self.volumes: dict[tuple[str, int], Any] = {}
        self.archives: dict[Path, bytes] = {}
        self.warnings: list[str] = []
        self.layers: dict[str, None] = {}
        self.ids: dict[str, Element] = {}
        self._made: dict[int, Any] = {}
        self._open = 0  # how many objects are being made, in each other
        self._named: dict[int, Element] = {}  # the object of each <ref> of an old file
        for element in document.root.walk():
            name = element.attributes.get("as" if element.tag == "alias" else "id")
            if name is None:
                continue
            if element.tag == "ref":
                if self.old and name in self.ids:
                    self._named[id(element)] = self.ids[name]
                continue
            if name in self.ids and not self.old:
                raise element.error(f"the id {name!r} is already used in this scene")
            if name in self.ids:
                self.warn(element, f"the id {name!r} is given again: this object counts from here")
            self.ids[name] = self.resolve(element)

    def resolve(self, element: Element) -> Element:
        """Return the object that a <ref> names; any other element is returned as it is.

        An <alias> names an object too, which stands before it.
        """
        if element.tag not in ("ref", "alias"):
            return element
        name = element.attribute("id")
        if name not in self.ids:
            raise element.error(f"there is no object with the id {name!r}")
        return self._named.get(id(element), self.ids[name])

    def once(self, element: Element, make: Callable[[Element], Any]) -> Any:
        """Return make(element), the same object for every reference to the element.

        Raises SceneError where it refers to itself, or is nested too deep.
        """
        key = id(element)
        if key not in self._made:
            self._made[key] = None
            self._open += 1
            if self._open > MAX_NESTING:
                raise element.error(f"nested deeper than {MAX_NESTING} objects, by references")
            with element.locating():
                self._made[key] = make(element)
            self._open -= 1
        if self._made[key] is None:
            raise element.error("refers to itself")
        return self._made[key]

    def warn(self, element: Element, message: str) -> None:
        """Warn of something that the picture will lack."""
        self.warnings.append(f"{element.file.name}:{element.line}: {element.label()}: {message}")

    def leave_out(self, element: Element, words: str) -> None:
        """Note words of an old file that change no expected picture, for `grouped`."""
        self.left_out.setdefault(words, []).append(element.line)

    def read_as(self, element: Element, words: str, today: str) -> None:
        """Note an old file's plugin and its replacement, for `grouped`."""
        self.replaced.setdefault(f"{words} as {today}", []).append(element.line)

    def stand_in(self, error: SceneError, element: Element, grey: T) -> T:
        """Return the stand-in for an unknown plugin if missing plugins are grey; else raise."""
        if self.missing == "error":
            raise error
        self.warn(element, f"{error.message}; {'grey stands for it' if grey else 'left out'}")
        return grey

    def grouped(self) -> list[str]:
        """Return a single warning of all notes, if there are any."""
        version = f"of Mitsuba {self.document.root.attributes.get('version', '')}"
        origin = version if self.document.makes_normals else "of Nori"
        groups = (("read", self.replaced), ("left out", self.left_out))
        texts = [f"{verb}: {_with_lines(notes)}" for verb, notes in groups if notes]
        name = self.document.root.file.name
        return [f"{name}: {origin}: {'; '.join(texts)}"] if texts else []


def _with_lines(notes: Mapping[str, Sequence[int]]) -> str:
    """Return notes with the lines of the first few places of each."""
    shown = []
    for words, places in list(notes.items())[:MOST_NOTES]:
        lines = sorted(set(places))
        more = " and more" if len(lines) > MOST_LINES else ""
        shown.append(f"{words} (line {', '.join(map(str, lines[:MOST_LINES]))}{more})")
    more = f", and {len(notes) - MOST_NOTES} more" if len(notes) > MOST_NOTES else ""
    return ", ".join(shown) + more


class Properties:
    """The children of an object element; `finish` refuses those that nothing has read."""

    def __init__(self, element: Element, context: Context):
        self.element, self.context = element, context
        self.named: dict[str, Element] = {}
        self.nested: list[Element] = []
        self.read: list[str] = []
        self.motion: Keys | None = None  # of an <animation> that was taken as a transform
        for child in element.children:
            if child.tag != "alias" and self._is_known(child):
                self._add(child)

    def _is_known(self, child: Element) -> bool:
        """Whether the version of the file has an element; else SceneError, told in old files."""
        if child.tag in VALUES or child.tag in OBJECTS or child.array is not None:
            return True
        if self.context.old and (child.tag in OLD_VALUES or child.tag in OLD_OBJECTS):
            return True
        if not self.context.old:
            error = child.error("is not supported")
            if note(error):
                return False
            raise error
        self.context.leave_out(child, f"element <{child.tag}>")
        return False

    def _add(self, child: Element) -> None:
        is_value = child.tag in (*VALUES, *OLD_VALUES) or child.array is not None
        if not child.name and is_value and not child.type:
            raise child.error("needs the attribute 'name'")
        if child.name in self.named:
            if not self.context.old:
                raise child.error(f"{child.name!r} is given twice")
            self.context.warn(child, f"{child.name!r} is given twice: the later value counts")
        if child.name and (is_value or child.tag in ("texture", "volume", "ref")):
            self.named[child.name] = child
        else:
            self.nested.append(child)

    def take(self, name: str) -> Element | None:
        """Take a parameter's element, or None where it is not given."""
        self.read.append(name)
        return self.named.pop(name, None)

    def objects(self, tag: str) -> list[Element]:
        """Take the nested objects of a tag, references to such included."""
        for name, child in list(self.named.items()):
            if child.tag == "ref" and self.context.resolve(child).tag == tag:
                self.nested.append(self.named.pop(name))
        matching, others = [], []
        for child in self.nested:
            target = self.context.resolve(child)
            if target.tag == tag:
                matching.append(target)
            else:
                others.append(child)
        self.nested = others
        return matching

    def object(self, tag: str) -> Element | None:
        """Take the single nested object of a tag, or None."""
        objects = self.objects(tag)
        if len(objects) > 1 and not self.context.old:
            raise self.element.error(f"holds more than one <{tag}>")
        if len(objects) > 1:
            self.context.warn(self.element, f"holds more than one <{tag}>: the last counts")
        return objects[-1] if objects else None

    def number(self, name: str, default: float) -> float:
        """Take a finite number."""
        child = self.take(name)
        return default if child is None else number(child)

    def integer(self, name: str, default: int, low: int = 0) -> int:
        """Take a whole number of at least `low`."""
        child = self.take(name)
        if child is None:
            return default
        self._expect(child, "integer")
        try:
            value = int(child.attribute("value"))
        except ValueError:
            shown = child.attribute("value")[:40]
            raise child.error(f"must be a whole number, not {shown!r}") from None
        if not low <= value <= LARGEST_INTEGER:
            raise child.error(f"must be at least {low} and below 2^31")
        return value

    def flag(self, name: str, default: bool) -> bool:
        """Take true or false."""
        child = self.take(name)
        if child is None:
            return default
        self._expect(child, "boolean")
        text = child.attribute("value").strip().lower()
        if text not in ("true", "false"):
            raise child.error(f"must be true or false, not {text[:40]!r}")
        return text == "true"

    def text(self, name: str, default: str, choices: Sequence[str] = ()) -> str:
        """Take a string; if `choices` are given, it must be among them."""
        child = self.take(name)
        if child is None:
            return default
        self._expect(child, "string")
        value = child.attribute("value")
        if not choices:
            return value
        value = value.lower()
        if value not in choices:
            raise child.error(f"{value[:40]!r} is none of {', '.join(choices)}")
        return value

    def ignore(self, *names: str) -> None:
        """Take parameters that change no picture."""
        for name in names:
            self.take(name)

    def file(self, name: str = "filename") -> Path:
        """Take a file name that must be given, and must exist."""
        child = self.take(name)
        if child is None:
            raise self.element.error(f"needs the parameter {name!r}")
        self._expect(child, "string")
        return self.context.document.find_file(child, child.attribute("value"))

    def image(self) -> Path | NDArray[np.float32]:
        """Take the name of an image; grey if it is missing and missing images are grey.

        A dictionary may have an array in its place, (h, w) or (h, w, c).
        """
        if (array := self.array("data", "bitmap")) is not None:
            return np.asarray(array if array.ndim == 3 else array[..., None])
        child = self.named.get("filename")
        try:
            return self.file()
        except SceneError:
            if child is None or child.tag != "string" or self.context.missing == "error":
                raise
            self.context.warn(self.element, grey_for(child.attributes.get("value")))
            return GREY

    def array(self, *names: str) -> NDArray[Any] | None:
        """Take the first array of these names, which only dictionaries have; None without."""
        for name in names:
            child = self.named.get(name)
            if child is not None and child.array is not None:
                self.take(name)
                if child.array.ndim not in (2, 3, 4):
                    raise child.error(f"cannot be an array of {child.array.ndim} axes")
                return child.array
        return None

    def vector(self, name: str, default: Sequence[float] | None) -> Any:
        """Take a point or a vector."""
        child = self.take(name)
        if child is None:
            return default
        if child.tag not in ("point", "vector"):
            raise child.error("must be a <point> or a <vector>")
        return tuple(triple(child, "value", 0.0).tolist())

    def matrix(self, name: str) -> transforms.Matrix:
        """Take a transform, (4, 4) float64; the identity where it is not given.

        An <animation> in its place is the identity, followed by `motion`.
        """
        child = self.take(name)
        if child is None:
            return np.eye(4)
        if child.tag == "animation":
            self.motion = self._keys(child)
            return np.eye(4)
        self._expect(child, "transform")
        for step in child.children:
            axis = triple(step, "value", 0.0) if step.tag == "rotate" else (1.0, 0.0, 0.0)
            if abs(np.linalg.norm(axis) - 1.0) > 1e-3:
                self.context.warn(
                    step, "its axis is not of unit length: a shear in Mitsuba 3, a rotation here"
                )
        return transform(child)

    def _keys(self, animation: Element) -> Keys:
        """The keys of an <animation>: each <transform> in it has a time [s]."""
        times: list[float] = []
        for key in animation.children:
            self._expect(key, "transform")
            times.append(numbers(key, "time", 1)[0])
            if len(times) > 1 and not times[-1] > times[-2]:
                message = f"its time must be later than {times[-2]:g} s, that of the key before"
                raise key.error(message)
        with animation.locating():
            return Keys(times, [transform(key) for key in animation.children])

    def placement(self, name: str = "to_world", *, thin: bool = False) -> transforms.Matrix:
        """Take a transform that can be inverted.

        thin: a transform that flattens space leaves a thickness of FLAT_SIZE. Raises NoArea for a
        transform that leaves a line or a point.
        """
        child = self.named.get(name)
        matrix = self.matrix(name)
        if child is None or not transforms.is_singular(matrix):
            return matrix
        if not thin or not transforms.is_affine(matrix):
            raise child.error("the transform cannot be inverted: it flattens space")
        u, sizes, v = np.linalg.svd(matrix[:3, :3])
        if sizes[1] <= FLAT_SIZE * sizes[0]:
            self.context.warn(child, "nothing is left of the shape: the transform makes it a line")
            raise NoArea
        self.context.warn(child, "the transform flattens the shape: black in Mitsuba, flat here")
        matrix[:3, :3] = u * [sizes[0], sizes[1], FLAT_SIZE * sizes[0]] @ v
        return matrix

    def finish(self) -> None:
        """Raise UnusedParameterError or SceneError for parameters and objects that were not read.

        In old files unread parameters give a warning.
        """
        label = f"{self.element.tag} {self.element.type!r}".replace(" ''", "")
        for name, child in self.named.items():
            if self.context.old and self.context.resolve(child).tag in LEFT_OUT:
                self.context.leave_out(child, f"{name!r} of {label}")
                continue
            error = UnusedParameterError(label, name, set(self.read), **child.location())
            if not note(error):
                raise error
        for child in self.nested:
            self.context.resolve(child)
            raise child.error(f"cannot stand in {label}")

    def _expect(self, child: Element, tag: str) -> None:
        if child.tag != tag:
            raise child.error(f"must be a <{tag}>")


class NoArea(Exception):
    """A shape that its transform makes a line or a point."""


def unknown(element: Element, known: Iterable[str]) -> SceneError:
    """Return the error for a plugin that is not `known`."""
    if element.type in UNSUPPORTED:
        return element.error("is a plugin of Mitsuba that is not supported")
    return UnknownKindError(element.tag, element.type, known, **element.location())


def number(child: Element) -> float:
    """Return the finite number that <float> or <integer> holds."""
    if child.tag not in ("float", "integer"):
        raise child.error("must be a <float>")
    return numbers(child, "value", 1)[0]


def numbers(child: Element, attribute: str, count: int = 0) -> list[float]:
    """Return the finite numbers in an attribute, `count` of them unless that is 0."""
    text = child.attribute(attribute)
    try:
        values = [float(part) for part in SEPARATOR.split(text) if part]
    except ValueError:
        raise child.error(f"{attribute} must be numbers, not {text[:40]!r}") from None
    if not all(math.isfinite(value) for value in values):
        raise child.error(f"{attribute} must be finite, not {text[:40]!r}")
    if count and len(values) != count:
        raise child.error(f"{attribute} must be {count} numbers, not {len(values)}")
    return values


def triple(child: Element, attribute: str, default: float) -> np.ndarray:
    """Return (3,) from a single attribute, or from x, y and z with `default` for missing axes."""
    if attribute in child.attributes:
        values = numbers(child, attribute)
        if len(values) == 1:
            values *= 3
        if len(values) != 3:
            raise child.error(f"{attribute} must be 3 numbers, not {len(values)}")
        return np.array(values)
    return np.array(
        [numbers(child, axis, 1)[0] if axis in child.attributes else default for axis in "xyz"]
    )


def transform(element: Element) -> transforms.Matrix:
    """Return the product of a <transform>'s steps, (4, 4); the first is applied first."""
    matrix = np.eye(4)
    for step in element.children:
        with step.locating():
            matrix = _step(step) @ matrix
    if not np.isfinite(matrix).all():
        raise element.error("the transform is not finite")
    return matrix


def _look_at(step: Element) -> transforms.Matrix:
    origin, target = numbers(step, "origin", 3), numbers(step, "target", 3)
    if "up" in step.attributes and any(above := numbers(step, "up", 3)):
        return transforms.look_at(origin, target, above)
    x, y, z = np.subtract(target, origin) / max(math.dist(target, origin), 1e-30)
    sign = math.copysign(1.0, z)  # any perpendicular direction, here that of Duff et al. 2017
    up = [1.0 - x * x / (1.0 + abs(z)), -x * y / (1.0 + abs(z)), -sign * x]
    return transforms.look_at(origin, target, up)


def _step(step: Element) -> transforms.Matrix:
    if step.tag == "translate":
        return transforms.translate(triple(step, "value", 0.0))
    if step.tag == "scale":
        return transforms.scale(triple(step, "value", 1.0))
    if step.tag == "rotate":
        axis, (angle,) = triple(step, "value", 0.0), numbers(step, "angle", 1)
        if angle == 0.0 and not axis.any():
            return np.eye(4)  # as in Mitsuba, whose matrix is the identity for any axis
        return transforms.rotate(axis, angle)
    if step.tag == "lookat":
        return _look_at(step)
    if step.tag == "matrix":
        values = np.array(numbers(step, "value"))
        if values.size == 9:
            matrix = np.eye(4)
            matrix[:3, :3] = values.reshape(3, 3)
            return matrix
        if values.size != 16:
            raise step.error(f"a matrix has 16 or 9 numbers, not {values.size}")
        return values.reshape(4, 4)
    raise step.error("is no transform; known: translate, scale, rotate, lookat, matrix")
