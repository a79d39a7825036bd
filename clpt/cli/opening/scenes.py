"""Scenes, and the devices that render them: opened beside each other, as both take time."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from clpt.render.flow.check import check

from ... import device as dev
from ...device import share_compilers
from ...formats import prepare
from ...scene import Scene
from ..options.applied import changed
from ..options.scene_options import SceneOptions
from ..printing.display import Display
from ..process.allocator import reusing
from ..process.stopping import prompt
from .devices import choose_devices


@dataclass(frozen=True)
class Opened:
    """A scene and devices; loading: seconds that its file took."""

    scene: Scene
    devices: list[dev.Device]
    loading: float


def read_scene(
    file: Path,
    options: SceneOptions,
    shown: Display,
    accept: Callable[[Scene], None] | None = None,
) -> Scene:
    """Return the scene of a file, as options change it, and note its warnings.

    accept: called with the scene before it is checked. Raises SceneError, click.BadParameter.
    """
    with shown.loading(file.name) as tell:
        loaded = options.loading.read(file, tell)
        scene = changed(loaded, options.changes)
    if accept is not None:
        accept(scene)
    check(scene)
    for warning in scene.warnings:
        shown.note(f"clpt: warning: {warning}")
    if scene.film.filtering != loaded.film.filtering:
        shown.note("the pixel filter is applied by importance sampling, which denoisers need")
    return scene


def open_scene(
    file: Path,
    options: SceneOptions,
    shown: Display,
    resources: ExitStack,
    accept: Callable[[Scene], None] | None = None,
) -> Opened:
    """Return the scene of a file and the devices.

    resources: get the processes that compile beside this one; accept: see `read_scene`.
    """
    began = time.perf_counter()
    prepare(file)
    alone = ThreadPoolExecutor(max_workers=1)
    with prompt(dev.kill_compilers), reusing(), alone as beside:
        chosen = beside.submit(choose_devices, options.machine)
        scene = read_scene(file, options, shown, accept)
        loading = time.perf_counter() - began
        devices = chosen.result()
        share_compilers(devices, options.machine.threads, resources)
    return Opened(scene, devices, loading)
