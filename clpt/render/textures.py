"""Textures on their way to the device: their rows and the dispatch text.

A row of `textures` belongs to one texture in one role. Row 0 is blank and valid as any kind in any
role, so that lanes which look up nothing have something to read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.layout import Record
from clpt.render import noise
from clpt.render.attributes import per_face
from clpt.render.bitmaps import Images, identity
from clpt.render.kinds import REAL_WORDS, SPECTRUM_WORDS
from clpt.render.texels import bands, spectral_image
from clpt.render.texture_programs import is_composite, operand_text, program
from clpt.scene.params import device_params, params
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

_COMMON = {
    "kind": ("integer", "position in the table of textures"),
    "to_u": ("vec3", "u of the texture from (u, v, 1) of the surface"),
    "to_v": ("vec3", "and v"),
    "mapping": ("integer", "MAPPING_"),
    "place": ("integer", "first of twelve words in `textures`: from the world to the mapping"),
}
_SOLID = {
    "kind": _COMMON["kind"],
    "place": ("integer", "first of twelve words in `textures`: from the world to the texture"),
}
_OCTAVES = {
    "octaves": ("integer", "how many"),
    "roughness": ("real", "how strong each is beside the one before"),
}
_IMAGE = {
    **_COMMON,
    "width": ("integer", "[texels]"),
    "height": ("integer", "[texels]"),
    "first": ("integer", "of its words in `images`"),
    "filter": ("integer", "BITMAP_FILTER_"),
    "wrap_u": ("integer", "BITMAP_WRAP_"),
    "wrap_v": ("integer", "BITMAP_WRAP_"),
    "decode": ("integer", "of 256 words in `images`: what bytes mean"),
}
RECORDS: dict[str, Record] = {
    "bitmap": Record("Bitmap", "An image of floats.", **_IMAGE),
    "packed_bitmap": Record("PackedBitmap", "An image of bytes.", **_IMAGE),
    "checkerboard": Record(
        "Checkerboard",
        "Two colours.",
        **_COMMON,
        color0=("integer", "first of its five words in `textures`"),
        color1=("integer", "first of its five words in `textures`"),
    ),
}
RECORDS["dots"] = Record("Dots", "Round dots.", **_COMMON)
RECORDS["checkers"] = Record("Checkers", "Cubes.", **_SOLID)
RECORDS["noise"] = Record(
    "Noise", "Octaves of noise.", **_SOLID, pattern=("integer", "NOISE_PATTERN_"), **_OCTAVES
)
RECORDS["marble"] = Record(
    "Marble",
    "Marble.",
    **_SOLID,
    **_OCTAVES,
    scale=("real", "how fine it is"),
    variation=("real", "how much the veins are disturbed"),
    colours=("integer", "first of five words of each of nine in `textures`"),
)
RECORDS["mesh_attribute"] = Record(
    "MeshAttribute",
    "Values per vertex or face.",
    kind=_COMMON["kind"],
    number=("integer", "its place in the directories of `attributes`"),
    per_face=("integer", "1: a value for each face; 0: for each vertex"),
)
RECORDS["spectral_bitmap"] = Record(
    "SpectralBitmap",
    "An image of spectra.",
    **{**_IMAGE, "first": ("integer", "of its floats in `texels`; `bands` a texel")},
    bands=("integer", "values in a texel"),
    number=("integer", "row in `spectra`: the number of the band by wavelength"),
)
KINDS = (*RECORDS, "program")
PROGRAM = KINDS.index("program")
LARGEST = 2**31 - 1  # floats in `texels` that an index reaches


class Sink(Protocol):
    """What is needed of clpt.render.tables.Tables."""

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
    place = _second_uv(tables) if texture.mapping == "uv1" else _place(texture, tables)
    return {**members, "mapping": MAPPINGS.index(texture.mapping), "place": place}


def _second_uv(tables: Sink) -> int:
    """Append where a mesh's second set of uv stands, in as many words as a place in the world."""
    words = np.zeros(12, np.uint32)
    for i, name in enumerate(SECOND_UV):
        words[i] = tables.attributes.setdefault((name, "real"), len(tables.attributes))
    return tables.append("textures", words)


def _place(texture: Placed | Solid, tables: Sink) -> int:
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
    return texture.kind, {"place": _place(texture, tables)}


def _noise(texture: Noise, role: str, tables: Sink) -> tuple[str, dict[str, Any]]:
    return texture.kind, {
        "place": _place(texture, tables),
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
        "place": _place(texture, tables),
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


def dispatch_text(
    kinds: Iterable[str],
    roles: Iterable[tuple[str, str]],
    depth: int = 0,
    mappings: bool = False,
) -> str:
    """Return the look-ups of the (kind, role) pairs in the scene, and the loaders that call them.

    depth: how many values the programs stack; mappings: some texture makes its own uv.

    texture_<role>(scene, row, point, lambdas)                 whose row is at a word
    spectrum_texture_<role>(scene, table, at, point, lambdas)  that the parameter at `at` names
    real_texture_real(scene, table, at, point, lambdas)        the same for a real
    """
    pairs, found = set(roles), set(kinds)
    lines = [f"#define MAPPING_{name.upper()} {i}" for i, name in enumerate(MAPPINGS)]
    lines += [
        f"#define USES_MAPPINGS {int(mappings)}",
        f"#define TEXTURE_PERMUTATION {RECORDS['spectral_bitmap'].words}",
    ]
    if found & {"spectral_bitmap", "packed_bitmap"}:
        found.add("bitmap")  # which knows what lies where
    present = [kind for kind in RECORDS if kind in found]
    kinds_of: tuple[type[Texture], ...] = (Bitmap, *MEMBERS)
    choosy = {cls.kind: cls for cls in kinds_of}
    parts = [*lines, '#include "lib/texture.cl"'] if found else []
    for kind in present:
        parts += _choice_lines(choosy[kind]) if kind in choosy else []
        parts += [RECORDS[kind].row_text(), f'#include "texture/{kind}.cl"']
    leaves = {
        role: [kind for kind in present if (kind, role) in pairs]
        for role in sorted({role for _, role in pairs})
    }
    programs = [role for role in leaves if ("program", role) in pairs]
    for role, own in leaves.items():
        parts += _look_up(role, own, "texture_leaf" if programs else "texture")
    if programs:
        parts += operand_text(leaves, depth)
    for role in leaves:
        parts += _with_programs(role, role in programs) if programs else []
        parts += _parameter(role)
    return "\n".join([*parts, ""])


def _choice_lines(cls: type[Texture]) -> list[str]:
    """#define KIND_PARAMETER_CHOICE for the choices that a kind's row holds as numbers."""
    return [
        f"#define {f'{cls.kind}_{name}_{choice}'.upper()} {number}"
        for name, param in device_params(cls).items()
        for number, choice in enumerate(param.choices)
    ]


def _look_up(role: str, kinds: list[str], name: str) -> list[str]:
    """Texts of `name`_<role>, for textures that combine nothing."""
    if role == "real":
        type_, choose, zero, more = "real", "sel", "0.0f", ""
    else:
        type_, choose, more = "Spectrum", "spectrum_sel", ", lambdas"
        zero = "spectrum_of(0.0f)"
    # Indices and factors are the same look-up, of other numbers.
    verb = "reflectance" if role in ("index", "factor") else role
    lines = [
        f"inline {type_} {name}_{role}"
        "(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)",
        "{",
        "    integer kind = gather_i(scene.textures, row);",
        f"    {type_} value = {zero};",
    ]
    for kind in kinds:
        loaded = f"{kind}_row(scene.textures, sel_i(m, row, (integer)(0)))"
        call = f"{kind}_{verb}({loaded}, scene, point{more})"
        lines += [
            "    {",
            f"        mask m = kind == {KINDS.index(kind)};",
            f"        if (any(m)) value = {choose}(m, {call}, value);",
            "    }",
        ]
    return [*lines, "    return value;", "}"]


def _with_programs(role: str, some: bool) -> list[str]:
    """texture_<role> for all textures, where there are programs, and `some` in this role."""
    run = f"texture_program(scene, TEXTURE_ROLE_{role.upper()}, row, m, point, lambdas)"
    type_, choose, made = "Spectrum", "spectrum_sel", run
    if role == "real":
        type_, choose, made = "real", "sel", f"{run}.x"
    if role == "reflectance":
        made = f"spectrum_clamped({run})"
    lines = [
        f"    mask m = gather_i(scene.textures, row) == {PROGRAM};",
        f"    if (any(m)) value = {choose}(m, {made}, value);",
    ]
    return [
        f"inline {type_} texture_{role}"
        "(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)",
        "{",
        f"    {type_} value = texture_leaf_{role}(scene, row, point, lambdas);",
        *(lines if some else ()),
        "    return value;",
        "}",
    ]


def _parameter(role: str) -> list[str]:
    """The texture that a parameter in a row names."""
    form, type_ = ("real", "real") if role == "real" else ("spectrum", "Spectrum")
    source = (REAL_WORDS if role == "real" else SPECTRUM_WORDS) - 1
    return [
        f"inline {type_} {form}_texture_{role}"
        "(Scene scene, global const uint *table, integer at,"
        " TexturePoint point, Wavelengths lambdas)",
        "{",
        f"    integer word = gather_i(table, at + {source}); /* 1 + the row, or no texture */",
        f"    return texture_{role}(scene, max_i(word - 1, (integer)(0)), point, lambdas);",
        "}",
    ]
