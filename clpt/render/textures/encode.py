"""The rows of textures.

A row of `textures` belongs to a texture in a role. Row 0 is blank, and valid as any kind in any
role, for idle lanes to read.

A texture that combines others is a program in postfix order, see kernels/textures/texture.cl. Its
row is the position of "program" in the table of texture kinds, then instructions of two words:
operand, operation and perhaps END, and the operand's argument.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np

from clpt import spectra
from clpt.arrays import Words
from clpt.errors import SceneError
from clpt.geometry.triangles import per_face
from clpt.render.records.materials import SPECTRUM_WORDS
from clpt.render.records.tables import TableStore
from clpt.render.records.textures import (
    END,
    KINDS,
    OPERANDS,
    OPERATIONS,
    PROGRAM,
    RECORDS,
    GraphNode,
    Operand,
    Structure,
    TextureFeatures,
)
from clpt.render.spectra.encode import SpectraTable
from clpt.render.textures.bitmaps import Images, has_levels
from clpt.render.textures.graphs import SECOND
from clpt.render.textures.texels import bands, texel_words
from clpt.scene.params import params
from clpt.scene.pixels import channel
from clpt.scene.roles import EMISSION, FACTOR, INDEX, REAL, REFLECTANCE, Role, Spectral
from clpt.scene.textures import (
    MAPPINGS,
    SECOND_UV,
    WRAPS,
    Bitmap,
    Checkerboard,
    Graph,
    Marble,
    MeshAttribute,
    Placed,
    Solid,
    Voxels,
    graph,
)
from clpt.scene.textures.graph import TEXTURE, Step, parts_of
from clpt.scene.values import Operation, Texture, Use, constant_number, is_texture, separated
from clpt.spectra import RGB, Constant, RGBIlluminant, RGBUnbounded, luminance

LARGEST = 2**31 - 1  # floats in `texels` that an index reaches

# Perlin's reference implementation of Improving Noise (2002).
PERMUTATION = np.array(
    [
        151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69,
        142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252,
        219, 203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168,
        68, 175, 74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211,
        133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1, 216, 80,
        73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100,
        109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82,
        85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119, 248,
        152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98,
        108, 110, 79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238,
        210, 144, 12, 191, 179, 162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31,
        181, 199, 106, 157, 184, 84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205,
        93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78, 66, 215, 61, 156, 180,
    ],
    np.uint32,
)  # fmt: skip

# The colours of marble's curves, linear, from Pharr, Jakob, Humphreys: Physically Based Rendering.
MARBLE = np.array(
    [
        [0.58, 0.58, 0.60], [0.58, 0.58, 0.60], [0.58, 0.58, 0.60], [0.50, 0.50, 0.50],
        [0.60, 0.59, 0.58], [0.58, 0.58, 0.60], [0.58, 0.58, 0.60], [0.20, 0.20, 0.33],
        [0.58, 0.58, 0.60],
    ]
)  # fmt: skip


class TextureTable:
    """The rows of `textures`, and the images and mesh attributes that textures ask for.

    roles: the (kind, role) pairs that occur; attributes: the index in directories by (name, role,
    channel); mappings: whether a texture has a mapping other than a mesh's uv; depth: the most
    values that a program stacks; graphs: the structures of graphs, with their numbers.
    """

    def __init__(self, store: TableStore, spectra: SpectraTable, images: Images):
        self.store, self.spectra, self.images = store, spectra, images
        self.roles: set[tuple[str, str]] = set()
        self.attributes: dict[tuple[str, Role, str], int] = {}
        self.mappings = False
        self.depth = 0
        self.graphs: dict[Structure, int] = {}  # their numbers
        self._uplift: int | None = None
        self._rows: dict[tuple[Any, Role], int] = {}
        self._folded: dict[tuple[int, Role], Any] = {}
        self._alive: list[Any] = []  # textures whose ids are keys

    def folded(self, value: object, role: Role) -> Any:
        """Return a value with constants combined and RGB products separated, see `Texture`."""
        key = id(value), role
        if is_texture(value) and key not in self._folded:
            combined = value.folded(role)
            spectral = self.spectra.spectral and role in (REFLECTANCE, EMISSION)
            self._folded[key] = separated(combined, role) if spectral else combined
            self._alive.append(value)
        return self._folded.get(key, value)

    def row(self, texture: Texture, role: Role) -> int:
        """Append a texture in a role; return the first word of its row in `textures`.

        A composite must be `folded`. The same texture in the same role is appended once. Raises
        SceneError for an image or a uv transform that cannot be used.
        """
        key = texture.identity, role
        if key not in self._rows:
            if self.store.size("textures") == 0:
                self._append_blank()
            self._rows[key] = self._append(texture, role)
            self._alive.append(texture)
        return self._rows[key]

    def features(self) -> TextureFeatures:
        """Return the features of the textures so far."""
        return TextureFeatures(
            roles=tuple(sorted(self.roles)),
            mappings=self.mappings,
            depth=self.depth,
            graphs=tuple(self.graphs),
            attributes=bool(self.attributes),
        )

    def finish(self) -> list[str]:
        """Append the images, when all of them are known; return warnings."""
        return self.images.finish(self.store, self.roles)

    @property
    def second_uv(self) -> tuple[int, int]:
        """The indices of the attributes that make a mesh's second set of uv; -1: not used."""
        u, v = (self.attributes.get((name, REAL, ""), -1) for name in SECOND_UV)
        return u, v

    def attribute(self, name: str, role: Role, channel: str = "") -> int:
        """Return the index of a mesh attribute in the directories of `attributes`.

        role: as in `row`; channel: of a colour, for a number: "r", "g" or "b", "" for luminance.
        """
        return self.attributes.setdefault((name, role, channel), len(self.attributes))

    def uplift(self) -> int:
        """Return the first float in `texels` of the table of spectra of colours; 0 in RGB mode."""
        if self._uplift is None:
            table = spectra.uplift_table() if self.spectra.spectral else np.zeros(0, np.float32)
            self._uplift = self.store.append_floats("texels", table) if table.size else 0
        return self._uplift

    def append_row(self, kind: str, members: dict[str, Any]) -> tuple[int, np.ndarray]:
        """Append a row; return its first word, and the row, which may still be written to."""
        words = np.zeros(1, RECORDS[kind].dtype)
        words["kind"] = KINDS.index(kind)
        for name, value in members.items():
            words[name] = value
        return self.store.append("textures", words.view(np.uint32)), words

    def _append(self, texture: Texture, role: Role) -> int:
        if texture.combines:
            self.roles.add(("program", role.name))
            words, depth = program(texture, role, self)
            self.depth = max(self.depth, depth)
            return self.store.append("textures", [PROGRAM, *words])
        append = APPENDERS.get(type(texture), _plain)
        return append(texture, role, self)

    def append_leaf(self, texture: Texture, role: Role, **members: Any) -> int:
        """Append the row of a texture other than an image; return its first word."""
        self.roles.add((texture.kind, role.name))
        return self.append_row(texture.kind, members)[0]

    def _append_blank(self) -> None:
        self.store.append_floats("texels", np.zeros(4))
        self.store.append("images", np.zeros(4, np.uint32))
        self.append_row("spectral_bitmap", {"kind": 0, "width": 1, "height": 1})
        self.store.append("textures", PERMUTATION)


def _place(texture: Any, table: TextureTable) -> dict[str, Any]:
    """Return the members of a row about where the texture's pattern lies."""
    if texture.fills == "space":
        return {"transform": _transform(texture, table)}
    return _uv(texture, table) if texture.fills == "uv" else {}


def _uv(texture: Placed, table: TextureTable, down: bool = False) -> dict[str, Any]:
    """Return the members of a row about uv; down: v runs down, as an image's rows do."""
    u, v = texture.affine[:2]
    members = {"to_u": u, "to_v": [0.0, 0.0, 1.0] - v if down else v}
    if texture.mapping == "uv":
        return members
    table.mappings = True
    transform = _second_uv(table) if texture.mapping == "uv1" else _transform(texture, table)
    return {**members, "mapping": MAPPINGS.index(texture.mapping), "transform": transform}


def _second_uv(table: TextureTable) -> int:
    """Append the attributes of a mesh's second set of uv, in as many words as `_transform`."""
    words = np.zeros(12, np.uint32)
    for i, name in enumerate(SECOND_UV):
        words[i] = table.attribute(name, REAL)
    return table.store.append("textures", words)


def _transform(texture: Placed | Solid, table: TextureTable) -> int:
    """Append the rows of `to_texture`."""
    matrix = np.asarray(texture.to_texture, np.float32)
    return table.store.append("textures", np.ascontiguousarray(matrix[:3]).view(np.uint32))


def _checkerboard(texture: Checkerboard, role: Role, table: TextureTable) -> int:
    members = _place(texture, table)
    colours: dict[str, Any] = {"color0": texture.color0, "color1": texture.color1}
    for name, value in colours.items():
        if role is REAL:
            words = np.zeros(SPECTRUM_WORDS, np.float32)
            words[0] = luminance(value.to_rgb("unbounded"))
            members[name] = table.store.append("textures", words.view(np.uint32))
        else:
            members[name] = table.store.append(
                "textures", table.spectra.words(value, cast(Spectral, role))[0]
            )
    return table.append_leaf(texture, role, **members)


def _bitmap(texture: Bitmap, role: Role, table: TextureTable) -> int:
    """Append a bitmap's row; its image follows in `finish`, an image of spectra at once."""
    filters, smooth = params(Bitmap)["filter"].choices, texture.filter == "trilinear"
    members = {
        **_uv(texture, table, down=True),
        "filter": filters.index("bilinear" if smooth else texture.filter),
        "wrap_u": WRAPS.index(texture.wraps[0]),
        "wrap_v": WRAPS.index(texture.wraps[1]),
    }
    in_colours = not table.spectra.spectral or role is REAL
    spectral = None if in_colours else texture.spectral(role)
    if spectral is None:
        kind = "mip_bitmap" if has_levels(texture, role) else "bitmap"
        at, row = table.append_row(kind, members)
        table.images.add(texture, role, row)
        return at
    values, number = bands(spectral, *table.spectra.range)
    if table.store.size("texels") + values.size > LARGEST:
        raise SceneError("all images together have too many texels", where="bitmap.image")
    table.roles.add(("spectral_bitmap", role.name))
    more = {
        "width": spectral.values.shape[1],
        "height": spectral.values.shape[0],
        "first": table.store.append_floats("texels", values),
        "bands": values.shape[1],
        "number": table.spectra.row(number),
    }
    return table.append_row("spectral_bitmap", {**members, **more})[0]


def _mesh_attribute(texture: MeshAttribute, role: Role, table: TextureTable) -> int:
    channel = texture.channel if role is REAL and texture.channel != "luminance" else ""
    number = table.attribute(texture.name, role, channel)
    return table.append_leaf(texture, role, number=number, per_face=per_face(texture.name))


def _marble(texture: Marble, role: Role, table: TextureTable) -> int:
    if role is REAL:
        words = np.zeros((len(MARBLE), SPECTRUM_WORDS), np.float32)
        words[:, 0] = luminance(MARBLE)
    else:
        colours = [table.spectra.words(RGB(*rgb), REFLECTANCE)[0] for rgb in MARBLE]
        words = np.array(colours).view(np.float32)
    members = {**_place(texture, table), **texture.record_members()}
    first = table.store.append("textures", words.view(np.uint32))
    return table.append_leaf(texture, role, colours=first, **members)


def _graph(texture: Graph, role: Role, table: TextureTable) -> int:
    encoded = _EncodedGraph(texture, table)
    table.mappings |= SECOND in texture.sources
    channel, few = params(Graph)["channel"].choices.index(texture.channel), texture.width < 3
    members = {
        "structure": table.graphs.setdefault(encoded.structure, len(table.graphs)),
        "first": table.store.append("textures", np.array([*encoded.words, 0], np.uint32)),
        "channel": 1 if few and texture.channel == "luminance" else channel,
        "bounded": role is REFLECTANCE,
        "uplift": 0 if role is REAL else table.uplift(),
    }
    return table.append_leaf(texture, role, **members)


class _EncodedGraph:
    """The structure of a graph, and its words."""

    def __init__(self, texture: Graph, table: TextureTable):
        self._texture, self._table = texture, table
        self.words: list[int] = []
        nodes = tuple(self._node(step) for step in texture.steps)
        self.structure = Structure(nodes, self._operand(texture.result))

    def _node(self, step: Step) -> GraphNode:
        operands = [self._operand(operand) for operand in step.operands.values()]
        settings = step.settings
        if step.kind == TEXTURE:
            parts = parts_of(self._texture.textures[settings["texture"]], step.width)
            rows = [self._table.row(part, REAL) for part in parts]
            operands.insert(0, ("rows", self._append(*rows), len(rows)))
            settings = {}
        if step.stops is not None:
            stops = step.stops.astype(np.float32).view(np.uint32)
            words = np.array([len(stops), *stops.reshape(-1)], np.uint32)
            first = self._table.store.append("textures", words)
            operands.append(("rows", self._append(first), 1))
        return GraphNode(step.kind, tuple(operands), (*settings.values(),), step.width)

    def _operand(self, operand: graph.Operand) -> Operand:
        if isinstance(operand, int):
            return "step", operand
        if isinstance(operand, str):
            second = [self._append(_second_uv(self._table))] if operand == SECOND else []
            return (operand, *second)
        words = operand.astype(np.float32).view(np.uint32)
        return "words", self._append(*words.tolist()), len(words)

    def _append(self, *words: int) -> int:
        self.words += words
        return len(self.words) - len(words)


def _voxels(texture: Voxels, role: Role, table: TextureTable) -> int:
    slices = texture.slices
    nz, ny, nx, depth = slices.shape
    rows = slices.reshape(nz * ny, nx, depth)
    chosen = channel(rows, "luminance") if role is REAL else rows
    words = texel_words(chosen, role, table.spectra.spectral)
    if table.store.size("images") + words.size > LARGEST:
        raise SceneError("all images together have too many texels", where="voxels.values")
    members = {
        **_place(texture, table),
        "nx": nx,
        "ny": ny,
        "nz": nz,
        "first": table.store.append("images", words),
        "nearest": texture.filter == "nearest",
        "wrap": WRAPS.index(texture.wrap),
    }
    return table.append_leaf(texture, role, **members)


def _plain(texture: Texture, role: Role, table: TextureTable) -> int:
    """Append the row of a texture whose members are numbers."""
    return table.append_leaf(texture, role, **_place(texture, table), **texture.record_members())


# functions that append the row of a kind with images, attributes or colours
APPENDERS: dict[type[Texture], Callable[..., int]] = {
    Bitmap: _bitmap,
    Checkerboard: _checkerboard,
    Graph: _graph,
    MeshAttribute: _mesh_attribute,
    Marble: _marble,
    Voxels: _voxels,
}


Code = list[tuple[int, int]]


def program(value: Texture, role: Role, table: TextureTable) -> tuple[Words, int]:
    """Return the instructions of a composite in a role, and how many values they stack.

    value: a result of `Texture.folded`; table: the rows of its parts are appended to it.
    """
    code, depth = _Writer(role, table).code(value, "own")
    last, argument = code[-1]
    return np.array([*code[:-1], (last | END, argument)], np.uint32).reshape(-1), depth


class _Writer:
    """Writes the instructions of a program."""

    def __init__(self, role: Role, table: TextureTable):
        self.role, self.table = role, table

    def code(self, value: object, use: Use) -> tuple[Code, int]:
        """Return instructions that push a value, and how many values they stack."""
        operation = self._operation(value, use)
        if operation is None:
            return [self._operand(value, use)], 1
        name, operands = operation
        joined: Code = []
        depth = 0
        for below, (operand_value, operand_use) in enumerate(operands[:-1]):
            code, needed = self.code(operand_value, operand_use)
            joined, depth = joined + code, max(depth, below + needed)
        last, last_use = operands[-1]
        if self._operation(last, last_use):
            code, needed = self.code(last, last_use)
            joined, depth = joined + code, max(depth, len(operands) - 1 + needed)
            operand, argument = OPERANDS.index("top"), 0
        else:
            operand, argument = self._operand(last, last_use)
        return [*joined, (operand | OPERATIONS[name], argument)], depth

    def _operation(self, value: object, use: Use) -> Operation | None:
        return value.operation(use, self.role) if is_texture(value) else None

    def _operand(self, value: Any, use: Use) -> tuple[int, int]:
        role = {"own": self.role, "factor": REFLECTANCE, "real": REAL}[use]
        if is_texture(value):
            # in a program of numbers every operand is a number
            name = "own" if role == self.role else use
            return OPERANDS.index(name), self.table.row(value, role)
        number = constant_number(value, role)
        if number is not None and role is not EMISSION:
            word = np.float32(number).view(np.uint32)
            return OPERANDS.index("number"), int(word)
        return OPERANDS.index("constant"), self.table.store.append(
            "textures", self._words(value, role)
        )

    def _words(self, value: Any, role: Role) -> Words:
        """Return a colour or spectrum as five words; colours may exceed 1, emission is D65."""
        if role is EMISSION and isinstance(value, Constant):
            value = RGBIlluminant(*[value.value] * 3)
        if role in (REFLECTANCE, INDEX) and type(value) in (RGB, RGBUnbounded):
            rgb = (value.r, value.g, value.b)
            words = np.zeros(SPECTRUM_WORDS, np.float32)
            if self.table.spectra.spectral:
                words[3], words[:3] = spectra.unbounded(rgb)
            else:
                words[:3] = rgb
            return words.view(np.uint32)
        if type(value) is RGBUnbounded:
            value = RGB(value.r, value.g, value.b)
        spectral = cast(Spectral, FACTOR if role is REFLECTANCE else role)
        return self.table.spectra.words(value, spectral)[0]
