"""Figures of `clpt bench`, and their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from clpt import bench as benchmark
from clpt.bench import apart, card, first_light, records, scenes
from clpt.bench.figures import Figure
from clpt.bench.records import Ratio
from clpt.files import output_files

from ... import device as dev
from ...choices import TREES
from ..console import output_console
from .settings import STAGES, Report, check_writable

Which = tuple[str | int | None, str | None]  # see clpt.bench.apart.measured
SLOWER = 3  # the exit status if a figure was refused, or is below --fail-below
HEADINGS = ("figure", "", "unit", "±", "GB/s", "of a copy", "")
WRONG = 3  # the exit status if a check is wrong
LONGEST = 300.0  # seconds that a check may take without a figure, whatever --limit says


def tell_of_devices(device: str | None, settings: Mapping[str, Any], report: Report) -> int:
    """Measure a device or all devices, and print the figures; return the exit status."""
    console = output_console()
    which: list[Which] = [(device, None)]
    if device == "all":
        which = [(info.index, info.label) for info in dev.devices()]
    failed = [_report(console, choice, settings, report) for choice in which]
    return SLOWER if any(failed) else 0


def _report(console: Console, which: Which, settings: Mapping[str, Any], report: Report) -> bool:
    """Measure a device and report; return whether a figure is refused or too low."""
    about, figures = _measured(console, which, settings, report.limit)
    failed = any(figure.refused for figure in figures)
    if report.target is not None:
        known = [figure for figure in figures if figure.rounds or figure.refused]
        records.append(report.target, [{**figure.record(), **about} for figure in known])
    ratios = []
    label = str(about["device"])
    some = any(figure.rounds and not figure.refused for figure in figures)
    if report.before is not None and some:
        ratios = records.against(figures, report.before, label)
        limit = report.fail_below
        _show_ratios(console, ratios, limit)
        failed |= limit is not None and any(ratio.below(limit) for ratio in ratios)
    if report.plot is not None and some:
        from .. import plots

        then = {figures.index(r.figure): float(r.then["value"]) for r in ratios}
        plots.plot_figures(report.plot, f"{label}, clpt bench", figures, then)
    if report.card is not None:
        card.card({**records.circumstances(), **about}, figures).write(report.card)
    return failed


def _measured(
    console: Console, which: Which, settings: Mapping[str, Any], limit: float
) -> tuple[apart.About, list[Figure]]:
    """Return the device's description and all figures; print each complete table."""
    figures: list[Figure] = []
    about: apart.About = {"device": which[1] or which[0] or "the default device"}
    table = None
    with console.status("measuring") as status:
        for about, figure in apart.measured(*which, settings, limit):
            if table is None or figure.part != figures[-1].part:
                console.print(_heading(about) if table is None else table)
                table = _table(figure)
            table.add_row(*_cells(figure), style="red" if figure.refused else "")
            figures.append(figure)
            status.update(f"{figure.part}: {figure.name}")
    if table is not None:
        console.print(table)
    return about, figures


def _heading(about: apart.About) -> Text:
    more = [about["opencl"], f"driver {about['driver']}"] if "opencl" in about else []
    return Text(", ".join([str(about["device"]), *more]), style="bold")


def _table(figure: Figure) -> Table:
    title = " of ".join(filter(None, (figure.part, figure.scene)))
    if figure.part == "pictures":  # each row has another scene
        title = f"pictures, {figure.more['size']}"
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for i, heading in enumerate(HEADINGS):
        table.add_column(heading, justify="right" if i in (1, 3, 4, 5) else "left")
    return table


def _cells(figure: Figure) -> list[str | Text]:
    more = figure.more
    note = figure.refused or str(more.get("note", ""))
    if figure.refused and not note.startswith("wrong"):
        note = f"refused: {note}"
    if not note and figure.part == "pictures" and "points" in more:
        note = f"{more['points']:,.0f} points; verified"
        note += ", to the bit" if more["exact"] else ""
    if not note and figure.part == "start":
        note = f"{more['programs']} programs in {more['build_seconds']:.2f} s"
        note += f", {more['memory'] / 2**20:.0f} MiB" if more["memory"] else ""
    bytes_ = (f"{more['gbytes']:.2f}", f"{more['of_copy']:.1%}") if "gbytes" in more else ("", "")
    return [
        figure.name,
        _shown(figure),
        figure.unit,
        f"{figure.spread:.1%}" if len(figure.rounds) > 1 else "",
        *bytes_,
        Text(note),
    ]


def _shown(figure: Figure) -> str:
    """Return a figure's value as text, "" without a value."""
    if not figure.rounds or (figure.refused and figure.part == "pictures"):
        return ""
    return f"{figure.value:.3g}" if figure.value < 1000 else f"{figure.value:.0f}"


def _show_ratios(console: Console, ratios: Sequence[Ratio], limit: float | None) -> None:
    then = ratios[0].then
    title = f"compared with {then.get('device', 'a record')}, {then.get('date', '')[:10]} "
    title += f"{then.get('commit') or then.get('clpt', '')}; above 1 is better now"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "now", "then", "unit", "ratio", "noise", ""):
        table.add_column(heading, justify="left" if heading in ("figure", "unit", "") else "right")
    for ratio in ratios:
        figure = ratio.figure
        worse = limit is not None and ratio.below(limit)
        clear = abs(ratio.ratio - 1.0) > ratio.noise
        table.add_row(
            f"{figure.part} {figure.name}",
            f"{figure.value:.4g}",
            f"{ratio.then['value']:.4g}",
            figure.unit,
            f"{ratio.ratio:.2f}",
            f"{ratio.noise:.1%}",
            f"below {limit:g}" if worse else "" if clear else "within noise",
            style="red" if worse else "",
        )
    console.print(table)


def show_list() -> None:
    """Print what --stage, --scene, --layout and --device accept."""
    console = output_console()
    rows = {
        **benchmark.PARTS,
        "a stage": "of `stages` alone: " + ", ".join(STAGES),
        "shading_KIND": "of `shading` that kind of material alone, as shading_diffuse",
    }
    for heading, names in (
        ("--stage", rows),
        ("--scene", {name: make.__doc__ for name, make in scenes.SCENES.items()}),
        ("--layout", dict.fromkeys(TREES, "")),
        ("--device", {str(info.index): info.label for info in dev.devices()}),
    ):
        table = Table(heading, "", box=None, pad_edge=False, title_justify="left")
        for name, meaning in names.items():
            table.add_row(name, meaning)
        console.print(table)


def tell_of_first_light(device: str | None, target: Path, limit: float) -> int:
    """Run all checks, print a row of each, write the report; return the exit status."""
    check_writable(target)
    console = output_console()
    checks = first_light.checks()
    results: list[first_light.Result] = []
    with console.status("checking") as status:
        status.update(checks[0].name)
        for result in first_light.run(device, min(limit, LONGEST), checks):
            results.append(result)
            row = f"{result.check.name:18} {result.seconds:4.0f} s  {result.summary}"
            console.print(Text(row, style="red" if result.wrong else ""))
            if len(results) < len(checks):
                status.update(checks[len(results)].name)
    output_files.write_text(target, first_light.report(results, len(checks)))
    console.print(Text(f"{target} tells what to report, and to whom"))
    return WRONG if any(result.wrong for result in results) else 0
