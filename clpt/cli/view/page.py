"""The page of `clpt view`: its server, its session, and their end."""

from __future__ import annotations

import os
import time
import webbrowser
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import click

from ... import device as dev
from ...cluster.multi_renderer import MultiRenderer
from ...formats import locate
from ...scene import Scene
from ...view.access import is_loopback
from ...view.messages import OF_VIEW
from ...view.pictures import Display
from ...view.saving import Folder
from ...view.saving import load as load_view
from ...view.session import Session
from ..display import Display as Progress
from ..display import display
from ..files import outputs, targets
from ..opening import connected, open_scene
from ..options.grading import Grading
from ..options.scene_options import SceneOptions
from ..process import terminal
from ..process.ending import STATUS, extra, stops
from .settings import Settings

CLOSE_SECONDS = 3.0  # a session that waits for no compiler ends within them


def show(scene: Path, settings: Settings) -> int:
    """Show a scene until a signal comes; return the exit status. Raises errors of its session."""
    from ...view.server import Server  # here: asyncio and sockets are for this command alone

    file = locate(scene)
    begins = load_view(settings.opened) if settings.opened is not None else None
    looked_at = _display(settings)
    with ExitStack() as resources:
        server = Server(settings.host, settings.port)
        resources.callback(server.close)
        _announce(server.address, settings)
        shown = display(settings.quiet, None)
        plan, devices, _ = open_scene(file, settings.options, shown, resources)
        where, make = _renderers(settings, devices, shown, resources)
        session = Session(
            plan,
            devices[0],
            server,
            folder=_folder(file, settings),
            source=_SceneFile(file, settings.options),
            display=looked_at,
            where=where,
            make=make,
            **settings.options.build,
        )
        resources.callback(session.close)
        if begins is not None:
            session.post(begins, server.message)
        server.show(session)
        session.start(solid=True)
        return _attend(session)


def _display(settings: Settings) -> Display:
    """Return how the picture is shown at first. Raises SceneError, click.UsageError."""
    grading = settings.graded.grading
    tone = OF_VIEW if grading.view else grading.tone
    if grading.exposure == "auto":
        raise click.UsageError("--exposure auto is for files: give the page a number to begin with")
    return Display(grading.exposure, tone, grading.view)


def _announce(address: str, settings: Settings) -> None:
    """Print the page's address with advice, and open the page."""
    terminal.say(address, err=False)
    if not settings.quiet:
        advice = (
            "open this address in a browser" if settings.no_browser else "opens in your browser"
        )
        terminal.say(f"{advice}; Ctrl-C ends it")
    if not is_loopback(settings.host):
        warning = f"other machines can reach {settings.host}, and read along"
        terminal.say(f"clpt: warning: {warning}")
    if not settings.no_browser:
        webbrowser.open(address)


def _renderers(
    settings: Settings, devices: list[dev.Device], shown: Progress, resources: ExitStack
) -> tuple[str, Any]:
    """Return the names of devices or workers, and a factory of renderers, None for `Renderer`."""
    device = devices[0]
    if settings.workers.cluster is not None:
        with extra("cluster", "clpt view --cluster"):
            from ...cluster.cluster_renderer import ClusterRenderer
        workers = connected(settings.workers, settings.options.machine, shown)
        client = resources.enter_context(workers)

        def of_cluster(scene: Scene, cancel_seconds: float, **options: Any) -> ClusterRenderer:
            return ClusterRenderer(scene, client, device=device, mixed=True, **options)

        return settings.workers.cluster, of_cluster
    several = partial(MultiRenderer, devices=devices) if len(devices) > 1 else None
    return " and ".join(on.info.label for on in devices), several


def _folder(file: Path, settings: Settings) -> Folder:
    """Return the folder that gets files of the page."""

    def write_exr(path: Path, renderer: Any, seconds: float) -> None:
        outputs.write(path, renderer, outputs.metadata(renderer, file, seconds), Grading())

    return Folder(settings.folder, targets.name_of(file), write_exr)


class _SceneFile:
    """The scene's file, which is read again after changes."""

    def __init__(self, file: Path, options: SceneOptions):
        self.file, self.options = file, options

    def stamp(self) -> Any:
        try:
            status = self.file.stat()
        except OSError:  # it is being replaced
            return None
        return status.st_mtime_ns, status.st_size

    def load(self) -> Scene:
        return self.options.scene(self.file)


def _attend(session: Session) -> int:
    """Wait until a signal ends the session, or a fault, which is raised; return the status."""
    with stops() as stopped:
        while not stopped and session.error is None:
            time.sleep(0.05)
    if session.error is not None:
        raise session.error
    status = STATUS + stopped[0]
    dev.kill_compilers()
    if not session.close(CLOSE_SECONDS):
        os._exit(status)  # a driver compiles; nothing else ends it
    return status
