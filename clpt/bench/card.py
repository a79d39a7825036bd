"""A card with the points of the picture benchmark and its device, as SVG or PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from clpt.bench.figures import Figure
from clpt.bench.pictures import ALL, PART
from clpt.files import output_files

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

WIDTH, MARGIN, ROW, HEAD, FOOT = 640, 28, 34, 132, 60  # [pixels]
NAMES, VALUES = 120, 96  # widths of the columns beside the bars [pixels]
PAPER, INK, FAINT, BAR, WRONG = "#fbfaf7", "#22252b", "#6c717c", "#2f6f9f", "#b3261e"
LONGEST = 58  # characters of a device's name
FORMATS = (".svg", ".png")
SCALE = 2  # pixels of the PNG over the SVG


@dataclass(frozen=True)
class Text:
    """Words with their left or, if `right`, their right end on a line at (x, y)."""

    x: int
    y: int
    words: str
    size: int
    colour: str
    bold: bool = False
    right: bool = False

    def svg(self) -> str:
        """Return the element of an SVG."""
        return (
            f'<text x="{self.x}" y="{self.y}" font-size="{self.size}" fill="{self.colour}" '
            f'font-weight="{"bold" if self.bold else "normal"}" '
            f'text-anchor="{"end" if self.right else "start"}">{escape(self.words)}</text>'
        )

    def draw(self, drawing: ImageDraw) -> None:
        """Draw the words on the PNG."""
        from PIL import ImageFont  # here: slow

        at, anchor = (SCALE * self.x, SCALE * self.y), "rs" if self.right else "ls"
        font = ImageFont.load_default(SCALE * self.size)
        drawing.text(at, self.words, self.colour, font, anchor, stroke_width=int(self.bold))


@dataclass(frozen=True)
class Bar:
    """A bar, as long as the points of a scene."""

    x: int
    y: int
    length: float
    height: int = 18

    def svg(self) -> str:
        """Return the element of an SVG."""
        return (
            f'<rect x="{self.x}" y="{self.y}" width="{self.length:.1f}" height="{self.height}" '
            f'rx="3" fill="{BAR}"/>'
        )

    def draw(self, drawing: ImageDraw) -> None:
        """Draw the bar on the PNG."""
        left, top = SCALE * self.x, SCALE * self.y
        corners = (left, top, left + SCALE * self.length, top + SCALE * self.height)
        drawing.rounded_rectangle(corners, min(6.0, SCALE * self.length / 2), BAR)


@dataclass(frozen=True)
class Card:
    """A card of a height, with its elements."""

    height: int
    drawn: Sequence[Text | Bar]

    def svg(self) -> str:
        """Return the card as the text of an SVG."""
        lines = [element.svg() for element in self.drawn]
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{self.height}" '
                f'viewBox="0 0 {WIDTH} {self.height}" font-family="sans-serif">',
                f'<rect width="{WIDTH}" height="{self.height}" rx="12" fill="{PAPER}"/>',
                *lines,
                "</svg>\n",
            ]
        )

    def png(self) -> bytes:
        """Return the card as a PNG of twice the size, in Pillow's font."""
        from PIL import Image, ImageDraw  # here: slow

        image = Image.new("RGBA", (SCALE * WIDTH, SCALE * self.height))
        draw = ImageDraw.Draw(image)
        whole = (0, 0, SCALE * WIDTH - 1, SCALE * self.height - 1)
        draw.rounded_rectangle(whole, SCALE * 12, PAPER)
        for element in self.drawn:
            element.draw(draw)
        content = io.BytesIO()
        image.save(content, "PNG")
        return content.getvalue()

    def write(self, path: Path) -> None:
        """Write the card in the format of the file's name, of FORMATS. Raises OSError."""
        if path.suffix.lower() == ".png":
            output_files.write(path, self.png())
        else:
            output_files.write_text(path, self.svg())


def card(about: Mapping[str, Any], figures: Sequence[Figure]) -> Card:
    """Return the card of a device.

    about: a record's description of device and circumstances, see clpt.bench.records.
    """
    points_figures = [figure for figure in figures if figure.part == PART]
    scenes = [figure for figure in points_figures if figure.name != ALL]
    total = next((figure for figure in points_figures if figure.name == ALL), None)
    good = total is not None and bool(total.rounds) and not total.refused
    height = HEAD + ROW * len(scenes) + FOOT
    more = points_figures[0].more if points_figures else {"size": "", "benchmark_version": ""}
    size, version = more["size"], more["benchmark_version"]
    label, driver = str(about.get("device", "")), str(about.get("driver", ""))
    label = label if len(label) <= LONGEST else label[: LONGEST - 1] + "…"
    points = f"{total.value:,.0f}" if good and total is not None else "no score"
    right = WIDTH - MARGIN
    drawn: list[Text | Bar] = [
        Text(MARGIN, 42, label, 17, INK, bold=True),
        Text(MARGIN, 64, f"driver {driver}", 12, FAINT),
        Text(MARGIN, 108, points, 34, INK if good else WRONG, bold=True),
        Text(right, 108, f"clpt bench {version}, {size}", 13, FAINT, right=True),
    ]
    most = max((_points(figure) for figure in scenes), default=0.0)
    for i, figure in enumerate(scenes):
        drawn += _row(figure, HEAD + ROW * i, most)
    passed = sum(not figure.refused for figure in scenes)
    summary = f"{passed} of {len(scenes)} pictures verified; "
    summary += f"clpt {about.get('clpt', '')} {about.get('commit', '')}".rstrip()
    summary += f", {str(about.get('date', ''))[:10]}"
    drawn.append(Text(MARGIN, height - 24, summary, 12, FAINT))
    return Card(height, drawn)


def _points(figure: Figure) -> float:
    return 0.0 if figure.refused else float(figure.more["points"])


def _row(figure: Figure, top: int, most: float) -> list[Text | Bar]:
    """Return a scene's name, bar and points, or the complaint on its picture."""
    left, base = MARGIN + NAMES, top + 18
    name = Text(MARGIN, base, figure.scene, 14, INK)
    if figure.refused:
        return [name, Text(left, base, figure.refused.split(",")[0], 13, WRONG)]
    points = _points(figure)
    length = (WIDTH - left - MARGIN - VALUES) * points / most if most else 0.0
    value = Text(WIDTH - MARGIN, base, f"{points:,.0f}", 14, INK, right=True)
    return [name, Bar(left, top + 4, length), value]
