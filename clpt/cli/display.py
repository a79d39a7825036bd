"""The progress of a render on stderr: a bar on a terminal, else a line every few seconds."""

from __future__ import annotations

import re
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

from ..render.progress import Progress
from .process import terminal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from ..formats.reading import Progress as LoadProgress


EVERY = 5.0  # seconds between lines
PATIENCE = 1.0  # seconds of reading or compiling before a line or a bar tells of it
WIDE, NARROW, ROOMY = 24, 10, 100  # columns of a wide bar, of a narrow bar, of a wide terminal
REFRESH = 0.1  # seconds between changes of the bar
LONGEST_NAME = 16  # characters of a scene's name beside the bar


def display(quiet: bool, limit: float | None, name: str = "") -> Display:
    """Return the display that suits stderr.

    limit: seconds that the render may take, or None; name: of the scene.
    """
    if quiet:
        return Display(limit, name)
    return Bar(limit, name) if sys.stderr.isatty() else Lines(limit, name)


class Programs:
    """Counts programs that are compiled; changed: called under a lock after each change."""

    def __init__(self, changed: Callable[[], None] = lambda: None):
        self._begun: set[str] = set()
        self._ended: set[str] = set()
        self._changed, self._lock = changed, threading.Lock()

    def begin(self, key: str) -> None:
        """Note that a program is about to be compiled."""
        self._note(key, self._begun)

    def end(self, key: str) -> None:
        """Note that a program has been compiled."""
        self._note(key, self._ended)

    def _note(self, key: str, keys: set[str]) -> None:
        with self._lock:
            if key not in keys:
                keys.add(key)
                self._changed()

    @property
    def begun(self) -> int:
        """The number of programs that a compiler has, or has had."""
        return len(self._begun)

    @property
    def ended(self) -> int:
        """The number of programs that are ready."""
        return len(self._ended)

    @property
    def told(self) -> str:
        """The count of ready programs, for people."""
        return f"{self.ended} of {self.begun}, once for this kind of scene"


class Display:
    """Shows nothing; the base of displays."""

    def __init__(self, limit: float | None = None, name: str = ""):
        self.limit, self.name = limit, terminal.cleaned(name)
        self.last = time.perf_counter()
        self.since: tuple[float, float] | None = None

    @contextmanager
    def phase(self, text: str) -> Iterator[None]:
        """Show a text meanwhile."""
        yield

    @contextmanager
    def compiling(self, text: str) -> Iterator[Programs]:
        """Yield a count of programs, which threads that compile advance; show it if it lasts."""
        yield Programs()

    def begin(self, text: str) -> None:
        """Show a text at once, until something else is shown."""

    @contextmanager
    def loading(self, name: str) -> Iterator[LoadProgress]:
        """Yield a function that shows the share of the scene `name` that is read."""
        yield lambda fraction, step: None

    @contextmanager
    def rendering(self) -> Iterator[None]:
        """Enclose the calls of `show`."""
        yield

    def show(self, progress: Progress) -> None:
        """Show the progress, if it is due."""

    def note(self, text: str) -> None:
        """Print a line that stays."""

    def due(self, progress: Progress, every: float) -> bool:
        """Return whether the render ended, or `every` seconds passed since this last was true."""
        end = bool(progress.total) and progress.samples >= progress.total
        if not end and time.perf_counter() - self.last < every:
            return False
        self.last = time.perf_counter()
        return True

    def fraction(self, progress: Progress) -> float:
        """Return the share of the render that is done: of samples, pixels or time, the largest."""
        done = progress.samples / progress.total if progress.total else 0.0
        done = max(done, 1.0 - progress.active)
        return min(1.0, max(done, progress.seconds / self.limit if self.limit else 0.0))

    def figures(self, progress: Progress) -> dict[str, str]:
        """Return what is shown; the time left is estimated from the first `progress` on.

        Before that many devices compile kernels, at another speed.
        """
        fraction = self.fraction(progress)
        self.since = self.since or (progress.seconds, fraction)
        return figures(progress, fraction, self.since)


class Lines(Display):
    """A line for every phase and every few seconds."""

    @contextmanager
    def phase(self, text: str) -> Iterator[None]:
        self.note(f"{text} ...")
        yield

    @contextmanager
    def compiling(self, text: str) -> Iterator[Programs]:
        timer = threading.Timer(PATIENCE, lambda: self.note(f"{text}: {programs.told} ..."))
        timer.daemon = True

        def begun() -> None:
            if programs.begun == 1 and not programs.ended:
                timer.start()

        programs = Programs(begun)
        try:
            yield programs
        finally:
            timer.cancel()

    @contextmanager
    def loading(self, name: str) -> Iterator[LoadProgress]:
        last = time.perf_counter()

        def tell(fraction: float, step: str) -> None:
            nonlocal last
            if time.perf_counter() - last >= EVERY:
                last = time.perf_counter()
                self.note(f"reading {name}: {step}")

        yield tell

    def show(self, progress: Progress) -> None:
        numbers = self.figures(progress)
        if self.due(progress, EVERY):
            self.note("  ".join(filter(None, numbers.values())))

    def note(self, text: str) -> None:
        terminal.say(text)


class Bar(Lines):
    """A spinner for every phase, then a bar."""

    def __init__(self, limit: float | None = None, name: str = ""):
        super().__init__(limit, name)
        self._begun = False  # whether the text of `begin` stands on the screen

    def begin(self, text: str) -> None:
        terminal.say(text, nl=False)  # before rich is imported, which takes its time
        self._begun = True

    @cached_property
    def console(self) -> Console:
        """The terminal, without the text of `begin`."""
        from rich.console import Console

        if self._begun:
            terminal.clear_line()
        return Console(stderr=True, highlight=False)

    @contextmanager
    def phase(self, text: str) -> Iterator[None]:
        with self.console.status(self._shown(f"{text} ...")):
            yield

    def _shown(self, text: str) -> Text:
        """Return a text without control characters and markup."""
        from rich.text import Text

        return Text(terminal.cleaned(text))

    @contextmanager
    def compiling(self, text: str) -> Iterator[Programs]:
        from rich.progress import BarColumn, SpinnerColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(NARROW),
            TextColumn("{task.fields[told]}", markup=False),
        )
        bar = RichProgress(*columns, console=self.console, transient=True)
        task = bar.add_task(self.name[:LONGEST_NAME], total=None, told="")

        def changed() -> None:
            bar.update(
                task, description=terminal.cleaned(text), total=programs.begun,
                completed=programs.ended, told=programs.told,
            )  # fmt: skip

        programs = Programs(changed)
        with bar:
            yield programs

    @contextmanager
    def loading(self, name: str) -> Iterator[LoadProgress]:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = (
            TextColumn("reading {task.fields[name]}", markup=False),
            BarColumn(24),
            TextColumn("{task.description}", markup=False),
        )
        bar = RichProgress(*columns, console=self.console, transient=True)
        task, began = bar.add_task("", total=1.0, name=terminal.cleaned(name)), time.perf_counter()

        def tell(fraction: float, step: str) -> None:
            if time.perf_counter() - began >= PATIENCE:
                bar.start()
                bar.update(task, completed=fraction, description=terminal.cleaned(step))

        try:
            yield tell
        finally:
            bar.stop()

    @contextmanager
    def rendering(self) -> Iterator[None]:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = [TextColumn(f"{{task.fields[{name}]}}") for name in FIGURES if name != "open"]
        width = WIDE if self.console.width >= ROOMY else NARROW
        name = TextColumn("{task.description}", markup=False)
        shape = BarColumn(width, complete_style="cyan", finished_style="green")
        bar = RichProgress(name, shape, *columns, console=self.console, auto_refresh=False)
        nothing: dict[str, Any] = dict.fromkeys(FIGURES, "")
        self._task = bar.add_task(self.name[:LONGEST_NAME], total=1.0, **nothing)
        with bar:
            self._bar = bar
            yield

    def show(self, progress: Progress) -> None:
        fields: dict[str, Any] = self.figures(progress)
        if self.due(progress, REFRESH):
            self._bar.update(self._task, completed=self.fraction(progress), **fields)
            self._bar.refresh()

    def note(self, text: str) -> None:
        self.console.print(self._shown(text))


FIGURES = ("samples", "open", "noise", "rays", "elapsed", "left")


def figures(
    progress: Progress, fraction: float, since: tuple[float, float] = (0.0, 0.0)
) -> dict[str, str]:
    """Return what is shown, by the names in FIGURES.

    fraction: of the render that is done; since: seconds and fraction at the start of the estimate
    of speed.
    """
    seconds, done = max(progress.seconds, 1e-9), fraction - since[1]
    left = f"{clock((seconds - since[0]) * (1.0 - fraction) / done)} left" if done > 0.0 else ""
    samples = f"{int(progress.samples)}{f'/{progress.total}' if progress.total else ''} spp"
    noise = "" if progress.noise is None else f"noise {percent(progress.noise)}"
    return {
        "samples": samples,
        "open": f"{progress.active:.0%} of the pixels left" if progress.active < 1.0 else "",
        "noise": noise,
        "rays": f"{progress.rays / seconds * 1e-6:.3g} Mrays/s",
        "elapsed": clock(progress.seconds),
        "left": left,
    }


def percent(share: float) -> str:
    """Return a share in percent, with two digits."""
    return f"{float(f'{100.0 * share:.2g}'):g} %"


def clock(seconds: float) -> str:
    """Return a time as m:ss or h:mm:ss."""
    minutes, seconds_left = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds_left:02}" if hours else f"{minutes}:{seconds_left:02}"


PLATFORMS = {  # names that people use
    "Portable Computing Language": "PoCL",
    "AMD Accelerated Parallel Processing": "AMD",
    "NVIDIA CUDA": "NVIDIA",
    "Intel(R) OpenCL": "Intel",
    "Intel(R) OpenCL Graphics": "Intel",
}
_MARKS = re.compile(r"\((?:R|TM|C)\)|\bCPU\b|@ ?[\d.]+ ?GHz|\b\d+-Core Processor\b", re.IGNORECASE)
_TARGET = re.compile(r"^(?:pthread|cpu)-(?:[a-z0-9_.-]*-)?(?=[A-Z])")  # PoCL's driver and target


class Named(Protocol):
    """A device: the names that OpenCL gives it."""

    @property
    def platform(self) -> str: ...

    @property
    def name(self) -> str: ...


def device_name(info: Named) -> str:
    """Return platform and device without marks and what says nothing: PoCL AMD EPYC."""
    platform = " ".join(PLATFORMS.get(info.platform, _MARKS.sub("", info.platform)).split())
    name = " ".join(_MARKS.sub("", _TARGET.sub("", info.name)).split())
    return name if name.startswith(platform) else f"{platform} {name}"


def device_names(infos: Sequence[Named]) -> str:
    """Return the names of several devices: 4 x NVIDIA H100 where they are alike."""
    names = [device_name(info) for info in infos]
    counted = [(names.count(name), name) for name in dict.fromkeys(names)]
    return " and ".join(name if count == 1 else f"{count} x {name}" for count, name in counted)
