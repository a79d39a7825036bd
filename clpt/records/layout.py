"""Records: a declaration gives the numpy dtype and the OpenCL text.

Every member consists of 4-byte words, so that no compiler pads anything; a test compares offsets
with the device. Four forms of text are made of a record:

- `uniform_text`: a struct of scalars in memory, the same for all lanes (settings, cameras);
- `row_text`: a lane struct and a loader that gathers a row per lane from a table of words;
- `slab_text`: a load and a store per member for slabs, where a word of all slots, or of a block of
  them, stands side by side (kernels/core/slab.cl);
- `select_text`: a lane struct that is never in memory, its value of nothing and the choice of two.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

Number = TypeVar("Number", bound=float)
SLAB_BLOCK = 32  # slots of a block of kernels/core/slab.cl, on a GPU

# type: (words, uniform form, lane form, components as the text names them)
_XYZ = (".x", ".y", ".z")
TYPES: dict[str, tuple[int, str, str, tuple[str, ...]]] = {
    "real": (1, "float", "real", ("",)),
    "integer": (1, "int", "integer", ("",)),
    "natural": (1, "uint", "natural", ("",)),
    "vec2": (2, "float", "vec2", (".x", ".y")),
    "vec3": (3, "float", "vec3", _XYZ),
    "natural3": (3, "uint", "Natural3", _XYZ),
    "fixed": (3, "uint", "Fixed", (".low", ".middle", ".high")),
    "spectrum": (4, "float", "Spectrum", (*_XYZ, ".w")),
    "matrix": (16, "float", "", ()),
}
_NUMPY = {"real": "f4", "integer": "i4", "natural": "u4", "natural3": "u4", "fixed": "u4"}
_CASTS = {
    "integer": "as_integer",
    "natural": "as_natural",
    "natural3": "as_natural",
    "fixed": "as_natural",
}
_SELECT = {"real": "sel", "integer": "sel_i", "natural": "sel_n", "vec3": "sel3"}
_ZERO = {
    "integer": "0", "natural": "0", "vec3": "v3(0.0f, 0.0f, 0.0f)", "Spectrum": "spectrum_of(0.0f)",
}  # fmt: skip


def select_name(lane: str) -> str:
    """Return the kernels' function that chooses between two values of a lane type or a record."""
    return _SELECT.get(lane) or f"{_snake(lane)}_sel"


class Constants(Generic[Number]):
    """Numbers that host and kernels share, by their names; kernels put a prefix before them.

    values: each number, and what it means. `constants["name"]` is the number.
    """

    def __init__(self, prefix: str, doc: str, unsigned: bool = False, **values: tuple[Number, str]):
        self.prefix, self.doc, self.unsigned = prefix, doc, unsigned
        self._values: dict[str, tuple[Number, str]] = values

    def __getitem__(self, name: str) -> Number:
        return self._values[name][0]

    @property
    def names(self) -> tuple[str, ...]:
        """The names, in their order."""
        return tuple(self._values)

    def text(self) -> str:
        """Return a `#define` of each."""
        suffix = "u" * self.unsigned
        rows = [
            f"#define {self.prefix}{name.upper()} {_literal(value)}{suffix}"
            + (f" /* {doc} */" if doc else "")
            for name, (value, doc) in self._values.items()
        ]
        return "\n".join([f"/* {self.doc} */", *rows, ""])


def _literal(value: int | float) -> str:
    """Return a number as OpenCL writes it: a float has the suffix f."""
    if isinstance(value, float):
        return f"{value!r}f"
    return f"{value:#x}" if value >= 1 << 12 else str(value)


def bits(prefix: str, doc: str, first: int = 1, **docs: str) -> Constants[int]:
    """Return constants that are a bit each, from `first` on; docs: what each means."""
    values = {name: (first << i, meaning) for i, (name, meaning) in enumerate(docs.items())}
    return Constants(prefix, doc, False, **values)


@dataclass(frozen=True)
class Member:
    """A member of a record: its type, its purpose, the place of its first word.

    nothing: its value in `name_nothing()` of `select_text`, as OpenCL; "": 0.
    """

    name: str
    type: str
    doc: str
    word: int
    nothing: str = ""

    @property
    def words(self) -> int:
        return TYPES[self.type][0]


class Record:
    """A named sequence of members; declared order is memory order.

    members: a type in TYPES, a documentation and, if it is not 0, `Member.nothing`.
    Raises ValueError for a type that is not in TYPES.
    """

    def __init__(self, name: str, doc: str, **members: tuple[str, str] | tuple[str, str, str]):
        self.name, self.doc = name, doc
        self.members: tuple[Member, ...] = ()
        self.words = 0  # of 4 bytes
        for member, (kind, text, *nothing) in members.items():
            if kind not in TYPES:
                raise ValueError(f"{name}.{member}: {kind!r} is none of {', '.join(TYPES)}")
            self.members += (Member(member, kind, text, self.words, *nothing),)
            self.words += self.members[-1].words

    @property
    def snake_name(self) -> str:
        """The name as the kernels' functions have it: LightRow is light_row."""
        return _snake(self.name)

    @property
    def step(self) -> int:
        """Words of a slot in a slab: odd, as distances of powers of two collide in a cache."""
        return self.words | 1

    def without(self, *names: str) -> Record:
        """Return the record without members of these names."""
        kept = [m for m in self.members if m.name not in names]
        return Record(self.name, self.doc, **{m.name: (m.type, m.doc, m.nothing) for m in kept})

    @cached_property
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

    def row_text(self, many: bool = False) -> str:
        """Return the lane struct and `name_row(table, at)`; `at`: a row's first word, per lane.

        many: see `row_words`.
        """
        lower = self.snake_name
        body, words = row_words("table", "at", self.words, many)
        body = [f"    {row}" for row in body]
        for m in self.members:
            if m.type == "vec3":
                whole = ", ".join(words[m.word + i] for i in range(3))
                body.append(f"    r.{m.name} = v3({whole});")
                continue
            for i, component in enumerate(TYPES[m.type][3]):
                value = words[m.word + i]
                if m.type in _CASTS:
                    value = f"{_CASTS[m.type]}({value})"
                if m.type == "spectrum" and i == 3:
                    body += ["#if SPECTRUM_SIZE == 4", f"    r.{m.name}.w = {value};", "#endif"]
                else:
                    body.append(f"    r.{m.name}{component} = {value};")
        head = f"inline {self.name} {lower}_row(global const uint *table, integer at)"
        return self.lane_text() + "\n".join(
            [head, "{", f"    {self.name} r;", *body, "    return r;", "}", ""]
        )

    def spread_text(self) -> str:
        """Return `name_at(table, at)`: the lane struct with a row that is the same for all lanes;
        table: of float; at: the row's first word. `row_text` has the struct."""
        lower = self.snake_name
        body = []
        for m in self.members:
            for i, component in enumerate(TYPES[m.type][3]):
                value = f"table[at + {m.word + i}]"
                if m.type in _CASTS:
                    value = f"as_{'int' if m.type == 'integer' else 'uint'}({value})"
                body.append(f"    r.{m.name}{component} = {value};")
        head = f"inline {self.name} {lower}_at(global const float *table, int at)"
        return "\n".join([head, "{", f"    {self.name} r;", *body, "    return r;", "}", ""])

    def keep_text(self) -> str:
        """Return `name_keep(table, at, m, v)`: writes a row where m; `at`: its first word."""
        lower = self.snake_name
        body = []
        for m in self.members:
            for i, component in enumerate(TYPES[m.type][3]):
                value = f"v.{m.name}{component}"
                value = f"as_real({value})" if m.type in _CASTS else value
                write = f"    scatter_if((global float *)table + {m.word + i}, at, m, {value});"
                guard = m.type == "spectrum" and i == 3
                body += ["#if SPECTRUM_SIZE == 4", write, "#endif"] if guard else [write]
        head = f"inline void {lower}_keep(global uint *table, integer at, mask m, {self.name} v)"
        return "\n".join([head, "{", *body, "}", ""])

    def select_text(self) -> str:
        """Return the lane struct, `name_sel(m, a, b)`, a where m, else b, and `name_nothing()`."""
        choices, values = [], []
        for m in self.members:
            lane, components = TYPES[m.type][2:]
            whole = m.type != "vec2"  # which has no function of its own
            for path in (m.name,) if whole else tuple(m.name + c for c in components):
                select = select_name(lane if whole else "real")
                choices.append(f"    a.{path} = {select}(m, a.{path}, b.{path});")
                values.append(f"    r.{path} = {m.nothing or _ZERO.get(lane, '0.0f')};")
        lower = self.snake_name
        return self.lane_text() + "\n".join(
            [
                f"inline {self.name} {lower}_sel(mask m, {self.name} a, {self.name} b)",
                "{", *choices, "    return a;", "}",
                f"inline {self.name} {lower}_nothing(void)",
                "{", f"    {self.name} r;", *values, "    return r;", "}",
                "",
            ]
        )  # fmt: skip

    def slab_text(self, unused: Container[str] = ()) -> str:
        """Return `load_name_member(slab, at)` and `store_name_member(slab, at, m, v)`, for each.

        unused: names of members that a scene does not use. Loading them gives `Member.nothing`,
        storing them does nothing. So kernels need not ask whether a scene has them.
        """
        used = [self._accessors(m) for m in self.members if m.name not in unused]
        absent = [self._without(m) for m in self.members if m.name in unused]
        note = [f"/* Members of {self.name} that nothing here uses. */"] * bool(absent)
        return "\n".join([*used, *note, *absent, ""])

    def _accessors(self, m: Member) -> str:
        """Return a load and a store of a member, with a comment in front of them."""
        lane, name, at = TYPES[m.type][2], f"{self.snake_name}_{m.name}", f"(s, {m.word}, at"
        cast = _CASTS.get(m.type, "") if m.words == 1 else ""
        several = f"_{m.type}" if m.words > 1 else ""  # a function of kernels/core/slab.cl
        read = f"slab_read{several}{at})"
        read = f"{cast}({read})" if cast else read
        write = f"slab_write{several}{at}, m, {'as_real(v)' if cast else 'v'})"
        return (
            f"/* {m.doc} */\ninline {lane} load_{name}(Slab s, uint at) {{ return {read}; }}\n"
            f"inline void store_{name}(Slab s, uint at, mask m, {lane} v) {{ {write}; }}"
        )

    def _without(self, m: Member) -> str:
        """Return macros in the place of a member's accessors, for a scene that does not use it."""
        lane, name = TYPES[m.type][2], f"{self.snake_name}_{m.name}"
        value = m.nothing or _ZERO.get(lane, "0.0f")
        value = value if "(" in value else f"(({lane})({value}))"
        store = f"#define store_{name}(s, at, m, v) ((void)0)"
        return f"#define load_{name}(s, at) {value}\n{store}"


def row_words(table: str, at: str, count: int, many: bool = False) -> tuple[list[str], list[str]]:
    """Return statements that read `count` words from `at` on, per lane, and each word's name.

    Four at a time, see kernels/core/rows.cl; the last four may repeat earlier words. many: lanes
    mostly read different rows, so that asking whether they read the same row costs more than it
    saves.
    """
    read = "gather_w4" if many else "row4"
    if count < 4:
        return [], [f"gather_w({table}, {at} + {i})" for i in range(count)]
    firsts = [*range(0, count - 4, 4), count - 4]
    rows = [f"vec4 words{first} = {read}({table} + {first}, {at});" for first in firsts]
    names = {first + i: f"words{first}.{c}" for first in firsts for i, c in enumerate("xyzw")}
    return rows, [names[i] for i in range(count)]


def _snake(name: str) -> str:
    return "".join(f"_{c.lower()}" if c.isupper() and i else c.lower() for i, c in enumerate(name))
