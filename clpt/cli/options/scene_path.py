"""The argument that names a scene: a path, which the TAB key completes with clpt's own scenes."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from ...formats import own_scenes


class ScenePath(click.Path):
    """The path of a file or a folder, or of one of clpt's own scenes."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return clpt's own scenes that begin so, with files that are there; else any files."""
        own = [path for path in own_scenes.paths() if path.startswith(incomplete)]
        if not incomplete or not own:
            return super().shell_complete(ctx, param, incomplete)
        folder, _, name = incomplete.rpartition("/")
        try:
            names = sorted(os.listdir(folder or "."))
        except OSError:
            names = []
        here = [f"{folder}/{one}" if folder else one for one in names if one.startswith(name)]
        files = [path for path in here if path not in own and path != own_scenes.SCENES]
        return [CompletionItem(path) for path in (*own, *files)]
