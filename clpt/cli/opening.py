"""Opens scenes, devices of this machine and workers of a cluster; factories make renderers."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.render.flow.check import check

from .. import device as dev
from ..device import compilers, share_compilers
from ..errors import ClusterError
from ..formats import prepare
from ..render.progress import Progress
from ..render.renderer import Renderer
from ..render.resumable import ResumableRenderer
from ..scene import Scene
from .display import Display, device_names
from .options.applied import changed
from .options.scene_options import Machine, SceneOptions, Workers
from .process import ending
from .process.allocator import reusing
from .process.ending import prompt

if TYPE_CHECKING:
    from distributed import Client

    from ..cluster.blocks import WorkerRecord
    from ..cluster.cluster_renderer import ClusterRenderer


def choose_devices(machine: Machine) -> list[dev.Device]:
    """Open what --device names. Raises DeviceError."""
    which, profiling, threads = machine.device, machine.profiling, machine.threads
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]


@contextmanager
def ending_at_limit() -> Iterator[None]:
    """End the process with an error if a driver's compiler hangs in it: nothing else would."""

    def end(said: str) -> None:
        dev.kill_compilers()
        ending.complain(said)
        os._exit(ending.BAD_INPUT)

    before, compilers.at_limit = compilers.at_limit, end
    try:
        yield
    finally:
        compilers.at_limit = before


def read_scene(file: Path, options: SceneOptions, shown: Display) -> Scene:
    """Return the scene of a file, changed by options, and note its warnings.

    Raises SceneError, click.BadParameter.
    """
    with shown.loading(file.name) as tell:
        loaded = options.loading.read(file, tell)
        scene = changed(loaded, options.changes)
    check(scene)
    for warning in scene.warnings:
        shown.note(f"clpt: warning: {warning}")
    if scene.film.filtering != loaded.film.filtering:
        shown.note("the pixel filter is applied by importance sampling, which denoisers need")
    return scene


def open_scene(
    file: Path, options: SceneOptions, shown: Display, resources: ExitStack
) -> tuple[Scene, list[dev.Device], float]:
    """Return the scene of a file, the devices, and the seconds that the file took.

    resources: get the processes that compile for this process.
    """
    began = time.perf_counter()
    prepare(file)
    alone = ThreadPoolExecutor(max_workers=1)
    with prompt(dev.kill_compilers), reusing(), alone as beside:
        chosen = beside.submit(choose_devices, options.machine)
        scene = read_scene(file, options, shown)
        loading = time.perf_counter() - began
        devices = chosen.result()
        share_compilers(devices, options.machine.threads, resources)
    return scene, devices, loading


MOST_LISTED = 16  # workers that have lines in a report
OVERLAP = 2  # pictures of a cluster at a time: workers begin a picture while another ends
DEVICE_SECONDS = 3.0  # of a pass: at its end few paths are left; only there is there a checkpoint
CLUSTER_SECONDS = 30.0  # of a pass with noise; at its end workers wait for each other


class RendererFactory:
    """Makes renderers, picture after picture.

    name: for people; frame: the number of the frame that is rendered, infinite without.
    """

    name = ""
    frame = math.inf

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ResumableRenderer:
        """Return a new renderer of a scene, which takes samples from this number on."""
        raise NotImplementedError

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return the seconds that a pass should take, infinite for a single pass.

        adaptive: whether pixels end by their noise; periods: how often something is written.
        """
        return DEVICE_SECONDS

    def look(self, progress: Progress) -> None:
        """Note events while a picture is rendered."""

    def report(self) -> None:
        """Note the work of each machine."""

    def stop(self) -> None:
        """End other processes that would delay the end of this process, after a signal."""


class DeviceFactory(RendererFactory):
    """Makes renderers on devices of this machine; renderer: the last of them."""

    renderer: ResumableRenderer

    def __init__(self, devices: list[dev.Device], options: SceneOptions):
        self.devices = devices
        self.name = " and ".join(on.info.label for on in devices)
        self._made = options.renderer_options

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ResumableRenderer:
        """Return a new renderer of a scene; note its warnings."""
        text = f"compiling for {device_names([on.info for on in self.devices])}"
        compiling = shown.compiling(text)
        with prompt(dev.kill_compilers), ending_at_limit(), reusing(), compiling as programs:
            for on in self.devices:
                on.builds.on_compile, on.builds.on_compiled = programs.begin, programs.end
            renderer = new_renderer(scene, self.devices, first_sample=first_sample, **self._made)
        for warning in renderer.warnings:
            shown.note(f"clpt: warning: {warning}")
        self.renderer = renderer
        return renderer

    def stop(self) -> None:
        """End the processes that compile."""
        dev.kill_compilers()


class ClusterFactory(RendererFactory):
    """Makes renderers on the workers of a cluster, where lower numbers of pictures come first.

    others: all factories of this cluster, itself among them; settings: options of its renderer.
    """

    watch: Watch

    def __init__(
        self, name: str, client: Client, others: list[ClusterFactory], settings: Mapping[str, Any]
    ):
        self.name, self._client, self._others, self._made = name, client, others, settings
        self.renderer: ClusterRenderer | None = None

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ClusterRenderer:
        """Return a new renderer of a scene, whose warnings the watch notes."""
        from ..cluster.cluster_renderer import ClusterRenderer

        others = [
            factory.renderer for factory in self._others if factory.renderer and factory is not self
        ]
        self.renderer = ClusterRenderer(
            scene, self._client, beside=others[0] if others else None, first_sample=first_sample,
            **self._made,
        )  # fmt: skip
        self.renderer.farm.priority = self._priority
        return self.renderer

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return the seconds of a pass: without adaptive sampling there is a single pass."""
        wanted = [seconds for seconds in periods if seconds]
        return min([CLUSTER_SECONDS, *wanted]) if adaptive else math.inf

    def look(self, progress: Progress) -> None:
        """Note workers that come and go."""
        self.watch.look()

    def report(self) -> None:
        """Note the work of each worker."""
        self.watch.report()

    def _priority(self) -> float:
        """The priority of blocks of this frame: earlier frames come first."""
        return -self.frame


def new_renderer(scene: Scene, devices: list[dev.Device], **settings: Any) -> ResumableRenderer:
    """Return a renderer on a single device, or on several."""
    if len(devices) > 1:
        from ..cluster.multi_renderer import MultiRenderer

        return MultiRenderer(scene, devices, **settings)
    return Renderer(scene, devices[0], **settings)


def device_factories(
    devices: list[dev.Device], options: SceneOptions, pictures: int
) -> list[DeviceFactory]:
    """Return a factory for each device, or a common factory where there are fewer pictures."""
    if pictures < len(devices):
        return [DeviceFactory(devices, options)]
    return [DeviceFactory([device], options) for device in devices]  # with nothing to add up


@contextmanager
def cluster_factories(
    workers: Workers, options: SceneOptions, pictures: int, shown: Display
) -> Iterator[list[ClusterFactory]]:
    """Yield factories of the workers at an address; pictures: that may be rendered at a time."""
    device = options.machine.device
    several = workers.number is None or dev.names_several(device)
    # Pictures are made on a single device.
    settings = options.renderer_options | {"device": None if several else device}
    settings = {name: value for name, value in settings.items() if value is not None}
    with connected(workers, options.machine, shown) as client:
        factories: list[ClusterFactory] = []
        for _ in range(min(pictures, OVERLAP)):
            factories.append(ClusterFactory(workers.cluster or "", client, factories, settings))
        watch = Watch(factories, shown)
        for factory in factories:
            factory.watch = watch
        yield factories


@contextmanager
def connected(workers: Workers, machine: Machine, shown: Display) -> Iterator[Client]:
    """Yield a client of the scheduler at an address, or of a scheduler on this machine.

    machine: for workers on this machine. Raises ClusterError.
    """
    from ..cluster import processes  # here: a single device has no use for them

    if workers.number is not None:
        device, threads = machine.device, machine.threads
        with processes.local_cluster(workers.number, device=device, threads=threads) as (client, _):
            yield client
        return
    processes.configure()
    from distributed import Client

    security = processes.security(workers.keys)
    with shown.phase(f"connecting to {workers.cluster}"):
        try:
            client = Client(workers.cluster, security=security, timeout=10)
        except OSError as error:
            message = f"there is no scheduler at {workers.cluster}: {error}"
            raise ClusterError(message) from None
    with client:
        yield client


class Watch:
    """Notes workers that come, go, or are refused; factories: all factories of a cluster."""

    def __init__(self, factories: list[ClusterFactory], shown: Display):
        self._factories, self._shown = factories, shown
        self._known: set[str] = set()
        self._refused: set[str] = set()
        self._warned: set[str] = set()
        self._lock = threading.Lock()

    @property
    def _renderers(self) -> list[ClusterRenderer]:
        return [factory.renderer for factory in self._factories if factory.renderer]

    def look(self) -> None:
        """Note changes since the last look."""
        with self._lock:
            renderers = self._renderers
            refused = {
                name: why for renderer in renderers for name, why in renderer.refused.items()
            }
            workers = {name for renderer in renderers for name in renderer.workers} - refused.keys()
            for name in sorted(refused.keys() - self._refused):
                self._shown.note(f"clpt: warning: {name} is refused: {refused[name]}")
            for name in sorted(self._known - workers - refused.keys()):
                self._shown.note(f"clpt: warning: {name} is gone; others render its samples")
            for name in sorted(workers - self._known):
                self._shown.note(f"{name} renders")
            for warning in (text for renderer in renderers for text in renderer.warnings):
                if warning not in self._warned:
                    self._shown.note(f"clpt: warning: {warning}")
                self._warned.add(warning)
            self._known, self._refused = workers, set(refused)

    def report(self) -> None:
        """Note what each worker has done."""
        renderers = self._renderers
        records: dict[str, list[WorkerRecord]] = {}
        for name, record in (pair for renderer in renderers for pair in renderer.workers.items()):
            records.setdefault(name, []).append(record)
        for name, of_worker in sorted(records.items())[:MOST_LISTED]:
            samples = sum(record.samples for record in of_worker)
            blocks = sum(record.blocks for record in of_worker)
            failed = sum(record.failures for record in of_worker)
            self._shown.note(
                f"{name}  {samples:.5g} spp in {blocks} blocks, {of_worker[-1].rate:.3g} spp/s, "
                f"{failed} failures"
            )
        lost = max((renderer.lost for renderer in renderers), default=0)
        self._shown.note(f"{len(records)} workers, {lost} lost")
