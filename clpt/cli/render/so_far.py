"""`--every`: the picture so far is written now and then, in the place of the one before."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path

from ..files import outputs
from ..options.grading import Grading


class PictureSoFar:
    """Writes the picture of a render that goes on, at the ends of its passes.

    A reader sees a whole picture at any time, see clpt.files.output_files. What cannot be written
    is told once, and tried again; the render goes on.

    period: seconds from one picture to the next, None: never; stats: returns the metadata of the
    picture so far; note: prints a line.
    """

    def __init__(
        self,
        period: float | None,
        targets: tuple[Path, ...],
        source: outputs.Source,
        stats: Callable[[], dict[str, str | int | float]],
        grading: Grading,
        note: Callable[[str], None],
    ):
        self._period, self._targets, self._source = period or math.inf, targets, source
        self._stats, self._grading, self._note = stats, grading, note
        self._due = time.monotonic() + self._period
        self._failed: set[Path] = set()

    def after_pass(self) -> None:
        """Write the picture, if that is due."""
        if time.monotonic() < self._due:
            return
        stats = self._stats()
        for path in self._targets:
            self._write(path, stats)
        self._due = time.monotonic() + self._period  # from its end: a render is not all writing

    def _write(self, path: Path, stats: dict[str, str | int | float]) -> None:
        try:
            outputs.write(path, self._source, stats, self._grading)
        except outputs.FAILURES as error:
            if path not in self._failed:
                self._note(f"clpt: warning: {outputs.failure(path, error)}; the render goes on")
            self._failed.add(path)
        else:
            self._failed.discard(path)
