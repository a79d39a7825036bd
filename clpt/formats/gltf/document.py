"""A glTF 2.0 file: its JSON, every value with its JSON path, and its buffers.

Accessors are read by numpy straight from the buffers. Other readers do less: trimesh ignores
skins, morph targets, lights, fans and instances; pygltflib does not check its values.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, NoReturn
from urllib.parse import unquote, unquote_to_bytes

from clpt.arrays import is_flag, is_number, is_whole
from clpt.choices import Missing
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.reading import Once

REQUIRED: Any = object()
ROUNDING = 1e-6  # by how much a number may exceed its limits, relative to them or to 1
LARGEST = 2**53  # whole numbers that JSON's readers agree upon
JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942
PER_BYTE = 4  # bytes of memory for each of the file, while it is read
SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
DATA_URI = re.compile(r"data:([^,;]*)((?:;[^,;]*)*),", re.ASCII)


class Element:
    """An object in the JSON with its path; every value is checked as it is read."""

    __slots__ = ("document", "path", "value")

    def __init__(self, document: Document, path: str, value: Any):
        self.document, self.path, self.value = document, path, value
        if not isinstance(value, dict):
            raise self.error(f"must be an object, not {_shown(value)}")

    def __contains__(self, key: str) -> bool:
        return key in self.value

    def json_path(self, key: str | None = None) -> str:
        """Return the JSON path of this element, or of the value of a key in it."""
        return ".".join(part for part in (self.path, key) if part)

    def error(self, message: str, key: str | None = None) -> SceneError:
        """Return an error that names the file and the JSON path."""
        return SceneError(message, file=self.document.file, where=self.json_path(key) or None)

    def warn(self, message: str, key: str | None = None) -> None:
        """Warn of an omission, once for each text."""
        self.document.warn(f"{self.json_path(key)}: {message}")

    def integer(
        self, key: str, default: object = REQUIRED, low: int = 0, high: int = LARGEST
    ) -> int:
        """Return a whole number in [low, high]."""
        value = self._get(key, default)
        if value is default:
            return default
        if isinstance(value, float) and value.is_integer():
            value = int(value)  # JSON's 3.0
        if not is_whole(value):
            raise self.error(f"must be a whole number, not {_shown(value)}", key)
        if not low <= value <= high:
            raise self.error(f"{_shown(value)} is outside {low} to {high}", key)
        return value

    def number(
        self, key: str, default: object = REQUIRED, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """Return a finite number in [low, high]."""
        value = self._get(key, default)
        return default if value is default else self._number(value, key, low, high)

    def numbers(
        self,
        key: str,
        count: int | None = None,
        default: object = REQUIRED,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> tuple[float, ...]:
        """Return finite numbers, `count` of them where that is given."""
        value = self._get(key, default)
        if value is default:
            return default
        if not isinstance(value, list) or (count is not None and len(value) != count):
            raise self.error(f"must be {count or 'a list of'} numbers, not {_shown(value)}", key)
        return tuple(self._number(v, f"{key}[{i}]", low, high) for i, v in enumerate(value))

    def text(self, key: str, default: object = REQUIRED, choices: Iterable[str] = ()) -> str:
        """Return a text; if `choices` are given, it must be among them."""
        value = self._get(key, default)
        if value is default:
            return default
        if not isinstance(value, str):
            raise self.error(f"must be a text, not {_shown(value)}", key)
        if choices and value not in choices:
            raise self.error(f"{_shown(value)} is none of {', '.join(choices)}", key)
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """Return a yes or no."""
        value = self._get(key, default)
        if not is_flag(value):
            raise self.error(f"must be true or false, not {_shown(value)}", key)
        return value

    def texts(self, key: str) -> list[str]:
        """Return a list of texts; empty where there is none."""
        self.count(key)
        for i, value in enumerate(self.value.get(key, [])):
            if not isinstance(value, str):
                raise self.error(f"must be a text, not {_shown(value)}", f"{key}[{i}]")
        return list(self.value.get(key, []))

    def child(self, key: str) -> Element | None:
        """Return the object under a key, or None."""
        return Element(self.document, self.json_path(key), self.value[key]) if key in self else None

    def needed(self, key: str) -> Element:
        """Return the object under a key that must be there."""
        self._get(key, REQUIRED)
        return Element(self.document, self.json_path(key), self.value[key])

    def count(self, key: str) -> int:
        """Return the length of the list under a key; 0 where there is none."""
        value = self.value.get(key, [])
        if not isinstance(value, list):
            raise self.error(f"must be a list, not {_shown(value)}", key)
        return len(value)

    def children(self, key: str) -> list[Element]:
        """Return the objects of the list under a key."""
        self.count(key)
        path = self.json_path(key)
        values = self.value.get(key, [])
        return [Element(self.document, f"{path}[{i}]", value) for i, value in enumerate(values)]

    def index(self, key: str, table: str, default: object = REQUIRED) -> int:
        """Return an index into a list of the document, such as "accessors"."""
        value = self.integer(key, default)
        return value if value is default else self._in_table(value, key, table)

    def indices(self, key: str, table: str) -> list[int]:
        """Return a list of indices into a list of the document."""
        self.count(key)
        indices = []
        for i, value in enumerate(self.value.get(key, [])):
            if not is_whole(value):
                raise self.error(f"must be a whole number, not {_shown(value)}", f"{key}[{i}]")
            indices.append(self._in_table(value, f"{key}[{i}]", table))
        return indices

    def entry(self, key: str, table: str) -> Element | None:
        """Return the object that the index under `key` refers to, or None without that key."""
        index = self.index(key, table, None)
        return None if index is None else self.document.entry(table, index)

    def extension(self, name: str) -> Element | None:
        """Return an extension's object, or None."""
        extensions = self.child("extensions")
        return None if extensions is None else extensions.child(name)

    def _get(self, key: str, default: object) -> Any:
        value = self.value.get(key, default)
        if value is REQUIRED:
            raise self.error(f"{key!r} is missing")
        return value

    def _number(self, value: object, key: str, low: float, high: float) -> float:
        if not is_number(value):
            raise self.error(f"must be a number, not {_shown(value)}", key)
        if abs(value) > 1e38:  # beyond what single precision holds; JSON's 1e999 is infinity
            raise self.error(f"{_shown(value)} is too large", key)
        near = min(max(value, low), high)  # an exporter's float32 may exceed a limit by rounding
        if abs(value - near) > ROUNDING * max(abs(near), 1.0):
            raise self.error(f"{value:g} is outside [{low:g}, {high:g}]", key)
        return float(near)

    def _in_table(self, value: int, key: str, table: str) -> int:
        count = self.document.root.count(table)
        if not 0 <= value < count:
            message = f"there is no {table}[{_shown(value)}]; the file has {count}"
            raise self.error(message, key)
        return value


@dataclass(frozen=True)
class Scale:
    """The brightness of a file's numbers.

    emission: radiance of an emission of 1 [W m^-2 sr^-1 nm^-1 of D65]; lights: intensity of a
    punctual light of 1, in the same unit [m^2].
    """

    emission: float = 1.0
    lights: float = 1.0

    @property
    def stops(self) -> float:
        """The stops that show an emission of 1 as 1."""
        return math.log2(1.0 / self.emission)


class Document(Once):
    """A parsed file: `root` is its JSON; `warnings` say what was left out."""

    def __init__(self, file: Path, missing: Missing = "error"):
        super().__init__()
        self.file, self.missing = file, missing
        self.warnings: list[str] = []
        self.uv_sets: list[int] = []  # of the textures that were made since it was cleared
        self.multiple_scattering = 0.0  # see clpt.formats.gltf.load
        self.scale = Scale()
        self.variant: int | None = None
        data = input_files.read_bytes(file)
        budget.check(PER_BYTE * len(data), "reading it", file)
        text, self.chunk = _split(file, data) if data[:4] == b"glTF" else (data, None)
        self.root = Element(self, "", _parsed(file, text))
        self._check_version()

    def warn(self, text: str) -> None:
        """Warn of an omission, once for each text."""
        if text not in self.warnings:
            self.warnings.append(text)

    def entry(self, table: str, index: int) -> Element:
        """Return an object of a list at the top, such as meshes[2]."""
        return Element(self, f"{table}[{index}]", self.root.value[table][index])

    def buffer(self, index: int) -> bytes:
        """Return the bytes of buffers[index], of its declared length."""
        return self.once(("buffer", index), lambda: self._buffer(index))

    def resource(self, element: Element) -> bytes:
        """Return the bytes that `uri` names: data in itself or a file beside."""
        uri = element.text("uri")
        if uri[:5].lower() == "data:":
            return _data(element, "uri", uri)
        try:
            return input_files.read_bytes(self.beside(element))
        except SceneError as error:
            raise error if error.where else element.error(error.message, "uri") from None

    def beside(self, element: Element) -> Path:
        """Return the file that a relative URI names, and that is there. Raises SceneError."""
        path = self.path_of(element)
        try:
            exists = path.is_file()
        except (OSError, ValueError):  # too long, or with a zero in it
            exists = False
        if not exists:
            raise element.error(f"there is no file {_shown(unquote(element.text('uri')))}", "uri")
        try:
            return input_files.named("gltf", self.file.parent, path)
        except SceneError as error:
            raise element.error(error.message, "uri") from None

    def path_of(self, element: Element) -> Path:
        """Return the path that a relative URI names. Raises SceneError for any other URI."""
        uri = element.text("uri")
        name = unquote(uri)
        parts = PurePosixPath(name).parts
        outside = SCHEME.match(name) or name.startswith(("/", "\\")) or ".." in parts
        if outside or not parts:
            message = f"{_shown(uri)} does not lie beside the file, so it is not read"
            raise element.error(message, "uri")
        return self.file.parent.joinpath(*parts)

    def _buffer(self, index: int) -> bytes:
        element = self.entry("buffers", index)
        length = element.integer("byteLength", low=1)
        if "uri" in element:
            data = self.resource(element)
        elif index == 0 and self.chunk is not None:
            data = self.chunk
        else:
            raise element.error("has neither a uri nor a binary chunk in the file")
        if len(data) < length:
            raise element.error(f"says {length} bytes, there are {len(data)}", "byteLength")
        return data[:length] if len(data) > length else data

    def _check_version(self) -> None:
        asset = self.root.child("asset")
        if asset is None:
            raise self.root.error("is not glTF 2.0: it has no 'asset'")
        for key in ("version", "minVersion"):
            version = asset.text(key, "2.0" if key == "minVersion" else REQUIRED)
            match = re.fullmatch(r"(\d+)\.(\d+)", version)
            if match is None:
                raise asset.error(f"{_shown(version)} is no version", key)
            if int(match[1]) != 2 or (key == "minVersion" and int(match[2]) > 0):
                raise asset.error(f"glTF {version} is not supported, only 2.0", key)


def _parsed(file: Path, data: bytes) -> Any:
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no number")

    try:
        value = json.loads(input_files.decode(data), parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        reason = str(error).splitlines()[0][:80]
        raise SceneError(f"is not glTF: {reason}", file=file) from None
    if not isinstance(value, dict):
        raise SceneError("is not glTF: its JSON is no object", file=file)
    return value


def _split(file: Path, data: bytes) -> tuple[bytes, bytes | None]:
    """Return the JSON of a binary file, and its binary chunk or None."""

    def word(at: int) -> int:
        return int.from_bytes(data[at : at + 4], "little")

    version, length = word(4), word(8)
    if len(data) >= 8 and version != 2:
        raise SceneError(f"is a binary glTF of version {version}, only 2 is supported", file=file)
    if len(data) < 20 or length > len(data):
        message = f"is cut short: {len(data)} bytes of {max(length, 20)}"
        raise SceneError(message, file=file)
    chunks: list[tuple[int, bytes]] = []
    at = 12
    while at + 8 <= length:
        size, kind = word(at), word(at + 4)
        if at + 8 + size > length:
            message = f"chunk {len(chunks)} says {size} bytes, {length - at - 8} are left"
            raise SceneError(message, file=file)
        chunks.append((kind, data[at + 8 : at + 8 + size]))
        at += 8 + size
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise SceneError("is no binary glTF: its first chunk is not JSON", file=file)
    if chunks[0][1].endswith(b"\0"):
        raise SceneError("is no binary glTF: its JSON is padded with zeros, not spaces", file=file)
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None
    return chunks[0][1], binary


def _data(element: Element, key: str, uri: str) -> bytes:
    head = DATA_URI.match(uri)
    if head is None:
        raise element.error("is a data URI without a comma", key)
    body = uri[head.end() :]
    if not head[2].lower().endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(unquote(body), validate=True)
    except (binascii.Error, ValueError):
        raise element.error("is a data URI with broken base64", key) from None


def _shown(value: object) -> str:
    """Return a value for a message: short, without line breaks."""
    text = json.dumps(value) if not isinstance(value, int) or abs(value) < 10**40 else "that"
    return text if len(text) <= 60 else text[:56] + " ..."
