"""Options of scenes, loading, devices and workers, with records of their values."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from ...choices import (
    DENOISERS,
    INTEGRATORS,
    LAYERS,
    LAYOUTS,
    MODES,
    SAMPLERS,
    SPACES,
    Missing,
    Programs,
    Quality,
)
from ...files import budget
from ...formats import ARGUMENTS, load
from .changes import SceneChanges, composition_options
from .records import Command, Decorator, with_options
from .values import Choice, LightPaths, Names, SensorName, Size, White

if TYPE_CHECKING:
    from ...formats.reading import Progress
    from ...scene import Scene


class Bytes(click.ParamType):
    """A number of bytes, such as 500M or 2G."""

    name = "SIZE"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        form, text = r"(\d{1,15}(?:\.\d+)?)\s*([KMGT]?)i?B?", str(value).strip()
        match = re.fullmatch(form, text, re.IGNORECASE)
        if match is None:
            self.fail(f"{value!r} is no size in memory; write 500M or 2G", param, ctx)
        return int(float(match[1]) * 1024 ** " KMGT".index(match[2].upper() or " "))


def _limit(name: str) -> Callable[[Any, Any, Any], None]:
    """Return the callback of an option that limits all loads of the command."""

    def set_limit(_: click.Context, __: click.Parameter, value: Any) -> None:
        budget.set_usual(dataclasses.replace(budget.usual, **{name: value}))

    return set_limit


def _parse(_: click.Context, __: click.Parameter, definitions: Iterable[str]) -> dict[str, Any]:
    """Return NAME=VALUE options as a dictionary. Raises click.BadParameter."""
    pairs = [definition.partition("=") for definition in definitions]
    wrong = next((name for name, equals, _ in pairs if not (name and equals)), None)
    if wrong is not None:
        raise click.BadParameter(f"{wrong!r} does not look like NAME=VALUE", param_hint="-D")
    for name in ARGUMENTS:
        if any(name == known for known, _, _ in pairs):
            raise click.BadParameter(f"no variable can be called {name}", param_hint="-D")
    return {name: value for name, _, value in pairs}


def _add_variants(ctx: click.Context, _: click.Parameter, variants: tuple[str, ...]) -> None:
    """Make the variants a variable of the scene."""
    if variants:
        ctx.params["variables"]["variant"] = ",".join(variants)


_LOADING = (
    click.option(
        "-D", "variables", multiple=True, metavar="NAME=VALUE", callback=_parse,
        is_eager=True,  # before --camera, which adds to it
        help="Set a $name of an .xml; of glTF scene, animation or time. See --frames for {frame}.",
    ),
    click.option(
        "--variant", multiple=True, metavar="SET=NAME", expose_value=False, callback=_add_variants,
        help="Select a variant of USD, or by its NAME of glTF.",
    ),
    click.option(
        "--load-memory", type=Bytes(), metavar="SIZE", expose_value=False,
        callback=_limit("memory"),
        help="Memory that reading the scene may take, such as 8G, if you trust its files.  "
        "[default: half the free, and what fits the size of its files]",
    ),
    click.option(
        "--load-seconds", type=click.FloatRange(0.0, min_open=True), metavar="SECONDS",
        expose_value=False, callback=_limit("seconds"),
        help=f"Time that it may take.  [default: {budget.SECONDS:g}]",
    ),
    click.option(
        "--load-parts", type=click.IntRange(1), metavar="N", expose_value=False,
        callback=_limit("parts"), help="Elements, shapes and instances that it may have.  "
        "[default: what fits the size of its files]",
    ),
)  # fmt: skip

_MISSING = (
    click.option(
        "--missing-textures", type=Choice(get_args(Missing)), default="error",
        help="grey: go on with grey where an image is not there, or a material is unknown.",
    ),
    click.option(
        "--strict", is_flag=True, help="Stop where the scene's file says what is left out."
    ),
)  # fmt: skip


def loading_options(command: Command) -> Command:
    """Give a command the parameter `variables`, and options that limit loads."""
    return with_options(command, _LOADING)


def reading_options(command: Command) -> Command:
    """Give a command the options of the record `Loading`."""
    return with_options(loading_options(command), _MISSING)


LOCAL = "local:"


class Where(click.ParamType):
    """The address of a scheduler, or local:N."""

    name = "ADDRESS"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        text = str(value)
        if not re.fullmatch(rf"{LOCAL}[1-9]\d{{0,2}}|tls://.+:\d+", text):
            self.fail(f"{text!r} is neither tls://HOST:PORT nor local:N")
        return text


@dataclass(frozen=True)
class Workers:
    """The address of a cluster, None for none, and the folder of its keys."""

    cluster: str | None = None
    keys: Path | None = None

    @property
    def number(self) -> int | None:
        """The number of workers to start on this machine; None where an address has its own."""
        where = self.cluster or ""
        return int(where.removeprefix(LOCAL)) if where.startswith(LOCAL) else None


def worker_options(text: str) -> Decorator:
    """Return a decorator that gives a command the options of the record `Workers`.

    text: the help of --cluster.
    """
    options = (
        click.option("--cluster", type=Where(), help=text),
        click.option(
            "--keys", type=click.Path(path_type=Path),
            help="Folder of the cluster's keys.  "
            "[default: that of clpt cluster start on this machine]",
        ),
    )  # fmt: skip
    return lambda command: with_options(command, options)


@dataclass(frozen=True)
class Loading:
    """Options of reading a scene's file: see `clpt.load`."""

    variables: dict[str, Any]
    missing_textures: Missing = "error"
    strict: bool = False

    def read(self, file: Path, progress: Progress | None = None) -> Scene:
        """Return the scene of a file. Raises SceneError."""
        return load(
            file,
            progress=progress,
            missing_textures=self.missing_textures,
            strict=self.strict,
            **self.variables,
        )


@dataclass(frozen=True)
class Machine:
    """The value of --device, and the most cores of a CPU.

    profiling: whether stages are timed.
    """

    device: str | None = None
    threads: int | None = None
    profiling: bool = False


@dataclass(frozen=True)
class SceneOptions:
    """The options of `scene_options`: a scene, changes of it, and who renders it."""

    loading: Loading
    changes: SceneChanges
    machine: Machine
    layout: str | None = None
    tree_quality: Quality = "high"
    programs: Programs = "own"
    texture_budget: int | None = None

    @property
    def renderer_options(self) -> dict[str, Any]:
        """The options of renderers, see `RenderOptions`."""
        return {**self.build, "denoise": self.changes.denoise}

    @property
    def build(self) -> dict[str, Any]:
        """The options of trees and textures, by their names in `RenderOptions`."""
        return {
            "layout": self.layout, "tree_quality": self.tree_quality,
            "texture_budget": self.texture_budget, "programs": self.programs,
        }  # fmt: skip

    def scene(self, file: Path, progress: Progress | None = None) -> Scene:
        """Return the scene of a file, changed. Raises SceneError, click.BadParameter."""
        from .applied import changed

        return changed(self.loading.read(file, progress), self.changes)


denoise_option = click.option(
    "--denoise", type=Choice(DENOISERS), is_flag=False, flag_value=DENOISERS[0],
    help="Take noise away: oidn is Open Image Denoise of clpt[denoise]; statistical needs nothing. "
    f"The noisy picture is kept as a layer of .exr.  [default: none; alone: {DENOISERS[0]}]",
)  # fmt: skip

_OPTIONS = (
    click.option(
        "--mode", type=Choice(MODES), help="Whether light is spectra or RGB."
    ),
    click.option("--size", type=Size(), help="Size of the picture."),
    click.option(
        "--device", metavar="NAME-OR-INDEX",
        help="Where to render, see `clpt devices`: one, or 0,2, all, gpu (all GPUs).",
    ),
    click.option("--threads", type=click.IntRange(1), help="Cores of a CPU to use, at most."),
    click.option(
        "--bvh", "layout", type=Choice(LAYOUTS),
        help="Acceleration structure of the triangles.",
    ),
    click.option(
        "--tree-quality", type=Choice(get_args(Quality)), default="high",
        help="fast: built sooner, a little slower to trace.",
    ),
    click.option(
        "--programs", type=Choice(get_args(Programs)), default="own",
        help="shared: with all scenes of the usual kinds. The first of them compiles for longer, "
        "the others hardly.",
    ),
    click.option(
        "--integrator", metavar="NAME", help=f"One of {', '.join(INTEGRATORS)}."
    ),
    click.option(
        "--sampler", type=Choice(SAMPLERS),
        help="Where random numbers come from.",
    ),
    click.option(
        "--max-depth", type=click.IntRange(-1), help="Longest path, at most 4000; -1: no limit."
    ),
    click.option(
        "--light-paths", type=LightPaths(),
        help="Of path and vcm: paths from lights for each sample, for caustics. Of path, 0: none; "
        "auto: some where something is specular and a light is small.",
    ),
    click.option(
        "--guiding", is_flag=True, default=None,
        help="Of path: learn first where light comes from, for rooms that are lit through a door.",
    ),
    click.option(
        "--reuse", is_flag=True, default=None,
        help="Of path: pixels close to each other share what their paths find, for diffuse rooms.",
    ),
    click.option(
        "--radius", type=click.FloatRange(0.0),
        help="Of vcm: where photons are gathered in the first pass [m]; 0: as suits the picture.",
    ),
    click.option(
        "--sensor", type=SensorName(), help="cie1931, cie1964 or a file of three curves."
    ),
    click.option(
        "--white-balance", type=White(), help="What becomes white: none, D65, 3200 or x,y."
    ),
    click.option(
        "--output-space", type=Choice(SPACES), help="Colour space of the picture."
    ),
    click.option(
        "--bands", type=click.IntRange(0), help="Bands of a spectral picture, for .npy and .exr."
    ),
    click.option(
        "--time-bins", type=click.IntRange(0),
        help="Bins of light by its time from the lamp to the film, for .npy and .exr.",
    ),
    click.option("--time-min", type=float, help="Where the first bin begins [ns].  [default: 0]"),
    click.option("--time-max", type=float, help="Where the last bin ends [ns].  [default: 100]"),
    click.option("--lambda-min", type=float, help="Shortest wavelength of the light [nm]."),
    click.option(
        "--lambda-max", type=float, help="Longest wavelength; fluorescence needs 300 to 830."
    ),
    click.option(
        "--layers", type=Names(LAYERS), metavar="NAME,..",
        help=f"Pictures beside the picture, for .exr: {', '.join(LAYERS)}.",
    ),
    click.option(
        "--alpha", is_flag=True, default=None, help="Transparent background (alpha channel)."
    ),
    reading_options,
    click.option(
        "--texture-budget", type=Bytes(), metavar="SIZE",
        help="Memory for images, such as 500M; larger ones are halved.  [default: half the free]",
    ),
)  # fmt: skip


def scene_options(command: Command) -> Command:
    """Give a command the options of the record `SceneOptions`."""
    return with_options(composition_options(command), _OPTIONS)
