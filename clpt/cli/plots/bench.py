"""The plot of `clpt bench`, by matplotlib: a panel for each part, a bar for each figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Sheet
from matplotlib.lines import Line2D

from clpt.bench import PARTS
from clpt.bench.figures import SECONDS, Figure
from clpt.bench.pictures import POINTS

from ...errors import SceneError
from .pixels import FAINT, FORMATS, INK, LINES, PAPER, save

SPAN = 30.0  # ratio of stages' speeds above which the scale is logarithmic
BAR, HEAD = 0.25, 0.9  # [inches] of a figure, and of a panel's title and axis
COLOURS = (*LINES[2:3], *LINES[1:2], *LINES[3:])


def check(path: Path) -> None:
    """Raise SceneError for a file whose suffix is unknown."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a plot is written to {', '.join(FORMATS)}", file=path)


def write(path: Path, title: str, figures: Sequence[Figure], then: Mapping[int, float]) -> None:
    """Plot figures to a file.

    then: values to compare with, by the indices of figures. Raises SceneError if the file cannot be
    written.
    """
    check(path)
    good = [(i, figure) for i, figure in enumerate(figures) if figure.rounds and not figure.refused]
    measured = [(i, figure) for i, figure in good if figure.unit != POINTS]  # a unit a panel
    panels = {
        part: [(i, figure) for i, figure in measured if figure.part == part]
        for part in PARTS
        if any(figure.part == part for _, figure in measured)
    }
    if not panels:
        raise SceneError("there is no figure to plot", file=path)
    heights = [HEAD + BAR * len(rows) for rows in panels.values()]
    sheet = Sheet(figsize=(8.0, 0.5 + sum(heights)), dpi=120, facecolor=PAPER, layout="constrained")
    column = sheet.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (part, rows) in zip(column, panels.items(), strict=True):
        _panel(axes, part, rows, then)
    sheet.suptitle(title, x=0.012, ha="left", color=INK, weight="bold", size=11)
    if then:
        mark = Line2D([], [], color=INK, marker="|", linestyle="", markersize=10)
        sheet.legend(
            [mark], ["in the record compared with"], frameon=False, labelcolor=INK, fontsize=9,
            loc="outside lower right",
        )  # fmt: skip
    save(sheet, path)


def _panel(
    axes: Axes, part: str, rows: Sequence[tuple[int, Figure]], then: Mapping[int, float]
) -> None:
    values = [figure.value for _, figure in rows]
    shown = [*values, *(then[i] for i, _ in rows if i in then)]
    logarithmic = part == "stages" and max(shown) > SPAN * min(shown)
    kinds = list(dict.fromkeys(_kind(figure) for _, figure in rows))
    for row, (i, figure) in enumerate(rows):
        colour = COLOURS[kinds.index(_kind(figure)) % len(COLOURS)]
        axes.barh(row, figure.value, 0.72, color=colour)
        edge = figure.value * (1.0 + figure.spread)
        axes.plot([figure.value * (1.0 - min(figure.spread, 0.99)), edge], [row, row], color=INK)
        if i in then:
            axes.plot(then[i], row, marker="|", color=INK, markersize=11, markeredgewidth=2)
            edge = max(edge, then[i])
        text = f"{figure.value:.3g}"
        if "of_copy" in figure.more:
            text += f"   {figure.more['gbytes']:.2g} GB/s, {figure.more['of_copy']:.1%} of a copy"
        axes.annotate(
            text, (edge, row), (5, 0), textcoords="offset points", va="center", fontsize=8,
            color=INK,
        )  # fmt: skip
    low = min(shown) / 2 if logarithmic else 0.0
    axes.set_xscale("log" if logarithmic else "linear")
    axes.set_xlim(low, max(shown) * (30.0 if logarithmic else 1.25))
    axes.set_yticks(range(len(rows)), [figure.name for _, figure in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    scene = rows[0][1].scene if len({figure.scene for _, figure in rows}) == 1 else ""
    axes.set_title(f"{part}{' of ' if scene else ''}{scene}", loc="left", size=10, color=INK)
    unit = rows[0][1].unit
    axes.set_xlabel(f"{unit}, less is better" if unit == SECONDS else unit, color=INK, size=9)
    axes.grid(axis="x", color=FAINT, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8, length=0, which="both")
    for name, side in axes.spines.items():
        side.set_visible(name == "left")
        side.set_color(INK)


def _kind(figure: Figure) -> str:
    """Return the layout, which decides a figure's colour in its panel."""
    return str(figure.more.get("layout", "")) if figure.part in ("rays", "build") else ""
