"""The progress of a render on stderr: a bar on a terminal, else a line every few seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from ...render.progress import Progress

EVERY = 5.0  # seconds between lines
PATIENCE = 1.0  # seconds of reading a scene before there is a bar
REFRESH = 0.1  # seconds between changes of the bar


def display(quiet: bool, limit: float | None) -> Display:
    """Return the display that suits stderr. limit: seconds that the render may take, or None."""
    if quiet:
        return Display(limit)
    return Bar(limit) if sys.stderr.isatty() else Lines(limit)


class Display:
    """Shows nothing; the base of those that do."""

    def __init__(self, limit: float | None = None):
        self.limit = limit
        self.last = time.perf_counter()
        self.since: tuple[float, float] | None = None

    @contextmanager
    def phase(self, text: str) -> Iterator[None]:
        """Show a text meanwhile."""
        yield

    @contextmanager
    def loading(self, name: str) -> Iterator[Callable[[float, str], None]]:
        """Yield a function that shows how much of the scene `name` is read."""
        yield lambda fraction, what: None

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
        """Return the share of the render that is done: of its samples or time, the larger."""
        done = progress.samples / progress.total if progress.total else 0.0
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
    def loading(self, name: str) -> Iterator[Callable[[float, str], None]]:
        last = time.perf_counter()

        def tell(fraction: float, what: str) -> None:
            nonlocal last
            if time.perf_counter() - last >= EVERY:
                last = time.perf_counter()
                self.note(f"reading {name}: {what}")

        yield tell

    def show(self, progress: Progress) -> None:
        numbers = self.figures(progress)
        if self.due(progress, EVERY):
            self.note("  ".join(numbers.values()).rstrip())

    def note(self, text: str) -> None:
        click.echo(text, err=True)


class Bar(Lines):
    """A spinner for every phase, then a bar."""

    def __init__(self, limit: float | None = None):
        super().__init__(limit)
        from rich.console import Console

        self.console = Console(stderr=True, highlight=False)

    @contextmanager
    def phase(self, text: str) -> Iterator[None]:
        with self.console.status(text):
            yield

    @contextmanager
    def loading(self, name: str) -> Iterator[Callable[[float, str], None]]:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = TextColumn(f"reading {name}"), BarColumn(24), TextColumn("{task.description}")
        bar = RichProgress(*columns, console=self.console, transient=True)
        task, began = bar.add_task("", total=1.0), time.perf_counter()

        def tell(fraction: float, what: str) -> None:
            if time.perf_counter() - began >= PATIENCE:
                bar.start()
                bar.update(task, completed=fraction, description=what)

        try:
            yield tell
        finally:
            bar.stop()

    @contextmanager
    def rendering(self) -> Iterator[None]:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = [TextColumn(f"{{task.fields[{name}]}}") for name in FIGURES]
        bar = RichProgress(BarColumn(24), *columns, console=self.console, auto_refresh=False)
        nothing: dict[str, Any] = dict.fromkeys(FIGURES, "")
        self._task = bar.add_task("", total=1.0, **nothing)
        with bar:
            self._bar = bar
            yield

    def show(self, progress: Progress) -> None:
        fields: dict[str, Any] = self.figures(progress)
        if self.due(progress, REFRESH):
            self._bar.update(self._task, completed=self.fraction(progress), **fields)
            self._bar.refresh()

    def note(self, text: str) -> None:
        self.console.print(text, markup=False)


FIGURES = ("samples", "speed", "rays", "elapsed", "left")


def figures(
    progress: Progress, fraction: float, since: tuple[float, float] = (0.0, 0.0)
) -> dict[str, str]:
    """Return what is shown, by the names in FIGURES.

    fraction: of the render that is done; since: the seconds and the fraction from which the speed
    is estimated.
    """
    seconds, done = max(progress.seconds, 1e-9), fraction - since[1]
    left = f"{clock((seconds - since[0]) * (1.0 - fraction) / done)} left" if done > 0.0 else ""
    samples = f"{int(progress.samples)}{f'/{progress.total}' if progress.total else ''} spp"
    left_over = f", {progress.active:.0%} of the pixels left" if progress.active < 1.0 else ""
    return {
        "samples": samples + left_over,
        "speed": f"{progress.paths / seconds * 1e-6:.3g} Msamples/s",
        "rays": f"{progress.rays / seconds * 1e-6:.3g} Mrays/s",
        "elapsed": clock(progress.seconds),
        "left": left,
    }


def clock(seconds: float) -> str:
    """Return a time as m:ss or h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
