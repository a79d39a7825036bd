"""The help of commands with many options: in groups, with examples at the end."""

from __future__ import annotations

from collections.abc import Sequence

import click

OTHER = "Other options"
# What stands under each heading, by the names that options have in the program. Options of a
# command that are in none of them stand under OTHER.
HEADINGS: dict[str, tuple[str, ...]] = {
    "Output": (
        "paths", "folder", "form", "every", "layers", "names", "alpha", "denoise", "tev",
    ),
    "Page": ("port", "host", "no_browser", "opened"),
    "Samples": ("spp", "noise", "limit", "numbers", "sampler", "seed", "period", "resume"),
    "Camera and picture": ("camera", "size", "crop", "env", "env_rotation"),
    "Light transport": (
        "mode", "integrator", "max_depth", "light_paths", "guiding", "radius", "lambda_min",
        "lambda_max", "bands",
    ),
    "Colour": (
        "exposure", "tone", "view", "display", "look", "ocio", "sensor", "white_balance",
        "output_space",
    ),
    "Animation": ("frames", "fps", "video"),
    "Device": ("device", "threads", "layout", "tree_quality", "texture_budget"),
    "Cluster": ("cluster", "keys"),
    "Scene file": (
        "variables", "missing_textures", "load_memory", "load_seconds", "load_parts",
    ),
}  # fmt: skip


class Grouped(click.Command):
    """A command whose help shows options under HEADINGS.

    `examples` of a heir: command lines, and what each does.
    """

    examples: Sequence[tuple[str, str]] = ()

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, heading by heading, then the examples."""
        left = {
            param.name: record
            for param in self.get_params(ctx)
            if isinstance(param, click.Option)
            and (record := param.get_help_record(ctx)) is not None
        }
        for heading, names in HEADINGS.items():
            rows = [left.pop(name) for name in names if name in left]
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)
        with formatter.section(OTHER):
            formatter.write_dl([*left.values()])
        if self.examples:
            with formatter.section("Examples"):
                for line, meaning in self.examples:
                    formatter.write(f"{'':{formatter.current_indent}}{line}\n")
                    formatter.write(f"{'':{formatter.current_indent}}    {meaning}\n")


def grouped(examples: Sequence[tuple[str, str]] = ()) -> type[Grouped]:
    """Return a class of commands whose help ends with examples."""
    return type("Grouped", (Grouped,), {"examples": examples})
