"""Figures beside those of a record: of before, or of another device."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from clpt.bench.figures import SECONDS, Figure
from clpt.errors import SceneError

Row = Mapping[str, Any]
_KEY = ("bench", "scene", "figure", "unit", "mode", "size", "benchmark_version")


@dataclass(frozen=True)
class Ratio:
    """A figure that is measured now beside the same figure in a record.

    ratio: above 1 where it is better now, whatever the unit; noise: by which it may be off, from
    the spread of both; then: the record.
    """

    figure: Figure
    then: Row
    ratio: float
    noise: float

    def below(self, limit: float) -> bool:
        """Whether it is below a limit by more than noise."""
        return self.ratio * (1.0 + self.noise) < limit


def key(record: Row) -> tuple[Any, ...]:
    """Return the values of a record that are equal in all records of the same figure."""
    return tuple(record.get(name) for name in _KEY)


def against(figures: Iterable[Figure], records: Iterable[Row], device: str) -> list[Ratio]:
    """Ratios of the figures that the records have too, the newest of each.

    device: the label of the one that was measured; its own records go before those of others.
    Raises SceneError if there are none.
    """
    then: dict[tuple[Any, ...], Row] = {}
    for record in sorted(records, key=lambda record: record.get("device") == device):
        if isinstance(record.get("value"), (int, float)) and "figure" in record:
            then[key(record)] = record
    found = [
        _ratio(figure, then[key(figure.record())])
        for figure in figures
        if figure.rounds and not figure.refused and key(figure.record()) in then
    ]
    if not found:
        raise SceneError("the record to compare with has none of the figures that were measured")
    return found


def _ratio(figure: Figure, then: Row) -> Ratio:
    now, before = figure.value, float(then["value"])
    ratio = before / now if figure.unit == SECONDS else now / before
    noise = math.hypot(figure.spread, float(then.get("spread", 0.0)))
    return Ratio(figure, then, ratio, noise)
