"""Commands with many options: records of their values, help in groups, the option -v."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import logging
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeVar, cast

import click

from ... import errors
from ..process import terminal

Command = TypeVar("Command", bound=Callable[..., Any])


class Decorator(Protocol):
    """Gives a command options, or records in their place."""

    def __call__(self, command: Command, /) -> Command: ...


RecordType = TypeVar("RecordType")


def with_options(command: Command, options: Sequence[Decorator]) -> Command:
    """Give a command options, which its help shows in this order."""
    for option in reversed(options):
        command = option(command)
    return command


def with_records(**forms: type[Any]) -> Decorator:
    """Let a command take records by these names in the place of the options that they name.

    forms: frozen dataclasses, see `record_of`. Two records may take the same option.
    """
    taken = {name for form in forms.values() for name in _names(form)}

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def with_them(**values: Any) -> Any:
            records = {name: record_of(form, values) for name, form in forms.items()}
            others = {name: value for name, value in values.items() if name not in taken}
            return command(**records, **others)

        return cast(Command, with_them)

    return decorate


def record_of(form: type[RecordType], values: Mapping[str, Any]) -> RecordType:
    """Return a record of the options that its fields name; a field may be a record of others.

    An option that the command does not have leaves the field's default.
    """
    members: dict[str, Any] = {}
    for name, inner in _fields(form).items():
        if inner is not None:
            members[name] = record_of(inner, values)
        elif name in values:
            members[name] = values[name]
    return form(**members)


def _names(form: type[Any]) -> Iterator[str]:
    """Yield the names of the options that a record takes."""
    for name, inner in _fields(form).items():
        if inner is not None:
            yield from _names(inner)
        else:
            yield name


def _fields(form: type[Any]) -> dict[str, type[Any] | None]:
    """Return the fields of a record by their names, with the record that is the type of each.

    A record is looked up in the form's module; other types may not be imported yet.
    """
    known = vars(sys.modules[form.__module__])
    fields: dict[str, Any] = {}
    for name, parameter in inspect.signature(form).parameters.items():
        record = known.get(parameter.annotation)
        fields[name] = record if dataclasses.is_dataclass(record) else None
    return fields


OTHER = "Other options"
# Options under each heading, by their names in the program; further options stand under OTHER.
HEADINGS: dict[str, tuple[str, ...]] = {
    "Output": (
        "paths", "folder", "form", "every", "layers", "names", "alpha", "denoise", "tev",
    ),
    "Page": ("port", "host", "no_browser", "opened"),
    "Samples": ("spp", "noise", "limit", "numbers", "sampler", "seed", "period", "resume"),
    "Camera and picture": ("camera", "size", "crop", "env", "env_rotation"),
    "Light transport": (
        "mode", "kinds", "integrator", "max_depth", "light_paths", "guiding", "reuse", "radius",
        "lambda_min", "lambda_max", "bands", "time_bins", "time_min", "time_max",
    ),
    "Colour": (
        "exposure", "tone", "view", "display", "look", "ocio", "sensor", "white_balance",
        "output_space",
    ),
    "Animation": ("frames", "fps", "video"),
    "Device": ("device", "threads", "layout", "tree_quality", "programs", "texture_budget"),
    "Cluster": ("cluster", "keys"),
    "Scene file": (
        "variables", "variant", "missing_textures", "strict", "load_memory", "load_seconds",
        "load_parts",
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


LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
_COUNT = "clpt.verbosity"  # in the dictionary that nested contexts share


class Handler(logging.Handler):
    """Prints messages of clpt's log as the commands print theirs: clpt: warning: ..."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a message, which has more lines where it tells a traceback."""
        errors.clean(record)  # another library's too
        terminal.clear_line()
        terminal.say_lines(f"clpt: {record.levelname.lower()}: {self.format(record)}", err=True)


def verbose_option(text: str) -> Decorator:
    """Return the option, with its help; the command gets how often it was given in all."""
    return click.option("-v", "--verbose", count=True, callback=_add, help=text)


def _add(ctx: click.Context, param: click.Parameter, value: int) -> int:
    count = ctx.meta[_COUNT] = ctx.meta.get(_COUNT, 0) + value
    logging.getLogger("clpt").setLevel(LEVELS[min(count, len(LEVELS) - 1)])
    return count
