"""Figures of `clpt bench`, and their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ... import benchmark
from ... import device as dev
from ...benchmark import comparing, records, scenes
from ...benchmark.comparing import Ratio
from ...benchmark.figures import Figure
from ...choices import TREES
from ...device.context import trial
from ..printing.console import output_console
from .settings import STAGES, Report

SLOWER = 3  # the exit status if a figure was refused, or is below --fail-below
HEADINGS = ("figure", "", "unit", "±", "GB/s", "of a copy", "")


def tell_of_devices(device: str | None, settings: Mapping[str, Any], report: Report) -> int:
    """Measure the devices of a name, or all, and tell of them; return the exit status."""
    console = output_console()
    failed = [_report(console, info, settings, report) for info in _infos(device)]
    return SLOWER if any(failed) else 0


def _report(
    console: Console, info: dev.DeviceInfo, settings: Mapping[str, Any], report: Report
) -> bool:
    """Measure a device, and tell of it; return whether a figure is refused, or too low."""
    on = dev.Device.open(info, profiling=True)
    console.print(f"[bold]{info.label}[/], {info.version}, driver {info.driver}", highlight=False)
    figures = _measured(console, on, settings)
    failed = any(figure.refused for figure in figures)
    if report.target is not None:
        about = records.of_device(info)
        good = [figure for figure in figures if figure.rounds and not figure.refused]
        records.append(report.target, [{**figure.record(), **about} for figure in good])
    ratios = []
    if report.before is not None:
        ratios = comparing.against(figures, report.before, info.label)
        limit = report.fail_below
        _show_ratios(console, ratios, limit)
        failed |= limit is not None and any(ratio.below(limit) for ratio in ratios)
    if report.plot is not None:
        from ..plots import bench as bench_plot

        then = {figures.index(one.figure): float(one.then["value"]) for one in ratios}
        bench_plot.write(report.plot, f"{info.label}, clpt bench", figures, then)
    return failed


def _infos(device: str | None) -> list[dev.DeviceInfo]:
    if device != "all":
        return [dev.choose(device).info]
    return [info for info in dev.devices() if trial(info) is None]


def _measured(console: Console, on: dev.Device, settings: Mapping[str, Any]) -> list[Figure]:
    """Return all figures; print each table when it is complete."""
    figures: list[Figure] = []
    table = None
    with console.status("measuring") as status:
        for figure in benchmark.measure(on, **settings):
            if table is None or figure.part != figures[-1].part:
                if table is not None:
                    console.print(table)
                table = _table(figure)
            table.add_row(*_cells(figure), style="red" if figure.refused else "")
            figures.append(figure)
            status.update(f"{figure.part}: {figure.name}")
    if table is not None:
        console.print(table)
    return figures


def _table(figure: Figure) -> Table:
    title = " of ".join(filter(None, (figure.part, figure.scene)))
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for i, heading in enumerate(HEADINGS):
        table.add_column(heading, justify="right" if i in (1, 3, 4, 5) else "left")
    return table


def _cells(figure: Figure) -> list[str | Text]:
    more = figure.more
    note = f"refused: {figure.refused}" if figure.refused else str(more.get("note", ""))
    if not note and figure.part == "start":
        note = f"{more['programs']} programs in {more['build_seconds']:.2f} s"
        note += f", {more['memory'] / 2**20:.0f} MiB" if more["memory"] else ""
    bytes_ = (f"{more['gbytes']:.2f}", f"{more['of_copy']:.1%}") if "gbytes" in more else ("", "")
    return [
        figure.name,
        f"{figure.value:.3g}" if figure.rounds and figure.value < 1000 else f"{figure.value:.0f}",
        figure.unit,
        f"{figure.spread:.1%}" if len(figure.rounds) > 1 else "",
        *bytes_,
        Text(note),
    ]


def _show_ratios(console: Console, ratios: Sequence[Ratio], limit: float | None) -> None:
    then = ratios[0].then
    title = f"compared with {then.get('device', 'a record')}, {then.get('date', '')[:10]} "
    title += f"{then.get('commit') or then.get('clpt', '')}; above 1 is better now"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "now", "then", "unit", "ratio", "noise", ""):
        table.add_column(heading, justify="left" if heading in ("figure", "unit", "") else "right")
    for one in ratios:
        worse = limit is not None and one.below(limit)
        clear = abs(one.ratio - 1.0) > one.noise
        table.add_row(
            f"{one.figure.part} {one.figure.name}",
            f"{one.figure.value:.4g}",
            f"{one.then['value']:.4g}",
            one.figure.unit,
            f"{one.ratio:.2f}",
            f"{one.noise:.1%}",
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
