"""The record of the options of `clpt view`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..options.grading import GradingOptions
from ..options.scene_options import SceneOptions, Workers


@dataclass(frozen=True)
class Settings:
    """The options of `clpt view`.

    folder: gets what the page saves; opened: a view that it has saved, to begin with.
    """

    host: str
    port: int
    no_browser: bool
    folder: Path
    opened: Path | None
    workers: Workers
    options: SceneOptions
    graded: GradingOptions
    quiet: bool
