"""Types of values that options of scenes have."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import click

from ...choices import AUTO, MOST_LIGHT_PATHS, OBSERVERS
from ...errors import nearest

LARGEST = 65536  # pixels of a side


class Size(click.ParamType):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", str(value).strip().lower())
        if not found:
            self.fail(f"{value!r} does not look like 640x480", param, ctx)
        width, height = int(found[1]), int(found[2])
        if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
            self.fail(f"{width}x{height}: each side can be 1 to {LARGEST} pixels", param, ctx)
        return width, height


class SensorName(click.ParamType):
    """An observer's name, or the file of a camera's curves."""

    name = "NAME-OR-FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value in OBSERVERS:
            return value
        from ...spectra import read_sensor  # here: help needs no tables of spectra

        return read_sensor(value)


class LightPaths(click.ParamType):
    """A number of light paths, or auto."""

    name = "N-OR-AUTO"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return AUTO if value == AUTO else click.FloatRange(0.0, MOST_LIGHT_PATHS)(value, param, ctx)


class Names(click.ParamType):
    """Names of a table, with commas between them."""

    name = "NAMES"

    def __init__(self, known: Iterable[str]):
        self.known = tuple(known)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        given = tuple(str(value).split(","))
        for name in given:
            if name not in self.known:
                self.fail(f"{name!r} is unknown{nearest(name, self.known)}", param, ctx)
        return given


class White(click.ParamType):
    """none, an illuminant, a colour temperature in K such as 3200, or a chromaticity x,y."""

    name = "WHITE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            numbers = [float(part) for part in str(value).split(",")]
        except ValueError:
            return value
        return numbers[0] if len(numbers) == 1 else tuple(numbers)
