"""`clpt render --cluster`: the same picture, of samples that workers take."""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import device as dev
from ..cluster import keys as cluster_keys
from ..cluster import processes
from ..cluster.blocks import WorkerRecord
from ..cluster.cluster_renderer import ClusterRenderer
from ..errors import ClusterError
from ..formats import load
from ..render.film.saved_film import SavedFilm
from ..render.lowering.checks import check
from ..render.progress import Progress
from . import checkpoints, outputs
from .display import Display
from .grading import Grading
from .rendering import render_samples
from .scene_options import changed
from .so_far import PictureSoFar
from .stopping import STATUS, stops

if TYPE_CHECKING:
    from distributed import Client

PASS_SECONDS = 30.0  # of a pass with noise, at the end of which workers wait for each other
MOST_LISTED = 16  # workers of which each has a line
OF_RENDERER = ("layout", "texture_budget", "tree_quality")


class Where(click.ParamType):
    """The address of a scheduler, or local:N."""

    name = "ADDRESS"

    def convert(self, value: Any, param: Any, ctx: Any) -> str:
        text = str(value)
        if not re.fullmatch(r"local:[1-9]\d{0,2}|tls://.+:\d+", text):
            self.fail(f"{text!r} is neither tls://HOST:PORT nor local:N")
        return text


def render_on_cluster(
    scene: Path,
    targets: tuple[Path, ...],
    shown: Display,
    where: str,
    *,
    keys: Path | None,
    limit: float | None,
    graded: Grading,
    numbers: tuple[int, int] | None,
    period: float | None,
    every: float | None,
    saved: SavedFilm | None,
    device: str | None,
    threads: int | None,
    variables: dict[str, Any],
    missing_textures: Any,
    spp: int | None,
    **options: Any,
) -> int:
    """Render a scene on the workers at an address; return the exit status.

    limit [s]: of the whole command; numbers: first and end of the samples to take; period: of
    checkpoints, see `Checkpoints`; every: of the picture so far; saved: to go on from.

    Raises ClusterError when the cluster is lost, after the picture so far and the film are written.
    """
    began = time.perf_counter()
    given = {name: options.pop(name) for name in OF_RENDERER}
    with shown.loading(scene.name) as tell:
        loaded = load(scene, progress=tell, missing_textures=missing_textures, **variables)
    plan = changed(loaded, spp=spp, **options)
    checkpoints.check_range(plan, numbers)
    saved_at, (first, end) = checkpoints.path_of(scene, targets), numbers or (0, None)
    if saved is not None:
        checkpoints.check(saved, saved_at, plan, first, end, gaps=plan.noise is None)
    check(plan)
    for warning in plan.warnings:
        shown.note(f"clpt: warning: {warning}")
    adaptive = plan.noise is not None or (saved is not None and bool(saved.adaptive))
    end = end or spp
    if end is None and limit is None and not options["noise"]:
        end = plan.spp
    given["denoise"] = options["denoise"]
    chosen = {name: value for name, value in given.items() if value is not None}
    with connected(where, keys, device, threads, shown) as client, stops() as stopped:
        local = picture_device(where, device)
        with ClusterRenderer(plan, client, device=local, first_sample=first, **chosen) as renderer:
            if saved is not None:
                checkpoints.go_on(renderer, saved, saved_at, shown.note)
                taken = saved.film.taken  # also what is missing before its last one
                end = max(end, taken[-1][1]) if end and taken else end
            writer = checkpoints.Checkpoints(
                renderer, saved_at, period, saved is not None, targets, shown.note
            )
            ready = time.perf_counter()
            left = shown.limit = None if limit is None else max(began + limit - ready, 0.0)
            watch = Watch(lambda: [renderer], shown)

            def stats_so_far() -> dict[str, str | int | float]:
                return outputs.metadata(renderer, scene, time.perf_counter() - ready)

            so_far = PictureSoFar(every, targets, renderer, stats_so_far, graded, shown.note)

            def after_pass() -> None:
                writer.after_pass()
                if renderer.counts.samples:
                    so_far.after_pass()

            def tell_progress(progress: Progress) -> None:
                watch.look()
                if not adaptive:  # else a film is whole at the end of a pass
                    after_pass()
                shown.show(progress)

            error: ClusterError | None = None
            try:
                with shown.rendering():
                    render_samples(
                        renderer, end, left, tell_progress, plan.noise, stopped, after_pass,
                        pass_seconds=pass_seconds(adaptive, period, every),
                    )  # fmt: skip
            except ClusterError as lost:
                error = lost
            watch.report()
            if not adaptive:
                renderer.hold()
            writer.save(bool(stopped), failed=error is not None)
            if renderer.counts.samples:
                outputs.write_all(targets, renderer, stats_so_far(), graded, shown.note)
                _warn_of_refused(renderer, shown.note)
            elif error is None:
                raise ClusterError("no worker sent anything in this time")
            writer.finish(bool(stopped) or error is not None)
            if error is not None:
                raise error
    return STATUS + stopped[0] if stopped else 0


def pass_seconds(adaptive: bool, *periods: float | None) -> float:
    """Return how long a pass of a render should take, at whose end something is written so often.

    With adaptive sampling workers wait for each other at its end; without there is one pass alone.
    """
    wanted = [seconds for seconds in periods if seconds]
    return min([PASS_SECONDS, *wanted]) if adaptive else math.inf


def picture_device(where: str, device: str | None) -> str | None:
    """Return the device that makes pictures on this machine: one, also beside several workers."""
    several = not where.startswith("local:") or dev.names_several(device)
    return None if several else device


@contextmanager
def connected(
    where: str, keys: Path | None, device: str | None, threads: int | None, shown: Display
) -> Iterator[Client]:
    """Yield a client of the scheduler at an address, or of one with workers of our own."""
    if where.startswith("local:"):
        number = int(where.removeprefix("local:"))
        with processes.local_cluster(number, device=device, threads=threads) as (client, _):
            yield client
        return
    processes.configure()
    from distributed import Client

    security = cluster_keys.security(keys)
    with shown.phase(f"connecting to {where}"):
        try:
            client = Client(where, security=security, timeout=10)
        except OSError as error:
            raise ClusterError(f"there is no scheduler at {where}: {error}") from None
    with client:
        yield client


class Watch:
    """Tells of workers that come, go, or are refused; of: returns renderers of one cluster."""

    def __init__(self, of: Callable[[], list[ClusterRenderer]], shown: Display):
        self._of, self._shown = of, shown
        self._known: set[str] = set()
        self._refused: set[str] = set()
        self._warned: set[str] = set()
        self._lock = threading.Lock()

    def look(self) -> None:
        """Note what has changed since the last look."""
        with self._lock:
            renderers = self._of()
            refused = {name: why for one in renderers for name, why in one.refused.items()}
            workers = {name for one in renderers for name in one.workers} - refused.keys()
            for name in sorted(refused.keys() - self._refused):
                self._shown.note(f"clpt: warning: {name} is refused: {refused[name]}")
            for name in sorted(self._known - workers - refused.keys()):
                self._shown.note(f"clpt: warning: {name} is gone; others render its samples")
            for name in sorted(workers - self._known):
                self._shown.note(f"{name} renders")
            for warning in (text for one in renderers for text in one.warnings):
                if warning not in self._warned:
                    self._shown.note(f"clpt: warning: {warning}")
                self._warned.add(warning)
            self._known, self._refused = workers, set(refused)

    def report(self) -> None:
        """Note what each worker has done."""
        renderers = self._of()
        records: dict[str, list[WorkerRecord]] = {}
        for name, record in (pair for one in renderers for pair in one.workers.items()):
            records.setdefault(name, []).append(record)
        for name, of_worker in sorted(records.items())[:MOST_LISTED]:
            samples = sum(record.samples for record in of_worker)
            blocks = sum(record.blocks for record in of_worker)
            failures = sum(record.failures for record in of_worker)
            self._shown.note(
                f"{name}  {samples:.5g} spp in {blocks} blocks, {of_worker[-1].rate:.3g} spp/s, "
                f"{failures} failures"
            )
        lost = max((one.lost for one in renderers), default=0)
        self._shown.note(f"{len(records)} workers, {lost} lost")


def _warn_of_refused(renderer: ClusterRenderer, tell: Callable[[str], None]) -> None:
    """Warn of samples that the films refused."""
    rejected = renderer.counts.rejected
    if rejected:
        tell(
            f"clpt: warning: {rejected} samples were not finite, or too bright, and count as black"
        )
    if renderer.counts.full:
        tell("clpt: warning: pixels are too bright for the film: lower film.exposure")
