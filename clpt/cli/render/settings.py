"""The options of `clpt render` alone, and the records that it takes."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clpt.files import output_files

from ...choices import MOST_SAMPLES, MOST_SEED, VIEWER
from ..files.targets import STANDARD_FORMATS, default
from ..options.grading import GradingOptions
from ..options.records import Command, with_options
from ..options.scene_options import SceneOptions, Workers
from ..options.values import Choice, Count, Noise

if TYPE_CHECKING:
    from ...scene import Scene

MOST_FRAMES = 10**6
DIGITS = 4  # of a frame's number in a name that says nothing else

_NUMBER = re.compile(r"#+|%0?(\d?)d")
_BRACES = re.compile(r"\{([^{}]*)\}")
_FORM = re.compile(r"0?\d{0,2}(\.\d{1,2})?[defg]?")
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip


class SampleRange(click.ParamType):
    """FIRST:END, numbers of samples without the last; returned as two numbers."""

    name = "FIRST:END"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        match = re.fullmatch(r"(\d{1,10}):(\d{1,10})", str(value).strip())
        if not match or not int(match[1]) < int(match[2]) <= MOST_SAMPLES:
            self.fail(f"{value!r} is no range of samples such as 0:1024", param, ctx)
        return int(match[1]), int(match[2])


class Duration(click.ParamType):
    """A time such as 30s, 5m, 1h30m or 2.5; returned in seconds."""

    name = "TIME"
    least = 1e-6

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        text = str(value).strip().lower()
        number = r"(\d+(?:\.\d+)?)"
        match = re.fullmatch(rf"(?:{number}h)?(?:{number}m)?(?:{number}s?)?", text)
        if not text or not match:
            self.fail(f"{value!r} does not look like 30s, 5m or 1h30m", param, ctx)
        hours, minutes, seconds_part = (float(n or 0) for n in match.groups())
        seconds = 3600 * hours + 60 * minutes + seconds_part
        if not self.least <= seconds < 1e9:
            self.fail(f"{value!r} is no time to render in", param, ctx)
        return seconds


class Period(Duration):
    """A time, or 0."""

    least = 0.0


class Frames(click.ParamType):
    """FIRST:LAST or FIRST:LAST:STEP, both included, or a single number; returned as a range."""

    name = "FIRST:LAST"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> range:
        match = re.fullmatch(r"(\d{1,9})(?::(\d{1,9}))?(?::(\d{1,9}))?", str(value).strip())
        if not match:
            self.fail(f"{value!r} does not look like 1:240, 1:240:2 or 7", param, ctx)
        first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
        if last < first or not step:
            self.fail(f"{value!r} has no frames", param, ctx)
        frames = range(first, last + 1, step)
        if len(frames) > MOST_FRAMES:
            self.fail(f"{value!r} are more than {MOST_FRAMES} frames", param, ctx)
        return frames


class Address(click.ParamType):
    """HOST, HOST:PORT or :PORT."""

    name = "HOST:PORT"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        if not isinstance(value, str):
            return value
        from clpt.images import tev  # here: help needs no numpy

        try:
            return tev.address(value)
        except ValueError as error:
            self.fail(f"{value!r} is no address of a viewer: {error}", param, ctx)


@dataclass(frozen=True)
class Until:
    """When a render ends: samples and noise, a time [s], or the numbers of its samples."""

    spp: int | None
    noise: float | None
    limit: float | None
    numbers: tuple[int, int] | None

    def check(self) -> None:
        """Raise click.UsageError for options that say different things."""
        if self.numbers and (self.spp or self.noise):
            message = "--samples says how many there are; leave out --spp and --noise"
            raise click.UsageError(message)

    @property
    def first(self) -> int:
        """The number of the first sample."""
        return self.numbers[0] if self.numbers else 0

    def end(self, scene: Scene) -> int | None:
        """Return the end of the samples, None where the limit or the noise ends the render."""
        if self.numbers:
            return self.numbers[1]
        free = self.limit is not None or self.noise
        return self.spp if free else scene.spp


@dataclass(frozen=True)
class Animation:
    """Frames, None for a picture that stands; how many a second, and the file of their video."""

    frames: range | None
    fps: float
    video: Path | None


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The options of `clpt render`: when a render ends, devices, files and messages.

    every: seconds between pictures so far; period: seconds between checkpoints; resume: whether to
    go on from a checkpoint; tev: host and port of a viewer; verbose: whether figures are printed.
    """

    paths: tuple[Path, ...]
    every: float | None
    until: Until
    period: float | None
    resume: bool | None
    animation: Animation
    options: SceneOptions
    workers: Workers
    graded: GradingOptions
    tev: tuple[str, int] | None
    verbose: int
    quiet: bool

    def check(self) -> None:
        """Raise click.UsageError for options that do not go together, SceneError for a view."""
        animated, _ = self.animation.frames is not None, self.graded.grading
        if self.tev is not None and (animated or self.workers.cluster is not None):
            message = "--tev shows one picture of this machine: not with these options yet"
            raise click.UsageError(message)
        if self.animation.video is not None and not animated:
            raise click.UsageError("--video needs --frames")
        saves = self.until.numbers or self.period is not None or self.resume is not None
        if animated and saves:
            raise click.UsageError("frames go on by themselves: leave out what saves one picture")
        if animated and self.every is not None:
            raise click.UsageError("each frame is written when it is complete: leave out --every")
        self.until.check()

    def of(self, scene: Path) -> Job:
        """Return the job of a scene."""
        machine = replace(self.options.machine, profiling=bool(self.verbose))
        options = replace(self.options, machine=machine)
        return Job(scene=scene, **(vars(self) | {"options": options}))


@dataclass(frozen=True, kw_only=True)
class Job(Settings):
    """A scene to render, by these settings; camera: which of several, as its number."""

    scene: Path
    camera: str | None = None

    @property
    def targets(self) -> tuple[Path, ...]:
        """The files of the picture."""
        return self.paths or default(self.scene)

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that are written."""
        video = self.animation.video
        return self.targets if video is None else (*self.targets, video)

    def named(self, old: str, new: str) -> Job:
        """Return the job with `new` for `old` in the names of its files."""

        def name(path: Path) -> Path:
            return Path(str(path).replace(old, new))

        animation = self.animation
        if animation.video is not None:
            animation = replace(animation, video=name(animation.video))
        return replace(self, paths=tuple(map(name, self.paths)), animation=animation)

    def with_variables(self, variables: dict[str, Any]) -> Job:
        """Return the job with other values of the scene's variables."""
        loading = replace(self.options.loading, variables=variables)
        return replace(self, options=replace(self.options, loading=loading))


_OUTPUT = (
    click.option(
        "-o", "--output", "paths", multiple=True,
        type=click.Path(path_type=Path, allow_dash=True),
        help="Where to write: .exr .png .jpg .webp .hdr .pfm .npy, or - for the standard "
        "output; may be given several times; {scene} is the scene's name, {camera} that of "
        "--camera all.  "
        "[default: {scene}.exr and {scene}.png]",
    ),
    click.option(
        "--format", "form", type=Choice(STANDARD_FORMATS),
        help="Of the picture of -o -.  [default: png]",
    ),
    click.option(
        "--every", type=Duration(),
        help="How often to write the picture so far, from the first sample of all pixels on.",
    ),
)  # fmt: skip
_UNTIL = (
    click.option("--spp", type=Count(), help="Samples per pixel: 256, 1k, 1M."),
    click.option(
        "--noise", type=Noise(),
        help="Stop sampling pixels with less noise, such as 2% of their light, after --denoise "
        "if that is given; 0: never.",
    ),
    click.option("--time", "limit", type=Duration(),
        help="Stop after 30s, 5m, 1h30m of rendering, which begins when the kernels are compiled."),
    click.option(
        "--samples", "numbers", type=SampleRange(),
        help="Take samples of these numbers only, END without: -o a.film, for `clpt merge`.",
    ),
)  # fmt: skip
_RESUMING = (
    click.option(
        "--checkpoint", "period", type=Period(),
        help="How often to save what there is beside the picture, as NAME.resume.exr, and keep "
        "that file; 0: never.  [default: 5m, after ten minutes; removed at the end]",
    ),
    click.option(
        "--resume/--no-resume", default=None,
        help="Go on from NAME.resume.exr, which must be there; or leave it alone.  "
        "[default: go on if it is there]",
    ),
)  # fmt: skip
_ANIMATION = (
    click.option(
        "--frames", type=Frames(),
        help="Render an animation: 1:240, with the last one. Complete frames stay.",
    ),
    click.option(
        "--fps", type=click.FloatRange(0.0, min_open=True), default=24.0, show_default=True,
        help="Frames a second, of {time} and of the video.",
    ),
    click.option(
        "--video", type=click.Path(path_type=Path), help="Write the frames as .mp4 or .webp too."
    ),
)  # fmt: skip
_SEED = click.option(
    "--seed", type=click.IntRange(0, MOST_SEED), help="Seed of the random numbers."
)


tev_option = click.option(
    "--tev", type=Address(), is_flag=False, flag_value=VIEWER,
    help="Show the picture in tev or HDRView while it is rendered.  [default: 127.0.0.1:14158]",
)  # fmt: skip


def picture_options(command: Command) -> Command:
    """Give a command the options of the records of this module, and the seed."""
    return with_options(command, (*_OUTPUT, *_UNTIL, *_RESUMING, _SEED, *_ANIMATION))


def has_number(path: Path) -> bool:
    """Whether a name has a place for a frame's number: #### or %04d."""
    return _NUMBER.search(path.name) is not None


def numbered(path: Path, frame: int) -> Path:
    """Return the name of a frame's file: #### or %04d is its number, or else a number is added."""
    if not has_number(path):
        return output_files.beside(path, f".{frame:0{DIGITS}}{path.suffix}")

    def number(match: re.Match[str]) -> str:
        digits = len(match[0]) if match[0][0] == "#" else int(match[1] or 1)
        return f"{frame:0{digits}}"

    return path.with_name(_NUMBER.sub(number, path.name))


def varies(variables: Mapping[str, str]) -> bool:
    """Whether a value has an expression in braces."""
    return any(_BRACES.search(value) for value in variables.values())


def expanded(variables: Mapping[str, str], frame: int, fps: float) -> dict[str, str]:
    """Return the values of a frame's variables.

    Braces hold arithmetic of numbers, `frame` and `time`, which is frame / fps [s], by + - * / // %
    and parentheses; behind a colon the form of the number, as in {frame:04}.

    Raises click.BadParameter.
    """
    names = {"frame": frame, "time": frame / fps}

    def value(match: re.Match[str]) -> str:
        text, _, form = match[1].partition(":")
        try:
            if not _FORM.fullmatch(form):
                raise ValueError(f"{form!r} is no form of a number")
            return format(_computed(ast.parse(text.strip(), mode="eval").body, names), form)
        except (SyntaxError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
            why = "it is no arithmetic" if isinstance(error, SyntaxError) else error
            raise click.BadParameter(f"{match[0]}: {why}", param_hint="-D") from error

    return {name: _BRACES.sub(value, text) for name, text in variables.items()}


def _computed(node: ast.expr, names: Mapping[str, float]) -> float:
    """The value of an expression. Raises ValueError for more than arithmetic."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise ValueError(f"there is no {node.id!r}; known: {', '.join(names)}")
        return names[node.id]
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_computed(node.operand, names))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        sides = _computed(node.left, names), _computed(node.right, names)
        return _OPERATORS[type(node.op)](*sides)
    raise ValueError("only numbers, frame, time, + - * / // % and parentheses are known")
