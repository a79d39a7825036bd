"""What `clpt render` and `clpt warm` share: options that say what is rendered and where, and how a
renderer is made of them.
"""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any, TypeAlias, get_args

import click

from .. import device as dev
from ..bvh import LAYOUTS, Quality
from ..cluster.multi_renderer import MultiRenderer
from ..denoise.needs import METHODS, prepared
from ..errors import nearest
from ..formats import load
from ..formats.missing import Missing
from ..render.analysis.checks import check
from ..render.renderer import Renderer
from ..scene import Scene, kinds
from ..scene.integrators import AUTO, MOST_LIGHT_PATHS, NO_AOV, Auto
from ..scene.layers import LAYERS
from ..scene.params import Kind, params
from ..spectra import read_sensor, spaces
from ..spectra.sensors import OBSERVERS
from .composition import Orbit, Span, composed, composition_options
from .display import Display
from .loading_options import Bytes, loading_options
from .option_sets import Command, with_options
from .stopping import prompt

LARGEST = 65536  # pixels of a side

AnyRenderer: TypeAlias = Renderer | MultiRenderer


class Size(click.ParamType):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", str(value).strip().lower())
        if not found:
            self.fail(f"{value!r} does not look like 640x480", param, ctx)
        width, height = int(found[1]), int(found[2])
        if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
            self.fail(f"{width}x{height}: each side can be 1 to {LARGEST} pixels", param, ctx)
        return width, height


class SensorName(click.ParamType):
    """An observer's name, or the file of a camera's curves."""

    name = "NAME-OR-FILE"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        return value if value in OBSERVERS else read_sensor(value)


class LightPaths(click.ParamType):
    """A number of light paths, or auto."""

    name = "N-OR-AUTO"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        return AUTO if value == AUTO else click.FloatRange(0.0, MOST_LIGHT_PATHS)(value, param, ctx)


class Names(click.ParamType):
    """Names of a table, with commas between them."""

    name = "NAMES"

    def __init__(self, known: Iterable[str]):
        self.known = tuple(known)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        given = tuple(str(value).split(","))
        for name in given:
            if name not in self.known:
                self.fail(f"{name!r} is unknown{nearest(name, self.known)}", param, ctx)
        return given


class White(click.ParamType):
    """none, an illuminant, a colour temperature in K such as 3200, or a chromaticity x,y."""

    name = "WHITE"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        try:
            numbers = [float(part) for part in str(value).split(",")]
        except ValueError:
            return value
        return numbers[0] if len(numbers) == 1 else tuple(numbers)


denoise_option = click.option(
    "--denoise", type=click.Choice(METHODS), is_flag=False, flag_value=METHODS[0],
    help="Take noise away: oidn is Open Image Denoise of clpt[denoise]; statistical needs nothing. "
    f"The noisy picture is kept as a layer of .exr.  [default: none; alone: {METHODS[0]}]",
)  # fmt: skip

_OPTIONS = (
    click.option(
        "--mode", type=click.Choice(["spectral", "rgb"]), help="Whether light is spectra or RGB."
    ),
    click.option("--size", type=Size(), help="Size of the picture."),
    click.option(
        "--device", metavar="NAME-OR-INDEX",
        help="Where to render, see `clpt devices`: one, or 0,2, all, gpu (all GPUs).",
    ),
    click.option("--threads", type=click.IntRange(1), help="Cores of a CPU to use, at most."),
    click.option(
        "--bvh", "layout", type=click.Choice([*LAYOUTS]),
        help="Acceleration structure of the triangles.",
    ),
    click.option(
        "--tree-quality", type=click.Choice(get_args(Quality)), default="high",
        help="fast: built sooner, a little slower to trace.",
    ),
    click.option(
        "--integrator", metavar="NAME", help=f"One of {', '.join(kinds('integrator'))}."
    ),
    click.option(
        "--sampler", type=click.Choice([*kinds("sampler")]),
        help="Where random numbers come from.",
    ),
    click.option(
        "--max-depth", type=click.IntRange(-1), help="Longest path, at most 4000; -1: no limit."
    ),
    click.option(
        "--light-paths", type=LightPaths(),
        help="Of path and vcm: paths from lights for each sample, for caustics. Of path, 0: none; "
        "auto: some where something is sharp and a light is small.",
    ),
    click.option(
        "--guiding", is_flag=True, default=None,
        help="Of path: learn first where light comes from, for rooms that are lit through a door.",
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
        "--output-space", type=click.Choice(spaces.SPACES), help="Colour space of the picture."
    ),
    click.option(
        "--bands", type=click.IntRange(0), help="Bands of a spectral picture, for .npy and .exr."
    ),
    click.option("--lambda-min", type=float, help="Shortest wavelength of the light [nm]."),
    click.option(
        "--lambda-max", type=float, help="Longest wavelength; fluorescence needs 300 to 830."
    ),
    click.option(
        "--layers", type=Names(LAYERS), metavar="NAME,..",
        help=f"Pictures beside the picture, for .exr: {', '.join(LAYERS)}.",
    ),
    click.option(
        "--alpha", is_flag=True, default=None, help="Leave the sky out, and write what is covered."
    ),
    loading_options,
    click.option(
        "--texture-budget", type=Bytes(), metavar="SIZE",
        help="Memory for images, such as 500M; larger ones are halved.  [default: half the free]",
    ),
    click.option(
        "--missing-textures", type=click.Choice(get_args(Missing)), default="error",
        help="grey: go on with grey where an image is not there.",
    ),
)  # fmt: skip


def scene_options(command: Command) -> Command:
    """Give a command the options that `open_renderer` takes."""
    return with_options(composition_options(command), _OPTIONS)


def open_renderer(
    scene: Path,
    shown: Display,
    resources: ExitStack,
    accept: Callable[[Scene], None] | None = None,
    *,
    first_sample: int = 0,
    layout: str | None,
    tree_quality: Quality,
    texture_budget: int | None,
    **options: Any,
) -> tuple[AnyRenderer, float]:
    """Return a renderer of a scene file, and the seconds that the file took.

    accept: called with the scene, before anything is built for it; first_sample: see
    `RenderOptions`; the others as of `open_scene`.
    """
    made: dict[str, Any] = {
        "texture_budget": texture_budget, "layout": layout, "tree_quality": tree_quality,
        "first_sample": first_sample, "denoise": options["denoise"],
    }  # fmt: skip
    with prompt(dev.kill_compilers):
        plan, devices, loading = open_scene(scene, shown, resources, accept, **options)
        with shown.phase(f"building kernels for {' and '.join(on.info.name for on in devices)}"):
            renderer = new_renderer(plan, devices, **made)
    for warning in renderer.warnings:
        shown.note(f"clpt: warning: {warning}")
    return renderer, loading


def open_scene(
    scene: Path,
    shown: Display,
    resources: ExitStack,
    accept: Callable[[Scene], None] | None = None,
    *,
    profiling: bool = False,
    device: str | None,
    threads: int | None,
    variables: dict[str, Any],
    missing_textures: Missing,
    **changes: Any,
) -> tuple[Scene, list[dev.Device], float]:
    """Return the scene of a file, the devices, and the seconds that the file took.

    resources: get the processes that compile beside this one; accept: called with the scene;
    changes: see `changed`.
    """
    began = time.perf_counter()
    with ThreadPoolExecutor(max_workers=1) as beside:
        chosen = beside.submit(choose_devices, device, profiling=profiling, threads=threads)
        with shown.loading(scene.name) as tell:
            loaded = load(scene, progress=tell, missing_textures=missing_textures, **variables)
            plan = changed(loaded, **changes)
        loading = time.perf_counter() - began
        if accept is not None:
            accept(plan)
        check(plan)
        devices = chosen.result()
    share_compilers(devices, threads, resources)
    for warning in plan.warnings:
        shown.note(f"clpt: warning: {warning}")
    if plan.film.filtering != loaded.film.filtering:
        shown.note("for the denoiser each pixel has its own samples: film.filtering is importance")
    return plan, devices, loading


def new_renderer(plan: Scene, devices: list[dev.Device], **made: Any) -> AnyRenderer:
    """Return a renderer on one device, or on several."""
    if len(devices) > 1:
        return MultiRenderer(plan, devices, **made)
    return Renderer(plan, devices[0], **made)


def choose_devices(which: str | None, *, profiling: bool, threads: int | None) -> list[dev.Device]:
    """Open what --device names."""
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]


def share_compilers(
    devices: list[dev.Device], threads: int | None, resources: ExitStack
) -> None:
    """Let other processes compile for devices whose driver compiles one text at a time."""
    slow = [on for on in devices if on.info.compiles_singly]
    spare = min([dev.spare_cores(), *((threads or on.info.compute_units) - 1 for on in slow)])
    if slow and spare > 0:
        compilers = resources.enter_context(dev.Compilers(spare))
        for on in slow:
            on.compilers = compilers


def changed(
    scene: Scene,
    *,
    mode: str | None = None,
    spp: int | None = None,
    noise: float | None = None,
    size: tuple[int, int] | None = None,
    seed: int | None = None,
    integrator: str | None = None,
    sampler: str | None = None,
    max_depth: int | None = None,
    light_paths: float | str | None = None,
    radius: float | None = None,
    guiding: bool | None = None,
    camera: Orbit | None = None,
    crop: tuple[Span, Span] | None = None,
    env: Path | None = None,
    env_rotation: float | None = None,
    denoise: str | None = None,
    **film: Any,
) -> Scene:
    """Return the scene with those settings replaced that are not None; `film`: of its film.

    camera, crop, env, env_rotation: see `composition.composed`.

    Raises click.BadParameter, and SceneError for an invalid film.
    """
    film = {name: value for name, value in {"mode": mode, **film}.items() if value is not None}
    film |= {} if size is None else {"width": size[0], "height": size[1]}
    film |= {} if crop is None else {"crop": None}  # that of the file may not fit the new size
    if noise is not None:
        scene = dataclasses.replace(scene, noise=noise or None)
    given: dict[str, Any] = {"spp": spp, "seed": seed}
    given["sampler"] = None if sampler is None else kinds("sampler")[sampler]()
    given["film"] = dataclasses.replace(scene.film, **film)
    if integrator is not None and integrator != scene.integrator.kind:
        given["integrator"] = _integrator(integrator, scene.integrator)
    how: Any = given.get("integrator", scene.integrator)
    if isinstance(how, Auto):  # a number of light paths, or a radius, is a choice
        of_path = light_paths is not None or guiding is not None
        wanted = "vcm" if radius is not None else "path" if of_path else "auto"
        how = _integrator(wanted, how)
    for name, value, what in (
        ("max_depth", max_depth, "depth"), ("light_paths", light_paths, "light paths beside it"),
        ("radius", radius, "photons"), ("guiding", guiding, "guiding"),
    ):  # fmt: skip
        if value is None:
            continue
        if not hasattr(how, name):
            message = f"the integrator {how.kind} has no {what}"
            raise click.BadParameter(message, param_hint=f"--{name.replace('_', '-')}")
        how = given["integrator"] = dataclasses.replace(how, **{name: value})
    scene = dataclasses.replace(scene, **{k: v for k, v in given.items() if v is not None})
    scene = composed(scene, camera=camera, crop=crop, env=env, env_rotation=env_rotation)
    return prepared(scene, denoise)


def _integrator(name: str, old: Kind) -> Any:
    """Return an integrator of another kind, with the parameters that both have."""
    known = kinds("integrator")
    if name not in known:
        message = NO_AOV if name == "aov" else f"{name!r} is none of {', '.join(known)}"
        raise click.BadParameter(message, param_hint="--integrator")
    shared = params(known[name]).keys() & params(type(old)).keys()
    given = {key: getattr(old, key) for key in shared}
    if name == "vcm" and "light_paths" in given:  # a whole number, 1 or more
        number = given.pop("light_paths")
        given |= {} if number == AUTO else {"light_paths": max(round(number), 1)}
    return known[name](**given)
