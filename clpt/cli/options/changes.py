"""Options change a scene: its samples, film, light transport, camera and surroundings."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import click

from .records import Command, record_of, with_options

NEAREST, FARTHEST = 1e-3, 1e6  # of an orbit, in distances that frame the scene

# A camera that looks at the middle of a scene. Azimuth [degrees]: 0 is in front, 90 on the right;
# elevation [degrees]: 90 is above; distance: 1 frames the whole scene.
Orbit: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Span:
    """Columns or rows of a picture, from `first` to `end`, which is excluded.

    Each is a number of pixels and False, or a share of the picture [percent] and True.
    """

    first: tuple[float, bool]
    end: tuple[float, bool]

    def of(self, size: int) -> tuple[int, int]:
        """Return the first pixel and how many there are, of `size`. Raises click.BadParameter."""
        first, end = (
            round(size * number / 100.0) if share else int(number)
            for number, share in (self.first, self.end)
        )
        if not first < end <= size:
            message = f"{first}:{end} is no part of the picture's {size} pixels"
            raise click.BadParameter(message, param_hint="--crop")
        return first, end - first


@dataclass(frozen=True)
class FilmChanges:
    """Parameters of a film, by their names there; size: width and height in pixels."""

    mode: str | None = None
    size: tuple[int, int] | None = None
    sensor: object = None
    white_balance: str | float | tuple[float, float] | None = None
    output_space: str | None = None
    bands: int | None = None
    time_bins: int | None = None
    time_min: float | None = None
    time_max: float | None = None
    lambda_min: float | None = None
    lambda_max: float | None = None
    layers: tuple[str, ...] | None = None
    alpha: bool | None = None

    def values(self) -> dict[str, Any]:
        """Return the parameters that options set, by their names in the film."""
        values = {name: value for name, value in vars(self).items() if value is not None}
        width_height = values.pop("size", None)
        if width_height is not None:
            values["width"], values["height"] = width_height
        return values


@dataclass(frozen=True)
class Transport:
    """Kinds of integrator and sampler, and parameters of the integrator."""

    integrator: str | None = None
    sampler: str | None = None
    max_depth: int | None = None
    light_paths: float | str | None = None
    radius: float | None = None
    guiding: bool | None = None
    reuse: bool | None = None

    @property
    def implied(self) -> str:
        """The kind in the place of "auto": a number of light paths, or a radius, is a choice."""
        of_path = any(x is not None for x in (self.light_paths, self.guiding, self.reuse))
        return "vcm" if self.radius is not None else "path" if of_path else "auto"


@dataclass(frozen=True)
class SceneChanges:
    """Values that replace parameters of a scene, where they are not None.

    noise: that ends the sampling of a pixel, 0: none does; env: an image around the scene;
    env_rotation: of the image about the vertical [degrees].
    """

    film: FilmChanges = FilmChanges()
    transport: Transport = Transport()
    spp: int | None = None
    noise: float | None = None
    seed: int | None = None
    denoise: str | None = None
    camera: Orbit | None = None
    crop: tuple[Span, Span] | None = None
    env: Path | None = None
    env_rotation: float | None = None

    @classmethod
    def of(cls, **options: Any) -> SceneChanges:
        """Return the record of options by their names."""
        return record_of(cls, options)


class CameraType(click.ParamType):
    """AZIMUTH,ELEVATION[,DISTANCE], returned as an Orbit, or a camera's name."""

    name = "AZ,EL[,DIST]|NAME"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Orbit | str:
        if isinstance(value, tuple):
            return value
        text = str(value).strip()
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) < 2:
            if not text:
                self.fail("give degrees such as 45,20, or a camera's number or name", param, ctx)
            return text
        if len(numbers) > 3 or not all(map(math.isfinite, numbers)):
            self.fail(f"{text!r} does not look like 45,20 or 45,20,1.5", param, ctx)
        azimuth, elevation, distance = (*numbers, 1.0)[:3]
        if abs(elevation) > 90.0:
            self.fail(f"the elevation is -90 to 90 degrees, not {elevation:g}", param, ctx)
        if not NEAREST <= distance <= FARTHEST:
            limits = f"{NEAREST:g} to {FARTHEST:g}"
            self.fail(f"the distance is {limits}, not {distance:g}; 1 frames all", param, ctx)
        return azimuth, elevation, distance


class CropType(click.ParamType):
    """X0:X1,Y0:Y1 in pixels or percent; returned as two Spans."""

    name = "X0:X1,Y0:Y1"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[Span, Span]:
        if isinstance(value, tuple):
            return value
        number = r"(?:(\d{1,9}(?:\.\d{1,9})?)(%?))?"
        match = re.fullmatch(rf"{number}:{number},{number}:{number}", str(value).replace(" ", ""))
        if not match:
            message = f"{value!r} does not look like 100:200,50:150 or 25%:75%,0%:50%"
            self.fail(message, param, ctx)
        ends = [
            (float(text or default), bool(share) or not text)
            for text, share, default in zip(
                match.groups()[::2], match.groups()[1::2], ("0", "100") * 2, strict=True
            )
        ]
        if any(not share and number != int(number) for number, share in ends):
            self.fail(f"{value!r}: pixels are whole numbers", param, ctx)
        return Span(*ends[:2]), Span(*ends[2:])


def _named(ctx: click.Context, _: click.Parameter, value: Orbit | str | None) -> Orbit | None:
    """Keep an orbit; a name is the scene's variable `camera`, as loaders know it."""
    if not isinstance(value, str):
        return value
    variables = ctx.params["variables"]
    if "camera" in variables:
        raise click.BadParameter("-D camera= says it already", param_hint="--camera")
    variables["camera"] = value
    return None


_OPTIONS = (
    click.option(
        "--camera", type=CameraType(), callback=_named,
        help="See the whole scene from there: degrees to the right of its front, degrees above "
        "the ground, and how far, where 1 frames it. Or one of the cameras of a glTF or .xml "
        "file, by its number or name; of `render` all: each, to {scene}.{camera}.exr.",
    ),
    click.option(
        "--crop", type=CropType(),
        help="Render this part of the picture only: pixels from the upper left, such as "
        "100:200,50:150, or 25%:75%,:50%.",
    ),
    click.option(
        "--env", type=click.Path(path_type=Path), metavar="FILE",
        help="Surround the scene with this image, such as an .hdr or .exr, in the place of its "
        "sky, and of the light and the ground that bare meshes get.",
    ),
    click.option(
        "--env-rotation", type=click.FloatRange(-360.0, 360.0), metavar="DEGREES",
        help="Turn that image about the vertical, as the azimuth of --camera turns.",
    ),
)  # fmt: skip


def composition_options(command: Command) -> Command:
    """Give a command options of the camera, the crop and the surroundings."""
    return with_options(command, _OPTIONS)
