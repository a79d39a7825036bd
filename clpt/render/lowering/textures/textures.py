"""Textures on their way to the device: their rows and the dispatch text.

A row of `textures` belongs to one texture in one role. Row 0 is blank and valid as any kind in any
role, so that lanes which look up nothing have something to read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.render.contract.parameter_words import SPECTRUM_WORDS
from clpt.render.contract.texture_records import KINDS, PROGRAM, RECORDS
from clpt.render.lowering.textures import noise
from clpt.render.lowering.textures.attributes import per_face
from clpt.render.lowering.textures.bitmaps import Images, identity
from clpt.render.lowering.textures.texels import bands, spectral_image
from clpt.render.lowering.textures.texture_programs import is_composite, program
from clpt.scene.params import params
from clpt.scene.textures import (
    MAPPINGS,
    PATTERNS,
    SECOND_UV,
    WRAPS,
    Bitmap,
    Checkerboard,
    Checkers,
    Dots,
    Marble,
    MeshAttribute,
    Noise,
    Placed,
    Solid,
    Texture,
)
from clpt.spectra import RGB, Spectrum, luminance

LARGEST = 2**31 - 1  # floats in `texels` that an index reaches


class Sink(Protocol):
    """What is needed of clpt.render.lowering.tables.Tables."""

    textures: dict[Any, int]
    texture_roles: set[tuple[str, str]]
    texture_depth: int
    texture_mappings: bool
    attributes: dict[tuple[str, str], int]
    kept: list[Any]
    images: Images

    lambda_min: float
    lambda_max: float

    @property
    def spectral(self) -> bool: ...
    def spectra_row(self, spectrum: Spectrum) -> int: ...
    def size(self, name: str) -> int: ...
    def append(self, name: str, words: ArrayLike) -> int: ...
    def append_floats(self, name: str, values: ArrayLike) -> int: ...
    def spectrum_words(self, value: Any, role: str) -> tuple[NDArray[np.uint32], str]: ...


def lower_texture(texture: Texture, role: str, tables: Sink) -> int:
    """Put a texture in a role ("reflectance", "emission", "index", "real") into the tables.

    A composite must be `folded`. Returns the first word of its row in `textures`; the same texture
    in the same role is put in once. Raises SceneError for an image or a uv transform that cannot be
    used.
    """
    key = (_identity(texture), role)
    if key not in tables.textures:
        if tables.size("textures") == 0:
            _blank(tables)
        if is_composite(texture):
            kind, row = "program", _program(texture, role, tables)
            tables.texture_roles.add((kind, role))
        elif isinstance(texture, Bitmap):
            row = _bitmap(texture, role, tables)
        else:
            kind, members = MEMBERS[type(texture)](texture, role, tables)
            row, _ = _row(kind, members, tables)
            tables.texture_roles.add((kind, role))
        tables.textures[key] = row
        tables.kept.append(texture)
    return tables.textures[key]


def _program(texture: Texture, role: str, tables: Sink) -> int:
    def lower(leaf: Texture, role: str) -> int:
        return lower_texture(leaf, role, tables)

    words, depth = program(texture, role, tables, lower)
    tables.texture_depth = max(tables.texture_depth, depth)
    return tables.append("textures", [PROGRAM, *words])


def _identity(texture: Texture) -> Any:
    """What makes two textures the same: of bitmaps their parameters, else being one object."""
    if isinstance(texture, Bitmap):
        values = (getattr(texture, name) for name in ("raw", "filter", "wrap", "wrap_v", "channel"))
        placed = (texture.to_uv.tobytes(), texture.mapping, texture.to_texture.tobytes())
        return (identity(texture), *values, *placed)
    return id(texture)


def _row(kind: str, members: dict[str, Any], tables: Sink) -> tuple[int, np.ndarray]:
    """Append a row; its first word, and the row itself, which may still be written to."""
    words = np.zeros(1, RECORDS[kind].dtype)
    words["kind"] = KINDS.index(kind)
    for name, value in members.items():
        words[name] = value
    return tables.append("textures", words.view(np.uint32)), words


def _blank(tables: Sink) -> None:
    tables.append_floats("texels", np.zeros(4))
    tables.append("images", np.zeros(4, np.uint32))
    _row("spectral_bitmap", {"kind": 0, "width": 1, "height": 1}, tables)
    tables.append("textures", noise.PERMUTATION)


def _uv(texture: Placed, tables: Sink, down: bool = False) -> dict[str, Any]:
    """The members of `_COMMON`; `down`: with v turned round, as an image's rows run."""
    matrix = np.asarray(texture.to_uv, np.float64)
    if not np.allclose(matrix[2, :2], 0.0) or np.isclose(matrix[2, 2], 0.0):
        raise SceneError("its last row must be 0 0 1", where=f"{texture.kind}.to_uv")
    u, v = matrix[:2] / matrix[2, 2]
    members = {"to_u": u, "to_v": [0.0, 0.0, 1.0] - v if down else v}
    if texture.mapping == "uv":
        return members
    tables.texture_mappings = True
    transform = _second_uv(tables) if texture.mapping == "uv1" else _transform(texture, tables)
    return {**members, "mapping": MAPPINGS.index(texture.mapping), "transform": transform}


def _second_uv(tables: Sink) -> int:
    """Append where a mesh's second set of uv stands, in as many words as a place in the world."""
    words = np.zeros(12, np.uint32)
    for i, name in enumerate(SECOND_UV):
        words[i] = tables.attributes.setdefault((name, "real"), len(tables.attributes))
    return tables.append("textures", words)


def _transform(texture: Placed | Solid, tables: Sink) -> int:
    """Append the rows of `to_texture`. Raises SceneError for a projection."""
    if not np.allclose(texture.to_texture[3], [0.0, 0.0, 0.0, 1.0]):
        raise SceneError("its last row must be 0 0 0 1", where=f"{texture.kind}.to_texture")
    rows = texture.to_texture[:3].astype(np.float32)
    return tables.append("textures", np.ascontiguousarray(rows).view(np.uint32))


def _checkerboard(texture: Checkerboard, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    members = _uv(texture, tables)
    for name in ("color0", "color1"):
        value = getattr(texture, name)
        if role == "real":
            words = np.zeros(SPECTRUM_WORDS, np.float32)
            words[0] = luminance(value.to_rgb("unbounded"))
            members[name] = tables.append("textures", words.view(np.uint32))
        else:
            members[name] = tables.append("textures", tables.spectrum_words(value, role)[0])
    return texture.kind, members


def _bitmap(texture: Bitmap, role: str, tables: Sink) -> int:
    """Append a bitmap's row; unless it is one of spectra, its image comes when all are known."""
    filters = params(Bitmap)["filter"].choices
    members = {
        **_uv(texture, tables, down=True),
        "filter": filters.index(texture.filter),
        "wrap_u": WRAPS.index(texture.wrap),
        "wrap_v": WRAPS.index(texture.wrap_v or texture.wrap),
    }
    spectral = spectral_image(texture, role) if tables.spectral and role != "real" else None
    if spectral is None:
        at, row = _row("bitmap", members, tables)
        tables.images.add(texture, role, row)
        return at
    values, number = bands(spectral, tables.lambda_min, tables.lambda_max)
    if tables.size("texels") + values.size > LARGEST:
        raise SceneError("all images together have too many texels", where="bitmap.image")
    tables.texture_roles.add(("spectral_bitmap", role))
    more = {
        "width": spectral.values.shape[1],
        "height": spectral.values.shape[0],
        "first": tables.append_floats("texels", values),
        "bands": values.shape[1],
        "number": tables.spectra_row(number),
    }
    return _row("spectral_bitmap", {**members, **more}, tables)[0]


def _mesh_attribute(texture: MeshAttribute, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    number = tables.attributes.setdefault((texture.name, role), len(tables.attributes))
    return texture.kind, {"number": number, "per_face": per_face(texture.name)}


def _dots(texture: Dots, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    return texture.kind, _uv(texture, tables)


def _checkers(texture: Checkers, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    return texture.kind, {"transform": _transform(texture, tables)}


def _noise(texture: Noise, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    return texture.kind, {
        "transform": _transform(texture, tables),
        "pattern": PATTERNS.index(texture.pattern),
        "octaves": texture.octaves,
        "roughness": texture.roughness,
    }


def _marble(texture: Marble, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    if role == "real":
        words = np.zeros((len(noise.MARBLE), SPECTRUM_WORDS), np.float32)
        words[:, 0] = luminance(noise.MARBLE)
    else:
        made = [tables.spectrum_words(RGB(*rgb), "reflectance")[0] for rgb in noise.MARBLE]
        words = np.array(made).view(np.float32)
    return texture.kind, {
        "transform": _transform(texture, tables),
        "colours": tables.append("textures", words.view(np.uint32)),
        **{n: getattr(texture, n) for n in ("octaves", "roughness", "scale", "variation")},
    }


MEMBERS: dict[type[Texture], Callable[..., tuple[str, dict[str, Any]]]] = {
    Checkerboard: _checkerboard,
    MeshAttribute: _mesh_attribute,
    Dots: _dots,
    Checkers: _checkers,
    Noise: _noise,
    Marble: _marble,
}
