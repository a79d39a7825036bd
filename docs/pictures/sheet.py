"""The contact sheet of all kinds: the last part of docs/gallery.md, from its heading on."""

from __future__ import annotations

from clpt.formats.native.reference import HEADINGS

from .table import PICTURES

HEADING = "## Every kind\n"
INTRODUCTION = """
A picture leads to the kind's parameters. `python -m docs.pictures` renders all of them and writes
this part of the page; [`docs/pictures`](pictures) has their scenes.
"""
PER_ROW = {"material": 2}


def written(page: str) -> str:
    """Return the page with its contact sheet written anew."""
    return page.split(HEADING)[0] + HEADING + sheet()


def sheet() -> str:
    parts = [INTRODUCTION]
    for category, entries in PICTURES.items():
        cells = [
            f"[![{kind}](pictures/kinds/{category}/{kind}.webp)](scene_format.md#{kind})<br>"
            f"[`{kind}`](scene_format.md#{kind})"
            for kind in entries
        ]
        count = PER_ROW.get(category, 3)
        cells += [""] * (-len(cells) % count)
        rows = [cells[at : at + count] for at in range(0, len(cells), count)]
        table = [rows[0], ["---"] * count, *rows[1:]]
        parts.append(f"### {HEADINGS[category]}\n")
        parts.append("\n".join(f"| {' | '.join(row)} |" for row in table) + "\n")
    return "\n".join(parts)
