"""Records: one declaration, from which the numpy dtype and the OpenCL text follow.

Every member consists of 4-byte words, so that no compiler pads anything; a test compares offsets
with the device. Three forms of text are made of a record:

- `uniform_text`: a struct of scalars in memory, the same for all lanes (settings, cameras);
- `row_text`: a lane struct and a loader that gathers one row per lane from a table of words;
- `slab_text`: a lane struct and a load and a store per member for structure-of-arrays slabs, where
  each word is a stream of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# type: (words, uniform form, lane form, components as the text names them)
_XYZ = (".x", ".y", ".z")
TYPES: dict[str, tuple[int, str, str, tuple[str, ...]]] = {
    "real": (1, "float", "real", ("",)),
    "integer": (1, "int", "integer", ("",)),
    "natural": (1, "uint", "natural", ("",)),
    "vec2": (2, "float", "vec2", (".x", ".y")),
    "vec3": (3, "float", "vec3", _XYZ),
    "spectrum": (4, "float", "Spectrum", (*_XYZ, ".w")),
    "matrix": (16, "float", "", ()),
}
_NUMPY = {"real": "f4", "integer": "i4", "natural": "u4"}


@dataclass(frozen=True)
class Member:
    """One member of a record: where its first word stands, its type and why it is there."""

    name: str
    type: str
    doc: str
    word: int

    @property
    def words(self) -> int:
        return TYPES[self.type][0]


class Record:
    """A named sequence of members; declared order is memory order.

    Raises ValueError for a type that is not in TYPES.
    """

    def __init__(self, name: str, doc: str, **members: tuple[str, str]):
        self.name, self.doc = name, doc
        self.members: tuple[Member, ...] = ()
        for member, (kind, text) in members.items():
            if kind not in TYPES:
                raise ValueError(f"{name}.{member}: {kind!r} is none of {', '.join(TYPES)}")
            self.members += (Member(member, kind, text, self.words),)

    @property
    def words(self) -> int:
        """Size in 4-byte words."""
        return sum(m.words for m in self.members)

    @property
    def dtype(self) -> np.dtype:
        """The record as a packed numpy structure."""
        fields = []
        for m in self.members:
            base = _NUMPY.get(m.type, "f4")
            shape = (4, 4) if m.type == "matrix" else (m.words,)
            fields.append((m.name, base) if m.words == 1 else (m.name, base, shape))
        return np.dtype(fields)

    def uniform_text(self) -> str:
        """Return `typedef struct {...} Name;` of scalars, as it lies in memory."""
        rows = [
            f"    {TYPES[m.type][1]} {m.name}{f'[{m.words}]' if m.words > 1 else ''}; /* {m.doc} */"
            for m in self.members
        ]
        return self._struct(rows)

    def lane_text(self) -> str:
        """Return `typedef struct {...} Name;` of lane types."""
        return self._struct(
            [f"    {TYPES[m.type][2]} {m.name}; /* {m.doc} */" for m in self.members]
        )

    def _struct(self, rows: list[str]) -> str:
        return "\n".join([f"/* {self.doc} */", "typedef struct {", *rows, f"}} {self.name};", ""])

    def row_text(self) -> str:
        """Return the lane struct and `name_row(table, at)`; `at`: a row's first word, per lane."""
        lower = _snake(self.name)
        body = []
        for m in self.members:
            read = "gather_i" if m.type == "integer" else "gather_w"
            for i, component in enumerate(TYPES[m.type][3]):
                value = f"{read}(table, at + {m.word + i})"
                if m.type == "natural":
                    value = f"as_natural({value})"
                if m.type == "spectrum" and i == 3:
                    body += ["#if SPECTRUM_SIZE == 4", f"    r.{m.name}.w = {value};", "#endif"]
                else:
                    body.append(f"    r.{m.name}{component} = {value};")
        head = f"inline {self.name} {lower}_row(global const uint *table, integer at)"
        return self.lane_text() + "\n".join(
            [head, "{", f"    {self.name} r;", *body, "    return r;", "}", ""]
        )

    def slab_text(self) -> str:
        """Return `load_name_member(slab, at)` and `store_name_member(slab, at, m, v)`, for each."""
        lower = _snake(self.name)
        parts = [f"#define {lower.upper()}_WORDS {self.words}"]
        for m in self.members:
            lane = TYPES[m.type][2]
            cast = {"integer": "as_integer", "natural": "as_natural"}.get(m.type, "")
            load, store = [], []
            for i, component in enumerate(TYPES[m.type][3]):
                read = f"    r{component} = {cast}(slab_read(s, {m.word + i}, at));"
                value = f"as_real(v{component})" if cast else f"v{component}"
                write = f"    slab_write(s, {m.word + i}, at, m, {value});"
                guard = m.type == "spectrum" and i == 3
                load += ["#if SPECTRUM_SIZE == 4", read, "#endif"] if guard else [read]
                store += ["#if SPECTRUM_SIZE == 4", write, "#endif"] if guard else [write]
            parts += [
                f"/* {m.doc} */",
                f"inline {lane} load_{lower}_{m.name}(Slab s, At at)",
                "{", f"    {lane} r;", *load, "    return r;", "}",
                f"inline void store_{lower}_{m.name}(Slab s, At at, mask m, {lane} v)",
                "{", *store, "}",
            ]  # fmt: skip
        return "\n".join([*parts, ""])


def _snake(name: str) -> str:
    return "".join(f"_{c.lower()}" if c.isupper() and i else c.lower() for i, c in enumerate(name))
