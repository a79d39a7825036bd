"""`clpt inspect`: what an image file holds, and the spectra of its pixels as numbers and a plot."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from .. import images, spectral_exr
from ..errors import SceneError

Place = tuple[int, int]
LETTERS = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}


class Pixel(click.ParamType):
    """X,Y in pixels."""

    name = "X,Y"

    def convert(self, value: Any, param: Any, ctx: Any) -> Place:
        found = re.fullmatch(r"(\d{1,9}),(\d{1,9})", str(value).replace(" ", ""))
        if not found:
            self.fail(f"{value!r} does not look like 120,80", param, ctx)
        return int(found[1]), int(found[2])


@dataclass(frozen=True)
class Opened:
    """An image as it is inspected.

    values: (h, w, n); labels: a wavelength or a channel's name per value; lambdas: (n,) [nm], None
    where the image is not spectral; colours: (h, w, 3) linear Rec. 709, None where it has none;
    quantity: what the values are, with their unit; facts: what else is told of the file.
    """

    path: Path
    values: np.ndarray
    labels: tuple[str, ...]
    lambdas: np.ndarray | None
    colours: np.ndarray | None
    quantity: str
    stats: dict[str, str]


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--at", "places", multiple=True, type=Pixel(), metavar="X,Y",
    help="A pixel, counted from 0,0 at the top left; may be given again.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="The plot, .png, .svg or .pdf; FILE's name with .spectrum.png in this folder by default.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of tables.")
def inspect(file: Path, places: tuple[Place, ...], output: Path | None, as_json: bool) -> None:
    """Tell what the image FILE holds; plot the spectra of pixels, or their channels.

    Of a spectral EXR file the values at its wavelengths are shown, of any other image its channels,
    linear.
    """
    image = opened(file)
    found = {place: _pixel(image, place) for place in places}
    if as_json:
        pixels = [{"at": place, "values": values.tolist()} for place, values in found.items()]
        names = {"wavelengths": image.lambdas.tolist()} if image.lambdas is not None else {}
        told = {**image.stats, "channels": image.labels, **names, "pixels": pixels}
        click.echo(json.dumps(told, indent=2))
    else:
        _tell(image, found)
    if places:
        from . import plots  # matplotlib takes its time

        target = output or Path(f"{file.stem}.spectrum.png")
        plots.write(target, image, found)
        click.echo(str(target), err=True)


def opened(path: Path) -> Opened:
    """Read any image file to be inspected. Raises SceneError."""
    if spectral_exr.is_spectral(path):
        return _spectral(path)
    if path.suffix.lower() == ".exr":
        layers = images.read_layers(path)
        if len({layer.shape for layer in layers.values()}) != 1:
            raise SceneError("its channels are of different sizes", file=path)
        labels, values = tuple(layers), np.stack(list(layers.values()), axis=2)
        if set("RGB") <= layers.keys():  # before others, and as people name them
            labels = (*"RGB", *(name for name in labels if name not in "RGB"))
            values = np.stack([layers[name] for name in labels], axis=2)
    else:
        values = images.read(path)
        count = values.shape[2]
        labels = tuple(LETTERS.get(count, ())) or tuple(str(i) for i in range(count))
    colours = values[..., :3] if labels[:3] == tuple("RGB") else None
    if labels[0] == "Y":
        colours = np.repeat(values[..., :1], 3, axis=2)
    stats = {"size": _size(values), "channels": str(len(labels))}
    return Opened(path, values, labels, None, colours, "value (linear)", stats)


def _spectral(path: Path) -> Opened:
    image = spectral_exr.read(path)
    lambdas = image.lambdas
    quantity = "reflectance"
    if image.emissive:
        quantity = f"radiance [{image.units}]" if image.units else "radiance"
    stats = {
        "size": _size(image.values),
        "holds": "light" if image.emissive else "reflectances",
        "bands": f"{len(lambdas)}, {lambdas[0]:g} to {lambdas[-1]:g} nm",
        **({"units": image.units} if image.units else {}),
        **({"exposure": f"{image.exposure:g} stops"} if image.exposure else {}),
        **({"response": "of the camera is given"} if image.response else {}),
        **({"transmission": "of the lens is given"} if image.transmission else {}),
        **({"note": "; ".join(image.warnings)} if image.warnings else {}),
    }
    colours = image.to_rgb() * np.float32(2.0**image.exposure)
    labels = tuple(f"{nm:g} nm" for nm in lambdas)
    return Opened(path, image.values, labels, lambdas, colours, quantity, stats)


def _size(values: np.ndarray) -> str:
    return f"{values.shape[1]} x {values.shape[0]}"


def _pixel(image: Opened, place: Place) -> np.ndarray:
    """A pixel's values (n,). Raises SceneError outside of the image."""
    (x, y), (height, width) = place, image.values.shape[:2]
    if x >= width or y >= height:
        raise SceneError(
            f"{x},{y} is outside of the image of {width} x {height} pixels, whose last one is "
            f"{width - 1},{height - 1}",
            file=image.path,
        )
    return np.asarray(image.values[y, x])


def hex_colour(image: Opened, place: Place) -> str | None:
    """A pixel's colour as #rrggbb in sRGB; None where the image has no colours."""
    if image.colours is None:
        return None
    x, y = place
    return "#" + bytes(images.to_srgb8(image.colours[y : y + 1, x : x + 1])[0, 0]).hex()


def _tell(image: Opened, found: dict[Place, np.ndarray]) -> None:
    console = Console()
    if not console.is_terminal:
        console = Console(width=200)  # a file or a pipe has no edge to wrap at
    console.print(str(image.path), markup=False, highlight=False)
    stats = Table(show_header=False)
    for name, value in image.stats.items():
        stats.add_row(name, value)
    console.print(stats)
    if not found:
        return
    console.print(image.quantity, markup=False)
    numbers = Table()
    numbers.add_column("wavelength" if image.lambdas is not None else "channel", justify="right")
    for x, y in found:
        numbers.add_column(f"{x},{y}", justify="right")
    for i, label in enumerate(image.labels):
        numbers.add_row(label, *(f"{values[i]:.5g}" for values in found.values()))
    if image.colours is not None:
        names = [hex_colour(image, place) for place in found]
        numbers.add_section()
        numbers.add_row("sRGB", *(f"[on {name}]   [/] {name}" for name in names))
    console.print(numbers)
