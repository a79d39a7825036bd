"""Checkpoints: the film of a render in a file beside its picture; `--resume` goes on with it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterable
from pathlib import Path

from clpt.files import output_files

from ...errors import MemoryBudgetError, SceneError
from ...render.film import film_file
from ...render.film.film_file import SavedFilm, differences_text, ranges_text
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ...scene.fingerprint import fingerprint
from ..display import Display, clock
from . import outputs
from .targets import CHECKPOINT, FILM, default, is_standard

PERIOD = 300.0  # seconds between checkpoints
PATIENCE = 600.0  # seconds of a render after which it has checkpoints unasked
FORMER = ".1"  # ends the name of the previous checkpoint
ADVICE = "render that again, or begin anew with --no-resume"


def path_of(scene: Path, targets: tuple[Path, ...]) -> Path:
    """Return where the checkpoints of a picture are written: a.resume.exr of a.png.

    Of a picture for the standard output alone they have the scene's name.
    """
    files = [path for path in targets if not is_standard(path)]
    target = (files or default(scene))[0]
    longest = output_files.LONGEST - len(FORMER)
    return output_files.beside(target, CHECKPOINT, longest)


def former_of(path: Path) -> Path:
    """Return the path of the previous checkpoint."""
    return path.with_name(path.name + FORMER)


def find(path: Path, resume: bool | None, shown: Display) -> SavedFilm | None:
    """Return the film to go on with, None to begin anew.

    resume: True: there must be a film; False: films are left alone; None: a film is taken if there
    is a file. The previous checkpoint takes the place of a damaged file; shown: notes that.

    Raises SceneError where no film can be read, though `resume` asks for it or there is a file.
    """
    if resume is False:
        return None
    present = [candidate for candidate in (path, former_of(path)) if candidate.exists()]
    if not present:
        if resume:
            raise SceneError("there is nothing to resume: no such file", file=path)
        return None
    failures = []
    for candidate in present:
        try:
            saved = film_file.read(candidate)
        except SceneError as error:
            failures.append(error)
            continue
        for failure in failures:
            shown.note(f"clpt: warning: {failure}; {candidate} is taken in its place")
        return saved
    raise SceneError(f"{failures[0].message}; {ADVICE}", file=present[0])


def refuse(differences: list[str], path: Path) -> None:
    """Raise SceneError if there is a difference between a film and what is rendered."""
    if differences:
        message = f"is of something else: {differences_text(differences)}"
        raise SceneError(f"{message}; {ADVICE}", file=path)


def check_range(plan: Scene, numbers: tuple[int, int] | None) -> None:
    """Raise SceneError for a range of samples of a scene that does not have the same everywhere."""
    if numbers and plan.noise is not None:
        raise SceneError("it would choose other samples of each film", where="noise")


def check(
    saved: SavedFilm, path: Path, plan: Scene, first: int, end: int | None, *, gaps: bool = False
) -> None:
    """Raise SceneError for a film of another scene, or without the samples from `first` on.

    end: of samples that are asked for, where no more are allowed; else None. gaps: whether samples
    may be missing, as workers of a cluster leave them.
    """
    refuse(saved.origin.scene.differences(fingerprint(plan)), path)
    taken = saved.film.taken
    if not taken:
        return
    if taken[0][0] < first if gaps else len(taken) > 1 or taken[0][0] != first:
        can = (
            "; --cluster local:1 without --noise takes those that are missing"
            if taken[0][0] >= first
            else ""
        )
        message = f"it has samples {ranges_text(taken)}, not those from {first} on{can}; {ADVICE}"
        raise SceneError(message, file=path)
    if end is not None and taken[-1][1] > end:
        message = f"it has samples {ranges_text(taken)}, more than to {end - 1}; {ADVICE}"
        raise SceneError(message, file=path)


def go_on(renderer: ResumableRenderer, saved: SavedFilm, path: Path, shown: Display) -> None:
    """Let a renderer go on from a film, and say so. Raises SceneError, which says what differs."""
    known = len(renderer.warnings)
    renderer._follow(saved.origin)
    refuse(saved.origin.differences(renderer._origin()), path)
    renderer._restore(saved)
    shown.note(f"goes on from {path}: {summary(saved)}")
    for warning in renderer.warnings[known:]:
        shown.note(f"clpt: warning: {warning}")


class Checkpoints:
    """Writes the film of a render now and then, in a thread beside it.

    A file that was asked for, or that was there before, stays at the end; others are removed.

    path: of the file; period: seconds between checkpoints, 0: never, None: not asked for; resumed:
    whether the render goes on from the file; targets: of the picture, which may be films.
    """

    def __init__(
        self,
        renderer: ResumableRenderer,
        path: Path,
        period: float | None,
        resumed: bool,
        targets: Iterable[Path],
        shown: Display,
    ):
        self._renderer, self._path, self._shown = renderer, path, shown
        self._period = PERIOD if period is None else period
        self._keep = bool(period) or (resumed and period is None)
        now = time.monotonic()
        self._due = now + (self._period if self._keep else PATIENCE)
        holds = self._keep or any(target.suffix.lower() == FILM for target in targets)
        self._holds_from = now if holds else self._due
        if period == 0.0:
            self._due = math.inf
        self._writer: threading.Thread | None = None
        self._failure: str | None = None
        self._written = self._held = False
        self._hold()

    def after_pass(self) -> None:
        """Keep the film of a pass that has ended, and write it if that is due."""
        self._hold()
        self._tell_failure()
        writing = self._writer is not None and self._writer.is_alive()
        if time.monotonic() < self._due or writing:
            return
        self._due = time.monotonic() + self._period
        self._begin_to_write()

    def save(self, stopped: bool, *, failed: bool = False) -> None:
        """Write the film of the last whole pass, if it stays.

        stopped: whether a signal ended the render: then it stays too where checkpoints had begun;
        failed: whether an error ended it: then a film that is held stays.
        """
        self._wait()
        if self._keep or (stopped and self._written) or (failed and self._held):
            self._begin_to_write()
            self._wait()
        self._tell_failure()

    def finish(self, stopped: bool) -> None:
        """Say where the film is, or remove it: the picture is written."""
        if not self._written:
            return
        if self._keep or stopped:
            self._shown.note(f"{self._path}  --resume goes on from it")
            return
        for path in (self._path, former_of(self._path)):
            path.unlink(missing_ok=True)

    def hold(self) -> None:
        """Hold the film as it is, whether checkpoints have begun or not."""
        self._holds_from = min(self._holds_from, time.monotonic())
        self._hold()

    def _hold(self) -> None:
        if time.monotonic() < self._holds_from:
            return
        try:
            self._renderer._hold()
            self._held = True
        except MemoryBudgetError as error:
            self._shown.note(f"clpt: warning: no checkpoints: {error}")
            self._holds_from = self._due = math.inf
            self._keep = False

    def _begin_to_write(self) -> None:
        try:
            saved = self._renderer.saved_film(held=True)
        except MemoryError as error:
            self._failure = outputs.failure(self._path, error)
            return
        if saved.film.taken:
            self._writer = threading.Thread(target=self._write, args=(saved,), name="checkpoint")
            self._writer.start()

    def _wait(self) -> None:
        if self._writer is not None:
            self._writer.join()

    def _write(self, saved: SavedFilm) -> None:
        try:
            output_files.link(self._path, former_of(self._path))
            film_file.write(self._path, saved)
            self._written = True
        except (OSError, MemoryError) as error:
            self._failure = outputs.failure(self._path, error)

    def _tell_failure(self) -> None:
        failure, self._failure = self._failure, None
        if failure:
            self._shown.note(
                f"clpt: warning: {failure}; what was there stays, and the render goes on"
            )


def summary(saved: SavedFilm) -> str:
    """Return what a film holds, for people."""
    sessions = f"{len(saved.sessions)} session{'s' if len(saved.sessions) > 1 else ''}"
    return f"samples {ranges_text(saved.film.taken)}, {clock(saved.seconds)} of {sessions}"
