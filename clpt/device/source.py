"""Assembly of a self-contained kernel text from the kernels folder and generated parts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path, PurePath
from typing import NoReturn

from ..errors import KernelBuildError
from ..records import constant_files
from .conditions import OPENING, Macros, Row, rows_of, taken
from .definitions import Paragraph, macro, named, paragraphs, whole, with_gaps

_GENERATED = "generated/"  # prefix of files generated for a scene
TWIN = "#none"  # suffix of the section of a file with the step that does nothing
_SHARED = "#"  # suffix of the section that all steps of a file share
_MARK = re.compile(  # at a section's start
    r"^/\* (?:(?P<twin>Twin, .*?\*/)|Step(?:(?P<unnamed>\. \*/)| (?P<step>\w+):))",
    re.MULTILINE | re.DOTALL,
)
_QUOTED = re.compile(r'"([^"]+)"$')
_LINE = re.compile(r'\s*#\s*line (\d+)(?: "([^"]+)")?')
_PRIVATE = re.compile(  # at a line's start: a constant, or a function with an argument
    r"^(?:static )?(?=[A-Za-z_])(?P<definition>"
    r"constant\b[^;=\[]*?(?P<constant>\w+)\s*(?=[=\[])"
    r"|(?!static\b|kernel\b|typedef\b|return\b|else\b)"
    r"[A-Za-z_]\w*(?: \w+)* \*?(?P<function>(?!loop_)\w+)\((?=[A-Za-z_]))",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Source:
    """A program as text.

    name: of the assembled root; text: for the compiler; files: all files and virtual files in
    order, as errors name them; registers: limits to try on GPUs, see
    `native_programs.with_fewest_registers`.
    """

    name: str
    text: str
    files: tuple[str, ...]
    registers: tuple[int, ...] = ()

    def location(self, row: int) -> tuple[str | None, int | None]:
        """Return the file and line of a row of the text, counted from 1.

        Follows `#line` like a compiler; both are None above the first `#line`.
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
        """Return a source with static functions and constants.

        A definition starts at the beginning of a line, with its type. Kernels, and functions that
        a macro names, stay as they are. A compiler drops unused static functions, and does not
        optimise inlined functions separately: a third less time.
        """
        return replace(self, text=_PRIVATE.sub(r"static \g<definition>", self.text))

    def with_private(self, prefix: str) -> Source:
        """Return a source for linking, with functions and constants that other programs do not see.

        They are static, see `with_static`, and get the prefix, since some linkers compare names
        only.
        """
        names: dict[str, None] = {}

        def note(match: re.Match[str]) -> str:
            names[match["function"] or match["constant"]] = None
            return f"static {match['definition']}"

        text = _PRIVATE.sub(note, self.text)
        head = [f"#define {name} in_{prefix}_{name}" for name in names]
        return replace(self, text="\n".join([*head, text]))


@dataclass(frozen=True)
class Part:
    """A virtual file with text from another file: errors name `file`, and lines from `line` on."""

    text: str
    file: str
    line: int = 1


Virtual = Mapping[str, str | Part | tuple[str, ...]]


def kernels_folder() -> Path:
    """Return the kernels folder: in the installed package, or beside it in a checkout."""
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
    """Return the text of `root` with its includes inserted, each file once, and nothing unused.

    root: a path under the kernels folder ("stage/shade.cl") or the name of a virtual file.
    virtual: by name: generated text, a Part, or names of files to include; it precedes a file of
    that name.
    defines: become `#define` lines at the top.
    library: whether another text will use these definitions and defines.

    The constants of clpt.records are virtual files of all texts.

    Untaken branches of `#if` are left out with their directives, except conditions on names that
    compilers define (`conditions.OUTSIDE`). Unused functions, types, constants and macros are left
    out too, except in a library and in a Part that pastes names. So programs that differ by these
    only are built once.

    A `#line` before every part, and after rows that are left out, lets a compiler name clpt's file
    and line; generated files are numbered by their rows in the text. Includes are resolved before
    conditions, so they must stand outside of `#if`.

    Raises KernelBuildError for an include of a missing file or inside an `#if`, and for an `#if`
    without its `#endif`.
    """
    values = {name: str(value) for name, value in (defines or {}).items()}
    assembly = _Assembly(root, {**constant_files(), **(virtual or {})}, values, library)
    assembly.add(root, None, 0)
    return assembly.source()


@cache
def _text(folder: Path, name: str) -> str:
    """Return a file's text. Raises OSError if the folder has no such file."""
    inside = PurePath(name)
    if inside.is_absolute() or ".." in inside.parts:
        raise FileNotFoundError(name)
    return (folder / inside).read_text(encoding="utf-8")


@cache
def sections(folder: Path, file: str) -> dict[str, Part]:
    """Return the sections of a file by the ends of their names. Raises OSError without the file.

    "#": the text above the first step, which all steps share; "#name": a named step; "": the step
    without a name, or all of a file without steps; each plus TWIN: the step's twin.
    """
    text = _text(folder, file)
    marks = [*_MARK.finditer(text)]
    found: dict[str, Part] = {}
    end, start = _SHARED if marks and not marks[0]["twin"] else "", 0
    for mark in [*marks, None]:
        stop = mark.start() if mark else len(text)
        line = 1 + text.count("\n", 0, start)
        found[end] = Part(text[start:stop], f"kernels/{file}", line)
        if mark:
            step = f"#{mark['step']}" if mark["step"] else ""
            end = end + TWIN if mark["twin"] else step
            start = mark.start() if step else mark.end()
    return found


class _BadRow(Exception):
    """An error in a row of a file, with the row's number."""

    def __init__(self, line: int, message: str):
        super().__init__(message)
        self.line = line


@dataclass
class _Piece:
    """A part of a file up to an include or its end: directives, and groups of other rows."""

    rows: list[Row | list[Row]]
    include: Row | None = None


@lru_cache(maxsize=1024)
def _pieces(text: str, first: int) -> tuple[_Piece, ...]:
    """Return the pieces of a file; first: the number of its first line. Raises _BadRow."""
    pieces = [_Piece([])]
    openings: list[int] = []
    for row in rows_of(text, first):
        rows = pieces[-1].rows
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
            pieces[-1].include = row
            pieces.append(_Piece([]))
    if openings:
        raise _BadRow(openings[-1], "there is no #endif of this #if")
    return tuple(pieces)


@dataclass(eq=False)
class _File:
    """A file in the text: its label in errors, and its head comment.

    generated: whether it is no file on disk, so that its lines count as in the text; lines: their
    number so far; described: whether the text gets its head comment, which a twin does without.
    """

    label: str
    generated: bool
    described: bool = True
    header: tuple[Row, ...] = ()
    lines: int = 0


class _Assembly:
    """The state of `assemble`: the macros so far, and the pieces of files."""

    def __init__(self, root: str, virtual: Virtual, defines: dict[str, str], library: bool):
        self.root, self.virtual, self.defines = root, virtual, defines
        self.library, self.folder = library, kernels_folder()
        self.macros = Macros(defines)
        self.names: set[str] = set()
        self.pieces: list[tuple[_File, tuple[Paragraph, ...]]] = []

    def add(self, name: str, includer: str | None, line: int) -> None:
        """Append the file `name` with its includes inserted."""
        generated = name.startswith(_GENERATED)
        for part in self._read(name, includer, line):
            is_pasted = part is self.virtual.get(name) and "##" in part.text
            file = _File(part.file, generated, described=not name.endswith(TWIN))
            self._append(part, file, self.library or is_pasted)

    def _append(self, part: Part, file: _File, keeps_all: bool) -> None:
        """Append a part of a file with its includes inserted.

        keeps_all: whether unused definitions stay.
        """
        try:
            pieces = _pieces(part.text, part.line)
        except _BadRow as error:
            self._fail(part.file, error.line, str(error))
        for number, piece in enumerate(pieces):
            kept = taken(piece.rows, self.macros)
            if number == 0 and kept and kept[0].is_comment and not (keeps_all or file.generated):
                file.header, kept = kept[: file.described], kept[1:]
            self.pieces.append((file, whole(kept) if keeps_all else paragraphs(kept)))
            include = piece.include and _QUOTED.match(piece.include.argument)
            if piece.include and include and include[1] not in self.names:
                self.add(include[1], part.file, piece.include.number)

    def source(self) -> Source:
        """Return the text without unused definitions."""
        defines = [macro(name, value) for name, value in self.defines.items()]
        pieces = [(file, p.definitions) for file, ps in self.pieces for p in ps]
        stay = named([*defines, *(d for _, ds in pieces for d in ds)])
        stay |= {*(defines if self.library else ())}
        printed = with_gaps(stay, (d for file, ds in pieces if file.generated for d in ds))
        left = [(file, [p.left(printed) for p in ps]) for file, ps in self.pieces]
        text = _Text([row.text for define in defines if define in stay for row in define.rows])
        root = self.pieces[0][0]
        if any(kept for file, parts in left if file is root for kept, _ in parts):
            text.add(root, root.header)
            text.begun.add(root)
        for file, parts in left:
            for kept, apart in parts:
                if kept and file.header and file not in text.begun:
                    text.begin(file, kept[0])
                text.add(file, kept, apart)
        names = tuple(label.removeprefix("kernels/") for label in text.files)
        return Source(self.root, "\n".join([*text.rows, ""]), names)

    def _read(self, name: str, includer: str | None, line: int) -> list[Part]:
        """Return the parts of a file, the part that its steps share first, unless it was read."""
        self.names.add(name)
        content = self.virtual.get(name)
        if isinstance(content, tuple):
            content = "".join(f'#include "{file}"\n' for file in content)
        if content is not None:
            return [content if isinstance(content, Part) else Part(content, name)]
        file, mark, step = name.partition("#")
        shared = file + _SHARED
        try:
            parts = sections(self.folder, file)
        except OSError:
            parts = {}
        if mark + step not in parts and (mark or _SHARED not in parts):
            self._fail(includer, line, f"no file {name!r} in {self.folder} and no generated one")
        ends = [mark + step] if shared in self.names else [_SHARED, mark + step]
        self.names.add(shared)
        return [parts[end] for end in ends if end in parts]

    def _fail(self, file: str | None, line: int, message: str) -> NoReturn:
        raise KernelBuildError(self.root, file, line or None, f"error: {message}", None)


class _Text:
    """A text written row by row, with a `#line` where a compiler would count wrongly."""

    def __init__(self, rows: list[str]):
        self.rows = rows
        self.files: dict[str, None] = {}
        self.begun: set[_File] = set()  # files whose head comments are written
        self._label, self._line = "", 0  # of the next row, by a compiler's count

    def begin(self, file: _File, first: Row) -> None:
        """Append a file's head comment in front of the file's first remaining row.

        The comment gets a number so that the row's number is right: errors never name comments.
        """
        header = "\n".join([row.text for row in file.header])
        lines = sum(row.lines for row in file.header)
        apart = first.is_comment and first.number > file.header[0].number + lines
        self.files.setdefault(file.label)
        self.begun.add(file)
        self.rows += [f'#line {first.number - lines - apart} "{file.label}"', header]
        self.rows += [""] * apart
        self._label, self._line = file.label, first.number

    def add(self, file: _File, rows: Sequence[Row], apart: bool = False) -> None:
        """Append rows of a file; apart: after a blank row."""
        for row in rows:
            self.files.setdefault(file.label)
            self._place(file, row, apart)
            apart = False
            self.rows.append(row.text)
            self._line += row.lines
            file.lines += row.lines

    def _place(self, file: _File, row: Row, apart: bool) -> None:
        """Append a blank row or a `#line` if a compiler would count the row wrongly."""
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
