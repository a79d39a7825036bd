"""Assembling kernel text: one self-contained text out of the kernels folder and generated parts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path, PurePath
from typing import NoReturn

from ..errors import KernelBuildError
from ..records import constant_files
from .conditions import OPENING, Macros, taken
from .definitions import Paragraph, macro, named, paragraphs, whole, with_gaps
from .text_rows import Row, rows_of

_GENERATED = "generated/"  # begins the names of files that are made for a scene
TWIN = "#none"  # ends the name of a half of a file: the step that does nothing
_TWIN = "\n/* Twin, "  # begins that half
_QUOTED = re.compile(r'"([^"]+)"$')
_LINE = re.compile(r'\s*#\s*line (\d+)(?: "([^"]+)")?')
_PRIVATE = re.compile(  # at the beginning of a line: a constant, or a function with an argument
    r"^(?:static )?(?=[A-Za-z_])(?P<rest>"
    r"constant\b[^;=\[]*?(?P<constant>\w+)\s*(?=[=\[])"
    r"|(?!static\b|kernel\b|typedef\b|return\b|else\b)"
    r"[A-Za-z_]\w*(?: \w+)* \*?(?P<function>(?!loop_)\w+)\((?=[A-Za-z_]))",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Source:
    """A whole program as text.

    name: the root it was assembled from; text: what the compiler gets; files: every file and
    virtual file that went in, in order, as errors name them; registers: limits of a work-item of a
    GPU to try, see clpt/device/registers.py.
    """

    name: str
    text: str
    files: tuple[str, ...]
    registers: tuple[int, ...] = ()

    def place(self, row: int) -> tuple[str | None, int | None]:
        """Return the file and line that a row of the text comes from, counted from 1.

        It does what a compiler does with `#line`; both are None above the first.
        """
        file, line = None, None
        for text in self.text.splitlines()[: row - 1]:
            if directive := _LINE.match(text):
                file = directive[2].removeprefix("kernels/") if directive[2] else file
                line = int(directive[1])
            elif line is not None:
                line += 1
        return file, line

    def with_static(self) -> Source:
        """Return a source whose functions and constants are static.

        The rule: a definition begins at the beginning of a line, with its type. Kernels, and
        functions that a macro names, stay as they are. A compiler leaves out what is not used, and
        does not optimise by itself what it puts into its callers: a third less time.
        """
        return replace(self, text=_PRIVATE.sub(r"static \g<rest>", self.text))

    def with_private(self, prefix: str) -> Source:
        """Return a source whose functions and constants other programs do not see, to be linked.

        They are static, see `with_static`, and get the prefix, since some linkers look at nothing
        but names.
        """
        names: dict[str, None] = {}

        def note(match: re.Match[str]) -> str:
            names[match["function"] or match["constant"]] = None
            return f"static {match['rest']}"

        text = _PRIVATE.sub(note, self.text)
        head = [f"#define {name} in_{prefix}_{name}" for name in names]
        return replace(self, text="\n".join([*head, text]))


@dataclass(frozen=True)
class Part:
    """A virtual file whose text stands elsewhere: errors name `file`, and lines from `line` on."""

    text: str
    file: str
    line: int = 1


Virtual = Mapping[str, str | Part | tuple[str, ...]]


def kernels_folder() -> Path:
    """Return the folder of the kernels: in the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "kernels"
    return installed if installed.is_dir() else package.parent / "kernels"


def assemble(
    root: str,
    virtual: Virtual | None = None,
    defines: Mapping[str, str | int | float] | None = None,
    *,
    library: bool = False,
) -> Source:
    """Return the text of `root` with its includes in place, each file once, and nothing unused.

    root: a path under the kernels folder ("stage/shade.cl") or the name of a virtual file.
    virtual: name -> generated text, a Part, or the names of files that stand for it, includable by
    that name; it wins over a file of that name.
    defines: written as `#define` lines at the top.
    library: whether another text will name what this one defines, and its defines.

    The constants of clpt.records are virtual files of all texts.

    What an `#if` leaves out is not in the text, nor is the `#if`, but for those that ask for what
    compilers define (`conditions.OUTSIDE`). Functions, types, constants and macros that nothing in
    the text names are left out too, unless it is a library, or they are of a Part that pastes names
    together. So programs that differ by nothing else are built once.

    A `#line` before every part, and where rows are left out of a file, lets a compiler name our
    file and line; generated files are numbered as they stand in the text. Includes are resolved
    before the preprocessor runs, so they have to stand outside of `#if`.

    Raises KernelBuildError for an include that names nothing, or that stands inside an `#if`, and
    for an `#if` without its end.
    """
    given = {name: str(value) for name, value in (defines or {}).items()}
    assembly = _Assembly(root, {**constant_files(), **(virtual or {})}, given, library)
    assembly.add(root, None, 0)
    return assembly.source()


@cache
def _text(folder: Path, name: str) -> str:
    """A file's text. Raises OSError where there is none inside of the folder."""
    inside = PurePath(name)
    if inside.is_absolute() or ".." in inside.parts:
        raise FileNotFoundError(name)
    return (folder / inside).read_text(encoding="utf-8")


def _half(folder: Path, name: str) -> Part:
    """A file up to its twin; or, where the name ends with TWIN, the twin. Raises OSError."""
    file = name.removesuffix(TWIN)
    step, _, twin = _text(folder, file).partition(_TWIN)
    if file == name:
        return Part(step, f"kernels/{file}")
    if not twin:
        raise FileNotFoundError(name)
    return Part(f"{_TWIN[1:]}{twin}", f"kernels/{file}", step.count("\n") + 2)


class _BadRow(Exception):
    """A fault in a row of a file, with the row's number."""

    def __init__(self, line: int, message: str):
        super().__init__(message)
        self.line = line


@dataclass
class _Piece:
    """A part of a file, up to an include or its end: directives, and groups of other rows."""

    rows: list[Row | list[Row]]
    include: Row | None = None


@lru_cache(maxsize=1024)
def _pieces(text: str, first: int) -> tuple[_Piece, ...]:
    """The pieces of a file; first: the number of its first line. Raises _BadRow."""
    found = [_Piece([])]
    openings: list[int] = []
    for row in rows_of(text, first):
        rows = found[-1].rows
        if not row.directive:
            last = rows[-1] if rows else None
            if isinstance(last, list):
                last.append(row)
            else:
                rows.append([row])
            continue
        if row.directive in OPENING:
            openings.append(row.number)
        elif row.directive == "endif" and openings:
            openings.pop()
        if not (row.directive == "include" and _QUOTED.match(row.argument)):
            rows.append(row)
        elif openings:
            raise _BadRow(
                row.number,
                f"#include {row.argument} stands inside an #if; every file is put in once, so it "
                "needs no include guard",
            )
        else:
            found[-1].include = row
            found.append(_Piece([]))
    if openings:
        raise _BadRow(openings[-1], "there is no #endif of this #if")
    return tuple(found)


@dataclass(eq=False)
class _File:
    """A file that goes in: what errors call it, and the comment at its head.

    generated: whether nobody can open it, so that its lines are those that are in the text; lines:
    how many they are so far.
    """

    label: str
    generated: bool
    header: tuple[Row, ...] = ()
    lines: int = 0


class _Assembly:
    """The state of one `assemble`: the macros so far, and what files have between includes."""

    def __init__(self, root: str, virtual: Virtual, defines: dict[str, str], library: bool):
        self.root, self.virtual, self.defines = root, virtual, defines
        self.library, self.folder = library, kernels_folder()
        self.macros = Macros(defines)
        self.names: set[str] = set()
        self.pieces: list[tuple[_File, tuple[Paragraph, ...]]] = []

    def add(self, name: str, includer: str | None, line: int) -> None:
        """Append the file `name` and, in place of its includes, the files that it names."""
        part = self._read(name, includer, line)
        self.names.add(name)
        try:
            pieces = _pieces(part.text, part.line)
        except _BadRow as error:
            self._fail(part.file, error.line, str(error))
        is_pasted = isinstance(self.virtual.get(name), Part) and "##" in part.text
        keeps_all = self.library or is_pasted
        generated = name.startswith(_GENERATED)
        file = _File(part.file, generated)
        for number, piece in enumerate(pieces):
            kept = taken(piece.rows, self.macros)
            if number == 0 and kept and kept[0].is_comment and not (keeps_all or generated):
                file.header, kept = kept[:1], kept[1:]
            self.pieces.append((file, whole(kept) if keeps_all else paragraphs(kept)))
            include = piece.include and _QUOTED.match(piece.include.argument)
            if piece.include and include and include[1] not in self.names:
                self.add(include[1], part.file, piece.include.number)

    def source(self) -> Source:
        """Return the text, without definitions that nothing in it names."""
        defines = [macro(name, value) for name, value in self.defines.items()]
        own = [one for _, ps in self.pieces for p in ps for one in p.definitions]
        stay = named([*defines, *own]) | {*(defines if self.library else ())}
        made = [ps for file, ps in self.pieces if file.generated]
        printed = with_gaps(stay, (one for ps in made for p in ps for one in p.definitions))
        left = [(file, [p.left(printed) for p in ps]) for file, ps in self.pieces]
        text = _Text([row.text for one in defines if one in stay for row in one.rows])
        root = self.pieces[0][0]
        if any(kept for file, found in left if file is root for kept, _ in found):
            text.add(root, root.header)
        for file, found in left:
            for kept, apart in found:
                if kept and file.header and file.label not in text.files:
                    text.begin(file, kept[0])
                text.add(file, kept, apart)
        names = tuple(label.removeprefix("kernels/") for label in text.files)
        return Source(self.root, "\n".join([*text.rows, ""]), names)

    def _read(self, name: str, includer: str | None, line: int) -> Part:
        if name in self.virtual:
            given = self.virtual[name]
            if isinstance(given, tuple):
                given = "".join(f'#include "{file}"\n' for file in given)
            return given if isinstance(given, Part) else Part(given, name)
        try:
            return _half(self.folder, name)
        except OSError:
            self._fail(includer, line, f"no file {name!r} in {self.folder} and no generated one")

    def _fail(self, file: str | None, line: int, message: str) -> NoReturn:
        raise KernelBuildError(self.root, file, line or None, f"error: {message}", None)


class _Text:
    """A text that is written row by row, with a `#line` where a compiler would count wrongly."""

    def __init__(self, rows: list[str]):
        self.rows = rows
        self.files: dict[str, None] = {}
        self._label, self._line = "", 0  # of the next row, as a compiler counts

    def begin(self, file: _File, first: Row) -> None:
        """Append the comment at a file's head in front of the first row that is left of the file.

        It is numbered so that the row's number is right: no error is in a comment.
        """
        header = "\n".join([row.text for row in file.header])
        lines = sum(row.lines for row in file.header)
        apart = first.is_comment and first.number > lines + 1
        self.files.setdefault(file.label)
        self.rows += [f'#line {first.number - lines - apart} "{file.label}"', header]
        self.rows += [""] * apart
        self._label, self._line = file.label, first.number

    def add(self, file: _File, rows: Sequence[Row], apart: bool = False) -> None:
        """Append rows of a file; apart: with a blank row before them."""
        for row in rows:
            self.files.setdefault(file.label)
            self._place(file, row, apart)
            apart = False
            self.rows.append(row.text)
            self._line += row.lines
            file.lines += row.lines

    def _place(self, file: _File, row: Row, apart: bool) -> None:
        """Let a compiler count a row right: by nothing, a blank row or a `#line`."""
        wanted = file.lines + 1 if file.generated else row.number
        if self._label != file.label:
            self.rows.append(f'#line {wanted} "{file.label}"')
        elif file.generated and apart:
            self.rows.append("")
            file.lines += 1
            wanted += 1
        elif wanted == self._line + 1:
            self.rows.append("")
        elif wanted != self._line:
            self.rows.append(f"#line {wanted}")
        self._label, self._line = file.label, wanted
