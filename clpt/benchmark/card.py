"""A card of the picture benchmark to post: an SVG of its points, and of what made them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape

from .figures import Figure
from .pictures import ALL, PART

WIDTH, MARGIN, ROW, HEAD, FOOT = 640, 28, 34, 132, 60  # [pixels]
NAMES, VALUES = 120, 96  # widths of the columns beside the bars [pixels]
PAPER, INK, FAINT, BAR, WRONG = "#fbfaf7", "#22252b", "#6c717c", "#2f6f9f", "#b3261e"
LONGEST = 58  # characters of a device's name


def card(about: Mapping[str, Any], figures: Sequence[Figure]) -> str:
    """Return the card of a device as the text of an SVG.

    about: what a record tells of the device and the circumstances, see clpt.benchmark.records.
    """
    own = [figure for figure in figures if figure.part == PART]
    scenes = [figure for figure in own if figure.name != ALL]
    total = next((figure for figure in own if figure.name == ALL), None)
    good = total is not None and bool(total.rounds) and not total.refused
    height = HEAD + ROW * len(scenes) + FOOT
    size = own[0].more["size"] if own else ""
    version = own[0].more["benchmark_version"] if own else ""
    label, driver = str(about.get("device", "")), str(about.get("driver", ""))
    label = label if len(label) <= LONGEST else label[: LONGEST - 1] + "…"
    points = f"{total.value:,.0f}" if good and total is not None else "no score"
    right = WIDTH - MARGIN
    lines = [
        _text(MARGIN, 42, label, 17, INK, "bold"),
        _text(MARGIN, 64, f"driver {driver}", 12, FAINT),
        _text(MARGIN, 108, points, 34, INK if good else WRONG, "bold"),
        _text(right, 108, f"clpt bench {version}, {size}", 13, FAINT, anchor="end"),
    ]
    most = max((_points(figure) for figure in scenes), default=0.0)
    for i, figure in enumerate(scenes):
        lines += _row(figure, HEAD + ROW * i, most)
    passed = sum(not figure.refused for figure in scenes)
    told = f"{passed} of {len(scenes)} pictures verified; "
    told += f"clpt {about.get('clpt', '')} {about.get('commit', '')}".rstrip()
    told += f", {str(about.get('date', ''))[:10]}"
    lines.append(_text(MARGIN, height - 24, told, 12, FAINT))
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" '
            f'viewBox="0 0 {WIDTH} {height}" font-family="sans-serif">',
            f'<rect width="{WIDTH}" height="{height}" rx="12" fill="{PAPER}"/>',
            *lines,
            "</svg>\n",
        ]
    )


def _points(figure: Figure) -> float:
    return 0.0 if figure.refused else float(figure.more["points"])


def _row(figure: Figure, top: int, most: float) -> list[str]:
    """Return a scene's name, bar and points; of a wrong one why it is refused."""
    left, base = MARGIN + NAMES, top + 18
    name = _text(MARGIN, base, figure.scene, 14, INK)
    if figure.refused:
        why = figure.refused.split(",")[0]
        return [name, _text(left, base, why, 13, WRONG)]
    points = _points(figure)
    length = (WIDTH - left - MARGIN - VALUES) * points / most if most else 0.0
    bar = f'<rect x="{left}" y="{top + 4}" width="{length:.1f}" height="18" rx="3" fill="{BAR}"/>'
    value = _text(WIDTH - MARGIN, base, f"{points:,.0f}", 14, INK, anchor="end")
    return [name, bar, value]


def _text(
    x: int, y: int, text: str, size: int, colour: str, weight: str = "normal", anchor: str = "start"
) -> str:
    return (
        f'<text x="{x}" y="{y}" font-size="{size}" fill="{colour}" font-weight="{weight}" '
        f'text-anchor="{anchor}">{escape(text)}</text>'
    )
