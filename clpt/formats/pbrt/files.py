"""Reading a PBRT file and those that it includes, within limits."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clpt.files import budget
from clpt.formats.located import Located
from clpt.formats.pbrt import old_words
from clpt.formats.pbrt.lexer import Lexer
from clpt.formats.pbrt.state import Definition, Shared, State

BYTES = 1024  # of a directive in memory, about
DEEPEST = 32  # files that include each other


@dataclass(eq=False)
class Contents:
    """The contents of a file: definitions in their order, and groups with their uses, by name."""

    shared: Shared
    shapes: list[Definition] = field(default_factory=list)
    lights: list[Definition] = field(default_factory=list)
    objects: dict[str, list[Definition]] = field(default_factory=dict)
    uses: list[Definition] = field(default_factory=list)
    options: dict[str, Definition] = field(default_factory=dict)
    seed: int | None = None


class Files(Located):
    """Reads the files; `state` is the graphics state at the directive that is being read."""

    def __init__(self, path: Path):
        self.path = path
        self.contents = Contents(Shared(path.parent))
        self.state = State(self.contents.shared, path.parent)
        self.files: list[Path] = []
        self.warned: set[str] = set()
        self.lexer: Lexer
        self.name = ""

    @abstractmethod
    def directive(self) -> None:
        """Take the next directive and carry it out."""

    def go_through(self, path: Path) -> None:
        """Read a file, which an Include may have named."""
        real = path.resolve()
        if real in self.files:
            raise self.lexer.error(f"{path.name} includes itself")
        if len(self.files) >= DEEPEST:
            raise self.lexer.error(f"{path.name} is included too deep: {DEEPEST} files in others")
        outer, lexer = getattr(self, "lexer", None), Lexer(path)
        shared = self.contents.shared
        if outer is None:
            shared.old = old_words.is_old(lexer.data)
        if shared.old:
            lexer.take_old()
        self.files.append(real)
        self.lexer, before = lexer, self.state.file_folder
        self.state.file_folder = path.parent
        while lexer.peek():
            budget.take(BYTES, "its directives", path)
            budget.take_parts(1, "its directives", path)
            self.directive()
        self.files.pop()
        self.state.file_folder = before
        if outer is not None:
            self.lexer = outer

    def location(self) -> dict[str, Any]:
        return {"file": self.lexer.path, "line": self.lexer.line, "where": self.name}

    def warn(self, text: str) -> None:
        """Warn of what the picture will lack, with this location."""
        location = f"{self.lexer.path.name}:{self.lexer.line}: {self.name}"
        self.contents.shared.warnings.append(f"{location}: {text}")

    def warn_once(self, text: str) -> None:
        """Warn, but only once of the same."""
        if text not in self.warned:
            self.warned.add(text)
            self.warn(text)
