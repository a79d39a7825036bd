"""Memory traffic: the bytes of a path's state that each stage of a bounce reads and writes.

The loads and stores of slabs (clpt/records.py) are counted in the program's text. Reads of the
scene's tables and trees depend on rays and are not counted: a figure is a lower bound.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from clpt.records import SLABS
from clpt.render.flow import blocks, programs
from clpt.render.records import Features

_WORD = 4  # bytes
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_CALL = re.compile(r"(?<!\w)(?P<verb>load|store)_(?P<member>\w+)\((?!Slab )")
_QUEUED = {"append": (0, 1), "shade": (1, 0)}  # words read and written of a queue


@dataclass(frozen=True)
class Moved:
    """Bytes that an item of a stage reads and writes, with all branches taken."""

    read: int
    written: int

    @property
    def total(self) -> int:
        return self.read + self.written


def traffic(features: Features, layout: str, *, queued: bool = False) -> dict[str, Moved]:
    """Return the traffic of an item in each program, by the names of `programs.sources`.

    An item is a slot with work: in `generate` a path that ends and its successor, in `intersect`
    and `shade_...` a ray and its hit, in `shadow` a shadow ray, in `append` a slot.
    """
    texts = programs.sources(features, layout, 1, queued=queued)
    unused = blocks.unused(features)
    sizes = {
        f"{record.name.lower()}_{member.name}": member.words
        - (member.type == "spectrum" and not features.spectra.spectral)
        for record in SLABS
        for member in record.members
        if member.name not in unused
    }
    moved = {}
    for name, source in texts.items():
        queue_words = _QUEUED.get(name.split("_")[0]) if queued else None
        moved[name] = _moved(source.text, sizes, *(queue_words or (0, 0)))
    return moved


def _moved(text: str, sizes: Mapping[str, int], read: int, written: int) -> Moved:
    """Return an item's traffic; sizes: words of slabs' members; read, written: further words."""
    words: dict[str, set[str]] = {"load": set(), "store": set()}
    for call in _CALL.finditer(_COMMENT.sub("", text)):
        if call["member"] in sizes:
            words[call["verb"]].add(call["member"])
    read += sum(sizes[member] for member in words["load"])
    written += sum(sizes[member] for member in words["store"])
    return Moved(_WORD * read, _WORD * written)
