"""Images that are inspected, as JSON and as tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.table import Table

from ..printing.console import output_console, shown
from .image_contents import ImageContents, Pixel


def as_json(image: ImageContents, values: dict[Pixel, np.ndarray]) -> dict[str, Any]:
    """Return an image and the values of its pixels as JSON."""
    lambdas = {"wavelengths": image.lambdas.tolist()} if image.lambdas is not None else {}
    pixels = [{"at": pixel, "values": row.tolist()} for pixel, row in values.items()]
    return {**image.facts, "channels": image.labels, **lambdas, "pixels": pixels}


def print_tables(image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    """Print what an image is, and the values of its pixels."""
    console = output_console()
    console.print(shown(image.path))
    facts = Table(show_header=False)
    for name, value in image.facts.items():
        facts.add_row(shown(name), shown(value))
    console.print(facts)
    if not values:
        return
    console.print(shown(image.quantity))
    numbers = Table()
    numbers.add_column("wavelength" if image.lambdas is not None else "channel", justify="right")
    for x, y in values:
        numbers.add_column(f"{x},{y}", justify="right")
    for i, label in enumerate(image.labels):
        numbers.add_row(shown(label), *(f"{row[i]:.5g}" for row in values.values()))
    if image.colours is not None:
        names = [image.hex_colour(pixel) for pixel in values]
        numbers.add_section()
        numbers.add_row("sRGB", *(f"[on {name}]   [/] {name}" for name in names))
    console.print(numbers)
