"""The words of docs/glossary.md: each stands once, and the code has the names that it gives."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GLOSSARY = ROOT / "docs/glossary.md"
FORMS = {"NAME.resume.exr", "generated/*.cl"}  # of names, rather than names


def rows() -> list[tuple[int, list[str]]]:
    """The rows of the glossary's tables below their heads: line, and word, meaning and code."""
    lines = GLOSSARY.read_text("utf-8").splitlines()
    split = [(n, re.split(r"(?<!\\)\|", line)[1:-1]) for n, line in enumerate(lines, 1)]
    found = [(n, [cell.strip() for cell in cells]) for n, cells in split if len(cells) == 3]
    return [(n, c) for n, c in found if c[0] not in ("word", "---")]


def test_a_word_has_one_row() -> None:
    words = [(word, line) for line, (said, *_) in rows() for word in said.split(", ")]
    first = dict(reversed(words))
    twice = [
        f"docs/glossary.md:{line}: {word}, first in line {first[word]}"
        for word, line in words
        if first[word] < line
    ]
    if twice:
        pytest.fail("\n  ".join(["a word of the glossary has one row:", *twice]), pytrace=False)


def test_the_code_has_the_names_of_the_glossary() -> None:
    files = [path for top in ("clpt", "kernels") for path in (ROOT / top).rglob("*")]
    code = "\n".join(f.read_text("utf-8") for f in files if f.suffix in (".py", ".cl"))
    names = set(re.findall(r"\w+", code))
    lost = []
    for line, (word, _, given) in rows():
        for name in set(re.findall(r"`([^`]+)`", given)) - FORMS:
            if "/" in name:
                there = (ROOT / name).exists()
            elif name.endswith(("_", "_*")):  # the beginning of names
                there = any(other.startswith(name.rstrip("*")) for other in names)
            else:
                there = set(re.findall(r"\w+", name)) <= names
            if not there:
                lost.append(f"docs/glossary.md:{line}: {word}: {name}")
    if lost:
        asked = "the glossary gives names that the code does not have: put the new ones there"
        pytest.fail("\n  ".join([asked, *lost]), pytrace=False)
