"""Assembling kernel text: one self-contained text out of the kernels folder and generated parts."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import NoReturn

from ..errors import KernelBuildError

_INCLUDE = re.compile(r'\s*#\s*include\s+"([^"]+)"\s*(?://.*|/\*.*\*/\s*)?$')
_LINE = re.compile(r'\s*#\s*line (\d+) "([^"]+)"')
_WORD = re.compile(r"\w+")
_OPEN_IF = re.compile(r"\s*#\s*if")
_FUNCTION = re.compile(  # at the beginning of a line: type, name, and a first argument or "void"
    r"^(?:static )?(?P<rest>(?!static\b|kernel\b|typedef\b|return\b|else\b|void loop_)"
    r"[A-Za-z_]\w*(?: \w+)* \*?(?P<name>\w+)\((?=[A-Za-z_]))",
    re.MULTILINE,
)
_CONSTANT = re.compile(
    r"^(?:static )?(?P<rest>constant\b[^;=\[]*?(?P<name>\w+)\s*(?=[=\[]))", re.MULTILINE
)
_PRIVATE = (_FUNCTION, _CONSTANT)
_CLOSE_IF = re.compile(r"\s*#\s*endif")


@dataclass(frozen=True)
class Source:
    """A whole program as text.

    name: the root it was assembled from; text: what the compiler gets; files: every file and
    virtual file that went in, in order, as errors name them.
    """

    name: str
    text: str
    files: tuple[str, ...]

    def place(self, row: int) -> tuple[str | None, int | None]:
        """Return the file and line that a row of the text comes from, counted from 1.

        It does what a compiler does with `#line`; both are None above the first.
        """
        file, line = None, None
        for text in self.text.splitlines()[: row - 1]:
            if directive := _LINE.match(text):
                file, line = directive[2].removeprefix("kernels/"), int(directive[1])
            elif line is not None:
                line += 1
        return file, line

    def with_static(self) -> Source:
        """Return a source whose functions and constants are static.

        The rule: a definition begins at the beginning of a line, with its type. Kernels, and
        functions that a macro names, stay as they are. A compiler leaves out what is not used, and
        does not optimise by itself what it puts into its callers: a third less time.
        """
        text = self.text
        for pattern in _PRIVATE:
            text = pattern.sub(r"static \g<rest>", text)
        return Source(self.name, text, self.files)

    def with_private(self, prefix: str, defines: Mapping[str, str] | None = None) -> Source:
        """Return a source whose functions and constants other programs do not see, to be linked.

        They are static, see `with_static`, and get the prefix, since some linkers look at nothing
        but names. defines: more `#define` lines at the top.
        """
        matches = (match for pattern in _PRIVATE for match in pattern.finditer(self.text))
        names = dict.fromkeys(match["name"] for match in matches)
        renamed = {name: f"{prefix}_{name}" for name in names}
        head = [f"#define {name} {value}" for name, value in {**(defines or {}), **renamed}.items()]
        static = self.with_static()
        return Source(self.name, "\n".join([*head, static.text]), self.files)


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
) -> Source:
    """Return the text of `root` with its includes in place, each file once.

    root: a path under the kernels folder ("stage/shade.cl") or the name of a virtual file.
    virtual: name -> generated text, a Part, or the names of files that stand for it, includable by
    that name; it wins over a file of that name.
    defines: written as `#define` lines at the top, but for those that the text does not name; so
    programs that differ by nothing else are built once.

    A `#line` before every part lets a compiler name our file and line. Includes are resolved before
    the preprocessor runs, so they have to stand outside of `#if`.

    Raises KernelBuildError for an include that names nothing, or that stands inside an `#if`.
    """
    assembly = _Assembly(root, virtual or {}, kernels_folder())
    assembly.add(root, None, 0)
    text = "\n".join([*assembly.rows, ""])
    given = {name: f"#define {name} {value}\n" for name, value in (defines or {}).items()}
    named = assembly.words.union(*(_WORD.findall(row)[2:] for row in given.values()))
    head = "".join(row for name, row in given.items() if name.partition("(")[0] in named)
    return Source(root, head + text, tuple(assembly.files))


@cache
def _text(folder: Path, name: str) -> str:
    """A file's text. Raises OSError where there is none inside of the folder."""
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise FileNotFoundError(name)
    return path.read_text(encoding="utf-8")


@lru_cache(maxsize=1024)
def _words(text: str) -> frozenset[str]:
    """The words of a file, most of which are in many programs."""
    return frozenset(_WORD.findall(text))


class _Assembly:
    """The state of one `assemble`: rows written so far, their words, the files they came from."""

    def __init__(self, root: str, virtual: Virtual, folder: Path):
        self.root, self.virtual, self.folder = root, virtual, folder
        self.rows: list[str] = []
        self.files: list[str] = []
        self.names: set[str] = set()
        self.words: set[str] = set()

    def add(self, name: str, includer: str | None, line: int) -> None:
        """Append the file `name` and, in place of its includes, the files that it names."""
        part = self._read(name, includer, line)
        label = part.file
        self.names.add(name)
        self.words |= _words(part.text)
        self.files.append(label.removeprefix("kernels/"))
        self.rows.append(f'#line {part.line} "{label}"')
        depth = 0
        for number, row in enumerate(part.text.splitlines(), start=part.line):
            if "#" not in row:  # most are no directives
                self.rows.append(row)
                continue
            depth += bool(_OPEN_IF.match(row)) - bool(_CLOSE_IF.match(row))
            include = _INCLUDE.match(row)
            if include is None:
                self.rows.append(row)
            elif depth > 0:
                self._fail(
                    label,
                    number,
                    f'#include "{include[1]}" stands inside an #if; every file is put in once, '
                    "so it needs no include guard",
                )
            elif include[1] in self.names:
                self.rows.append("")
            else:
                self.add(include[1], label, number)
                self.rows.append(f'#line {number + 1} "{label}"')

    def _read(self, name: str, includer: str | None, line: int) -> Part:
        if name in self.virtual:
            given = self.virtual[name]
            if isinstance(given, tuple):
                given = "".join(f'#include "{file}"\n' for file in given)
            return given if isinstance(given, Part) else Part(given, name)
        try:
            return Part(_text(self.folder, name), f"kernels/{name}")
        except OSError:
            self._fail(includer, line, f"no file {name!r} in {self.folder} and no generated one")

    def _fail(self, file: str | None, line: int, message: str) -> NoReturn:
        raise KernelBuildError(self.root, file, line or None, f"error: {message}", None)
