"""`clpt view`: a scene in the browser, rendered while it is watched and steered."""

from __future__ import annotations

import os
import time
import webbrowser
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..cluster.multi_renderer import MultiRenderer
from ..formats import load, locate
from ..scene import Scene
from . import outputs
from .display import display
from .extras import extra
from .grading import Grading, grading, grading_options
from .on_cluster import Where, connected
from .scene_options import changed, open_scene, scene_options
from .stopping import STATUS, stops
from .verbosity import verbose_option

if TYPE_CHECKING:
    from ..view.session import Source

CLOSE_SECONDS = 3.0  # in which a session ends that waits for no compiler
OF_RENDERER = ("layout", "tree_quality", "texture_budget")
OF_DEVICE = ("device", "threads")
OF_GRADING = ("exposure", "tone", "view", "display", "look", "ocio")


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="0: any that is free.")
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Where to listen; any but this machine's own lets in whoever has the address.",
)  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Print the address, and open nothing.")
@click.option(
    "-o", "--output", "folder", default=".", show_default=True,
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Folder that gets what the page saves.",
)  # fmt: skip
@click.option(
    "--open", "opened", type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="VIEW.json", help="Begin with a view that the page has saved.",
)  # fmt: skip
@click.option("--cluster", type=Where(), help="Render on workers, as of `clpt render`.")
@click.option(
    "--keys", type=click.Path(path_type=Path),
    help="Folder of the cluster's keys.  [default: that of clpt cluster start on this machine]",
)  # fmt: skip
@click.option("--spp", type=click.IntRange(1, 2**31 - 1), help="Samples per pixel.")
@click.option("--noise", type=click.FloatRange(0.0), metavar="SHARE", help="As of `clpt render`.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), help="Seed of the random numbers.")
@scene_options
@grading_options
@verbose_option("Log more, twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
def view(
    scene: Path,
    port: int,
    host: str,
    no_browser: bool,
    folder: Path,
    opened: Path | None,
    cluster: str | None,
    keys: Path | None,
    verbose: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Show the scene file, mesh or folder SCENE in the browser, and let it be steered.

    The line that is printed is the page's address. It opens the page once, on this machine; the
    page makes addresses for others. The scene's file is read again when it changes. Ctrl-C ends it.
    """
    with extra("view", "clpt view"):
        from ..view.server import Server
    from ..view.access import is_loopback
    from ..view.commands import OF_VIEW
    from ..view.pictures import Display
    from ..view.saving import Folder
    from ..view.session import Session
    from ..view.views import load as load_view

    file = locate(scene)
    begins = load_view(opened) if opened is not None else None
    graded = grading(**{name: options.pop(name) for name in OF_GRADING})
    resources = click.get_current_context().with_resource(ExitStack())
    server = Server(host, port)
    resources.callback(server.close)
    address = server.address
    click.echo(address)
    if not is_loopback(host):
        click.echo(f"clpt: warning: other machines can reach {host}, and read along", err=True)
    if not no_browser:
        webbrowser.open(address)

    def write_exr(path: Path, renderer: Any, seconds: float) -> None:
        outputs.write(path, renderer, outputs.metadata(renderer, file, seconds), Grading())

    of_renderer = {name: options.pop(name) for name in OF_RENDERER}
    shown = display(quiet, None)
    plan, devices, _ = open_scene(scene, shown, resources, **options)
    device = devices[0]
    make: Any = None
    where = " and ".join(one.info.label for one in devices)
    if cluster is not None:
        on, threads = options["device"], options["threads"]
        with extra("cluster", "clpt view --cluster"):
            from ..cluster.cluster_renderer import ClusterRenderer
        client = resources.enter_context(connected(cluster, keys, on, threads, shown))

        def of_cluster(scene: Scene, cancel_seconds: float, **made: Any) -> ClusterRenderer:
            return ClusterRenderer(scene, client, device=device, mixed=True, **made)

        make, where = of_cluster, cluster
    elif len(devices) > 1:
        make = partial(MultiRenderer, devices=devices)
    session = Session(
        plan,
        device,
        server,
        folder=Folder(folder, outputs.default(file)[0].stem, write_exr),
        source=_source(file, **options),
        display=Display(graded.exposure, OF_VIEW if graded.view else graded.tone, graded.view),
        where=where,
        make=make,
        **of_renderer,
    )
    resources.callback(session.close)
    if begins is not None:
        session.post(begins, server.message)
    server.show(session)
    session.start()
    with stops() as stopped:
        while not stopped and session.error is None:
            time.sleep(0.05)
    if session.error is not None:
        raise session.error
    status = STATUS + stopped[0]
    if device.compilers is not None:
        device.compilers.kill()
    if not session.close(CLOSE_SECONDS):
        os._exit(status)  # a driver compiles; nothing else ends it
    return status


def _source(
    file: Path, *, variables: dict[str, Any], missing_textures: Any, **options: Any
) -> Source:
    """Return what reads the scene's file again."""
    from ..view.session import Source

    changes = {name: value for name, value in options.items() if name not in OF_DEVICE}

    def stamp() -> Any:
        try:
            found = file.stat()
        except OSError:  # it is being replaced
            return None
        return found.st_mtime_ns, found.st_size

    def read() -> Scene:
        loaded = load(file, missing_textures=missing_textures, **variables)
        return changed(loaded, **changes)

    return Source(stamp, read)
