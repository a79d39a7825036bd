"""`clpt render --frames`: an animation, frame by frame, over devices."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from .. import __version__, images
from ..cluster.cluster_renderer import ClusterRenderer
from ..errors import ClusterError, SceneError
from ..formats import load
from ..render.lowering.checks import check
from ..scene import Scene
from ..scene.fingerprint import fingerprint
from . import outputs, video
from .display import Display, clock
from .frame_crews import Crew, cluster_crews, device_crews
from .frame_values import expanded, has_number, numbered, varies
from .grading import Grading
from .rendering import render_samples
from .scene_options import AnyRenderer, changed
from .stopping import STATUS, stops

KEPT = (".exr", ".png")  # formats that keep a frame's fingerprint
LOOK = 0.1  # seconds between two looks at signals


@dataclass(frozen=True)
class Animation:
    """What is rendered for each frame.

    scene, outputs: names with a place for the frame's number; variables: values perhaps with
    expressions; changes: see `scene_options.changed`; limit: seconds of a frame; spp: samples, None
    where the limit or the noise ends a frame.
    """

    scene: Path
    outputs: tuple[Path, ...]
    frames: range
    fps: float
    variables: Mapping[str, str]
    missing_textures: Any
    changes: Mapping[str, Any]
    grading: Grading
    limit: float | None

    def file(self, frame: int) -> Path:
        """Return the scene file of a frame."""
        return numbered(self.scene, frame) if has_number(self.scene) else self.scene

    def targets(self, frame: int) -> tuple[Path, ...]:
        """Return the files of a frame's picture."""
        return tuple(numbered(path, frame) for path in self.outputs)

    def load(self, frame: int) -> tuple[Scene, str]:
        """Return a frame's scene, and the fingerprint of all that decides its picture."""
        variables: dict[str, Any] = {**expanded(self.variables, frame, self.fps)}
        loaded = load(self.file(frame), missing_textures=self.missing_textures, **variables)
        plan = changed(loaded, **self.changes)
        check(plan)
        decides = {
            "scene": fingerprint(plan).digest, "spp": self.spp(plan), "noise": plan.noise,
            "time": self.limit, "grading": repr(self.grading), "version": __version__,
            "denoise": self.changes["denoise"],
        }  # fmt: skip
        return plan, hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()

    def spp(self, plan: Scene) -> int | None:
        """Return how many samples a frame gets, None for any number."""
        free = self.limit is not None or self.changes["noise"]
        return self.changes["spp"] if free else plan.spp

    def is_complete(self, frame: int, digest: str) -> bool:
        """Whether a frame's files are there, and of this fingerprint."""
        paths = self.targets(frame)
        kept = [_fingerprint_of(path) for path in paths if path.suffix.lower() in KEPT]
        return bool(kept) and set(kept) == {digest} and all(path.is_file() for path in paths)


def render_frames(
    scene: Path,
    paths: tuple[Path, ...],
    frames: range,
    fps: float,
    film: Path | None,
    graded: Grading,
    limit: float | None,
    shown: Display,
    *,
    cluster: str | None,
    keys: Path | None,
    device: str | None,
    threads: int | None,
    variables: Mapping[str, str],
    missing_textures: Any,
    profiling: bool = False,
    **options: Any,
) -> int:
    """Render frames that are not complete; return the exit status.

    film: of all frames; cluster, keys: see `on_cluster.render_on_cluster`.
    """
    given = paths or outputs.default(scene if not has_number(scene) else numbered(scene, frames[0]))
    if not paths and film is None:
        given = given[:1]  # .exr
    if not varies(variables) and not has_number(scene):
        raise click.UsageError(
            "all frames would be the same: let a variable depend on them, as -D 'time={time}', or "
            "give a scene of each frame, as scene.####.json"
        )
    if film is not None:
        pictures = [path for path in given if path.suffix.lower() == ".png"]
        if not pictures:
            raise click.UsageError("--video is made of .png: add -o NAME.png")
        video.check(film)
    outputs.checked(tuple(numbered(path, frames[0]) for path in given))
    made = {name: options.pop(name) for name in ("layout", "tree_quality", "texture_budget")}
    made["denoise"] = options["denoise"]
    plan = Animation(scene, given, frames, fps, variables, missing_textures, options, graded, limit)
    with ExitStack() as resources, stops() as stopped:
        if cluster is None:
            crews = device_crews(device, threads, len(frames), profiling, made, resources)
        else:
            together = 1 if limit is not None else len(frames)  # its time is a frame's own
            several = cluster_crews(cluster, keys, device, threads, together, made, shown)
            crews = resources.enter_context(several)
        _FrameLoop(plan, crews, shown, stopped).run()
        if stopped:
            for crew in crews:
                crew.stop()
            return STATUS + stopped[0]
    if film is not None:
        with shown.phase(f"writing {film}"):
            video.write(film, [numbered(pictures[0], frame) for frame in frames], fps)
        shown.note(f"{film}  {len(frames)} frames, {len(frames) / fps:.3g} s")
    return 0


class _FrameLoop:
    """Threads that take frames, one for each crew, and one that reads scenes ahead."""

    def __init__(
        self,
        plan: Animation,
        crews: list[Crew],
        shown: Display,
        stopped: Sequence[int],
    ):
        self.plan, self.crews, self.shown, self.stopped = plan, crews, shown, stopped
        self.errors: list[BaseException] = []
        self._left = deque(plan.frames)
        self._ahead: deque[tuple[int, Future[tuple[Scene, str]]]] = deque()
        self._lock = threading.Lock()
        self._done = self._rendered = 0
        self._seconds = 0.0
        self._began = time.perf_counter()

    def run(self) -> None:
        """Render all frames. Raises what a thread raised."""
        with ThreadPoolExecutor(1) as reader:
            while (self._left or self._ahead) and not (self.errors or self.stopped):
                threads = [
                    threading.Thread(target=self._work, args=(crew, reader), daemon=True)
                    for crew in self.crews
                ]
                for thread in threads:
                    thread.start()
                for thread in threads:
                    while thread.is_alive():
                        thread.join(LOOK)
            for _, scene in self._ahead:
                scene.cancel()
        if self.errors:
            raise self.errors[0]

    def _take(self, reader: ThreadPoolExecutor) -> tuple[int, Future[tuple[Scene, str]]] | None:
        """The next frame, whose scene is being read, and none after an end."""
        with self._lock:
            if self.errors or self.stopped:
                return None
            while self._left and len(self._ahead) <= len(self.crews):
                frame = self._left.popleft()
                self._ahead.append((frame, reader.submit(self.plan.load, frame)))
            return self._ahead.popleft() if self._ahead else None

    def _work(self, crew: Crew, reader: ThreadPoolExecutor) -> None:
        """Let a crew render frames, till none is left."""
        renderer: AnyRenderer | ClusterRenderer | None = None
        try:
            while (taken := self._take(reader)) is not None:
                frame, scene = taken
                try:
                    renderer = self._frame(frame, *scene.result(), crew, renderer)
                except (SceneError, ClusterError, OSError, click.ClickException):
                    raise
                except Exception as error:
                    if not self._lose(crew, error, taken):
                        raise
                    return
        except BaseException as error:
            self.errors.append(error)
        finally:
            crew.frame = math.inf
            if renderer is not None:
                renderer.close()

    def _lose(
        self,
        lost: Crew,
        error: BaseException,
        taken: tuple[int, Future[tuple[Scene, str]]],
    ) -> bool:
        """Leave a crew out, of which others get the frame; return whether there are others."""
        with self._lock:
            self.crews = [crew for crew in self.crews if crew is not lost]
            self._ahead.appendleft(taken)
        what = f"{lost.name} failed and is left out, others do its part: {error}"
        if self.crews:
            self.shown.note(f"clpt: warning: {what}")
        return bool(self.crews)

    def _frame(
        self,
        frame: int,
        scene: Scene,
        digest: str,
        crew: Crew,
        renderer: AnyRenderer | ClusterRenderer | None,
    ) -> AnyRenderer | ClusterRenderer | None:
        """Render a frame unless it is complete; return the renderer for the next one."""
        plan = self.plan
        if plan.is_complete(frame, digest):
            self._tell(frame, "is complete", 0.0)
            return renderer
        stale = [path for path in plan.targets(frame) if path.is_file()]
        if any(_fingerprint_of(path) not in (None, digest) for path in stale):
            self.shown.note(f"frame {frame}: the scene or an option has changed since {stale[0]}")
        crew.frame = frame
        renderer = _showing(scene, crew, renderer, self.shown)
        began = time.perf_counter()
        render_samples(
            renderer, plan.spp(scene), plan.limit, crew.tell, scene.noise, self.stopped,
            pass_seconds=crew.pass_seconds(scene),
        )  # fmt: skip
        if self.stopped:
            return renderer  # what it has so far is no frame
        if not renderer.counts.samples:
            message = "in so short a time there was no sample"
            raise click.BadParameter(message, param_hint="--time")
        seconds = time.perf_counter() - began
        stats = outputs.metadata(renderer, plan.file(frame), seconds)
        stats |= {"frame": frame, "fingerprint": digest}
        outputs.write_all(plan.targets(frame), renderer, stats, plan.grading, lambda text: None)
        rejected = renderer.counts.rejected
        bad = f", {rejected} samples were not finite, or too bright" if rejected else ""
        done = f"{plan.targets(frame)[0]}  {stats['spp']:.4g} spp, {seconds:.1f} s{bad}"
        self._tell(frame, done, time.perf_counter() - began)
        return renderer

    def _tell(self, frame: int, what: str, seconds: float) -> None:
        """Say that a frame is done, and how long the rest takes."""
        with self._lock:
            self._done += 1
            self._rendered += seconds > 0.0
            left = len(self.plan.frames) - self._done
            passed = time.perf_counter() - self._began
            rest = f"; {clock(passed / self._rendered * left)} left" if self._rendered else ""
            number = f"{self._done} of {len(self.plan.frames)}"
        self.shown.note(f"frame {frame} ({number}): {what}{rest if left else ''}")


def _showing(
    scene: Scene, crew: Crew, renderer: AnyRenderer | ClusterRenderer | None, shown: Display
) -> AnyRenderer | ClusterRenderer:
    """Return a renderer of a scene: the one that there is, if it can take the scene."""
    if renderer is not None:
        try:
            renderer.update(scene=scene)
            return renderer
        except SceneError:  # a film of another form
            renderer.close()
    renderer = crew.make(scene, shown)
    for warning in (*scene.warnings, *renderer.warnings):
        shown.note(f"clpt: warning: {warning}")
    return renderer


def _fingerprint_of(path: Path) -> str | None:
    """The fingerprint that a frame's file keeps; None without, or where it cannot be read."""
    read: Callable[[Path], Mapping[str, Any]] = images.attributes
    if path.suffix.lower() == ".png":
        read = images.png_text
    try:
        if path.suffix.lower() not in KEPT or not path.is_file():
            return None
        images.read_stored(path)  # all of it: a file may be cut off
        found = read(path).get("fingerprint")
    except (SceneError, OSError, RuntimeError, ValueError, SyntaxError):
        return None
    return found if isinstance(found, str) else None
