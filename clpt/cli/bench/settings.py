"""The options of `clpt bench`, as records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import click

from clpt.files import output_files

from ...choices import TREES
from ...errors import SceneError
from ..process.ending import extra

STAGES = (
    "generate", "emit", "intersect", "mix", "shade", "shadow", "splat", "append", "accumulate",
)  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """Things to measure, and how often: see `clpt.bench.measure`."""

    scene: str | None
    stages: tuple[str, ...]
    layouts: tuple[str, ...]
    mode: str | None
    rounds: int
    count: int | None
    size: str

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `clpt.bench.measure`. Raises click.BadParameter."""
        parts, only, kinds = _chosen(self.stages)
        return {
            "parts": parts, "only": only, "kinds": kinds, "scene": self.scene,
            "layouts": self.layouts or TREES, "mode": self.mode, "rounds": self.rounds,
            "count": self.count, "size": self.size,
        }  # fmt: skip


@dataclass(frozen=True)
class Report:
    """Files that get figures, a record to compare them with, and how long to wait for each."""

    target: Path | None
    record: Path | None
    fail_below: float | None
    plot: Path | None
    card: Path | None
    limit: float

    def check(self) -> None:
        """Raise what is wrong with a file, before anything is measured."""
        if self.fail_below is not None and self.record is None:
            raise click.UsageError("--fail-below compares: give --compare FILE too")
        if self.card is not None:
            from clpt.bench.card import FORMATS  # here: help needs no OpenCL

            if self.card.suffix.lower() not in FORMATS:
                raise SceneError(f"a card is written to {' or '.join(FORMATS)}", file=self.card)
            check_writable(self.card)
        if self.plot is not None:
            with extra("plot", "a plot"):
                from .. import plots  # here: matplotlib is an extra, and slow

            plots.check_format(self.plot)
        _ = self.before

    @cached_property
    def before(self) -> list[dict[str, Any]] | None:
        """The figures of the record."""
        if self.record is None:
            return None
        from clpt.bench import records  # here: help needs no OpenCL

        return records.read(self.record)


def check_writable(path: Path) -> None:
    """Raise SceneError if a file cannot be written, before anything is measured."""
    try:
        output_files.check_writable(path)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _chosen(names: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Return parts, and stages and kinds of material if not all. Raises click.BadParameter."""
    from clpt import bench as benchmark  # here: help needs no OpenCL

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
