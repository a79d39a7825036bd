"""`python -m bench.board FILES... -o board.html` makes a page of many results of `clpt bench`.

FILES: JSON lines of `clpt bench --json`, or reports of `clpt bench --first-light`, of any devices
and machines. The page is an HTML file without scripts: devices by their points, their strengths,
and wrong figures. Of equal figures of a device, driver and clpt the newest counts.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import click

from clpt.bench import pictures, records
from clpt.bench.scenes import PICTURES, SIZES
from clpt.errors import SceneError
from clpt.files import output_files

Row = dict[str, Any]
WHO = ("device", "driver", "processor", "clpt", "commit")  # equal in all figures of a row
FENCED = re.compile(r"^```json\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Of each column: the part, the scene, what the figure's name must match, and what it says.
SUBSCORES = {
    "copy": ("bandwidth", "", r"copy 128 MiB", "a copy of 128 MiB"),
    "coherent rays": ("rays", "atrium", r"\w+ primary closest", "the camera's, nearest triangle"),
    "incoherent rays": ("rays", "atrium", r"\w+ diffuse closest", "scattered, nearest triangle"),
    "any hit": ("rays", "atrium", r"\w+ shadow any", "to a light, anything between"),
    "shading": ("stages", "atrium", r"shade_diffuse", "hits on a diffuse surface"),
    "sorting": ("stages", "atrium", r"append", "slots brought together by material"),
    "building": ("build", "atrium", r"build \w+", "trees of high quality"),
    "cold start": (
        "start",
        "cornell",
        r"cold start",
        "a first picture, empty caches, less is better",
    ),
}
STYLE = """
:root { color-scheme: light dark; --ink: #22252b; --faint: #6c717c; --paper: #fbfaf7;
  --line: #dddad2; --bar: #2f6f9f; --wrong: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e6e1; --faint: #9a9fa9;
  --paper: #191b1f; --line: #34373d; --bar: #6aa9d8; --wrong: #ff8a80; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 1180px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
p, .faint { color: var(--faint); } .faint { font-size: .85em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: .45rem .6rem; border-bottom: 1px solid var(--line); text-align: right;
  vertical-align: top; white-space: nowrap; }
th { font-weight: 600; } th:first-child, td:first-child { text-align: left; white-space: normal;
  min-width: 11rem; }
.bar { height: 4px; border-radius: 2px; background: var(--bar); margin-top: 3px;
  margin-left: auto; }
.wrong { color: var(--wrong); } .words { white-space: normal; text-align: left; }
b { font-size: 1.15em; }
"""


@dataclass
class Entry:
    """All that was measured of a device with a driver and a clpt: figures by their keys."""

    who: Row
    figures: dict[tuple[Any, ...], Row] = field(default_factory=dict)

    def picture(self, name: str, size: str) -> Row | None:
        """Return the record of a picture."""
        rows = [
            row
            for row in self.figures.values()
            if (row["bench"], row["figure"], row.get("size")) == (pictures.PART, name, size)
        ]
        return max(rows, key=lambda row: row.get("benchmark_version", 0), default=None)

    def score(self, size: str) -> float:
        """Return the geometric mean of the pictures' points; 0 if a picture is wrong or missing."""
        each = [points(self.picture(name, size)) for name in PICTURES]
        return math.prod(each) ** (1 / len(each))

    def best(self, part: str, scene: str, pattern: str) -> Row | None:
        """Return the best record of a part and scene whose figure's name matches."""
        rows = [
            row
            for row in self.figures.values()
            if (row["bench"], row.get("scene", "")) == (part, scene)
            and row["value"]
            and re.fullmatch(pattern, row["figure"])
        ]
        sign = -1.0 if part == "start" else 1.0
        return max(rows, key=lambda row: sign * float(row["value"]), default=None)


def points(row: Row | None) -> float:
    """Return the points of a picture's record; 0 if it is wrong or there is none."""
    return float(row["points"]) if row is not None and row["value"] is not None else 0.0


def read(path: Path) -> list[Row]:
    """Return the records of a file. Raises SceneError."""
    if path.suffix.lower() != ".md":
        return records.read(path)
    try:
        fenced = FENCED.search(path.read_text(encoding="utf-8"))
        return [json.loads(row) for row in fenced[1].splitlines()] if fenced else []
    except (OSError, ValueError) as error:
        raise SceneError(f"is no report of clpt bench --first-light: {error}", file=path) from error


def entries(rows: Iterable[Row]) -> list[Entry]:
    """Return an entry for each device, driver and clpt; records of other things are left out."""
    by_machine: dict[tuple[str, ...], Entry] = {}
    for row in sorted(rows, key=lambda row: str(row.get("date", ""))):
        if "device" in row and {"figure", "value", "bench"} <= row.keys():
            who = {name: row.get(name, "") for name in WHO}
            entry = by_machine.setdefault(tuple(map(str, who.values())), Entry(who))
            entry.who |= {"date": row.get("date", ""), "load": row.get("load")}
            entry.who["cores"] = row.get("cores")
            entry.figures[records.key(row)] = row
    return list(by_machine.values())


def page(listed: Sequence[Entry]) -> str:
    """Return the page."""
    parts = [
        "<!doctype html>",
        '<html lang="en"><meta charset="utf-8"><title>clpt bench: results</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{STYLE}</style>",
        "<h1>clpt bench: results</h1>",
        "<p>Pictures by an OpenCL path tracer; each is verified by tiles against a reference. "
        "More is better. A wrong picture has no points.</p>",
    ]
    for size in SIZES:
        with_pictures = [
            entry for entry in listed if any(entry.picture(name, size) for name in PICTURES)
        ]
        if with_pictures:
            parts += _ranking(sorted(with_pictures, key=lambda entry: -entry.score(size)), size)
    return "\n".join([*parts, *_subscores(listed), *_faults(listed), "</html>\n"])


def _ranking(listed: Sequence[Entry], size: str) -> Iterator[str]:
    """Yield the table of points of a size, the best device first."""
    side, samples = SIZES[size].side, SIZES[size].samples
    yield f"<h2>Points, {size}: {side} x {side} pixels, {samples} samples</h2>"
    yield '<div class="wide"><table><tr><th>device</th><th>all</th>'
    yield "".join(f"<th>{name}</th>" for name in PICTURES) + "</tr>"
    most = {name: max(points(entry.picture(name, size)) for entry in listed) for name in PICTURES}
    for entry in listed:
        score = entry.score(size)
        wrong = any((row := entry.picture(n, size)) and row["value"] is None for n in PICTURES)
        none = '<span class="wrong">no score</span>' if wrong else ""
        cells = [f"<b>{score:,.0f}</b>" if score else none]
        cells += [_bar(entry, name, size, most[name]) for name in PICTURES]
        yield (
            f"<tr><td>{_who(entry)}</td>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
        )
    yield "</table></div>"


def _bar(entry: Entry, name: str, size: str, most: float) -> str:
    """Return a scene's points with a bar beside the best device's."""
    row = entry.picture(name, size)
    if row is None:
        return ""
    if row["value"] is None:
        return '<span class="wrong">wrong</span>'
    row_points = points(row)
    width = 100 * row_points / most if most else 0
    return f'{row_points:,.0f}<div class="bar" style="width:{width:.0f}%"></div>'


def _subscores(listed: Sequence[Entry]) -> Iterator[str]:
    """Yield the table of each device's strengths."""
    yield "<h2>What each is good at</h2>"
    yield '<div class="wide"><table><tr><th>device</th>'
    for name, (*_, meaning) in SUBSCORES.items():
        yield f'<th title="{escape(meaning)}">{name}</th>'
    yield "</tr>"
    for entry in listed:
        cells = []
        for *which, _ in SUBSCORES.values():
            row = entry.best(*which)
            unit = escape(str(row["unit"])) if row else ""
            shown = f'{_short(row["value"])} <span class="faint">{unit}</span>' if row else ""
            cells.append(f"<td>{shown}</td>")
        if any(cell != "<td></td>" for cell in cells):
            yield f"<tr><td>{_who(entry)}</td>{''.join(cells)}</tr>"
    yield "</table></div>"
    meanings = (f"{name}: {meaning}" for name, (*_, meaning) in SUBSCORES.items())
    yield f"<p>{escape('; '.join(meanings))}. Of several layouts of trees the best.</p>"


def _short(value: float) -> str:
    """Return three digits of a number, without an exponent."""
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def _faults(listed: Sequence[Entry]) -> Iterator[str]:
    """Yield the table of refused figures."""
    rows = [
        (entry, row) for entry in listed for row in entry.figures.values() if row.get("refused")
    ]
    yield "<h2>What was wrong</h2>"
    if not rows:
        yield "<p>Nothing.</p>"
        return
    yield '<div class="wide"><table><tr><th>device</th><th>figure</th>'
    yield '<th class="words">why</th></tr>'
    for entry, row in rows:
        scene = f" of {row['scene']}" if row.get("scene") else ""
        named = escape(f"{row['bench']}{scene}: {row['figure']}")
        why = f'<td class="words wrong">{escape(str(row["refused"]))}</td>'
        yield f"<tr><td>{_who(entry)}</td><td>{named}</td>{why}</tr>"
    yield "</table></div>"


def _who(entry: Entry) -> str:
    """Return a device's name, with driver, processor and version in small print."""
    who = entry.who
    more = [f"driver {who['driver']}", who["processor"], f"clpt {who['clpt']} {who['commit']}"]
    more.append(str(who["date"])[:10])
    busy = who["load"] is not None and who["cores"] and who["load"] > 1.5 * who["cores"]
    text = escape(", ".join(str(part).strip() for part in more))
    text += ', <span class="wrong">the machine did other work too</span>' if busy else ""
    return f'{escape(str(who["device"]))}<div class="faint">{text}</div>'


@click.command(help=__doc__)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="the page")
def main(files: Sequence[Path], output: Path) -> None:
    listed = entries(row for path in files for row in read(path))
    output_files.write_text(output, page(listed))
    click.echo(f"{output}  {len(listed)} devices and drivers")


if __name__ == "__main__":
    main()
