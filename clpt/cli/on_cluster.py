"""`clpt render --cluster`: the same picture, of samples that workers take."""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import device as dev
from ..cluster import keys as cluster_keys
from ..cluster import processes
from ..cluster.cluster_renderer import ClusterRenderer
from ..errors import ClusterError
from ..formats import load
from ..render.lowering.checks import check
from ..render.progress import Progress
from ..render.renderer import MOST_SAMPLES
from ..render.saved_film import SavedFilm
from ..scene import Scene
from . import checkpoints, outputs
from .display import Display
from .grading import Grading
from .scene_options import changed
from .stopping import STATUS, stops

if TYPE_CHECKING:
    from distributed import Client

MOST_LISTED = 16  # workers of which each has a line
OF_RENDERER = ("layout", "texture_budget", "tree_quality")


class Where(click.ParamType):
    """The address of a scheduler, or local:N."""

    name = "ADDRESS"

    def convert(self, value: Any, param: Any, ctx: Any) -> str:
        text = str(value)
        if not re.fullmatch(r"local:[1-9]\d{0,2}|(tcp|tls)://.+:\d+", text):
            self.fail(f"{text!r} is neither tls://HOST:PORT, tcp://HOST:PORT nor local:N")
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
    checkpoints, see `Checkpoints`; saved: to go on from. Raises ClusterError when the cluster is
    lost, after the picture so far and the film are written.
    """
    began = time.perf_counter()
    if options["noise"]:
        raise click.BadParameter("not with --cluster yet", param_hint="--noise")
    given = {name: options.pop(name) for name in OF_RENDERER}
    with shown.loading(scene.name) as tell:
        loaded = load(scene, progress=tell, missing_textures=missing_textures, **variables)
    plan = dataclasses.replace(changed(loaded, spp=spp, **options), noise=None)
    outputs.check_contents(targets, plan)
    saved_at, (first, end) = checkpoints.path_of(targets[0]), numbers or (0, None)
    if saved is not None:
        checkpoints.check(saved, saved_at, plan, first, end, gaps=True)
    check(plan)
    for warning in plan.warnings:
        shown.note(f"clpt: warning: {warning}")
    wanted = plan.spp if spp is None and limit is None else spp or MOST_SAMPLES
    wanted = wanted if end is None else end - first
    chosen = {name: value for name, value in given.items() if value is not None}
    with _connected(where, keys, device, threads, shown) as client, stops() as stopped:
        several = not where.startswith("local:") or dev.names_several(device)
        local = None if several else device  # one device makes the picture
        with ClusterRenderer(plan, client, device=local, first_sample=first, **chosen) as renderer:
            if saved is not None:
                checkpoints.go_on(renderer, saved, saved_at, shown.note)
                taken = saved.film.taken  # also what is missing before its last one
                wanted = max(wanted, taken[-1][1] - first if taken else 0)
            former, missing = renderer.counts, wanted - renderer.samples
            writer = checkpoints.Checkpoints(
                renderer, saved_at, period, saved is not None, targets, shown.note
            )
            ready = time.perf_counter()
            shown.limit = None if limit is None else max(began + limit - ready, 0.0)
            watch = _Watch(renderer, shown)

            def tell_progress(progress: Progress) -> bool:
                watch.look()
                writer.after_pass()
                total = 0 if wanted == MOST_SAMPLES else progress.total
                paths = progress.paths - former["samples"]
                rays = progress.rays - former["rays"]
                shown.show(dataclasses.replace(progress, total=total, paths=paths, rays=rays))
                over = limit is not None and time.perf_counter() - began >= limit
                return not (stopped or over)

            error: ClusterError | None = None
            try:
                if missing > 0:
                    with shown.rendering():
                        renderer.run(missing, tell_progress)
            except ClusterError as lost:
                error = lost
            watch.report()
            seconds = time.perf_counter() - ready
            renderer.hold()
            writer.save(bool(stopped), failed=error is not None)
            if renderer.samples:
                _write(renderer, plan, scene, targets, graded, seconds, shown.note)
            elif error is None:
                raise ClusterError("no worker sent anything in this time")
            writer.finish(bool(stopped) or error is not None)
            if error is not None:
                raise error
    return STATUS + stopped[0] if stopped else 0


@contextmanager
def _connected(
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

    security = cluster_keys.security(where, keys)
    with shown.phase(f"connecting to {where}"):
        try:
            client = Client(where, security=security, timeout=10)
        except OSError as error:
            raise ClusterError(f"there is no scheduler at {where}: {error}") from None
    with client:
        yield client


class _Watch:
    """Tells of workers that come, go, or are refused."""

    def __init__(self, renderer: ClusterRenderer, shown: Display):
        self._renderer, self._shown = renderer, shown
        self._known: set[str] = set()
        self._refused: set[str] = set()
        self._warned = 0

    def look(self) -> None:
        """Note what has changed since the last look."""
        workers, refused = self._renderer.workers, self._renderer.refused
        for name in sorted(refused.keys() - self._refused):
            self._shown.note(f"clpt: warning: {name} is refused: {refused[name]}")
        for name in sorted(self._known - workers.keys() - refused.keys()):
            self._shown.note(f"clpt: warning: {name} is gone; others render its samples")
        for name in sorted(workers.keys() - self._known):
            self._shown.note(f"{name} renders")
        for warning in self._renderer.warnings[self._warned :]:
            self._shown.note(f"clpt: warning: {warning}")
        self._known, self._refused = set(workers), set(refused)
        self._warned = len(self._renderer.warnings)

    def report(self) -> None:
        """Note what each worker has done."""
        blocks, workers = self._renderer.blocks, self._renderer.workers
        for name, record in sorted(workers.items())[:MOST_LISTED]:
            self._shown.note(
                f"{name}  {record.samples} spp in {record.blocks} blocks, "
                f"{record.rate:.3g} spp/s, {record.failures} failures"
            )
        self._shown.note(
            f"{len(workers)} workers; blocks lost {blocks.lost}, repeated {blocks.repeated}, "
            f"dropped {blocks.dropped}"
        )


def _write(
    renderer: ClusterRenderer,
    plan: Scene,
    scene: Path,
    targets: tuple[Path, ...],
    graded: Grading,
    seconds: float,
    tell: Callable[[str], None],
) -> None:
    """Write the picture so far, and warn of what the films refused."""
    local, counts = renderer.developed(), renderer.counts
    pixels = plan.film.width * plan.film.height
    stats = outputs.metadata(local, scene, seconds)
    stats["spp"] = counts["samples"] / pixels / max(len(local.channels), 1)
    kinds = {record.kind for record in renderer.workers.values()}
    stats["device"] = "; ".join(sorted(kinds)) or stats["device"]
    stats["seconds"] = round(seconds + renderer.former_seconds, 3)
    outputs.write_all(targets, renderer, stats, graded, tell)
    if counts["rejected"]:
        tell(
            f"clpt: warning: {counts['rejected']} samples were not finite, or too bright, and "
            "count as black"
        )
    if counts["full"]:
        tell("clpt: warning: pixels are too bright for the film: lower film.exposure")
