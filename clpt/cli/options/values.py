"""Types of values that options of scenes have."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from ...choices import AUTO, MOST_LIGHT_PATHS, MOST_SAMPLES, OBSERVERS
from ...errors import nearest
from ...formats import own_scenes

LARGEST = 65536  # pixels of a side
MOST_NOISE = 0.5  # that --noise takes: beyond, a few samples of each pixel are enough
MOST_STOPS = 120.0  # float32 has not many more


class Choice(click.Choice):
    """A name among several, in small letters or capitals."""

    def __init__(self, names: Iterable[str]):
        super().__init__(tuple(names), case_sensitive=False)


class Size(click.ParamType):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", str(value).strip().lower())
        if not match:
            self.fail(f"{value!r} does not look like 640x480", param, ctx)
        width, height = int(match[1]), int(match[2])
        if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
            self.fail(f"{width}x{height}: each side can be 1 to {LARGEST} pixels", param, ctx)
        return width, height


class Noise(click.ParamType):
    """A share such as 0.02 or 2%, at most MOST_NOISE; 0 for none."""

    name = "SHARE"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        match = re.fullmatch(r"(\d{1,9}(?:\.\d*)?|\.\d+)(?:e-?\d{1,2})?( ?%)?", str(value).strip())
        if not match:
            self.fail(f"{value!r} does not look like 0.02 or 2%", param, ctx)
        share = float(str(value).strip().rstrip(" %")) / (100.0 if match[2] else 1.0)
        if share > MOST_NOISE:
            percent = not match[2] and share / 100.0 <= MOST_NOISE
            advice = f"; write {share:g}% or {share / 100.0:g}" if percent else ""
            self.fail(f"{value} is a noise above {MOST_NOISE:.0%}{advice}", param, ctx)
        return share


class Count(click.ParamType):
    """A whole number from 1 on, such as 256, 1k or 1M."""

    name = "N"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> int:
        match = re.fullmatch(r"(\d{1,10})(?:\.(\d{1,6}))?([kM]?)", str(value).strip())
        number = 0.0
        if match:
            number = (
                float(f"{match[1]}.{match[2] or 0}") * {"": 1, "k": 1000, "M": 1000_000}[match[3]]
            )
        if not match or number != int(number):
            self.fail(f"{value!r} is no whole number such as 256, 1k or 1M", param, ctx)
        if not 1 <= number <= MOST_SAMPLES:
            self.fail(f"{value} is outside of 1 to {MOST_SAMPLES}", param, ctx)
        return int(number)


class Stops(click.ParamType):
    """A number of stops, or auto."""

    name = "STOPS-OR-AUTO"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float | str:
        limits = click.FloatRange(-MOST_STOPS, MOST_STOPS)
        return AUTO if str(value).lower() == AUTO else limits(value, param, ctx)


class SensorName(click.ParamType):
    """An observer's name, or the file of a camera's curves."""

    name = "NAME-OR-FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if str(value).lower() in OBSERVERS:
            return str(value).lower()
        from ...spectra import read_sensor  # here: help needs no tables of spectra

        return read_sensor(value)


class LightPaths(click.ParamType):
    """A number of light paths, or auto."""

    name = "N-OR-AUTO"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        return (
            AUTO
            if str(value).lower() == AUTO
            else click.FloatRange(0.0, MOST_LIGHT_PATHS)(value, param, ctx)
        )


class Names(click.ParamType):
    """Names of a table, with commas between them."""

    name = "NAMES"

    def __init__(self, known: Iterable[str]):
        self.known = tuple(known)

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        names = tuple(str(value).lower().split(","))
        for name in names:
            if name not in self.known:
                self.fail(f"{name!r} is unknown{nearest(name, self.known)}", param, ctx)
        return names


class White(click.ParamType):
    """none, an illuminant, a colour temperature in K such as 3200, or a chromaticity x,y."""

    name = "WHITE"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        try:
            numbers = [float(part) for part in str(value).split(",")]
        except ValueError:
            from ...spectra import illuminants  # here: help needs no tables of spectra

            names = {name.lower(): name for name in ("none", *illuminants())}
            return names.get(str(value).lower(), value)
        return numbers[0] if len(numbers) == 1 else tuple(numbers)


class ScenePath(click.Path):
    """The path of a file or a folder, or of a scene that comes with clpt."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return clpt's own scenes that begin so, with files that are there; else any files."""
        shipped = [path for path in own_scenes.paths() if path.startswith(incomplete)]
        if not incomplete or not shipped:
            return super().shell_complete(ctx, param, incomplete)
        folder, _, name = incomplete.rpartition("/")
        try:
            names = sorted(os.listdir(folder or "."))
        except OSError:
            names = []
        here = [
            f"{folder}/{entry}" if folder else entry for entry in names if entry.startswith(name)
        ]
        files = [path for path in here if path not in shipped and path != own_scenes.SCENES]
        return [CompletionItem(path) for path in (*shipped, *files)]
