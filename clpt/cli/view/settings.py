"""The records that `clpt view` takes in the place of options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..options.grading import GradingOptions
from ..options.scene_options import SceneOptions, Workers


@dataclass(frozen=True)
class Listening:
    """Where the page is, and whether a browser opens it."""

    host: str
    port: int
    no_browser: bool


@dataclass(frozen=True)
class Settings:
    """The options of `clpt view`.

    folder: gets what the page saves; opened: a view that it has saved, to begin with.
    """

    listening: Listening
    folder: Path
    opened: Path | None
    workers: Workers
    options: SceneOptions
    graded: GradingOptions
    quiet: bool
