"""Opens scenes, devices of this machine and workers of a cluster; factories make renderers."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.render.flow.check import check

from .. import device as dev
from ..device import compile_limits, share_compilers
from ..errors import ClusterError
from ..render.pictures import DevicePictures
from ..render.progress import Progress
from ..render.renderer import Renderer
from ..scene import Scene
from .display import Display, device_names
from .options.applied import changed
from .options.scene_options import Machine, SceneOptions, Workers
from .process import failures
from .process.allocator import reusing
from .process.stopping import prompt

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
        failures.complain(said)
        os._exit(failures.BAD_INPUT)

    before, compile_limits.at_limit = compile_limits.at_limit, end
    try:
        yield
    finally:
        compile_limits.at_limit = before


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
    alone = ThreadPoolExecutor(max_workers=1)
    with prompt(dev.kill_compilers), reusing(), alone as beside:
        chosen = beside.submit(choose_devices, options.machine)
        scene = read_scene(file, options, shown, accept)
        loading = time.perf_counter() - began
        devices = chosen.result()
        share_compilers(devices, options.machine.threads, resources)
    return Opened(scene, devices, loading)


MOST_LISTED = 16  # workers that a report has a line for
OVERLAP = 2  # pictures of a cluster at a time: workers begin the next one while the last one ends
DEVICE_SECONDS = 3.0  # of a pass: at its end few paths are left; only there is there a checkpoint
CLUSTER_SECONDS = 30.0  # of a pass with noise, at the end of which workers wait for each other


class RendererFactory:
    """Makes the renderer of one picture after the other.

    name: for people; frame: the number of the frame that is rendered, infinite without.
    """

    name = ""
    frame = math.inf

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> DevicePictures:
        """Return a new renderer of a scene, which takes samples from this number on."""
        raise NotImplementedError

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return how long a pass should take, infinite for a single one.

        adaptive: whether pixels end by their noise; periods: how often something is written.
        """
        return DEVICE_SECONDS

    def look(self, progress: Progress) -> None:
        """Note what there is to say while a picture is rendered."""

    def report(self) -> None:
        """Note what each machine has done."""

    def stop(self) -> None:
        """End what would delay the end of the process, after a signal."""


class DeviceFactory(RendererFactory):
    """Makes renderers on devices of this machine; renderer: the last one that was made."""

    renderer: DevicePictures

    def __init__(self, devices: list[dev.Device], options: SceneOptions):
        self.devices = devices
        self.name = " and ".join(on.info.label for on in devices)
        self._made = options.made

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> DevicePictures:
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

    others: all factories of this cluster, itself among them; made: options of its renderer.
    """

    watch: Watch

    def __init__(
        self, name: str, client: Client, others: list[ClusterFactory], made: Mapping[str, Any]
    ):
        self.name, self._client, self._others, self._made = name, client, others, made
        self.renderer: ClusterRenderer | None = None

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ClusterRenderer:
        """Return a new renderer of a scene, whose warnings the watch notes."""
        from ..cluster.cluster_renderer import ClusterRenderer

        others = [one.renderer for one in self._others if one.renderer and one is not self]
        self.renderer = ClusterRenderer(
            scene, self._client, beside=others[0] if others else None, first_sample=first_sample,
            **self._made,
        )  # fmt: skip
        self.renderer.farm.priority = self._priority
        return self.renderer

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return how long a pass should take: without adaptive sampling there is one alone."""
        wanted = [seconds for seconds in periods if seconds]
        return min([CLUSTER_SECONDS, *wanted]) if adaptive else math.inf

    def look(self, progress: Progress) -> None:
        """Note workers that come and go."""
        self.watch.look()

    def report(self) -> None:
        """Note what each worker has done."""
        self.watch.report()

    def _priority(self) -> float:
        """That of this frame's blocks among those of the others: earlier frames come first."""
        return -self.frame


def new_renderer(scene: Scene, devices: list[dev.Device], **made: Any) -> DevicePictures:
    """Return a renderer on one device, or on several."""
    if len(devices) > 1:
        from ..cluster.multi_renderer import MultiRenderer

        return MultiRenderer(scene, devices, **made)
    return Renderer(scene, devices[0], **made)


def device_factories(
    devices: list[dev.Device], options: SceneOptions, pictures: int
) -> list[DeviceFactory]:
    """Return a factory for each device, or one of all where there are fewer pictures."""
    if pictures < len(devices):
        return [DeviceFactory(devices, options)]
    return [DeviceFactory([one], options) for one in devices]  # with nothing to add up


@contextmanager
def cluster_factories(
    workers: Workers, options: SceneOptions, pictures: int, shown: Display
) -> Iterator[list[ClusterFactory]]:
    """Yield factories of the workers at an address; pictures: that may be rendered at a time."""
    device = options.machine.device
    several = workers.number is None or dev.names_several(device)
    made = options.made | {"device": None if several else device}  # one alone makes the pictures
    made = {name: value for name, value in made.items() if value is not None}
    with connected(workers, options.machine, shown) as client:
        factories: list[ClusterFactory] = []
        for _ in range(min(pictures, OVERLAP)):
            factories.append(ClusterFactory(workers.cluster or "", client, factories, made))
        watch = Watch(lambda: [one.renderer for one in factories if one.renderer], shown)
        for factory in factories:
            factory.watch = watch
        yield factories


@contextmanager
def connected(workers: Workers, machine: Machine, shown: Display) -> Iterator[Client]:
    """Yield a client of the scheduler at an address, or of one with workers of our own.

    machine: what our own workers render with. Raises ClusterError.
    """
    from ..cluster import keys, processes  # here: one device has no use for them

    if workers.number is not None:
        device, threads = machine.device, machine.threads
        with processes.local_cluster(workers.number, device=device, threads=threads) as (client, _):
            yield client
        return
    processes.configure()
    from distributed import Client

    security = keys.security(workers.keys)
    with shown.phase(f"connecting to {workers.cluster}"):
        try:
            client = Client(workers.cluster, security=security, timeout=10)
        except OSError as error:
            message = f"there is no scheduler at {workers.cluster}: {error}"
            raise ClusterError(message) from None
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
