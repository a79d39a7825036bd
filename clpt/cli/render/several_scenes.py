"""Several scenes or cameras in one command, one after the other: what fails for one does not stop
the rest.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from ...errors import SceneError
from ...formats import load
from ..files import outputs
from ..files.standard_output import STANDARD, standard_output
from ..process import failures

NAME = "{scene}"  # in the name of an output, the scene's
CAMERA = "{camera}"  # the camera's, or its number
ALL = "all"  # the name of no camera: each of them


@dataclass(frozen=True)
class _Job:
    """A scene, the files of its picture, none for the default ones, and its video.

    changed: options that differ from the command's.
    """

    scene: Path
    paths: tuple[Path, ...]
    video: Path | None
    changed: dict[str, Any] = field(default_factory=dict)

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that are written."""
        film = () if self.video is None else (self.video,)
        return (*(self.paths or outputs.default(self.scene)), *film)

    def done(self, run: Callable[..., int]) -> int:
        """Return the status of a command for this scene."""
        return run(scene=self.scene, paths=self.paths, video=self.video, **self.changed)


def one_by_one(command: Callable[..., int]) -> Callable[..., int]:
    """Let a command of one `scene` and its `paths` take `scenes`, and a `form` of -o -.

    Of the camera `all` it renders each. Returns what the command does for one scene; for several
    0, or the largest status, and at a signal its status at once.
    """

    @functools.wraps(command)
    def each(
        *,
        scenes: tuple[Path, ...],
        paths: tuple[Path, ...],
        form: str | None,
        video: Path | None,
        quiet: bool,
        **options: Any,
    ) -> int:
        with standard_output(paths, form) as named:
            if STANDARD in paths and (len(scenes) > 1 or options["frames"] is not None):
                raise click.UsageError("-o - is for one picture")
            if set(paths) == {STANDARD} and options["every"] is not None:
                raise click.UsageError("--every writes a file again and again; -o - is none")
            jobs = [
                _Job(scene, _of(scene, named), None if video is None else _of(scene, (video,))[0])
                for scene in scenes
            ]
            if options["variables"].get("camera") == ALL:
                if STANDARD in paths:
                    raise click.UsageError("-o - is for one picture")
                jobs = [one for job in jobs for one in _of_cameras(job, options)]
            run = functools.partial(command, quiet=quiet, **options)
            return _all(run, jobs, quiet) if len(jobs) > 1 else jobs[0].done(run)

    return each


def _of(scene: Path, paths: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the names of a scene's outputs: {scene} is its name."""
    name = outputs.default(scene)[0].stem
    return tuple(Path(str(path).replace(NAME, name)) for path in paths)


def _of_cameras(job: _Job, options: dict[str, Any]) -> list[_Job]:
    """Return a job for each of a scene's cameras; the job itself where these cannot be told."""
    variables = {key: value for key, value in options["variables"].items() if key != "camera"}
    try:
        scene = load(job.scene, missing_textures=options["missing_textures"], **variables)
    except SceneError:
        return [job]  # it fails by itself, and says why
    names = [one.partition(" ")[2] for one in scene.extra.get("cameras", ())]
    if ALL in names:
        return [job]
    if not names:
        return [replace(job, changed={"variables": variables})]
    if len({*names}) < len(names) or not all(names):
        names = [str(number) for number in range(len(names))]
    usual = tuple(path.with_stem(f"{path.stem}.{CAMERA}") for path in outputs.default(job.scene))
    made = []
    for number, name in enumerate(names):
        label = re.sub(r"[^\w.-]", "_", name)
        paths = tuple(Path(str(path).replace(CAMERA, label)) for path in job.paths or usual)
        video = None if job.video is None else Path(str(job.video).replace(CAMERA, label))
        own = {"variables": {**variables, "camera": str(number)}}
        made.append(replace(job, paths=paths, video=video, changed=own))
    return made


def _check_distinct(jobs: list[_Job]) -> None:
    """Raise SceneError where two scenes or cameras would be written to one file."""
    owners: dict[Path, _Job] = {}
    for job in jobs:
        for path in job.files:
            other = owners.setdefault(path.absolute(), job)
            if other.scene is not job.scene:
                message = f"{other.scene} and {job.scene} would both be written there"
                raise SceneError(f"{message}; -o '{NAME}.exr' names them by the scene", file=path)
            if other is not job:
                message = "several cameras would be written there"
                raise SceneError(f"{message}; -o '{CAMERA}.exr' names them", file=path)


def _all(run: Callable[..., int], jobs: list[_Job], quiet: bool) -> int:
    """Run the command for each scene; return the status of all."""
    _check_distinct(jobs)
    for job in jobs:
        outputs.checked(job.paths or outputs.default(job.scene))
    statuses: list[int] = []
    for number, job in enumerate(jobs, start=1):
        if not quiet:
            seen = job.changed.get("variables", {}).get("camera")
            which = "" if seen is None else f", camera {seen}"
            click.echo(f"{job.scene}{which} ({number} of {len(jobs)})", err=True)
        status = _one(run, job)
        if status > failures.BAD_INPUT:
            return status  # a signal
        statuses.append(status)
    failed = [str(job.scene) for job, status in zip(jobs, statuses, strict=True) if status]
    if failed:
        failures.complain(f"{len(failed)} of {len(jobs)} scenes failed: {', '.join(failed)}")
    return max(statuses)


def _one(run: Callable[..., int], job: _Job) -> int:
    """Run the command for a scene of several, and give back what it took; return its status."""
    above = click.get_current_context()
    try:
        with click.Context(above.command, parent=above, info_name=above.info_name):
            return job.done(run)
    except Exception as error:
        message, status = failures.message_of(error)
        failures.complain(message if str(job.scene) in message else f"{job.scene}: {message}")
        return status
