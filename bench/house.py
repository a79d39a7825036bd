"""The house in figures: how long, wide and tangled the code is, read from the files.

    python -m bench.house              a table
    python -m bench.house --where      with the places that are over a limit, the worst first
    python -m bench.house --json
    python -m bench.house --bounds     the table of tests/test_house.py, where figures may only fall

No device is needed. Of clpt only `clpt kernels` runs, and the table of flags is counted.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import click
from click.testing import CliRunner

from bench import imports, kernel_files, python_files, walks
from bench.imports import ROOT

LINES, LONG = 40, 60  # of a function: what it may have, and what it must not
PARAMETERS = 8
CORNELL = "scenes/cornell_box"
SIZES = ("lines of Python", "lines of OpenCL")
SPARE = 100  # lines that a small correction may add


@dataclass(frozen=True)
class Figure:
    """A figure, and the places that it comes from, the worst first: ("file:line name", value)."""

    name: str
    value: int
    where: tuple[str, ...] = ()


def figures(root: Path = ROOT) -> list[Figure]:
    """Measure a checkout."""
    return [figure for measure in MEASURES for figure in measure(root)]


def functions(root: Path) -> Iterator[Figure]:
    """Functions of the package that are long, or ask for much."""
    lines, parameters = [], []
    for place, file in _python(root):
        for function in file.functions:
            where = f"{place}:{function.line} {function.name}"
            lines.append((function.lines, where))
            parameters.append((function.parameters, where))
    yield _over(f"functions over {LONG} lines", lines, LONG)
    yield _over(f"functions over {LINES} lines", lines, LINES)
    yield _most("lines of the longest function", lines)
    yield _over(f"functions with {PARAMETERS} or more parameters", parameters, PARAMETERS - 1)
    yield _most("parameters of a function, most", parameters)


def kernels(root: Path) -> Iterator[Figure]:
    """Conditions of kernel files, and functions that are long."""
    conditions, lines, inside = [], [], []
    for path in sorted((root / "kernels").rglob("*.cl")):
        place = path.relative_to(root).as_posix()
        conditions.append((kernel_files.conditions(path.read_text(encoding="utf-8")), place))
        for function in kernel_files.functions(path):
            where = f"{place}:{function.line} {function.name}"
            lines.append((function.lines, where))
            inside.append((function.conditions, where))
    yield _sum("#if, #ifdef, #ifndef and #elif in kernels", conditions)
    yield _most("lines of the longest kernel function", lines)
    yield _most("#if of a kernel function, most", inside)
    yield _over(f"kernel functions over {LONG} lines", lines, LONG)


def features(root: Path) -> Iterator[Figure]:
    """What the compiled text of a scene depends on."""
    from clpt.render.flow import flags

    yield Figure("compile-time flags of a scene", len(flags.SCENE))
    records = [
        (count, f"{place} {name}")
        for place, file in _python(root)
        if re.search(r"^clpt/render/records/\w+\.py$", place)
        for name, count in file.fields.items()
    ]
    yield _most("fields of a record of features, most", records)


def types(root: Path) -> Iterator[Figure]:
    """What a type checker cannot see, and types that are told again."""
    files = list(_python(root))
    for name, pattern in (("getattr(", r"getattr\("), (": Any", r": Any\b")):
        yield _sum(name, ((len(re.findall(pattern, file.text)), place) for place, file in files))
    aliases = [
        (1, f"{place}:{file.line_of(match.start())} {match[1]}")
        for place, file in files
        for match in python_files.ARRAY.finditer(file.text)
        if place != "clpt/arrays.py"
    ]
    yield _sum("aliases of array types outside clpt/arrays.py", aliases)


def sizes(root: Path) -> Iterator[Figure]:
    """Lines and words."""
    yield _sum(SIZES[0], ((_lines(f.text), place) for place, f in _python(root)))
    texts = {path: path.read_text(encoding="utf-8") for path in (root / "kernels").rglob("*.cl")}
    yield _sum(SIZES[1], ((_lines(t), str(p.relative_to(root))) for p, t in texts.items()))
    yield Figure("words of README.md", len((root / "README.md").read_text("utf-8").split()))


def circles(root: Path) -> Iterator[Figure]:
    """Yield rooms in circles of imports; see bench.imports.rooms."""
    circles_of_rooms = [
        (len(circle), ", ".join(circle))
        for links in imports.rooms(root).values()
        for circle in imports.circles(links)
    ]
    yield _sum("rooms in circles of imports", circles_of_rooms)


def ways(root: Path) -> Iterator[Figure]:
    """Functions that see a whole scene between `clpt.render` and the tables; see bench.walks."""
    stays = walks.stays(root)
    yield Figure("stays of a scene from render() to the tables", len(stays), tuple(stays))
    rooms = tuple(dict.fromkeys(place.partition(" ")[0] for place in stays))
    yield Figure("rooms of these stays", len(rooms), rooms)


def words(root: Path) -> Iterator[Figure]:
    """Docstrings that cannot be understood alone."""
    dependent = [
        (1, f"{place}:{docstring.line} {docstring.name}: {docstring.text.splitlines()[0]}")
        for place, file in _python(root)
        for docstring in file.docstrings
        if python_files.DEPENDENT.match(docstring.text)
    ]
    yield _sum("docstrings that begin with What, Of, How, Those, The same", dependent)


def programs(root: Path) -> Iterator[Figure]:
    """Lines of the programs of Cornell's box that people are told to read."""
    from clpt.cli import cli

    with tempfile.TemporaryDirectory() as folder:
        asked = ["kernels", str(root / CORNELL), "-o", folder]
        CliRunner().invoke(cli, asked, catch_exceptions=False)
        for name in ("accumulate", "shade_diffuse"):
            text = (Path(folder) / f"{name}.cl").read_text(encoding="utf-8")
            yield Figure(f"lines of {name} of Cornell's box", _lines(text))


MEASURES: tuple[Callable[[Path], Iterator[Figure]], ...] = (
    functions, kernels, features, types, circles, ways, sizes, words, programs,
)  # fmt: skip

Counted = Iterable[tuple[int, str]]


def _python(root: Path) -> Iterator[tuple[str, python_files.PythonFile]]:
    """The files of the package by their paths."""
    for path in sorted((root / "clpt").rglob("*.py")):
        yield path.relative_to(root).as_posix(), python_files.read(path, root)


def _lines(text: str) -> int:
    return len(text.splitlines())


def _listed(counted: Counted) -> tuple[str, ...]:
    """The places that count, the worst first, each with its figure where they differ."""
    ordered = sorted((entry for entry in counted if entry[0]), key=lambda entry: -entry[0])
    alike = len({count for count, _ in ordered}) == 1
    return tuple(where if alike else f"{where}: {count}" for count, where in ordered)


def _over(name: str, counted: Counted, limit: int) -> Figure:
    """How many are over a limit."""
    places = _listed(entry for entry in counted if entry[0] > limit)
    return Figure(name, len(places), places)


def _most(name: str, counted: Counted) -> Figure:
    """The largest of some."""
    counts = list(counted)
    return Figure(name, max((count for count, _ in counts), default=0), _listed(counts)[:10])


def _sum(name: str, counted: Counted) -> Figure:
    """The sum of some."""
    counts = list(counted)
    return Figure(name, sum(count for count, _ in counts), _listed(counts))


@click.command()
@click.option("--where", is_flag=True, help="Print the places too, the worst first.")
@click.option("--json", "as_json", is_flag=True, help="Print one line of JSON.")
@click.option("--bounds", is_flag=True, help="Print the table of tests/test_house.py.")
def main(where: bool, as_json: bool, bounds: bool) -> None:
    """Measure this checkout."""
    measured = figures()
    if as_json:
        click.echo(json.dumps({figure.name: figure.value for figure in measured}))
        return
    for figure in measured:
        if bounds:
            rounded = -(-figure.value // SPARE) * SPARE if figure.name in SIZES else figure.value
            click.echo(f'    "{figure.name}": {rounded:_},')
            continue
        click.echo(f"{figure.value:>8,}  {figure.name}")
        for place in figure.where if where else ():
            click.echo(f"{'':>10}{place}")


if __name__ == "__main__":
    main()
