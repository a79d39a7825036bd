"""Messages between page and session: commands with their types and ranges, and replies as JSON."""

from __future__ import annotations

import json
import logging
import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Protocol

from clpt.arrays import is_flag, is_number, is_whole
from clpt.errors import ClptError, KernelBuildError, SceneError, one_line
from clpt.images.colour import TONES
from clpt.spectra import illuminants

log = logging.getLogger(__name__)

QUOTED_FOLDER = re.compile(r"""(?<=['"])(?:[A-Za-z]:)?[/\\][^'"\n]*[/\\]""")
FOLDER = re.compile(r"""(?<![\w.~-])(?:[A-Za-z]:)?[/\\][^\s'"]*[/\\]""")
# A folder that `one_line` has cut, in an error that quotes the text of another.
CUT_NAME = re.compile(r"""(?<=['"])(?:[A-Za-z]:)?[/\\][^'"\n]* \.\.\. (?:[^'"]*[/\\])?""")
CUT_FOLDER = re.compile(r"""(?<= \.\.\. )[^'"]*[/\\]""")

PREPARING: Final[dict[str, Any]] = {"type": "status", "phase": "preparing"}
Reply = Callable[[dict[str, Any]], None]
OF_VIEW = "view"  # of OpenColorIO, in the place of a tone curve
TARGETS = ("camera", "film", "light", "emission", "material", "integrator")
FILES = ("png", "exr", "scene", "view")
LARGEST_MESSAGE = 64 * 1024  # [bytes]
DEEPEST, MOST_PARTS = 16, 4096  # levels and numbers, names and lists of a value


def as_json(message: object) -> str:
    """Return a message as JSON; what is no finite number is null."""
    try:
        return json.dumps(message, allow_nan=False)
    except ValueError:
        return json.dumps(finite(message))


def finite(value: object) -> Any:
    """Return a message with None in place of numbers that are not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(child) for key, child in value.items()}
    return [finite(child) for child in value] if isinstance(value, (list, tuple)) else value


def error_message(error: BaseException, before: str = "") -> dict[str, Any]:
    """Return a viewer's message about an error, on a single line.

    before: begins the line. A file has its name there, not its folder.
    """
    text = f"{before}{_reason(error)}"
    for folder in (CUT_NAME, QUOTED_FOLDER, FOLDER, CUT_FOLDER):
        text = folder.sub("", text)
    return {"type": "error", "text": one_line(text)}


@contextmanager
def answering(reply: Reply, before: str = "") -> Iterator[None]:
    """Let whatever is raised be an answer: no message, whatever it holds, ends a viewer."""
    try:
        yield
    except Exception as error:
        log.debug("a message failed", exc_info=True)
        reply(error_message(error, before))


def _reason(error: BaseException) -> str:
    if isinstance(error, SceneError):
        line = f"line {error.line}" if error.line is not None else None
        name = None if error.file is None else Path(error.file).name
        return ": ".join(part for part in (name, line, error.whole) if part)
    if isinstance(error, KernelBuildError):
        return f"the kernel program {error.stage!r} did not build"
    if isinstance(error, ClptError):
        return error.whole
    if isinstance(error, MemoryError):
        return "there is not enough memory"
    if isinstance(error, OSError):
        return error.strerror or "a file cannot be read or written"
    return f"a fault of clpt ({type(error).__name__})"


class CommandError(ClptError):
    """A message without a command, or a command that fails; its text is for the viewer."""


class Type(Protocol):
    """A type of a parameter."""

    def check(self, value: object) -> Any:
        """Return the value. Raises CommandError."""


@dataclass(frozen=True)
class Number:
    """A finite number from low to high."""

    low: float
    high: float

    def check(self, value: object) -> float:
        if not is_number(value):
            raise CommandError(f"must be a number, not {_shown(value)}")
        if not self.low <= value <= self.high:  # a NaN is neither
            raise CommandError(f"must be {self.low:g} to {self.high:g}, not {_shown(value)}")
        return float(value)


@dataclass(frozen=True)
class Whole:
    """A whole number from low to high."""

    low: int
    high: int

    def check(self, value: object) -> int:
        if not is_whole(value):
            raise CommandError(f"must be a whole number, not {_shown(value)}")
        if not self.low <= value <= self.high:
            raise CommandError(f"must be {self.low} to {self.high}, not {_shown(value)}")
        return value


@dataclass(frozen=True)
class Flag:
    """True or false."""

    def check(self, value: object) -> bool:
        if not is_flag(value):
            raise CommandError(f"must be true or false, not {_shown(value)}")
        return value


@dataclass(frozen=True)
class Choice:
    """A name among several."""

    names: tuple[str, ...]

    def check(self, value: object) -> str:
        if not isinstance(value, str) or value not in self.names:
            raise CommandError(f"must be one of {', '.join(self.names)}, not {_shown(value)}")
        return value


@dataclass(frozen=True)
class Name:
    """A word of letters, digits, _ and -, which names no folder."""

    longest: int = 40

    def check(self, value: object) -> str:
        pattern = rf"[A-Za-z0-9_][A-Za-z0-9_-]{{0,{self.longest - 1}}}"
        if not isinstance(value, str) or not re.fullmatch(pattern, value):
            raise CommandError(f"must be a word, not {_shown(value)}")
        return value


@dataclass(frozen=True)
class Value:
    """A JSON value for a parameter of the scene, whose own declaration checks it.

    `clpt.view.panels.read` takes it, and lets it name no file.
    """

    def check(self, value: object) -> Any:
        if _check_value(value, DEEPEST) > MOST_PARTS:
            raise CommandError(f"has more than {MOST_PARTS} parts")
        return value


@dataclass(frozen=True)
class Optional:
    """A value of a type, or null, which is the default."""

    type: Type

    def check(self, value: object) -> Any:
        return None if value is None else self.type.check(value)


@dataclass(frozen=True)
class Command:
    """A command.

    parameters: types by name; all but `Optional` parameters are required. steers: only the viewer
    who steers may send it. restarts: the picture so far is of no use afterwards. quick: it does not
    wait for the samples of the present pass.
    """

    doc: str
    parameters: Mapping[str, Type] = field(default_factory=dict)
    steers: bool = True
    restarts: bool = False
    certain: bool = False
    quick: bool = False


@dataclass(frozen=True)
class Request:
    """A command that has passed all checks."""

    name: str
    values: dict[str, Any]


DRAG = Number(-20.0, 20.0)  # heights of the picture
PIXEL = Whole(0, 65535)
SIDE = Whole(1, 65536)
LENGTH = Whole(1, 16384)  # [pixels] of a film
MANY = Whole(0, 2**31 - 1)

COMMANDS: dict[str, Command] = {
    # of a viewer
    "shown": Command("a frame is on the screen", {"frame": Whole(0, 2**53)}, steers=False),
    "steer": Command("take the wheel", steers=False),
    "invite": Command("make an address that opens the page once, for somebody else"),
    # the camera
    "orbit": Command("turn about the pivot", {"dx": DRAG, "dy": DRAG}, restarts=True, certain=True),
    "look": Command("turn the head", {"dx": DRAG, "dy": DRAG}, restarts=True, certain=True),
    "pan": Command("move across the view", {"dx": DRAG, "dy": DRAG}, restarts=True, certain=True),
    "dolly": Command(
        "come nearer, in powers of e", {"by": Number(-5.0, 5.0)}, restarts=True, certain=True
    ),
    "fly": Command(
        "move by shares of the distance to the pivot",
        {"right": DRAG, "up": DRAG, "forward": DRAG},
        restarts=True,
        certain=True,
    ),
    "home": Command("the camera that the scene's file has", restarts=True, certain=True),
    "open_view": Command(
        "look as a view does that was saved or copied",
        {
            "camera": Value(),
            "exposure": Number(-20.0, 20.0),
            "tone": Choice((*TONES, OF_VIEW)),
        },
        restarts=True,
    ),
    "look_at": Command("tell where the camera is and looks", steers=False, quick=True),
    "copy_view": Command("tell the view, to be kept elsewhere", steers=False, quick=True),
    "field_of_view": Command(
        "of a perspective camera", {"degrees": Number(0.1, 170.0)}, restarts=True
    ),
    "pick": Command("let the pivot be what a pixel shows", {"x": PIXEL, "y": PIXEL}, quick=True),
    "focus": Command("focus on what a pixel shows", {"x": PIXEL, "y": PIXEL}, quick=True),
    # pixels
    "inspect": Command(
        "tell what is in a pixel, and its spectrum",
        {"x": PIXEL, "y": PIXEL},
        steers=False,
        quick=True,
    ),
    "value": Command(
        "tell what the picture has in a pixel", {"x": PIXEL, "y": PIXEL}, steers=False, quick=True
    ),
    # the scene
    "edit": Command(
        "give a parameter another value",
        {"target": Choice(TARGETS), "index": MANY, "key": Name(), "value": Value()},
        restarts=True,
    ),
    "undo": Command("take back the last change of the scene", restarts=True),
    "redo": Command("make the change again that was taken back", restarts=True),
    "size": Command("render so many pixels", {"width": LENGTH, "height": LENGTH}, restarts=True),
    "restore": Command("the scene as its file has it", restarts=True),
    "hide": Command("leave an object out", {"shape": MANY, "hidden": Flag()}, restarts=True),
    "hide_at": Command("leave out what a pixel shows", {"x": PIXEL, "y": PIXEL}),
    "show_all": Command("leave no object out", restarts=True),
    "lamp": Command(
        "give all lights the spectrum of a lamp",
        {"name": Optional(Choice(illuminants()))},
        restarts=True,
    ),
    "wavelength": Command(
        "show one wavelength alone [nm]",
        {"nm": Optional(Number(300.0, 830.0)), "width": Number(0.5, 100.0)},
        restarts=True,
    ),
    "region": Command(
        "render a part of the film, or all of it",
        {
            "x": Optional(PIXEL),
            "y": Optional(PIXEL),
            "width": Optional(SIDE),
            "height": Optional(SIDE),
        },
        restarts=True,
    ),
    # the render
    "display": Command(
        "how the picture is shown",
        {"exposure": Number(-20.0, 20.0), "tone": Choice((*TONES, OF_VIEW))},
        quick=True,
    ),
    "shows": Command("show the picture, a layer or a map", {"name": Name()}),
    "pause": Command("let the picture rest, or go on", {"paused": Flag()}),
    "stop_at": Command(
        "where the render ends: samples, and perhaps noise",
        {"spp": Whole(1, 2**31 - 1), "noise": Optional(Number(1e-4, 1.0))},
    ),
    "restart": Command("begin again", restarts=True, certain=True),
    "keep": Command("keep the picture to compare with, or keep none", {"kept": Flag()}),
    "statistics": Command("tell what the render takes", steers=False, quick=True),
    "save": Command("write a new file into the folder", {"what": Choice(FILES)}),
}


def parse(message: str | bytes) -> Request:
    """Return the command that a message of JSON is. Raises CommandError."""
    if not isinstance(message, str):
        raise CommandError("a message is text")
    if len(message) > LARGEST_MESSAGE:
        raise CommandError("the message is too long")
    try:
        decoded = json.loads(message, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise CommandError("the message is not JSON") from None
    return checked(decoded)


def checked(message: object) -> Request:
    """Return the command that a message is, with values of its declared types.

    Here alone a command is looked up. Raises CommandError.
    """
    if not isinstance(message, dict) or not isinstance(message.get("do"), str):
        raise CommandError("a message is an object that says what to do")
    name = message["do"]
    command = COMMANDS.get(name)
    if command is None:
        raise CommandError(f"there is no command {_shown(name)}")
    for key in message:
        if key != "do" and key not in command.parameters:
            raise CommandError(f"{name} has no parameter {_shown(key)}")
    values = {}
    for key, kind in command.parameters.items():
        if key not in message and not isinstance(kind, Optional):
            raise CommandError(f"{name} needs {key}")
        try:
            values[key] = kind.check(message.get(key))
        except CommandError as error:
            raise CommandError(f"{name}: {key} {error}") from None
    return Request(name, values)


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is not JSON")


def _shown(value: object) -> str:
    """Return a value for a message, cut short."""
    try:
        text = json.dumps(value)
    except (ValueError, RecursionError):  # a number of thousands of digits
        return "that"
    return text if len(text) <= 40 else f"{text[:40]}..."


def _check_value(value: object, levels: int) -> int:
    """Return how many parts a value has.

    Raises CommandError for values nested too deeply, and numbers too large or not finite.
    """
    if levels == 0:
        raise CommandError("is nested too deeply")
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return 1 + sum(_check_value(child, levels - 1) for child in value)
    if isinstance(value, (int, float)) and not -1e30 <= value <= 1e30:
        raise CommandError("has a number that is too large")
    return 1
