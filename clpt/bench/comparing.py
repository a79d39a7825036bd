"""Comparison of figures with records: of earlier runs, or of another device."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from clpt.bench.figures import Figure
from clpt.errors import SceneError

Row = Mapping[str, Any]
_KEY = ("bench", "scene", "figure", "unit", "mode", "size", "benchmark_version")


@dataclass(frozen=True)
class Ratio:
    """A measured figure beside the same figure in a record.

    ratio: above 1 if the new figure is better, in any unit; noise: relative uncertainty, from the
    spread of both; then: the record.
    """

    figure: Figure
    then: Row
    ratio: float
    noise: float

    def below(self, limit: float) -> bool:
        """Return whether the ratio is below a limit by more than noise."""
        return self.ratio * (1.0 + self.noise) < limit


def key(record: Row) -> tuple[Any, ...]:
    """Return the values of a record that are equal in all records of the same figure."""
    return tuple(record.get(name) for name in _KEY)


def against(figures: Iterable[Figure], records: Iterable[Row], device: str) -> list[Ratio]:
    """Return ratios of the figures to the newest record of each.

    device: label of the measured device, whose records precede other devices'. Raises
    SceneError if no figure has a record.
    """
    then: dict[tuple[Any, ...], Row] = {}
    for record in sorted(records, key=lambda record: record.get("device") == device):
        if isinstance(record.get("value"), (int, float)) and "figure" in record:
            then[key(record)] = record
    ratios = [
        _ratio(figure, then[key(figure.record())])
        for figure in figures
        if figure.rounds and not figure.refused and key(figure.record()) in then
    ]
    if not ratios:
        raise SceneError("the record to compare with has none of the figures that were measured")
    return ratios


def _ratio(figure: Figure, then: Row) -> Ratio:
    now, before = figure.value, float(then["value"])
    ratio = before / now if figure.less_is_better else now / before
    noise = math.hypot(figure.spread, float(then.get("spread", 0.0)))
    return Ratio(figure, then, ratio, noise)
