"""Statements of Wavefront's MTL files (Ramey, Rose, Tyerman 1995), by material."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clpt.errors import SceneError
from clpt.files import input_files

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
WORDS = ("-blendu", "-blendv", "-clamp", "-cc", "-imfchan", "-type", "-colorspace")
OPTIONS = {  # how many words follow
    "-s": 3, "-o": 3, "-t": 3, "-mm": 2, "-bm": 1, "-boost": 1, "-texres": 1,
    **dict.fromkeys(WORDS, 1),
}  # fmt: skip
WHOLE = {"-s": WHITE, "-o": BLACK, "-t": BLACK}  # defaults of their last numbers
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
ALIKE = {"map_bump": "bump", "map_norm": "norm", "map_kn": "norm", "map_disp": "disp"}
# Without a meaning where light is traced, or for a material that has no use for them.
SILENT = {"ka", "illum", "ni", "ns", "ks", "kd", "sharpness", "pcr", "d", "tr"}
NEUTRAL = {  # values that ask for nothing
    "tf": (WHITE, (1.0,)), "kt": (BLACK,),
    **dict.fromkeys(("anisor", "aniso", "pm", "ps", "pc"), ((0.0,),)),
}  # fmt: skip

Options = dict[str, Any]


@dataclass
class Statement:
    """A line of a material: its first word `key`, and the words after it."""

    key: str
    value: str
    file: Path
    line: int

    def error(self, message: str) -> SceneError:
        """Return an error about the line."""
        return SceneError(f"{self.key}: {message}", file=self.file, line=self.line)

    def words(self) -> list[str]:
        """Return the words before a comment."""
        return uncommented(self.value).split()

    def numbers(self, words: list[str] | None = None) -> list[float]:
        """Return the words as finite numbers. Raises SceneError."""
        words = self.words() if words is None else words
        try:
            values = [float(word) for word in words]
        except ValueError:
            unlike = f"needs numbers, not {self.value[:60]!r}"
            message = input_files.comma_message(self.value) or unlike
            raise self.error(message) from None
        if not values or not all(map(math.isfinite, values)):
            raise self.error(f"needs finite numbers, not {self.value[:60]!r}")
        return values

    def image(self, unread: str) -> tuple[str, Options]:
        """Return the name of an image, and the options before it. Raises SceneError."""
        options: Options = {}
        while (match := re.match(r"(-[a-z]+)(\s+|$)", unread, re.IGNORECASE)) is not None:
            option = match[1].lower()
            if option not in OPTIONS:
                break
            unread = unread[match.end() :]
            taken: list[str] = []
            while len(taken) < OPTIONS[option] and (word := re.match(r"(\S+)(\s+|$)", unread)):
                if option not in WORDS and not NUMBER.fullmatch(word[1]):
                    break
                taken.append(word[1])
                unread = unread[word.end() :]
            if option in WORDS and taken:
                options[option] = taken[0].lower()
            elif taken and (option in WHOLE or len(taken) == OPTIONS[option]):
                values = self.numbers(taken)
                options[option] = (*values, *WHOLE.get(option, ())[len(values) :])
            else:
                count = f"{option} needs {OPTIONS[option]} numbers"
                message = input_files.comma_message(unread) or count
                raise self.error(message)
        return unread.strip(), options

    def is_neutral(self, key: str) -> bool:
        """Return whether the statement has no effect; key: its first word."""
        if key in SILENT:
            return True
        try:
            return (*self.numbers(),) in NEUTRAL.get(key, ())
        except SceneError:
            return False


Statements = dict[str, Statement]


def uncommented(line: str) -> str:
    """Return a line without the comment behind it, if that follows a blank."""
    return re.split(r"(?:^|\s)#", line, maxsplit=1)[0].strip()


def read(path: Path) -> dict[str, Statements]:
    """Read the statements of each material by its name. Raises SceneError."""
    data = input_files.plain(input_files.read_bytes(path))
    materials: dict[str, Statements] = {}
    statements: Statements = {}
    for number, line in enumerate(data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")):
        words = input_files.decode(line.replace(b"\0", b" ")).strip().split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        key, value = words[0].lower(), words[1] if len(words) > 1 else ""
        if key == "newmtl":
            statements = materials[value] = {}
        else:
            statements[ALIKE.get(key, key)] = Statement(words[0], value, path, number + 1)
    return materials
