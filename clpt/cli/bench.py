"""`clpt bench`: how fast rays, stages, builds and starts are on a device, and beside a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from .. import benchmark
from .. import device as dev
from ..benchmark import comparing, records, scenes
from ..benchmark.comparing import Ratio
from ..benchmark.figures import Figure
from ..bvh import TREES
from ..device.context import trial
from .options.records import with_records
from .printing.console import output_console
from .process.extras import extra

SLOWER = 3  # the exit status if a figure was refused, or is below --fail-below
STAGES = (
    "generate", "emit", "intersect", "mix", "shade", "shadow", "splat", "append", "accumulate",
)  # fmt: skip
HEADINGS = ("figure", "", "unit", "±", "GB/s", "of a copy", "")


@dataclass(frozen=True)
class Subject:
    """Things to measure, and how often: see `clpt.benchmark.measure`."""

    scene: str | None
    stages: tuple[str, ...]
    layouts: tuple[str, ...]
    mode: str | None
    rounds: int
    count: int | None

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `clpt.benchmark.measure`. Raises click.BadParameter."""
        parts, only, kinds = _chosen(self.stages)
        return {
            "parts": parts, "only": only, "kinds": kinds, "scene": self.scene,
            "layouts": self.layouts or TREES, "mode": self.mode, "rounds": self.rounds,
            "count": self.count,
        }  # fmt: skip


@dataclass(frozen=True)
class Report:
    """Files that get figures, and a record to compare them with."""

    target: Path | None
    record: Path | None
    fail_below: float | None
    plot: Path | None

    def check(self) -> None:
        """Raise what is wrong with a file, before anything is measured."""
        if self.fail_below is not None and self.record is None:
            raise click.UsageError("--fail-below compares: give --compare FILE too")
        if self.plot is not None:
            with extra("plot", "a plot"):
                from .plots import bench as bench_plot  # here: matplotlib is an extra, and slow

            bench_plot.check(self.plot)
        _ = self.before

    @cached_property
    def before(self) -> list[dict[str, Any]] | None:
        """The figures of the record."""
        return None if self.record is None else records.read(self.record)


@click.command()
@click.option("--scene", help="A scene's file or folder, or atrium or cornell, made from formulas.")
@click.option(
    "--stage", "stages", multiple=True, metavar="NAME",
    help="What to measure: see --list; repeat it for several.  [default: all but shading]",
)  # fmt: skip
@click.option("--layout", "layouts", multiple=True, type=click.Choice(TREES), help="Of the trees.")
@click.option("--mode", type=click.Choice(["spectral", "rgb"]), help="What light is made of.")
@click.option("--device", help="Index or part of the name of a device, or all.")
@click.option(
    "--rounds", type=click.IntRange(1), default=5, show_default=True, help="Of each figure."
)
@click.option("--count", type=click.IntRange(64), help="Rays of a set.")
@click.option(
    "--json", "target", type=click.Path(path_type=Path), help="Append JSON lines to a file."
)
@click.option(
    "--compare", "record", type=click.Path(path_type=Path),
    help="JSON lines to compare with, earlier ones or of another device.",
)  # fmt: skip
@click.option(
    "--fail-below", type=float, metavar="RATIO",
    help="With --compare: exit with 3 if a figure is below this ratio, beyond noise.",
)  # fmt: skip
@click.option(
    "--plot", "plot", type=click.Path(path_type=Path),
    help="Plot the figures to a .png, .svg or .pdf; of several devices the last one's.",
)  # fmt: skip
@click.option("--list", "list_all", is_flag=True, help="List what can be measured, and where.")
@with_records(subject=Subject, report=Report)
def bench(subject: Subject, report: Report, device: str | None, list_all: bool) -> int:
    """Measure rays, stages of rendering, builds and starts of an OpenCL device.

    Figures are medians of rounds; ± is half the distance of their quartiles. A result that cannot
    be true (rays not traced, wrong hits, times below what memory allows)
    is refused: it is not recorded, and the exit status is 3.
    """
    console = output_console()
    if list_all:
        _list(console)
        return 0
    report.check()
    settings = subject.settings()
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
        from .plots import bench as bench_plot

        then = {figures.index(one.figure): float(one.then["value"]) for one in ratios}
        bench_plot.write(report.plot, f"{info.label}, clpt bench", figures, then)
    return failed


def _chosen(names: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Return parts, and stages and kinds of material if not all. Raises click.BadParameter."""
    parts: list[str] = []
    only: list[str] = []
    kinds: list[str] = []
    for name in names:
        if name in benchmark.PARTS:
            parts.append(name)
        elif name.startswith("shading_"):
            kinds.append(name.removeprefix("shading_"))
        elif name.split("_")[0] in STAGES:
            only.append(name)
        else:
            known = ", ".join([*benchmark.PARTS, *STAGES])
            raise click.BadParameter(f"{name!r} is none of {known}", param_hint="--stage")
    for part, chosen in (("stages", only), ("shading", kinds)):
        if chosen and part not in parts:
            parts.append(part)
    return parts or list(benchmark.DEFAULT_PARTS), only, kinds


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


def _list(console: Console) -> None:
    """Print what --stage, --scene, --layout and --device accept."""
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
