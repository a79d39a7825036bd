"""Options that say how light becomes the colours of a .png."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...choices import CHANNEL_NAMES, FOR_SCREENS, OCIO_CONFIG, TONES, Exposure
from .records import Command, with_options
from .values import Choice, Stops

if TYPE_CHECKING:
    from clpt.images.colour import View


@dataclass(frozen=True)
class Grading:
    """The form of pictures in files.

    exposure [stops], or "auto"; tone: a curve of clpt.images.colour; view: of OpenColorIO,
    instead;
    names: of channels of an .exr, a set of clpt.choices.CHANNEL_NAMES.
    """

    exposure: Exposure = 0.0
    tone: str = "none"
    view: View | None = None
    names: str = CHANNEL_NAMES[0]

    def unused(self, targets: tuple[Path, ...]) -> str | None:
        """Return a sentence on options that concern none of the files, None without such."""
        used = {
            "--exposure": self.exposure != 0.0,
            "--tone": self.tone != "none",
            "--view": self.view is not None,
        }
        names = [name for name, was in used.items() if was]
        if not names or for_screens(targets):
            return None
        suffixes = " ".join(FOR_SCREENS)
        return (
            f"{' and '.join(names)} ignored: for {suffixes} only; other formats keep linear light"
        )


def for_screens(targets: tuple[Path, ...]) -> list[Path]:
    """Return the files that exposure and tone curve concern."""
    return [path for path in targets if path.suffix.lower() in FOR_SCREENS]


@dataclass(frozen=True)
class GradingOptions:
    """The options of `grading_options` and `names_option`."""

    exposure: Exposure
    tone: str | None
    view: str | None
    display: str | None
    look: str | None
    ocio: str
    names: str = CHANNEL_NAMES[0]

    @cached_property
    def grading(self) -> Grading:
        """The grading that the options ask for. Raises SceneError, click.UsageError."""
        if not (self.view or self.display or self.look):
            if self.ocio != OCIO_CONFIG:
                raise click.UsageError("--ocio needs --view or --display")
            return Grading(self.exposure, self.tone or "none", names=self.names)
        if self.tone is not None:
            raise click.UsageError("a view has its own tone curve; leave out --tone")
        from clpt.images.colour import View  # here: help needs no numpy

        seen = View(self.view, display=self.display, look=self.look, config=self.ocio)
        return Grading(self.exposure, view=seen, names=self.names)


_OPTIONS = (
    click.option(
        "--exposure", type=Stops(), default=0.0,
        help="Brighten .png, .jpg and .webp by so many stops; auto: to a middle grey.",
    ),
    click.option(
        "--tone", type=Choice(TONES),
        help="Tone curve of .png, .jpg and .webp.  [default: none]",
    ),
    click.option(
        "--view", metavar="NAME", help="Make .png by this view of OpenColorIO: clpt[colour]."
    ),
    click.option("--display", metavar="NAME", help="The display of the view."),
    click.option("--look", metavar="NAME", help="A look before the view."),
    click.option(
        "--ocio", metavar="CONFIG", default=OCIO_CONFIG, show_default=True,
        help="Where views are from: a config.ocio, ocio://NAME, or $OCIO.",
    ),
)  # fmt: skip

names_option = click.option(
    "--names", type=Choice(CHANNEL_NAMES), default=CHANNEL_NAMES[0], show_default=True,
    help="What .exr files call layers: depth.Z, or ViewLayer.Denoising Depth.Z.",
)  # fmt: skip


def grading_options(command: Command) -> Command:
    """Give a command the options of the record `GradingOptions`."""
    return with_options(command, _OPTIONS)
