"""What a GPU is expected to do beside what it did: a section of bench/results/gpus.md.

Measured are the lines of `bench.first_hour` in bench/results/first_hour*.jsonl. Expected figures
follow from the H100's of 2026-11-26, by what has changed since; bench/notes tell how.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.hour_steps import Row

RESULTS = Path(__file__).parent / "results"
PAGE = RESULTS / "gpus.md"
HEADING = "## Expected, and measured"
NOT_YET = "*not measured yet*"


@dataclass(frozen=True)
class Expected:
    """A figure: its unit, what an H100 did before, what it is to do, and what is expected.

    step, key: of the lines of `bench.first_hour`.
    """

    name: str
    unit: str
    before: str
    aim: str
    expected: str
    step: str
    key: str


ALL = (
    Expected("trees, 309,472 triangles, `wide8`", "Mtri/s", ".6 to .8", "100", "150",
             "trees", "wide8 1, from the leaves up"),
    Expected("trees, 309,472 triangles, `compact`", "Mtri/s", ".6 to .8", "100", "150",
             "trees", "compact 1, from the leaves up"),
    Expected("trees, 9.9 million triangles, `wide8`", "Mtri/s", ".7", "100", "700",
             "trees", "wide8 32, from the leaves up"),
    Expected("closest hit, primary rays, `wide8`", "Mrays/s", "2,879", "4,000", "3,200",
             "rays", "wide8: wide8 primary closest"),
    Expected("closest hit, diffuse rays, `wide8`", "Mrays/s", "1,038", "2,000", "1,300",
             "rays", "wide8: wide8 diffuse closest"),
    Expected("any hit, primary rays, `wide8`", "Mrays/s", "6,476", "10,000", "7,000",
             "rays", "wide8: wide8 primary any"),
    Expected("any hit, diffuse rays, `wide8`", "Mrays/s", "2,305", "4,000", "2,600",
             "rays", "wide8: wide8 diffuse any"),
    Expected("any hit, diffuse rays, `compact`", "Mrays/s", "508", "", "2,000",
             "rays", "compact: compact diffuse any"),
    Expected("Cornell box, `generate`", "Mitems/s", "620 (atrium)", "2,600", "1,500",
             "stages", "cornell: generate"),
    Expected("Cornell box, rendered", "Msamples/s", "189", "400", "270",
             "registers", "cornell, limited"),
    Expected("the same without limits of registers", "Msamples/s", "189", "", "250",
             "registers", "cornell, free"),
    Expected("atrium, closest hits of paths in their slots", "Mrays/s", "1,210", "", "1,500",
             "sorting", "atrium, in their slots"),
    Expected("the same, sorted, with the sort", "Mrays/s", "", "", "1,450",
             "sorting", "atrium, sorted"),
    Expected("pool, closest hits of paths in their slots", "Mrays/s", "", "", "",
             "sorting", "scenes/pool, in their slots"),
    Expected("the same, sorted, with the sort", "Mrays/s", "", "", "1.1 of that",
             "sorting", "scenes/pool, sorted"),
    Expected("a step of a sample at 1280x720, enqueued", "ms", "", ".3", "",
             "host", "cornell, enqueued"),
    Expected("first picture with new programs", "s", "2.7 to 3.5", "1.5", "3",
             "starting", "cornell: cold start"),
)  # fmt: skip


def lines(files: Sequence[Path]) -> list[Row]:
    """Return the lines of files of `bench.first_hour`."""
    return [json.loads(line) for file in files for line in file.read_text("utf-8").splitlines()]


def section(rows: Sequence[Row]) -> str:
    """Return the section; the last line of a figure counts."""
    devices = list(dict.fromkeys(str(row["device"]) for row in rows))
    last = {(row["device"], row["step"], row["figure"]): row for row in rows}
    heads = [
        "",
        "unit",
        "H100, 2026-11-26",
        "aim",
        "expected of an H100",
        *(devices or ["measured"]),
    ]
    table = [heads, ["---"] * len(heads)]
    for figure in ALL:
        values = [figure.name, figure.unit, figure.before, figure.aim, figure.expected]
        values += [_cell(last.get((name, figure.step, figure.key))) for name in devices or [""]]
        table.append(values)
    text = f"{HEADING}\n\n`python -m bench.report` makes this table from the lines of "
    text += "`python -m bench.first_hour`.\n\n"
    text += "\n".join(f"| {' | '.join(values)} |" for values in table) + "\n"
    return text + _wrong(rows)


def _cell(row: Row | None) -> str:
    if row is None:
        return NOT_YET
    value = row["value"]
    return f"refused: {row['refused']}" if "refused" in row else f"{value:.4g}"


def _wrong(rows: Sequence[Row]) -> str:
    """Return what went wrong, a list item each."""
    last = {(row["device"], row["step"], row["part"], row["figure"]): row for row in rows}
    items = []
    for (device, step, part, _), row in last.items():
        if row.get("wrong"):
            items.append(f"- {device}: {step}, {part}: {row['says']}")
        elif row.get("ended", "well") != "well":
            items.append(f"- {device}: {step}, {part}: {row['ended']}")
    return "\n".join(["", "Wrong, or not ended:", "", *items, ""]) if items else ""


def write(page: Path = PAGE, results: Path = RESULTS) -> None:
    """Write the section in place of the page's own, or at its end."""
    text = page.read_text("utf-8")
    before, _, after = text.partition(HEADING)
    following = after.find("\n## ")
    others = after[following:] if following >= 0 else ""
    new = section(lines(sorted(results.glob("first_hour*.jsonl"))))
    page.write_text(f"{before.rstrip()}\n\n{new}{others}", "utf-8")
